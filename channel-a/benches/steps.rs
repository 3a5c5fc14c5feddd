//! Runs steps of channel A's core and nothing else, for callgrind: the difference of two runs
//! is the exact cost of the steps between them.
//!
//! `harness` makes the inputs only, so that its cost can be taken off; `guard-portable` and
//! `guard-hardware` check the form of one report cell for each step.
#![allow(missing_docs, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a tool")]

mod image;

use std::hint::black_box;
use std::process::ExitCode;

use channel_a::guard::Guard;
use channel_a::{Monitor, crc32};
use shm_schema::agreement::{Agreement, Echo};
use shm_schema::cell::{Header, Kind, Payload, seal};
use shm_schema::command::{Command, CommandSource};
use shm_schema::encoder::Encoder;
use shm_schema::exchange::{CellFault, Inputs, Motion, Published, Sampled, Setup, Start};
use shm_schema::facts::{amk_kw, atv340, etg, lenze_sm301};
use shm_schema::inhibit::Readback;
use shm_schema::io::Io;
use shm_schema::profile::{Profile, common, etg_key, lenze_key, reference};
use shm_schema::report::Report;
use shm_schema::word::Word;

const NONCE: u32 = 7;
const CYCLE_NS: u64 = 1_000_000;
const USAGE: &str = "usage: steps-a PROFILE INSTANCES STEPS
  PROFILE    amk-kw, lenze-sm301, atv340, etg-6100-2, harness, guard-portable, guard-hardware
  INSTANCES  etg-6100-2: instances of SLS, 1 to 32, all requested; others: ignored, all functions
  STEPS      number of steps";

/// What is run: image and control word.
struct Case {
    image: Vec<u8>,
    word: Word,
    /// A speed at which every function is active and kept.
    speed_mrpm: i32,
}

fn case(profile: &str, instances: u32) -> Option<Case> {
    let cleared = |profile: Profile, bits: &[u8]| {
        bits.iter().fold(Word::from_u32(profile.neutral_word()), |word, bit| word.with(*bit, false))
    };
    let made = |profile, entries: &[(u32, i64)], word| Case {
        image: image::sealed(profile, entries, crc32),
        word,
        speed_mrpm: if profile == Profile::Atv340 { 300_000 } else { 0 },
    };
    Some(match profile {
        "amk-kw" => {
            use amk_kw::control as c;
            let all =
                [c::SOS, c::SSR1, c::SSR2, c::SSR3, c::SSR4, c::SDIP, c::SDIN, c::SLS1, c::SLS2, c::SLI];
            let entries = [(67, 3_000), (69, 1), (75, 1), (81, 1), (87, 1), (93, 1)];
            made(Profile::AmkKw, &entries, cleared(Profile::AmkKw, &all))
        }
        "lenze-sm301" => {
            use lenze_sm301::control as c;
            let all = [c::SLS1, c::SLS2, c::SLS3, c::SLS4, c::SDIPOS, c::SDINEG];
            let speeds = (1..=4).map(|sub| (lenze_key(15_330, sub), 500));
            let others = [(15_305, 1_000), (15_320, 3_000), (15_342, 1_000), (15_100, 2), (15_400, 1)];
            let others = others.map(|(number, value)| (lenze_key(number, 0), value));
            let entries: Vec<_> = others.into_iter().chain(speeds).collect();
            made(Profile::LenzeSm301, &entries, cleared(Profile::LenzeSm301, &all))
        }
        "atv340" => {
            let entries = [
                (1, 1),
                (2, 2),
                (5, 5),
                (6, 1_024),
                (39, 2),
                (40, 100),
                (46, 10),
                (48, 500),
                (50, 400),
                (56, 2),
                (57, 900),
                (58, 900),
                (59, 800),
                (60, 800),
                (65, 1),
                (66, 1),
                (31, 100),
                (33, 10),
            ];
            let word = Word::from_u32(Profile::Atv340.neutral_word()).with(atv340::control::SLS, true);
            made(Profile::Atv340, &entries, word)
        }
        "etg-6100-2" => {
            let mut entries = Vec::new();
            let mut word = Word::from_u32(Profile::Etg61002.neutral_word());
            for instance in 1..=instances.clamp(1, 32) {
                entries.push((etg_key(etg::SLS, instance, etg::sls::VELOCITY_LIMIT), 500));
                let bit = 64 + instance;
                entries.push((common::CONTROL_WORD + bit, i64::from(reference(etg::SLS, instance))));
                entries.push((common::STATUS_WORD + bit, i64::from(reference(etg::SLS, instance))));
                word = word.with(bit as u8, false);
            }
            made(Profile::Etg61002, &entries, word)
        }
        "harness" => made(Profile::AmkKw, &[], Word::ZERO),
        _ => return None,
    })
}

