//! SEM: how long a sine encoder may stand still before its faults would stay hidden
//! (AMK-SEM-01 to AMK-SEM-12).

/// Distance of the repeated error, ns (AMK-SEM-08).
const REPEAT_NS: u64 = 30 * 60 * 1_000_000_000;

/// What SEM has to say in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notice {
    /// T(warn) has run out.
    Warning,
    /// T(err) has run out, or the repetition is due.
    Error,
}

/// The standstill timers of one axis.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sem {
    warn_ns: u64,
    error_ns: u64,
    period: i64,
    still: Option<(i64, u64)>,
    warned: bool,
    next_error_ns: u64,
}

impl Sem {
    /// Times in minutes, one sine period in increments (AMK-SEM-02).
    pub fn new(warn_min: i64, error_min: i64, period: i64) -> Self {
        let minutes = |value: i64| (value.max(0) as u64).saturating_mul(60_000_000_000);
        Self { warn_ns: minutes(warn_min), error_ns: minutes(error_min), period, ..Self::default() }
    }

    /// One instant.
    pub fn step(&mut self, position: i64, now_ns: u64) -> Option<Notice> {
        let (at, since_ns) = self.still.unwrap_or((position, now_ns));
        let moved = position.saturating_sub(at).saturating_abs() >= self.period;
        if moved | self.still.is_none() {
            self.still = Some((position, now_ns));
            self.warned = false;
            self.next_error_ns = self.warn_ns.saturating_add(self.error_ns);
            return None;
        }
        let elapsed = now_ns.saturating_sub(since_ns);
        if elapsed >= self.next_error_ns {
            self.next_error_ns = self.next_error_ns.saturating_add(REPEAT_NS);
            return Some(Notice::Error);
        }
        let due = (elapsed >= self.warn_ns) & !self.warned;
        self.warned |= due;
        due.then_some(Notice::Warning)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINUTE: u64 = 60_000_000_000;

    #[test]
    fn warning_then_error_then_the_error_again_every_half_hour() {
        // AMK-EX-SEM-TIMELINE
        let mut sem = Sem::new(2, 3, 64);
        let found: [Option<Notice>; 70] = core::array::from_fn(|minute| sem.step(0, minute as u64 * MINUTE));
        let at = |notice| {
            found.iter().enumerate().filter(move |(_, found)| **found == Some(notice)).map(|(at, _)| at)
        };
        assert!(at(Notice::Warning).eq([2]));
        assert!(at(Notice::Error).eq([5, 35, 65]));
    }

    #[test]
    fn only_a_movement_of_one_period_resets_the_timers() {
        // AMK-SEM-02, AMK-SEM-09
        let mut sem = Sem::new(2, 3, 64);
        assert_eq!(sem.step(0, 0), None);
        assert_eq!(sem.step(63, MINUTE), None);
        assert_eq!(sem.step(63, 2 * MINUTE), Some(Notice::Warning));
        assert_eq!(sem.step(64, 3 * MINUTE), None);
        assert_eq!(sem.step(64, 5 * MINUTE - 1), None);
        assert_eq!(sem.step(64, 5 * MINUTE), Some(Notice::Warning));
    }
}
