//! The own lines of the safe outputs: what they are driven with, and whether they follow.
//!
//! Channel A owns the lines .1 of SA1 and SA2, and SDYN1. A test pulse is a gap in a line that
//! is on: once per period, at its end, generated and looked for by the line's owner.

use crate::fresh::Patience;

/// Own lines: SA1.1, SA2.1, SDYN1.
pub const LINES: usize = 3;
const SUPPLY: usize = 2;
/// Lines that have a readback of their own to follow; the supply is not safe (AMK-DYN-03).
pub const SAFE_LINES: usize = 2;
/// Distance of two samples, ns.
const SAMPLE_NS: u64 = 62_500;
/// Samples a pattern holds.
const PATTERN: u64 = 64;
/// Cycles in which a level has to follow, in the strict timing.
const FOLLOW: u8 = 3;

/// The test pulses of one line, in samples of 62.5 µs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Gaps {
    pulse: u64,
    period: u64,
}

impl Gaps {
    /// One gap of `pulse_us` in each `period_ms` (AMKP-SA-01, AMKP-SA-02).
    pub const fn new(pulse_us: i64, period_ms: i64) -> Self {
        let pulse = (pulse_us.saturating_mul(2) / 125).unsigned_abs();
        Self { pulse, period: period_ms.unsigned_abs().saturating_mul(16) }
    }

    const fn exist(self) -> bool {
        (self.pulse > 0) & (self.period > PATTERN)
    }
}

/// One line.
#[derive(Debug, Clone, Copy)]
struct Line {
    gaps: Gaps,
    /// Sample of the period in which the gap begins.
    begin: u64,
    /// Samples since the period began.
    at: u64,
    level: bool,
    /// Cycles since a gap was driven.
    whole_cycles: u16,
    /// Cycles since a gap began that has not been seen; 0: none.
    unseen_cycles: u16,
    unseen_gaps: u16,
    contradicted: u16,
}

impl Line {
    const fn new(gaps: Gaps) -> Self {
        let begin = if gaps.exist() { gaps.period.saturating_sub(gaps.pulse) } else { u64::MAX };
        Self {
            gaps,
            begin,
            at: 0,
            level: false,
            whole_cycles: if gaps.exist() { 0 } else { u16::MAX },
            unseen_cycles: 0,
            unseen_gaps: 0,
            contradicted: 0,
        }
    }

    /// Samples of the next cycle, bit k the k-th of `samples`.
    fn drive(&mut self, level: bool, samples: u64, all: u64) -> u64 {
        self.level = level;
        if self.begin == u64::MAX {
            return if level { all } else { 0 };
        }
        self.whole_cycles = self.whole_cycles.saturating_add(1);
        let after = self.at.saturating_add(samples);
        // Most cycles have no gap.
        if after <= self.begin {
            self.at = after;
            return if level { all } else { 0 };
        }
        let end = self.gaps.period.saturating_sub(self.at);
        let low = mask(end) & !mask(self.begin.saturating_sub(self.at)) & all;
        let begins = (low != 0) & (self.at < self.begin);
        self.at = after;
        if self.at >= self.gaps.period {
            self.at = self.at.saturating_sub(self.gaps.period);
        }
        if low != 0 {
            self.whole_cycles = 0;
        }
        if begins & level {
            self.unseen_cycles = 1;
        }
        if level { all & !low } else { 0 }
    }

    /// What the newest `new` samples read; `true` when the line does not follow.
    fn judge(&mut self, pattern: u64, new: u64, limits: &Limits) -> bool {
        let read = mask(new);
        let (high, low) = (pattern & read != 0, !pattern & read != 0);
        let in_gap = self.whole_cycles <= limits.cycles;
        let contradicts = if self.level { !(high | in_gap) } else { high };
        self.contradicted = if contradicts { self.contradicted.saturating_add(1) } else { 0 };
        if low {
            (self.unseen_cycles, self.unseen_gaps) = (0, 0);
        } else if self.unseen_cycles > 0 {
            self.unseen_cycles = self.unseen_cycles.saturating_add(1);
        }
        if self.unseen_cycles > limits.cycles.saturating_add(1) {
            self.unseen_cycles = 0;
            self.unseen_gaps = self.unseen_gaps.saturating_add(1);
        }
        (self.contradicted > limits.cycles) | (self.unseen_gaps >= limits.gaps)
    }
}

const fn mask(samples: u64) -> u64 {
    if samples >= PATTERN { u64::MAX } else { (1 << (samples & 63)) - 1 }
}

/// How late a line may follow, and how many gaps a late producer may swallow.
#[derive(Debug, Clone, Copy)]
struct Limits {
    cycles: u16,
    gaps: u16,
}

/// The lines of one axis.
#[derive(Debug, Clone, Copy)]
pub struct Outputs {
    lines: [Line; LINES],
    supplies: bool,
    samples: u64,
    limits: Limits,
    read_samples: Option<u64>,
    /// The producer returns what is driven: the supply, always on, has been read so.
    returned: bool,
}

