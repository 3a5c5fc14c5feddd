//! One set of real processes with GPIO paths, started and ended by the job.
//!
//! `safepair run` starts a simulated drive with every set; here the drive is the machine behind
//! the lines, so the job is the supervisor: the same options, the same pipes, the same domain.

use std::fs;
use std::io::{self, PipeReader, PipeWriter, Read};
use std::os::fd::OwnedFd;
use std::process::{Child, Command};
use std::thread;
use std::time::Duration;

use command_fds::{CommandFdExt, FdMapping};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use producers::clock::{now_ns, sleep_until};
use shm_schema::report::Phase;
use sim::shm::{Domain, Place};

use crate::chip::{AIE, AIS, Chip, PAIR_1, PATH_A, PATH_B};
use crate::machine::{CYCLE_NS, Machine};

const FOLDER: &str = "/run/rig";
const SUPERVISOR_FD: i32 = 11;
const READY_FD: i32 = 12;
/// Wake-up of channel A inside the cycle, ns.
pub const PHASE_A_NS: u64 = CYCLE_NS / 4;
/// SCHED_FIFO priority of the monitors.
pub const PRIORITY: i32 = 80;
/// A terminal acknowledges with a pulse of 0.3 to 10 s (LNZ-ACK-01).
const PULSE: Duration = Duration::from_millis(350);

/// A process of the set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The terminals.
    Terminals,
    /// Channel A.
    A,
    /// Channel B.
    B,
    /// Crosscheck.
    Crosscheck,
}

impl Role {
    const ALL: [Self; 4] = [Self::Terminals, Self::A, Self::B, Self::Crosscheck];

    const fn program(self) -> &'static str {
        match self {
            Self::Terminals => "/safepair/safepair-gpio-producer",
            Self::A => "/safepair/safepair-channel-a",
            Self::B => "/safepair/safepair-channel-b",
            Self::Crosscheck => "/safepair/safepair-crosscheck",
        }
    }
}

/// A running set and its machine.
#[derive(Debug)]
pub struct Set {
    children: Vec<(Role, Child)>,
    // Open as long as the set shall live.
    alive: Vec<PipeWriter>,
    /// The machine behind the lines.
    pub machine: Option<Machine>,
    domain: Option<Domain>,
    place: Place,
    chip: Chip,
}

