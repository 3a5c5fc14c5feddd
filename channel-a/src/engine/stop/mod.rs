//! Stop functions: started by the edge into request, run to their end, held by the level,
//! ordered STO over SS1 over SS2 (DEC-11 to DEC-13). Those of equal order run side by side,
//! each by its own time and within its own limits (ETG-GEN-12).
//!
//! - this file: what there is, what starts, and what it ends
//! - [`advance`]: what one instant makes of what runs or stands
//! - [`leave`]: how a reached stop is left

mod advance;
mod leave;

use super::approach::{Approach, Progress};
use super::places::Places;
use super::watch::Part;
use super::{Range, Sample, Side};

/// Stop functions besides STO that one profile can have: eight SS1 and eight SS2.
pub const STOPS: usize = 16;

/// What a violation starts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Reaction {
    /// Nothing but the error.
    None,
    /// Torque off at once.
    #[default]
    Sto,
    /// The stop function at this place of the table.
    Stop(u8),
}

/// Where a stop function ends.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum End {
    /// Torque off (SS1).
    #[default]
    Sto,
    /// Monitored standstill under torque (SS2).
    Sos,
}

/// One stop function, as the profile's table has it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Plan {
    /// Where it ends.
    pub end: End,
    /// How the end is approached.
    pub approach: Approach,
    /// The speed has to be inside the approach's window at its end.
    pub judged_at_end: bool,
    /// Speed window of the standstill, 1/1000 rpm.
    pub stand_speed: Range,
    /// Position window of the standstill around its first position, increments (DEC-08).
    pub stand_position: Range,
    /// The profile's number of the function.
    pub function: u16,
    /// The profile's number for violations of the standstill.
    pub stand_function: u16,
    /// What leaving the ramp starts.
    pub reaction: Reaction,
    /// The standstill is left only with a restart acknowledge (DEC-12).
    pub restart: bool,
}

/// What is asked of the stop functions in one step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Demand {
    /// STO is requested.
    pub sto: bool,
    /// An error takes the torque away, whatever is requested.
    pub fault: bool,
    /// The stop functions requested.
    pub stops: Places,
    /// An error stands that keeps the reached stop.
    pub blocked: bool,
    /// A restart acknowledge edge.
    pub restart: bool,
    /// The running or standing stop is cancelled at once (enable switch).
    pub release: bool,
}

impl Demand {
    /// Asks for `stop` as well.
    pub const fn ask(&mut self, stop: Reaction) {
        match stop {
            Reaction::None => {}
            Reaction::Sto => self.sto = true,
            Reaction::Stop(place) => self.stops = self.stops.with(Places::of(place)),
        }
    }
}

/// A violation while a stop runs or stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Violation {
    /// The profile's number of the function.
    pub function: u16,
    /// Ramp or standstill.
    pub part: Part,
    /// Which limit.
    pub side: Side,
    /// The position window, not the speed.
    pub position: bool,
    /// What follows.
    pub reaction: Reaction,
}

/// One stop function: its row of the table, and where it is while it runs or stands.
#[derive(Debug, Clone, Copy, Default)]
struct Instance {
    plan: Plan,
    progress: Progress,
    stood_at: i64,
}

/// The stop functions of one axis.
#[derive(Debug, Clone, Copy, Default)]
pub struct Stops {
    instances: [Instance; STOPS],
    known: Places,
    /// SS1: those that end in STO.
    to_sto: Places,
    /// Those whose standstill is left only with a restart acknowledge.
    acknowledged: Places,
    sto: bool,
    /// STO is in force for all that this instant shows, and not only by what it shows.
    shut: bool,
    /// An error has started or kept what runs or stands: a restart acknowledge ends it, and no
    /// enable switch (LNZ-OMS-10).
    by_error: bool,
    braking: Places,
    standing: Places,
    /// Have run to their end, and hold it as long as they are requested.
    held: Places,
    /// Have failed into another stop; they wait until nothing runs any more.
    failed: Places,
    sto_since_ns: u64,
    ended: Option<u8>,
    /// The next leaving needs a restart acknowledge whatever the parameters say.
    pub restart_once: bool,
    /// When STO is left, a requested stop that ends in SOS stands at once (LNZ-SOS-04).
    pub direct_sos: bool,
    /// STO is left only with a restart acknowledge (DEC-12).
    pub restart: bool,
    /// The STO that ends a stop lasts at least this long, ns (ATV 100 ms).
    pub sto_least_ns: u64,
    /// A restart acknowledge is all that is missing.
    pub restart_pending: bool,
}

impl Stops {
    /// Puts `plan` at `place`.
    pub fn set(&mut self, place: u8, plan: Plan) {
        let Some(instance) = self.instances.get_mut(usize::from(place)) else { return };
        instance.plan = plan;
        self.known = self.known.with(Places::of(place));
        self.to_sto = self.to_sto.with(Places::when(plan.end == End::Sto, place));
        self.acknowledged = self.acknowledged.with(Places::when(plan.restart, place));
    }

