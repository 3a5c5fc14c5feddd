//! The generic profile, cycle by cycle.

use shm_schema::exchange::Start;
use shm_schema::facts::etg as f;
use shm_schema::facts::etg_6100_2::control as f_control;
use shm_schema::profile::{Profile, common, etg_key, reference};
use shm_schema::report::{Phase, Report, Stop};

use super::bench::{Bench, codes};

const NEUTRAL: u32 = 0x0F7F_FF7F;
const RESTART: u32 = 1 << 23;
const ACK: u32 = 1 << 7;

fn bench(entries: &[(u32, u32, u32, i64)]) -> Bench {
    bench_from(entries, Start::Settled)
}

fn bench_from(entries: &[(u32, u32, u32, i64)], start: Start) -> Bench {
    let mut keyed: std::vec::Vec<(u32, i64)> = entries
        .iter()
        .map(|(function, instance, object, value)| (etg_key(*function, *instance, *object), *value))
        .collect();
    keyed.push((common::SPEED_DIFFERENCE, 315));
    Bench::new(Profile::Etg61002, &keyed, start)
}

fn without(bit: u32) -> u32 {
    NEUTRAL & !(1 << bit)
}

#[test]
fn sto_waits_for_the_restart_acknowledge_by_default() {
    // ETG-RST-03, ETG-RST-06, DEC-12
    let mut bench = bench(&[]);
    bench.until(9);
    bench.word = without(0);
    assert_eq!(bench.until(10).status.0[0], 1);
    bench.word = NEUTRAL;
    assert_eq!(bench.until(12).status.0[0], 1 | RESTART);
    bench.word |= RESTART;
    let report = bench.until(13);
    assert_eq!((report.status.0[0], report.driving), (0, true));
}

#[test]
fn sto_restarts_by_itself_when_so_configured() {
    // ETG-STO-06
    let mut bench = bench(&[(f::STO, 1, f::sto::RESTART_ACKNOWLEDGE_BEHAVIOR, 0)]);
    bench.word = without(0);
    bench.until(10);
    bench.word = NEUTRAL;
    assert!(bench.until(11).driving);
}

#[test]
fn ss1_with_time_monitoring_ends_in_sto_at_its_time() {
    // ETG-SS1-01, ETG-SEQ-01
    let mut bench = bench(&[(f::SS1, 1, f::ss1::TIME_TO_STO, 400)]);
    bench.ride(9, |_| 1_000.0);
    bench.word = without(1);
    assert_eq!(bench.first(900, |_| 1_000.0, |report| report.status.bit(0)), Some(410));
    assert!(!bench.until(411).status.bit(7), "without a zero window the end is no error");
}

#[test]
fn ss1_outside_its_zero_window_at_its_time_is_an_error() {
    // ETG-SS1-11
    let mut bench =
        bench(&[(f::SS1, 1, f::ss1::TIME_TO_STO, 400), (f::SS1, 1, f::ss1::VELOCITY_ZERO_WINDOW, 10)]);
    bench.ride(9, |_| 1_000.0);
    bench.word = without(1);
    assert_eq!(bench.first(900, |_| 11.0, |report| report.status.bit(7)), Some(410));
}

#[test]
fn two_ss1_run_side_by_side_and_the_first_that_ends_is_sto() {
    // ETG-SEQ-01, ETG-GEN-12: the timer of each from its own request
    let entries = [(f::SS1, 1, f::ss1::TIME_TO_STO, 100), (f::SS1, 2, f::ss1::TIME_TO_STO, 2_000)];
    let mut bench = bench(&[entries[0], entries[1], (f::STO, 1, f::sto::RESTART_ACKNOWLEDGE_BEHAVIOR, 0)]);
    bench.ride(9, |_| 500.0);
    bench.word = without(f_control::SS1_2.into());
    bench.ride(109, |_| 500.0);
    assert!(bench.until(110).driving);
    bench.word = without(f_control::SS1_2.into()) & without(1);
    assert_eq!(bench.first(900, |_| 500.0, |report| report.status.bit(0)), Some(211));
    // Both have run here: the one that is still requested holds STO (DEC-11).
    bench.word = without(f_control::SS1_2.into());
    bench.until(400);
    assert!(!bench.until(401).driving);
}

