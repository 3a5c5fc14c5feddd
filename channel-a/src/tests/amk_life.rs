//! Start-up, partner, agreement, staleness and paths.

use super::bench::{Bench, codes};
use shm_schema::agreement::PathTest;
use shm_schema::error::ErrorCode;
use shm_schema::exchange::Start;
use shm_schema::profile::Profile;
use shm_schema::report::{Phase, Report, Stop};

const ACK: u32 = 1 << 7;

fn settled() -> Bench {
    let mut bench = Bench::amk(&[(67, 3_000), (2, 450), (3, 315)]);
    bench.until(19);
    bench
}

#[test]
fn a_cold_start_goes_through_every_phase_before_the_first_torque() {
    // DEC-19
    let mut bench = Bench::new(Profile::AmkKw, &[(67, 3_000)], Start::Cold);
    bench.agreement.permit = false;
    let report = bench.until(0);
    assert_eq!((report.phase, report.status.0[0] & 1, report.driving), (Phase::Pairing, 1, false));
    assert_eq!(bench.until(60).phase, Phase::Pairing);
    assert_eq!(bench.until(130).phase, Phase::SelfTest);
    bench.agreement.path_test = PathTest::RaiseA;
    assert!(bench.until(131).driving);
    bench.agreement.path_test = PathTest::RaiseB;
    assert!(!bench.until(140).driving);
    bench.agreement.path_test = PathTest::Passed;
    let report = bench.until(141);
    assert_eq!((report.phase, report.status.bit(28), report.ready), (Phase::AwaitAcknowledge, true, false));
    bench.word |= ACK;
    assert_eq!(bench.until(142).phase, Phase::Operational);
    assert!(!bench.until(143).driving, "crosscheck does not permit yet");
    bench.agreement.permit = true;
    assert!(bench.until(145).driving);
}

#[test]
fn the_first_torque_waits_while_a_stop_is_requested() {
    // DEC-19
    let mut bench = Bench::new(Profile::AmkKw, &[(67, 3_000)], Start::Cold);
    bench.agreement.path_test = PathTest::Passed;
    bench.word &= !2;
    assert_eq!(bench.until(150).phase, Phase::AwaitAcknowledge);
    bench.word |= ACK;
    assert_eq!(bench.until(151).phase, Phase::AwaitAcknowledge);
}

#[test]
fn a_refused_set_never_permits_torque_and_says_why() {
    // AMKD-MSG-02
    let mut bench = Bench::amk(&[(6, 8), (20, 0)]);
    let report = bench.until(10);
    assert_eq!((report.phase, report.driving, report.ready), (Phase::Refused, false, false));
    assert_eq!(codes(&report), [(3605, 7, 1, 0), (3605, 101, 0, 6)]);
    assert_eq!(report.status.0[0] & 0x1000_0081, 0x81);
}

#[test]
fn the_delivery_state_passes_every_rule() {
    // DEC-28
    let mut found = 0;
    crate::findings(&super::bench::image(Profile::AmkKw, &[]), &mut |_| found += 1);
    assert_eq!(found, 0);
}

#[test]
fn a_damaged_image_is_refused() {
    let mut octets = super::bench::image(Profile::AmkKw, &[(67, 3_000)]);
    octets[60] ^= 1;
    let mut found = std::vec::Vec::new();
    crate::findings(&octets, &mut |code| found.push(code));
    assert_eq!(found, [ErrorCode::amk(3609, 128, 4, 55)]);
}

#[test]
fn an_encoder_frozen_from_cycle_k_drops_the_path_in_k_plus_two() {
    let mut bench = settled();
    bench.encoder_alive = false;
    assert!(bench.until(21).driving);
    let report = bench.until(22);
    assert_eq!((report.driving, report.stop), (false, Stop::Sto));
}

#[test]
fn a_stale_command_requests_everything() {
    // DEC-18
    let mut bench = settled();
    bench.command_alive = false;
    assert!(bench.until(21).driving);
    let report = bench.until(22);
    assert_eq!((report.requested.0[0], report.stop), (0x7E7F, Stop::Sto));
}

#[test]
fn crosscheck_frozen_from_cycle_k_drops_the_path_in_k_plus_two() {
    let mut bench = settled();
    // Cycle 20 still reads what crosscheck wrote in cycle 19.
    bench.until(20);
    bench.agreement_alive = false;
    assert!(bench.until(21).driving);
    let report = bench.until(22);
    assert_eq!((report.driving, report.stop), (false, Stop::None));
}

