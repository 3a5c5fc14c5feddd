//! Processes as the kernel shows them.

use std::fs;
use std::path::Path;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

/// The fields of `/proc/PID/stat` behind the name; `None` when there is no such process.
fn fields(pid: u32) -> Option<Vec<String>> {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let (_, behind_name) = text.rsplit_once(')')?;
    Some(behind_name.split_whitespace().map(ToOwned::to_owned).collect())
}

/// Whether `pid` can still do anything: a zombie cannot.
pub fn lives(pid: u32) -> bool {
    fields(pid).is_some_and(|fields| !matches!(fields[0].as_str(), "Z" | "X"))
}

/// Minor and major page faults so far.
pub fn faults(pid: u32) -> (u64, u64) {
    let fields = fields(pid).expect("a living process");
    let number = |field: usize| fields[field].parse().expect("a number");
    (number(7), number(9))
}

/// Resident memory, KiB.
pub fn resident_kib(pid: u32) -> u64 {
    memory_kib(pid, "VmRSS:")
}

/// Memory is locked: the kernel permitted it to this process.
pub fn is_locked(pid: u32) -> bool {
    memory_kib(pid, "VmLck:") > 0
}

fn memory_kib(pid: u32, what: &str) -> u64 {
    let text = fs::read_to_string(format!("/proc/{pid}/status")).expect("a living process");
    let line = text.lines().find_map(|line| line.strip_prefix(what)).expect("a line of memory");
    line.trim().trim_end_matches(" kB").parse().expect("a number")
}

/// Everybody whose command line names `folder`: the supervisor and the processes of its set.
pub fn of(folder: &Path) -> Vec<u32> {
    let named = |pid: &u32| {
        let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        let words = String::from_utf8_lossy(&line).into_owned();
        words.split('\0').any(|word| Path::new(word).starts_with(folder))
    };
    let entries = fs::read_dir("/proc").expect("a mounted /proc").flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter(named).filter(|pid| lives(*pid)).collect()
}

/// The process among those of `folder` that runs `program`.
pub fn running(folder: &Path, program: &str) -> Option<u32> {
    let runs = |pid: &u32| {
        let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        let words = String::from_utf8_lossy(&line).into_owned();
        words.split('\0').next().is_some_and(|first| Path::new(first).ends_with(program))
    };
    of(folder).into_iter().find(runs)
}

/// Sends a signal; whoever is gone needs none.
pub fn send(pid: u32, signal: Signal) {
    let _ = kill(Pid::from_raw(pid as i32), signal);
}
