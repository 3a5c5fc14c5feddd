//! Safe input lines: glitch filter, then time filter, sample by sample (AMK-FILT-02), and
//! the check of their test pulses (AMKP-SE-11).

/// Samples that have to agree before the glitch filter follows (AMK-FILT-03).
const GLITCH_SAMPLES: u64 = 4;
const GLITCH_MASK: u64 = (1 << GLITCH_SAMPLES) - 1;
/// Tolerance of a measured test pulse period: a tenth (DEC-46).
const PERIOD_TOLERANCE_DIVISOR: u64 = 10;
/// Samples a pattern holds.
const PATTERN: u64 = 64;

/// Filter time of a line in samples of 62.5 µs: entries are rounded up to whole
/// microseconds, so half a microsecond is forgiven (AMKP-SE-09).
pub const fn filter_samples(time_us: u64) -> u64 {
    time_us.saturating_mul(2).saturating_sub(1).div_ceil(125)
}

/// The newest samples of a pattern, as many as have arrived since the step before.
#[derive(Debug, Clone, Copy)]
pub struct Newest {
    count: u64,
    mask: u64,
}

impl Newest {
    /// So many.
    pub const fn new(count: u64) -> Self {
        let mask = if count >= PATTERN { u64::MAX } else { (1 << (count & 63)) - 1 };
        Self { count, mask }
    }

    /// More have arrived than a pattern holds.
    const fn lost(self) -> bool {
        self.count > PATTERN
    }

    /// All of them show this level.
    const fn all(self, pattern: u64, high: bool) -> bool {
        let other = if high { !pattern } else { pattern };
        other & self.mask == 0
    }

    /// One by one, the oldest first.
    fn each(self, pattern: u64) -> impl Iterator<Item = bool> {
        (0..self.count.min(PATTERN) as u32).rev().map(move |index| pattern.wrapping_shr(index) & 1 == 1)
    }
}

/// One input line.
#[derive(Debug, Clone, Copy, Default)]
pub struct Line {
    filter: u64,
    glitch_free: bool,
    constant_for: u64,
    level: bool,
    history: u64,
    /// Samples that have to agree, as a mask of the history.
    agreeing: u64,
    /// The level is about to change, or was; else only a sample of the other level does anything.
    unsteady: bool,
}

impl Line {
    /// A line that reads low until it has proven otherwise.
    pub fn new(filter: u64) -> Self {
        Self { filter, agreeing: GLITCH_MASK, ..Self::default() }
    }

    /// The same without a glitch filter in front (Lenze, LNZ-IN-11).
    pub fn unglitched(filter: u64) -> Self {
        Self { agreeing: 1, ..Self::new(filter) }
    }

    /// The line has stood like this for ever.
    pub fn settle(&mut self, level: bool) {
        self.history = if level { u64::MAX } else { 0 };
        self.glitch_free = level;
        self.level = level;
        self.constant_for = u64::MAX / 2;
        self.unsteady = false;
    }

    /// The debounced level.
    pub const fn level(&self) -> bool {
        self.level
    }

    /// The newest samples of `pattern` change nothing.
    pub const fn rests(&self, pattern: u64, newest: Newest) -> bool {
        let same = newest.all(pattern, self.level);
        same & !(self.unsteady | newest.lost())
    }

    /// The newest samples of `pattern` have arrived.
    pub fn take(&mut self, pattern: u64, newest: Newest) {
        if self.rests(pattern, newest) {
            return;
        }
        if newest.lost() {
            // Samples were lost: the level has to prove itself again (DEC-18).
            *self = Self { agreeing: self.agreeing, ..Self::new(self.filter) };
        }
        newest.each(pattern).for_each(|high| self.sample(high));
        let expected = if self.level { u64::MAX } else { 0 };
        let agree = (self.history ^ expected) & self.agreeing == 0;
        let follows = self.glitch_free == self.level;
        self.unsteady = !(agree & follows);
    }

    fn sample(&mut self, high: bool) {
        self.history = (self.history << 1) | u64::from(high);
        let last = self.history & self.agreeing;
        let settled = (last == 0) | (last == self.agreeing);
        self.constant_for = self.constant_for.saturating_add(1);
        if settled & (self.glitch_free != high) {
            self.glitch_free = high;
            self.constant_for = 0;
        }
        if self.constant_for >= self.filter {
            self.level = self.glitch_free;
        }
    }
}

/// What the test pulses of a line show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PulseFault {
    /// None within the period (Info2 1).
    Missing = 1,
    /// Too soon after the one before (Info2 4).
    TooSoon = 4,
}

/// Check of the test pulses of one line.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pulses {
    /// Samples from one pulse to the next, at least and at most.
    earliest: u64,
    latest: u64,
    since: u64,
    /// Samples between the beginnings of the pulse that lasts and the one before.
    gap: u64,
    low: bool,
    seen: bool,
}

