//! SEM: the standstill of a sine encoder hides its faults, so it must move now and then
//! (AMK-SEM-01 to 12).

use crate::model::Which;

use super::parameters::Parameters;

const MINUTE: i64 = 60_000;
/// AMK-SEM-08: the error is sent again each 30 minutes.
const REPETITION: i64 = 30 * MINUTE;

/// What SEM says in one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Said {
    /// Prm9 has run out.
    Warning([u32; 4]),
    /// Prm10 has run out too, or 30 minutes more.
    Error([u32; 4]),
}

/// Standstill supervision of one channel.
#[derive(Debug, Clone)]
pub struct Sem {
    /// AMK-SEM-10: a resolver is exempt.
    watches: bool,
    info1: u32,
    periods: i64,
    warn_after: i64,
    error_after: i64,
    still: Option<(i64, i64)>,
}

impl Sem {
    /// Timers at zero.
    pub fn new(parameters: &Parameters, which: Which) -> Self {
        let (slot, info1) = match which {
            Which::A => (4, 38),
            Which::B => (5, 39),
        };
        let warn_after = parameters.value(9) * MINUTE;
        Self {
            watches: parameters.raw(slot) == 1,
            info1,
            periods: parameters.value(6),
            warn_after,
            // AMK-SEM-06: in sequence, not in parallel.
            error_after: warn_after + parameters.value(10) * MINUTE,
            still: None,
        }
    }

    /// AMK-SEM-02: movement is the angle of one full sine period or more.
    fn has_moved(&self, from: i64, to: i64) -> bool {
        i128::from((to - from).abs()) * i128::from(self.periods) >= 65_536
    }

    /// AMK-SEM-09: only movement resets, never an acknowledgement, a mode or a stop.
    pub fn step(&mut self, now: i64, position: i64) -> Option<Said> {
        if !self.watches {
            return None;
        }
        let (since, from) = *self.still.get_or_insert((now, position));
        if self.has_moved(from, position) {
            self.still = Some((now, position));
            return None;
        }
        let still_for = now - since;
        let over = still_for - self.error_after;
        if still_for == self.warn_after {
            Some(Said::Warning([3610, self.info1, 3, 0]))
        } else if over >= 0 && over % REPETITION == 0 {
            Some(Said::Error([3606, self.info1, 4, 0]))
        } else {
            None
        }
    }
}
