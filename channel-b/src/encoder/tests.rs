use super::*;
use std::prelude::v1::*;

const SETUP: EncoderSetup = EncoderSetup {
    slot: None,
    kind: Some(SlotKind::SineCosine),
    periods: 1024,
    pole_pairs: 1,
    is_inverted: false,
};

fn sine(position: f64, amplitude: f64) -> Encoder {
    let periods = position * 1024.0 / INCREMENTS;
    let count = libm::floor(periods);
    let (sin, cos) = libm::sincos((periods - count) * core::f64::consts::TAU);
    let slot = Slot {
        kind: SlotKind::SineCosine,
        sine: libm::rint(sin * amplitude) as i16,
        cosine: libm::rint(cos * amplitude) as i16,
        count: count as i32,
        ..Slot::default()
    };
    let drive_position = libm::rint(position) as i64;
    Encoder { slots: [slot, Slot::default()], drive_position, ..Encoder::default() }
}

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
    assert_eq!(run(sine(30.0 + 64.0, 16_384.0)), Some(EncoderFault::Quadrant));
}

#[test]
fn a_missing_encoder_and_a_reported_fault_are_refused() {
    let none = Encoder::default();
    assert_eq!(Evaluation::new(SETUP).evaluate(&none, 0), Err(EncoderFault::Absent));
    let mut ill = sine(0.0, 16_384.0);
    ill.slots[0].status = 4;
    assert_eq!(Evaluation::new(SETUP).evaluate(&ill, 0), Err(EncoderFault::Status));
}
