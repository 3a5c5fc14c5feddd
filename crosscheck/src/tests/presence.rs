//! DEC-23, DEC-26, overruns and the readback of the paths.

use shm_schema::exchange::CellFault;
use shm_schema::report::Stop;

use super::bench::{Bench, CYCLE_NS, amk, codes};

/// DEC-23: frozen from cycle k on, lost in cycle k + 2.
#[test]
fn a_channel_that_stands_still_is_lost_in_the_third_cycle() {
    let mut bench = Bench::settled();
    bench.run(10);
    bench.frozen_a = true;
    assert_eq!(bench.cycles_to_error(5), Some(2));
    let outputs = bench.step();
    assert!(!outputs.torque);
    assert_eq!(codes(&outputs.agreement), [amk(3606, 13, 1)]);
}

/// DEC-23: a cell that fails its check is no advance.
#[test]
fn a_channel_whose_report_is_corrupt_is_lost_in_the_third_cycle() {
    let mut bench = Bench::settled();
    bench.run(10);
    bench.broken_b = true;
    assert_eq!(bench.cycles_to_error(5), Some(2));
}

/// DEC-23: two missing reports are tolerated; DEC-15: the error goes with an edge, not by itself.
#[test]
fn a_channel_that_returns_within_two_cycles_was_never_lost() {
    let mut bench = Bench::settled();
    for _ in 0..20 {
        bench.frozen_a = true;
        assert!(bench.run(2).torque);
        bench.frozen_a = false;
        assert!(bench.run(1).torque);
    }
    bench.frozen_a = true;
    bench.run(3);
    bench.frozen_a = false;
    assert!(bench.run(10).agreement.error);
    bench.stop_both();
    assert!(!bench.acknowledge().agreement.error);
}

/// DEC-23: exchange numbers ahead of every sample are no reports.
#[test]
fn a_channel_that_lies_ahead_is_lost() {
    let mut bench = Bench::settled();
    bench.run(10);
    bench.lie_a = 2;
    assert_eq!(bench.cycles_to_error(5), Some(2));
}

/// DEC-23: a header that advances over a report that does not is no advance.
#[test]
fn a_channel_that_repeats_one_exchange_is_lost() {
    let mut bench = Bench::settled();
    bench.run(10);
    let exchange = bench.exchange;
    let mut error_after = None;
    for cycle in 0..5 {
        bench.step_without_reports();
        let (old, new) = (bench.sampled(&bench.a, exchange), bench.sampled(&bench.b, bench.exchange));
        let outputs = bench.raw(Ok(old), Ok(new));
        if outputs.agreement.error {
            error_after.get_or_insert(cycle);
        }
    }
    assert_eq!(error_after, Some(2));
}

/// Architecture, pairing: reports that never meet are as good as none.
#[test]
fn channels_that_never_report_the_same_exchange_are_lost() {
    let mut bench = Bench::settled();
    bench.run(10);
    let mut error_after = None;
    for cycle in 0..8 {
        bench.step_without_reports();
        let even = bench.exchange & !1;
        let a = bench.sampled(&bench.a, even);
        let b = bench.sampled(&bench.b, even.saturating_sub(1));
        if bench.raw(Ok(a), Ok(b)).agreement.error {
            error_after.get_or_insert(cycle);
        }
    }
    assert!(error_after.is_some_and(|cycle| cycle <= 3), "{error_after:?}");
}

/// Design 5: a report that comes one cycle late is compared with its own partner.
#[test]
fn a_late_report_is_paired_with_the_report_of_the_same_exchange() {
    let mut bench = Bench::settled();
    bench.run(5);
    for cycle in 0..100_i64 {
        bench.step_without_reports();
        let position = cycle * 1_000;
        let (mut a, mut b) = (bench.a, bench.b);
        (a.position, b.position) = (position, position - 1_000);
        let a = bench.sampled(&a, bench.exchange);
        let b = bench.sampled(&b, bench.exchange - 1);
        let outputs = bench.raw(Ok(a), Ok(b));
        // Compared across exchanges this would be 1,000 increments apart.
        assert!(!outputs.agreement.error, "{cycle}");
        assert!(outputs.agreement.exchange + 1 >= bench.exchange);
    }
}

/// Design 5: a sample one channel skipped is a missed exchange.
#[test]
fn missed_exchanges_are_counted() {
    let mut bench = Bench::settled();
    bench.run(5);
    bench.broken_b = true;
    bench.run(2);
    bench.broken_b = false;
    assert!(bench.run(1).torque);
    assert_eq!(bench.core.missed_exchanges(), 2);
}

