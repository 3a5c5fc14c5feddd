//! The functions of the AMK profile, cycle by cycle.

use super::bench::{Bench, codes};
use shm_schema::report::Stop;

const NEUTRAL: u32 = 0x7E7F;
const VALID: u32 = 0xF000_0000;
const SMS: u32 = 1 << 8;
const ACK: u32 = 1 << 7;
/// 3,000 rpm in 1,000 ms; SS1 window 10 rpm, SS2 and SOS 10 rpm and 100 increments.
const SET: &[(u32, i64)] = &[
    (2, 450),
    (3, 315),
    (20, 1_000),
    (21, 10),
    (25, 1_000),
    (26, 10),
    (27, 100),
    (28, 10),
    (29, 100),
    (64, 5),
    (67, 3_000),
    (54, 100),
    (56, 1_000),
    (57, 500),
    (58, 1),
    (59, 0),
    (61, 1_000),
    (62, 300),
    (30, 50),
    (32, 500),
    (33, 1_500),
    (34, 1_000),
    (65, 1_000),
    (66, -100),
];

fn without(bit: u32) -> u32 {
    NEUTRAL & !(1 << bit)
}

#[test]
fn nothing_requested_shows_sms_and_valid_and_permits_torque() {
    let report = Bench::amk(SET).until(20);
    assert_eq!((report.status.0[0], report.ready, report.driving), (VALID | SMS, true, true));
}

#[test]
fn sto_takes_effect_in_its_cycle_and_ends_with_its_request() {
    // AMK-STO-04, DEC-12
    let mut bench = Bench::amk(SET);
    bench.until(9);
    bench.word = without(0);
    let report = bench.until(10);
    assert_eq!((report.status.0[0], report.stop, report.driving), (VALID | 1, Stop::Sto, false));
    bench.word = NEUTRAL;
    assert!(bench.until(11).driving);
}

#[test]
fn ss1_follows_the_line_and_ends_in_sto_when_the_line_meets_the_window() {
    // AMK-EX-SS1-1: from 1,500 rpm at 3 rpm/ms the line is at 10 rpm after 496.67 ms
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 1_500.0);
    bench.word = without(1);
    let rpm = |t: f64| (1_500.0 - 3.5 * (t - 10.0)).max(0.0);
    assert_eq!(bench.ride(10, rpm).status.0[0], VALID | SMS | 1 << 26);
    assert_eq!(bench.first(900, rpm, |report| report.status.bit(0)), Some(10 + 497));
    assert_eq!(codes(&bench.until(920)), []);
}

#[test]
fn ss1_beyond_the_line_is_sto_at_once() {
    // AMK-EX-SS1-2
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 1_500.0);
    bench.word = without(1);
    let rpm = |t: f64| if t < 110.0 { 1_500.0 - 3.0 * (t - 10.0) } else { 1_201.0 };
    assert_eq!(bench.first(900, rpm, |report| report.status.bit(0)), Some(110));
    let report = bench.until(111);
    assert_eq!(codes(&report), [(3606, 101, 0, 8)]);
    assert!(report.status.bit(7));
    // DEC-11: the STO stands as long as its request, even acknowledged.
    bench.word |= ACK;
    let report = bench.until(112);
    assert_eq!((report.status.bit(7), report.status.bit(0)), (false, true));
    bench.word = NEUTRAL;
    assert!(bench.until(113).driving);
}

#[test]
fn ss1_runs_to_its_end_without_its_request_and_its_sto_lasts_a_cycle() {
    // AMK-SS1-05, DEC-48
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 300.0);
    bench.word = without(1);
    bench.ride(10, |_| 300.0);
    bench.word = NEUTRAL;
    let rpm = |t: f64| (300.0 - 3.0 * (t - 10.0)).max(0.0);
    assert_eq!(bench.first(900, rpm, |report| report.status.bit(0)), Some(10 + 97));
    assert!(bench.until(108).driving);
}

