//! Stop functions: started by the edge into request, run to their end, held by the level,
//! ordered STO over SS1 over SS2 (DEC-11 to DEC-13).

use super::approach::{Approach, Progress, Stage};
use super::watch::Part;
use super::{Range, Sample, Side};

/// Stop functions besides STO that one profile can have.
pub const STOPS: usize = 6;

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
    /// Bit n: the stop function at place n is requested.
    pub stops: u8,
    /// An error stands that keeps the reached stop.
    pub blocked: bool,
    /// A restart acknowledge edge.
    pub restart: bool,
    /// The running or standing stop is cancelled at once (enable switch).
    pub release: bool,
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
}

/// What runs or stands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Active {
    /// Nothing.
    #[default]
    None,
    /// Torque off.
    Sto,
    /// The stop at this place brakes.
    Braking(u8, Progress),
    /// The stop at this place stands around this position.
    Standing(u8, i64),
}

/// The stop functions of one axis.
#[derive(Debug, Clone, Copy, Default)]
pub struct Stops {
    plans: [Option<Plan>; STOPS],
    active: Active,
    /// Further SS1 requested while one brakes: each by its own time (ETG-GEN-12); the first that
    /// ends, ends all.
    beside: [Option<Progress>; STOPS],
    held: u8,
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

const fn bit(place: u8) -> u8 {
    1 << (place & 7)
}

impl Stops {
    /// Puts `plan` at `place`.
    pub fn set(&mut self, place: u8, plan: Plan) {
        if let Some(entry) = self.plans.get_mut(usize::from(place)) {
            *entry = Some(plan);
        }
    }

    /// The plan at `place`.
    pub fn plan(&self, place: u8) -> Option<&Plan> {
        self.plans.get(usize::from(place)).and_then(Option::as_ref)
    }

    /// What runs or stands.
    pub const fn active(&self) -> Active {
        self.active
    }

    /// Torque is off.
    pub fn is_sto(&self) -> bool {
        self.active == Active::Sto
    }

    /// The stop function whose end this STO is.
    pub fn ended(&self) -> Option<u8> {
        self.ended.filter(|_| self.is_sto())
    }

    /// No stop function brakes: a violation has reached its end state (DEC-15).
    pub fn is_settled(&self) -> bool {
        !matches!(self.active, Active::Braking(..))
    }

    fn rank_of(&self, place: u8) -> u8 {
        self.plan(place).map_or(0, |plan| if plan.end == End::Sto { 2 } else { 1 })
    }

    fn rank(&self) -> u8 {
        match self.active {
            Active::None => 0,
            Active::Braking(place, _) | Active::Standing(place, _) => self.rank_of(place),
            Active::Sto => 3,
        }
    }

    /// Torque off now. A running SS1 has reached its end by it and is held by its request.
    pub fn enter_sto(&mut self, now_ns: u64) {
        if let Active::Braking(place, _) = self.active {
            let ends_here = self.rank_of(place) == 2;
            self.held |= if ends_here { bit(place) } else { 0 };
        }
        if let Active::Standing(place, _) = self.active {
            // DEC-13: aborted, and remembered as long as it is requested.
            self.held &= !bit(place);
        }
        for (place, further) in (0..).zip(&self.beside) {
            self.held |= if further.is_some() { bit(place) } else { 0 };
        }
        self.beside = [None; STOPS];
        if !self.is_sto() {
            self.sto_since_ns = now_ns;
            self.ended = None;
        }
        self.active = Active::Sto;
    }

    /// Requests: what is left, what starts.
    pub fn command(&mut self, demand: Demand, sample: &Sample) {
        if let Active::Standing(place, _) = self.active {
            self.held |= bit(place);
        }
        self.held &= demand.stops;
        let was_sto = self.is_sto();
        self.leave(demand, sample.now_ns);
        if demand.sto {
            self.enter_sto(sample.now_ns);
        }
        let left_sto = was_sto & (self.active == Active::None);
        if left_sto & self.direct_sos {
            self.stand_at_once(demand.stops & !self.held, sample.position);
        }
        // DEC-13: a lower stop requested meanwhile is remembered as long as it is requested.
        let pending = demand.stops & !self.held;
        if pending == 0 {
            return;
        }
        for end in [2, 1] {
            for place in 0..STOPS as u8 {
                let asked = pending & bit(place) != 0;
                if asked & (self.rank_of(place) == end) {
                    self.start(place, sample);
                }
            }
        }
    }

