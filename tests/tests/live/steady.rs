//! What a running process costs, and what it asks of the kernel (design 3.6, 11).

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use nix::sys::signal::Signal;

use crate::host::judged;
use crate::processes;
use crate::set::{Folder, Role, Running, alone, until};

const MONITORS: [Role; 3] = [Role::ChannelA, Role::ChannelB, Role::Crosscheck];
/// How long the kernel is asked.
const WATCHED: Duration = Duration::from_secs(2);
/// Most memory of one monitor, KiB.
const RESIDENT_KIB: u64 = 16 * 1_024;
/// Lines of a trace that are judged: more than a second of cycles is not needed.
const CALLS: usize = 100;

#[test]
fn a_running_monitor_has_no_page_faults_and_stays_small() {
    let _turn = alone();
    judged("page faults", || {
        let folder = Folder::new("steady");
        let running = folder.energised(0);
        let monitors = MONITORS.map(|role| (role, running.process(role)));
        let before = monitors.map(|(_, pid)| processes::faults(pid));
        // The length is what is measured over.
        thread::sleep(WATCHED);
        for ((role, pid), before) in monitors.into_iter().zip(before) {
            let faults = processes::faults(pid);
            if processes::is_locked(pid) {
                assert_eq!(faults, before, "{role:?}: minor and major page faults in {WATCHED:?}");
            } else {
                println!("skipped for {role:?}: no right to lock memory, page faults {before:?}, {faults:?}");
            }
            let kib = processes::resident_kib(pid);
            assert!(kib < RESIDENT_KIB, "{role:?}: {kib} KiB resident");
        }
        running.stop();
    });
}

#[test]
fn the_cycle_of_a_monitor_calls_nothing_but_the_sleep() {
    let _turn = alone();
    judged("system calls", || {
        let folder = Folder::new("calls");
        let running = folder.energised(0);
        for role in MONITORS {
            let Some(calls) = traced(&folder, &running, role) else {
                println!("skipped: strace is not installed or not permitted");
                break;
            };
            let other: Vec<_> = calls.iter().filter(|call| !call.starts_with("clock_nanosleep(")).collect();
            assert!(other.is_empty(), "{role:?}: in the cycle {other:?}");
        }
        running.stop();
    });
}

/// Design 3.6: whatever is linked into a monitor, its cycle takes nothing from the heap.
#[test]
fn the_cycle_of_a_monitor_allocates_and_frees_nothing() {
    let _turn = alone();
    judged("allocations", || {
        let folder = Folder::new("heap");
        let counter = folder.file("allocations.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/live/allocations.c");
        let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
        let mut compile = Command::new(compiler);
        compile.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&counter).arg(source);
        if !compile.status().is_ok_and(|status| status.success()) {
            println!("skipped: no C compiler");
            return;
        }
        let counts = folder.file("counts");
        fs::create_dir_all(&counts).expect("a folder");
        let mut command = folder.command();
        command.env("LD_PRELOAD", &counter).env("SAFEPAIR_ALLOCATIONS", &counts);
        let mut running = folder.running(folder.launch_as(command));
        assert!(running.energise(0), "no torque:\n{}", folder.said());
        let counted = |role| {
            let file = counts.join(running.process(role).to_string());
            let octets = fs::read(file).expect("a count");
            u64::from_ne_bytes(octets.try_into().expect("eight octets"))
        };
        let before = MONITORS.map(counted);
        assert!(before.iter().all(|count| *count > 0), "the start allocates: {before:?}");
        // The length is what is measured over.
        thread::sleep(WATCHED);
        assert_eq!(MONITORS.map(counted), before, "allocations of {MONITORS:?} in {WATCHED:?}");
        running.stop();
    });
}

/// The system calls of the thread that runs the cycle, which is the first of its process.
fn traced(folder: &Folder, running: &Running<'_>, role: Role) -> Option<Vec<String>> {
    let file = folder.run().join("trace");
    let pid = running.process(role).to_string();
    let mut strace = Command::new("strace");
    strace.args(["-qq", "-o"]).arg(&file).args(["-p", &pid]).stderr(Stdio::null());
    let mut child = strace.spawn().ok()?;
    let read = || fs::read_to_string(&file).unwrap_or_default();
    until("a trace, or the refusal of one", || {
        let refused = child.try_wait().expect("our child").is_some();
        thread::sleep(Duration::from_millis(20));
        refused || read().lines().count() >= CALLS
    });
    processes::send(child.id(), Signal::SIGINT);
    let _ = child.wait();
    let text = read();
    let _ = fs::remove_file(&file);
    // The first line may be the call that the attaching interrupted, the last is cut off.
    let lines: Vec<String> = text.lines().map(ToOwned::to_owned).collect();
    (lines.len() >= CALLS).then(|| lines[1..CALLS].to_vec())
}