#[test]
fn the_delay_covers_its_time_and_not_its_end() {
    // AMK-RAMP-02, DEC-02: SLS1 has 100 ms
    for (until, trips) in [(109.0, None), (110.0, Some(110))] {
        let mut bench = Bench::amk(SET);
        bench.ride(9, |_| 800.0);
        bench.word = without(12);
        let rpm = |t: f64| {
            if (10.5..until + 0.5).contains(&t) { 900.0 } else { 800.0 - 3.0 * (t - 110.0).clamp(0.0, 200.0) }
        };
        assert_eq!(bench.first(130, rpm, |report| !report.errors.is_empty()), trips);
    }
}

#[test]
fn sls_is_acknowledged_when_the_line_meets_the_limit() {
    // AMK-EX-SLS-1: (800 - 500) / 3 = 100 ms
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 800.0);
    bench.word = without(12);
    let rpm = |t: f64| (800.0 - 4.0 * (t - 110.0).max(0.0)).max(500.0);
    assert_eq!(bench.first(500, rpm, |report| report.status.bit(12)), Some(210));
    // AMK-GEN-12: equal is inside.
    assert!(bench.ride(300, |_| 500.0).status.bit(12));
    assert!(bench.ride(302, |_| -500.0).status.bit(12));
}

#[test]
fn sls_beyond_its_limit_starts_its_stop_and_is_a_warning_with_error_bit() {
    // AMK-EX-SLS-3, DEC-44
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 400.0);
    bench.word = without(12);
    bench.ride(200, |_| 400.0);
    let report = bench.ride(201, |_| 500.001);
    assert_eq!(codes(&report), [(3610, 112, 3, 0)]);
    assert_eq!(report.status.0[0], VALID | SMS | 1 << 7 | 1 << 26);
    assert!(report.driving);
    // DEC-15: refused while the stop brakes.
    bench.word |= ACK;
    let down = |t: f64| (500.0 - 4.0 * (t - 201.0)).max(0.0);
    assert!(bench.ride(250, down).status.bit(7));
    bench.word &= !ACK;
    assert_eq!(bench.first(600, down, |report| report.status.bit(0)), Some(365));
    bench.word |= ACK;
    let at = bench.k;
    let report = bench.until(at);
    assert_eq!((report.status.bit(7), report.driving), (false, true));
    // DEC-17: starts again with its transition time.
    assert!(!bench.until(at + 99).status.bit(12));
    assert!(bench.until(at + 100).status.bit(12));
}

#[test]
fn an_ssr_that_excludes_zero_is_approached_from_below() {
    // DEC-06: from 400 rpm up to 1,000 rpm at 6 rpm/ms after 50 ms
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 400.0);
    bench.word = without(4);
    let rpm = |t: f64| (400.0 + 6.5 * (t - 60.0).max(0.0)).min(1_200.0);
    assert_eq!(bench.first(500, rpm, |report| report.status.bit(4)), Some(160));
    let report = bench.ride(161, |_| 999.9);
    assert_eq!(codes(&report), [(3606, 104, 4, 0)]);
}

#[test]
fn an_ssr_that_is_not_followed_upwards_is_undershot() {
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 400.0);
    bench.word = without(4);
    assert_eq!(bench.first(500, |_| 400.0, |report| report.status.bit(0)), Some(61));
    assert_eq!(codes(&bench.until(62)), [(3606, 104, 0, 9)]);
}

#[test]
fn sms_acts_without_request() {
    // AMK-EX-SMS-2
    let mut bench = Bench::amk(SET);
    assert!(bench.ride(10, |_| -3_000.0).status.bit(8));
    let report = bench.ride(11, |_| -3_000.001);
    assert_eq!(codes(&report), [(3606, 108, 4, 0)]);
    assert_eq!(report.status.0[0], VALID | 1 | 1 << 7);
}

#[test]
fn sos_keeps_its_position_window_where_it_was_commanded() {
    // AMK-EX-SOS-3, DEC-08
    let mut bench = Bench::amk(SET);
    bench.travel = false;
    bench.position = 5_000;
    bench.until(9);
    bench.word = without(3);
    assert!(bench.until(10).status.bit(3));
    bench.position = 5_100;
    assert!(bench.until(11).status.bit(3));
    bench.position = 4_899;
    assert_eq!(codes(&bench.until(12)), [(3606, 103, 6, 0)]);
}

