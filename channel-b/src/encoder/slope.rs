//! The slope of a least-squares line through the last few samples.

/// Samples the line goes through. Fewer would let the resolver's resolution show, more
/// would delay the speed.
const SAMPLES: usize = 4;

/// The last samples, newest first.
#[derive(Debug, Clone, Copy)]
pub struct Slope {
    positions: [f64; SAMPLES],
    times: [u64; SAMPLES],
    count: usize,
}

impl Slope {
    /// No sample.
    pub const fn new() -> Self {
        Self { positions: [0.0; SAMPLES], times: [0; SAMPLES], count: 0 }
    }

    /// As many samples as the line needs, `spacing_ns` apart on a line through `position` at
    /// `time_ns` with `rate` for each ns.
    pub fn settled(position: f64, rate: f64, time_ns: u64, spacing_ns: u64) -> Self {
        let mut line = Self::new();
        let places = line.positions.iter_mut().zip(&mut line.times);
        for (back, (place, time)) in (0_u64..).zip(places) {
            let before = spacing_ns.saturating_mul(back);
            *place = position - rate * before as f64;
            *time = time_ns.wrapping_sub(before);
        }
        line.count = SAMPLES;
        line
    }

    /// The line goes through as many samples as it shall.
    pub const fn is_full(&self) -> bool {
        self.count >= SAMPLES
    }

    /// Adds a sample; slope of the line, position for each ns. 0 with a single sample.
    pub fn add(&mut self, position: f64, time_ns: u64) -> f64 {
        let ([p0, p1, p2, _], [t0, t1, t2, _]) = (self.positions, self.times);
        self.positions = [position, p0, p1, p2];
        self.times = [time_ns, t0, t1, t2];
        self.count = self.count.saturating_add(1).min(SAMPLES);
        let spacing = time_ns.wrapping_sub(t0);
        let is_even = (t0.wrapping_sub(t1) == spacing) & (t1.wrapping_sub(t2) == spacing);
        if is_even & self.is_full() & (spacing > 0) {
            // The usual case in closed form: the least squares of four samples at even distances.
            return (3.0 * (position - p2) + (p0 - p1)) / (10.0 * spacing as f64);
        }
        self.fit(position, time_ns)
    }

    /// Least squares about the newest sample, which keeps the numbers small. Times wrap: a
    /// settled line begins before the clock does.
    fn fit(&self, position: f64, time_ns: u64) -> f64 {
        let samples = || self.positions.iter().zip(&self.times).take(self.count);
        let ahead = |time: u64| time.wrapping_sub(time_ns) as i64 as f64;
        let share = 1.0 / self.count as f64;
        let (mut mean_time, mut mean_place) = (0.0, 0.0);
        for (place, time) in samples() {
            mean_time += ahead(*time) * share;
            mean_place += (place - position) * share;
        }
        let (mut product, mut square) = (0.0, 0.0);
        for (place, time) in samples() {
            let distance = ahead(*time) - mean_time;
            product += distance * (place - position - mean_place);
            square += distance * distance;
        }
        if square > 0.0 { product / square } else { 0.0 }
    }
}
