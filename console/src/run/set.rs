//! The processes of one set: started together, ended together.

use std::{
    fmt,
    fs::{self, File},
    io::{self, PipeReader, PipeWriter, Read, Write},
    net::SocketAddr,
    os::fd::OwnedFd,
    path::PathBuf,
    process::{Child, Command, ExitStatus},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use command_fds::{CommandFdExt, FdMapping};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use sim::shm::Domain;

use super::place::RunFolderError;
use super::{Bus, Fieldbus, Images, RunFolder, Timing};

/// Every process must report ready within this time.
const READY_DEADLINE: Duration = Duration::from_secs(5);
/// A process that was asked to end is killed after this time.
const END_DEADLINE: Duration = Duration::from_secs(2);
/// How often the supervisor looks at its processes.
const WATCH: Duration = Duration::from_millis(2);

/// Descriptors as the processes find them.
const LOCK_FD: i32 = 10;
const SUPERVISOR_FD: i32 = 11;
const READY_FD: i32 = 12;

/// What a process of the set does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Simulated drive and master.
    Sim,
    /// Channel A.
    ChannelA,
    /// Channel B.
    ChannelB,
    /// Crosscheck.
    Crosscheck,
}

impl Role {
    /// In the order in which they are started.
    pub const ALL: [Self; 4] = [Self::Sim, Self::ChannelA, Self::ChannelB, Self::Crosscheck];

    /// File name of the program.
    pub const fn program(self) -> &'static str {
        match self {
            Self::Sim => "safepair-sim",
            Self::ChannelA => "safepair-channel-a",
            Self::ChannelB => "safepair-channel-b",
            Self::Crosscheck => "safepair-crosscheck",
        }
    }

    /// Wake-up inside the cycle as a share of it, in 1/16: producer, A, B, crosscheck.
    const fn phase_sixteenths(self) -> u32 {
        match self {
            Self::Sim => 0,
            Self::ChannelA => 4,
            Self::ChannelB => 8,
            Self::Crosscheck => 12,
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Sim => "the simulated drive",
            Self::ChannelA => "channel A",
            Self::ChannelB => "channel B",
            Self::Crosscheck => "crosscheck",
        })
    }
}

/// Everything a set needs to start.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Where it lives.
    pub folder: RunFolder,
    /// Axes in use.
    pub axes: Vec<u8>,
    /// Safety images of every axis.
    pub images: Vec<Images>,
    /// Cycle and ages.
    pub timing: Timing,
    /// Cores of A, B, crosscheck, simulated drive.
    pub cpus: Vec<Option<u32>>,
    /// SCHED_FIFO priority; 0: none.
    pub priority: u8,
    /// Path of A.
    pub inhibit_a: String,
    /// Path of B.
    pub inhibit_b: String,
    /// Statement about the evaluator.
    pub evaluator: Option<String>,
    /// The unprotected control word is accepted.
    pub plain_command: bool,
    /// Program that produces in place of the simulated drive.
    pub producer: Option<PathBuf>,
    /// Script of the simulated drive.
    pub script: Option<PathBuf>,
    /// Where the simulated drive's gateway listens.
    pub gateway: Option<SocketAddr>,
    /// Black channels by axis: protocol and address.
    pub buses: Vec<Fieldbus>,
    /// File of the logbook.
    pub logbook: Option<PathBuf>,
}

/// Why a set did not start.
#[derive(Debug)]
pub enum StartError {
    /// The run folder.
    Folder(RunFolderError),
    /// The shared memory.
    Domain(sim::shm::DomainError),
    /// A file of the set.
    File(PathBuf, io::Error),
    /// A program could not be started.
    Program(Role, io::Error),
    /// A program ended or stayed silent before it was ready.
    NotReady(Role),
}

