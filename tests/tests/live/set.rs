//! One `safepair run` in a run folder of its own.

use std::fs::{self, File};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use nix::unistd::Uid;
use shm_schema::exchange::RELAXED_AGE_FACTOR;
use shm_schema::wire::{DIGEST_START, digest};
use sim::shm::Place;

use crate::axis::Axis;
use crate::processes;
use crate::programs::safepair;

/// Cycle of the relaxed timing: hosts of tests stall for milliseconds.
pub const CYCLE: Duration = Duration::from_millis(4);
/// Factor of the relaxed timing on ages, partner time-outs and the dead-man.
pub const AGES: u32 = RELAXED_AGE_FACTOR as u32;
/// Longest wait for a start or an end.
pub const DEADLINE: Duration = Duration::from_secs(8);

/// Longest wait for torque or speed.
const PATIENCE: Duration = Duration::from_secs(3);
const POLL: Duration = Duration::from_millis(1);
const PROGRAMS: [&str; 4] =
    ["safepair-sim", "safepair-channel-a", "safepair-channel-b", "safepair-crosscheck"];

static ALONE: Mutex<()> = Mutex::new(());

/// Two sets at a time would take each other's cores: the tests take turns.
pub fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits until `condition` holds, at most `DEADLINE`.
pub fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < DEADLINE, "{what} did not come within {} s", DEADLINE.as_secs());
        thread::sleep(POLL);
    }
}

/// A run folder below the temporary one, removed at the end.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// A new one for the test `name`.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("safepair-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a folder for the test");
        Self(path)
    }

    /// The run folder.
    pub fn run(&self) -> PathBuf {
        self.0.join("run")
    }

    /// A file of the test's own.
    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// What the supervisor and its processes said.
    pub fn said(&self) -> String {
        fs::read_to_string(self.0.join("said")).unwrap_or_default()
    }

    /// Where the shared memory of this folder's sets is; the nonce matters to writers only.
    pub fn place(&self) -> Place {
        let prefix = format!("safepair_{:08x}_", digest(DIGEST_START, &self.run().to_string_lossy()));
        Place::new(self.run().join("domain"), prefix, 1)
    }

    /// The supervisor, not waited for.
    pub fn launch(&self) -> Supervisor {
        self.launch_as(self.command())
    }

    /// The supervisor as `command` starts it, not waited for.
    pub fn launch_as(&self, mut command: Command) -> Supervisor {
        let said = File::create(self.0.join("said")).expect("a file for the output");
        command.stdout(said.try_clone().expect("a descriptor")).stderr(said);
        Supervisor { child: command.spawn().expect("safepair starts"), folder: self.run() }
    }

    /// `safepair run` with the usual options.
    pub fn command(&self) -> Command {
        let mut command = Command::new(safepair());
        command.arg("run").arg("--params").arg(axis_file()).arg("--run-dir").arg(self.run());
        command.args(["--timing", "relaxed"]);
        if !Uid::effective().is_root() {
            command.args(["--priority", "0"]);
        }
        command
    }

    /// A set that has reached its cycle, with eyes on it.
    pub fn start(&self) -> Running<'_> {
        self.running(self.launch())
    }

    /// Waits until `supervisor` has its set in the cycle, and opens eyes on it.
    pub fn running(&self, mut supervisor: Supervisor) -> Running<'_> {
        until(&format!("the start in {}", self.run().display()), || {
            let ended = supervisor.child.try_wait().expect("our child");
            assert!(ended.is_none(), "the start ended with {ended:?}:\n{}", self.said());
            self.said().contains("running:")
        });
        let axis = Axis::open(&self.place());
        Running { axis, supervisor, folder: self }
    }

    /// A set whose axis has torque and turns with `rpm`.
    pub fn energised(&self, rpm: u32) -> Running<'_> {
        let mut running = self.start();
        let turns = running.energise(rpm);
        assert!(turns, "no torque at {rpm} rpm:\n{}\n{}", running.axis.in_words(), self.said());
        running
    }

    /// What is left of a set that has ended, beside the lock that every start uses.
    pub fn remains(&self) -> Vec<PathBuf> {
        let place = self.place();
        let mut found = files(&self.run());
        found.retain(|path| !path.ends_with("lock"));
        let shared = fs::read_dir("/dev/shm").expect("shared memory").flatten();
        let ours = shared.filter(|entry| entry.file_name().to_string_lossy().starts_with(place.prefix()));
        found.extend(ours.map(|entry| entry.path()));
        found
    }

    /// Waits until nobody of any set in this folder lives.
    pub fn until_deserted(&self) {
        until("the end of every process of the set", || processes::of(&self.run()).is_empty());
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        processes::of(&self.run()).into_iter().for_each(|pid| processes::send(pid, Signal::SIGKILL));
        // What a failed test left; no set of this folder lives.
        let _ = self.place().wipe();
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The parameter set of the tests.
pub fn axis_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/live/axis.toml")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found
}