#[test]
fn sos_at_speed_trips_at_once() {
    // AMK-SOS-02
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 10.001);
    bench.word = without(3);
    assert_eq!(codes(&bench.ride(10, |_| 10.001)), [(3606, 103, 3, 0)]);
}

#[test]
fn ss2_ends_in_sos_with_windows_of_its_own() {
    // AMK-EX-SS2-1, AMK-EX-SS2-3
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 310.0);
    bench.word = without(2);
    let rpm = |t: f64| (310.0 - 3.2 * (t - 10.0)).max(0.0);
    assert_eq!(bench.ride(10, rpm).status.0[0], VALID | SMS | 1 << 27);
    assert_eq!(bench.first(500, rpm, |report| report.status.bit(3)), Some(110));
    let report = bench.until(111);
    assert_eq!((report.status.0[0], report.stop, report.driving), (VALID | SMS | 1 << 3, Stop::Sos, true));
    let report = bench.ride(112, |_| -10.1);
    assert_eq!(codes(&report), [(3606, 102, 4, 0)]);
}

#[test]
fn ss2_is_left_when_its_request_is_gone() {
    // DEC-12
    let mut bench = Bench::amk(SET);
    bench.until(9);
    bench.word = without(2);
    assert!(bench.until(30).status.bit(3));
    bench.word = NEUTRAL;
    assert_eq!(bench.until(31).status.0[0], VALID | SMS);
}

#[test]
fn sdi_judges_the_sign_of_the_speed() {
    // AMK-EX-SDIP-2, AMK-EX-SDIN-2
    for (bit, sign, info) in [(5, -1.0, (3606, 105, 4, 0)), (6, 1.0, (3606, 106, 3, 0))] {
        let mut bench = Bench::amk(SET);
        bench.ride(9, |_| -sign * 1_000.0);
        bench.word = without(bit);
        assert!(bench.ride(20, |_| -sign * 1_000.0).status.bit(bit as u8));
        assert!(bench.ride(21, |_| sign * 5.0).status.bit(bit as u8));
        assert_eq!(codes(&bench.ride(22, |_| sign * 5.001)), [info]);
    }
}

#[test]
fn sli_takes_its_start_from_each_selection() {
    // AMK-EX-SLI-POS, AMK-EX-SLI-2
    let mut bench = Bench::amk(SET);
    bench.travel = false;
    for start in [10_000, 50_000] {
        bench.position = start;
        bench.word = NEUTRAL;
        let k = bench.k;
        bench.until(k + 5);
        bench.word = without(14);
        for position in [start, start - 100, start + 1_000] {
            bench.position = position;
            let k = bench.k;
            assert!(bench.until(k).status.bit(14), "{position}");
        }
    }
    bench.position = 51_001;
    let k = bench.k;
    assert_eq!(codes(&bench.until(k)), [(3606, 114, 5, 0)]);
}

#[test]
fn simultaneous_reactions_ss1_and_ss2_end_in_sto() {
    // AMK-EX-CONFLICT, DEC-13
    let mut set = SET.to_vec();
    set.push((63, 2));
    let mut bench = Bench::amk(&set);
    bench.ride(9, |_| 250.0);
    bench.word = without(12) & without(13);
    bench.ride(200, |_| 250.0);
    let report = bench.ride(201, |_| 600.0);
    assert_eq!(codes(&report), [(3610, 112, 3, 0), (3610, 113, 3, 0)]);
    assert_eq!(report.stop, Stop::Ss1);
    let down = |t: f64| (600.0 - 3.1 * (t - 201.0)).max(0.0);
    assert_eq!(bench.ride(450, down).stop, Stop::Sto);
}

#[test]
fn a_higher_stop_aborts_a_lower_one() {
    // DEC-13
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 1_000.0);
    bench.word = without(2);
    let down = |t: f64| 1_000.0 - 3.5 * (t - 10.0);
    assert_eq!(bench.ride(12, down).stop, Stop::Ss2);
    bench.word &= without(1);
    assert_eq!(bench.ride(13, down).stop, Stop::Ss1);
    bench.word &= without(0);
    assert_eq!(bench.ride(14, down).stop, Stop::Sto);
}