impl fmt::Display for StartError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder(error) => error.fmt(out),
            Self::Domain(error) => write!(out, "shared memory: {error}"),
            Self::File(path, error) => write!(out, "{}: {error}", path.display()),
            Self::Program(role, error) => write!(out, "{} ({}): {error}", role, role.program()),
            Self::NotReady(role) => write!(out, "{role} was not ready within {} s", READY_DEADLINE.as_secs()),
        }
    }
}

impl std::error::Error for StartError {}

/// How a set ended.
#[derive(Debug)]
pub enum Ended {
    /// By signal or time, as asked.
    Asked,
    /// A process ended by itself.
    Process(Role, ExitStatus),
}

/// A running set.
pub struct Set {
    children: Vec<(Role, Child)>,
    domain: Option<Domain>,
    folder: RunFolder,
    nonce: u32,
    session: u16,
    // Open as long as the supervisor lives: their end of file is the processes' signal.
    alive: Vec<PipeWriter>,
    // Tells the thread that gives the channels signs of life to end.
    silent: Arc<AtomicBool>,
    lock: Option<File>,
}

impl Set {
    /// Takes the lock, makes the domain, writes the images, starts all processes and waits
    /// until each is ready.
    ///
    /// # Errors
    /// What was in the way; nothing keeps running then.
    pub fn start(plan: &Plan) -> Result<Self, StartError> {
        let lock = plan.folder.lock().map_err(StartError::Folder)?;
        let random = || draw().map_err(|error| StartError::File("/dev/urandom".into(), error));
        let (nonce, session) = (random()?, random()? as u16);
        write_images(plan)?;
        let domain = Domain::create(&plan.folder.place(nonce), &plan.axes).map_err(StartError::Domain)?;
        let mut set = Self {
            children: Vec::new(),
            domain: Some(domain),
            folder: plan.folder.clone(),
            nonce,
            session,
            alive: Vec::new(),
            silent: Arc::new(AtomicBool::new(false)),
            lock: Some(lock),
        };
        for role in Role::ALL {
            set.spawn(plan, role)?;
        }
        Ok(set)
    }

    /// The shared memory of the set.
    pub fn domain(&self) -> Option<&Domain> {
        self.domain.as_ref()
    }

    /// Process id of `role`.
    pub fn process(&self, role: Role) -> Option<u32> {
        self.children.iter().find(|(known, _)| *known == role).map(|(_, child)| child.id())
    }

    /// The first process that has ended by itself.
    pub fn ended(&mut self) -> Option<(Role, ExitStatus)> {
        let mut ended = self.children.iter_mut().map(|(role, child)| (*role, child.try_wait()));
        ended.find_map(|(role, status)| Some((role, status.ok()??)))
    }

    /// Waits until `stop` is set, `limit` is over or a process ends.
    pub fn wait(&mut self, stop: &AtomicBool, limit: Option<Duration>) -> Ended {
        let start = Instant::now();
        loop {
            if let Some((role, status)) = self.ended() {
                return Ended::Process(role, status);
            }
            let over = limit.is_some_and(|limit| start.elapsed() >= limit);
            if over || stop.load(Ordering::Relaxed) {
                return Ended::Asked;
            }
            thread::sleep(WATCH);
        }
    }

    /// Ends every process, the domain and its files, and gives the lock back.
    pub fn stop(mut self) {
        self.end();
    }

