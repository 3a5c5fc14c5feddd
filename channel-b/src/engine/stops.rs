//! Stop functions: at most one runs; STO over SS1 over SS2 (DEC-13, AMK-GEN-07).

use super::Motion;
use super::record::{Breach, Phase, Record};
use super::spec::{Reaction, Spec};
use crate::twin::Twin;

/// Most stop functions of one axis besides STO.
pub const STOPS_MAX: usize = 16;

/// Where a stop function leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// Torque off: an SS1.
    Sto,
    /// Standstill under torque: an SS2.
    Sos,
}

/// A stop function.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// Its approach and windows.
    pub spec: Spec,
    /// Where it leads.
    pub end: End,
    /// Status bit of the standing SOS, or [`super::spec::NO_BIT`].
    pub standing_status: u8,
    /// Interrupted by STO it stands at once when STO is left (LNZ-SOS-04).
    pub resumes: bool,
}

/// What is asked of the stop functions in one cycle.
#[derive(Debug, Clone, Copy)]
pub struct Demand {
    /// Torque off is asked for.
    pub sto: bool,
    /// Bit n: the stop function in place n is asked for, by a request or by an error.
    pub stops: u16,
    /// The same by a request alone.
    pub requests: u16,
    /// A finished stop may be left: no error stands, the restart rule is satisfied.
    pub may_leave: bool,
    /// The same for a standing SOS at the end of an SS2.
    pub may_leave_sos: bool,
}

/// All stop functions of one axis.
#[derive(Debug, Clone, Copy)]
pub struct Stops {
    table: [Option<Stop>; STOPS_MAX],
    count: usize,
    active: Option<(u8, Record)>,
    sto: Twin,
    /// When STO was entered, ns.
    entered: Twin,
    /// Bit mask of the stop that ended in STO.
    origin: Twin,
    /// Bit mask of the stop that ended in STO, by its end or by a violation, and whose request
    /// has stood since: while it stands, STO stands (DEC-11, DEC-12). A request that comes
    /// later is remembered and begins when STO is left (DEC-13).
    held: Twin,
    /// Bit n: stop n was interrupted by STO and its request has not gone since.
    interrupted: u16,
    /// Requests of this cycle.
    requests: u16,
    /// Further SS1 requested while one brakes, each in its own envelope since its own request
    /// (ETG-GEN-12); the first that ends, ends all.
    beside: [Option<Record>; STOPS_MAX],
    /// How long the STO of a finished stop lasts at least, ns (DEC-48).
    sto_least_ns: u64,
}

impl Stops {
    /// In STO, as every axis begins (DEC-19).
    pub const fn new() -> Self {
        Self {
            table: [None; STOPS_MAX],
            count: 0,
            active: None,
            sto: Twin::flag(true),
            entered: Twin::time(0),
            origin: Twin::new(0),
            held: Twin::new(0),
            interrupted: 0,
            requests: 0,
            beside: [None; STOPS_MAX],
            sto_least_ns: 0,
        }
    }

    /// Adds a stop function; its place, or `None` when there is no room.
    pub fn add(&mut self, stop: Stop) -> Option<u8> {
        let place = self.count;
        *self.table.get_mut(place)? = Some(stop);
        self.count = self.count.saturating_add(1);
        Some(place as u8)
    }

    /// The STO of a finished stop lasts at least this long (ATV 100 ms).
    pub const fn hold_sto(&mut self, least_ns: u64) {
        self.sto_least_ns = least_ns;
    }

    /// The stop functions in use, with their places.
    pub fn all(&self) -> impl Iterator<Item = (u8, &Stop)> {
        (0..)
            .zip(self.table.iter().take(self.count))
            .filter_map(|(place, stop)| Some((place, stop.as_ref()?)))
    }

    /// Torque is off.
    pub const fn in_sto(&self) -> bool {
        self.sto.is(true)
    }

    /// The stop that brakes or stands, with whether it has reached its window.
    pub fn running(&self) -> Option<(&Stop, bool)> {
        let (place, record) = self.active.as_ref()?;
        Some((self.at(*place)?, record.has_landed()))
    }

    /// Time since the running stop began and time inside its window, ns.
    pub fn progress(&self, now: u64) -> Option<(i64, i64)> {
        self.active.as_ref().and_then(|(_, record)| record.progress(now))
    }

    /// Place of the stop that brakes or stands.
    pub fn place(&self) -> Option<u8> {
        self.active.as_ref().map(|(place, _)| *place)
    }

    /// The STO of a finished stop has its least time still before it (DEC-48).
    pub fn rests(&self, now: u64) -> bool {
        let age = self.entered.get_time().map(|entered| now.saturating_sub(entered));
        self.in_sto() & (self.origin() != 0) & age.is_none_or(|age| age < self.sto_least_ns)
    }

