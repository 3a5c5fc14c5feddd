//! DEC-19: cold start, self-test of the paths, refused images.

use shm_schema::agreement::PathTest;
use shm_schema::exchange::Start;
use shm_schema::profile::Profile;
use shm_schema::report::Phase;
use std::vec::Vec;

use super::bench::{Bench, PASSED, TCC_CYCLES, amk, amk_image, codes, image};
use crate::Limits;

fn cold() -> Bench {
    let mut bench = Bench::with(&amk_image(), Start::Cold);
    bench.stop_both();
    phase(&mut bench, Phase::Pairing);
    bench
}

fn phase(bench: &mut Bench, phase: Phase) {
    (bench.a.phase, bench.b.phase) = (phase, phase);
}

/// Follows what the agreement asks, one cycle later; the requests in their order.
fn follow(bench: &mut Bench, cycles: u64) -> Vec<PathTest> {
    let mut seen = Vec::new();
    for _ in 0..cycles {
        let asked = bench.step().agreement.path_test;
        if seen.last() != Some(&asked) {
            seen.push(asked);
        }
        // Whether a channel calls this driving makes no difference to the test.
        bench.a.driving = asked == PathTest::RaiseA;
        (bench.path_a, bench.path_b) = (asked == PathTest::RaiseA, asked == PathTest::RaiseB);
    }
    seen
}

/// DEC-19: one fault tolerance time of equality, then each path alone, read back, dropped.
#[test]
fn the_self_test_raises_each_path_alone_and_sees_it_drop() {
    use PathTest::{None, RaiseA, RaiseB};
    let mut bench = cold();
    bench.run(TCC_CYCLES - 1);
    phase(&mut bench, Phase::SelfTest);
    assert_eq!(follow(&mut bench, 100), [None, RaiseA, None, RaiseB, None, PASSED]);
}

/// DEC-19: agreement of less than tcc does not begin it.
#[test]
fn a_difference_begins_the_time_of_equality_anew() {
    let mut bench = cold();
    bench.run(TCC_CYCLES - 10);
    bench.a.inputs = 1;
    bench.step();
    bench.a.inputs = 0;
    phase(&mut bench, Phase::SelfTest);
    assert_eq!(follow(&mut bench, TCC_CYCLES), [PathTest::None]);
    assert_eq!(follow(&mut bench, 100).last(), Some(&PASSED));
}

/// DEC-19: a path that does not follow within 20 cycles fails the test; after an
/// acknowledgement it is repeated.
#[test]
fn a_path_that_cannot_be_raised_fails_the_self_test() {
    let mut bench = cold();
    bench.run(TCC_CYCLES);
    phase(&mut bench, Phase::SelfTest);
    let outputs = bench.run(30);
    assert_eq!(codes(&outputs.agreement), [amk(3606, 75, 5)]);
    assert_eq!(outputs.agreement.path_test, PathTest::None);
    assert!(!bench.acknowledge().agreement.error);
    assert_eq!(follow(&mut bench, 200).last(), Some(&PASSED));
}

/// DEC-19: no permit before the self-test has passed, whatever the channels claim.
#[test]
fn nothing_is_permitted_before_the_self_test() {
    let mut bench = Bench::with(&amk_image(), Start::Cold);
    phase(&mut bench, Phase::Pairing);
    for _ in 0..300 {
        assert!(!bench.step().agreement.permit);
    }
}

/// A channel that claims to be ready in its boot is not believed.
#[test]
fn nothing_is_permitted_to_channels_in_boot() {
    let mut bench = Bench::with(&amk_image(), Start::Cold);
    phase(&mut bench, Phase::Boot);
    assert!(!bench.run(TCC_CYCLES * 2).agreement.permit);
}

/// Nothing to compare before both channels have read their parameters.
#[test]
fn channels_in_boot_are_not_compared() {
    let mut bench = cold();
    phase(&mut bench, Phase::Boot);
    (bench.a.position, bench.a.inputs, bench.a.parameter_signature) = (9_999, 3, 0);
    assert!(!bench.run(TCC_CYCLES * 2).agreement.error);
}

/// DEC-20: 3605/13/9 outside 7 to 199, and nothing ends it.
#[test]
fn a_cc_factor_out_of_range_permits_nothing() {
    for (factor, fine) in [(6, false), (7, true), (199, true), (200, false), (-1, false), (i32::MAX, false)] {
        let image = image(Profile::AmkKw, 1, &[(2, 50), (3, 16), (105, factor)]);
        let mut bench = Bench::with(&image, Start::Settled);
        assert_eq!(bench.run(3).torque, fine, "{factor}");
        assert_eq!(bench.acknowledge().agreement.errors.contains(amk(3605, 13, 9)), !fine, "{factor}");
    }
}

/// Every damaged octet of the image, and every shortened image, is refused.
#[test]
fn a_damaged_image_permits_nothing() {
    let whole = amk_image();
    for at in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x10;
        assert!(!Limits::from_image(&damaged).acceptable, "octet {at}");
        assert!(!Limits::from_image(&whole[..at]).acceptable, "{at} octets");
    }
    assert!(Limits::from_image(&whole).acceptable);
}

/// The image of another axis is no image.
#[test]
fn an_image_of_another_axis_permits_nothing() {
    let mut bench = Bench::with(&image(Profile::AmkKw, 2, &[(2, 50)]), Start::Settled);
    assert!(!bench.run(3).torque);
}

/// DEC-50: the other profiles use the common keys, in rpm and increments.
#[test]
fn the_common_keys_set_the_limits_of_the_other_profiles() {
    use shm_schema::profile::common;
    let entries = [(common::CC_FACTOR, 9), (common::POSITION_DIFFERENCE, 12), (common::SPEED_DIFFERENCE, 34)];
    let limits = Limits::from_image(&image(Profile::Etg61002, 1, &entries));
    assert_eq!((limits.position_difference, limits.speed_difference_mrpm), (12, 34_000));
    assert_eq!(limits.tcc_ns, 150_000_000);
    let left_out = Limits::from_image(&image(Profile::Atv340, 1, &[]));
    assert_eq!((left_out.position_difference, left_out.speed_difference_mrpm), (450, 315_000));
}