#[test]
fn an_ss2_aborted_by_an_ss1_starts_again_when_sto_is_left() {
    // DEC-13: the lower one is remembered as long as it is requested
    let entries = [(f::SS1, 1, f::ss1::TIME_TO_STO, 100), (f::SS2, 1, f::ss2::TIME_TO_SOS, 50)];
    let mut bench = bench(&[entries[0], entries[1], (f::STO, 1, f::sto::RESTART_ACKNOWLEDGE_BEHAVIOR, 0)]);
    bench.until(9);
    bench.word = without(2);
    assert_eq!(bench.until(100).stop, Stop::Sos);
    bench.word = without(2) & without(1);
    assert_eq!(bench.until(300).stop, Stop::Sto);
    bench.word = without(2);
    assert_eq!(bench.until(303).stop, Stop::Ss2, "torque, but only with the stop that is asked for");
}

#[test]
fn ss1_ends_early_after_its_dwell() {
    // ETG-SS1-02
    let entries = [
        (f::SS1, 1, f::ss1::TIME_TO_STO, 400),
        (f::SS1, 1, f::ss1::VELOCITY_ZERO_WINDOW, 10),
        (f::SS1, 1, f::ss1::TIME_FOR_VELOCITY_ZERO, 50),
    ];
    let mut bench = bench(&entries);
    bench.ride(9, |_| 1_000.0);
    bench.word = without(1);
    let rpm = |t: f64| if t < 100.0 { 1_000.0 } else { 10.0 };
    assert_eq!(bench.first(900, rpm, |report| report.status.bit(0)), Some(150));
}

#[test]
fn the_slope_of_ss1_follows_from_its_times_when_only_they_are_given() {
    // ETG-EX-03: 3,000 rpm in 0.8 s
    let entries = [
        (f::SMS, 1, f::sms::VELOCITY_MAXIMUM_POSITIVE, 3_000),
        (f::SMS, 1, f::sms::VELOCITY_MAXIMUM_NEGATIVE, 2_000),
        (f::SS1, 1, f::ss1::TIME_TO_STO, 1_000),
        (f::SS1, 1, f::ss1::TIME_DELAY_DECELERATION_MONITORING, 200),
    ];
    for (slope, trips) in [(3.76, false), (3.70, true)] {
        let mut bench = bench(&entries);
        bench.ride(9, |_| 1_500.0);
        bench.word = without(1);
        let rpm = |t: f64| (1_500.0 - slope * (t - 210.0).max(0.0)).max(0.0);
        assert_eq!(bench.ride(800, rpm).status.bit(7), trips, "{slope}");
    }
}

#[test]
fn ss2_ends_in_the_sos_of_its_number_and_waits_for_its_acknowledge() {
    // ETG-SS2-01, ETG-SS2-02, ETG-RST-02
    let entries = [
        (f::SS2, 1, f::ss2::TIME_TO_SOS, 100),
        (f::SOS, 1, f::sos::POSITION_ZERO_WINDOW, 50),
        (f::SOS, 1, f::sos::VELOCITY_ZERO_WINDOW, 10),
    ];
    let mut bench = bench(&entries);
    bench.word = without(2);
    bench.until(0);
    bench.word = NEUTRAL;
    let report = bench.until(100);
    assert_eq!((report.status.bit(3), report.stop), (true, Stop::Sos));
    assert_eq!(bench.until(101).status.0[0], 1 << 3 | RESTART);
    bench.word |= RESTART;
    assert_eq!(bench.until(102).status.0[0], 0);
}

#[test]
fn sls_reacts_as_its_reference_says() {
    // ETG-SLS-01, ETG-ERR-01, ETG-ERR-02
    let cases = [(reference(f::STO, 1), Stop::Sto), (reference(f::SS1, 2), Stop::Ss1), (0, Stop::None)];
    for (reaction, stop) in cases {
        let entries = [
            (f::SS1, 2, f::ss1::TIME_TO_STO, 300),
            (f::SLS, 3, f::sls::TIME_TO_VELOCITY_MONITORING, 100),
            (f::SLS, 3, f::sls::VELOCITY_LIMIT, 500),
            (f::SLS, 3, f::sls::ERROR_REACTION, i64::from(reaction)),
        ];
        let mut bench = bench(&entries);
        bench.word = without(10);
        assert!(!bench.ride(99, |_| 900.0).status.bit(10));
        let report = bench.ride(100, |_| 500.0);
        assert_eq!((report.status.bit(10), report.status.bit(7)), (true, false));
        let report = bench.ride(101, |_| 501.0);
        assert_eq!((report.status.bit(10), report.status.bit(7), report.stop), (false, true, stop));
        let code = (f::SLS << 16 | 3 << 8 | 1, 0, 0, 0);
        assert_eq!(super::bench::codes(&report), [code], "row E1");
    }
}