    /// Bit mask of the stops whose request holds STO while it stands.
    pub fn held(&self) -> u16 {
        self.held.get().map_or(u16::MAX, |held| held as u16)
    }

    /// Bit mask of the stop that ended in the present STO.
    pub fn origin(&self) -> i64 {
        self.origin.get().unwrap_or(0)
    }

    /// Drops a running or finished stop that is no longer asked for: the enable switch
    /// completes stopping times (LNZ-OMS-14).
    pub fn complete(&mut self, demand: &Demand) {
        let is_free = !demand.sto & demand.may_leave & (demand.stops == 0);
        if is_free {
            self.active = None;
            self.release();
        }
    }

    const fn release(&mut self) {
        self.sto = Twin::flag(false);
        self.origin = Twin::new(0);
        self.held = Twin::new(0);
    }

    /// A stop function is still on its way to its end state (DEC-15).
    pub fn brakes(&self) -> bool {
        self.running().is_some_and(|(_, landed)| !landed)
    }

    fn at(&self, place: u8) -> Option<&Stop> {
        self.table.get(usize::from(place))?.as_ref()
    }

    /// Leaves what may be left. First call of a cycle.
    pub fn leave(&mut self, demand: &Demand, now: u64) {
        if self.in_sto() {
            self.leave_sto(demand, now);
        }
        let Some((place, record)) = &self.active else {
            return;
        };
        let is_asked = demand.stops >> (place & 15) & 1 == 1;
        let may = record.has_landed() & demand.may_leave_sos & !is_asked;
        if may {
            self.active = None;
        }
    }

    /// The request of what ended in this state is gone.
    pub fn is_released(&self, demand: &Demand) -> bool {
        let held = self.held.get().unwrap_or(-1);
        let active = self.place().map_or(0, |place| 1 << (place & 15));
        i64::from(demand.requests) & (held | active) == 0
    }

    fn leave_sto(&mut self, demand: &Demand, now: u64) {
        let (Some(entered), Some(origin)) = (self.entered.get_time(), self.origin.get()) else {
            return;
        };
        let Some(held) = self.held.get() else { return };
        let held = held & i64::from(demand.requests);
        self.held = Twin::new(held);
        // DEC-48: visible for one cycle at least, so never left in the cycle it was entered.
        let is_finished_stop = origin != 0;
        let age = now.saturating_sub(entered);
        let too_young = is_finished_stop & (age < self.sto_least_ns.max(1));
        let is_held = demand.sto | (held != 0);
        let stays = is_held | too_young | !demand.may_leave;
        if !stays {
            self.release();
        }
    }

    /// Starts what is asked for and judges what runs. May be called again in the same
    /// cycle with a larger demand; the answer to what already ran is the same.
    pub fn advance(
        &mut self,
        demand: &Demand,
        now: u64,
        motion: &Motion,
        found: &mut dyn FnMut(u8, &Spec, Breach, Phase),
    ) {
        self.interrupted &= demand.stops;
        self.requests = demand.requests;
        let is_idle = !demand.sto & !self.in_sto() & (demand.stops == 0) & self.active.is_none();
        if is_idle {
            return;
        }
        if demand.sto {
            self.enter_sto(0, now);
        }
        if self.in_sto() {
            self.abort(demand);
            return;
        }
        self.select(demand, now, motion);
        self.judge(now, motion, found);
        self.judge_beside(now, motion, found);
    }

    /// STO ends what runs. An SS1 has its end state then: while the request that it had stands,
    /// STO stands (DEC-11, DEC-13, ATV-SS1-12).
    fn abort(&mut self, demand: &Demand) {
        let Some(place) = self.place() else { return };
        let bit = 1_u16 << (place & 15);
        self.interrupted |= bit & demand.stops;
        let is_ss1 = self.running().is_some_and(|(stop, _)| stop.end == End::Sto);
        if is_ss1 {
            self.hold(bit & demand.requests);
        }
        self.active = None;
    }

    /// The request of the SS1 that has ended here holds STO, and so does that of every other SS1
    /// that was requested beside it (ETG-GEN-12).
    fn hold(&mut self, own: u16) {
        let beside =
            self.all().fold(0, |mask, (place, stop)| mask | u16::from(stop.end == End::Sto) << (place & 15));
        let held = self.held.get().unwrap_or(0) | i64::from(own | (beside & self.requests));
        self.held = Twin::new(held);
    }

