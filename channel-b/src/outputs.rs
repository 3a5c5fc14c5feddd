//! The own lines of the safe outputs: levels, test pulses, and what must be read back
//! (AMK-DYN-09, LNZ-OUT-02). Channel B drives SA1.2, SA2.2 and SDYN2.
//!
//! A pulse is a short interruption of the energised line, in closed form: its samples follow
//! from the place in the period.

use crate::twin::Twin;

/// Lines of one channel: SA1.n, SA2.n, SDYNn.
pub const LINES: usize = 3;
/// Cycles within which a level or a pulse must be read back (architecture, "Safe outputs").
const FOLLOW_CYCLES: u32 = 3;
/// Distance of two samples, ns.
const SAMPLE_NS: u64 = shm_schema::io::SAMPLE_NS;

/// How one line is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LineSetup {
    /// Length of a test pulse, samples; 0: none.
    pub pulse: u32,
    /// Distance of two pulses, samples; more than 64, and at least ten pulses (AMKP-SA-06).
    pub period: u32,
    /// Place in the period at which the line begins.
    pub phase: u32,
    /// The load sits between this line and the other of the pair: this one is its low side, low
    /// while on (Prm104).
    pub is_low_side: bool,
    /// The line is read back and must follow. SDYN is not safe by itself (AMK-DYN-03): its
    /// supervision is at the inputs.
    pub is_watched: bool,
}

impl LineSetup {
    /// Without pulses, and nothing has to follow.
    pub const UNUSED: Self = Self { pulse: 0, period: 0, phase: 0, is_low_side: false, is_watched: false };

    /// A line with pulses of `pulse_us` every `period_ms`.
    pub const fn pulsed(pulse_us: u32, period_ms: u32) -> Self {
        Self {
            // AMKP-SA-01: multiples of 125 µs, two samples.
            pulse: pulse_us.saturating_mul(2) / 125,
            period: period_ms.saturating_mul(16),
            phase: 0,
            is_low_side: false,
            is_watched: true,
        }
    }
}

/// One line.
#[derive(Debug, Clone, Copy)]
struct Line {
    setup: LineSetup,
    is_unused: bool,
    /// Cycles within which a level, and a pulse from its beginning on, must be read back.
    patience: u32,
    latest: u32,
    phase: Twin,
    /// Cycles since the line was last driven high, and low.
    since_high: u32,
    since_low: u32,
    /// Cycles since a pulse began that has not been read back.
    pulse_age: Option<u32>,
}

impl Line {
    fn new(setup: LineSetup, samples: u32, factor: u8) -> Self {
        let patience = FOLLOW_CYCLES.saturating_mul(u32::from(factor));
        let length = setup.pulse.checked_div(samples).unwrap_or(0);
        Self {
            setup,
            is_unused: setup == LineSetup::UNUSED,
            patience,
            latest: length.saturating_add(patience),
            phase: Twin::new(i64::from(setup.phase)),
            since_high: 0,
            since_low: 0,
            pulse_age: None,
        }
    }

    /// The samples of the next cycle.
    #[inline]
    fn drive(&mut self, level: bool, samples: u32, whole: u64) -> u64 {
        if self.is_unused {
            return if level { whole } else { 0 };
        }
        let is_plain = (self.setup.pulse == 0) & self.pulse_age.is_none();
        if is_plain {
            let driven = if level == self.setup.is_low_side { 0 } else { whole };
            let (on, off) = if driven == 0 {
                (&mut self.since_high, &mut self.since_low)
            } else {
                (&mut self.since_low, &mut self.since_high)
            };
            (*on, *off) = (on.saturating_add(1), 0);
            return driven;
        }
        let is_pulsed = self.setup.pulse > 0;
        let gap = if is_pulsed { self.advance(samples) & whole } else { 0 };
        let energised = if level { whole & !gap } else { 0 };
        let driven = if self.setup.is_low_side { whole & !energised } else { energised };
        if self.setup.is_watched {
            self.note(level, gap, driven, whole);
        }
        driven
    }