#[test]
fn ssr_is_entered_early_after_its_time_within_the_limits() {
    // ETG-SSR-02
    let entries = [
        (f::SSR, 1, f::ssr::TIME_TO_VELOCITY_MONITORING, 1_000),
        (f::SSR, 1, f::ssr::VELOCITY_UPPER_LIMIT, 600),
        (f::SSR, 1, f::ssr::VELOCITY_LOWER_LIMIT, -600),
        (f::SSR, 1, f::ssr::TIME_FOR_VELOCITY_IN_LIMITS, 100),
    ];
    let mut bench = bench(&entries);
    bench.word = without(4);
    let rpm = |t: f64| if t < 50.0 { 700.0 } else { 600.0 };
    assert_eq!(bench.first(900, rpm, |report| report.status.bit(4)), Some(150));
}

#[test]
fn position_torque_and_acceleration_have_their_windows() {
    // ETG-SLP-01, ETG-SLT-01, ETG-SAR-01, ETG-SMA-01
    let entries = [
        (f::SLP, 1, f::slp::POSITION_UPPER_LIMIT, 1_000),
        (f::SLP, 1, f::slp::POSITION_LOWER_LIMIT, -500),
        (f::SLT, 1, f::slt::TORQUE_LIMIT_POSITIVE_DIRECTION, 800),
        (f::SLT, 1, f::slt::TORQUE_LIMIT_NEGATIVE_DIRECTION, 600),
        (f::SAR, 1, f::sar::ACCELERATION_UPPER_LIMIT, 2_000),
        (f::SAR, 1, f::sar::ACCELERATION_LOWER_LIMIT, -1_000),
        (f::SMA, 1, f::sma::ACCELERATION_MAXIMUM, 5_000),
        (f::SMA, 1, f::sma::DECELERATION_MAXIMUM, -5_000),
    ];
    let run = |change: fn(&mut Bench)| {
        let mut bench = bench(&entries);
        bench.travel = false;
        bench.acceleration = Some(0);
        bench.word = without(12) & without(14) & without(15);
        assert_eq!(bench.until(9).status.0[0], 1 << 12 | 1 << 14 | 1 << 15 | 1 << 17);
        change(&mut bench);
        bench.until(10).status.bit(7)
    };
    assert!(!run(|bench| bench.position = 1_000));
    assert!(run(|bench| bench.position = 1_001));
    assert!(run(|bench| bench.position = -501));
    assert!(!run(|bench| bench.torque_ppm = 800_000));
    assert!(run(|bench| bench.torque_ppm = 800_001));
    assert!(run(|bench| bench.torque_ppm = -600_001));
    assert!(!run(|bench| bench.acceleration = Some(-1_000_000)));
    assert!(run(|bench| bench.acceleration = Some(-1_000_001)));
}

#[test]
fn sli_is_relative_to_its_activation_with_magnitudes() {
    // ETG-SLI-01, DEC-31
    let entries = [
        (f::SLI, 1, f::sli::POSITION_RELATIVE_UPPER_LIMIT, 100),
        (f::SLI, 1, f::sli::POSITION_RELATIVE_LOWER_LIMIT, 50),
    ];
    for (position, trips) in [(1_100, false), (1_101, true), (950, false), (949, true)] {
        let mut bench = bench(&entries);
        bench.travel = false;
        bench.position = 1_000;
        bench.word = without(13);
        bench.until(5);
        bench.position = position;
        assert_eq!(bench.until(6).status.bit(7), trips, "{position}");
    }
}

#[test]
fn sdi_lets_the_enabled_direction_run_and_holds_the_other() {
    // ETG-SDI-02, ETG-SDI-05, DEC-30
    let entries = [(f::SDI, 1, f::sdi::POSITION_ZERO_WINDOW, 100)];
    for (bits, path, trips) in [
        (1 << 6, [0_i64, 5_000, 4_900], false),
        (1 << 6, [0, 5_000, 4_899], true),
        (1 << 5, [0, -5_000, -4_900], false),
        (1 << 5, [0, -5_000, -4_899], true),
        (3 << 5, [0, 100, -100], false),
        (3 << 5, [0, 100, -101], true),
    ] {
        let mut bench = bench(&entries);
        bench.travel = false;
        bench.word = NEUTRAL & !bits;
        let mut error = false;
        for position in path {
            bench.position = position;
            error = bench.step().report.status.bit(7);
        }
        assert_eq!(error, trips, "{bits:x} {path:?}");
    }
}

