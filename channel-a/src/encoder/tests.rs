//! The evaluation against lines that are known.
use super::*;

use std::f64::consts::TAU;

fn sine_slot(revolutions: f64, periods: f64) -> Slot {
    let turns = revolutions * periods;
    Slot {
        kind: SlotKind::SineCosine,
        sine: (16_384.0 * (turns * TAU).sin()).round() as i16,
        cosine: (16_384.0 * (turns * TAU).cos()).round() as i16,
        count: (turns * 4.0).floor() as i32,
        ..Slot::default()
    }
}

fn sampled(slot: Slot, sequence: u64) -> Sampled<Encoder> {
    let encoder = Encoder { slots: [slot, Slot::default()], period_ns: 1_000_000, ..Encoder::default() };
    Sampled { sequence, timestamp_ns: sequence * 1_000_000, crc32: 0, payload: encoder }
}

const SINE: Selection =
    Selection { kind: Some(SlotKind::SineCosine), slot: 0, periods: 1_024, inverted: false, gear: NO_GEAR };

fn sine() -> Evaluation {
    Evaluation::new(SINE)
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
fn an_encoder_that_counts_against_the_motor_is_turned_round() {
    // C15409, SC07
    let mut evaluation = Evaluation::new(Selection { inverted: true, ..SINE });
    for k in 1..20_u64 {
        let revolutions = 1_500.0 / 60_000.0 * k as f64;
        let reading = evaluation.take(&sampled(sine_slot(revolutions, 1_024.0), k)).unwrap();
        assert!((reading.position + (revolutions * 65_536.0).floor() as i64).abs() <= 1);
        assert!(k < 3 || (reading.speed + 1_500_000).abs() < 500);
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
fn a_count_that_loses_quarters_is_found_with_the_second_and_moves_nothing_before() {
    // AMKD-ENCM-02
    let mut evaluation = sine();
    let whole = sine_slot(0.100_3, 1_024.0);
    let position = evaluation.take(&sampled(whole, 1)).unwrap().position;
    let slipped = |quarters: i32| Slot { count: whole.count - quarters, ..whole };
    assert_eq!(evaluation.take(&sampled(slipped(1), 2)).map(|reading| reading.position), Ok(position));
    assert_eq!(evaluation.take(&sampled(slipped(2), 3)), Err(Fault::Quadrant));
}

#[test]
fn noise_around_a_quadrant_boundary_moves_the_position_by_no_period() {
    // AMKD-ENCM-02: the comparators may be one quadrant ahead or behind
    for boundary in -5..=5_i32 {
        for (ahead, noise) in [(0, -60), (0, 60), (-1, -60), (-1, 60), (-1, 0), (0, 0)] {
            let turns = f64::from(boundary) / 4.0;
            let mut slot = sine_slot(turns / 1_024.0, 1_024.0);
            slot.count = boundary + ahead;
            slot.sine += noise;
            slot.cosine -= noise;
            let reading = sine().take(&sampled(slot, 1)).unwrap();
            let exact = turns * 64.0;
            assert!((reading.position as f64 - exact).abs() < 1.0, "{boundary}: {}", reading.position);
        }
    }
}

#[test]
fn two_quadrants_between_count_and_tracks_are_a_fault() {
    // AMKD-ENCM-02
    for (quarters, tolerated) in [(-2, false), (-1, true), (0, true), (1, true), (2, false)] {
        let mut slot = sine_slot(0.000_3, 1_024.0);
        slot.count += quarters;
        let judged = sine().take(&sampled(slot, 1));
        assert_eq!(judged.is_ok(), tolerated, "{quarters}: {judged:?}");
    }
}

#[test]
fn a_live_encoder_at_3_000_rpm_trips_nothing_in_either_direction() {
    for rpm in [3_000.0, -3_000.0] {
        let mut evaluation = sine();
        for k in 1..5_000_u64 {
            let revolutions = rpm / 60_000.0 * k as f64;
            let mut slot = sine_slot(revolutions, 1_024.0);
            slot.sine += [-6, 5, 0, 6, -1][(k % 5) as usize];
            slot.cosine += [4, -6, 6][(k % 3) as usize];
            let reading = evaluation.take(&sampled(slot, k)).unwrap();
            assert!((reading.position as f64 - revolutions * 65_536.0).abs() <= 1.0, "{rpm} {k}");
            if k > 2 {
                assert!((reading.speed as f64 / 1000.0 - rpm).abs() < 0.5, "{rpm} {k}: {}", reading.speed);
            }
        }
    }
}

#[test]
fn the_count_may_wrap_in_either_direction() {
    for step in [3.3_f64, -3.3] {
        let mut evaluation = sine();
        let mut before = None;
        let edge = f64::from(i32::MAX) / 4.0 * step.signum();
        for k in 1..100_u64 {
            let turns = edge + step * (k as f64 - 50.0);
            let mut slot = sine_slot(turns, 1.0);
            slot.count = ((turns * 4.0).floor() as i64) as i32;
            let reading = evaluation.take(&sampled(slot, k)).unwrap();
            let moved = reading.position - before.unwrap_or(reading.position);
            let expected = if before.is_some() { step * 64.0 } else { 0.0 };
            assert!((moved as f64 - expected).abs() <= 2.0, "{step} {k}: {moved}");
            before = Some(reading.position);
        }
    }
}

#[test]
fn skipped_samples_are_no_jump() {
    for kind in [SlotKind::SineCosine, SlotKind::Resolver] {
        let periods = if kind == SlotKind::Resolver { 1 } else { 1_024 };
        for rpm in [3_000.0, -3_000.0, 12_000.0] {
            let mut evaluation = Evaluation::new(Selection {
                kind: Some(kind),
                slot: 0,
                periods,
                inverted: false,
                gear: NO_GEAR,
            });
            let mut k = 1_u64;
            for skipped in [0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 0, 10, 0, 2, 2, 0, 0] {
                k += 1 + skipped;
                let revolutions = rpm / 60_000.0 * k as f64;
                let slot = Slot { kind, ..sine_slot(revolutions, periods as f64) };
                let reading = evaluation.take(&sampled(slot, k)).unwrap();
                if k > 6 {
                    assert!(
                        (reading.speed as f64 / 1000.0 - rpm).abs() < 1.0,
                        "{rpm} {k}: {}",
                        reading.speed
                    );
                }
            }
        }
    }
}

#[test]
fn swapped_sine_and_cosine_are_found() {
    // AMKD-ENCM-02
    let mut evaluation = sine();
    let found = (1..20_u64).find_map(|k| {
        let slot = sine_slot(0.05 * k as f64 + 0.000_01, 1_024.0);
        let swapped = Slot { sine: slot.cosine, cosine: slot.sine, ..slot };
        evaluation.take(&sampled(swapped, k)).err()
    });
    assert_eq!(found, Some(Fault::Quadrant));
}

#[test]
fn an_amplitude_that_falls_slowly_is_found_at_half_of_the_nominal_one() {
    // AMKD-ENCM-02
    let mut evaluation = sine();
    let lost = (0..1_000_u64).find(|k| {
        let strength = 1.0 - *k as f64 / 1_000.0;
        let mut slot = sine_slot(0.001 * *k as f64, 1_024.0);
        slot.sine = (f64::from(slot.sine) * strength) as i16;
        slot.cosine = (f64::from(slot.cosine) * strength) as i16;
        evaluation.take(&sampled(slot, *k + 1)) == Err(Fault::RadiusSmall)
    });
    assert!(lost.is_some_and(|k| (495..=505).contains(&k)), "{lost:?}");
}

#[test]
fn a_settled_start_has_the_speed_and_position_of_its_motion_and_follows_a_ramp() {
    for (kind, periods) in
        [(SlotKind::SineCosine, 1_024_i64), (SlotKind::Resolver, 1), (SlotKind::Digital, 1)]
    {
        for (rpm, ramp) in [(0.0, 0.0), (1_500.0, 0.0), (-3_000.0, 5_000.0), (0.0, -5_000.0), (0.4, 0.0)] {
            let mut evaluation = Evaluation::new(Selection {
                kind: Some(kind),
                slot: 0,
                periods,
                inverted: false,
                gear: NO_GEAR,
            });
            let speed_at = |k: f64| rpm + ramp * k / 1_000.0;
            for k in 0..300_u64 {
                let t = k as f64;
                let revolutions = 3.7 + (rpm * t + ramp * t * t / 2_000.0) / 60_000.0;
                let increments = revolutions * 65_536.0;
                let digital = increments.floor() as i64;
                let slot = Slot { kind, digital, ..sine_slot(revolutions, periods as f64) };
                let speed_mrpm = (speed_at(t) * 1_000.0) as i32;
                let position = increments.round() as i64;
                if k == 0 {
                    let motion =
                        shm_schema::exchange::Motion { position, speed_mrpm, acceleration_mrpm_s: None };
                    evaluation.seed(&sampled(slot, 1), &motion, 1_000_000);
                } else {
                    evaluation.take(&sampled(slot, k + 1)).unwrap();
                }
                assert!(evaluation.is_primed());
                let reading = evaluation.reading();
                let shown = reading.speed as f64 / 1_000.0;
                let (from, to) = (speed_at(t - 2.0), speed_at(t));
                let inside = (from.min(to) - 1.0..=from.max(to) + 1.0).contains(&shown);
                assert!(inside, "{kind:?} {rpm} {ramp} {k}: {shown}");
                assert!((reading.position - position).abs() <= 2, "{kind:?} {rpm} {k}");
            }
        }
    }
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
    let mut evaluation = Evaluation::new(Selection {
        kind: Some(SlotKind::Resolver),
        slot: 0,
        periods: 1,
        inverted: false,
        gear: NO_GEAR,
    });
    for k in 1..2_000_u64 {
        let revolutions = -3_000.0 / 60_000.0 * k as f64;
        let slot = Slot { kind: SlotKind::Resolver, count: 0, ..sine_slot(revolutions, 1.0) };
        let reading = evaluation.take(&sampled(slot, k)).unwrap();
        if k > 9 {
            assert!((reading.speed + 3_000_000).abs() < 1_000, "{k}: {}", reading.speed);
        }
    }
}
