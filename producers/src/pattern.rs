//! Edges with time stamps become samples of 62.5 µs, and output patterns become changes.
//!
//! Sample `k` is the level at `k * 62.5 µs` of CLOCK_MONOTONIC. An edge reaches user space after
//! its time stamp, so a sample is given out only [`SETTLE_NS`] later. What comes even later
//! counts from the first sample that is not given out yet; but a low level, however short, then
//! takes one sample at least: a request must not get lost (AMK-IN-02).

use shm_schema::io::SAMPLE_NS;

/// Delay of the samples behind the clock, ns: the longest way of an edge from its interrupt to
/// the reader that costs nothing.
pub const SETTLE_NS: u64 = 4 * SAMPLE_NS;
/// Changes of one line that can wait. A line that bounces faster is not believed.
const WAITING: usize = 64;

/// One line.
#[derive(Debug, Clone)]
pub struct Line {
    /// Level of the newest sample.
    level: bool,
    /// Changes not yet sampled: time and level, in order.
    waiting: [(u64, bool); WAITING],
    count: usize,
    /// Newest sample given out in bit 0.
    pattern: u64,
    /// Samples still to be given out low, whatever the line says.
    distrust: u32,
}

impl Line {
    /// A line that has been low for ever: nothing is known yet.
    pub const fn new() -> Self {
        Self { level: false, waiting: [(0, false); WAITING], count: 0, pattern: 0, distrust: 0 }
    }

    /// The line changed to `level` at `at_ns`.
    pub fn change(&mut self, at_ns: u64, level: bool) {
        let Some(place) = self.waiting.get_mut(self.count) else {
            self.doubt(level);
            return;
        };
        *place = (at_ns, level);
        self.count += 1;
    }

    /// An edge was lost, or the line is not what its edges say: what waits is void, the line is
    /// at `level` now, and reads low for a whole pattern.
    pub const fn doubt(&mut self, level: bool) {
        self.count = 0;
        self.level = level;
        self.distrust = u64::BITS;
    }

    /// The level after everything that waits.
    pub fn newest(&self) -> bool {
        let last = self.count.checked_sub(1).and_then(|last| self.waiting.get(last));
        last.map_or(self.level, |(_, level)| *level)
    }

    /// The pattern so far.
    pub const fn pattern(&self) -> u64 {
        self.pattern
    }

    /// Gives out the sample of `instant_ns`.
    fn sample(&mut self, instant_ns: u64, first_late_ns: u64) {
        let due = self.waiting.iter().take(self.count).take_while(|(at, _)| *at <= instant_ns);
        let due = due.count();
        // Low for a moment only, but too late for the sample it belongs to: this one is low.
        let late = |(at, level): &(u64, bool)| (*at < first_late_ns) & !*level;
        let dip = self.waiting.iter().take(due).any(late);
        if let Some((_, level)) = due.checked_sub(1).and_then(|last| self.waiting.get(last)) {
            self.level = *level;
        }
        self.waiting.copy_within(due.., 0);
        self.count -= due;
        let trusted = self.distrust == 0;
        self.distrust = self.distrust.saturating_sub(1);
        let level = self.level & trusted & !dip;
        self.pattern = self.pattern << 1 | u64::from(level);
    }
}

impl Default for Line {
    fn default() -> Self {
        Self::new()
    }
}

/// Lines that are sampled together.
#[derive(Debug, Clone)]
pub struct Sampler<const N: usize> {
    /// The lines.
    pub lines: [Line; N],
    samples: u64,
}

impl<const N: usize> Sampler<N> {
    /// Starts at `now_ns`, every line low until it is said to be high.
    pub fn new(now_ns: u64) -> Self {
        Self { lines: [const { Line::new() }; N], samples: now_ns.saturating_sub(SETTLE_NS) / SAMPLE_NS }
    }

    /// Number of the newest sample: grows by one every 62.5 µs.
    pub const fn samples(&self) -> u64 {
        self.samples
    }

    /// Gives out every sample that is due at `now_ns`; all edges known by then have been told
    /// with [`Line::change`].
    pub fn advance(&mut self, now_ns: u64) {
        let newest = now_ns.saturating_sub(SETTLE_NS) / SAMPLE_NS;
        // What lies behind the length of a pattern is forgotten before anybody can see it.
        let first = self.samples.max(newest.saturating_sub(u64::from(u64::BITS)));
        // Edges before the newest sample given out come too late for their own.
        let given_out_ns = self.samples * SAMPLE_NS;
        for sample in first..newest {
            for line in &mut self.lines {
                line.sample((sample + 1) * SAMPLE_NS, given_out_ns);
            }
        }
        self.samples = self.samples.max(newest);
    }
}

