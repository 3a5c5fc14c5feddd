//! Exact fractions: a ramp line never rounds, so the model never argues about an edge.

use std::cmp::Ordering;

/// A fraction with a positive denominator.
#[derive(Debug, Clone, Copy)]
#[must_use]
pub struct Ratio {
    numerator: i128,
    denominator: i128,
}

impl Ratio {
    /// `numerator / denominator`; the denominator must be positive.
    ///
    /// # Panics
    /// On a denominator of 0 or less.
    pub fn new(numerator: i128, denominator: i128) -> Self {
        assert!(denominator > 0, "a fraction needs a positive denominator");
        Self { numerator, denominator }
    }

    /// A whole number.
    pub fn whole(value: i64) -> Self {
        Self::new(i128::from(value), 1)
    }

    /// The sum.
    pub fn plus(self, other: Self) -> Self {
        Self::new(
            self.numerator * other.denominator + other.numerator * self.denominator,
            self.denominator * other.denominator,
        )
    }

    /// The difference.
    pub fn minus(self, other: Self) -> Self {
        self.plus(Self::new(-other.numerator, other.denominator))
    }

    /// The product with a whole number.
    pub fn times(self, factor: i64) -> Self {
        Self::new(self.numerator * i128::from(factor), self.denominator)
    }

    /// The larger of two.
    pub fn max(self, other: Self) -> Self {
        if self < other { other } else { self }
    }

    /// The smaller of two.
    pub fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }

    /// The quotient by a positive whole number.
    pub fn over(self, divisor: i64) -> Self {
        Self::new(self.numerator, self.denominator * i128::from(divisor))
    }

    /// `self * share / whole`; the whole must be positive.
    pub fn scaled(self, share: Self, whole: Self) -> Self {
        let numerator = self.numerator * share.numerator * whole.denominator;
        Self::new(numerator, self.denominator * share.denominator * whole.numerator)
    }

    /// Rounded to the nearest whole number, halves away from zero.
    pub fn to_nearest(self) -> i64 {
        let twice = 2 * self.numerator.abs() + self.denominator;
        let size = (twice / (2 * self.denominator)) as i64;
        if self.numerator < 0 { -size } else { size }
    }
}

impl PartialEq for Ratio {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Ratio {}

impl PartialOrd for Ratio {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ratio {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.numerator * other.denominator).cmp(&(other.numerator * self.denominator))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirds_are_exact() {
        let third = Ratio::new(1, 3);
        assert_eq!(third.times(3), Ratio::whole(1));
        assert!(third.plus(third) < Ratio::whole(1));
        assert_eq!(Ratio::whole(1).minus(third).times(3), Ratio::whole(2));
    }
}
