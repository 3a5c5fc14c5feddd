//! The ATV340, cycle by cycle. One pole pair: 50 Hz are 3,000 rpm.

use shm_schema::exchange::Start;
use shm_schema::profile::{Profile, common};
use shm_schema::report::{Phase, Stop};

use super::bench::{Bench, codes};

const PERMIT: u32 = 1;
const SS1: u32 = 1 << 2;
const RESET: u32 = 1 << 7;
const SLS: u32 = 1 << 9;
const SWITCH: u32 = 1 << 14;

/// SS1: 10 Hz/s from +5 Hz after 5 ms to 5 Hz (the read-back example ATV-EX-08).
const SET: &[(u32, i64)] = &[
    (1, 1),
    (2, 1),
    (4, 40),
    (5, 8),
    (6, 1),
    (65, 1),
    (66, 1),
    (36, 1),
    (30, 200),
    (31, 100),
    (32, 50),
    (33, 50),
    (34, 5),
    (35, 1),
    (39, 2),
    (40, 100),
    (43, 20),
    (46, 10),
    (48, 300),
    (50, 250),
    (54, 1_000),
];

fn bench(extra: &[(u32, i64)]) -> Bench {
    let mut entries: std::collections::BTreeMap<u32, i64> = SET.iter().copied().collect();
    entries.extend(extra.iter().copied());
    entries.insert(common::SPEED_DIFFERENCE, 315);
    let entries: std::vec::Vec<(u32, i64)> = entries.into_iter().collect();
    Bench::new(Profile::Atv340, &entries, Start::Settled)
}

fn hz(frequency: f64) -> f64 {
    frequency * 60.0
}

#[test]
fn bit_0_permits_torque_and_its_absence_is_sto() {
    // ATV-STO-05
    let mut bench = bench(&[]);
    let report = bench.until(5);
    assert_eq!((report.phase, report.status.0[0], report.driving), (Phase::Operational, 0, true));
    bench.word = 0;
    assert_eq!(bench.until(6).status.0[0], 1);
    bench.word = PERMIT;
    assert!(bench.until(7).driving);
}

#[test]
fn ss1_is_judged_from_its_highest_frequency_after_its_delay() {
    // ATV-EX-13: 45 Hz one second after the delay
    for (frequency, trips) in [(45.0, false), (45.001, true)] {
        let mut bench = bench(&[]);
        bench.ride(9, |_| hz(49.0));
        bench.word = PERMIT | SS1;
        let rpm = |t: f64| match t as u64 {
            10..=12 => hz(50.0),
            1_015 => hz(frequency),
            _ => hz(44.0),
        };
        let report = bench.ride(1_015, rpm);
        assert_eq!(report.status.bit(6), trips, "{frequency}");
        assert_eq!(codes(&report).as_slice(), if trips { &[(0x011, 0, 0, 0)][..] } else { &[][..] });
    }
}

#[test]
fn ss1_ends_at_its_standstill_level_and_releases_after_100_ms() {
    // ATV-SS1-10, ATV-SS1-11
    let mut bench = bench(&[]);
    bench.ride(9, |_| hz(20.0));
    bench.word = PERMIT | SS1;
    let report = bench.ride(10, |_| hz(20.0));
    assert_eq!(
        (report.status.0[0], report.drive.brake, report.drive.deceleration_rpm_s),
        (1 << 2, true, 1_200)
    );
    bench.word = PERMIT;
    bench.ride(199, |_| hz(10.0));
    assert_eq!(bench.ride(200, |_| hz(5.0)).status.0[0], 1 | 1 << 7);
    assert_eq!(bench.until(299).stop, Stop::Sto);
    assert!(bench.until(300).driving);
}

#[test]
fn ss1_with_its_request_stays_in_sto_until_it_is_gone() {
    // ATV-SS1-12
    let mut bench = bench(&[]);
    bench.word = PERMIT | SS1;
    assert_eq!(bench.until(500).stop, Stop::Sto);
    bench.word = PERMIT;
    assert!(bench.until(501).driving);
}

