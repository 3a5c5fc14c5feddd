//! How a reached stop is left: nothing requests it, no error stands, and the restart behaviour
//! is satisfied (DEC-12). Each standing stop is left for itself (ETG-RST-02).

use super::{Demand, Places, Stops};

impl Stops {
    /// STO may be left, but for a restart acknowledge.
    fn sto_is_free(&self, demand: &Demand, now_ns: u64) -> bool {
        let young = now_ns.saturating_sub(self.sto_since_ns) < self.sto_least_ns;
        let short = young & self.ended.is_some();
        let ended = self.held.common(self.to_sto).common(demand.stops);
        let kept = demand.sto | demand.fault | short | !ended.is_empty();
        !(kept | demand.blocked)
    }

    /// The standing stops that may be left, but for a restart acknowledge.
    const fn free(&self, demand: &Demand) -> Places {
        if demand.blocked { Places::NONE } else { self.standing.without(demand.stops) }
    }

    /// Of those that may be left, the ones that wait for a restart acknowledge.
    const fn waiting(&self, free: Places) -> Places {
        if self.restart_once { free } else { free.common(self.acknowledged) }
    }

    pub(super) fn leave(&mut self, demand: Demand, now_ns: u64) {
        let kept = demand.sto | demand.fault | demand.blocked | self.by_error;
        let cancelled = demand.release & !kept;
        if cancelled {
            self.sto = false;
            (self.braking, self.standing) = (Places::NONE, Places::NONE);
            return;
        }
        if self.sto {
            let satisfied = !(self.restart | self.restart_once) | demand.restart;
            self.sto = !(satisfied & self.sto_is_free(&demand, now_ns));
            self.restart_once &= self.sto;
            return;
        }
        let free = self.free(&demand);
        let left = if demand.restart { free } else { free.without(self.waiting(free)) };
        self.standing = self.standing.without(left);
        self.restart_once &= left.is_empty();
    }

    /// After everything of this instant: whether a restart acknowledge is all that is missing.
    pub fn note_pending(&mut self, demand: &Demand, now_ns: u64) {
        self.restart_pending = if self.sto {
            self.sto_is_free(demand, now_ns) & (self.restart | self.restart_once)
        } else {
            !self.waiting(self.free(demand)).is_empty()
        };
    }
}