/// Samples of the outputs of one cycle at which a level changes: sample and levels, line `n` in
/// bit `n`. Sample 0 always comes first.
pub fn changes<const N: usize>(outputs: [u64; N], samples: u32) -> impl Iterator<Item = (u32, u32)> {
    let levels = move |sample: u32| {
        let bits = outputs.iter().enumerate();
        bits.fold(0, |all, (line, pattern)| all | ((pattern >> sample & 1) as u32) << line)
    };
    let samples = samples.clamp(1, u64::BITS);
    (0..samples)
        .filter(move |sample| sample.checked_sub(1).is_none_or(|before| levels(before) != levels(*sample)))
        .map(move |sample| (sample, levels(sample)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = SAMPLE_NS;
    /// A round start: sample 1,000 is the newest given out.
    const START: u64 = 1_000 * S + SETTLE_NS;

    /// One line, high for long enough to be believed.
    fn settled() -> Sampler<1> {
        let mut sampler = Sampler::new(START - 80 * S);
        sampler.lines[0].change(0, true);
        sampler.advance(START);
        assert_eq!(sampler.lines[0].pattern(), u64::MAX);
        sampler
    }

    #[test]
    fn a_line_nobody_has_spoken_of_is_low() {
        let mut sampler = Sampler::<1>::new(START);
        sampler.advance(START + 16 * S);
        assert_eq!((sampler.samples(), sampler.lines[0].pattern()), (1_016, 0));
    }

    /// AMK-FILT-03: the length of a pulse in samples is its length in time.
    #[test]
    fn a_pulse_of_four_samples_shows_as_four_low_samples_at_its_place() {
        let mut sampler = settled();
        sampler.lines[0].change(1_005 * S - 1, false);
        sampler.lines[0].change(1_009 * S - 1, true);
        sampler.advance(START + 16 * S);
        // Samples 1,005 to 1,008 of 1,001 to 1,016: bits 11 to 8.
        assert_eq!(sampler.lines[0].pattern(), !(0b1111 << 8));
    }

    #[test]
    fn a_pulse_between_two_samples_is_not_seen_as_in_hardware_that_samples() {
        let mut sampler = settled();
        sampler.lines[0].change(1_005 * S + 1, false);
        sampler.lines[0].change(1_006 * S - 1, true);
        sampler.advance(START + 16 * S);
        assert_eq!(sampler.lines[0].pattern(), u64::MAX);
    }

    #[test]
    fn an_edge_on_the_instant_of_a_sample_belongs_to_it() {
        let mut sampler = settled();
        sampler.lines[0].change(1_016 * S, false);
        sampler.advance(START + 16 * S);
        assert_eq!(sampler.lines[0].pattern(), !1);
    }

    #[test]
    fn samples_wait_until_edges_of_their_time_can_have_come() {
        let mut sampler = settled();
        sampler.advance(START + S - 1);
        assert_eq!(sampler.samples(), 1_000);
        sampler.advance(START + S);
        assert_eq!(sampler.samples(), 1_001);
    }

    #[test]
    fn a_late_pulse_still_takes_one_low_sample() {
        let mut sampler = settled();
        sampler.lines[0].change(990 * S, false);
        sampler.lines[0].change(995 * S, true);
        sampler.advance(START + 2 * S);
        assert_eq!(sampler.lines[0].pattern(), !0b10);
    }

    /// DEC-18: what cannot be believed reads low.
    #[test]
    fn a_doubted_line_reads_low_for_a_whole_pattern() {
        let mut sampler = settled();
        sampler.lines[0].doubt(true);
        sampler.advance(START + 64 * S);
        assert_eq!(sampler.lines[0].pattern(), 0);
        sampler.advance(START + 66 * S);
        assert_eq!(sampler.lines[0].pattern(), 0b11);
    }

    #[test]
    fn a_line_that_bounces_faster_than_can_be_kept_is_doubted() {
        let mut sampler = settled();
        for edge in 0..=WAITING as u64 {
            sampler.lines[0].change(1_002 * S + edge, edge % 2 == 0);
        }
        assert!(sampler.lines[0].newest());
        sampler.advance(START + 16 * S);
        assert_eq!(sampler.lines[0].pattern() & 0xFFFF, 0);
    }

    #[test]
    fn a_long_stall_costs_one_pattern_and_no_more() {
        let mut sampler = settled();
        sampler.lines[0].change(2_000 * S, false);
        sampler.advance(START + 10_000_000 * S);
        assert_eq!((sampler.samples(), sampler.lines[0].pattern()), (10_001_000, 0));
    }

    /// AMK-DYN-09: the owner's test pulses come at the samples it names.
    #[test]
    fn an_output_pattern_is_the_list_of_its_changes() {
        let steady: Vec<_> = changes([u64::MAX, 0, u64::MAX], 16).collect();
        assert_eq!(steady, [(0, 0b101)]);
        let pulsed: Vec<_> = changes([!0b1100, 0, 1 << 15], 16).collect();
        assert_eq!(pulsed, [(0, 0b001), (2, 0b000), (4, 0b001), (15, 0b101)]);
    }
}
