//! The evaluation against lines that are known.
use super::*;

use std::f64::consts::TAU;

fn sine_slot(revolutions: f64, periods: f64) -> Slot {
    let turns = revolutions * periods;
    Slot {
        kind: SlotKind::SineCosine,
        sine: (16_384.0 * (turns * TAU).sin()).round() as i16,
        cosine: (16_384.0 * (turns * TAU).cos()).round() as i16,
        count: turns.floor() as i32,
        ..Slot::default()
    }
}

fn sampled(slot: Slot, sequence: u64) -> Sampled<Encoder> {
    let encoder = Encoder { slots: [slot, Slot::default()], period_ns: 1_000_000, ..Encoder::default() };
    Sampled { sequence, timestamp_ns: sequence * 1_000_000, crc32: 0, payload: encoder }
}

fn sine() -> Evaluation {
    Evaluation::new(Selection { kind: Some(SlotKind::SineCosine), slot: 0, periods: 1_024 })
}

#[test]
fn a_sine_encoder_gives_position_and_speed_at_every_speed_and_direction() {
    for rpm in [0.0, 0.7, 3.0, -3.0, 29.0, 1_500.0, -6_000.0, 60_000.0] {
        let mut evaluation = sine();
        for k in 1..200_u64 {
            let revolutions = 0.3 + rpm / 60_000.0 * k as f64;
            let reading = evaluation.take(&sampled(sine_slot(revolutions, 1_024.0), k)).unwrap();
            let expected = (revolutions * 65_536.0).floor() as i64;
            assert!((reading.position - expected).abs() <= 1, "{rpm} {k}: {} {expected}", reading.position);
            if k > 2 {
                assert!((reading.speed as f64 / 1000.0 - rpm).abs() < 0.5, "{rpm} {k}: {}", reading.speed);
            }
        }
    }
}

#[test]
fn a_weak_or_too_strong_circle_is_a_fault() {
    // AMKD-ENCM-02
    let mut slot = sine_slot(0.1, 1_024.0);
    slot.sine /= 4;
    slot.cosine /= 4;
    assert_eq!(sine().take(&sampled(slot, 1)), Err(Fault::RadiusSmall));
    let slot = Slot { sine: 32_000, cosine: 32_000, ..slot };
    assert_eq!(sine().take(&sampled(slot, 1)), Err(Fault::RadiusLarge));
}

#[test]
fn a_counter_that_slips_a_period_at_standstill_is_a_fault() {
    let mut evaluation = sine();
    for k in 1..5 {
        evaluation.take(&sampled(sine_slot(0.100_3, 1_024.0), k)).unwrap();
    }
    let mut slot = sine_slot(0.100_3, 1_024.0);
    slot.count += 1;
    assert_eq!(evaluation.take(&sampled(slot, 5)), Err(Fault::Quadrant));
}

#[test]
fn frozen_signals_of_a_moving_shaft_are_found_with_the_second_sample() {
    let mut evaluation = sine();
    let at = |k: u64| sine_slot(0.05 * k as f64 + 0.001, 1_024.0);
    for k in 1..10 {
        evaluation.take(&sampled(at(k), k)).unwrap();
    }
    assert!(evaluation.take(&sampled(at(9), 10)).is_ok());
    assert_eq!(evaluation.take(&sampled(at(9), 11)), Err(Fault::Frozen));
}

#[test]
fn a_status_fault_or_an_empty_slot_is_a_fault() {
    let slot = Slot { status: 1, ..sine_slot(0.0, 1_024.0) };
    assert_eq!(sine().take(&sampled(slot, 1)), Err(Fault::Absent));
    assert_eq!(sine().take(&sampled(Slot::default(), 1)), Err(Fault::Absent));
}

#[test]
fn a_resolver_is_followed_over_the_turn() {
    let mut evaluation = Evaluation::new(Selection { kind: Some(SlotKind::Resolver), slot: 0, periods: 1 });
    for k in 1..2_000_u64 {
        let revolutions = -3_000.0 / 60_000.0 * k as f64;
        let slot = Slot { kind: SlotKind::Resolver, count: 0, ..sine_slot(revolutions, 1.0) };
        let reading = evaluation.take(&sampled(slot, k)).unwrap();
        if k > 9 {
            assert!((reading.speed + 3_000_000).abs() < 1_000, "{k}: {}", reading.speed);
        }
    }
}
