//! What the drive says of itself beside what is safe, and inputs that nobody uses.

use shm_schema::exchange::Start;
use shm_schema::profile::{Profile, common, lenze_key};
use shm_schema::report::Stop;
use std::vec::Vec;

use super::bench::{Bench, codes};

/// A sine encoder of 1,024 periods; the drive's speed may differ by 20 rpm (C15411).
fn lenze(start: Start) -> Bench {
    let codes = [(15_400, 1), (15_420, 1_024), (15_411, 20), (15_320, 3_000), (15_305, 1_000), (15_203, 0)];
    let entries: Vec<_> = codes.iter().map(|(number, value)| (lenze_key(*number, 0), *value)).collect();
    Bench::new(Profile::LenzeSm301, &entries, start)
}

/// Encoder SC05 with 1,024 periods, one pole pair; SS1 and SLS type 5.
fn atv(encoder: i64) -> Bench {
    let entries = [(1, 1), (2, 1), (4, 40), (5, encoder), (6, 1_024), (65, 1), (66, 1), (31, 100), (33, 10)];
    let sls = [(39, 5), (40, 100), (48, 900), (50, 900), (common::SPEED_DIFFERENCE, 315)];
    let entries: Vec<_> = entries.into_iter().chain(sls).collect();
    Bench::new(Profile::Atv340, &entries, Start::Settled)
}

const SINE: i64 = 5;
const OPEN_LOOP: i64 = 1;

#[test]
fn a_speed_of_the_drive_that_differs_for_two_seconds_is_212() {
    // LNZ-SPD-06, LNZ-SPD-08
    let first = |ratio: f64, own: f64| {
        let mut bench = lenze(Start::Settled);
        (bench.raw, bench.drive_ratio) = (true, ratio);
        bench.first(5_000, |_| own, |report| !codes(report).is_empty()).map(|at| (at, bench))
    };
    assert!(first(0.98, 1_000.0).is_none(), "20 rpm");
    assert!(first(0.0, 20.0).is_none());
    for (ratio, rpm) in [(0.978, 1_000.0), (0.0, 22.0), (-1.0, 11.0)] {
        let (at, mut bench) = first(ratio, rpm).expect("22 rpm");
        assert!((1_800..2_100).contains(&at), "{at}");
        let report = bench.step().report;
        assert_eq!((codes(&report), report.stop), (Vec::from([(212, 0, 0, 0)]), Stop::Sto));
    }
}

#[test]
fn a_drive_that_turns_the_other_way_round_names_what_is_inverted() {
    // ATV-ENC-09: SC07 with an encoder, SC03 without
    for (encoder, ratio, code) in
        [(SINE, -1.0, Some(0x0DB)), (OPEN_LOOP, -1.0, Some(0x0DA)), (SINE, 1.0, None), (OPEN_LOOP, 1.0, None)]
    {
        let mut bench = atv(encoder);
        (bench.raw, bench.drive_ratio, bench.word) = (true, ratio, 1);
        let report = bench.ride(1_000, |_| 300.0);
        let expected: Vec<_> = code.into_iter().map(|code| (code, 0, 0, 0)).collect();
        assert_eq!(codes(&report), expected, "{encoder} {ratio}");
        assert_eq!(report.stop == Stop::Sto, code.is_some());
    }
}

#[test]
fn a_function_asked_for_while_the_motor_coasts_is_an_error_in_the_closed_loop() {
    // ATV-SLS-09: SME071
    const SLS: u32 = 1 << 9;
    for (encoder, expected) in [(SINE, Vec::from([(0x071, 0, 0, 0)])), (OPEN_LOOP, Vec::new())] {
        let mut bench = atv(encoder);
        bench.word = 1;
        bench.ride(9, |_| 300.0);
        bench.drive_enabled = false;
        bench.ride(19, |_| 300.0);
        bench.word = 1 | SLS;
        assert_eq!(codes(&bench.ride(20, |_| 300.0)), expected, "{encoder}");
    }
}

#[test]
fn a_signal_at_a_deactivated_input_keeps_the_start_from_torque() {
    // LNZ-IN-03: 57 to 60, only during initialisation
    let mut bench = lenze(Start::Cold);
    bench.lines = [false, true, false, true];
    let report = bench.until(300);
    assert_eq!(codes(&report), [(58, 0, 0, 0), (60, 0, 0, 0)]);
    assert_eq!((report.stop, report.driving), (Stop::Sto, false));
    let mut bench = lenze(Start::Settled);
    bench.lines = [false; 4];
    bench.until(9);
    bench.lines = [true; 4];
    assert!(codes(&bench.until(50)).is_empty());
}
