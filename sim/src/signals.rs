//! Encoder signals made from a position: sine and cosine with a count of quarter periods,
//! resolver, square-wave counter, digital position.

use std::f64::consts::TAU;

use shm_schema::INCREMENTS_PER_REVOLUTION;
use shm_schema::encoder::{NOMINAL_AMPLITUDE, Slot, SlotKind};

use crate::random::Random;

/// Parts of one increment in a fine position.
pub const FINE: i64 = 256;

/// The comparators of the quarter-period count switch this much behind the boundary upwards,
/// degrees of the period: offset and hysteresis of their own, as in a real counter.
const SWITCHES_UP: i128 = 5;
/// And this much before it downwards, degrees of the period.
const SWITCHES_DOWN: i128 = 2;
/// Degrees of a quarter period.
const QUARTER: i128 = 90;

/// What is mounted at one slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SlotWiring {
    /// Kind of encoder.
    pub kind: SlotKind,
    /// Periods (sine, counter) or pole pairs (resolver) per revolution, at least 1.
    pub periods: u32,
}

impl SlotWiring {
    /// Nothing mounted.
    pub const NONE: Self = Self { kind: SlotKind::None, periods: 1 };

    /// An encoder of `kind` with `periods` per revolution.
    pub fn new(kind: SlotKind, periods: i32) -> Self {
        Self { kind, periods: u32::try_from(periods).unwrap_or(1).max(1) }
    }
}

/// One encoder with its noise.
#[derive(Debug, Clone)]
pub struct Signals {
    wiring: SlotWiring,
    noise: i16,
    random: Random,
    quarters: Option<i64>,
}

impl Signals {
    /// An encoder whose sine and cosine carry noise of at most `noise` counts each way.
    pub fn new(wiring: SlotWiring, noise: i16, seed: u64) -> Self {
        Self { wiring, noise, random: Random::new(seed), quarters: None }
    }

    /// The signals at a position in 1/[`FINE`] increments.
    pub fn slot(&mut self, fine: i64) -> Slot {
        let kind = self.wiring.kind;
        let blank = Slot { kind, ..Slot::default() };
        match kind {
            SlotKind::None | SlotKind::Encoderless => blank,
            SlotKind::Digital => Slot { digital: fine.div_euclid(FINE), ..blank },
            SlotKind::Counter => {
                let (quarter, _) = periods(fine, 4 * i64::from(self.wiring.periods));
                Slot { count: quarter as i32, ..blank }
            }
            SlotKind::Resolver | SlotKind::SineCosine => self.analog(fine, blank),
        }
    }

    fn analog(&mut self, fine: i64, blank: Slot) -> Slot {
        let (_, fraction) = periods(fine, self.wiring.periods.into());
        let (sine, cosine) = (fraction * TAU).sin_cos();
        let count = if blank.kind == SlotKind::SineCosine { self.counted(fine) as i32 } else { 0 };
        Slot { sine: self.sampled(sine), cosine: self.sampled(cosine), count, ..blank }
    }

    /// Quarter periods as the comparators have them: near a boundary one behind or ahead.
    fn counted(&mut self, fine: i64) -> i64 {
        let behind = quarters(fine, self.wiring.periods, -SWITCHES_UP);
        let ahead = quarters(fine, self.wiring.periods, SWITCHES_DOWN);
        let before = self.quarters.unwrap_or_else(|| quarters(fine, self.wiring.periods, 0));
        let counted = before.clamp(behind, ahead);
        self.quarters = Some(counted);
        counted
    }

    fn sampled(&mut self, level: f64) -> i16 {
        let noise = self.random.between(-i64::from(self.noise), self.noise.into());
        let exact = (level * f64::from(NOMINAL_AMPLITUDE)).round() as i64;
        (exact + noise) as i16
    }
}

