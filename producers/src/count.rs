//! A hardware counter of any width becomes the signed, wrapping count of an encoder slot.

/// Quarter periods counted by a counter that wraps at its ceiling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quarters {
    /// Values the counter has: ceiling + 1; 0 means all of 64 bits.
    values: u64,
    raw: u64,
    count: i32,
}

impl Quarters {
    /// A counter that shows `raw` now and wraps behind `ceiling`; its count starts at 0.
    pub const fn new(raw: u64, ceiling: u64) -> Self {
        Self { values: ceiling.wrapping_add(1), raw, count: 0 }
    }

    /// The count after the counter has come to `raw`, by the shorter way.
    pub fn step(&mut self, raw: u64) -> i32 {
        let forward = self.forward(raw);
        let backward = self.values.wrapping_sub(forward);
        // All of 64 bits: the complement is the way back.
        let shorter_is_back = (forward != 0) & (backward < forward);
        // What does not fit wraps like the slot itself.
        let change = if shorter_is_back { (backward as i32).wrapping_neg() } else { forward as i32 };
        self.raw = raw;
        self.count = self.count.wrapping_add(change);
        self.count
    }

    fn forward(&self, raw: u64) -> u64 {
        let ahead = raw.wrapping_sub(self.raw);
        if raw >= self.raw { ahead } else { ahead.wrapping_add(self.values) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_of_sixteen_bits_wraps_both_ways() {
        let mut quarters = Quarters::new(65_530, 65_535);
        assert_eq!(quarters.step(65_535), 5);
        assert_eq!(quarters.step(3), 9, "over the ceiling");
        assert_eq!(quarters.step(65_534), 4, "and back");
        assert_eq!(quarters.step(65_534), 4, "standstill");
    }

    #[test]
    fn a_ceiling_that_is_no_power_of_two_wraps_there() {
        let mut quarters = Quarters::new(3_998, 3_999);
        assert_eq!(quarters.step(1), 3);
        assert_eq!(quarters.step(3_997), -1);
    }

    #[test]
    fn a_counter_of_sixty_four_bits_counts_down_through_zero() {
        let mut quarters = Quarters::new(2, u64::MAX);
        assert_eq!(quarters.step(u64::MAX), -3);
        assert_eq!(quarters.step(7), 5);
    }

    #[test]
    fn the_count_wraps_as_the_slot_does() {
        let mut quarters = Quarters::new(0, u64::MAX);
        assert_eq!(quarters.step(i32::MAX as u64), i32::MAX);
        assert_eq!(quarters.step(i32::MAX as u64 + 1), i32::MIN);
    }
}