#[test]
fn a_lost_partner_is_sto_in_the_third_cycle() {
    // DEC-23
    let mut bench = settled();
    bench.partner_alive = false;
    assert!(bench.until(21).driving);
    let report = bench.until(22);
    assert_eq!((report.driving, report.stop), (false, Stop::Sto));
    assert_eq!(codes(&report), [(3606, 13, 1, 0)]);
}

#[test]
fn position_and_speed_of_the_partner_may_differ_by_their_tolerance_only() {
    // DEC-22, AMKP-XCH-01
    let mut bench = settled();
    bench.partner_changes = |report| report.position += 450;
    assert!(bench.until(30).driving);
    bench.partner_changes = |report| report.position += 451;
    assert_eq!(codes(&bench.until(31)), [(3606, 13, 5, 0)]);
    let mut bench = settled();
    bench.partner_changes = |report| report.speed_mrpm -= 315_001;
    assert_eq!(codes(&bench.until(20)), [(3606, 13, 6, 0)]);
}

#[test]
fn a_status_difference_is_tolerated_for_tcc() {
    // DEC-21: Prm105 = 7 is 120 ms
    let mut bench = settled();
    bench.partner_changes = |report| report.status = report.status.with(26, true);
    assert!(bench.until(139).driving);
    let report = bench.until(140);
    assert_eq!((codes(&report).as_slice(), report.stop), ([(3606, 13, 3, 0)].as_slice(), Stop::Sto));
}

#[test]
fn an_error_of_one_channel_alone_is_tolerated_for_tcc_and_a_warning_for_ever() {
    // DEC-21, DEC-47: whatever the status words say
    fn stands(report: &mut Report, code: u32) {
        report.errors.insert(ErrorCode::amk(code, 101, 0, 14));
    }
    let mut bench = settled();
    bench.partner_changes = |report| stands(report, 3610);
    assert!(bench.until(199).driving);
    bench.partner_changes = |report| stands(report, 3606);
    assert!(bench.until(319).driving);
    let report = bench.until(320);
    assert_eq!((codes(&report).as_slice(), report.stop), ([(3606, 13, 8, 0)].as_slice(), Stop::Sto));
}

#[test]
fn an_error_of_crosscheck_is_sto_without_an_error_of_our_own() {
    let mut bench = settled();
    bench.agreement.error = true;
    let report = bench.until(20);
    assert_eq!((report.stop, report.status.bit(7)), (Stop::Sto, false));
    bench.agreement.error = false;
    assert!(bench.until(21).driving);
}

#[test]
fn a_path_that_stays_on_is_an_error() {
    let mut bench = settled();
    bench.word &= !1;
    for _ in 0..12 {
        bench.step();
        bench.readback.path_a = true;
    }
    assert_eq!(codes(&bench.step().report), [(3606, 75, 4, 0)]);
}

#[test]
fn sem_warns_and_then_stops() {
    // AMK-SEM-04, AMK-SEM-07
    let mut bench = Bench::amk(&[(9, 1), (10, 1)]);
    assert_eq!(codes(&bench.until(59_999)), []);
    let report = bench.until(60_000);
    assert_eq!((codes(&report).as_slice(), report.status.bit(7)), ([(3610, 38, 3, 0)].as_slice(), false));
    let report = bench.until(120_000);
    assert_eq!(codes(&report), [(3606, 38, 4, 0), (3610, 38, 3, 0)]);
    assert_eq!(report.stop, Stop::Sto);
}

#[test]
fn a_monitor_is_bounded() {
    assert!(size_of::<crate::Monitor>() < 64 * 1024, "{}", size_of::<crate::Monitor>());
}

#[test]
fn a_producer_that_runs_slow_is_a_clock_error() {
    // DEC-26
    let mut bench = settled();
    bench.stretch = 1.03;
    let report = bench.until(1_100);
    assert_eq!((codes(&report).as_slice(), report.stop), ([(3607, 71, 2, 0)].as_slice(), Stop::Sto));
    let mut bench = settled();
    bench.stretch = 1.01;
    assert!(bench.until(2_200).driving);
}

#[test]
fn an_acknowledge_edge_is_refused_while_the_cause_stands() {
    // DEC-15
    let mut bench = settled();
    bench.encoder_alive = false;
    assert_eq!(bench.until(25).stop, Stop::Sto);
    bench.word |= ACK;
    assert!(bench.until(26).status.bit(7));
    bench.word &= !ACK;
    bench.encoder_alive = true;
    assert!(bench.until(27).status.bit(7));
    bench.word |= ACK;
    let report = bench.until(28);
    assert_eq!((report.status.bit(7), report.driving), (false, true));
}