/// The process of `safepair run`; killed when it is no longer looked after.
#[derive(Debug)]
pub struct Supervisor {
    child: Child,
    folder: PathBuf,
}

impl Supervisor {
    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits for its end.
    pub fn end(&mut self) -> ExitStatus {
        let mut status = None;
        until("the end of the supervisor", || {
            status = self.child.try_wait().expect("our child");
            status.is_some()
        });
        status.expect("ended")
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        processes::of(&self.folder).into_iter().for_each(|pid| processes::send(pid, Signal::SIGKILL));
    }
}

/// A process of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Simulated drive and master.
    Sim,
    /// Channel A.
    ChannelA,
    /// Channel B.
    ChannelB,
    /// Crosscheck.
    Crosscheck,
    /// `safepair run` itself.
    Supervisor,
}

impl Role {
    /// Everybody.
    pub const ALL: [Self; 5] =
        [Self::Sim, Self::ChannelA, Self::ChannelB, Self::Crosscheck, Self::Supervisor];

    /// Its program, `None` for the supervisor.
    pub fn program(self) -> Option<&'static str> {
        PROGRAMS.get(self as usize).copied()
    }
}

/// A set in its cycle.
#[derive(Debug)]
pub struct Running<'a> {
    /// What its cells say.
    pub axis: Axis,
    /// The supervisor.
    pub supervisor: Supervisor,
    folder: &'a Folder,
}

impl Running<'_> {
    /// Process id of `role`.
    pub fn process(&self, role: Role) -> u32 {
        let Some(program) = role.program() else { return self.supervisor.id() };
        processes::running(&self.folder.run(), program).expect("a process of every role")
    }

    /// Tells the simulated master of axis 1 something (`sim::control`).
    pub fn tell(&self, instruction: &str) {
        let socket = UnixDatagram::unbound().expect("a socket");
        let path = self.folder.run().join("domain/master.sock");
        socket.send_to(instruction.as_bytes(), path).expect("the master listens");
    }

    /// Acknowledges the start and turns with `rpm`; whether torque and speed came.
    pub fn energise(&mut self, rpm: u32) -> bool {
        if !self.axis.comes(PATIENCE, Axis::awaits_acknowledge) {
            return false;
        }
        self.tell(r#"{"acknowledge": true}"#);
        if !self.axis.comes(PATIENCE, Axis::torque) {
            return false;
        }
        self.tell(&format!(r#"{{"set_point_rpm": {rpm}}}"#));
        let least = i32::try_from(rpm).expect("a speed") * 900 - 1;
        self.axis.comes(PATIENCE, |axis| axis.torque() & (axis.speed_mrpm() > least))
    }

    /// Asks the supervisor to end the set: it must, with success, and leave nothing.
    pub fn stop(mut self) {
        processes::send(self.supervisor.id(), Signal::SIGTERM);
        let status = self.supervisor.end();
        assert!(status.success(), "asked to end, it ended with {status}:\n{}", self.folder.said());
        self.folder.until_deserted();
        assert_eq!(self.folder.remains(), Vec::<PathBuf>::new());
    }
}
