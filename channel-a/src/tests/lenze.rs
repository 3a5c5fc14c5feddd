//! The SM301, cycle by cycle.

use shm_schema::exchange::Start;
use shm_schema::profile::{Profile, lenze_key};
use shm_schema::report::{Phase, Stop};

use super::bench::{Bench, codes};

pub(super) const NEUTRAL: u32 = 0x0180_01FF;
pub(super) const AIS: u32 = 1 << 16;
pub(super) const AIE: u32 = 1 << 17;
pub(super) const ES: u32 = 1 << 9;
pub(super) const OMS: u32 = 1 << 11;

/// Stopping time 1,000 ms, window 20 rpm, SMS 3,000 rpm, no limited increment.
const SET: &[(u32, u32, i64)] =
    &[(15_305, 0, 1_000), (15_310, 0, 20), (15_311, 0, 100), (15_320, 0, 3_000), (15_203, 0, 0)];

pub(super) fn bench(extra: &[(u32, u32, i64)]) -> Bench {
    let mut entries: std::collections::BTreeMap<u32, i64> = std::collections::BTreeMap::new();
    for (number, subcode, value) in SET.iter().chain(extra) {
        entries.insert(lenze_key(*number, *subcode), *value);
    }
    let entries: std::vec::Vec<(u32, i64)> = entries.into_iter().collect();
    Bench::new(Profile::LenzeSm301, &entries, Start::Settled)
}

pub(super) fn without(bit: u32) -> u32 {
    NEUTRAL & !(1 << bit)
}

#[test]
fn nothing_requested_permits_torque() {
    let report = bench(&[]).until(5);
    assert_eq!((report.phase, report.status.0[0], report.driving), (Phase::Operational, 0, true));
}

#[test]
fn sto_is_left_by_the_restart_acknowledge_of_the_bus() {
    // LNZ-RST-01, LNZ-ACK-02
    let mut bench = bench(&[]);
    bench.until(5);
    bench.word = without(0);
    assert_eq!(bench.until(6).status.0[0], 1);
    bench.word = NEUTRAL;
    assert_eq!(bench.until(8).stop, Stop::Sto);
    bench.word |= AIS;
    assert!(bench.until(9).driving);
}

#[test]
fn ss1_waits_its_full_time_and_judges_the_window_then() {
    // LNZ-SS1-03, LNZ-SS1-04, LNZ-EX-28
    for (rpm, expected) in [(20.0, &[] as &[(u32, u32, u32, u32)]), (20.001, &[(97, 0, 0, 0)])] {
        let mut bench = bench(&[]);
        bench.ride(9, |_| 1_000.0);
        bench.word = without(1);
        assert_eq!(bench.ride(10, |_| 1_000.0).status.0[0], 1 << 1);
        assert_eq!(bench.first(2_000, |_| rpm, |report| report.status.bit(0)), Some(1_010));
        let report = bench.until(1_011);
        assert_eq!(codes(&report), expected);
    }
}

#[test]
fn ss1_at_standstill_ends_after_its_extra_time() {
    // LNZ-SS1-04, LNZ-SS1-11
    let mut bench = bench(&[(15_306, 0, 1), (15_307, 0, 200)]);
    bench.ride(9, |_| 1_000.0);
    bench.word = without(1);
    let rpm = |t: f64| if t < 100.0 { 500.0 } else { 0.0 };
    assert_eq!(bench.first(2_000, rpm, |report| report.status.bit(0)), Some(300));
    assert_eq!(bench.until(301).status.0[0], 0b11);
}

#[test]
fn the_ramp_is_held_for_a_tenth_and_falls_to_zero() {
    // LNZ-EX-09, LNZ-EX-10, DEC-49
    let ramp = |extra: &[(u32, u32, i64)], at: f64, rpm: f64| {
        let mut set = std::vec::Vec::from([(15_315, 0, 1)]);
        set.extend_from_slice(extra);
        let mut bench = bench(&set);
        bench.ride(9, |_| 1_000.0);
        bench.word = without(1);
        let slow = |t: f64| {
            if t < 10.5 {
                1_000.0
            } else if (t - 10.0 - at).abs() < 0.5 {
                rpm
            } else {
                0.0
            }
        };
        codes(&bench.ride(990, slow))
    };
    assert_eq!(ramp(&[], 100.0, 1_020.0), []);
    assert_eq!(ramp(&[], 100.0, 1_020.1), [(110, 0, 0, 0)]);
    assert_eq!(ramp(&[(15_317, 0, 10)], 100.0, 1_100.0), []);
    // Half of the falling part: half of the start value.
    assert_eq!(ramp(&[], 550.0, 510.0), []);
    assert_eq!(ramp(&[], 550.0, 510.1), [(110, 0, 0, 0)]);
    assert_eq!(ramp(&[(15_316, 0, 100)], 300.0, 1_020.0), []);
    // Never below the tolerance window.
    assert_eq!(ramp(&[], 979.0, 20.0), []);
}

