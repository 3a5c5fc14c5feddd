//! `steps-b PROFILE INSTANCES STEPS`: runs the core's step so often and no more, so that the
//! difference of two instruction counts (callgrind) is that of the steps between them.
//!
//! PROFILE is `amk-kw`, `etg-6100-2`, `lenze-sm301` or `atv340` with every function the profile
//! can have active at once, or `guard` for reading one cell of each kind by the hardware check
//! sum; `harness` makes and feeds back what the steps of `amk-kw` are given, and steps nothing, so
//! that its cost can be taken off. INSTANCES counts the functions of `etg-6100-2`; the other profiles have theirs.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::process::ExitCode;

use channel_b::Monitor;
use channel_b::crc::{Signature, crc32c};
use channel_b::guard::Guard;
use shm_schema::agreement::{Agreement, Echo};
use shm_schema::cell::{Header, Kind, Payload, seal};
use shm_schema::command::{Command, CommandSource};
use shm_schema::encoder::{Encoder, Slot, SlotKind};
use shm_schema::exchange::{CellFault, Inputs, Outputs, Published, Received, Sampled, Setup, Start};
use shm_schema::facts::{self, amk_kw, atv340, etg};
use shm_schema::image::{MAGIC, VERSION};
use shm_schema::inhibit::Readback;
use shm_schema::io::Io;
use shm_schema::profile::{Profile, common, etg_key, lenze_key, reference};
use shm_schema::report::Report;
use shm_schema::word::Word;

const NONCE: u32 = 1;
const MS: u64 = 1_000_000;
/// Cells of the guard's measurement.
const KINDS: usize = 6;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let profile = arguments.next().unwrap_or_default();
    let mut number = || arguments.next().and_then(|text| text.parse::<u64>().ok());
    let (Some(instances), Some(steps)) = (number(), number()) else {
        eprintln!("steps-b: expected PROFILE INSTANCES STEPS");
        return ExitCode::from(2);
    };
    if profile == "guard" {
        return guard(steps);
    }
    if profile == "harness" {
        return harness(steps);
    }
    let Some(plan) = plan(&profile, instances as u32) else {
        eprintln!("steps-b: {profile:?} is amk-kw, etg-6100-2, lenze-sm301, atv340, guard or harness");
        return ExitCode::from(2);
    };
    let last = run(&plan, steps);
    let torque = last.is_some_and(|last| last.inhibit.permit);
    println!("{profile} instances {instances} steps {steps} torque {torque}");
    if torque {
        return ExitCode::SUCCESS;
    }
    // A set that trips would be measured in STO.
    let errors = last.map(|last| last.report.errors);
    eprintln!("steps-b: no torque: {:?}", errors.map(|list| list.iter().copied().collect::<Vec<_>>()));
    ExitCode::from(1)
}

/// A parameter set and a control word that keep everything active without a violation.
struct Plan {
    profile: Profile,
    values: BTreeMap<u32, i32>,
    word: Word,
}

fn plan(name: &str, instances: u32) -> Option<Plan> {
    match name {
        "amk-kw" => Some(amk()),
        "etg-6100-2" => Some(generic(instances)),
        "lenze-sm301" => Some(lenze()),
        "atv340" => Some(atv()),
        _ => None,
    }
}

fn defaults(rows: &[facts::Parameter]) -> BTreeMap<u32, i32> {
    rows.iter().map(|row| (row.key, row.default)).collect()
}

/// Every function but the three stops: 12 request bits at 0, SMS and SEM always.
fn amk() -> Plan {
    let mut values = defaults(&amk_kw::PARAMETERS);
    values.extend([(2, 1_000_000), (3, 60_000), (67, 3_000), (64, 10), (65, 2_000_000_000)]);
    values.extend([(66, -2_000_000_000), (28, 3_000), (29, 2_000_000_000)]);
    for first in [30, 36, 42, 48] {
        values.extend([(first + 3, 2_000), (first + 4, -2_000)]);
    }
    values.extend([(57, 2_000), (62, 2_000)]);
    // STO, SS1 and SS2 stay at 1.
    Plan { profile: Profile::AmkKw, values, word: Word::from_u32(0b111) }
}

