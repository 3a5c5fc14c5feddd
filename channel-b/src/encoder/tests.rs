use super::*;
use crate::testing::sine;
use std::prelude::v1::*;

const SETUP: EncoderSetup = EncoderSetup {
    slot: None,
    kind: Some(SlotKind::SineCosine),
    periods: 1024,
    pole_pairs: 1,
    is_inverted: false,
    gear_percent: 100,
};

fn resolver(position: f64) -> Encoder {
    let (sin, cos) = libm::sincos(position / INCREMENTS * core::f64::consts::TAU);
    let slot = Slot {
        kind: SlotKind::Resolver,
        sine: libm::rint(sin * 16_384.0) as i16,
        cosine: libm::rint(cos * 16_384.0) as i16,
        ..Slot::default()
    };
    Encoder { slots: [slot, Slot::default()], ..Encoder::default() }
}

/// Increments of one ms at `rpm`.
fn step(rpm: f64) -> f64 {
    rpm * INCREMENTS / 60_000.0
}

#[test]
fn a_sine_encoder_gives_position_and_speed_at_every_speed_and_direction() {
    for rpm in [0.0, 0.3, 1.0, -1.0, 58.6, -117.2, 1_500.0, -3_000.0, 11_000.0] {
        let mut evaluation = Evaluation::new(SETUP);
        for k in 0..200_u64 {
            let position = -700.0 + step(rpm) * k as f64;
            let seen = evaluation.evaluate(&sine(position, 16_384.0), k * 1_000_000).expect("sound");
            assert!((seen.position as f64 - position).abs() <= 1.0, "{rpm} rpm, cycle {k}: {seen:?}");
            if k > 4 {
                assert!((seen.speed_mrpm as f64 - rpm * 1_000.0).abs() <= 100.0, "{rpm} rpm: {seen:?}");
            }
        }
    }
}

#[test]
fn a_resolver_is_extended_over_its_turns() {
    let mut evaluation = Evaluation::new(EncoderSetup { kind: Some(SlotKind::Resolver), ..SETUP });
    for k in 0..400_u64 {
        let position = step(-3_000.0) * k as f64;
        let seen = evaluation.evaluate(&resolver(position), k * 1_000_000).expect("sound");
        assert!((seen.position as f64 - position).abs() <= 2.0, "cycle {k}: {seen:?}");
        if k > 4 {
            assert!((seen.speed_mrpm + 3_000_000).abs() <= 1_000, "{seen:?}");
        }
    }
}

/// AMKD-3606-006: radius too large 1, too small 2.
#[test]
fn an_amplitude_outside_the_circle_is_refused() {
    let judged = |amplitude| Evaluation::new(SETUP).evaluate(&sine(20.0, amplitude), 0).err();
    assert_eq!(judged(9_000.0), Some(EncoderFault::SineSmall));
    assert_eq!(judged(22_000.0), Some(EncoderFault::SineLarge));
    assert_eq!(judged(14_000.0), None);
}

#[test]
fn a_signal_that_stands_still_while_the_drive_turns_is_found_within_two_cycles() {
    let mut evaluation = Evaluation::new(SETUP);
    for k in 0..10_u64 {
        let position = step(100.0) * k as f64;
        assert!(evaluation.evaluate(&sine(position, 16_384.0), k * 1_000_000).is_ok());
    }
    let stuck = sine(step(100.0) * 9.0, 16_384.0);
    let seen = [10_u32, 11].map(|k| {
        let drive_position = libm::rint(step(100.0) * f64::from(k)) as i64;
        let sample = Encoder { drive_position, ..stuck };
        evaluation.evaluate(&sample, u64::from(k) * 1_000_000).is_err()
    });
    assert!(seen[1]);
}

#[test]
fn a_jump_and_a_slipped_count_are_refused() {
    let run = |last: Encoder| {
        let mut evaluation = Evaluation::new(SETUP);
        for k in 0..10_u64 {
            assert!(evaluation.evaluate(&sine(30.0, 16_384.0), k * 1_000_000).is_ok());
        }
        evaluation.evaluate(&last, 10_000_000).err()
    };
    assert_eq!(run(sine(30.0 + 20_000.0, 16_384.0)), Some(EncoderFault::Implausible));
    // 3606/6/3: two quarter periods apart, from whichever quadrant.
    for position in [30.0, 40.0, 56.0, 70.0] {
        let mut slipped = sine(position, 16_384.0);
        slipped.slots[0].count += 2;
        assert_eq!(run(slipped), Some(EncoderFault::Quadrant), "{position}");
    }
}