    fn stand_at_once(&mut self, pending: u8, position: i64) {
        let sos = (0..STOPS as u8).find(|place| (pending & bit(*place) != 0) & (self.rank_of(*place) == 1));
        if let Some(place) = sos {
            self.active = Active::Standing(place, position);
        }
    }

    fn leave(&mut self, demand: Demand, now_ns: u64) {
        let cancelled = demand.release & !(demand.sto | demand.blocked);
        if cancelled {
            self.active = Active::None;
            self.beside = [None; STOPS];
            self.restart_pending = false;
            return;
        }
        let (kept, restart) = match self.active {
            Active::Sto => {
                let young = now_ns.saturating_sub(self.sto_since_ns) < self.sto_least_ns;
                let short = young & self.ended.is_some();
                let ended = self.held_to_sto();
                (demand.sto | short | ended, self.restart)
            }
            Active::Standing(place, _) => {
                let plan = self.plan(place);
                (self.held & bit(place) != 0, plan.is_some_and(|plan| plan.restart))
            }
            Active::None | Active::Braking(..) => return self.restart_pending = false,
        };
        let free = !(kept | demand.blocked);
        let restart = restart | self.restart_once;
        let acknowledged = !restart | demand.restart;
        if free & acknowledged {
            self.active = Active::None;
            self.restart_pending = false;
            self.restart_once = false;
        }
    }

    /// After everything of this instant: whether a restart acknowledge is all that is missing.
    pub fn note_pending(&mut self, demand: &Demand, now_ns: u64) {
        let held = self.held & demand.stops;
        let (kept, restart) = match self.active {
            Active::Sto => {
                let young = now_ns.saturating_sub(self.sto_since_ns) < self.sto_least_ns;
                let short = young & self.ended.is_some();
                (demand.sto | short | self.any_to_sto(held), self.restart)
            }
            Active::Standing(place, _) => {
                let restart = self.plan(place).is_some_and(|plan| plan.restart);
                (demand.stops & bit(place) != 0, restart)
            }
            Active::None | Active::Braking(..) => (true, false),
        };
        let free = !(kept | demand.blocked);
        self.restart_pending = free & (restart | self.restart_once);
    }

    fn held_to_sto(&self) -> bool {
        self.any_to_sto(self.held)
    }

    fn any_to_sto(&self, held: u8) -> bool {
        (held != 0) && (0..STOPS as u8).any(|place| (held & bit(place) != 0) & (self.rank_of(place) == 2))
    }

    /// Starts the stop at `place` unless something as high runs (DEC-13); a further SS1 runs
    /// beside the one that does.
    pub fn start(&mut self, place: u8, sample: &Sample) {
        let further = match self.active {
            Active::Braking(other, _) if other != place => {
                (self.rank_of(other), self.rank_of(place)) == (2, 2)
            }
            _ => false,
        };
        if let (true, Some(entry)) = (further, self.beside.get_mut(usize::from(place))) {
            entry.get_or_insert(Progress::begin(sample.now_ns, sample.speed));
            return;
        }
        if self.rank_of(place) > self.rank() {
            if let Active::Standing(aborted, _) = self.active {
                // DEC-13: aborted, and remembered as long as it is requested.
                self.held &= !bit(aborted);
            }
            self.active = Active::Braking(place, Progress::begin(sample.now_ns, sample.speed));
        }
    }

    /// Starts what a violation asks for.
    pub fn react(&mut self, reaction: Reaction, sample: &Sample) {
        match reaction {
            Reaction::None => {}
            Reaction::Stop(place) if self.plan(place).is_some() => self.start(place, sample),
            // A reaction that does not exist is torque off.
            Reaction::Sto | Reaction::Stop(_) => self.enter_sto(sample.now_ns),
        }
    }

