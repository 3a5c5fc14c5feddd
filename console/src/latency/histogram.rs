//! What is shown of a measured distribution.

use hdrhistogram::Histogram;
use serde::Serialize;

/// Percentiles of the report.
pub const PERCENTILES: [(&str, f64); 5] =
    [("p50", 50.0), ("p99", 99.0), ("p99.9", 99.9), ("p99.99", 99.99), ("p99.999", 99.999)];
/// Longest time that is told apart from longer ones, ns: a minute.
const HIGHEST_NS: u64 = 60_000_000_000;

/// A distribution of times, ns, three digits.
#[derive(Debug, Clone)]
pub struct Times(Histogram<u64>);

impl Default for Times {
    fn default() -> Self {
        let fixed = Histogram::new_with_bounds(1, HIGHEST_NS, 3);
        Self(fixed.expect("1 to a minute in three digits is within the library's bounds"))
    }
}

impl Times {
    /// Adds a time; longer than a minute counts as a minute.
    pub fn add(&mut self, time_ns: u64) {
        self.0.saturating_record(time_ns.max(1));
    }

    /// Number of times.
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// The time that so many percent do not exceed, µs.
    pub fn percentile_us(&self, percent: f64) -> f64 {
        self.0.value_at_percentile(percent) as f64 / 1e3
    }

    /// The longest time, µs.
    pub fn max_us(&self) -> f64 {
        self.0.max() as f64 / 1e3
    }

    /// Share of the times that are longer, for the picture: (µs, share), 120 points.
    pub fn tail(&self) -> Vec<(f64, f64)> {
        let share = |step: u32| 10_f64.powf(-f64::from(step) / 20.0);
        let smallest = 1.0 / self.count().max(1) as f64;
        let shares = (0..120).map(share).take_while(|share| *share >= smallest);
        shares.map(|share| (self.percentile_us(100.0 * (1.0 - share)), share)).collect()
    }
}

/// One line of the table.
#[derive(Debug, Clone, Serialize)]
pub struct Line {
    /// What was measured.
    pub what: String,
    /// The line it is compared with, if any.
    pub floor: Option<&'static str>,
    /// Number of times.
    pub count: u64,
    /// Percentiles as in [`PERCENTILES`], µs.
    pub percentiles_us: [f64; 5],
    /// The longest, µs.
    pub max_us: f64,
    /// Against the floor: at the median and at p99.99.
    pub ratio: Option<[f64; 2]>,
    /// For the picture.
    #[serde(skip)]
    pub tail: Vec<(f64, f64)>,
}

impl Line {
    /// `what`, compared with a floor where there is one.
    pub fn new(what: impl Into<String>, times: &Times, floor: Option<(&'static str, &Times)>) -> Self {
        let ratio = |percent: f64, floor: &Times| {
            times.percentile_us(percent) / floor.percentile_us(percent).max(0.001)
        };
        Self {
            what: what.into(),
            floor: floor.map(|(name, _)| name),
            count: times.count(),
            percentiles_us: PERCENTILES.map(|(_, percent)| times.percentile_us(percent)),
            max_us: times.max_us(),
            ratio: floor.map(|(_, floor)| [ratio(50.0, floor), ratio(99.99, floor)]),
            tail: times.tail(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_its_percentiles_and_its_ratio_to_the_floor() {
        let (mut slow, mut fast) = (Times::default(), Times::default());
        for microsecond in 1..=1_000_u64 {
            slow.add(microsecond * 2_000);
            fast.add(microsecond * 1_000);
        }
        let line = Line::new("slow", &slow, Some(("fast", &fast)));
        assert!((line.percentiles_us[0] - 1_000.0).abs() < 2.0, "{line:?}");
        assert!((line.ratio.expect("has a floor")[0] - 2.0).abs() < 0.01);
        assert_eq!((line.count, slow.tail().is_empty()), (1_000, false));
    }
}
