//! Safe input lines as the acquisition samples them: 62.5 µs apart, newest in bit 0.

use shm_schema::io::{Io, SAMPLE_NS};

/// Levels of all lines during one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lines {
    /// Levels of line .1 and line .2 of each pair.
    pub pairs: [(bool, bool); 4],
    /// Acknowledge in, restart.
    pub ais: bool,
    /// Acknowledge in, error.
    pub aie: bool,
    /// Safe outputs SA1.1, SA1.2, SA2.1, SA2.2 in bits 0 to 3; SDYN1, SDYN2 in 4 and 5.
    pub outputs: u8,
}

impl Default for Lines {
    fn default() -> Self {
        Self { pairs: [(true, true); 4], ais: false, aie: false, outputs: 0 }
    }
}

impl Lines {
    /// The patterns after these levels have stood for ever.
    pub fn settled(&self) -> Io {
        let mut io = Io { samples: 64, ..Io::default() };
        self.each(&mut io, |pattern, level| *pattern = pattern_of(level));
        io
    }

    /// Adds the samples of one cycle to the patterns: only the newest one is taken at the time
    /// of the cycle, those before it lie between the cycles and have the level that held then.
    pub fn sample(&self, io: &mut Io, cycle_ns: u64) {
        let samples = cycle_ns / SAMPLE_NS;
        let shift = samples.min(63) as u32;
        io.samples = io.samples.wrapping_add(samples);
        self.each(io, |pattern, level| {
            let held = pattern_of(*pattern & 1 == 1) & !(u64::MAX << shift) & !1;
            *pattern = *pattern << shift | held | u64::from(level);
        });
    }

    /// Sets the samples since `since_ns` before the newest one to these levels.
    pub fn amend(&self, io: &mut Io, since_ns: u64) {
        let count = (since_ns / SAMPLE_NS + 1).min(63);
        let recent = !(u64::MAX << count);
        self.each(io, |pattern, level| {
            *pattern = *pattern & !recent | pattern_of(level) & recent;
        });
    }

    fn each(&self, io: &mut Io, set: impl Fn(&mut u64, bool)) {
        for ((first, second), levels) in io.line_1.iter_mut().zip(&mut io.line_2).zip(self.pairs) {
            set(first, levels.0);
            set(second, levels.1);
        }
        set(&mut io.ais, self.ais);
        set(&mut io.aie, self.aie);
        let readback = io.output_readback.iter_mut().chain(&mut io.dynamic_readback);
        for (bit, pattern) in readback.enumerate() {
            set(pattern, self.outputs >> bit & 1 == 1);
        }
    }
}

const fn pattern_of(level: bool) -> u64 {
    if level { u64::MAX } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_millisecond_brings_sixteen_samples_newest_in_bit_0() {
        let mut lines = Lines::default();
        let mut io = lines.settled();
        lines.pairs[1] = (false, true);
        lines.sample(&mut io, 1_000_000);
        assert_eq!(io.samples, 80);
        assert_eq!((io.line_1[1], io.line_2[1]), (u64::MAX << 1, u64::MAX));
        lines.sample(&mut io, 250_000);
        assert_eq!(io.line_1[1], u64::MAX << 5);
    }

    #[test]
    fn a_level_holds_from_its_own_time_on() {
        let mut lines = Lines::default();
        let mut io = lines.settled();
        lines.sample(&mut io, 1_000_000);
        lines.pairs[0].0 = false;
        // 0.25 ms before the newest sample: that one, and the four before it.
        lines.amend(&mut io, 250_000);
        assert_eq!(io.line_1[0], u64::MAX << 5);
        lines.pairs[0].0 = true;
        lines.amend(&mut io, 62_499);
        assert_eq!(io.line_1[0], u64::MAX << 5 | 1);
    }
}