#[test]
fn signals_and_moving_bits_go_on_in_sto() {
    // ETG-SSM-01, ETG-SCA-01, ETG-SDI-04, DEC-14
    let entries = [
        (f::SSM, 1, f::ssm::VELOCITY_UPPER_LIMIT, 20),
        (f::SSM, 1, f::ssm::VELOCITY_LOWER_LIMIT, -20),
        (f::SCA, 1, f::sca::POSITION_UPPER_LIMIT, 500),
        (f::SCA, 1, f::sca::POSITION_LOWER_LIMIT, 0),
        (f::SDI, 1, f::sdi::POSITION_ZERO_WINDOW, 100),
    ];
    let mut bench = bench(&entries);
    bench.travel = false;
    bench.word = without(0);
    assert_eq!(bench.ride(5, |_| -20.0).status.0[0], 1 | 1 << 1 | 1 << 6 | 1 << 18);
    bench.position = 501;
    assert_eq!(bench.ride(6, |_| 20.001).status.0[0], 1 | 1 << 5);
}

#[test]
fn the_brake_closes_before_the_torque_goes() {
    // ETG-EX-06, ETG-SBC-05
    let entries = [
        (f::SBC, 1, f::sbc::BRAKE_TIME_DELAY, 150),
        (f::SS1, 1, f::ss1::TIME_TO_STO, 1_000),
        (f::SS1, 1, f::ss1::ACTIVATE_SBC, i64::from(reference(f::SBC, 1))),
    ];
    let mut bench = bench(&entries);
    bench.word = without(1);
    assert_eq!(bench.first(2_000, |_| 0.0, |report| !report.status.bit(20)), Some(850));
    assert_eq!(bench.first(2_000, |_| 0.0, |report| report.status.bit(0)), Some(1_000));
}

#[test]
fn words_can_be_assigned_beyond_the_fourth_octet() {
    // DEC-41
    let mut entries = std::vec::Vec::from([
        (etg_key(f::SLS, 5, f::sls::VELOCITY_LIMIT), 100_i64),
        (common::CONTROL_WORD + 31, i64::from(reference(f::SLS, 5))),
        (common::STATUS_WORD + 40, i64::from(reference(f::SLS, 5))),
    ]);
    entries.push((common::SPEED_DIFFERENCE, 315));
    let mut bench = Bench::new(Profile::Etg61002, &entries, Start::Settled);
    bench.word = NEUTRAL | 1 << 31;
    assert!(!bench.until(5).status.bit(40));
    bench.word = NEUTRAL;
    assert!(bench.until(6).status.bit(40));
    assert!(bench.ride(7, |_| 101.0).status.bit(7));
}

#[test]
fn an_instance_that_no_key_names_is_not_requested() {
    // DEC-40
    let mut bench = bench(&[]);
    bench.word = 1;
    let report = bench.until(5);
    assert_eq!((report.requested.0[0], report.status.0[0], report.driving), (0, 0, true));
}

#[test]
fn the_first_torque_needs_an_edge_and_the_restart_edge_is_one() {
    // DEC-19
    let mut bench = bench_from(&[], Start::Cold);
    bench.agreement.path_test = shm_schema::agreement::PathTest::Passed;
    assert_eq!(bench.until(150).phase, Phase::AwaitAcknowledge);
    bench.word |= RESTART;
    bench.until(151);
    let report = bench.until(152);
    assert_eq!((report.phase, report.driving, report.status.bit(0)), (Phase::Operational, true, false));
}

#[test]
fn an_error_is_acknowledged_by_its_own_edge_and_the_stop_by_the_other() {
    // ETG-ERR-04, ETG-RST-01
    let mut bench = bench(&[
        (f::SMS, 1, f::sms::VELOCITY_MAXIMUM_POSITIVE, 100),
        (f::SMS, 1, f::sms::VELOCITY_MAXIMUM_NEGATIVE, 100),
    ]);
    assert_eq!(bench.ride(5, |_| 0.0).status.0[0], 1 << 16);
    assert_eq!(bench.ride(6, |_| 101.0).status.0[0], 1 | ACK);
    bench.word |= RESTART;
    assert_eq!(bench.ride(7, |_| 0.0).status.0[0], 1 | ACK);
    bench.word = NEUTRAL | ACK;
    assert_eq!(bench.ride(8, |_| 0.0).status.0[0], 1 | RESTART);
    bench.word |= RESTART;
    assert_eq!(bench.ride(9, |_| 0.0).status.0[0], 1 << 16);
}

