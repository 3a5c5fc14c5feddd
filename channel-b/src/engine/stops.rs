//! Stop functions: STO over SS1 over SS2 (DEC-13, AMK-GEN-07). Those of the same rank run side by
//! side, each from its own start to its own end (ETG-GEN-12): the first SS1 that ends is STO for
//! all, an SS2 that ends stands in its own SOS while another still brakes (ETG-SS2-02).

use super::Motion;
use super::record::{Breach, Phase, Record, Verdict};
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
    /// Requested, not a reaction, when STO is left it stands at once (LNZ-SOS-04, LNZ-PRIO-04).
    pub resumes: bool,
}

/// What is asked of the stop functions in one cycle.
#[derive(Debug, Clone, Copy)]
pub struct Demand {
    /// Torque off is asked for.
    pub sto: bool,
    /// Bit n: the stop function in place n is asked for by a request.
    pub requests: u16,
    /// Bit n: by an error that stands.
    pub reactions: u16,
    /// A finished stop may be left: no error stands, the restart rule is satisfied.
    pub may_leave: bool,
    /// Bit n: the same for the SOS at the end of stop n.
    pub may_leave_sos: u16,
}

impl Demand {
    const fn stops(&self) -> u16 {
        self.requests | self.reactions
    }
}

/// Is told the place of a stop, its spec and how it was violated.
pub type Found<'a> = dyn FnMut(u8, &Spec, Breach, Phase) + 'a;

/// All stop functions of one axis.
#[derive(Debug, Clone, Copy)]
pub struct Stops {
    table: [Option<Stop>; STOPS_MAX],
    count: usize,
    /// Bit n: stop n exists; it is an SS1.
    known: u16,
    ss1: u16,
    /// Bit n: stop n brakes or stands; what is known of it is in its record.
    running: Twin,
    records: [Record; STOPS_MAX],
    sto: Twin,
    /// When STO was entered, ns.
    entered: Twin,
    /// Bit mask of the stops that ended in STO.
    origin: Twin,
    /// Bit mask of the stops that ended in STO, by their end or by a violation, and whose request
    /// has stood since: while it stands, STO stands (DEC-11, DEC-12). A request that comes
    /// later is remembered and begins when STO is left (DEC-13).
    held: Twin,
    /// STO was left in this cycle; not by the first one, which only begins as if it had been.
    has_left_sto: bool,
    is_first: bool,
    /// Bit n: stop n has left its line, and another stop took over (ETG-SS2-10). It does not begin
    /// again before its request has gone or its error was acknowledged (DEC-17).
    spent: u16,
    /// Stops that errors asked for in the cycle before.
    reacted: u16,
    /// How long the STO of a finished stop lasts at least, ns (DEC-48).
    sto_least_ns: u64,
}

impl Stops {
    /// In STO, as every axis begins (DEC-19).
    pub const fn new() -> Self {
        Self {
            table: [None; STOPS_MAX],
            count: 0,
            known: 0,
            ss1: 0,
            running: Twin::new(0),
            records: [Record::begin(0, &Motion::ZERO); STOPS_MAX],
            sto: Twin::flag(true),
            entered: Twin::time(0),
            origin: Twin::new(0),
            held: Twin::new(0),
            has_left_sto: false,
            is_first: true,
            spent: 0,
            reacted: 0,
            sto_least_ns: 0,
        }
    }

    /// Adds a stop function; its place, or `None` when there is no room.
    pub fn add(&mut self, stop: Stop) -> Option<u8> {
        let place = self.count as u8;
        *self.table.get_mut(self.count)? = Some(stop);
        self.count = self.count.saturating_add(1);
        self.known |= bit(place);
        if stop.end == End::Sto {
            self.ss1 |= bit(place);
        }
        Some(place)
    }

    /// The STO of a finished stop lasts at least this long (ATV 100 ms).
    pub const fn hold_sto(&mut self, least_ns: u64) {
        self.sto_least_ns = least_ns;
    }

    /// The stop functions in use, with their places.
    pub fn all(&self) -> impl Iterator<Item = (u8, &Stop)> {
        self.of(self.known)
    }

    fn of(&self, mask: u16) -> impl Iterator<Item = (u8, &Stop)> {
        places(mask).filter_map(|place| Some((place, self.table.get(usize::from(place))?.as_ref()?)))
    }

    fn record(&self, place: u8) -> Option<&Record> {
        self.records.get(usize::from(place))
    }

    /// Torque is off.
    pub const fn in_sto(&self) -> bool {
        self.sto.is(true)
    }

    /// Bit n: stop n brakes or stands. Damage is answered by [`Stops::advance`].
    fn on(&self) -> u16 {
        self.running.get().map_or(0, |running| running as u16)
    }

    /// Nothing brakes or stands, and torque is on.
    pub fn is_idle(&self) -> bool {
        (self.on() == 0) & !self.in_sto()
    }

    /// Nothing runs or has just been left, and nothing of it is remembered.
    pub fn is_quiet(&self) -> bool {
        let is_running = self.running.get() != Some(0);
        !(is_running | self.in_sto() | self.has_left_sto | (self.spent != 0))
    }

