//! The relaxed timing: later, never more (architecture, Timing).

use super::bench::{Bench, codes};
use shm_schema::exchange::{RELAXED_AGE_FACTOR, Setup, Start};
use shm_schema::profile::Profile;

fn relaxed() -> Bench {
    let setup = Setup { age_factor: RELAXED_AGE_FACTOR, ..Setup::new(1, 9, Start::Settled) };
    let mut bench = Bench::with(Profile::AmkKw, &[(67, 3_000)], &setup);
    bench.until(19);
    bench
}

#[test]
fn everything_that_asks_how_late_waits_ten_times_as_long() {
    let mut bench = relaxed();
    bench.encoder_alive = false;
    assert!(bench.until(48).driving, "29 ms old");
    assert_eq!(codes(&bench.until(49)), [(3606, 7, 3, 0)]);

    let mut bench = relaxed();
    bench.partner_alive = false;
    assert!(bench.until(48).driving);
    assert_eq!(codes(&bench.until(49)), [(3606, 13, 1, 0)]);

    let mut bench = relaxed();
    bench.agreement_alive = false;
    // Cycle 20 is the first without a new echo; one of twenty exchanges ago still counts.
    assert!(bench.until(38).driving);
    assert!(!bench.until(39).driving);
    assert_eq!(codes(&bench.until(50)), [(3606, 13, 1, 0)]);

    let mut bench = relaxed();
    bench.command_alive = false;
    assert_eq!(bench.until(48).requested.0[0], 0);
    assert_ne!(bench.until(49).requested.0[0], 0);

    let mut bench = relaxed();
    bench.overruns = 29;
    assert!(bench.until(20).driving);
    bench.overruns = 30;
    assert_eq!(codes(&bench.until(21)), [(3607, 29, 6, 0)]);

    let mut bench = relaxed();
    bench.word &= !1;
    let stuck = |bench: &mut Bench| {
        let report = bench.step().report;
        bench.readback.path_a = true;
        codes(&report)
    };
    assert!((0..61).all(|_| stuck(&mut bench).is_empty()));
    assert_eq!(stuck(&mut bench), [(3606, 75, 4, 0)]);
}

#[test]
fn clocks_may_run_ten_times_as_wrong() {
    // DEC-26
    let mut bench = relaxed();
    bench.stretch = 1.03;
    assert!(bench.until(2_200).driving);
    let mut bench = relaxed();
    bench.stretch = 1.35;
    assert_eq!(codes(&bench.until(1_100)), [(3607, 71, 2, 0)]);
}

#[test]
fn nothing_that_asks_how_much_is_relaxed() {
    // DEC-22
    let mut bench = relaxed();
    bench.partner_changes = |report| report.position += 51;
    assert_eq!(codes(&bench.until(20)), [(3606, 13, 5, 0)]);
    let mut bench = relaxed();
    bench.rpm = 3_001.0;
    assert!(!bench.until(20).driving);
}