#[test]
fn the_fifth_violation_needs_a_restart() {
    // ATV-SS1-09
    let mut bench = bench(&[]);
    for round in 1..=5 {
        let k = bench.k;
        bench.ride(k, |_| hz(50.0));
        bench.word = PERMIT | SS1;
        let report = bench.ride(k + 700, |_| hz(50.0));
        let expected = if round < 5 { 0x011 } else { 0x068 };
        assert_eq!(codes(&report), [(expected, 0, 0, 0)]);
        bench.word = PERMIT | RESET;
        let report = bench.ride(k + 702, |_| 0.0);
        assert_eq!(report.status.bit(6), round == 5);
        bench.word = PERMIT;
        bench.ride(k + 704, |_| 0.0);
    }
}

#[test]
fn sls_type_2_follows_its_ramp_and_keeps_its_threshold() {
    // ATV-SLST2-01, ATV-SLST2-02, ATV-SLST2-03, ATV-SEQ-04
    let mut bench = bench(&[]);
    bench.ride(9, |_| hz(40.0));
    bench.word = PERMIT | SLS;
    let rpm = |t: f64| hz((40.0 - 0.01 * (t - 10.0)).max(25.0));
    let report = bench.ride(1_500, rpm);
    assert_eq!((report.status.0[0], report.errors.is_empty()), (1 << 9, true));
    assert_eq!((report.drive.limit_set_point, report.drive.set_point_max_mrpm), (true, 1_500_000));
    assert_eq!(codes(&bench.ride(1_501, |_| hz(30.001))), [(0x0AB, 0, 0, 0)]);
}

#[test]
fn sls_below_standstill_is_sto_without_error_until_it_is_deselected() {
    // ATV-SLST2-06, ATV-SLST2-07, ATV-SEQ-05
    let mut bench = bench(&[]);
    bench.word = PERMIT | SLS;
    assert_eq!(bench.until(999).stop, Stop::None);
    let report = bench.until(1_000);
    assert_eq!((report.stop, report.errors.is_empty(), report.status.bit(7)), (Stop::Sto, true, true));
    bench.word = PERMIT;
    assert!(bench.until(1_001).driving);
}

#[test]
fn sls_type_3_executes_ss1_above_its_threshold() {
    // ATV-SLST3-01, ATV-SLST3-05, ATV-SEQ-06
    let mut bench = bench(&[(39, 3)]);
    bench.ride(9, |_| hz(40.0));
    bench.word = PERMIT | SLS;
    assert_eq!(bench.ride(10, |_| hz(40.0)).stop, Stop::Ss1);
    bench.word = PERMIT;
    assert_eq!(bench.ride(100, |_| hz(6.0)).stop, Stop::Ss1);
    assert_eq!(bench.ride(101, |_| hz(5.0)).stop, Stop::Sto);
    assert!(bench.ride(201, |_| 0.0).driving);
}

#[test]
fn an_ss1_requested_in_the_sto_of_sls_begins_when_that_is_left() {
    // ATV-SLS-07, DEC-11, DEC-13: with the cycle that deselects SLS, and before it
    for early_ms in [0, 100] {
        let mut bench = bench(&[(39, 3)]);
        bench.ride(9, |_| hz(35.0));
        bench.word = PERMIT | SLS;
        assert_eq!(bench.ride(10, |_| hz(35.0)).stop, Stop::Ss1);
        assert_eq!(bench.ride(500, |_| 0.0).stop, Stop::Sto);
        bench.word |= SS1;
        (0..early_ms).for_each(|_| {
            bench.step();
        });
        bench.word = PERMIT | SS1;
        bench.rpm = hz(20.0);
        assert_eq!(bench.step().report.stop, Stop::Ss1, "{early_ms}");
    }
}

#[test]
fn an_ss1_that_ran_beside_the_one_of_sls_holds_its_sto() {
    // DEC-11: its edge came before
    let mut bench = bench(&[(39, 3)]);
    bench.ride(9, |_| hz(35.0));
    bench.word = PERMIT | SLS | SS1;
    bench.ride(500, |_| 0.0);
    bench.word = PERMIT | SS1;
    assert_eq!(bench.ride(700, |_| 0.0).stop, Stop::Sto);
}

#[test]
fn an_ss1_of_sls_that_a_higher_stop_has_forestalled_holds_nothing() {
    // DEC-13: SMS leads to STO with the sample that makes SLS ask for SS1
    let mut bench = bench(&[(39, 3), (56, 1), (57, 350), (58, 350)]);
    bench.ride(9, |_| hz(34.0));
    bench.word = PERMIT | SLS;
    let violated = [(0x0B4, 0, 0, 0)];
    assert_eq!(codes(&bench.ride(10, |_| hz(36.0))), violated);
    bench.word |= RESET;
    let report = bench.ride(11, |_| hz(20.0));
    assert_eq!((codes(&report).as_slice(), report.stop), ([].as_slice(), Stop::Ss1));
}

