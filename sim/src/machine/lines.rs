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
}

impl Default for Lines {
    fn default() -> Self {
        Self { pairs: [(true, true); 4], ais: false, aie: false }
    }
}

impl Lines {
    /// The same levels where something is connected, low elsewhere.
    #[must_use]
    pub fn where_connected(mut self, inputs: [bool; 4]) -> Self {
        for (levels, connected) in self.pairs.iter_mut().zip(inputs) {
            *levels = (levels.0 & connected, levels.1 & connected);
        }
        self
    }

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
    }
}

/// Adds what channel A and channel B drove on their lines of the safe outputs during one cycle,
/// as the acquisition read it back: SA1.n, SA2.n, SDYNn each.
pub fn read_back(io: &mut Io, driven: &[[u64; 3]; 2], cycle_ns: u64) {
    let samples = (cycle_ns / SAMPLE_NS).clamp(1, 64) as u32;
    let [[sa1_1, sa2_1, sdyn1], [sa1_2, sa2_2, sdyn2]] = *driven;
    let lines = [sa1_1, sa1_2, sa2_1, sa2_2, sdyn1, sdyn2];
    let patterns = io.output_readback.iter_mut().chain(&mut io.dynamic_readback);
    for (pattern, line) in patterns.zip(lines) {
        // Driven counts from the first sample, read back from the last one.
        let newest_first = line.reverse_bits() >> (64 - samples);
        *pattern = pattern.checked_shl(samples).unwrap_or(0) | newest_first;
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
    fn what_was_driven_first_is_read_back_as_the_oldest_sample() {
        let mut io = Io::default();
        // SA1.1 on but for its second sample; SDYN2 on.
        read_back(&mut io, &[[!0b10, 0, 0], [0, 0, u64::MAX]], 250_000);
        assert_eq!(io.output_readback, [0b1011, 0, 0, 0]);
        assert_eq!(io.dynamic_readback, [0, 0b1111]);
        read_back(&mut io, &[[0; 3]; 2], 250_000);
        assert_eq!(io.output_readback[0], 0b1011_0000);
        read_back(&mut io, &[[1 << 63, 0, 0], [0; 3]], 4_000_000);
        assert_eq!(io.output_readback[0], 1);
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
