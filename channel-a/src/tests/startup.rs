//! The way to the first torque, however the others behave (DEC-19), and back to it.

use super::bench::{Bench, codes};
use shm_schema::agreement::PathTest;
use shm_schema::exchange::Start;
use shm_schema::profile::Profile;
use shm_schema::report::{Phase, Report, Stop};

const ACK: u32 = 1 << 7;
const STO: u32 = 1;
const VALID: u8 = 28;
/// Prm105 = 7: one fault tolerance time (DEC-20).
const TCC_MS: u64 = 120;

fn cold() -> Bench {
    let mut bench = Bench::new(Profile::AmkKw, &[(67, 3_000)], Start::Cold);
    bench.agreement.permit = false;
    bench
}

/// Everything done but the acknowledge edge.
fn waiting() -> Bench {
    let mut bench = cold();
    bench.agreement.path_test = PathTest::Passed;
    assert_eq!(bench.until(TCC_MS + 5).phase, Phase::AwaitAcknowledge);
    bench
}

fn driving() -> Bench {
    let mut bench = waiting();
    bench.word |= ACK;
    bench.agreement.permit = true;
    let at = bench.k;
    assert!(bench.until(at + 2).driving);
    bench.word &= !ACK;
    bench.until(at + 5);
    bench
}

fn operational(report: &mut Report) {
    report.phase = Phase::Operational;
    report.ready = true;
    report.status = report.status.with(VALID, true).with(0, false);
}

#[test]
fn a_partner_ahead_by_any_phase_does_not_hold_the_pairing() {
    // DEC-19: its VALID and STO differ by the phase alone
    let ahead: [fn(&mut Report); 3] = [
        |report| report.phase = Phase::SelfTest,
        |report| {
            report.phase = Phase::AwaitAcknowledge;
            report.status = report.status.with(VALID, true);
        },
        operational,
    ];
    for change in ahead {
        let mut bench = cold();
        bench.partner_changes = change;
        assert_eq!(bench.until(TCC_MS + 5).phase, Phase::SelfTest);
        assert_eq!(bench.until(5_000).phase, Phase::SelfTest);
        bench.agreement.path_test = PathTest::Passed;
        assert_eq!(bench.until(5_001).phase, Phase::AwaitAcknowledge);
        bench.word |= ACK;
        assert_eq!(bench.until(5_002).phase, Phase::Operational);
    }
}

#[test]
fn a_partner_in_the_same_phase_with_another_status_holds_it_until_they_agree() {
    // DEC-19, DEC-21: no difference for one fault tolerance time
    let mut bench = cold();
    bench.partner_changes = |report| report.status = report.status.with(7, true);
    assert_eq!(bench.until(1_000).phase, Phase::Pairing);
    bench.partner_changes = |_| {};
    // The report that agrees is read a cycle later.
    assert_eq!(bench.until(1_001 + TCC_MS).phase, Phase::SelfTest);
}

#[test]
fn a_short_difference_starts_the_time_of_pairing_again() {
    let mut bench = cold();
    bench.until(80);
    bench.partner_changes = |report| report.requested = report.requested.with(9, true);
    bench.until(81);
    bench.partner_changes = |_| {};
    assert_eq!(bench.until(81 + TCC_MS).phase, Phase::Pairing);
    assert_eq!(bench.until(82 + TCC_MS).phase, Phase::SelfTest);
}

#[test]
fn an_error_of_crosscheck_holds_no_phase_but_lets_no_path_rise() {
    // Its cause may be that this channel is still behind.
    let mut bench = cold();
    bench.agreement.error = true;
    assert_eq!(bench.until(TCC_MS + 5).phase, Phase::SelfTest);
    bench.agreement.path_test = PathTest::RaiseA;
    assert!(!bench.until(200).driving);
    bench.agreement.error = false;
    assert!(bench.until(201).driving);
}

#[test]
fn a_self_test_already_under_way_is_joined_and_a_passed_one_counts() {
    let mut bench = cold();
    bench.agreement.path_test = PathTest::RaiseA;
    assert!(!bench.until(TCC_MS - 5).driving);
    let report = bench.until(TCC_MS + 1);
    assert_eq!((report.phase, report.driving), (Phase::SelfTest, true));
    bench.agreement.path_test = PathTest::Passed;
    let report = bench.until(TCC_MS + 2);
    assert_eq!((report.phase, report.driving), (Phase::AwaitAcknowledge, false));
}

#[test]
fn cells_that_come_late_or_twice_do_not_hold_the_pairing() {
    // Two cycles of three without news are late, not lost (DEC-23).
    let mut bench = cold();
    for k in 0..3 * TCC_MS {
        bench.partner_alive = k % 3 == 0;
        bench.agreement_alive = k % 3 == 1;
        bench.until(k);
    }
    (bench.partner_alive, bench.agreement_alive) = (true, true);
    assert_eq!(bench.until(3 * TCC_MS).phase, Phase::SelfTest);
}

#[test]
fn a_partner_that_was_lost_is_paired_with_anew() {
    let mut bench = waiting();
    bench.partner_alive = false;
    assert_eq!(bench.until(TCC_MS + 8).phase, Phase::Pairing);
    bench.partner_alive = true;
    assert_eq!(bench.until(2 * TCC_MS + 12).phase, Phase::AwaitAcknowledge);
}