    fn enter_sto(&mut self, origin: i64, now: u64) {
        if !self.in_sto() {
            self.entered = Twin::time(now);
            self.origin = Twin::new(origin);
        }
        self.sto = Twin::flag(true);
    }

    fn first(&self, asked: u16, end: End) -> Option<u8> {
        let is_asked = |place: u8| asked >> (place & 15) & 1 == 1;
        self.all().find(|(place, stop)| is_asked(*place) & (stop.end == end)).map(|(place, _)| place)
    }

    fn select(&mut self, demand: &Demand, now: u64, motion: &Motion) {
        let running = self.running().map(|(stop, _)| stop.end);
        // DEC-11: what runs, runs to its end; DEC-13: only a higher stop aborts it.
        let next = match running {
            Some(End::Sto) => None,
            Some(End::Sos) => self.first(demand.stops, End::Sto),
            None => self.first(demand.stops, End::Sto).or(self.first(demand.stops, End::Sos)),
        };
        if running == Some(End::Sto) || next.is_some_and(|place| self.ends_in_sto(place)) {
            self.select_beside(demand.stops, next.or(self.place()), now, motion);
        }
        if let Some(place) = next {
            let record = Record::begin(now, motion);
            let resumes = self.at(place).is_some_and(|stop| stop.resumes);
            let was_interrupted = self.interrupted >> (place & 15) & 1 == 1;
            self.active = Some((place, if resumes & was_interrupted { record.landed() } else { record }));
        }
    }

    fn ends_in_sto(&self, place: u8) -> bool {
        self.at(place).is_some_and(|stop| stop.end == End::Sto)
    }

    fn select_beside(&mut self, asked: u16, first: Option<u8>, now: u64, motion: &Motion) {
        for place in 0..STOPS_MAX as u8 {
            let is_asked = asked >> (place & 15) & 1 == 1;
            let is_further = is_asked & (first != Some(place)) & self.ends_in_sto(place);
            if let (true, Some(entry)) = (is_further, self.beside.get_mut(usize::from(place))) {
                entry.get_or_insert(Record::begin(now, motion));
            }
        }
    }

    /// As the one that brakes: a breach or the end of a further SS1 is STO.
    fn judge_beside(&mut self, now: u64, motion: &Motion, found: &mut dyn FnMut(u8, &Spec, Breach, Phase)) {
        for place in 0..STOPS_MAX as u8 {
            let brakes = self.running().is_some_and(|(stop, _)| stop.end == End::Sto);
            if !brakes {
                self.beside = [None; STOPS_MAX];
                return;
            }
            let entry = self.beside.get(usize::from(place)).copied().flatten();
            let Some((mut record, stop)) = entry.zip(self.at(place).copied()) else { continue };
            let verdict = record.judge(&stop.spec, now, motion);
            record.note(&stop.spec, &verdict, now, motion);
            if let Some(entry) = self.beside.get_mut(usize::from(place)) {
                *entry = Some(record);
            }
            let is_over = (verdict.phase == Phase::Window) | verdict.breach.is_some();
            if !is_over {
                continue;
            }
            // The one that ran holds STO by its request as well.
            let first = self.place().map_or(0, |first| 1_u16 << (first & 15));
            self.active = None;
            self.hold(first | 1 << (place & 15));
            if let Some(breach) = verdict.breach {
                self.enter_sto(0, now);
                found(place, &stop.spec, breach, verdict.phase);
            } else {
                self.enter_sto(1 << (place & 15), now);
            }
        }
    }

    fn judge(&mut self, now: u64, motion: &Motion, found: &mut dyn FnMut(u8, &Spec, Breach, Phase)) {
        let Some((place, mut record)) = self.active else {
            return;
        };
        let Some(stop) = self.at(place).copied() else {
            return self.enter_sto(0, now);
        };
        let verdict = record.judge(&stop.spec, now, motion);
        if let Some(breach) = verdict.breach {
            self.active = None;
            // ETG-SS2-10: only a left line may have another reaction than STO.
            let is_own_reaction = matches!((breach, stop.spec.reaction), (Breach::Line, Reaction::Stop(_)));
            if !is_own_reaction {
                self.enter_sto(0, now);
                if stop.end == End::Sto {
                    self.hold(1 << (place & 15));
                }
            }
            return found(place, &stop.spec, breach, verdict.phase);
        }
        record.note(&stop.spec, &verdict, now, motion);
        self.active = Some((place, record));
        let is_over = (verdict.phase == Phase::Window) & (stop.end == End::Sto);
        if is_over {
            self.active = None;
            self.hold(1 << (place & 15));
            self.enter_sto(1 << (place & 15), now);
        }
    }
}

impl Default for Stops {
    fn default() -> Self {
        Self::new()
    }
}
