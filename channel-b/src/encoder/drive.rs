//! The own movement beside the drive's own position, which is not safe: it uncovers an evaluation
//! that follows another machine (LNZ-SPD-06, ATV-ENC-09).

use shm_schema::INCREMENTS_PER_REVOLUTION;

use super::MRPM_PER_INCREMENT_NS;

/// Filter of the speed comparison, ns (LNZ-SPD-06: about 2 s).
const FILTER_NS: f64 = 2e9;
/// Travel against each other that no reversal between two samples explains (DEC-46): a quarter
/// of a revolution.
const OPPOSITE_MOST: i64 = INCREMENTS_PER_REVOLUTION / 4;

/// What differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contradiction {
    /// Filtered difference of the speeds, 1/1000 rpm.
    pub deviation_mrpm: i64,
    /// They move against each other.
    pub is_opposite: bool,
}

impl Contradiction {
    /// The two agree.
    pub const NONE: Self = Self { deviation_mrpm: 0, is_opposite: false };
}

/// Compares position with position.
#[derive(Debug, Clone, Copy)]
pub struct Companion {
    /// Own position, the drive's, and when, ns.
    last: Option<(i64, i64, u64)>,
    /// Increments that the filter holds.
    held: f64,
    opposite: i64,
}

impl Companion {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self { last: None, held: 0.0, opposite: 0 }
    }

    /// Takes both positions of the sample at `time_ns`.
    pub fn observe(&mut self, own: i64, drive: i64, time_ns: u64) -> Contradiction {
        let last = self.last.replace((own, drive, time_ns));
        let Some((own_before, drive_before, before)) = last else { return Contradiction::NONE };
        let (own, drive) = (own.saturating_sub(own_before), drive.saturating_sub(drive_before));
        let elapsed = time_ns.saturating_sub(before) as f64;
        self.filter(own.saturating_sub(drive), elapsed);
        let both = own.saturating_abs().min(drive.saturating_abs());
        let change = if (own < 0) == (drive < 0) { both.saturating_neg() } else { both };
        self.opposite = self.opposite.saturating_add(change).clamp(0, i64::MAX);
        let deviation = libm::fabs(self.held) * MRPM_PER_INCREMENT_NS / FILTER_NS;
        // Not finite is as bad as it can be; the cast saturates.
        let deviation_mrpm = if deviation.is_finite() { deviation as i64 } else { i64::MAX };
        Contradiction { deviation_mrpm, is_opposite: self.opposite > OPPOSITE_MOST }
    }

    fn filter(&mut self, difference: i64, elapsed: f64) {
        let share = (elapsed / FILTER_NS).clamp(0.0, 1.0);
        self.held += difference as f64 - self.held * share;
    }
}

impl Default for Companion {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn follow(own: i64, drive: i64, cycles: i64) -> Contradiction {
        let mut companion = Companion::new();
        let step = |cycle: i64| companion.observe(cycle * own, cycle * drive, cycle as u64 * MS);
        (0..=cycles).map(step).last().unwrap_or(Contradiction::NONE)
    }

    /// LNZ-SPD-06: one increment each millisecond is 0.9155 rpm; after 2 s 63 % of it shows.
    #[test]
    fn a_lasting_difference_of_speeds_grows_through_the_filter() {
        assert_eq!(follow(100, 100, 10_000), Contradiction::NONE);
        let (after_filter, settled) = (follow(101, 100, 2_000), follow(101, 100, 20_000));
        assert!((577..580).contains(&after_filter.deviation_mrpm), "{after_filter:?}");
        assert!((910..916).contains(&settled.deviation_mrpm), "{settled:?}");
    }

    /// ATV-ENC-09: the two turn against each other for a quarter of a revolution.
    #[test]
    fn opposite_directions_are_seen_after_a_quarter_of_a_revolution() {
        assert!(!follow(100, -100, 163).is_opposite);
        assert!(follow(100, -100, 164).is_opposite);
        assert!(!follow(100, 0, 10_000).is_opposite);
        assert!(!follow(-100, -100, 10_000).is_opposite);
    }
}