/// A producer that stands still is judged by the channels: their reports go on, and so does
/// the comparison of the one sample there is.
#[test]
fn a_producer_that_stands_still_is_no_lost_channel() {
    let mut bench = Bench::settled();
    bench.run(5);
    bench.frozen_encoder = true;
    assert!(!bench.run(5_000).agreement.error);
    bench.b.position = 51;
    assert!(bench.step().agreement.error);
}

/// DEC-26: 2 % over one second.
#[test]
fn a_channels_clock_may_differ_by_two_per_cent() {
    for (per_mille, trips) in [(1_019, false), (981, false), (1_021, true), (979, true)] {
        let mut bench = Bench::settled();
        let mut error = false;
        for cycle in 0..3_000 {
            bench.step_without_reports();
            let mut a = bench.sampled(&bench.a, bench.exchange);
            a.payload.time_ns = 7 + cycle * per_mille * (CYCLE_NS / 1_000);
            let b = bench.sampled(&bench.b, bench.exchange);
            let outputs = bench.raw(Ok(a), Ok(b));
            error |= outputs.agreement.errors.contains(amk(3607, 71, 2));
        }
        assert_eq!(error, trips, "{per_mille}");
    }
}

/// DEC-26: any step.
#[test]
fn a_step_of_a_channels_clock_trips_at_once() {
    let mut bench = Bench::settled();
    bench.run(10);
    bench.step_without_reports();
    let a = bench.sampled(&bench.a, bench.exchange);
    let mut b = bench.sampled(&bench.b, bench.exchange);
    b.payload.time_ns += 4 * CYCLE_NS;
    assert!(codes(&bench.raw(Ok(a), Ok(b)).agreement).contains(&amk(3607, 72, 2)));
}

/// DEC-26: the producer's rate is the independent witness.
#[test]
fn a_producer_of_another_rate_trips_within_a_second_and_a_half() {
    let mut bench = Bench::settled();
    bench.step();
    for _ in 0..1_100 {
        bench.now_ns += CYCLE_NS / 40;
        bench.step();
    }
    assert!(codes(&bench.step().agreement).contains(&amk(3607, 71, 1)));
}

/// DEC-26: the own clock never goes backwards.
#[test]
fn an_own_clock_that_goes_backwards_trips() {
    let mut bench = Bench::settled();
    bench.run(5);
    bench.now_ns -= 3 * CYCLE_NS;
    assert!(bench.step().agreement.error);
}

/// Design 8: overruns in a row, crosscheck's own and those a channel reports.
#[test]
fn three_overruns_in_a_row_trip() {
    let mut bench = Bench::settled();
    bench.overruns = 2;
    assert!(bench.run(5).torque);
    bench.overruns = 3;
    assert!(bench.step().agreement.error);

    let mut bench = Bench::settled();
    bench.b.overruns = 3;
    assert!(bench.step().agreement.error);
}

/// Architecture, paths: not driven for more than six cycles, it must read off.
#[test]
fn a_path_that_is_stuck_on_is_found_in_the_seventh_cycle() {
    let mut bench = Bench::settled();
    bench.run(10);
    bench.stop_both();
    bench.path_a = true;
    assert_eq!(bench.cycles_to_error(20), Some(6));
    assert_eq!(codes(&bench.step().agreement), [amk(3606, 75, 4)]);
    assert!(bench.acknowledge().agreement.error);
    bench.path_a = false;
    assert!(!bench.acknowledge().agreement.error);
}

/// Architecture, paths: driven for more than three cycles, it must read on.
#[test]
fn a_path_that_does_not_follow_is_found_in_the_fourth_cycle() {
    let mut bench = Bench::settled();
    bench.stop_both();
    bench.run(50);
    for report in [&mut bench.a, &mut bench.b] {
        (report.ready, report.driving, report.stop) = (true, true, Stop::None);
    }
    bench.path_a = true;
    assert_eq!(bench.cycles_to_error(20), Some(3));
    assert_eq!(codes(&bench.step().agreement), [amk(3606, 76, 5)]);
}

/// A withheld test edge is no end of driving, and a pause shows that the path can be dropped.
#[test]
fn a_test_pulse_disturbs_nothing() {
    let mut bench = Bench::settled();
    for cycle in 0..3_000_u64 {
        bench.a.test_pulse = cycle % 1_000 == 250;
        bench.a.driving = cycle % 1_000 != 250;
        // The evaluator sees the pause in the cycle after.
        bench.paused_a += u64::from(cycle % 1_000 == 251);
        assert!(bench.step().torque, "{cycle}");
    }
}