    /// Since when which level, and which pulse, must be read back.
    fn note(&mut self, level: bool, gap: u64, driven: u64, whole: u64) {
        self.since_high = if driven == 0 { self.since_high.saturating_add(1) } else { 0 };
        self.since_low = if driven == whole { self.since_low.saturating_add(1) } else { 0 };
        self.pulse_age = match self.pulse_age {
            _ if !level => None,
            None if gap != 0 => Some(0),
            other => other.map(|age| age.saturating_add(1)),
        };
    }

    /// Goes on by `samples`; the samples that belong to a pulse.
    fn advance(&mut self, samples: u32) -> u64 {
        let (pulse, period) = (self.setup.pulse, self.setup.period);
        // A damaged place begins a new period.
        let phase = self.phase.get().map_or(0, |phase| phase.clamp(0, i64::from(u32::MAX)) as u32);
        let is_between = (phase >= pulse) & (phase.saturating_add(samples) < period);
        if is_between {
            self.phase = Twin::new(i64::from(phase.saturating_add(samples)));
            return 0;
        }
        let first = ones(pulse.saturating_sub(phase));
        let ahead = period.saturating_sub(phase);
        let second = ones(pulse).checked_shl(ahead).unwrap_or(0);
        let next = phase.saturating_add(samples);
        let next = if next >= period { next.saturating_sub(period) } else { next };
        self.phase = Twin::new(i64::from(next));
        first | second
    }

    /// Whether the line does not follow. `count` samples are new.
    fn judge(&mut self, pattern: u64, count: u64, whole: u64) -> bool {
        if !self.setup.is_watched {
            return false;
        }
        let seen = pattern & whole;
        let (has_high, has_low) = (seen != 0, seen != whole);
        let is_wrongly_high = has_high & (self.since_high > self.patience);
        let is_wrongly_low = has_low & (self.since_low > self.patience);
        let is_pulse_seen = if self.setup.is_low_side { has_high } else { has_low };
        // More samples than a pattern holds: the pulse may be among those lost.
        if is_pulse_seen | (count > 64) {
            self.pulse_age = None;
        }
        let is_missing = self.pulse_age.is_some_and(|age| age > self.latest);
        if is_missing {
            self.pulse_age = None;
        }
        is_wrongly_high | is_wrongly_low | is_missing
    }
}

/// The lowest `count` samples.
const fn ones(count: u32) -> u64 {
    if count >= 64 { u64::MAX } else { !(u64::MAX << count) }
}

/// The own lines of the safe outputs.
#[derive(Debug, Clone, Copy)]
pub struct Outputs {
    lines: [Line; LINES],
    /// Samples of one cycle.
    samples: u32,
    /// As many ones.
    whole: u64,
    read: Option<u64>,
}

impl Outputs {
    /// Lines with their setups, for a cycle of `cycle_ns` and a timing `factor`.
    pub fn new(setups: [LineSetup; LINES], cycle_ns: u64, factor: u8) -> Self {
        let samples = (cycle_ns / SAMPLE_NS).clamp(1, 64) as u32;
        let lines = setups.map(|setup| Line::new(setup, samples, factor));
        Self { lines, samples, whole: ones(samples), read: None }
    }

    /// What is driven in the cycle that follows.
    pub fn drive(&mut self, levels: [bool; LINES]) -> [u64; LINES] {
        let mut driven = [0; LINES];
        for ((pattern, line), level) in driven.iter_mut().zip(&mut self.lines).zip(levels) {
            *pattern = line.drive(level, self.samples, self.whole);
        }
        driven
    }