#[test]
fn ss2_goes_to_sos_and_keeps_the_position() {
    // LNZ-SS2-01, LNZ-SOS-01, LNZ-SOS-05, LNZ-EX-29
    let mut bench = bench(&[]);
    bench.travel = false;
    bench.until(9);
    bench.word = without(2);
    assert_eq!(bench.until(1_009).status.0[0], 1 << 2);
    assert_eq!(bench.until(1_010).status.0[0], 1 << 2 | 1 << 16);
    bench.position = 100;
    assert!(bench.ride(1_011, |_| 50.0).errors.is_empty());
    bench.position = 101;
    assert_eq!(codes(&bench.until(1_012)), [(106, 0, 0, 0)]);
}

#[test]
fn a_stop_to_sto_returns_to_sos_at_once() {
    // LNZ-SOS-04, LNZ-PRIO-04, LNZ-EX-11
    let mut bench = bench(&[]);
    bench.travel = false;
    bench.word = without(2);
    bench.until(1_001);
    bench.word = without(2) & without(0);
    assert_eq!(bench.until(1_002).stop, Stop::Sto);
    bench.position = 5_000;
    bench.word = without(2);
    bench.until(1_003);
    bench.word |= AIS;
    let report = bench.until(1_004);
    assert_eq!((report.stop, report.errors.is_empty()), (Stop::Sos, true));
}

#[test]
fn sls_is_monitored_after_its_braking_time_and_shown_as_soon_as_it_is_kept() {
    // LNZ-EX-30, LNZ-SLS-02, LNZ-SLS-05
    let mut bench = bench(&[(15_330, 1, 500), (15_331, 1, 300)]);
    bench.ride(9, |_| 800.0);
    bench.word = without(3);
    assert_eq!(bench.ride(100, |_| 800.0).status.0[0], 1 << 3);
    assert_eq!(bench.ride(101, |_| 500.0).status.0[0], 1 << 3 | 1 << 17);
    assert!(bench.ride(309, |_| 800.0).errors.is_empty());
    assert_eq!(codes(&bench.ride(310, |_| 800.0)), [(98, 0, 0, 0)]);
}

#[test]
fn a_speed_that_stays_too_high_is_sto_after_the_response_time() {
    // LNZ-EX-27, LNZ-SMS-06
    let mut bench = bench(&[(15_321, 0, 1), (15_350, 0, 200)]);
    let report = bench.ride(10, |t| if t < 9.5 { 0.0 } else { 3_001.0 });
    assert_eq!((codes(&report).as_slice(), report.stop), ([(105, 0, 0, 0)].as_slice(), Stop::Ss1));
    assert_eq!(bench.ride(209, |_| 3_001.0).stop, Stop::Ss1);
    let report = bench.ride(210, |_| 3_001.0);
    assert_eq!(
        (codes(&report).as_slice(), report.stop),
        ([(102, 0, 0, 0), (105, 0, 0, 0)].as_slice(), Stop::Sto)
    );
}

#[test]
fn a_speed_that_was_inside_in_between_is_judged_when_the_response_time_has_elapsed() {
    // LNZ-EX-27: T2 + C15350
    let run = |inside: f64| {
        let mut bench = bench(&[(15_321, 0, 1), (15_350, 0, 200)]);
        bench.ride(10, |t| if t < 9.5 { 0.0 } else { 3_001.0 });
        bench.ride(209, |t| if t < 100.0 { 3_000.0 } else { 3_001.0 });
        bench.ride(210, |_| inside)
    };
    assert_eq!(codes(&run(3_001.0)), [(102, 0, 0, 0), (105, 0, 0, 0)]);
    assert_eq!(run(3_000.0).stop, Stop::Ss1);
}

#[test]
fn what_leads_to_sto_ends_the_evaluation_in_its_instant() {
    // DEC-14: 97 without 102, although the response time elapses in the same cycle
    let mut bench = bench(&[(15_321, 0, 1), (15_350, 0, 100), (15_305, 0, 100)]);
    bench.ride(10, |t| if t < 9.5 { 0.0 } else { 3_001.0 });
    assert_eq!(codes(&bench.ride(110, |_| 3_001.0)), [(97, 0, 0, 0), (105, 0, 0, 0)]);
}

