//! The shell: options, shared memory, real time, inhibit path, ending, cycle.

mod bus;
mod cells;
mod checks;
mod cycle;
mod ending;
mod inhibit;
mod options;
mod realtime;

use std::fs;
use std::process::ExitCode;
use std::time::Duration;

use channel_a::Monitor;
use shm_schema::exchange::{Setup, Start};
use tracing::{error, info, warn};

use cells::Domain;
use options::Options;

/// Longest wait for anything that has to be opened.
const OPEN_DEADLINE: Duration = Duration::from_secs(2);
const EXIT_OPTION: u8 = 2;
const EXIT_OPEN: u8 = 3;

/// Everything the process does.
pub fn main() -> ExitCode {
    if std::env::args().skip(1).eq(["--identity"]) {
        println!("{}", channel_a::BUILD);
        return ExitCode::SUCCESS;
    }
    log();
    let options = match Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(reason) => {
            error!("{reason}");
            return ExitCode::from(EXIT_OPTION);
        }
    };
    // Before any other thread exists: all of them inherit the blocked signals.
    let ending = ending::Ending::watch(options.supervisor_fd);
    match run(&options, &ending) {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            error!("{reason}");
            ExitCode::from(EXIT_OPEN)
        }
    }
}

fn log() {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env();
    let filter = filter.unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("info"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
}

fn run(options: &Options, ending: &ending::Ending) -> Result<(), String> {
    // The path is off before any file is read (DEC-19).
    let paths = inhibit::open(options)?;
    let images = read_images(options)?;
    let monitors = options.axes.iter().zip(&images).map(|(axis, image)| {
        let mut setup = Setup::new(*axis, options.nonce, Start::Cold);
        setup.cycle_ns = options.cycle_ns();
        setup.age_factor = options.age_factor;
        setup.partner_build = options.partner_build;
        setup.bus = options.bus_of(*axis);
        Monitor::new(image, &setup)
    });
    let monitors: Vec<Monitor> = monitors.collect();
    let domain = Domain::open(options, OPEN_DEADLINE)?;
    let axes = domain.axes(options, monitors, paths)?;
    let sound = checks::watch(images);
    for missing in realtime::prepare(options) {
        warn!("{missing}");
    }
    info!(axes = options.axes.len(), cycle_us = options.cycle_us, "channel A runs");
    ending::ready(options.ready_fd);
    cycle::run(options, axes, ending, &sound);
    Ok(())
}

fn read_images(options: &Options) -> Result<Vec<Vec<u8>>, String> {
    let read = |axis: &u8| {
        let path = options.images.join(format!("axis-{axis:02}.a.img"));
        fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    options.axes.iter().map(read).collect()
}
