//! The closed form of a whole bank: where the motion may be, and how long, without any function
//! answering otherwise than in the cycle before.
//!
//! It is the intersection of all windows in force, made anew whenever one of them has changed,
//! and kept like every safety variable, together with its complement.

use super::Motion;
use super::spec::{Quantity, Range};
use crate::twin::Twin;

/// Speed, position, acceleration, torque.
const QUANTITIES: usize = 4;

/// An intersection in the making.
#[derive(Debug, Clone, Copy)]
pub struct Band {
    lower: [i64; QUANTITIES],
    upper: [i64; QUANTITIES],
    until: i64,
}

impl Band {
    /// Everything, for ever.
    pub const OPEN: Self =
        Self { lower: [i64::MIN; QUANTITIES], upper: [i64::MAX; QUANTITIES], until: i64::MAX };

    /// Nothing is known of the next cycle.
    pub const fn shut(&mut self) {
        self.until = 0;
    }

    /// What holds now may change at `time`, ns.
    pub fn ends_at(&mut self, time: i64) {
        self.until = self.until.min(time);
    }

    /// Stay inside `range`, travel counted from `reference`.
    #[inline]
    pub fn stay_inside(&mut self, range: &Range, reference: i64) {
        let from = if range.quantity == Quantity::Travel { reference } else { 0 };
        self.at_least(range.quantity, range.lower.saturating_add(from));
        self.at_most(range.quantity, range.upper.saturating_add(from));
    }

    /// Stay on the side of `range` on which the motion is, in or out.
    pub fn stay_beside(&mut self, range: &Range, motion: &Motion) {
        let value = value(range.quantity, motion);
        if value > range.upper {
            self.at_least(range.quantity, range.upper.saturating_add(1));
        } else if value < range.lower {
            self.at_most(range.quantity, range.lower.saturating_sub(1));
        } else {
            self.stay_inside(range, 0);
        }
    }

    /// Not below `value`.
    #[inline]
    pub fn at_least(&mut self, quantity: Quantity, value: i64) {
        if let Some(lower) = self.lower.get_mut(place(quantity)) {
            *lower = value.max(*lower);
        }
    }

    /// Not above `value`.
    #[inline]
    pub fn at_most(&mut self, quantity: Quantity, value: i64) {
        if let Some(upper) = self.upper.get_mut(place(quantity)) {
            *upper = value.min(*upper);
        }
    }
}

/// A finished intersection.
#[derive(Debug, Clone, Copy)]
pub struct Calm {
    lower: [Twin; QUANTITIES],
    upper: [Twin; QUANTITIES],
    until: Twin,
}

impl Calm {
    /// Nothing is known.
    pub const NONE: Self = Self {
        lower: [Twin::new(i64::MIN); QUANTITIES],
        upper: [Twin::new(i64::MAX); QUANTITIES],
        until: Twin::new(0),
    };

    /// Of a band.
    pub fn of(band: &Band) -> Self {
        Self {
            lower: band.lower.map(Twin::new),
            upper: band.upper.map(Twin::new),
            until: Twin::new(band.until),
        }
    }

    /// Every function answers as before. Damage does not: the full judgement follows.
    #[inline]
    pub fn holds(&self, motion: &Motion, now: u64) -> bool {
        let values = [motion.speed, motion.position, motion.acceleration, motion.torque];
        let ranges = self.lower.iter().zip(&self.upper);
        let mut holds = self.until.get().is_some_and(|until| (now as i64) < until);
        for ((lower, upper), value) in ranges.zip(values) {
            holds &= lower.is_kept() & upper.is_kept();
            holds &= (lower.seen() <= value) & (value <= upper.seen());
        }
        holds
    }
}

const fn place(quantity: Quantity) -> usize {
    match quantity {
        Quantity::Speed => 0,
        Quantity::Travel | Quantity::Position => 1,
        Quantity::Acceleration => 2,
        Quantity::Torque => 3,
    }
}

const fn value(quantity: Quantity, motion: &Motion) -> i64 {
    match quantity {
        Quantity::Speed => motion.speed,
        Quantity::Travel | Quantity::Position => motion.position,
        Quantity::Acceleration => motion.acceleration,
        Quantity::Torque => motion.torque,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: Motion = Motion { speed: 0, position: 1_000, acceleration: 0, torque: 0 };

    fn calm(make: impl Fn(&mut Band)) -> Calm {
        let mut band = Band::OPEN;
        make(&mut band);
        Calm::of(&band)
    }

    #[test]
    fn a_band_is_the_intersection_of_its_windows_and_includes_their_ends() {
        let calm = calm(|band| {
            band.stay_inside(&Range::around_zero(Quantity::Speed, 50), 0);
            band.stay_inside(&Range::between(Quantity::Speed, -10, 80), 0);
            band.stay_inside(&Range::around_zero(Quantity::Travel, 5), 1_000);
        });
        let holds = |speed, position| calm.holds(&Motion { speed, position, ..REST }, 7);
        assert!(holds(-10, 1_005) & holds(50, 995));
        assert_eq!([holds(-11, 1_000), holds(51, 1_000), holds(0, 994), holds(0, 1_006)], [false; 4]);
    }

    #[test]
    fn outside_a_shown_range_the_band_lies_beside_it() {
        let calm = calm(|band| band.stay_beside(&Range::between(Quantity::Position, 10, 999), &REST));
        assert!(calm.holds(&REST, 0));
        assert!(!calm.holds(&Motion { position: 999, ..REST }, 0));
    }

    #[test]
    fn it_ends_with_its_time_and_with_any_damage() {
        let mut calm = calm(|band| band.ends_at(8));
        assert!(calm.holds(&REST, 7) & !calm.holds(&REST, 8));
        calm.upper[2].damage();
        assert!(!calm.holds(&REST, 7));
    }
}