/// `instances` SLS, control bits from 32 on.
fn generic(instances: u32) -> Plan {
    let mut values = BTreeMap::new();
    for instance in 1..=instances.min(96) {
        values.insert(etg_key(etg::SLS, instance, 2), 2_000);
        values.insert(etg_key(etg::SLS, instance, 1), 0);
        let bit = 31 + instance;
        values.insert(common::CONTROL_WORD + bit, reference(etg::SLS, instance));
        values.insert(common::STATUS_WORD + bit, reference(etg::SLS, instance));
    }
    Plan { profile: Profile::Etg61002, values, word: Word::from_u32(Profile::Etg61002.neutral_word()) }
}

/// SMS, SLS 1 to 4, both directions.
fn lenze() -> Plan {
    let mut values = defaults(&facts::lenze_sm301::PARAMETERS);
    let mut set = |code: u32, subcode: u32, value: i32| values.insert(lenze_key(code, subcode), value);
    set(15_100, 0, 1);
    set(15_113, 0, -1);
    set(15_400, 0, 1);
    set(15_410, 0, 10);
    set(15_320, 0, 3_000);
    set(15_342, 0, 327_680);
    for number in 1..=4 {
        set(15_330, number, 2_000);
    }
    let stops = 0b111;
    Plan { profile: Profile::LenzeSm301, values, word: Word::from_u32(0x0180_0000 | stops) }
}

/// SLS type 4 and SMS with one threshold.
fn atv() -> Plan {
    let mut values = defaults(&atv340::PARAMETERS);
    values.extend([(65, 1), (66, 1), (39, 4), (48, 1_000), (50, 900), (56, 1), (57, 1_500), (58, 1_500)]);
    values.extend([(1, 1), (2, 2), (4, 2_000), (5, 5), (6, 1_024)]);
    values.extend([(36, 1), (30, 200), (31, 100), (32, 50), (33, 50), (34, 5)]);
    Plan { profile: Profile::Atv340, values, word: Word::from_u32(1 | 1 << atv340::control::SLS) }
}

/// The image of encoding B.
fn image(plan: &Plan) -> Vec<u8> {
    let start = Signature::new().word(plan.profile as u32);
    let content =
        plan.values.iter().fold(start, |sum, (key, value)| sum.word(*key).word(*value as u32)).finish();
    let device = (0..6).fold(Signature::new().word(content), |sum, _| sum.word(0)).finish();
    let version = u32::from(VERSION) << 16 | (plan.profile as u32) << 8 | 1;
    let mut words = vec![MAGIC, version, plan.values.len() as u32, 0, content, device, 1];
    words.extend([0; 6]);
    words.extend(plan.values.iter().flat_map(|(key, value)| [*key, *value as u32]));
    let mut octets: Vec<u8> = words.iter().flat_map(|word| (!word).to_be_bytes()).collect();
    octets.extend((!crc32c(&octets)).to_be_bytes());
    octets
}

/// The outputs of the last step.
fn run(plan: &Plan, steps: u64) -> Option<Outputs> {
    let mut monitor = Monitor::new(&image(plan), &Setup::new(1, NONCE, Start::Settled));
    let mut inputs = first_inputs(plan);
    let mut last = None;
    for cycle in 0..steps {
        advance(&mut inputs, cycle);
        let outputs = monitor.step(black_box(&inputs), cycle * MS);
        feed_back(&mut inputs, &outputs);
        last = Some(outputs);
    }
    last
}

/// Everything around the steps: the outputs are those of the first one, again and again.
fn harness(steps: u64) -> ExitCode {
    let plan = amk();
    let mut inputs = first_inputs(&plan);
    let mut monitor = Monitor::new(&image(&plan), &Setup::new(1, NONCE, Start::Settled));
    let made = monitor.step(&inputs, 0);
    let mut last = None;
    for cycle in 0..steps {
        advance(&mut inputs, cycle);
        let outputs = *black_box(&made);
        feed_back(black_box(&mut inputs), &outputs);
        last = Some(outputs);
    }
    println!("harness steps {steps} torque {}", last.is_some_and(|last| last.inhibit.permit));
    ExitCode::SUCCESS
}

#[allow(clippy::unnecessary_wraps, reason = "the type the inputs have")]
fn cell<T>(payload: T) -> Received<T> {
    Ok(Sampled { sequence: 1, timestamp_ns: 0, crc32: 0, payload })
}