#[test]
fn sdi_counts_from_the_furthest_position() {
    // LNZ-SDI-03, LNZ-EX-31, DEC-49
    let mut bench = bench(&[(15_342, 0, 50), (15_343, 0, 0)]);
    bench.travel = false;
    bench.word = without(7);
    assert_eq!(bench.until(5).status.0[0], 1 << 7 | 1 << 21);
    bench.position = 10_000;
    bench.until(6);
    bench.position = 9_950;
    assert!(bench.until(7).errors.is_empty());
    bench.position = 9_949;
    assert_eq!(codes(&bench.until(8)), [(103, 0, 0, 0)]);
}

#[test]
fn an_error_stop_is_acknowledged_before_the_restart() {
    // LNZ-ACK-06
    let mut bench = bench(&[]);
    bench.ride(5, |_| 0.0);
    bench.ride(6, |_| 3_001.0);
    bench.word = NEUTRAL | AIS;
    bench.ride(7, |_| 0.0);
    bench.word = NEUTRAL | AIE;
    assert_eq!(bench.ride(8, |_| 0.0).status.0[0], 1);
    bench.word |= AIS;
    assert!(bench.ride(9, |_| 0.0).driving);
}

#[test]
fn terminals_acknowledge_with_the_falling_edge() {
    // LNZ-ACK-01
    let mut bench = bench(&[]);
    bench.until(5);
    bench.word = without(0);
    bench.until(6);
    bench.word = NEUTRAL;
    bench.ais = u64::MAX;
    assert_eq!(bench.until(310).stop, Stop::Sto);
    bench.ais = 0;
    assert!(bench.until(311).driving);
}

#[test]
fn the_filter_inhibits_bits_of_the_bus() {
    // LNZ-EX-14
    let mut bench = bench(&[(15_113, 0, !3_i64)]);
    bench.word = without(0) & without(1);
    assert!(bench.until(5).driving);
    bench.word = without(2);
    assert_eq!(bench.until(6).stop, Stop::Ss2);
}

#[test]
fn an_input_requests_its_function_and_reports_its_discrepancy() {
    // LNZ-IN-14, LNZ-IN-15, LNZ-ERR-06
    let mut bench = bench(&[(15_030, 1, 2), (15_032, 1, 3), (15_330, 1, 500)]);
    assert_eq!(bench.until(9).status.0[0], 1 << 24);
    bench.lines[0] = false;
    let at = bench.first(30, |_| 0.0, |report| report.status.bit(3)).unwrap();
    assert!((12..=13).contains(&at), "{at}");
    assert_eq!(bench.until(40).status.0[0], 1 << 3 | 1 << 17);
}

#[test]
fn special_operation_stops_and_the_enable_switch_moves() {
    // LNZ-EX-32, LNZ-OMS-03, LNZ-OMS-07, LNZ-ES-03
    let mut bench = bench(&[(15_200, 0, 2), (15_201, 0, 3), (15_330, 1, 500)]);
    bench.until(5);
    bench.word = NEUTRAL | OMS;
    assert_eq!(bench.until(6).status.0[0], 1 << 2 | 1 << 3 | 1 << 11 | 1 << 17 | 1 << 29);
    assert_eq!(bench.until(1_010).stop, Stop::Sos);
    bench.word |= ES;
    let report = bench.ride(1_011, |_| 0.0);
    assert_eq!((report.stop, report.status.bit(9)), (Stop::None, true));
    // A simple stop is overridden, an emergency stop is not.
    bench.word &= !1;
    assert_eq!(bench.ride(1_012, |_| 400.0).stop, Stop::None);
    assert_eq!(codes(&bench.ride(1_013, |_| 501.0)), [(98, 0, 0, 0)]);
}

#[test]
fn an_emergency_stop_acts_in_special_operation_too() {
    // LNZ-OMS-08, LNZ-SSE-01
    let mut bench = bench(&[(15_200, 0, 2)]);
    bench.word = NEUTRAL | OMS;
    bench.until(5);
    bench.word |= ES;
    assert_eq!(bench.until(6).stop, Stop::None);
    bench.word &= !(1 << 23);
    let report = bench.until(7);
    assert_eq!((report.stop, report.status.bit(23)), (Stop::Sto, true));
}

#[test]
fn special_operation_limits_the_increment() {
    // LNZ-SLI-01, LNZ-SLI-02
    let mut bench = bench(&[(15_200, 0, 2), (15_203, 0, 1_000)]);
    bench.travel = false;
    bench.word = NEUTRAL | OMS;
    bench.until(5);
    bench.word |= ES;
    assert!(bench.until(6).status.bit(10));
    bench.position = 1_000;
    assert!(bench.until(7).errors.is_empty());
    bench.position = 1_001;
    assert_eq!(codes(&bench.until(8)), [(111, 0, 0, 0)]);
}

