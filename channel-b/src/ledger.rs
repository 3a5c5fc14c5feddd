//! Standing errors and warnings: what they demand, and when an edge may clear them.

use shm_schema::error::{ErrorCode, ErrorList};

use crate::engine::spec::Reaction;

/// Errors that stand side by side at most; one more is torque off until all are gone.
const ENTRIES: usize = 16;

/// How long the cause of an error stands (DEC-15).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Until the stop it demands has reached its end state; where it demands none, as long as
    /// the limit is violated (ETG-ERR-02).
    Reaction,
    /// As long as it is raised again every cycle.
    Live,
    /// As long as it is raised again every cycle; ends by itself. For what disturbs a start-up
    /// (nothing was tripped yet, and the first torque needs an edge anyway, DEC-19) and for
    /// messages without error status.
    Passing,
    /// Until the set is restarted or a valid parameter set loaded.
    Lasting,
}

/// One standing error.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// What is reported.
    pub code: ErrorCode,
    /// What it demands while it stands.
    pub reaction: Reaction,
    /// It sets the error bit and keeps stops from being left (DEC-47).
    pub is_error: bool,
    /// When its cause is gone.
    pub cause: Cause,
    /// What to release on acknowledgement: a monitoring function, or [`STOP`] and above a stop.
    pub owner: u8,
}

/// Owner of the first stop function's errors; below it are those of the monitoring functions.
pub const STOP: u8 = 128;
/// Nothing waits for this error.
pub const NO_OWNER: u8 = u8::MAX;

impl Entry {
    /// An error that demands STO.
    pub const fn sto(code: ErrorCode, cause: Cause) -> Self {
        Self { code, reaction: Reaction::Sto, is_error: true, cause, owner: NO_OWNER }
    }

    /// A warning that demands nothing.
    pub const fn warning(code: ErrorCode, cause: Cause) -> Self {
        Self { code, reaction: Reaction::None, is_error: false, cause, owner: NO_OWNER }
    }
}

#[derive(Debug, Clone, Copy)]
struct Standing {
    entry: Entry,
    /// Raised in this cycle or the one before.
    fresh: u8,
}

/// The errors of one axis.
#[derive(Debug, Clone, Copy)]
pub struct Ledger {
    entries: [Option<Standing>; ENTRIES],
    overflow: bool,
    /// What follows from the entries, kept with every change.
    is_empty: bool,
    has_error: bool,
    demands_sto: bool,
    stops: u16,
}

impl Ledger {
    /// Nothing stands.
    pub const fn new() -> Self {
        Self {
            entries: [None; ENTRIES],
            overflow: false,
            is_empty: true,
            has_error: false,
            demands_sto: false,
            stops: 0,
        }
    }

    /// A new cycle: causes that are not raised again count as gone.
    pub fn begin_cycle(&mut self) {
        if self.is_empty {
            return;
        }
        for place in &mut self.entries {
            let Some(standing) = place else { continue };
            standing.fresh = standing.fresh.saturating_sub(1);
            let is_over = (standing.entry.cause == Cause::Passing) & (standing.fresh == 0);
            if is_over {
                *place = None;
            }
        }
        self.sum_up();
    }

    /// Raises `entry`, or refreshes its cause when it stands already.
    pub fn raise(&mut self, entry: Entry) {
        let known = self.entries.iter_mut().flatten().find(|old| old.entry.code == entry.code);
        if let Some(standing) = known {
            standing.fresh = 2;
            // What stood at the start and stands under torque is an error like any other.
            if standing.entry.cause == Cause::Passing {
                standing.entry.cause = entry.cause;
            }
            return;
        }
        match self.entries.iter_mut().find(|place| place.is_none()) {
            Some(place) => *place = Some(Standing { entry, fresh: 2 }),
            None => self.overflow = true,
        }
        self.sum_up();
    }