fn first_inputs(plan: &Plan) -> Inputs {
    let lines = [u64::MAX; 4];
    let command =
        Command { source: CommandSource::Plain, drive_enabled: true, word: plan.word, ..Command::default() };
    let slot = Slot { kind: SlotKind::SineCosine, cosine: 16_384, ..Slot::default() };
    let encoder = Encoder { slots: [slot; 2], ..Encoder::default() };
    Inputs {
        encoder: cell(encoder),
        motion: None,
        io: cell(Io { samples: 64, line_1: lines, line_2: lines, ..Io::default() }),
        command: cell(command),
        partner: Err(CellFault::Missing),
        agreement: cell(Agreement { permit: true, ..Agreement::default() }),
        readback: cell(Readback { path_a: true, path_b: true, ..Readback::default() }),
        published: None,
        overruns: 0,
        image_sound: true,
    }
}

fn stamp<T>(received: &mut Received<T>, cycle: u64) {
    if let Ok(cell) = received {
        cell.sequence = cycle + 1;
        cell.timestamp_ns = cycle * MS;
    }
}

fn advance(inputs: &mut Inputs, cycle: u64) {
    stamp(&mut inputs.encoder, cycle);
    stamp(&mut inputs.io, cycle);
    stamp(&mut inputs.command, cycle);
    stamp(&mut inputs.agreement, cycle);
    stamp(&mut inputs.readback, cycle);
    if let Ok(cell) = &mut inputs.io {
        cell.payload.samples += 16;
    }
}

/// The partner says the same, crosscheck echoes it, the lines follow.
fn feed_back(inputs: &mut Inputs, outputs: &Outputs) {
    let exchange = outputs.report.exchange;
    let crc32 = exchange as u32;
    inputs.published = Some(Published { exchange, crc32 });
    let partner = Report { time_ns: outputs.report.time_ns, ..outputs.report };
    inputs.partner = Ok(Sampled { sequence: exchange, timestamp_ns: 0, crc32, payload: partner });
    if let Ok(cell) = &mut inputs.agreement {
        cell.payload.echo_b = Echo { exchange, boot_nonce: NONCE, crc32 };
    }
    if let Ok(cell) = &mut inputs.readback {
        cell.payload.edges_a = outputs.inhibit.edges;
        cell.payload.edges_b = outputs.inhibit.edges;
    }
    if let Ok(cell) = &mut inputs.io {
        let [sa1, sa2, _] = outputs.inhibit.outputs;
        let read = |before: u64, driven: u64| before << 16 | driven.reverse_bits() >> 48;
        let [_, first, _, second] = &mut cell.payload.output_readback;
        (*first, *second) = (read(*first, sa1), read(*second, sa2));
    }
}

/// Reads one cell of each kind a channel reads, with the fastest check sum of this machine.
fn guard(steps: u64) -> ExitCode {
    let octets = written::<Encoder>(Kind::Encoder).len()
        + written::<Io>(Kind::Io).len()
        + written::<Command>(Kind::Command).len()
        + written::<Report>(Kind::ReportA).len()
        + written::<Agreement>(Kind::Agreement).len()
        + written::<Readback>(Kind::Readback).len();
    let mut valid = 0;
    valid += checked::<Encoder>(Kind::Encoder, steps);
    valid += checked::<Io>(Kind::Io, steps);
    valid += checked::<Command>(Kind::Command, steps);
    valid += checked::<Report>(Kind::ReportA, steps);
    valid += checked::<Agreement>(Kind::Agreement, steps);
    valid += checked::<Readback>(Kind::Readback, steps);
    println!("guard octets {octets} kinds {KINDS} steps {steps} valid {valid}");
    ExitCode::SUCCESS
}

fn written<T: Payload + Default>(kind: Kind) -> Vec<u8> {
    let mut octets = vec![0; T::CELL];
    T::default().write(&Header { sequence: 1, ..Header::of(kind, 1, NONCE) }, &mut octets);
    seal(&mut octets, channel_b::crc::crc32, crc32c);
    octets
}

fn checked<T: Payload + Default>(kind: Kind, steps: u64) -> u64 {
    let mut guard = Guard::new(kind, 1, NONCE);
    let octets = written::<T>(kind);
    let crc = checksum::fastest();
    (0..steps).filter(|_| guard.check::<T>(black_box(&octets), crc).is_ok()).count() as u64
}

#[path = "../shell/checksum.rs"]
mod checksum;