/// AMK-PATH-03: an hour without a dynamic test is a warning, which removes no torque.
#[test]
fn an_hour_without_a_dynamic_test_is_a_warning() {
    let mut bench = Bench::settled();
    bench.run(10);
    bench.now_ns += 3_600_000_000_000;
    // The jump of the time itself is seen as well; only the warning is of interest here.
    let outputs = bench.step();
    assert!(outputs.agreement.errors.contains(amk(3610, 75, 6)));
    assert!(outputs.agreement.errors.contains(amk(3610, 76, 6)));
}

/// DEC-16: after a loss a 0 must be seen before a 1 is an edge.
#[test]
fn an_acknowledge_level_that_returns_high_with_the_channel_is_no_edge() {
    let mut bench = Bench::settled();
    bench.run(5);
    bench.broken_b = true;
    bench.run(5);
    bench.broken_b = false;
    bench.b.acknowledgements = 1;
    assert!(bench.run(3).agreement.error);
    bench.b.acknowledgements = 0;
    bench.step();
    bench.b.acknowledgements = 1;
    assert!(!bench.step().agreement.error);
}

/// Freshness: without a readback nothing is permitted, from the third cycle on.
#[test]
fn a_readback_that_stands_still_withdraws_the_permit_in_the_third_cycle() {
    let mut bench = Bench::settled();
    bench.stop_both();
    (bench.a.ready, bench.b.ready) = (true, true);
    bench.run(10);
    bench.frozen_readback = true;
    assert!(bench.run(2).agreement.permit);
    let outputs = bench.step();
    assert!(!outputs.agreement.permit);
    assert!(!outputs.agreement.error);
    bench.frozen_readback = false;
    assert!(bench.step().agreement.permit);
}

/// DEC-24: the newest word counts, even before its partner has come.
#[test]
fn a_channel_that_is_not_ready_withdraws_the_permit_before_the_other_has_reported() {
    let mut bench = Bench::settled();
    bench.run(5);
    bench.step_without_reports();
    let mut a = bench.sampled(&bench.a, bench.exchange);
    a.payload.ready = false;
    let outputs = bench.raw(Ok(a), Err(CellFault::Missing));
    assert!(!outputs.agreement.permit);
}

/// Freshness: more than one cycle in the future is as bad as stale.
#[test]
fn a_report_from_the_future_is_no_report() {
    for (ahead_ns, lost) in [(CYCLE_NS, false), (CYCLE_NS + 1, true)] {
        let mut bench = Bench::settled();
        bench.run(5);
        let mut error = false;
        for _ in 0..3 {
            bench.step_without_reports();
            let mut a = bench.sampled(&bench.a, bench.exchange);
            a.timestamp_ns += ahead_ns;
            let b = bench.sampled(&bench.b, bench.exchange);
            error = bench.raw(Ok(a), Ok(b)).agreement.error;
        }
        assert_eq!(error, lost);
    }
}

/// Total on any input: nothing there at all.
#[test]
fn without_any_cell_there_is_no_permit_and_no_panic() {
    let mut bench = Bench::settled();
    for _ in 0..10 {
        bench.step_without_reports();
        assert!(!bench.raw(Err(CellFault::Missing), Err(CellFault::Nonce)).torque);
    }
}

/// Design 8: a path that conducts while its test edge is withheld is found by that test.
#[test]
fn a_path_that_does_not_pause_when_its_edge_is_withheld_is_stuck() {
    let mut bench = Bench::settled();
    bench.run(20);
    bench.a.test_pulse = true;
    bench.step();
    bench.a.test_pulse = false;
    let after = bench.cycles_to_error(20).expect("found by the test");
    assert!(after <= 6, "{after} cycles");
    assert_eq!(codes(&bench.step().agreement), [amk(3606, 75, 4)]);
}

#[test]
fn a_path_that_pauses_passes_its_test() {
    let mut bench = Bench::settled();
    for _ in 0..5 {
        bench.run(20);
        bench.a.test_pulse = true;
        bench.step();
        bench.a.test_pulse = false;
        bench.step();
        bench.paused_a += 1;
        assert_eq!(bench.cycles_to_error(20), None);
    }
}

#[test]
fn a_path_that_is_switched_off_during_its_test_is_not_stuck() {
    let mut bench = Bench::settled();
    bench.run(20);
    bench.a.test_pulse = true;
    bench.step();
    bench.a.test_pulse = false;
    bench.stop_both();
    assert_eq!(bench.cycles_to_error(20), None);
}