/// Whole periods and the fraction of the present one.
fn periods(fine: i64, per_revolution: i64) -> (i64, f64) {
    let revolution = i128::from(INCREMENTS_PER_REVOLUTION * FINE);
    let passed = i128::from(fine) * i128::from(per_revolution);
    let fraction = passed.rem_euclid(revolution) as f64 / revolution as f64;
    (passed.div_euclid(revolution) as i64, fraction)
}

/// Whole quarter periods at `degrees` of the period beyond the position.
fn quarters(fine: i64, per_revolution: u32, degrees: i128) -> i64 {
    let revolution = i128::from(INCREMENTS_PER_REVOLUTION * FINE);
    let passed = i128::from(fine) * i128::from(per_revolution) * 4 * QUARTER + degrees * revolution;
    passed.div_euclid(revolution * QUARTER) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals(kind: SlotKind, periods: i32) -> Signals {
        Signals::new(SlotWiring::new(kind, periods), 0, 1)
    }

    /// One period of 1,024, in fine parts.
    const PERIOD: i64 = 64 * FINE;

    /// Quadrant of sine and cosine, 0 to 3.
    fn quadrant(slot: &Slot) -> i32 {
        match (slot.sine >= 0, slot.cosine > 0) {
            (true, true) => 0,
            (true, false) => 1,
            (false, false) => 2,
            (false, true) => 3,
        }
    }

    #[test]
    fn angle_zero_is_the_rising_zero_crossing_of_the_sine() {
        let at = |fine| signals(SlotKind::SineCosine, 1_024).slot(fine);
        assert_eq!((at(PERIOD).count, at(PERIOD).sine, at(PERIOD).cosine), (4, 0, 16_384));
        let quarter = at(-PERIOD + PERIOD / 4);
        assert_eq!((quarter.count, quarter.sine, quarter.cosine), (-3, 16_384, 0));
        assert_eq!(at(-1).count, -1);
    }

    #[test]
    fn comparators_of_their_own_switch_late_both_ways() {
        let mut sine = signals(SlotKind::SineCosine, 1_024);
        let degrees = |degrees: i64| PERIOD * degrees / 360;
        let shown = [80, 92, 97, 89, 87, 80].map(|angle| sine.slot(degrees(angle)).count);
        assert_eq!(shown, [0, 0, 1, 1, 0, 0]);
    }

    #[test]
    fn the_count_is_at_most_one_quadrant_away_from_sine_and_cosine() {
        let mut sine = signals(SlotKind::SineCosine, 1_024);
        let mut apart = 0;
        let there = (-3 * PERIOD as i32..3 * PERIOD as i32).step_by(37);
        for fine in there.clone().chain(there.rev()) {
            let slot = sine.slot(fine.into());
            let difference = (quadrant(&slot) - slot.count + 1).rem_euclid(4) - 1;
            assert!((-1..=1).contains(&difference), "{fine}: {slot:?}");
            apart += i32::from(difference != 0);
        }
        assert!(apart > 0, "the case that a channel must bear occurs");
    }

    #[test]
    fn resolver_counter_and_digital_show_the_same_shaft() {
        let half = 32_768 * FINE;
        let resolver = signals(SlotKind::Resolver, 1).slot(half);
        assert_eq!((resolver.sine, resolver.cosine, resolver.count), (0, -16_384, 0));
        assert_eq!(signals(SlotKind::Counter, 1_000).slot(half).count, 2_000);
        assert_eq!(signals(SlotKind::Digital, 1).slot(half).digital, 32_768);
    }

    #[test]
    fn noise_stays_inside_its_bound_and_repeats_with_its_seed() {
        let wiring = SlotWiring::new(SlotKind::SineCosine, 1_024);
        let mut noisy = Signals::new(wiring, 3, 9);
        let mut again = Signals::new(wiring, 3, 9);
        for _ in 0..200 {
            let slot = noisy.slot(0);
            assert!((-3..=3).contains(&slot.sine));
            assert_eq!(slot, again.slot(0));
        }
    }
}