    /// Torque is off.
    pub const fn is_sto(&self) -> bool {
        self.sto
    }

    /// Limits are judged in this instant: no STO, or only one that left limits of this instant lead
    /// to. That one begins when all of them have been judged (DEC-02, DEC-14).
    pub const fn judges(&self) -> bool {
        !self.shut
    }

    /// Those that brake.
    pub const fn braking(&self) -> Places {
        self.braking
    }

    /// Those that brake into STO.
    pub const fn braking_to_sto(&self) -> Places {
        self.braking.common(self.to_sto)
    }

    /// Those that stand monitored under torque.
    pub const fn standing(&self) -> Places {
        self.standing
    }

    /// Those that brake or stand.
    pub const fn running(&self) -> Places {
        self.braking.with(self.standing)
    }

    /// Nothing runs or stands.
    pub const fn is_idle(&self) -> bool {
        !self.sto & self.running().is_empty()
    }

    /// No stop function brakes: a violation has reached its end state (DEC-15).
    pub const fn is_settled(&self) -> bool {
        self.braking.is_empty()
    }

    /// How far the stop at `place` has come while it brakes.
    pub fn progress(&self, place: u8) -> Option<&Progress> {
        self.instances.get(usize::from(place)).map(|instance| &instance.progress)
    }

    /// The stop function whose end this STO is.
    pub fn ended(&self) -> Option<u8> {
        self.ended.filter(|_| self.sto)
    }

    /// Torque off now. A running SS1 has reached its end by it and is held by its request; a
    /// standing SS2 is aborted, and remembered as long as it is requested (DEC-13).
    pub fn enter_sto(&mut self, now_ns: u64) {
        self.held = self.held.with(self.braking_to_sto()).without(self.standing);
        (self.braking, self.standing) = (Places::NONE, Places::NONE);
        if !self.sto {
            self.sto = true;
            self.sto_since_ns = now_ns;
            self.ended = None;
        }
    }

    /// Requests: what is left, what starts.
    pub fn command(&mut self, demand: Demand, sample: &Sample) {
        let nothing = demand.stops.is_empty() & !(demand.sto | demand.fault);
        if nothing & self.is_idle() {
            self.forget();
            return;
        }
        self.held = self.held.with(self.standing).common(demand.stops);
        self.failed = self.failed.common(demand.stops);
        let was_sto = self.sto;
        self.leave(demand, sample.now_ns);
        if self.is_idle() {
            (self.failed, self.by_error) = (Places::NONE, false);
        }
        if demand.sto | demand.fault {
            self.enter_sto(sample.now_ns);
        }
        self.by_error |= demand.fault;
        self.shut = self.sto;
        // DEC-13: a lower stop requested meanwhile is remembered as long as it is requested.
        let pending = demand.stops.common(self.known).without(self.held.with(self.failed));
        if pending.is_empty() {
            return;
        }
        if was_sto & self.direct_sos & !self.sto {
            pending.without(self.to_sto).into_iter().for_each(|place| self.stand_at(place, sample.position));
        }
        pending.common(self.to_sto).into_iter().for_each(|place| self.start(place, sample));
        pending.without(self.to_sto).into_iter().for_each(|place| self.start(place, sample));
    }

    /// Nothing runs and nothing is asked for.
    const fn forget(&mut self) {
        (self.held, self.failed, self.by_error) = (Places::NONE, Places::NONE, false);
    }

    /// Starts the stop at `place` unless it or a higher one runs; a higher one aborts the lower
    /// (DEC-13).
    fn start(&mut self, place: u8, sample: &Sample) {
        let to_sto = self.to_sto.has(place);
        let runs = self.running().has(place);
        let outranked = !to_sto & !self.braking_to_sto().is_empty();
        if self.sto | runs | outranked {
            return;
        }
        if to_sto {
            // Aborted, and remembered as long as they are requested.
            self.held = self.held.without(self.standing);
            (self.braking, self.standing) = (self.braking_to_sto(), Places::NONE);
        }
        if let Some(instance) = self.instances.get_mut(usize::from(place)) {
            instance.progress = Progress::begin(sample.now_ns, sample.speed);
            self.braking = self.braking.with(Places::of(place));
        }
    }

    fn stand_at(&mut self, place: u8, position: i64) {
        if let Some(instance) = self.instances.get_mut(usize::from(place)) {
            instance.stood_at = position;
            self.braking = self.braking.without(Places::of(place));
            self.standing = self.standing.with(Places::of(place));
        }
    }

    /// Starts what a violation asks for; `true` when a stop brakes that did not.
    pub fn react(&mut self, reaction: Reaction, sample: &Sample) -> bool {
        let before = self.braking;
        self.by_error |= !matches!(reaction, Reaction::None);
        match reaction {
            Reaction::None => {}
            Reaction::Stop(place) if self.known.has(place) => self.start(place, sample),
            // A reaction that does not exist is torque off.
            Reaction::Sto | Reaction::Stop(_) => self.enter_sto(sample.now_ns),
        }
        !self.braking.without(before).is_empty()
    }
}
