//! Safe inputs: glitch filter, time filter and pulse check of line .2 of each pair
//! (DEC-36), by run lengths.

use shm_schema::io::{Io, PAIRS};

/// Equal samples in a row that change the glitch filter (AMK-FILT-03: 250 µs).
const GLITCH_SAMPLES: u32 = 4;
/// A measured sampling period below this share (eighths) of the set one is too short (DEC-46).
const PERIOD_SHARE_EIGHTHS: u64 = 4;

/// How one line is read.
#[derive(Debug, Clone, Copy, Default)]
pub struct LineSetup {
    /// Filter time, µs (Prm73, 79, 85).
    pub filter_us: u32,
    /// The line is inverted against its partner (Prm70, 76, 82).
    pub is_inverted: bool,
    /// The line carries test pulses that must be seen.
    pub is_pulsed: bool,
    /// Period of the test pulses, ms.
    pub period_ms: u32,
}

/// What is wrong with the pulses of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PulseFault {
    /// No pulse within the period.
    Missing,
    /// Pulses follow each other too fast.
    TooShort,
}

/// Filter of one line.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    setup: LineSetup,
    /// Samples the glitch filter's output must be constant.
    hold: u32,
    raw: bool,
    raw_run: u32,
    glitch: bool,
    glitch_run: u32,
    level: bool,
    since_pulse: u64,
    pulses: u64,
    fault: Option<PulseFault>,
}

impl Line {
    /// A line that reads low.
    pub const fn new(setup: LineSetup) -> Self {
        // AMKP-SE-09: entries are the 62.5 µs grid rounded up to whole µs.
        let twice = setup.filter_us.saturating_mul(2).saturating_sub(1);
        Self {
            setup,
            hold: twice.div_ceil(125),
            raw: false,
            raw_run: 0,
            glitch: false,
            glitch_run: 0,
            level: false,
            since_pulse: 0,
            pulses: 0,
            fault: None,
        }
    }

    /// The line has always been at its newest sample.
    pub fn settle(&mut self, pattern: u64) {
        self.raw = pattern & 1 == 1;
        self.glitch = self.raw;
        self.level = self.raw;
        self.raw_run = GLITCH_SAMPLES;
        self.glitch_run = u32::MAX;
    }

    /// Takes the `count` newest samples, oldest first.
    pub fn take(&mut self, pattern: u64, count: u32) {
        self.fault = None;
        let all_equal = if self.raw { pattern == u64::MAX } else { pattern == 0 };
        if all_equal {
            return self.take_equal(count);
        }
        for place in (0..count.min(64)).rev() {
            self.sample(pattern >> (place & 63) & 1 == 1);
        }
    }

    /// The common case in closed form: nothing changed since the last cycle.
    fn take_equal(&mut self, count: u32) {
        let is_settled = (self.raw == self.glitch) & (self.glitch == self.level);
        if is_settled & !self.setup.is_pulsed {
            self.raw_run = self.raw_run.saturating_add(count);
            self.glitch_run = self.glitch_run.saturating_add(count);
            return;
        }
        let fills = GLITCH_SAMPLES.saturating_sub(self.raw_run);
        if (fills > 0) & (self.raw != self.glitch) {
            for _ in 0..count.min(64) {
                self.sample(self.raw);
            }
            return;
        }
        self.raw_run = self.raw_run.saturating_add(count);
        self.glitch_run = self.glitch_run.saturating_add(count);
        self.since_pulse = self.since_pulse.saturating_add(u64::from(count));
        self.settle_level();
        self.check_pulse();
    }

    fn sample(&mut self, raw: bool) {
        self.count_pulse(raw);
        self.raw_run = if raw == self.raw { self.raw_run.saturating_add(1) } else { 1 };
        self.raw = raw;
        self.glitch_run = self.glitch_run.saturating_add(1);
        let changes = (self.raw != self.glitch) & (self.raw_run >= GLITCH_SAMPLES);
        if changes {
            self.glitch = self.raw;
            self.glitch_run = 0;
        }
        self.settle_level();
        self.check_pulse();
    }

    /// AMK-FILT-04: at least the set time constant, for both edges alike.
    fn settle_level(&mut self) {
        if self.glitch_run >= self.hold {
            self.level = self.glitch;
        }
    }

