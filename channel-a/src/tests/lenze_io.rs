//! The SM301's safe output, its cascade, and its encoders.

use shm_schema::exchange::Start;
use shm_schema::profile::{Profile, common, lenze_key};
use shm_schema::report::{Phase, Report, Stop};

use super::bench::{Bench, codes, image};
use crate::encoder::{Evaluation, Selection};
use crate::image::Image;
use crate::profile::Program;
use shm_schema::encoder::SlotKind;

const NEUTRAL: u32 = 0x0180_01FF;
const AIS: u32 = 1 << 16;
const AIE: u32 = 1 << 17;
const ON: u64 = 0xFFFF;

fn entries(extra: &[(u32, u32, i64)]) -> std::vec::Vec<(u32, i64)> {
    let base = [(15_305, 0, 1_000), (15_310, 0, 20), (15_311, 0, 100), (15_320, 0, 3_000), (15_203, 0, 0)];
    let mut entries = std::collections::BTreeMap::new();
    for (number, subcode, value) in base.iter().chain(extra) {
        entries.insert(lenze_key(*number, *subcode), *value);
    }
    entries.into_iter().collect()
}

fn bench(extra: &[(u32, u32, i64)]) -> Bench {
    Bench::new(Profile::LenzeSm301, &entries(extra), Start::Settled)
}

/// SD-Out1 is on while no STO is active: the inverse of status bit 0.
const OUTPUT: &[(u32, u32, i64)] = &[(15_051, 1, 0b10)];

/// SD-In4 cascades into SD-Out1 (LNZ-CAS-01, LNZ-CAS-09, LNZ-CAS-10).
fn cascade() -> Bench {
    bench(&[
        (15_035, 0, 4),
        (15_030, 4, 2),
        (15_031, 4, 1),
        (15_032, 4, 9),
        (15_300, 1, 0),
        (15_113, 0, !(1_i64 << 24)),
    ])
}

fn driven(bench: &mut Bench) -> u64 {
    bench.step().inhibit.outputs[0]
}

fn trip(bench: &mut Bench) {
    bench.word = NEUTRAL & !1;
    bench.until(20);
    bench.lines[3] = false;
    bench.word = NEUTRAL;
    bench.until(40);
}

fn press(bench: &mut Bench, bit: u32) -> Report {
    bench.word = NEUTRAL | bit;
    bench.step();
    bench.word = NEUTRAL;
    bench.step().report
}

#[test]
fn a_shorted_output_goes_off_until_it_is_acknowledged() {
    // LNZ-OUT-03, LNZ-SELF-03: code 89, and nothing but the output goes off
    let mut bench = bench(OUTPUT);
    bench.returned = Some(|_, read| read);
    bench.until(9);
    assert_eq!(driven(&mut bench), ON);
    bench.returned = Some(|line, read| if line == 0 { 0 } else { read });
    let report = bench.until(20);
    assert_eq!((codes(&report).as_slice(), report.stop), ([(89, 0, 0, 0)].as_slice(), Stop::None));
    assert_eq!(driven(&mut bench), 0);
    bench.returned = Some(|_, read| read);
    bench.until(50);
    assert_eq!(driven(&mut bench), 0, "gone, but not acknowledged");
    assert_eq!(codes(&press(&mut bench, AIE)), []);
    assert_eq!(driven(&mut bench), ON);
}

#[test]
fn an_output_that_stays_high_cannot_be_acknowledged() {
    // DEC-15: its cause stands
    let mut bench = bench(OUTPUT);
    bench.word = NEUTRAL & !1;
    bench.returned = Some(|_, read| read);
    bench.until(9);
    bench.returned = Some(|_, _| ON);
    assert_eq!(codes(&bench.until(20)), [(89, 0, 0, 0)]);
    bench.word |= AIE;
    assert_eq!(codes(&bench.until(21)), [(89, 0, 0, 0)]);
}

#[test]
fn a_cascade_comes_back_a_tenth_of_a_second_after_its_acknowledgement() {
    // LNZ-CAS-04, LNZ-CAS-05, LNZ-CAS-06
    let mut bench = cascade();
    bench.until(9);
    assert_eq!(driven(&mut bench), ON);
    trip(&mut bench);
    assert_eq!(driven(&mut bench), 0);
    bench.word = NEUTRAL | AIS;
    let at = bench.k;
    assert_eq!(bench.first(at + 150, |_| 0.0, |report| report.drive.outputs != 0), Some(at + 100));
    bench.lines[3] = true;
    assert_eq!(bench.until(at + 110).stop, Stop::None);
}

