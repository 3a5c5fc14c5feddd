//! The process around the core.
//!
//! - [`options`]: what the supervisor asks · [`cells`]: shared memory · [`line`]: the path
//! - [`clock`]: two clocks and the sleep · [`thread`]: priority, core, memory
//! - [`ending`]: what ends the process · [`cycle`]: the loop
//!
//! Everything that allocates, locks or calls the system happens before the cycle begins.

mod cells;
mod checksum;
mod clock;
mod cycle;
mod ending;
mod line;
mod options;
mod thread;

use std::fmt::{self, Display};
use std::process::ExitCode;
use std::time::Duration;

use options::Options;

/// Everything must be open within this time (docs/architecture.md).
const OPEN_DEADLINE: Duration = Duration::from_secs(2);

/// Why the process cannot work.
#[derive(Debug)]
pub struct Trouble {
    what: String,
    why: String,
}

impl Trouble {
    /// `what` did not work, because of `why`.
    pub fn new(what: impl Display, why: impl Display) -> Self {
        Self { what: what.to_string(), why: why.to_string() }
    }
}

impl Display for Trouble {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: {}", self.what, self.why)
    }
}

/// Runs the process; its exit code.
pub fn run() -> ExitCode {
    if std::env::args().nth(1).as_deref() == Some("--identity") {
        println!("{}", channel_b::BUILD);
        return ExitCode::SUCCESS;
    }
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_target(false).init();
    let options = match Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(trouble) => return refuse(&trouble, 2),
    };
    match serve(options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(trouble) => refuse(&trouble, 3),
    }
}

fn refuse(trouble: &Trouble, code: u8) -> ExitCode {
    eprintln!("safepair-channel-b: {trouble}");
    ExitCode::from(code)
}

fn serve(mut options: Options) -> Result<(), Trouble> {
    // Signals are blocked before the first thread exists, so that only the watcher sees them.
    let ending = ending::watch(options.supervisor.take())?;
    let mut axes = cells::open(&options, OPEN_DEADLINE)?;
    let lines = line::open(&options)?;
    thread::prepare(&options);
    let ready = options.ready.take();
    cycle::run(&options, &mut axes, lines, &ending, ready)
}
