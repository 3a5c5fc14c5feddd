//! What the functions of the demonstration axis permit over time, from its parameters:
//! drawn beside what the axis did. For the picture only; nothing is judged with it.

use std::collections::BTreeMap;

/// A function of the demonstration that narrows the permitted speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Restriction {
    /// Request or error that started it, s.
    pub start: f64,
    /// Speed then, rpm, magnitude.
    pub latched: f64,
    /// Delay, s (DEC-02).
    pub delay: f64,
    /// Slope of the line, rpm/s (DEC-04).
    pub slope: f64,
    /// Where the line ends, rpm.
    pub target: f64,
    /// When it no longer holds, s.
    pub end: f64,
}

impl Restriction {
    /// SLS1 of an AMK set, requested at `start` with `speed` (AMK-SLS-03, AMK-SLS-04).
    pub fn sls1(values: &BTreeMap<u32, i32>, start: f64, speed: f64, end: f64) -> Self {
        Self::amk(values, [54, 56, 57], start, speed, end)
    }

    /// SS1 of an AMK set (AMK-SS1, Prm18, Prm20, Prm21).
    pub fn ss1(values: &BTreeMap<u32, i32>, start: f64, speed: f64, end: f64) -> Self {
        Self::amk(values, [18, 20, 21], start, speed, end)
    }

    fn amk(values: &BTreeMap<u32, i32>, keys: [u32; 3], start: f64, speed: f64, end: f64) -> Self {
        let [delay, ramp, target] = keys.map(|key| value(values, key));
        // DEC-04: Prm67 / ramp time.
        let slope = value(values, 67) / (ramp / 1_000.0).max(0.001);
        Self { start, latched: speed.abs(), delay: delay / 1_000.0, slope, target, end }
    }

    /// Permitted magnitude at `time`; `None` while nothing is monitored.
    pub fn limit(&self, time: f64) -> Option<f64> {
        let from = self.start + self.delay;
        let monitored = (from..self.end).contains(&time);
        // DEC-03: from the latched speed; DEC-05: until the line meets the target.
        let line = self.latched - self.slope * (time - from);
        monitored.then(|| line.max(self.target))
    }
}

/// Raw value of an AMK parameter.
pub fn value(values: &BTreeMap<u32, i32>, key: u32) -> f64 {
    values.get(&key).copied().map_or(0.0, f64::from)
}

/// Time, lower and upper limit: the narrowest of `always` and all restrictions.
pub fn envelope(time: (f64, f64), always: f64, restrictions: &[Restriction]) -> Vec<(f64, f64, f64)> {
    const STEPS: u32 = 1_200;
    let step = (time.1 - time.0) / f64::from(STEPS);
    let at = |index: u32| {
        let now = time.0 + step * f64::from(index);
        let limits = restrictions.iter().filter_map(|restriction| restriction.limit(now));
        let narrowest = limits.fold(always, f64::min);
        (now, -narrowest, narrowest)
    };
    (0..=STEPS).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// DEC-02 to DEC-05
    #[test]
    fn the_line_falls_from_the_latched_speed_after_the_delay_and_ends_at_the_limit() {
        let values = BTreeMap::from([(67, 2_000), (54, 100), (56, 1_000), (57, 500)]);
        let sls = Restriction::sls1(&values, 1.0, 1_500.0, 9.0);
        assert_eq!(sls.limit(1.05), None);
        assert_eq!(sls.limit(1.1).map(f64::round), Some(1_500.0));
        assert_eq!(sls.limit(1.35).map(f64::round), Some(1_000.0));
        assert_eq!(sls.limit(2.0), Some(500.0));
        assert_eq!(sls.limit(9.0), None);
    }
}
