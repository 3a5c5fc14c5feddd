//! An AMK axis on raw encoder signals.

use shm_schema::profile::Profile;

use super::bench::{Bench, codes, image};

/// AMK-EX: SMS open, so that only the evaluation can trip.
const OPEN: &[(u32, i64)] = &[(67, 10_000)];

fn raw(rpm: f64) -> Bench {
    let mut bench = Bench::amk(OPEN);
    bench.raw = true;
    bench.rpm = rpm;
    bench
}

#[test]
fn a_settled_start_on_raw_signals_permits_torque_without_a_gap() {
    // design 10, replay
    for (rpm, ramp) in [(0.0, 0.0), (1_500.0, 0.0), (-3_000.0, 0.0), (0.0, 3_000.0), (0.0, -3_000.0)] {
        let mut bench = raw(rpm);
        while bench.k < 500 {
            bench.rpm = rpm + ramp * bench.k as f64 / 1_000.0;
            let report = bench.step().report;
            assert!(report.driving, "{rpm} {ramp} {}: {:?}", bench.k, codes(&report));
            assert!(codes(&report).is_empty(), "{rpm} {ramp} {}: {:?}", bench.k, codes(&report));
            let shown = f64::from(report.speed_mrpm) / 1_000.0;
            let lag = (ramp / 1_000.0).abs() * 2.0;
            assert!((shown - bench.rpm).abs() <= lag + 1.0, "{rpm} {ramp} {}: {shown}", bench.k);
            assert!((report.position - bench.position).abs() <= 1, "{rpm} {ramp} {}", bench.k);
        }
    }
}

#[test]
fn a_host_that_sleeps_for_some_cycles_misses_exchanges_and_trips_nothing() {
    // design 5: a sample that one channel skipped is a missed exchange
    for rpm in [0.0, 3_000.0, -3_000.0] {
        let mut bench = raw(rpm);
        for cycles in [2, 1, 3, 2, 10] {
            bench.until(bench.k + 20);
            bench.stall(cycles);
            let report = bench.step().report;
            assert!(report.driving, "{rpm} {cycles}: {:?}", codes(&report));
            assert!((f64::from(report.speed_mrpm) / 1_000.0 - rpm).abs() <= 1.0, "{rpm} {cycles}");
            assert!(codes(&report).is_empty(), "{rpm} {cycles}: {:?}", codes(&report));
        }
    }
}

#[test]
fn limits_of_ssr_mean_the_same_in_either_order() {
    // AMK-SSR-06, docs/decisions/0002
    for limits in [[(33, 500), (34, -500)], [(33, -500), (34, 500)]] {
        let entries: std::vec::Vec<(u32, i64)> = OPEN.iter().chain(&limits).copied().collect();
        let mut bench = Bench::amk(&entries);
        bench.word &= !(1 << 4);
        bench.rpm = 400.0;
        let report = bench.until(50);
        assert!(codes(&report).is_empty(), "{limits:?}: {:?}", codes(&report));
    }
}

#[test]
fn the_ratio_of_an_input_and_the_flat_ramp_are_judged_by_the_shared_thresholds() {
    // AMKP-PLAUS-019, AMKP-PLAUS-114: too steep is channel 2's row
    let found = |entries: &[(u32, i64)]| {
        let mut found = 0;
        crate::findings(&image(Profile::AmkKw, entries), &mut |_| found += 1);
        found
    };
    assert_eq!(found(&[(71, 10_000), (72, 50), (73, 10_000), (74, 50)]), 0, "five pulses in a period");
    assert_eq!(found(&[(71, 10_001), (72, 50), (73, 10_000), (74, 50)]), 1);
    assert_eq!(found(&[(67, 60_000), (20, 1)]), 0, "steep");
}
