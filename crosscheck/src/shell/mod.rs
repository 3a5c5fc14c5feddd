//! Everything of the process that touches the operating system.

pub mod cells;
pub mod cycle;
pub mod ending;
pub mod journal;
pub mod log;
pub mod options;
pub mod realtime;

use std::fmt;
use std::time::Duration;

use crosscheck::{Crosscheck, Limits};
use shm_schema::exchange::{Setup, Start};

use options::Options;

/// How long anything may take to open (docs/architecture.md).
pub const OPEN_DEADLINE: Duration = Duration::from_secs(2);

/// Why the process cannot run: what was to be opened, and what is wrong with it.
#[derive(Debug)]
pub struct OpenError {
    what: String,
    why: String,
}

impl OpenError {
    /// `what` could not be opened because of `why`.
    pub fn new(what: impl Into<String>, why: impl fmt::Display) -> Self {
        Self { what: what.into(), why: why.to_string() }
    }
}

impl fmt::Display for OpenError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: {}", self.what, self.why)
    }
}

/// Opens everything, then runs until the end of the set.
///
/// # Errors
/// [`OpenError`] when something could not be opened within [`OPEN_DEADLINE`].
pub fn run(options: &Options) -> Result<(), OpenError> {
    // First, so that every thread started from here on leaves the signals to the watcher.
    let ending = ending::watch(options.supervisor_fd)?;
    let opened = ending::limit_opening(OPEN_DEADLINE);
    let (cores, images) = cores(options)?;
    // Before the thread is pinned and prioritised, so that the recorder inherits neither.
    let journal = journal::begin(options, images)?;
    let domain = cells::Domain::open(options, OPEN_DEADLINE)?;
    let axes = domain.axes(options, cores)?;
    opened.done();
    realtime::prepare(options);
    let (feeder, journal) = journal.unzip();
    cycle::run(options, axes, feeder, &ending);
    if let Some(journal) = journal {
        journal.finish();
    }
    Ok(())
}

/// Axis, profile octet and content signature of an image, for the logbook.
pub type Image = (u8, u8, u32);

/// One core for each axis, from encoding A of its image.
fn cores(options: &Options) -> Result<(Vec<Crosscheck>, Vec<Image>), OpenError> {
    let mut both = (Vec::new(), Vec::new());
    for axis in &options.axes {
        let limits = limits(options, *axis)?;
        let setup = Setup {
            cycle_ns: options.cycle_ns(),
            age_factor: options.age_factor,
            ..Setup::new(*axis, options.nonce, Start::Cold)
        };
        both.0.push(Crosscheck::new(&setup, &limits));
        both.1.push((*axis, limits.profile as u8, limits.signature));
    }
    Ok(both)
}

fn limits(options: &Options, axis: u8) -> Result<Limits, OpenError> {
    let path = options.images.join(format!("axis-{axis:02}.a.img"));
    let image = std::fs::read(&path).map_err(|error| OpenError::new(path.display().to_string(), error))?;
    let limits = Limits::from_image(&image);
    if !limits.acceptable {
        // Not an exit: the refusal is reported as an error of the axis.
        tracing::error!(axis, "safety image refused: this axis gets no torque");
    }
    Ok(limits)
}
