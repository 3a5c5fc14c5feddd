//! `safepair-gpio-producer`: the terminals of one axis on a GPIO chip, as the `io` cell.
//!
//! ```text
//! safepair-gpio-producer --domain DIR --prefix TEXT --nonce N --axis 1 --cycle-us 1000 \
//!     --chip /dev/gpiochip0 --line se1.1=4 --line se1.2=5 --line aie=6 --line sa1.1=8 --line sa1.2=9
//! ```
//!
//! Inputs `se1.1` to `se4.2`, `ais`, `aie`; outputs `sa1.1` to `sa2.2`, `sdyn1`, `sdyn2`. What
//! is not wired reads low.

use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use producers::cells::{Domain, Publisher, Subscriber, Trouble, within};
use producers::clock::{Cycle, now_ns, prepare};
use producers::options::Options;
use producers::terminals::{Terminals, wire};
use shm_schema::cell::Kind;
use shm_schema::inhibit::Inhibit;
use shm_schema::io::{Io, SAMPLE_NS};

const OPEN_DEADLINE: Duration = Duration::from_secs(2);
/// Cycles after which what a channel asks for is no longer believed.
const STALE_CYCLES: u64 = 3;

fn main() -> ExitCode {
    let own = ["--chip", "--line"];
    let options = match Options::parse(std::env::args().skip(1), &own) {
        Ok(options) => options,
        Err(line) => return refuse(&line, 2),
    };
    match run(options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(line) => refuse(&line, 3),
    }
}

fn refuse(line: &str, code: u8) -> ExitCode {
    eprintln!("safepair-gpio-producer: {line}");
    ExitCode::from(code)
}

/// What this producer publishes and reads.
struct Cells {
    io: Publisher<Io>,
    asked: [Subscriber<Inhibit>; 2],
}

fn run(mut options: Options) -> Result<(), String> {
    let ending = options.ending();
    let chip = options.each("--chip").last().unwrap_or("/dev/gpiochip0").to_owned();
    let wires = options.each("--line").map(wire).collect::<Result<Vec<_>, _>>()?;
    let mut terminals = Terminals::open(&chip, &wires)?;
    let (place, axis) = (options.place.clone(), options.axis);
    let open = move || -> Result<Cells, Trouble> {
        let domain = Domain::open(&place)?;
        let asked = [domain.subscriber(Kind::InhibitA, axis)?, domain.subscriber(Kind::InhibitB, axis)?];
        Ok(Cells { io: domain.publisher(Kind::Io, axis)?, asked })
    };
    let mut cells = within(OPEN_DEADLINE, open).map_err(|trouble| trouble.to_string())?;
    for missing in prepare(options.cpu, options.priority) {
        eprintln!("safepair-gpio-producer: {missing}");
    }
    options.ready();
    let mut cycle = Cycle::after(now_ns(), options.cycle_ns, options.phase_ns);
    let samples = (options.cycle_ns / SAMPLE_NS) as u32;
    while !ending.load(Ordering::Acquire) {
        let (cycles, start_ns) = cycle.wait();
        cells.io.publish(&terminals.look(), start_ns, cycles);
        let oldest_ns = start_ns.saturating_sub(STALE_CYCLES * options.cycle_ns);
        let asked = cells.asked.each_ref().map(|cell| {
            let fresh = cell.read().filter(|(header, _)| header.timestamp_ns >= oldest_ns);
            fresh.map(|(_, inhibit)| inhibit)
        });
        terminals.drive(start_ns, samples, asked);
    }
    terminals.drive(now_ns(), 1, [None, None]);
    Ok(())
}