#[test]
fn sms_has_three_modes() {
    // ATV-SMS-03, ATV-SMS-04, ATV-SMS-07, ATV-SMS-08, ATV-SEQ-09
    let set = |mode| [(56, mode), (57, 450), (58, 450), (59, 350), (60, 350)];
    let judge = |mode, word, frequency| {
        let mut bench = bench(&set(mode));
        bench.word = word;
        codes(&bench.ride(3, |_| hz(frequency)))
    };
    assert_eq!(judge(1, PERMIT, 45.0), []);
    assert_eq!(judge(1, PERMIT, 45.001), [(0x0B4, 0, 0, 0)]);
    assert_eq!(judge(1, PERMIT, -45.001), [(0x0B5, 0, 0, 0)]);
    assert_eq!(judge(2, PERMIT, 36.0), []);
    assert_eq!(judge(2, PERMIT | SWITCH, 36.0), [(0x0B4, 0, 0, 0)]);
    assert_eq!(judge(3, PERMIT, 60.0), []);
    assert_eq!(judge(3, PERMIT | SWITCH, 46.0), [(0x0B4, 0, 0, 0)]);
    let mut bench = bench(&set(2));
    bench.word = PERMIT | SWITCH;
    assert_eq!(bench.until(5).status.0[0], 1 << 14 | 1 << 15);
}

#[test]
fn what_is_not_configured_or_reserved_is_an_error() {
    // DEC-33, ATV-SS1-18, ATV-SLS-13, ATV-SMS-14
    let cases = [(1 << 3, 0x152), (SS1, 0x156), (SLS, 0x157), (SWITCH, 0x158)];
    for (bits, number) in cases {
        let mut bench = bench(&[(65, 0), (66, 0)]);
        bench.until(5);
        bench.word = PERMIT | bits;
        let report = bench.until(6);
        assert_eq!((codes(&report)[0].0, report.stop), (number, Stop::Sto), "{bits:x}");
        bench.word = PERMIT;
        bench.until(7);
        bench.word = PERMIT | RESET;
        assert!(bench.until(8).driving);
    }
}

#[test]
fn pole_pairs_turn_frequency_into_speed() {
    // DEC-32: 45 Hz with 3 pole pairs are 900 rpm
    let mut bench = bench(&[(2, 3), (56, 1), (57, 450), (58, 450)]);
    assert!(bench.ride(3, |_| 900.0).errors.is_empty());
    assert_eq!(codes(&bench.ride(4, |_| 900.001)), [(0x0B4, 0, 0, 0)]);
}

#[test]
fn levels_of_sls_above_sms_are_refused() {
    // ATV-SLS-04
    let report = bench(&[(56, 1), (57, 250), (58, 450)]).until(1);
    assert_eq!((report.phase, report.errors.codes[0].code), (Phase::Refused, 0x032));
}

#[test]
fn the_longest_way_of_ss1_ends_at_its_standstill_level() {
    // ATV-EX-14: 5 ms + (50 + 5 - 5) Hz / 10 Hz/s, without the bus; ATV-SEQ-01
    let mut bench = bench(&[]);
    bench.ride(9, |_| hz(50.0));
    bench.word = PERMIT | SS1;
    let line = |t: f64| hz(50.0 - 0.01 * (t - 15.0).max(0.0));
    let at = bench.first(6_000, line, |report| report.stop == Stop::Sto);
    assert!(at.is_some_and(|at| at <= 10 + 5 + 5_000), "{at:?}");
    assert!(bench.until(bench.k).errors.is_empty());
}

#[test]
fn sls_from_standstill_goes_on_when_the_level_is_reached_in_time() {
    // ATV-SEQ-05
    let mut bench = bench(&[]);
    bench.word = PERMIT | SLS;
    let report = bench.ride(1_500, |t| if t < 900.0 { 0.0 } else { hz(10.0) });
    assert_eq!((report.stop, report.errors.is_empty(), report.status.bit(9)), (Stop::None, true, true));
}