    fn sum_up(&mut self) {
        self.is_empty = self.entries.iter().all(Option::is_none);
        let (mut has_error, mut demands_sto, mut stops) = (self.overflow, self.overflow, 0);
        for entry in self.iter() {
            has_error |= entry.is_error;
            match entry.reaction {
                Reaction::None => {}
                Reaction::Sto => demands_sto = true,
                Reaction::Stop(place) => stops |= 1 << (place & 15),
            }
        }
        (self.has_error, self.demands_sto, self.stops) = (has_error, demands_sto, stops);
    }

    /// One edge clears everything whose cause is gone (DEC-15). `settles` is asked about each
    /// violation, and lets its function start again when it is over.
    pub fn acknowledge(&mut self, settles: &mut dyn FnMut(&Entry) -> bool) {
        for place in &mut self.entries {
            let Some(standing) = place else { continue };
            let gone = match standing.entry.cause {
                Cause::Reaction => settles(&standing.entry),
                Cause::Live | Cause::Passing => standing.fresh == 0,
                Cause::Lasting => false,
            };
            if gone {
                *place = None;
            }
        }
        if self.entries.iter().all(Option::is_none) {
            self.overflow = false;
        }
        self.sum_up();
    }

    /// Nothing stands, not even a warning.
    pub const fn is_empty(&self) -> bool {
        self.is_empty & !self.overflow
    }

    /// Torque off is demanded.
    pub const fn demands_sto(&self) -> bool {
        self.demands_sto
    }

    /// Stop functions demanded, bit n for place n.
    pub const fn demanded_stops(&self) -> u16 {
        self.stops
    }

    /// Something stands that sets the error bit.
    pub const fn has_error(&self) -> bool {
        self.has_error
    }

    /// Enters what stands into the empty list of a report, sorted.
    pub fn list(&self, list: &mut ErrorList) {
        if self.is_empty {
            return;
        }
        for entry in self.iter() {
            list.insert(entry.code);
        }
        list.more |= self.overflow;
    }

    /// Whether `found` is said of something that stands.
    pub fn any(&self, found: impl Fn(&Entry) -> bool) -> bool {
        !self.is_empty && self.iter().any(found)
    }

    /// What stands.
    pub fn iter(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().flatten().map(|standing| &standing.entry)
    }
}

impl Default for Ledger {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARTNER: ErrorCode = ErrorCode::amk(3606, 13, 1, 0);

    /// DEC-15: refused while the cause stands.
    #[test]
    fn an_edge_clears_a_live_error_only_after_its_cause_has_gone() {
        let mut ledger = Ledger::new();
        ledger.raise(Entry::sto(PARTNER, Cause::Live));
        ledger.begin_cycle();
        ledger.acknowledge(&mut |_| true);
        assert!(ledger.demands_sto());
        ledger.begin_cycle();
        ledger.acknowledge(&mut |_| true);
        assert!(!ledger.has_error());
    }

    /// DEC-19: what disturbs a start-up ends with its cause; under torque it waits for an edge.
    #[test]
    fn a_disturbed_start_needs_no_edge_of_its_own() {
        let mut ledger = Ledger::new();
        ledger.raise(Entry::sto(PARTNER, Cause::Passing));
        ledger.begin_cycle();
        assert!(ledger.has_error());
        ledger.begin_cycle();
        assert!(!ledger.has_error());
        ledger.raise(Entry::sto(PARTNER, Cause::Passing));
        ledger.raise(Entry::sto(PARTNER, Cause::Live));
        ledger.begin_cycle();
        ledger.begin_cycle();
        assert!(ledger.has_error());
    }

    #[test]
    fn more_errors_than_places_are_torque_off_until_all_are_gone() {
        let mut ledger = Ledger::new();
        for code in 1..=17 {
            ledger.raise(Entry::warning(ErrorCode::single(code), Cause::Live));
        }
        assert!(ledger.demands_sto());
        let mut list = ErrorList::default();
        ledger.list(&mut list);
        assert!(list.more);
        for _ in 0..2 {
            ledger.begin_cycle();
        }
        ledger.acknowledge(&mut |_| true);
        assert!(!ledger.demands_sto());
    }
}