    fn set_running(&mut self, running: u16) {
        self.running = Twin::new(i64::from(running));
    }

    /// Bit n: stop n has reached its end state, an SOS.
    pub fn standing(&self) -> u16 {
        let landed = |place: u8| self.record(place).is_some_and(Record::has_landed);
        places(self.on()).fold(0, |mask, place| mask | u16::from(landed(place)) << (place & 15))
    }

    /// Bit n: stop n is still on its way to its end state (DEC-15).
    pub fn braking(&self) -> u16 {
        self.on() & !self.standing()
    }

    /// Stop `place` is still on its way to its end state, or an SS1 is that has aborted it.
    pub fn is_pending(&self, place: u8) -> bool {
        self.brakes_to_sto() | (self.braking() & bit(place) != 0)
    }

    /// An SS1 brakes.
    pub fn brakes_to_sto(&self) -> bool {
        self.on() & self.ss1 != 0
    }

    /// An SS2 brakes, or stands in its SOS.
    pub fn is_in_ss2(&self) -> bool {
        self.on() & !self.ss1 != 0
    }

    /// What brakes or stands: places, and whether the end state is reached.
    pub fn running(&self) -> impl Iterator<Item = (&Stop, bool)> {
        let standing = self.standing();
        self.of(self.on()).map(move |(place, stop)| (stop, standing & bit(place) != 0))
    }

    /// Of the running stops in `mask`: time since the beginning and time inside the window, ns.
    pub fn progress(&self, mask: u16, now: u64) -> impl Iterator<Item = (&Stop, i64, i64)> {
        self.of(self.on() & mask).filter_map(move |(place, stop)| {
            let (elapsed, dwelt) = self.record(place)?.progress(now)?;
            Some((stop, elapsed, dwelt))
        })
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

    /// Bit mask of the stops that ended in the present STO.
    pub fn origin(&self) -> i64 {
        self.origin.get().unwrap_or(0)
    }

    /// Drops running or finished stops that are no longer asked for: the enable switch
    /// completes stopping times (LNZ-OMS-14).
    pub fn complete(&mut self, demand: &Demand) {
        let is_free = !demand.sto & demand.may_leave & (demand.stops() == 0);
        if is_free {
            self.set_running(0);
            self.leave_for_torque();
        }
    }

    const fn leave_for_torque(&mut self) {
        self.sto = Twin::flag(false);
        self.origin = Twin::new(0);
        self.held = Twin::new(0);
    }

    /// The error of the stop in `place` was acknowledged: it may begin again (DEC-17).
    pub const fn release(&mut self, place: u8) {
        self.spent &= !bit(place);
    }

    /// Stop `place` is off its line, which has no reaction (ETG-ERR-02).
    pub fn is_violated(&self, place: u8, now: u64, motion: &Motion) -> bool {
        let is_violated = |stop: &Stop| {
            let record = self.record(place);
            record.is_some_and(|record| record.judge(&stop.spec, now, motion).breach.is_some())
        };
        self.of(self.on() & bit(place)).any(|(_, stop)| is_violated(stop))
    }

    /// Leaves what may be left. First call of a cycle.
    pub fn leave(&mut self, demand: &Demand, now: u64) {
        self.has_left_sto = false;
        if self.in_sto() {
            self.leave_sto(demand, now);
            self.has_left_sto = !(self.in_sto() | self.is_first);
        }
        self.is_first = false;
        let leaves = demand.may_leave_sos & !demand.stops() & self.on();
        if leaves != 0 {
            self.set_running(self.on() & !(leaves & self.standing()));
        }
    }

    /// The requests that held this STO are gone.
    pub fn is_released(&self, demand: &Demand) -> bool {
        i64::from(demand.requests) & self.held.get().unwrap_or(-1) == 0
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
            self.leave_for_torque();
        }
    }

    /// Starts what is asked for and judges what runs; whether an SS2 was violated in this cycle.
    /// The STO of an SS1 is its own end, that of an SS2 a reaction like any other's.
    pub fn advance(&mut self, demand: &Demand, now: u64, motion: &Motion, found: &mut Found<'_>) -> bool {
        let asked = demand.stops();
        self.spent &= asked;
        let is_running = self.running.get() != Some(0);
        let is_idle = !(demand.sto | self.in_sto() | (asked != 0) | is_running);
        if is_idle {
            return false;
        }
        if self.running.get().is_none() {
            self.enter_sto(0, now);
        }
        self.begin(demand, now, motion);
        self.judge(self.on(), demand, now, motion, found)
    }

    /// Starts what the errors of the same cycle ask for besides.
    pub fn join(&mut self, demand: &Demand, now: u64, motion: &Motion, found: &mut Found<'_>) {
        let is_asked = demand.stops() & !self.on() != 0;
        let is_idle = !(demand.sto | self.in_sto() | is_asked);
        if is_idle {
            return;
        }
        let begun = self.begin(demand, now, motion);
        if begun != 0 {
            self.judge(begun, demand, now, motion, found);
        }
    }