    /// The end of a low pulse; its distance to the one before is the measured period.
    fn count_pulse(&mut self, raw: bool) {
        self.since_pulse = self.since_pulse.saturating_add(1);
        let ends = raw & !self.raw;
        if !ends {
            return;
        }
        let least = self.period_samples().saturating_mul(PERIOD_SHARE_EIGHTHS) >> 3;
        let is_second = self.pulses > 0;
        if is_second & (self.since_pulse < least) & self.setup.is_pulsed {
            self.fault = Some(PulseFault::TooShort);
        }
        self.pulses = self.pulses.saturating_add(1);
        self.since_pulse = 0;
    }

    /// AMKP-SE-11: one pulse at least in each period, while the line is high.
    fn check_pulse(&mut self) {
        if !self.level {
            self.since_pulse = 0;
            self.pulses = 0;
        }
        let is_late = self.since_pulse > self.period_samples();
        if is_late & self.setup.is_pulsed {
            self.fault = Some(PulseFault::Missing);
        }
    }

    fn period_samples(&self) -> u64 {
        u64::from(self.setup.period_ms).saturating_mul(16)
    }

    /// The level behind the filter, 1 = not requested.
    pub fn level(&self) -> bool {
        self.level != self.setup.is_inverted
    }

    /// The pattern that changes nothing: it has been at it for longer than any filter asks for.
    fn rest(&self) -> Option<u64> {
        let is_settled = (self.raw == self.glitch) & (self.glitch == self.level);
        let is_long = (self.raw_run >= GLITCH_SAMPLES) & (self.glitch_run >= self.hold);
        let rests = is_settled & is_long & !self.setup.is_pulsed;
        rests.then_some(if self.raw { u64::MAX } else { 0 })
    }

    /// What was wrong with the pulses in the samples last taken.
    pub fn fault(&self) -> Option<PulseFault> {
        self.fault
    }
}

/// The four lines of channel B.
#[derive(Debug, Clone, Copy)]
pub struct Inputs {
    /// Lines .2 of the pairs.
    pub lines: [Line; PAIRS],
    /// Lines .1, for profiles with a discrepancy time of their own.
    pub others: [Line; PAIRS],
    /// Pairs that are evaluated, and whether lines .1 are too.
    pairs: usize,
    has_others: bool,
    samples: Option<u64>,
    are_read: bool,
    /// Levels of lines .2 and .1 as of the newest samples.
    levels: u32,
    other_levels: u32,
    has_fault: bool,
    rest: Option<Rest>,
}

/// Every line that is evaluated rests: the patterns they rest at, and which bits count.
#[derive(Debug, Clone, Copy)]
struct Rest {
    patterns: [[u64; PAIRS]; 2],
    masks: [[u64; PAIRS]; 2],
}

impl Rest {
    fn of(inputs: &Inputs) -> Option<Self> {
        let mut rest = Self { patterns: [[0; PAIRS]; 2], masks: [[0; PAIRS]; 2] };
        let watched = [inputs.pairs, if inputs.has_others { inputs.pairs } else { 0 }];
        let sides = rest.patterns.iter_mut().zip(&mut rest.masks);
        for (((patterns, masks), lines), count) in sides.zip([&inputs.lines, &inputs.others]).zip(watched) {
            for ((pattern, mask), line) in patterns.iter_mut().zip(masks).zip(lines).take(count) {
                (*pattern, *mask) = (line.rest()?, u64::MAX);
            }
        }
        Some(rest)
    }

    fn goes_on(&self, io: &Io) -> bool {
        let mut differs = 0;
        for ((patterns, masks), lines) in self.patterns.iter().zip(&self.masks).zip([&io.line_2, &io.line_1])
        {
            for ((pattern, mask), line) in patterns.iter().zip(masks).zip(lines) {
                differs |= (pattern ^ line) & mask;
            }
        }
        differs == 0
    }
}

fn levels_of(lines: &[Line]) -> u32 {
    (0..).zip(lines).fold(0, |levels, (pair, line)| levels | u32::from(line.level()) << (pair & 3))
}

impl Inputs {
    /// Lines with their setups; the first `pairs` are evaluated, lines .1 where asked for.
    pub fn new(setups: [LineSetup; PAIRS], pairs: usize, has_others: bool) -> Self {
        let (lines, others) = (setups.map(Line::new), setups.map(Line::new));
        Self {
            lines,
            others,
            pairs,
            has_others,
            samples: None,
            are_read: false,
            levels: 0,
            other_levels: 0,
            has_fault: false,
            rest: None,
        }
    }

    /// Something was wrong with the pulses of a line.
    pub const fn has_fault(&self) -> bool {
        self.has_fault
    }