impl Outputs {
    /// Lines that are off; `supplies`: the third is a supply that is always on.
    pub fn new(gaps: [Gaps; LINES], supplies: bool, cycle_ns: u64, patience: Patience) -> Self {
        Self {
            lines: gaps.map(Line::new),
            supplies,
            samples: (cycle_ns / SAMPLE_NS).min(PATTERN),
            limits: Limits { cycles: patience.cycles(FOLLOW), gaps: patience.cycles(1) },
            read_samples: None,
            returned: false,
        }
    }

    /// What is driven in the cycle that follows, with these levels of SA1.1 and SA2.1.
    pub fn drive(&mut self, levels: [bool; SAFE_LINES]) -> [u64; LINES] {
        let wanted = [levels[0], levels[1], self.supplies];
        let all = mask(self.samples);
        let mut driven = [0; LINES];
        for ((place, line), level) in driven.iter_mut().zip(&mut self.lines).zip(wanted) {
            *place = line.drive(level, self.samples, all);
        }
        driven
    }

    /// The safe lines that do not follow. `readback`: samples since power-up, then what each
    /// own line read. A readback that has never shown the supply returns nothing at all.
    pub fn judge(&mut self, readback: Option<(u64, [u64; LINES])>) -> [bool; SAFE_LINES] {
        let mut faulty = [false; SAFE_LINES];
        let Some((samples, patterns)) = readback else {
            self.read_samples = None;
            return faulty;
        };
        let new = self.read_samples.replace(samples).map_or(0, |before| samples.wrapping_sub(before));
        self.returned |= self.supplies & (patterns[SUPPLY] != 0);
        if !self.returned | (new == 0) {
            return faulty;
        }
        for ((faulty, line), pattern) in faulty.iter_mut().zip(&mut self.lines).zip(patterns) {
            *faulty = line.judge(pattern, new, &self.limits);
        }
        faulty
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SA1: Gaps = Gaps::new(500, 50);

    fn outputs(age_factor: u8) -> Outputs {
        let supply = Gaps::new(500, 1_000);
        Outputs::new([SA1, Gaps::default(), supply], true, 1_000_000, Patience::new(age_factor))
    }

    /// First cycle in which a safe line is found not to follow; `bent` changes what is read.
    fn first_fault(
        levels: [bool; 2],
        age_factor: u8,
        bent: fn(u64, usize, u64) -> u64,
    ) -> Option<(u64, usize)> {
        let mut outputs = outputs(age_factor);
        let mut driven = [0_u64; LINES];
        (0..400_u64).find_map(|cycle| {
            let mut read = [0; LINES];
            for (line, pattern) in read.iter_mut().enumerate() {
                // The newest sample is bit 0 of what is read.
                *pattern = bent(cycle, line, driven[line].reverse_bits() >> 48);
            }
            let faulty = outputs.judge(Some((16 * cycle, read)));
            driven = outputs.drive(levels);
            faulty.iter().position(|faulty| *faulty).map(|line| (cycle, line))
        })
    }

    #[test]
    fn a_gap_of_its_length_comes_once_in_a_period() {
        // AMK-DYN-09, AMKP-SA-01, AMKP-SA-02
        let mut outputs = outputs(1);
        let mut samples = std::vec::Vec::new();
        for _ in 0..100 {
            let [line, other, supply] = outputs.drive([true, false]);
            assert_eq!((other, supply), (0, 0xFFFF));
            samples.extend((0..16).map(|k| line >> k & 1));
        }
        let lows: std::vec::Vec<usize> = (0..1_600).filter(|at| samples[*at] == 0).collect();
        let expected = (792..800).chain(1_592..1_600);
        assert!(lows.into_iter().eq(expected));
    }

    #[test]
    fn lines_that_follow_are_no_fault_whatever_they_carry() {
        for levels in [[true, true], [false, true], [false, false]] {
            assert_eq!(first_fault(levels, 1, |_, _, read| read), None);
        }
    }

    #[test]
    fn a_level_has_three_cycles_to_follow() {
        // AMKD-OUTM-01, 3606/27
        let low = |cycle, line, read| if (line == 0) & (cycle > 20) { 0 } else { read };
        assert_eq!(first_fault([true, true], 1, low), Some((24, 0)));
        let high = |cycle, line, read| if (line == 1) & (cycle > 20) { 0xFFFF } else { read };
        assert_eq!(first_fault([true, false], 1, high), Some((24, 1)));
        assert_eq!(first_fault([true, false], 10, high), Some((51, 1)));
    }

    #[test]
    fn a_gap_that_is_not_seen_is_a_short_circuit() {
        let shorted = |_, line, read| if line == 0 { 0xFFFF } else { read };
        assert_eq!(first_fault([true, true], 1, shorted), Some((53, 0)));
    }

    #[test]
    fn a_readback_that_returns_nothing_is_not_judged() {
        assert_eq!(first_fault([true, true], 1, |_, _, _| 0), None);
    }
}