#[test]
fn a_delay_that_is_not_shorter_than_its_time_is_refused() {
    // ETG-SS1-09
    let entries =
        [(f::SS1, 1, f::ss1::TIME_TO_STO, 100), (f::SS1, 1, f::ss1::TIME_DELAY_DECELERATION_MONITORING, 100)];
    assert_eq!(bench(&entries).until(1).phase, Phase::Refused);
}

#[test]
fn a_stop_that_ends_after_its_request_asks_for_the_acknowledge_at_once() {
    // ETG-SEQ-15, DEC-12
    let mut bench = bench(&[(f::SS1, 1, f::ss1::TIME_TO_STO, 100)]);
    bench.until(9);
    bench.word = without(1);
    bench.until(20);
    bench.word = Profile::Etg61002.neutral_word();
    assert_eq!(bench.until(109).status.0[0] & (1 | RESTART), 0);
    assert_eq!(bench.until(110).status.0[0] & (1 | RESTART), 1 | RESTART);
}

#[test]
fn an_ss2_without_an_error_reaction_brakes_on_beside_its_line() {
    // ETG-ERR-02, ETG-SS2-10, DEC-15: error bit and code, and nothing else
    let mut bench = bench(&[
        (f::SS2, 1, f::ss2::TIME_TO_SOS, 400),
        (f::SS2, 1, f::ss2::DECELERATION_LIMIT, 1_000),
        (f::SS2, 1, f::ss2::TIME_DELAY_DECELERATION_MONITORING, 100),
        (f::SS2, 1, f::ss2::ERROR_REACTION, 0),
        (f::SOS, 1, f::sos::POSITION_ZERO_WINDOW, 1_000_000),
    ]);
    bench.ride(9, |_| 500.0);
    bench.word = without(2);
    assert_eq!(bench.ride(110, |_| 500.0).stop, Stop::Ss2);
    let violated = |report: &Report| (codes(report), report.stop, report.status.bit(7));
    let expected = (std::vec::Vec::from([(0x5_0101, 0, 0, 0)]), Stop::Ss2, true);
    assert_eq!(violated(&bench.ride(111, |_| 500.0)), expected);
    // Refused while it stands, accepted when the speed is below the line again.
    bench.word |= ACK;
    assert_eq!(violated(&bench.ride(112, |_| 500.0)), expected);
    bench.word &= !ACK;
    bench.ride(113, |_| 100.0);
    bench.word |= ACK;
    assert_eq!(codes(&bench.ride(114, |_| 100.0)), []);
    assert_eq!(bench.first(900, |_| 0.0, |report| report.stop == Stop::Sos), Some(410));
}

#[test]
fn what_is_monitored_begins_anew_after_an_sto_of_one_cycle_too() {
    // DEC-14, DEC-48: SSR_1 leads to STO at the end of a cycle, and STO is left with the next
    let mut bench = bench(&[
        (f::STO, 1, f::sto::RESTART_ACKNOWLEDGE_BEHAVIOR, 0),
        (f::SSR, 1, f::ssr::VELOCITY_UPPER_LIMIT, 500),
        (f::SSR, 1, f::ssr::VELOCITY_LOWER_LIMIT, -500),
        (f::SLS, 3, f::sls::VELOCITY_LIMIT, 1_000),
        (f::SLS, 3, f::sls::TIME_TO_VELOCITY_MONITORING, 20),
    ]);
    bench.word = without(4) & without(10);
    assert_eq!(bench.ride(29, |_| 100.0).status.0[0], 1 << 4 | 1 << 10);
    assert_eq!(bench.ride(30, |_| 501.0).stop, Stop::Sto);
    bench.word = without(10) | ACK;
    let report = bench.ride(31, |_| 100.0);
    assert_eq!((report.stop, report.status.bit(10)), (Stop::None, false));
    assert_eq!(bench.first(90, |_| 100.0, |report| report.status.bit(10)), Some(51));
}