    /// Levels of lines .1, bit n for pair n; all low when unreadable.
    pub fn others(&self) -> u32 {
        if self.are_read & self.has_others { self.other_levels } else { 0 }
    }

    /// Takes the samples of this cycle; `None`: unreadable, all levels low (DEC-18).
    /// Returns the levels, bit n for pair n.
    pub fn take(&mut self, io: Option<&Io>, settled: bool) -> u32 {
        let Some(io) = io else {
            self.are_read = false;
            return 0;
        };
        self.are_read = true;
        let goes_on = !settled & self.rest.is_some_and(|rest| rest.goes_on(io));
        if !goes_on {
            self.take_samples(io, settled);
        }
        self.samples = Some(io.samples);
        self.levels
    }

    fn take_samples(&mut self, io: &Io, settled: bool) {
        let count = match self.samples {
            Some(before) => io.samples.wrapping_sub(before).min(64) as u32,
            None => 64,
        };
        let own = self.lines.iter_mut().zip(io.line_2).take(self.pairs);
        let watched = if self.has_others { self.pairs } else { 0 };
        let others = self.others.iter_mut().zip(io.line_1).take(watched);
        for (line, pattern) in own.chain(others) {
            if settled {
                line.settle(pattern);
            } else {
                line.take(pattern, count);
            }
        }
        self.levels = levels_of(self.lines.get(..self.pairs).unwrap_or(&[]));
        self.other_levels = levels_of(&self.others);
        self.has_fault = self.lines.iter().any(|line| line.fault.is_some());
        self.rest = Rest::of(self);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(filter_us: u32) -> Line {
        let mut line = Line::new(LineSetup { filter_us, ..LineSetup::default() });
        line.settle(u64::MAX);
        line
    }

    /// AMK-EX-GLITCH: the single 1 is ignored, the fourth equal sample changes.
    #[test]
    fn the_glitch_filter_changes_at_the_fourth_equal_sample() {
        let mut line = Line::new(LineSetup::default());
        line.settle(0);
        let seen = [0, 0, 0, 0, 1, 0, 1, 1, 1, 1].map(|bit| {
            line.sample(bit == 1);
            line.glitch
        });
        assert_eq!(seen.iter().position(|level| *level), Some(9));
    }

    /// AMK-FILT-04, AMKP-EX-PULSE-GRID: 250, 313, 375 µs are 4, 5, 6 samples.
    #[test]
    fn the_time_filter_waits_for_the_set_time_behind_the_glitch_filter() {
        for (filter_us, samples) in [(250, 8), (313, 9), (375, 10), (1_000, 20), (65_500, 1_052)] {
            let mut line = line(filter_us);
            let needed = (1..2_000).find(|_| {
                line.sample(false);
                !line.level()
            });
            assert_eq!(needed, Some(samples), "{filter_us} µs");
        }
    }

    #[test]
    fn a_pattern_and_its_samples_one_by_one_give_the_same_level() {
        let (mut whole, mut single) = (line(1_000), line(1_000));
        let patterns = [!0, 0xFF00_FF00_F0F0_0000, 0, 0, 0xFFFF, 0xFFFF_FFFF, !0, !0, !0];
        for pattern in patterns {
            whole.take(pattern, 16);
            for place in (0..16).rev() {
                single.sample(pattern >> place & 1 == 1);
            }
            assert_eq!((whole.level, whole.glitch), (single.level, single.glitch), "{pattern:x}");
        }
    }

    /// AMKP-SE-11: without a pulse in the period 3606/19 Info2 1 follows.
    #[test]
    fn a_line_without_test_pulses_is_found_after_its_period() {
        let mut line =
            Line::new(LineSetup { filter_us: 250, is_pulsed: true, period_ms: 50, is_inverted: false });
        line.settle(u64::MAX);
        let cycle = (0..100).find(|_| {
            line.take(u64::MAX, 16);
            line.fault().is_some()
        });
        assert_eq!((cycle, line.fault()), (Some(50), Some(PulseFault::Missing)));
    }

    #[test]
    fn an_unreadable_input_reads_low_even_when_its_line_is_inverted() {
        let setup = LineSetup { filter_us: 250, is_inverted: true, ..LineSetup::default() };
        let mut inputs = Inputs::new([setup; PAIRS], PAIRS, true);
        assert_eq!(inputs.take(None, true), 0);
        assert_eq!(inputs.take(Some(&Io::default()), true), 0xF);
    }
}
