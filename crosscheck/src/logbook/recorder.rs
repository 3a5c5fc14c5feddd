//! Turns moments into records: keeps the last second, notices changes and trips.

use std::collections::{BTreeMap, VecDeque};
use std::vec::Vec;

use super::moment::Moment;
use super::record::Entry;

/// What belongs to a trip, ns.
const SECOND_NS: u64 = 1_000_000_000;
/// Moments of a second at most: beyond 1 kHz every second, fourth, eighth one is kept.
const KEPT: usize = 1_000;
/// Changes of one axis recorded in one second; a bit that chatters must not fill the book.
const CHANGES_MAX: u32 = 20;

/// One axis.
#[derive(Debug, Default)]
struct Axis {
    second: VecDeque<Moment>,
    last: Option<Moment>,
    window_ns: u64,
    changes: u32,
    traced_ns: Option<u64>,
}

/// All axes.
#[derive(Debug, Default)]
pub struct Recorder {
    axes: BTreeMap<u8, Axis>,
    cycle_ns: u64,
    suppressed: u64,
}

impl Recorder {
    /// For a cycle of `cycle_ns`.
    pub fn new(cycle_ns: u64) -> Self {
        Self { cycle_ns, ..Self::default() }
    }

    /// What a moment adds to the logbook.
    pub fn take(&mut self, moment: Moment) -> Option<Entry> {
        let stride_ns = (SECOND_NS / KEPT as u64).max(self.cycle_ns);
        let axis = self.axes.entry(moment.axis).or_default();
        let before = axis.last.replace(moment);
        let tripped = before.is_some_and(|before| trips(&before, &moment));
        axis.keep(moment, stride_ns, tripped);
        if tripped && axis.may_trace(moment.now_ns) {
            let second: Vec<Moment> = axis.second.iter().copied().collect();
            return Some(Entry::Trip { moment, second });
        }
        let changed = before.is_none_or(|before| before.state() != moment.state());
        if !changed {
            return None;
        }
        if axis.may_record(moment.now_ns) {
            return Some(Entry::Change(moment));
        }
        self.suppressed += 1;
        None
    }

    /// Changes left out since the last call.
    pub fn suppressed(&mut self) -> u64 {
        std::mem::take(&mut self.suppressed)
    }
}

impl Axis {
    /// The moments of the last second, at most one for each stride; the trip's own always.
    fn keep(&mut self, moment: Moment, stride_ns: u64, always: bool) {
        let distance = self.second.back().map(|last| moment.now_ns.saturating_sub(last.now_ns));
        // Half a stride of slack: wake-ups are never quite on the raster.
        let due = distance.is_none_or(|distance| distance + stride_ns / 2 >= stride_ns);
        if due || always {
            self.second.push_back(moment);
        }
        let oldest = moment.now_ns.saturating_sub(SECOND_NS);
        while self.second.front().is_some_and(|first| first.now_ns < oldest) {
            self.second.pop_front();
        }
        while self.second.len() > KEPT {
            self.second.pop_front();
        }
    }

    /// One trace a second is enough: the one before shows how it began.
    fn may_trace(&mut self, now_ns: u64) -> bool {
        let free = self.traced_ns.is_none_or(|last| now_ns.saturating_sub(last) >= SECOND_NS);
        if free {
            self.traced_ns = Some(now_ns);
        }
        free
    }

    fn may_record(&mut self, now_ns: u64) -> bool {
        if now_ns.saturating_sub(self.window_ns) >= SECOND_NS {
            (self.window_ns, self.changes) = (now_ns, 0);
        }
        self.changes += 1;
        self.changes <= CHANGES_MAX
    }
}

/// A code that was not there before; torque that went away while a code stands.
fn trips(before: &Moment, now: &Moment) -> bool {
    let new_code = now.codes().any(|code| before.codes().all(|known| known != code));
    let torque_lost = before.torque && !now.torque;
    let with_code = torque_lost && now.codes().next().is_some();
    new_code || with_code
}