#[test]
fn a_restart_that_does_not_come_round_the_cascade_is_108() {
    // LNZ-CAS-13, DEC-46
    let mut bench = cascade();
    trip(&mut bench);
    bench.word = NEUTRAL | AIS;
    let at = bench.k;
    assert_eq!(codes(&bench.until(at + 1_400)), []);
    let report = bench.until(at + 1_401);
    assert_eq!((codes(&report).as_slice(), report.stop), ([(108, 0, 0, 0)].as_slice(), Stop::Sto));
    assert_eq!(driven(&mut bench), 0);
    assert_eq!(codes(&press(&mut bench, AIE)), []);
}

#[test]
fn a_cascade_output_that_stays_on_is_109() {
    // LNZ-CAS-13
    let mut bench = cascade();
    bench.returned = Some(|_, read| read);
    bench.until(9);
    bench.returned = Some(|_, _| ON);
    trip(&mut bench);
    let report = bench.until(45);
    assert_eq!((codes(&report).as_slice(), report.stop), ([(109, 0, 0, 0)].as_slice(), Stop::Sto));
}

#[test]
fn a_discrepancy_at_the_cascade_input_is_109() {
    // LNZ-CAS-13: channel A's line falls, the other does not
    let mut bench = cascade();
    bench.split = Some(3);
    bench.until(9);
    bench.lines[3] = false;
    let report = bench.until(40);
    assert_eq!((codes(&report).as_slice(), report.stop), ([(109, 0, 0, 0)].as_slice(), Stop::Sto));
}

#[test]
fn the_response_time_of_the_encoder_monitoring_is_one_of_three() {
    // C15410; LNZ-SPD-02: the shortest is not for a sole resolver
    let cases = [(1, 0, 0, true), (1, 10, 0, true), (1, 20, 0, true), (1, 5, 0, false)];
    let resolver = [(2, 0, 0, false), (2, 10, 0, true), (2, 0, 1, true)];
    for (system, time, position, accepted) in cases.into_iter().chain(resolver) {
        let set = [(15_400, 0, system), (15_410, 0, time), (15_500, 0, position)];
        let report = bench(&set).until(1);
        let text = std::format!("{system} {time} {position}");
        assert_eq!(report.phase != Phase::Refused, accepted, "{text}");
    }
}

/// What an axis evaluates whose channel A looks at slot 2.
fn selected(extra: &[(u32, u32, i64)]) -> Selection {
    let mut entries = entries(extra);
    entries.push((common::ENCODER_A, 2));
    entries.sort_unstable();
    Program::build(&Image::parse(&image(Profile::LenzeSm301, &entries)).unwrap()).encoder
}

#[test]
fn a_position_encoder_has_its_own_kind_direction_and_gear() {
    // LNZ-EX-04, LNZ-EX-05, LNZ-SPD-12, LNZ-SPD-17
    for (motor, position, inverted) in [(0, 0, false), (0, 1, true), (1, 1, false), (1, 0, true)] {
        let set = [(15_500, 0, 2), (15_501, 0, 2_543), (15_409, 0, motor), (15_502, 0, position)];
        let selection = selected(&set);
        assert_eq!((selection.kind, selection.slot), (Some(SlotKind::Digital), 2));
        assert_eq!((selection.gear, selection.inverted), (2_543, inverted));
    }
    assert_eq!(selected(&[(15_500, 0, 1)]).kind, None, "sine or TTL");
    assert_eq!(selected(&[(15_501, 0, 2_543)]).gear, 100, "no position encoder");
}

#[test]
fn the_gear_turns_the_encoders_way_into_the_motors() {
    // LNZ-EX-02, LNZ-EX-04: i = 25.43
    use shm_schema::encoder::{Encoder, Slot};
    use shm_schema::exchange::Sampled;
    let mut evaluation = Evaluation::new(selected(&[(15_500, 0, 2), (15_501, 0, 2_543)]));
    for k in 1..10_u64 {
        let slot = Slot { kind: SlotKind::Digital, digital: 16_384 * k as i64, ..Slot::default() };
        let payload =
            Encoder { slots: [Slot::default(), slot], period_ns: 1_000_000_000, ..Encoder::default() };
        let sample = Sampled { sequence: k, timestamp_ns: k * 1_000_000_000, crc32: 0, payload };
        let reading = evaluation.take(&sample).unwrap();
        assert_eq!(reading.position, (416_645.12 * k as f64).round() as i64);
        // A quarter revolution in a second are 15 rpm at the encoder.
        assert!(k < 3 || reading.speed == 381_450, "{}", reading.speed);
    }
}