#[test]
fn monitoring_starts_again_when_sto_is_left() {
    // DEC-14
    let mut bench = Bench::amk(SET);
    bench.word = without(12);
    assert!(bench.until(101).status.bit(12));
    bench.word &= without(0);
    assert_eq!(bench.ride(110, |_| 700.0).status.0[0], VALID | 1);
    bench.word = without(12);
    let report = bench.ride(111, |_| 700.0);
    assert_eq!((report.status.bit(12), report.driving), (false, true));
}

#[test]
fn inputs_request_what_is_assigned_after_their_filter_time() {
    // AMK-IN-04, AMK-TIME-02: 1 ms filter and 0.25 ms
    let mut set = SET.to_vec();
    set.extend([(7, 1), (15, 3), (16, 12), (17, 1)]);
    let mut bench = Bench::amk(&set);
    bench.word = 0;
    assert_eq!(bench.until(9).status.0[0], VALID | SMS);
    bench.lines[0] = false;
    assert!(!bench.until(10).status.bit(3));
    let report = bench.until(11);
    assert_eq!((report.status.bit(3), report.status.bit(29)), (true, false));
    assert_eq!(report.drive.outputs, 0b0011);
    bench.lines[2] = false;
    bench.until(13);
    assert_eq!(bench.until(14).stop, Stop::Sto);
}

#[test]
fn an_acknowledge_level_that_is_high_already_is_no_edge() {
    // DEC-16
    let mut bench = Bench::amk(SET);
    bench.word |= ACK;
    bench.ride(9, |_| 0.0);
    bench.ride(10, |_| 4_000.0);
    assert!(bench.ride(20, |_| 0.0).status.bit(7));
    bench.word &= !ACK;
    bench.ride(21, |_| 0.0);
    bench.word |= ACK;
    let report = bench.ride(22, |_| 0.0);
    assert_eq!((report.status.bit(7), report.driving), (false, true));
}

#[test]
fn the_drives_clear_command_acknowledges_too() {
    // AMK-ACK-02
    let mut bench = Bench::amk(SET);
    bench.ride(9, |_| 0.0);
    bench.ride(10, |_| 4_000.0);
    bench.ride(11, |_| 0.0);
    bench.clear = true;
    assert!(!bench.ride(12, |_| 0.0).status.bit(7));
}

#[test]
fn the_drives_clear_command_needs_no_control_word() {
    // AMK-ACK-02, Prm7 = 1: an axis that is commanded by its inputs; DEC-16: an edge
    use shm_schema::command::{Command, CommandSource};
    let set: std::vec::Vec<_> = SET.iter().copied().chain([(7, 1), (15, 3), (16, 12)]).collect();
    let command = |clear_error| {
        let none = Command { source: CommandSource::None, drive_enabled: true, ..Command::default() };
        Some(Command { clear_error, ..none })
    };
    let mut bench = Bench::amk(&set);
    bench.command = command(true);
    bench.ride(9, |_| 0.0);
    assert!(bench.ride(10, |_| 4_000.0).status.bit(7));
    assert!(bench.ride(12, |_| 0.0).status.bit(7), "high since before the error");
    bench.command = command(false);
    bench.ride(13, |_| 0.0);
    bench.command = command(true);
    let report = bench.ride(14, |_| 0.0);
    assert_eq!((report.status.bit(7), report.driving), (false, true));
}

#[test]
fn an_ss2_that_sto_interrupted_begins_again_while_it_is_requested() {
    // DEC-13
    let mut bench = Bench::amk(SET);
    bench.word = without(2);
    assert_eq!(bench.until(20).stop, Stop::Sos);
    bench.word &= without(0);
    assert_eq!(bench.until(21).stop, Stop::Sto);
    bench.word = without(2);
    assert_eq!(bench.until(22).stop, Stop::Sos);
}