impl Pulses {
    /// Checks for one pulse in `period_ms`.
    pub fn new(period_ms: u64) -> Self {
        let period = period_ms.saturating_mul(16);
        let tolerance = period / PERIOD_TOLERANCE_DIVISOR;
        let (earliest, latest) = (period.saturating_sub(tolerance), period.saturating_add(tolerance));
        Self { earliest, latest, ..Self::default() }
    }

    /// The newest samples of `pattern` have arrived while the line's level is `high`.
    pub fn take(&mut self, pattern: u64, newest: Newest, high: bool) -> Option<PulseFault> {
        if !high {
            *self = Self { earliest: self.earliest, latest: self.latest, ..Self::default() };
            return None;
        }
        let mut fault = None;
        // Most patterns hold no pulse at all.
        if newest.all(pattern, true) & !self.low {
            self.since = self.since.saturating_add(newest.count.min(PATTERN));
        } else {
            newest.each(pattern).for_each(|high| fault = self.sample(high).or(fault));
        }
        if self.since > self.latest { Some(PulseFault::Missing) } else { fault }
    }

    /// A low line is a pulse when it ends inside the filter time: a request is none, and never
    /// comes too soon.
    fn sample(&mut self, high: bool) -> Option<PulseFault> {
        let begins = !(high | self.low);
        let ends = high & self.low;
        self.low = !high;
        self.since = self.since.saturating_add(1);
        if begins {
            (self.gap, self.since) = (self.since, 0);
        }
        let early = ends & self.seen & (self.gap < self.earliest);
        self.seen |= ends;
        early.then_some(PulseFault::TooSoon)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_rounded_up_to_microseconds_mean_whole_samples() {
        // AMKP-EX-PULSE-GRID
        assert_eq!([250, 313, 375, 438, 600].map(filter_samples), [4, 5, 6, 7, 10]);
    }

    #[test]
    fn a_single_wrong_sample_is_ignored_and_four_equal_ones_count() {
        // AMK-EX-GLITCH: 0 0 0 0 1 0 1 1 1 1, newest last
        let mut line = Line::new(0);
        line.settle(false);
        line.take(0b00_0010_1111, Newest::new(10));
        assert!(line.level());
        line.settle(false);
        line.take(0b00_0010_1110 >> 1, Newest::new(9));
        assert!(!line.level());
    }

    #[test]
    fn the_level_follows_after_glitch_and_filter_time() {
        // AMK-FILT-04, AMK-TIME-02: 0.25 ms + 1 ms
        let mut line = Line::new(filter_samples(1_000));
        line.settle(true);
        let mut samples = 0;
        while line.level() {
            line.take(0, Newest::new(1));
            samples += 1;
        }
        assert_eq!(samples, 4 + 16);
    }

    #[test]
    fn without_a_glitch_filter_the_time_alone_counts() {
        // LNZ-IN-11: low from one sample on for 2 ms
        let mut line = Line::unglitched(filter_samples(2_000));
        line.settle(true);
        let mut samples = 0;
        while line.level() {
            line.take(0, Newest::new(1));
            samples += 1;
        }
        assert_eq!(samples, 33);
    }

    #[test]
    fn a_glitch_before_quiet_samples_is_forgotten_and_no_part_of_the_next() {
        // AMK-FILT-03
        let mut line = Line::new(0);
        line.settle(false);
        line.take(0b1, Newest::new(16));
        line.take(0, Newest::new(16));
        line.take(0b111, Newest::new(3));
        assert!(!line.level(), "three of four");
        line.take(0b1, Newest::new(1));
        assert!(line.level());
    }

    #[test]
    fn lost_samples_read_as_low() {
        let mut line = Line::new(4);
        line.settle(true);
        line.take(u64::MAX, Newest::new(65));
        assert!(line.level(), "64 sound samples prove the level again");
        line.take(0, Newest::new(65));
        assert!(!line.level());
    }

    #[test]
    fn test_pulses_have_to_come_once_in_a_period() {
        // AMKP-SE-11
        let mut pulses = Pulses::new(50);
        let mut fault = None;
        for _ in 0..56 {
            fault = fault.or(pulses.take(u64::MAX, Newest::new(16), true));
        }
        assert_eq!(fault, Some(PulseFault::Missing));
        let mut pulses = Pulses::new(50);
        assert_eq!(pulses.take(0xFFF7, Newest::new(16), true), None);
        assert_eq!(pulses.take(0xFFF7, Newest::new(16), true), Some(PulseFault::TooSoon));
    }

    #[test]
    fn a_request_that_falls_soon_after_a_pulse_is_no_pulse() {
        // AMK-IN-02, AMKP-SE-11
        let mut pulses = Pulses::new(50);
        assert_eq!(pulses.take(0xFFF7, Newest::new(16), true), None);
        assert_eq!(pulses.take(0xFF00, Newest::new(16), true), None, "it falls and may still be a pulse");
        assert_eq!(pulses.take(0, Newest::new(16), false), None, "the filter time is over: it is requested");
        assert_eq!(pulses.take(0xFFFF, Newest::new(16), true), None);
    }
}