    /// Bit n: line n does not follow. `taken`: samples since power-up; `read`: the patterns.
    pub fn judge(&mut self, taken: u64, read: [u64; LINES]) -> u8 {
        let count = self.read.map_or(0, |before| taken.wrapping_sub(before));
        self.read = Some(taken);
        if count == 0 {
            return 0;
        }
        let whole = ones(count.min(64) as u32);
        let mut wrong = 0;
        for (place, (line, pattern)) in (0..).zip(self.lines.iter_mut().zip(read)) {
            wrong |= u8::from(line.judge(pattern, count, whole)) << (place & 7);
        }
        wrong
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// What a line of `setup` at a constant level drives, sample by sample.
    fn samples(setup: LineSetup, level: bool, cycle_ns: u64, count: usize) -> Vec<bool> {
        let mut outputs = Outputs::new([setup; LINES], cycle_ns, 1);
        let each = (cycle_ns / SAMPLE_NS) as u32;
        let mut all = Vec::new();
        while all.len() < count {
            let [pattern, ..] = outputs.drive([level; LINES]);
            all.extend((0..each).map(|place| pattern >> place & 1 == 1));
        }
        all.truncate(count);
        all
    }

    /// AMK-DYN-01, AMK-DYN-09: one interruption of the pulse's length each period.
    #[test]
    fn an_energised_line_is_interrupted_once_a_period_at_any_cycle() {
        for (pulse_us, period_ms) in [(500, 50), (1_000, 1_000), (5_000, 50)] {
            for cycle_ns in [125_000, 1_000_000, 4_000_000] {
                let setup = LineSetup::pulsed(pulse_us, period_ms);
                let (pulse, period) = (pulse_us as usize * 2 / 125, period_ms as usize * 16);
                let driven = samples(setup, true, cycle_ns, 3 * period);
                let wrong = (0..driven.len()).find(|place| driven[*place] == (place % period < pulse));
                assert_eq!(wrong, None, "{pulse_us} {period_ms} {cycle_ns}");
            }
        }
    }

    #[test]
    fn a_line_that_is_off_has_no_pulses_and_a_low_side_is_high_then() {
        let setup = LineSetup::pulsed(500, 50);
        assert!(samples(setup, false, 1_000_000, 2_000).iter().all(|level| !level));
        let low = LineSetup { is_low_side: true, ..setup };
        assert!(samples(low, false, 1_000_000, 2_000).iter().all(|level| *level));
        let on = samples(low, true, 1_000_000, 800);
        assert_eq!(on.iter().filter(|level| **level).count(), 8);
    }

    /// First cycle in which a line is said not to follow; `read` makes of what was driven what
    /// is read a cycle later.
    fn first_wrong(setup: LineSetup, factor: u8, read: impl Fn(usize, u64) -> u64) -> Option<usize> {
        let mut outputs = Outputs::new([setup; LINES], 1_000_000, factor);
        let mut driven = 0;
        (0..3_000).find(|cycle| {
            let wrong = outputs.judge(*cycle as u64 * 16, [read(*cycle, driven).reverse_bits() >> 48; LINES]);
            [driven, ..] = outputs.drive([*cycle % 400 < 200; LINES]);
            wrong != 0
        })
    }

    #[test]
    fn what_follows_a_cycle_later_is_right_and_what_does_not_is_wrong_after_three() {
        let setup = LineSetup::pulsed(500, 50);
        assert_eq!(first_wrong(setup, 1, |_, driven| driven), None);
        // Driven high from cycle 0 on, read low: wrong in the fourth cycle after the first.
        let still = LineSetup { pulse: 0, ..setup };
        assert_eq!(first_wrong(still, 1, |_, _| 0), Some(4));
        assert_eq!(first_wrong(still, 10, |_, _| 0), Some(31));
        assert_eq!(
            first_wrong(still, 1, |cycle, driven| if cycle > 200 { 0xFFFF } else { driven }),
            Some(204)
        );
    }

    /// A cross-fault to a steady 24 V hides the pulses.
    #[test]
    fn a_pulse_that_is_not_read_back_is_a_fault_of_the_line() {
        let setup = LineSetup::pulsed(500, 50);
        let steady = |_: usize, driven: u64| if driven == 0 { 0 } else { 0xFFFF };
        assert_eq!(first_wrong(setup, 1, steady), Some(5));
        let unwatched = LineSetup { is_watched: false, ..setup };
        assert_eq!(first_wrong(unwatched, 1, steady), None);
    }
}