#[test]
fn a_missing_encoder_and_a_reported_fault_are_refused() {
    let none = Encoder::default();
    assert_eq!(Evaluation::new(SETUP).evaluate(&none, 0), Err(EncoderFault::Absent));
    let mut ill = sine(0.0, 16_384.0);
    ill.slots[0].status = 4;
    assert_eq!(Evaluation::new(SETUP).evaluate(&ill, 0), Err(EncoderFault::Status));
}

/// The count may be one quadrant ahead of or behind the angle at every boundary.
#[test]
fn a_count_one_quadrant_off_moves_nothing() {
    for boundary in [-64.0, -16.0, 0.0, 16.0, 32.0, 48.0, 64.0, 6_400.0] {
        let mut evaluation = Evaluation::new(SETUP);
        for k in 0..60_i32 {
            let noise = f64::from(k % 5 - 2) * 0.2;
            let mut sample = sine(boundary + noise, 16_384.0);
            sample.slots[0].count += k % 3 - 1;
            let seen = evaluation.evaluate(&sample, k as u64 * 1_000_000).expect("sound");
            assert!((seen.position as f64 - boundary).abs() <= 1.0, "{boundary}, {k}: {seen:?}");
        }
    }
}

#[test]
fn the_count_wraps_without_a_step() {
    let mut evaluation = Evaluation::new(SETUP);
    let mut first = None;
    for k in 0..50_i32 {
        let mut sample = sine(step(3_000.0) * f64::from(k), 16_384.0);
        sample.slots[0].count = sample.slots[0].count.wrapping_add(i32::MAX - 3);
        let seen = evaluation.evaluate(&sample, k as u64 * 1_000_000).expect("sound");
        let start = *first.get_or_insert(seen.position);
        assert!(((seen.position - start) as f64 - step(3_000.0) * f64::from(k)).abs() <= 1.0);
    }
}

/// A sequence that jumps by 2 or 3 is a missed exchange: the time stamp jumps along.
#[test]
fn skipped_samples_are_no_jump() {
    for kind in [SlotKind::SineCosine, SlotKind::Resolver] {
        let is_sine = kind == SlotKind::SineCosine;
        let make = |position| if is_sine { sine(position, 16_384.0) } else { resolver(position) };
        let mut evaluation = Evaluation::new(EncoderSetup { kind: Some(kind), ..SETUP });
        let mut k = 0_u64;
        for n in 0..400_u64 {
            k += [1, 1, 3, 1, 2, 11][n as usize % 6];
            // 9,000 rpm moves a resolver by 1.65 turns in 11 ms.
            let position = step(9_000.0) * k as f64;
            let seen = evaluation.evaluate(&make(position), k * 1_000_000);
            let far = n < 12;
            let seen = seen.expect("no jump");
            let off = (seen.speed_mrpm - 9_000_000).abs();
            assert!(far | (off <= 1_000), "{kind:?} {n}: {seen:?}");
        }
        let late = make(step(9_000.0) * (k + 3) as f64 + 20_000.0);
        let jump = evaluation.evaluate(&late, (k + 3) * 1_000_000);
        // A resolver of one pole pair shows a third of a turn in 3 ms as 6,700 rpm more.
        assert_eq!(jump, Err(EncoderFault::Implausible), "{kind:?}");
    }
}

/// Design 10: a settled start has position and speed from its first sample on, and follows a
/// ramp within two cycles.
#[test]
fn a_settled_start_knows_a_standing_and_a_starting_motion() {
    for (rpm, ramp) in [(0.0, 0.0), (1_500.0, 0.0), (-3_000.0, 5_000.0), (0.0, 3_000.0), (800.0, -4_000.0)] {
        for inverted in [false, true] {
            let sign = if inverted { -1.0 } else { 1.0 };
            let mut evaluation = Evaluation::new(EncoderSetup { is_inverted: inverted, ..SETUP });
            let at = |t: f64| 1234.4 + (rpm * t + ramp * t * t / 2.0) * INCREMENTS / 60.0;
            let exact = Evaluated { position: 1234, speed_mrpm: libm::rint(rpm * 1e3) as i64 };
            evaluation.settle(&sine(at(0.0) * sign, 16_384.0), 0, &exact, 1_000_000);
            for k in 1..300_u64 {
                let t = k as f64 / 1e3;
                let seen = evaluation.evaluate(&sine(at(t) * sign, 16_384.0), k * 1_000_000).expect("sound");
                assert!((seen.position as f64 - at(t)).abs() <= 1.0, "{rpm} {ramp} {k}: {seen:?}");
                let speed = seen.speed_mrpm as f64 / 1e3;
                let line = |t: f64| rpm + ramp * t.max(0.0);
                let (one, other) = (line(t), line(t - 0.002));
                assert!(speed >= one.min(other) - 1.0, "{rpm} {ramp} {k}: {seen:?}");
                assert!(speed <= one.max(other) + 1.0, "{rpm} {ramp} {k}: {seen:?}");
            }
        }
    }
}