    /// One instant of what runs or stands; what it violates.
    pub fn advance(&mut self, sample: &Sample) -> [Option<Violation>; 2] {
        match self.active {
            Active::None | Active::Sto => [None; 2],
            Active::Braking(place, progress) => {
                let Some(plan) = self.plan(place).copied() else {
                    self.enter_sto(sample.now_ns);
                    return [None; 2];
                };
                let found = self.brake(place, progress, &plan, sample);
                self.brake_beside(found, sample)
            }
            Active::Standing(place, position) => {
                let plan = self.plan(place).copied().unwrap_or_default();
                self.stand(&plan, position, sample)
            }
        }
    }

    fn brake(
        &mut self,
        place: u8,
        mut progress: Progress,
        plan: &Plan,
        sample: &Sample,
    ) -> [Option<Violation>; 2] {
        let left = |part, side| Some(Violation { function: plan.function, part, side, position: false });
        match progress.step(&plan.approach, sample.now_ns, sample.speed) {
            Stage::Under => {
                self.active = Active::Braking(place, progress);
                [None; 2]
            }
            Stage::Violated(side) => {
                self.fail(plan.reaction, sample);
                [left(Part::Ramp, side), None]
            }
            Stage::Arrived => {
                let outside = plan.approach.window.left_by(sample.speed).filter(|_| plan.judged_at_end);
                if let Some(side) = outside {
                    self.fail(plan.reaction, sample);
                    return [left(Part::End, side), None];
                }
                if plan.end == End::Sto {
                    self.enter_sto(sample.now_ns);
                    self.ended = Some(place);
                    return [None; 2];
                }
                self.active = Active::Standing(place, sample.position);
                self.stand(plan, sample.position, sample)
            }
        }
    }

    /// The further SS1, each within its own limits; nothing of them is left when no stop brakes.
    fn brake_beside(&mut self, mut found: [Option<Violation>; 2], sample: &Sample) -> [Option<Violation>; 2] {
        for place in 0..STOPS as u8 {
            if !matches!(self.active, Active::Braking(..)) {
                self.beside = [None; STOPS];
                return found;
            }
            let entry = self.beside.get(usize::from(place)).copied().flatten();
            let Some((mut progress, plan)) = entry.zip(self.plan(place).copied()) else { continue };
            let stage = progress.step(&plan.approach, sample.now_ns, sample.speed);
            if let Some(entry) = self.beside.get_mut(usize::from(place)) {
                *entry = Some(progress);
            }
            let outside = plan.approach.window.left_by(sample.speed).filter(|_| plan.judged_at_end);
            let left = match (stage, outside) {
                (Stage::Under, _) => continue,
                (Stage::Violated(side), _) => Some((Part::Ramp, side)),
                (Stage::Arrived, Some(side)) => Some((Part::End, side)),
                (Stage::Arrived, None) => None,
            };
            self.enter_sto(sample.now_ns);
            if let Some((part, side)) = left {
                let violation = Violation { function: plan.function, part, side, position: false };
                let room = if found[0].is_none() { &mut found[0] } else { &mut found[1] };
                *room = Some(violation);
            } else {
                self.ended = Some(place);
            }
        }
        found
    }

    fn fail(&mut self, reaction: Reaction, sample: &Sample) {
        if reaction == Reaction::Sto {
            return self.enter_sto(sample.now_ns);
        }
        self.active = Active::None;
        self.react(reaction, sample);
        if self.active == Active::None {
            // A stop that failed leaves no torque without another stop.
            self.enter_sto(sample.now_ns);
        }
    }

    fn stand(&mut self, plan: &Plan, position: i64, sample: &Sample) -> [Option<Violation>; 2] {
        let travel = sample.position.saturating_sub(position);
        let violation =
            |side, position| Violation { function: plan.stand_function, part: Part::Window, side, position };
        let found = [
            plan.stand_speed.left_by(sample.speed).map(|side| violation(side, false)),
            plan.stand_position.left_by(travel).map(|side| violation(side, true)),
        ];
        if found.iter().any(Option::is_some) {
            self.enter_sto(sample.now_ns);
        }
        found
    }
}