#[test]
fn an_encoder_fault_during_start_goes_with_the_acknowledge_that_releases() {
    let mut bench = cold();
    bench.until(20);
    bench.encoder_alive = false;
    assert_eq!(codes(&bench.until(24)), [(3606, 7, 3, 0)]);
    bench.encoder_alive = true;
    bench.agreement.path_test = PathTest::Passed;
    assert_eq!(bench.until(25 + TCC_MS + 2).phase, Phase::AwaitAcknowledge);
    bench.word |= ACK;
    let at = bench.k;
    let report = bench.until(at);
    assert_eq!((report.phase, codes(&report).len()), (Phase::Operational, 0));
}

#[test]
fn a_program_flow_is_learnt_while_pairing_and_held_from_then_on() {
    // DEC-22
    let mut bench = cold();
    bench.partner_changes = |report| report.flow ^= 1;
    bench.until(40);
    bench.partner_changes = |_| {};
    assert_eq!(bench.until(42 + TCC_MS).phase, Phase::SelfTest);
    bench.partner_changes = |report| report.flow ^= 1;
    assert_eq!(bench.until(45 + TCC_MS).phase, Phase::Pairing);
    let mut bench = driving();
    bench.partner_changes = |report| report.flow ^= 1;
    let at = bench.k;
    assert_eq!(codes(&bench.until(at)), [(3606, 13, 8, 0)]);
}

#[test]
fn overruns_count_from_the_first_torque_on() {
    // 3607/29/6: before it a late step can prolong nothing
    let mut bench = waiting();
    bench.overruns = 3;
    let at = bench.k;
    let report = bench.until(at + 20);
    assert_eq!((codes(&report).len(), report.overruns), (0, 3));
    let mut bench = driving();
    bench.overruns = 2;
    let at = bench.k;
    assert!(bench.until(at).driving);
    bench.overruns = 3;
    let report = bench.until(at + 1);
    assert_eq!((codes(&report).as_slice(), report.driving), ([(3607, 29, 6, 0)].as_slice(), false));
}

#[test]
fn a_permit_withheld_while_the_partner_stops_comes_back_with_it() {
    // No trip: the partner's own stop function stood and is left (DEC-12).
    let mut bench = driving();
    bench.agreement.permit = false;
    let at = bench.k;
    let report = bench.until(at + 50);
    assert_eq!((report.driving, report.ready, report.stop), (false, true, Stop::None));
    bench.agreement.permit = true;
    assert!(bench.until(at + 51).driving);
}

#[test]
fn an_agreement_that_no_longer_echoes_is_a_lost_partner_and_needs_an_acknowledge() {
    // DEC-23, design 3.3 and 3.7
    let mut bench = driving();
    bench.echo_alive = false;
    let at = bench.k;
    // The echo of two exchanges ago still counts.
    assert!(bench.until(at).driving);
    let report = bench.until(at + 2);
    assert_eq!((report.driving, codes(&report).len()), (false, 0));
    assert_eq!(codes(&bench.until(at + 3)), [(3606, 13, 1, 0)]);
    bench.echo_alive = true;
    let report = bench.until(at + 50);
    assert_eq!((report.driving, report.stop), (false, Stop::Sto));
    bench.word |= ACK;
    assert!(bench.until(at + 51).driving);
}

#[test]
fn an_agreement_that_stands_still_is_a_lost_partner_and_needs_an_acknowledge() {
    // DEC-23
    let mut bench = driving();
    bench.agreement_alive = false;
    let at = bench.k;
    assert!(!bench.until(at + 2).driving);
    assert_eq!(codes(&bench.until(at + 5)), [(3606, 13, 1, 0)]);
    bench.agreement_alive = true;
    assert!(!bench.until(at + 50).driving);
    bench.word |= ACK;
    assert!(bench.until(at + 51).driving);
}

#[test]
fn a_stop_requested_with_the_edge_keeps_the_start_waiting() {
    let mut bench = waiting();
    bench.word &= !STO;
    bench.word |= ACK;
    let at = bench.k;
    assert_eq!(bench.until(at + 10).phase, Phase::AwaitAcknowledge);
    bench.word |= STO;
    assert_eq!(bench.until(at + 20).phase, Phase::AwaitAcknowledge, "the edge is gone");
}

#[test]
fn a_path_that_is_stuck_under_torque_is_found_by_its_next_test() {
    // Design 8, AMK-PATH-01: a stuck path shows no pause of its edges
    for stuck_from in [10, 200, 600] {
        let mut bench = Bench::amk(&[(67, 3_000)]);
        assert!(bench.until(stuck_from).driving);
        let mut edges = 1_000;
        let found = (0..1_100).find(|_| {
            edges += 1;
            bench.readback.edges_a = edges;
            !codes(&bench.step().report).is_empty()
        });
        assert!(found.is_some_and(|cycles| cycles <= 1_010), "{stuck_from}: {found:?}");
    }
}

#[test]
fn a_partner_path_that_is_stuck_under_torque_is_found_by_its_next_test() {
    // Design 8, 3606/75/1
    let mut bench = Bench::amk(&[(67, 3_000)]);
    assert!(bench.until(3_000).driving, "a healthy run");
    let at = bench.k;
    let mut edges = 0;
    while bench.k < at + 1_010 {
        edges += 1;
        bench.readback.edges_b = edges;
        bench.step();
    }
    assert_eq!(codes(&bench.step().report), [(3606, 75, 1, 0)]);
}
