//! Age and order of what other processes write, judged by channel B's own clock.
//!
//! B never subtracts a foreign time stamp from its own clock to get an age: the two clocks
//! may have different origins. It compares the distance of the two clocks with the smallest
//! distance seen, and counts its own steps since the sequence last advanced (DEC-26).

use crate::twin::Twin;

/// Rates further apart than this over one second are a fault (DEC-26: 2 %).
const RATE_NS: i64 = 20_000_000;
/// Length of a rate measurement, ns.
const WINDOW_NS: u64 = 1_000_000_000;

/// How long something may be without news.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    cycles: i64,
    longest_ns: u64,
}

impl Limit {
    /// `cycles` of `cycle_ns`, one at least; half a cycle of grace for a late wake-up: overruns are
    /// judged elsewhere.
    pub fn new(cycles: u8, cycle_ns: u64) -> Self {
        let cycles = cycles.max(1);
        let longest_ns = u64::from(cycles).saturating_mul(cycle_ns).saturating_add(cycle_ns >> 1);
        Self { cycles: i64::from(cycles), longest_ns }
    }
}

/// What a step sees of a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Look {
    /// It has advanced.
    pub is_news: bool,
    /// It has not for too long.
    pub is_stale: bool,
}

/// Steps since a sequence last advanced.
#[derive(Debug, Clone, Copy)]
pub struct Freshness {
    newest: Option<u64>,
    missed: Twin,
    since: Twin,
}

impl Freshness {
    /// Nothing seen yet: stale.
    pub const fn new() -> Self {
        Self { newest: None, missed: Twin::new(STALE), since: Twin::time(0) }
    }

    /// A step at `now` that sees `sequence`; whether that is news.
    pub fn observe(&mut self, sequence: Option<u64>, now: u64) -> bool {
        let is_news = sequence.is_some_and(|seen| self.newest.is_none_or(|newest| seen > newest));
        if is_news {
            self.newest = sequence;
            self.missed = Twin::new(0);
            self.since = Twin::time(now);
        } else {
            let missed = self.missed.get().unwrap_or(STALE);
            self.missed = Twin::new(missed.saturating_add(1).min(STALE));
        }
        is_news
    }

    /// The step just observed does not count: there was nothing to advance with.
    pub fn hold(&mut self, cycle_ns: u64) {
        let missed = self.missed.get().unwrap_or(STALE);
        if missed < STALE {
            self.missed = Twin::new(missed.saturating_sub(1).max(0));
            let since = self.since.get_time().unwrap_or(0);
            self.since = Twin::time(since.saturating_add(cycle_ns));
        }
    }

    /// Both at once: whether `sequence` is news, and whether there has been none for too long.
    #[inline]
    pub fn look(&mut self, sequence: Option<u64>, limit: &Limit, now: u64) -> Look {
        if self.observe(sequence, now) {
            return Look { is_news: true, is_stale: false };
        }
        Look { is_news: false, is_stale: self.is_stale(limit, now) }
    }

    /// Not advanced for as many steps as `limit` says, or for clearly longer than as many cycles.
    pub fn is_stale(&self, limit: &Limit, now: u64) -> bool {
        let Some(missed) = self.missed.get() else { return true };
        let Some(since) = self.since.get_time() else { return true };
        (missed >= limit.cycles) | (now.saturating_sub(since) > limit.longest_ns)
    }
}

impl Default for Freshness {
    fn default() -> Self {
        Self::new()
    }
}

/// More missed steps than any limit.
const STALE: i64 = 1_000_000;

/// A foreign clock beside the own one.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    base: Option<i64>,
    window_start: u64,
    window_least: i64,
    previous_least: Option<i64>,
    /// Drift over one second that is a fault, ns.
    rate_ns: i64,
}

/// What a foreign clock said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockVerdict {
    /// Age of the time stamp against the best seen, ns.
    pub age_ns: u64,
    /// The time stamp lies in the future by more than the tolerance.
    pub is_ahead: bool,
    /// Its rate is more than 2 % off.
    pub is_off: bool,
}

impl Clock {
    /// Nothing seen yet; `factor` on the limit (architecture, "Timing").
    pub const fn new(factor: u8) -> Self {
        let rate_ns = RATE_NS.saturating_mul(factor as i64);
        Self { base: None, window_start: 0, window_least: i64::MAX, previous_least: None, rate_ns }
    }

    /// Forgets everything, after a gap.
    pub const fn restart(&mut self) {
        *self = Self { rate_ns: self.rate_ns, ..Self::new(1) };
    }

    /// A stamp `theirs` read at `now`; `tolerance_ns` of future is no fault.
    pub fn observe(&mut self, now: u64, theirs: u64, tolerance_ns: u64) -> ClockVerdict {
        let distance = (now as i64).wrapping_sub(theirs as i64);
        let base = *self.base.get_or_insert(distance);
        let step = distance.saturating_sub(base);
        let is_ahead = step < -(tolerance_ns.min(i64::MAX as u64) as i64);
        if step < 0 {
            self.base = Some(distance);
        }
        let is_off = self.measure(now, distance);
        ClockVerdict { age_ns: step.max(0) as u64, is_ahead, is_off }
    }

    fn measure(&mut self, now: u64, distance: i64) -> bool {
        if self.window_least == i64::MAX {
            self.window_start = now;
        }
        self.window_least = self.window_least.min(distance);
        if now.saturating_sub(self.window_start) < WINDOW_NS {
            return false;
        }
        let least = self.window_least;
        let drift = self.previous_least.map_or(0, |previous| least.saturating_sub(previous));
        self.previous_least = Some(least);
        self.window_least = i64::MAX;
        // Slow drift of two clocks of one crystal is followed, a wrong rate is a fault.
        let is_off = drift.saturating_abs() > self.rate_ns;
        if !is_off {
            self.base = Some(least);
        }
        is_off
    }
}

impl Default for Clock {
    fn default() -> Self {
        Self::new(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Architecture: frozen from cycle k on, dropped in cycle k + 2.
    #[test]
    fn three_steps_without_news_are_stale_and_two_are_not() {
        let mut fresh = Freshness::new();
        assert!(fresh.observe(Some(4), MS));
        for (cycle, stale) in [(2, false), (3, false), (4, true)] {
            assert!(!fresh.observe(Some(4), cycle * MS));
            assert_eq!(fresh.is_stale(&Limit::new(3, MS), cycle * MS), stale);
        }
    }

    /// DEC-26: 2 % over one second.
    #[test]
    fn a_clock_three_per_cent_slow_is_found_and_one_per_cent_is_not() {
        for (percent, off) in [(1, false), (3, true)] {
            let mut clock = Clock::new(1);
            let seen = (0..2_500_u64).any(|cycle| {
                let theirs = cycle * MS - cycle * MS / 100 * percent;
                clock.observe(7 + cycle * MS, theirs, MS).is_off
            });
            assert_eq!(seen, off, "{percent} %");
        }
    }

    #[test]
    fn an_old_stamp_has_an_age_and_a_stamp_of_the_future_is_ahead() {
        let mut clock = Clock::new(1);
        clock.observe(100 * MS, 40 * MS, MS);
        assert_eq!(clock.observe(103 * MS, 40 * MS, MS).age_ns, 3 * MS);
        assert!(clock.observe(104 * MS, 47 * MS, MS).is_ahead);
    }
}
