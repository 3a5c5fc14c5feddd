//! `safepair-counter-producer`: encoders on the kernel's counter subsystem, as the `encoder`
//! cell with [`SlotKind::Counter`](shm_schema::encoder::SlotKind::Counter).
//!
//! ```text
//! safepair-counter-producer --domain DIR --prefix TEXT --nonce N --axis 1 --cycle-us 1000 \
//!     --slot1 /sys/bus/counter/devices/counter0/count0 --slot2 /sys/bus/counter/devices/counter1/count0
//! ```
//!
//! A slot that is not named stays empty. What only the drive knows (its own position, output
//! frequency, torque) is 0 here: add it where your drive tells.

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use producers::cells::{Domain, within};
use producers::clock::{Cycle, now_ns, prepare};
use producers::counter::Counter;
use producers::options::Options;
use shm_schema::cell::Kind;
use shm_schema::encoder::{Encoder, Slot};

const OPEN_DEADLINE: Duration = Duration::from_secs(2);

fn main() -> ExitCode {
    let options = match Options::parse(std::env::args().skip(1), &["--slot1", "--slot2"]) {
        Ok(options) => options,
        Err(line) => return refuse(&line, 2),
    };
    match run(options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(line) => refuse(&line, 3),
    }
}

fn refuse(line: &str, code: u8) -> ExitCode {
    eprintln!("safepair-counter-producer: {line}");
    ExitCode::from(code)
}

fn run(mut options: Options) -> Result<(), String> {
    let ending = options.ending();
    let open = |name| options.each(name).last().map(|folder| Counter::open(Path::new(folder))).transpose();
    let mut counters = [open("--slot1")?, open("--slot2")?];
    let (place, axis) = (options.place.clone(), options.axis);
    let open = move || Domain::open(&place)?.publisher::<Encoder>(Kind::Encoder, axis);
    let mut cell = within(OPEN_DEADLINE, open).map_err(|trouble| trouble.to_string())?;
    for missing in prepare(options.cpu, options.priority) {
        eprintln!("safepair-counter-producer: {missing}");
    }
    options.ready();
    let mut cycle = Cycle::after(now_ns(), options.cycle_ns, options.phase_ns);
    while !ending.load(Ordering::Acquire) {
        let (cycles, _) = cycle.wait();
        let slots = counters.each_mut().map(|slot| slot.as_mut().map_or_else(Slot::default, Counter::sample));
        // The instant of the reading, not of the boundary: a late reading is another position.
        let latched_ns = now_ns();
        let sample = Encoder { slots, period_ns: options.cycle_ns as u32, ..Encoder::default() };
        cell.publish(&sample, latched_ns, cycles);
    }
    Ok(())
}