    fn spawn(&mut self, plan: &Plan, role: Role) -> Result<(), StartError> {
        let failed = |error| StartError::Program(role, error);
        let (mut ready, report) = io::pipe().map_err(failed)?;
        let (watched, alive) = io::pipe().map_err(failed)?;
        let lock = self.lock.as_ref().ok_or(StartError::NotReady(role))?;
        let handed: Vec<(OwnedFd, i32)> = vec![
            (lock.try_clone().map_err(failed)?.into(), LOCK_FD),
            (watched.into(), SUPERVISOR_FD),
            (report.into(), READY_FD),
        ];
        let program = match (role, &plan.producer) {
            (Role::Sim, Some(program)) => program.clone(),
            _ => beside_us(role.program()).map_err(failed)?,
        };
        let mut command = Command::new(program);
        command.args(self.options(plan, role));
        let mappings = handed.into_iter().map(|(parent_fd, child_fd)| FdMapping { parent_fd, child_fd });
        command.fd_mappings(mappings.collect()).map_err(|error| failed(io::Error::other(error)))?;
        // A group of its own: Ctrl-C reaches the supervisor, which ends all in order.
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let child = command.spawn().map_err(failed)?;
        // The descriptors mapped for the child are closed here with the command.
        drop(command);
        self.children.push((role, child));
        if matches!(role, Role::ChannelA | Role::ChannelB) {
            give_signs_of_life(alive.try_clone().map_err(failed)?, Arc::clone(&self.silent));
        }
        self.alive.push(alive);
        wait_ready(&mut ready).then_some(()).ok_or(StartError::NotReady(role))
    }

    fn options(&self, plan: &Plan, role: Role) -> Vec<String> {
        let place = self.folder.place(self.nonce);
        let phase = plan.timing.cycle_us * role.phase_sixteenths() / 16;
        let axes: Vec<String> = plan.axes.iter().map(ToString::to_string).collect();
        let mut options = vec![
            ("--domain", place.root().display().to_string()),
            ("--prefix", place.prefix().to_owned()),
            ("--nonce", self.nonce.to_string()),
            ("--cycle-us", plan.timing.cycle_us.to_string()),
            ("--age-factor", plan.timing.age_factor.to_string()),
            ("--phase-us", phase.to_string()),
            ("--axes", axes.join(",")),
            ("--images", self.folder.images().display().to_string()),
            ("--lock-fd", LOCK_FD.to_string()),
            ("--supervisor-fd", SUPERVISOR_FD.to_string()),
            ("--ready-fd", READY_FD.to_string()),
        ];
        let place_of_core = match role {
            Role::ChannelA => 0,
            Role::ChannelB => 1,
            Role::Crosscheck => 2,
            Role::Sim => 3,
        };
        if let Some(Some(cpu)) = plan.cpus.get(place_of_core) {
            options.push(("--cpu", cpu.to_string()));
        }
        if plan.priority > 0 {
            // The producer is the witness of the cycle: just above the monitors.
            let above = u8::from(role == Role::Sim);
            options.push(("--priority", (plan.priority + above).to_string()));
        }
        match role {
            Role::ChannelA => options.extend(self.channel_options(plan, &plan.inhibit_a, channel_b::BUILD)),
            Role::ChannelB => options.extend(self.channel_options(plan, &plan.inhibit_b, channel_a::BUILD)),
            Role::Sim => {
                options.extend(plan.script.iter().map(|script| ("--script", script.display().to_string())));
                options.extend(self.bus_option(plan));
                options.extend(plan.gateway.iter().map(|at| ("--gateway", at.to_string())));
            }
            Role::Crosscheck => {
                options.extend(plan.logbook.iter().map(|file| ("--logbook", file.display().to_string())));
            }
        }
        options.into_iter().flat_map(|(name, value)| [name.to_owned(), value]).collect()
    }

    /// `partner`: the build identity of the other channel in this release (DEC-22). The supervisor
    /// is built with it, and so is the release manifest itself: a program of another release beside
    /// this one is found out by its partner.
    fn channel_options(&self, plan: &Plan, inhibit: &str, partner: u32) -> Vec<(&'static str, String)> {
        let mut options = vec![("--inhibit", inhibit.to_owned()), ("--partner-build", partner.to_string())];
        options.extend(plan.evaluator.iter().map(|text| ("--evaluator", text.clone())));
        if plan.plain_command {
            options.push(("--plain-command", "yes".to_owned()));
        }
        options.extend(self.bus_option(plan));
        options
    }