#[test]
fn the_way_back_to_normal_operation_needs_a_restart_acknowledge() {
    // LNZ-OMS-12
    let mut bench = bench(&[(15_200, 0, 2), (15_300, 2, 1), (15_308, 0, 1)]);
    bench.word = NEUTRAL | OMS;
    assert_eq!(bench.until(5).stop, Stop::Sos);
    bench.word = NEUTRAL;
    assert_eq!(bench.until(10).stop, Stop::Sos);
    bench.word |= AIS;
    assert_eq!(bench.until(11).stop, Stop::None);
}

#[test]
fn without_an_encoder_ss1_takes_the_drives_standstill() {
    // LNZ-SS1-02
    let set = [(15_400, 0, 0), (15_320, 0, 0), (15_306, 0, 1)];
    let mut bench = bench(&set);
    bench.until(5);
    bench.word = without(1);
    assert_eq!(bench.until(50).stop, Stop::Ss1);
    bench.drive_n0 = true;
    assert_eq!(bench.until(51).stop, Stop::Sto);
}

#[test]
fn two_mode_selectors_are_refused() {
    // LNZ-IN-06
    let set = [(15_030, 1, 2), (15_030, 2, 2), (15_031, 1, 2), (15_031, 2, 2), (15_113, 0, !(1_i64 << 11))];
    let report = bench(&set).until(1);
    assert_eq!(report.phase, Phase::Refused);
    assert_eq!(report.errors.codes[0].code, 167);
}

#[test]
fn an_input_acts_after_two_milliseconds_and_its_delay() {
    // LNZ-IN-11, DEC-02, DEC-24: low from 100.0 ms on
    for (delay, at) in [(0, 102), (20, 122)] {
        let set = [(15_030, 1, 2), (15_031, 1, 1), (15_034, 1, delay), (15_033, 1, 100)];
        let mut bench = bench(&set);
        bench.until(99);
        // Of the samples of cycle 100 only the newest is low.
        bench.line_patterns = Some(u64::MAX - 1);
        bench.step();
        bench.line_patterns = None;
        bench.lines[0] = false;
        assert_eq!(bench.first(200, |_| 0.0, |report| report.status.bit(0)), Some(at));
    }
}

#[test]
fn the_enable_switch_need_not_wait_for_the_stop_of_special_operation() {
    // LNZ-OMS-14, LNZ-OMS-22: C15200 SS1, C15201 SLS1
    let set = [(15_200, 0, 1), (15_201, 0, 3), (15_330, 1, 50), (15_331, 1, 500), (15_100, 0, 1)];
    let mut bench = bench(&set);
    bench.until(49);
    bench.word |= OMS;
    assert_eq!(bench.until(59).stop, Stop::Ss1);
    bench.word |= ES;
    let report = bench.until(60);
    assert_eq!((report.status.bit(9), report.stop), (true, Stop::None));
}

#[test]
fn what_a_parameter_adds_is_no_request() {
    // DEC-21: permanent direction (C15340), direction with SLS (C15333), output and mode bits
    let mut bench = bench(&[(15_340, 0, 1), (15_333, 1, 2), (15_100, 0, 1)]);
    assert_eq!(bench.until(5).requested.0[0], 0);
    bench.word = (without(3) & !(1 << 24)) | OMS | ES;
    assert_eq!(bench.until(6).requested.0[0], 1 << 3);
}

#[test]
fn a_higher_stop_ends_a_lower_one_and_not_the_other_way_round() {
    // LNZ-EX-35
    let then = |first: u32, second: u32| {
        let mut bench = bench(&[]);
        bench.word = without(first);
        bench.until(10);
        bench.word &= without(second);
        bench.until(11).stop
    };
    assert_eq!([then(1, 0), then(2, 0)], [Stop::Sto; 2]);
    assert_eq!([then(2, 1), then(1, 2)], [Stop::Ss1; 2]);
}

#[test]
fn the_level_of_special_operation_is_a_parameter() {
    // LNZ-EX-12, LNZ-EX-13: a key switch closes for it, a safety door opens
    for (at_low, low_is_special) in [(0, false), (1, true)] {
        let set = [
            (15_030, 1, 2),
            (15_031, 1, 2),
            (15_032, 1, 9),
            (15_113, 0, !(1_i64 << 11)),
            (15_202, 0, at_low),
        ];
        let mut bench = bench(&set);
        bench.lines[0] = false;
        let low = bench.until(20).status.bit(29);
        bench.lines[0] = true;
        let high = bench.until(40).status.bit(29);
        assert_eq!((low, high), (low_is_special, !low_is_special));
    }
}
