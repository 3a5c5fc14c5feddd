//! C15350: how long the speed may stay too high once a limit was violated. The time belongs to
//! the error stop, which runs to its end whatever is requested meanwhile (DEC-11, LNZ-SMS-06).

use super::{OVERSPEEDS, SLS_CODE};
use crate::engine::places::Places;
use crate::engine::stop::Reaction;
use crate::engine::watch::{Quantity, Watch};
use crate::engine::{Range, Sample};

/// A limit that was violated, and when.
#[derive(Debug, Clone, Copy, Default)]
struct Violated {
    window: Range,
    since_ns: u64,
}

/// The limits whose violation started a stop and is not acknowledged yet.
#[derive(Debug, Clone, Copy, Default)]
pub struct Overspeed {
    limit_ns: u64,
    violated: [Violated; OVERSPEEDS],
    open: Places,
}

impl Overspeed {
    /// So much time for each of them.
    pub fn new(limit_ns: u64) -> Self {
        Self { limit_ns, ..Self::default() }
    }

    /// Takes what was violated since the instant before.
    pub fn begin<'a>(&mut self, watches: impl Iterator<Item = &'a Watch>) {
        for watch in watches.filter(|watch| stops_by_itself(watch)) {
            let place = watch.plan.function.wrapping_sub(SLS_CODE) as u8;
            let Some(slot) = self.violated.get_mut(usize::from(place)) else { continue };
            if let Some(since_ns) = watch.violated_since_ns().filter(|_| !self.open.has(place)) {
                *slot = Violated { window: watch.plan.window, since_ns };
                self.open = self.open.with(Places::of(place));
            }
        }
    }

    /// Acknowledged, or in STO.
    pub const fn end(&mut self) {
        self.open = Places::NONE;
    }

    /// Outside a limit when its time has elapsed. Being inside in between does not end the time
    /// (LNZ-EX-27).
    pub fn is_late(&self, sample: &Sample) -> bool {
        let late = |violated: &Violated| {
            let elapsed = sample.now_ns.saturating_sub(violated.since_ns) >= self.limit_ns;
            elapsed & !violated.window.has(sample.speed)
        };
        self.open.into_iter().filter_map(|place| self.violated.get(usize::from(place))).any(late)
    }
}

/// SLS or SMS with SS1 or SS2; with STO the motor is coasting already (LNZ-SMS-07).
fn stops_by_itself(watch: &Watch) -> bool {
    let speed = watch.plan.quantity == Quantity::Speed;
    speed & matches!(watch.plan.reaction, Reaction::Stop(_))
}