    fn bus_option(&self, plan: &Plan) -> Option<(&'static str, String)> {
        let bus = |Fieldbus { axis, bus, address, sra }: &Fieldbus| match bus {
            // Both channels have to begin with the same session id, another one with each start.
            Bus::Fsoe => {
                let (session, sra) = (self.session ^ u16::from(*axis) << 8, if *sra { ":sra" } else { "" });
                format!("{axis}=fsoe:{address}:{session}{sra}")
            }
            Bus::Profisafe => format!("{axis}=profisafe:{address}"),
        };
        let buses: Vec<String> = plan.buses.iter().map(bus).collect();
        (!buses.is_empty()).then(|| ("--bus", buses.join(",")))
    }

    fn end(&mut self) {
        // End of file on the pipe asks as well, for a process that missed the signal.
        self.silent.store(true, Ordering::Relaxed);
        self.alive.clear();
        for (_, child) in &self.children {
            let _ = kill(Pid::from_raw(child.id() as i32), Signal::SIGTERM);
            // A stopped process takes its signal only when it goes on.
            let _ = kill(Pid::from_raw(child.id() as i32), Signal::SIGCONT);
        }
        let deadline = Instant::now() + END_DEADLINE;
        for (_, child) in &mut self.children {
            while matches!(child.try_wait(), Ok(None)) && Instant::now() < deadline {
                thread::sleep(WATCH);
            }
            let _ = child.kill();
            let _ = child.wait();
        }
        self.children.clear();
        self.domain = None;
        let _ = self.folder.place(self.nonce).wipe();
        let _ = fs::remove_dir_all(self.folder.images());
        let _ = fs::remove_dir_all(self.folder.domain());
        self.lock = None;
    }
}

impl Drop for Set {
    fn drop(&mut self) {
        self.end();
    }
}

/// A channel that hears nothing for a dozen of these takes the supervisor for stopped.
const SIGN_OF_LIFE: Duration = Duration::from_millis(20);

fn give_signs_of_life(mut pipe: PipeWriter, silent: Arc<AtomicBool>) {
    thread::spawn(move || {
        while !silent.load(Ordering::Relaxed) && pipe.write_all(b".").is_ok() {
            thread::sleep(SIGN_OF_LIFE);
        }
    });
}

fn write_images(plan: &Plan) -> Result<(), StartError> {
    let folder = plan.folder.images();
    let failed = |path: &PathBuf| {
        let path = path.clone();
        move |error| StartError::File(path, error)
    };
    fs::create_dir_all(&folder).map_err(failed(&folder))?;
    for (axis, image_a, image_b) in &plan.images {
        for (channel, image) in [("a", image_a), ("b", image_b)] {
            let file = folder.join(format!("axis-{axis:02}.{channel}.img"));
            fs::write(&file, image).map_err(failed(&file))?;
        }
    }
    Ok(())
}

fn draw() -> io::Result<u32> {
    let mut octets = [0; 4];
    File::open("/dev/urandom")?.read_exact(&mut octets)?;
    Ok(u32::from_le_bytes(octets).max(1))
}

/// The programs of a set stand beside this one.
fn beside_us(program: &str) -> io::Result<PathBuf> {
    let own = std::env::current_exe()?;
    let folders = own.ancestors().skip(1).take(2);
    let mut found = folders.map(|folder| folder.join(program)).filter(|path| path.is_file());
    let missing = || io::Error::other(format!("{program} is not beside {}", own.display()));
    found.next().ok_or_else(missing)
}

/// One octet means ready; end of file or silence means not.
fn wait_ready(ready: &mut PipeReader) -> bool {
    use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
    use std::os::fd::AsFd;
    let limit = PollTimeout::try_from(READY_DEADLINE.as_millis()).unwrap_or(PollTimeout::MAX);
    let readable = poll(&mut [PollFd::new(ready.as_fd(), PollFlags::POLLIN)], limit);
    let mut octet = [0];
    let said = readable.is_ok_and(|count| count > 0) && ready.read(&mut octet).is_ok_and(|count| count == 1);
    said && octet == *b"R"
}