impl Set {
    /// Everything, up to the first cycle of each process. Both lines of the emergency stop are
    /// closed, no acknowledge stands.
    pub fn start(chip: &Chip) -> Result<Self, String> {
        for line in PAIR_1 {
            chip.pull(line, true)?;
        }
        for line in [AIE, AIS, PATH_A, PATH_B] {
            chip.pull(line, false)?;
        }
        let text = fs::read_to_string("/safepair/axis.toml").map_err(|error| error.to_string())?;
        let set = params::parse(&text, "axis.toml")
            .map_err(|all| all.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
        let axis = set.axes.first().ok_or("no axis")?;
        let images = format!("{FOLDER}/images");
        fs::create_dir_all(&images).map_err(|error| error.to_string())?;
        for (channel, image) in [("a", axis.image_a(true)), ("b", axis.image_b(true))] {
            let file = format!("{images}/axis-01.{channel}.img");
            fs::write(&file, image).map_err(|error| format!("{file}: {error}"))?;
        }
        let nonce = (now_ns() as u32).max(1);
        let place = Place::new(format!("{FOLDER}/domain"), "rig_set_", nonce);
        let domain = Domain::create(&place, &[1]).map_err(|error| error.to_string())?;
        let machine = Machine::start(&domain, chip)?;
        let mut started = Self {
            children: Vec::new(),
            alive: Vec::new(),
            machine: Some(machine),
            domain: Some(domain),
            place,
            chip: chip.clone(),
        };
        for role in Role::ALL {
            started.spawn(role)?;
            raise_interrupts();
        }
        Ok(started)
    }

    fn spawn(&mut self, role: Role) -> Result<(), String> {
        let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", role.program());
        let (mut ready, report) = io::pipe().map_err(|error| failed(&error))?;
        let (watched, alive) = io::pipe().map_err(|error| failed(&error))?;
        let handed: [(OwnedFd, i32); 2] = [(watched.into(), SUPERVISOR_FD), (report.into(), READY_FD)];
        let handed = handed.into_iter().map(|(parent_fd, child_fd)| FdMapping { parent_fd, child_fd });
        let mut command = Command::new(role.program());
        command.args(self.options(role)).fd_mappings(handed.collect()).map_err(|error| failed(&error))?;
        self.children.push((role, command.spawn().map_err(|error| failed(&error))?));
        self.alive.push(alive);
        // The child's ends are closed here with the command.
        drop(command);
        said_ready(&mut ready).then_some(()).ok_or_else(|| failed(&"not ready"))
    }

    fn options(&self, role: Role) -> Vec<String> {
        let (phase_us, priority) = match role {
            Role::Terminals => (60, PRIORITY + 4),
            Role::A => (PHASE_A_NS / 1_000, PRIORITY),
            Role::B => (500, PRIORITY),
            Role::Crosscheck => (750, PRIORITY),
        };
        let common = format!(
            "--domain {} --prefix {} --nonce {} --cycle-us {} --phase-us {phase_us} --priority {priority} \
             --supervisor-fd {SUPERVISOR_FD} --ready-fd {READY_FD}",
            self.place.root().display(),
            self.place.prefix(),
            self.place.nonce(),
            CYCLE_NS / 1_000,
        );
        let device = self.chip.device();
        let own = match role {
            Role::Terminals => format!(
                " --axis 1 --chip {device} --line se1.1={} --line se1.2={} --line aie={AIE} --line ais={AIS} \
                 --line sa1.1=8 --line sa1.2=9 --line sa2.1=10 --line sa2.2=11 --line sdyn1=12 --line sdyn2=13",
                PAIR_1[0], PAIR_1[1]
            ),
            Role::Crosscheck => format!(" --axes 1 --images {FOLDER}/images"),
            Role::A | Role::B => {
                let line = if role == Role::A { PATH_A } else { PATH_B };
                format!(
                    " --axes 1 --images {FOLDER}/images --inhibit gpio:{device}:{line} --evaluator the-rig-drops-it-after-three-missing-edges"
                )
            }
        };
        common.split_whitespace().chain(own.split_whitespace()).map(ToOwned::to_owned).collect()
    }

    /// What the machine has seen.
    pub fn seen<T>(&self, look: impl FnOnce(&mut crate::machine::Seen) -> T) -> Option<T> {
        self.machine.as_ref().map(|machine| look(&mut machine.seen()))
    }

    /// Waits until `condition` holds, at most `limit`.
    pub fn until(&self, limit: Duration, condition: impl Fn(&crate::machine::Seen) -> bool) -> bool {
        let end_ns = now_ns() + limit.as_nanos() as u64;
        loop {
            if self.seen(|seen| condition(seen)) == Some(true) {
                return true;
            }
            if now_ns() > end_ns {
                return false;
            }
            thread::sleep(Duration::from_millis(2));
        }
    }

    /// Both channels wait for the first acknowledge.
    pub fn awaits_acknowledge(&self) -> bool {
        let waits = |seen: &crate::machine::Seen| {
            seen.reports.iter().all(|report| report.is_some_and(|r| r.phase == Phase::AwaitAcknowledge))
        };
        self.until(Duration::from_secs(5), waits)
    }

    /// One pulse at an acknowledge terminal; its falling edge counts.
    pub fn acknowledge(&self, terminal: u32) -> Result<(), String> {
        self.chip.pull(terminal, true)?;
        thread::sleep(PULSE);
        self.chip.pull(terminal, false)
    }

    /// From the start to torque; says what is in the way.
    pub fn energise(&self) -> Result<(), String> {
        if !self.awaits_acknowledge() {
            return Err(format!("no channel waits for an acknowledge: {}", self.state()));
        }
        self.acknowledge(AIE)?;
        if self.until(Duration::from_secs(2), |seen| seen.torque) {
            thread::sleep(Duration::from_millis(50));
            return Ok(());
        }
        Err(format!("no torque after the acknowledge: {}", self.state()))
    }

    /// What the cells say, for a person.
    pub fn state(&self) -> String {
        let words = |seen: &mut crate::machine::Seen| {
            let report = |report: &Option<shm_schema::report::Report>| {
                report.map_or("no report".to_owned(), |r| {
                    let codes: Vec<_> =
                        r.errors.iter().map(|e| [e.code, e.info1, e.info2, e.info3]).collect();
                    format!("{:?} {:?} ready {} driving {} {codes:?}", r.phase, r.stop, r.ready, r.driving)
                })
            };
            let agreement = seen.agreement.map_or("no agreement".to_owned(), |a| {
                let codes: Vec<_> = a.errors.iter().map(|e| [e.code, e.info1, e.info2, e.info3]).collect();
                format!("permit {} error {} {:?} {codes:?}", a.permit, a.error, a.path_test)
            });
            let edges = seen.edges.each_ref().map(Vec::len);
            format!(
                "A: {} | B: {} | {agreement} | edges {edges:?}",
                report(&seen.reports[0]),
                report(&seen.reports[1])
            )
        };
        self.seen(words).unwrap_or_default()
    }

    /// Sends a signal to a process; the time just before, ns.
    pub fn send(&self, role: Role, signal: Signal) -> u64 {
        crate::promptly(|| {
            // Not at the instant at which the judge woke by chance: late in a cycle, before the
            // next one begins.
            let now = now_ns();
            sleep_until(now - now % CYCLE_NS + 2 * CYCLE_NS + CYCLE_NS / 8 * 7);
            let at_ns = now_ns();
            for (_, child) in self.children.iter().filter(|(known, _)| *known == role) {
                let _ = kill(Pid::from_raw(child.id() as i32), signal);
            }
            at_ns
        })
    }
}

impl Drop for Set {
    fn drop(&mut self) {
        for (_, child) in &mut self.children {
            let _ = child.kill();
            let _ = child.wait();
        }
        self.machine = None;
        self.domain = None;
        let _ = self.place.wipe();
    }
}

/// The threads of interrupts above the set, as on a machine whose safe inputs are GPIO lines:
/// while such a thread waits its interrupt is masked, and gpio-sim loses the next edge.
fn raise_interrupts() {
    let parameter = libc::sched_param { sched_priority: 90 };
    for entry in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let Some(pid) = entry.file_name().to_string_lossy().parse::<libc::pid_t>().ok() else { continue };
        let name = fs::read_to_string(entry.path().join("comm")).unwrap_or_default();
        if name.starts_with("irq") {
            // SAFETY: the parameter lives over the call.
            let result = unsafe { libc::sched_setscheduler(pid, libc::SCHED_FIFO, &raw const parameter) };
            if result != 0 {
                crate::Verdict::note(format!("{}: keeps its priority", name.trim()));
            }
        }
    }
}

fn said_ready(ready: &mut PipeReader) -> bool {
    let mut octet = [0];
    ready.read(&mut octet).is_ok_and(|length| length == 1) && octet == *b"R"
}
