//! Clock supervision (DEC-26): the partner's clock and the producer's stamps and sample
//! count, measured against the own clock over one second.

use crate::fresh::Patience;

/// Length of one measurement, ns.
const WINDOW_NS: u64 = 1_000_000_000;
/// Permitted deviation: one part in fifty, 2 %.
const TOLERANCE_DIVISOR: u64 = 50;

/// One clock under measurement.
#[derive(Debug, Clone, Copy)]
pub struct Measured {
    start: Option<(u64, u64)>,
    tolerance_ns: u64,
}

impl Measured {
    /// Nothing measured yet.
    pub fn new(patience: Patience) -> Self {
        Self { start: None, tolerance_ns: patience.time_ns(WINDOW_NS / TOLERANCE_DIVISOR) }
    }

    /// Nothing measured; also after any gap.
    pub fn restart(&mut self) {
        self.start = None;
    }

    /// Takes a simultaneous reading of both clocks; `false` when the other runs wrong.
    pub fn step(&mut self, own_ns: u64, other_ns: u64) -> bool {
        let Some((own_start, other_start)) = self.start else {
            self.start = Some((own_ns, other_ns));
            return true;
        };
        let own = own_ns.saturating_sub(own_start);
        let other = other_ns.saturating_sub(other_start);
        let deviates = own.abs_diff(other) > self.tolerance_ns;
        if (own >= WINDOW_NS) | deviates {
            self.start = Some((own_ns, other_ns));
        }
        !deviates
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs(per_mille: u64) -> bool {
        runs_relaxed(per_mille, 1)
    }

    fn runs_relaxed(per_mille: u64, age_factor: u8) -> bool {
        let mut clock = Measured::new(Patience::new(age_factor));
        (0..3_000_u64).all(|k| clock.step(k * 1_000_000, k * per_mille * 1_000))
    }

    #[test]
    fn two_per_cent_are_tolerated_and_no_more() {
        assert!([1_000, 1_019, 981].into_iter().all(runs));
        assert!(![1_022, 978, 2_000, 0].into_iter().any(runs));
        // Timing: the relaxed one tolerates ten times as much.
        assert!(runs_relaxed(1_190, 10));
        assert!(!runs_relaxed(1_210, 10));
    }
}