fn cell<T>(payload: T) -> Sampled<T> {
    Sampled { sequence: 0, timestamp_ns: 0, crc32: 0, payload }
}

fn first_inputs(word: Word, speed_mrpm: i32) -> Inputs {
    let command = Command { source: CommandSource::Plain, drive_enabled: true, word, ..Command::default() };
    let lines = [u64::MAX; 4];
    Inputs {
        encoder: Ok(cell(Encoder { period_ns: CYCLE_NS as u32, ..Encoder::default() })),
        motion: Some(Motion { position: 0, speed_mrpm, acceleration_mrpm_s: None }),
        io: Ok(cell(Io { line_1: lines, line_2: lines, ..Io::default() })),
        command: Ok(cell(command)),
        partner: Err(CellFault::Missing),
        agreement: Ok(cell(Agreement { permit: true, ..Agreement::default() })),
        readback: Ok(cell(Readback::default())),
        published: None,
        overruns: 0,
        image_sound: true,
    }
}

fn age<T>(cell: &mut Result<Sampled<T>, CellFault>, step: u64) -> Option<&mut T> {
    let sampled = cell.as_mut().ok()?;
    sampled.sequence = step + 1;
    sampled.timestamp_ns = step * CYCLE_NS;
    Some(&mut sampled.payload)
}

/// The inputs of `step`, in place: everything goes on, both channels agree.
fn go_on(inputs: &mut Inputs, step: u64) {
    age(&mut inputs.encoder, step);
    if let Some(io) = age(&mut inputs.io, step) {
        io.samples = 16 * (step + 1);
        // One test pulse in each period of 1,000 ms.
        let pulse = if step % 1_000 == 500 { !0xFF } else { u64::MAX };
        io.line_1 = [pulse; 4];
    }
    age(&mut inputs.command, step);
    age(&mut inputs.partner, step);
    age(&mut inputs.readback, step);
    if let (Some(agreement), Some(own)) = (age(&mut inputs.agreement, step), &inputs.published) {
        agreement.echo_a = Echo { exchange: own.exchange, boot_nonce: NONCE, crc32: own.crc32 };
    }
}

fn run(case: &Case, steps: u64, with_monitor: bool) -> Option<Report> {
    let mut monitor = Monitor::new(&case.image, &Setup::new(1, NONCE, Start::Settled));
    let mut inputs = first_inputs(case.word, case.speed_mrpm);
    let mut last = None;
    for step in 0..steps {
        go_on(&mut inputs, step);
        if !with_monitor {
            black_box(&inputs);
            continue;
        }
        let outputs = monitor.step(black_box(&inputs), step * CYCLE_NS);
        let report = &outputs.report;
        inputs.published = Some(Published { exchange: report.exchange, crc32: report.exchange as u32 });
        inputs.partner = Ok(cell(*report));
        if let Ok(readback) = &mut inputs.readback {
            let (on, edges) = (outputs.inhibit.permit, outputs.inhibit.edges);
            readback.payload = Readback { path_a: on, path_b: on, edges_a: edges, edges_b: edges };
        }
        if step + 1 == steps {
            last = Some(outputs.report);
        }
    }
    last
}

fn guard(steps: u64, crc: fn(&[u8]) -> u32) -> usize {
    let mut header = Header::of(Kind::ReportB, 1, NONCE);
    header.sequence = 1;
    let mut octets = [0; Report::CELL];
    Report::default().write(&header, &mut octets);
    seal(&mut octets, crc32, |_| 0);
    let mut guard = Guard::new(Kind::ReportB, 1, NONCE);
    (0..steps).filter(|_| black_box(guard.check::<Report>(black_box(&octets), crc)).is_ok()).count()
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [profile, instances, steps] = arguments.as_slice() else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    let (Ok(instances), Ok(steps)) = (instances.parse(), steps.parse()) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match profile.as_str() {
        "guard-portable" => println!("{} cells of {} octets sound", guard(steps, crc32), Report::CELL),
        "guard-hardware" => {
            println!("{} cells of {} octets sound", guard(steps, crc32fast::hash), Report::CELL);
        }
        _ => {
            let Some(case) = case(profile, instances) else {
                eprintln!("{USAGE}");
                return ExitCode::from(2);
            };
            let last = run(&case, steps, profile != "harness");
            // What ran is shown, so that nobody measures an axis in STO.
            let shown = last
                .map(|report| (report.phase, report.driving, report.status.0, report.errors.iter().count()));
            println!("{shown:?}");
        }
    }
    ExitCode::SUCCESS
}
