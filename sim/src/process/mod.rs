//! The process around the simulated machine.

mod drive;
mod ending;
mod listen;
mod options;
mod realtime;

use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;
use std::{fmt, fs};

use gateway::udp::Port;
use params::AxisSet;
use shm_schema::profile::Profile;
use sim::control::Script;
use sim::shm::{Domain, DomainError, Place};

use drive::{BusEnd, Drives};
use listen::Order;
use options::Options;

/// Longest wait for the domain.
const OPEN_DEADLINE: Duration = Duration::from_secs(2);
/// Instructions that may wait for the next cycle.
const WAITING_MAX: usize = 256;

/// Why the process ended early.
#[derive(Debug)]
pub enum Failure {
    /// A wrong option or file: one line.
    Option(String),
    /// Shared memory or socket could not be opened.
    Open(String),
}

impl Failure {
    /// As docs/architecture.md lists them.
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Option(_) => 2,
            Self::Open(_) => 3,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Option(text) | Self::Open(text) => out.write_str(text),
        }
    }
}

impl From<DomainError> for Failure {
    fn from(error: DomainError) -> Self {
        Self::Open(error.to_string())
    }
}

/// Runs until SIGTERM, SIGINT or the end of the supervisor.
pub fn run(arguments: impl Iterator<Item = String>) -> Result<(), Failure> {
    let options = Options::parse(arguments).map_err(Failure::Option)?;
    let ending = ending::Ending::watch(options.supervisor_fd);
    let script = read_script(&options)?;
    let sets = options.axes.iter().map(|axis| read_set(&options, *axis)).collect::<Result<Vec<_>, _>>()?;
    let place = Place::new(&options.domain, &options.prefix, options.nonce);
    let domain = Domain::open(&place, OPEN_DEADLINE)?;
    let drives = Drives::new(&domain, &sets, options.cycle_ns(), buses(&options)?, options.age_factor)?;
    let (sender, orders) = sync_channel(WAITING_MAX);
    let socket = listen::Listener::start(&options.domain, sender).map_err(Failure::Open)?;
    for missing in realtime::prepare(&options) {
        tracing::warn!("{missing}");
    }
    ending::ready(options.ready_fd);
    cycle(&options, &ending, drives, &orders, script);
    drop(socket);
    Ok(())
}

fn cycle(
    options: &Options,
    ending: &ending::Ending,
    mut drives: Drives,
    orders: &Receiver<Order>,
    script: Script,
) {
    let mut clock = realtime::Periodic::new(options.cycle_ns(), options.phase_us * 1_000);
    let mut script = script.at.into_iter().peekable();
    let mut elapsed_ns: u64 = 0;
    while !ending.is_wanted() {
        let (cycles, now_ns) = clock.wait();
        elapsed_ns += cycles * options.cycle_ns();
        let due = |at: &sim::control::Instruction| at.t_ms.unwrap_or(0.0) * 1e6 <= elapsed_ns as f64;
        while let Some(instruction) = script.next_if(due) {
            if let Err(message) = drives.take(&instruction) {
                tracing::warn!("script: {message}");
            }
        }
        for order in orders.try_iter() {
            // Nobody waits any more: nothing is lost but the answer.
            let _ = order.answer.try_send(drives.take(&order.instruction));
        }
        drives.step(cycles, now_ns);
    }
}

/// One port after the other for the axes with a bus.
fn buses(options: &Options) -> Result<Vec<(u8, BusEnd)>, Failure> {
    let bind = |(at, (axis, protocol)): (usize, &(u8, gateway::Protocol))| {
        let Some(mut address) = options.gateway else {
            return Ok((*axis, BusEnd::new(*protocol, None)));
        };
        address.set_port(address.port().saturating_add(at as u16));
        let port = Port::bind(address).map_err(|error| Failure::Open(format!("{address}: {error}")))?;
        tracing::info!("axis {axis}: black channel at {address}");
        Ok((*axis, BusEnd::new(*protocol, Some(port))))
    };
    options.buses.iter().enumerate().map(bind).collect()
}

fn read_script(options: &Options) -> Result<Script, Failure> {
    let Some(path) = &options.script else {
        return Ok(Script::default());
    };
    let failed = |error: String| Failure::Option(format!("{}: {error}", path.display()));
    let text = fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
    Script::parse(&text).map_err(failed)
}

/// The machine is built from the image of channel A: what the parameters say is mounted.
fn read_set(options: &Options, axis: u8) -> Result<AxisSet, Failure> {
    let path = options.images.join(format!("axis-{axis:02}.a.img"));
    let failed = |error: String| Failure::Open(format!("{}: {error}", path.display()));
    let octets = fs::read(&path).map_err(|error| failed(error.to_string()))?;
    let image = params::Image::read(&octets).map_err(|error| failed(error.to_string()))?;
    let profile = image.profile().unwrap_or(Profile::None);
    let delivery = AxisSet::delivery(profile, axis, &image.serial);
    Ok(AxisSet { values: image.values, ..delivery })
}
