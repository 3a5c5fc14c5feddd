//! `steps-crosscheck STEPS`: runs crosscheck's step over two healthy channels so often and no
//! more, so that the difference of two instruction counts (callgrind) is that of the steps.

use std::hint::black_box;
use std::process::ExitCode;

use crosscheck::guard::crc32;
use crosscheck::{Crosscheck, Limits};
use shm_schema::exchange::{CrosscheckInputs, CrosscheckOutputs, Sampled, Setup, Start};
use shm_schema::image::{MAGIC, VERSION};
use shm_schema::inhibit::Readback;
use shm_schema::profile::Profile;
use shm_schema::report::{Phase, Report};
use shm_schema::word::Word;

const NONCE: u32 = 7;
const CYCLE_NS: u64 = 1_000_000;
const SIGNATURE: u32 = 0x00C0_FFEE;

/// Encoding A of an AMK set, as far as crosscheck reads it: Prm2, Prm3, Prm105.
fn image() -> Vec<u8> {
    let entries = [(2, 50), (3, 16), (105, 7)];
    let kind = u32::from(VERSION) << 16 | (Profile::AmkKw as u32) << 8 | 1;
    let head = [MAGIC, kind, entries.len() as u32, 0, SIGNATURE, 0, 1, 0, 0, 0, 0, 0, 0];
    let words = head.into_iter().chain(entries.into_iter().flat_map(|(key, value)| [key, value]));
    let mut octets: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
    octets.extend(crc32(&octets).to_le_bytes());
    octets
}

fn run(steps: u64) -> Option<CrosscheckOutputs> {
    let setup = Setup::new(1, NONCE, Start::Settled);
    let mut core = Crosscheck::new(&setup, &Limits::from_image(&image()));
    let mut report = Report {
        phase: Phase::Operational,
        ready: true,
        driving: true,
        parameter_signature: SIGNATURE,
        status: Word::from_u32(0x1000_0100),
        ..Report::default()
    };
    let mut readback = Readback::default();
    let mut last = None;
    for step in 1..=steps {
        (report.exchange, report.time_ns) = (step, step * CYCLE_NS);
        let on = last.is_none_or(|last: CrosscheckOutputs| last.torque);
        let edges = readback.edges_a + u64::from(on);
        readback = Readback { path_a: on, path_b: on, edges_a: edges, edges_b: edges };
        let at = |payload| Sampled { sequence: step, timestamp_ns: step * CYCLE_NS, crc32: 1, payload };
        let readback = Sampled { sequence: step, timestamp_ns: step * CYCLE_NS, crc32: 1, payload: readback };
        let inputs = CrosscheckInputs {
            report_a: Ok(at(report)),
            report_b: Ok(at(report)),
            readback: Ok(readback),
            encoder_sequence: Some(step),
            overruns: 0,
        };
        last = Some(core.step(black_box(&inputs), step * CYCLE_NS));
    }
    last
}

fn main() -> ExitCode {
    let Some(steps) = std::env::args().nth(1).and_then(|text| text.parse().ok()) else {
        eprintln!("steps-crosscheck: expected STEPS");
        return ExitCode::from(2);
    };
    let torque = run(steps).is_some_and(|last| last.torque);
    println!("steps {steps} torque {torque}");
    // A set that trips would be measured in STO.
    if torque { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
