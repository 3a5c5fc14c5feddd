//! Input filters, sample by sample (AMK-FILT-01 to 04).

/// Samples of one cycle of 1 ms at a distance of 62.5 µs (AMK-FILT-03).
pub const SAMPLES_PER_CYCLE: usize = 16;

/// Glitch filter and time filter of one input line.
#[derive(Debug, Clone)]
pub struct LineFilter {
    /// Samples the glitch filter's output must stay constant.
    constant_for: u32,
    newest_four: [bool; 4],
    glitch_free: bool,
    constant_since: u32,
    output: bool,
    last_level: bool,
}

impl LineFilter {
    /// A filter that has seen `level` for ever; `filter_us` is the line's pulse duration.
    pub fn settled(level: bool, filter_us: i32) -> Self {
        // AMKP-SE-09: an entry is the multiple of 62.5 µs rounded up to whole microseconds.
        let constant_for = (filter_us.max(0) as u32) * 2 / 125;
        Self {
            constant_for,
            newest_four: [level; 4],
            glitch_free: level,
            constant_since: constant_for,
            output: level,
            last_level: level,
        }
    }

    /// One cycle: a step column holds from its row on, so only the newest of the 16
    /// samples that arrive with cycle k carries the level of cycle k.
    pub fn cycle(&mut self, level: bool) -> bool {
        for _ in 1..SAMPLES_PER_CYCLE {
            self.sample(self.last_level);
        }
        self.sample(level);
        self.last_level = level;
        self.output
    }

    /// One sample of 62.5 µs.
    pub fn sample(&mut self, level: bool) {
        self.newest_four.rotate_left(1);
        self.newest_four[3] = level;
        self.constant_since += 1;
        let four_equal = self.newest_four.iter().all(|sample| *sample == level);
        if four_equal && level != self.glitch_free {
            self.glitch_free = level;
            self.constant_since = 0;
        }
        // AMK-FILT-04: constant for at least the time set; the same for both edges.
        if self.constant_since >= self.constant_for {
            self.output = self.glitch_free;
        }
    }

    /// The level behind both filters.
    pub fn output(&self) -> bool {
        self.output
    }

    /// The level behind the glitch filter alone.
    pub fn glitch_free(&self) -> bool {
        self.glitch_free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// AMK-EX-GLITCH
    #[test]
    fn a_single_sample_is_ignored_and_the_fourth_equal_one_counts() {
        let mut line = LineFilter::settled(false, 250);
        let mut seen = Vec::new();
        for bit in [0, 0, 0, 0, 1, 0, 1, 1, 1, 1] {
            line.sample(bit == 1);
            seen.push(line.glitch_free());
        }
        assert_eq!(seen.iter().position(|level| *level), Some(9));
    }

    /// AMK-EX-BOUNCE-1, AMK-EX-BOUNCE-2: after t1 only a 0 that lasts for the filter time
    /// makes the output fall back.
    #[test]
    fn bounce_shorter_than_the_filter_time_leaves_the_output_standing() {
        let mut line = LineFilter::settled(false, 1000);
        for _ in 0..20 {
            line.sample(true);
        }
        assert!(line.output());
        for _ in 0..18 {
            line.sample(false);
        }
        line.sample(true);
        assert!(line.output());
        for _ in 0..20 {
            line.sample(false);
        }
        assert!(!line.output());
    }

    /// AMK-EX-T-IN-MIN, AMK-TIME-02: 0.25 ms and the filter time.
    #[test]
    fn the_response_is_a_quarter_millisecond_and_the_filter_time() {
        let cycles_until_seen = |filter_us| {
            let mut line = LineFilter::settled(true, filter_us);
            (0..1_000).find(|_| !line.cycle(false)).unwrap_or_default()
        };
        assert_eq!(cycles_until_seen(250), 1);
        assert_eq!(cycles_until_seen(1000), 2);
        assert_eq!(cycles_until_seen(65_500), 66);
    }
}