    /// Starts what is asked for; bit mask of what was started.
    fn begin(&mut self, demand: &Demand, now: u64, motion: &Motion) -> u16 {
        let running = self.on();
        // A new reaction that has failed already is none; what has handed over is answered.
        let has_failed = demand.reactions & !self.reacted & self.spent != 0;
        self.reacted = demand.reactions;
        if demand.sto | has_failed {
            self.enter_sto(0, now);
        }
        if self.in_sto() {
            self.abort(demand);
            return 0;
        }
        let asked = demand.stops() & self.known & !running & !self.spent;
        // DEC-11: what runs, runs to its end; DEC-13: only a higher stop aborts it.
        let is_ss1 = (running | asked) & self.ss1 != 0;
        let rank = if is_ss1 { self.ss1 } else { u16::MAX };
        let begun = asked & rank;
        for place in places(begun) {
            let is_request = demand.requests & bit(place) != 0;
            self.start(place, Record::begin(now, motion), is_request & self.has_left_sto);
        }
        self.set_running((running & rank) | begun);
        begun
    }

    fn start(&mut self, place: u8, record: Record, is_left_over: bool) {
        let resumes = self.of(bit(place)).any(|(_, stop)| stop.resumes);
        if let Some(entry) = self.records.get_mut(usize::from(place)) {
            *entry = if resumes & is_left_over { record.landed() } else { record };
        }
    }

    /// STO ends what runs. An SS1 has its end state then: while the request that it had stands,
    /// STO stands (DEC-11, DEC-13, ATV-SS1-12).
    fn abort(&mut self, demand: &Demand) {
        let running = self.on();
        if running == 0 {
            return;
        }
        let held = i64::from(running & self.ss1 & demand.requests);
        self.held = Twin::new(self.held.get().unwrap_or(-1) | held);
        self.set_running(0);
    }

    fn enter_sto(&mut self, origin: u16, now: u64) {
        if !self.in_sto() {
            self.entered = Twin::time(now);
            self.origin = Twin::new(i64::from(origin));
        }
        self.sto = Twin::flag(true);
    }

    /// Judges the running stops in `mask`, each by its own record; whether an SS2 was violated.
    fn judge(
        &mut self,
        mask: u16,
        demand: &Demand,
        now: u64,
        motion: &Motion,
        found: &mut Found<'_>,
    ) -> bool {
        let mut ends = Ends::default();
        for place in places(mask) {
            let stop = self.table.get(usize::from(place)).and_then(Option::as_ref);
            let Some((stop, record)) = stop.zip(self.records.get_mut(usize::from(place))) else { continue };
            let verdict = record.judge(&stop.spec, now, motion);
            let answer = answer(bit(place) | self.spent | ends.spent, stop, &verdict);
            if let Some(breach) = verdict.breach {
                ends.is_violated = true;
                found(place, &stop.spec, breach, verdict.phase);
            }
            match answer {
                Answer::GoesOn => record.note(&stop.spec, &verdict, now, motion),
                Answer::Ends => ends.ended |= bit(place),
                Answer::Leaves => ends.left |= bit(place),
                Answer::HandsOver => ends.spent |= bit(place),
            }
        }
        self.end(&ends, demand, now);
        ends.is_violated & (mask & self.ss1 == 0)
    }

    fn end(&mut self, ends: &Ends, demand: &Demand, now: u64) {
        if ends.spent != 0 {
            self.spent |= ends.spent;
            self.set_running(self.on() & !ends.spent);
        }
        if ends.ended | ends.left != 0 {
            self.abort(demand);
            self.enter_sto(if ends.left == 0 { ends.ended } else { 0 }, now);
        }
    }
}

impl Default for Stops {
    fn default() -> Self {
        Self::new()
    }
}

/// What became of the stops of one cycle, as bit masks.
#[derive(Default)]
struct Ends {
    ended: u16,
    left: u16,
    spent: u16,
    is_violated: bool,
}

/// What a verdict means to its stop.
enum Answer {
    GoesOn,
    /// An SS1 has reached its end: STO.
    Ends,
    /// Violated: STO.
    Leaves,
    /// Violated: its reaction takes over.
    HandsOver,
}

/// ETG-SS2-10: only a left line may have another reaction than STO. The stop itself and those that
/// have left their own line before, `failed`, are none.
fn answer(failed: u16, stop: &Stop, verdict: &Verdict) -> Answer {
    match (verdict.breach, stop.spec.reaction) {
        (None, _) if (verdict.phase == Phase::Window) & (stop.end == End::Sto) => Answer::Ends,
        (None, _) | (Some(Breach::Line), Reaction::None) => Answer::GoesOn,
        (Some(Breach::Line), Reaction::Stop(other)) if failed & bit(other) == 0 => Answer::HandsOver,
        (Some(_), _) => Answer::Leaves,
    }
}

/// No bit for what is no place.
const fn bit(place: u8) -> u16 {
    if place < 16 { 1 << place } else { 0 }
}

/// The places of a bit mask.
fn places(mask: u16) -> impl Iterator<Item = u8> {
    let mut rest = mask;
    core::iter::from_fn(move || {
        let place = rest.trailing_zeros() as u8;
        rest &= rest.wrapping_sub(1);
        (place < 16).then_some(place)
    })
}
