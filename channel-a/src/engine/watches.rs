//! The watches of an axis. Held windows stand still: what all of them permit together is worked
//! out once and judged as one, and only what an instant can move by itself is stepped by it.
//! Anything else walks the whole table, which alone decides.

use super::places::Places;
use super::watch::{Basis, Outlook, Plan, Violation, Watch};
use super::{Range, Sample};
use shm_schema::word::Word;

/// Instances one axis can have.
pub const WATCHES: usize = 48;

/// What all held windows permit.
#[derive(Debug, Clone, Copy)]
struct Common {
    speed: Range,
    position: Range,
    acceleration: Range,
    torque: Range,
}

impl Common {
    const ALL: Self =
        Self { speed: Range::ALL, position: Range::ALL, acceleration: Range::ALL, torque: Range::ALL };

    const fn narrow(&mut self, basis: Basis, range: Range) {
        let own = match basis {
            Basis::Speed => &mut self.speed,
            Basis::Position => &mut self.position,
            Basis::Acceleration => &mut self.acceleration,
            Basis::Torque => &mut self.torque,
        };
        *own = own.common(range);
    }

    const fn has(&self, sample: &Sample) -> bool {
        self.speed.has(sample.speed)
            & self.position.has(sample.position)
            & self.acceleration.has(sample.acceleration)
            & self.torque.has(sample.torque)
    }
}

/// What the table looks like, until one of its states changes.
#[derive(Debug, Clone, Copy)]
struct Survey {
    common: Common,
    /// Those that any instant can move: on their way, or still without their latch.
    restless: Places,
    /// Those whose latch moves with the position, and where it does not.
    drifting: Places,
    still: Range,
    violated: Places,
    engaged: u64,
    shown: Word,
}

impl Survey {
    const EMPTY: Self = Self {
        common: Common::ALL,
        restless: Places::NONE,
        drifting: Places::NONE,
        still: Range::ALL,
        violated: Places::NONE,
        engaged: 0,
        shown: Word::ZERO,
    };
}

/// The watches of one axis.
#[derive(Debug, Clone)]
pub struct Watches {
    table: [Watch; WATCHES],
    used: usize,
    /// Of the last step: what was asked for, and whether anything was monitored.
    last: (u64, bool),
    survey: Survey,
    surveyed: bool,
}

impl Watches {
    /// None.
    pub fn new() -> Self {
        Self {
            table: [Watch::default(); WATCHES],
            used: 0,
            last: (0, false),
            survey: Survey::EMPTY,
            surveyed: false,
        }
    }

    /// Adds one instance; `false` when there is no place for it.
    pub fn add(&mut self, plan: Plan) -> bool {
        let Some(place) = self.table.get_mut(self.used) else { return false };
        *place = Watch::new(plan);
        self.used = self.used.saturating_add(1);
        true
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Watch> {
        self.table.iter().take(self.used)
    }

    /// Those that any instant can move: on their way, or still without their latch.
    pub fn restless(&self) -> impl Iterator<Item = &Watch> {
        self.at(self.survey.restless)
    }

    /// Those that were violated and not acknowledged since.
    pub fn violated(&self) -> impl Iterator<Item = &Watch> {
        self.at(self.survey.violated)
    }

    fn at(&self, places: Places) -> impl Iterator<Item = &Watch> {
        places.into_iter().filter_map(|place| self.table.get(usize::from(place)))
    }

    /// Requests of those that are on their way or hold.
    pub const fn engaged(&self) -> u64 {
        self.survey.engaged
    }

    /// Status bits of what is held; a bit with two instances needs both.
    pub const fn shown(&self) -> &Word {
        &self.survey.shown
    }

    /// One instant: `asked` is the mask of requests; without `monitored` all rest (DEC-14).
    pub fn step(
        &mut self,
        asked: u64,
        monitored: bool,
        sample: &Sample,
        found: &mut dyn FnMut(&Plan, Violation),
    ) {
        let same = self.surveyed & (self.last == (asked, monitored));
        let calm = same & self.survey.common.has(sample);
        if !calm {
            self.last = (asked, monitored);
            return self.walk(sample, found);
        }
        let Survey { still, restless, drifting, .. } = self.survey;
        let due = if still.has(sample.position) { restless } else { restless.with(drifting) };
        if !due.is_empty() {
            self.step_due(due, sample, found);
        }
    }

    /// All begin anew with the next instant: STO is left, however short it was (DEC-14).
    pub fn restart(&mut self) {
        self.table.iter_mut().take(self.used).for_each(Watch::rest);
        self.surveyed = false;
    }

    fn walk(&mut self, sample: &Sample, found: &mut dyn FnMut(&Plan, Violation)) {
        let (asked, monitored) = self.last;
        for watch in self.table.iter_mut().take(self.used) {
            if !(monitored & watch.is_asked(asked)) {
                watch.rest();
            } else if let Some(violation) = watch.step(sample) {
                found(&watch.plan, violation);
            }
        }
        self.look_round();
    }

    fn step_due(&mut self, due: Places, sample: &Sample, found: &mut dyn FnMut(&Plan, Violation)) {
        let mut changed = false;
        for place in due {
            let Some(watch) = self.table.get_mut(usize::from(place)) else { continue };
            let before = watch.face();
            let violation = watch.step(sample);
            changed |= violation.is_some() | (before != watch.face());
            if let Some(violation) = violation {
                found(&watch.plan, violation);
            }
        }
        if changed {
            return self.look_round();
        }
        let stills = self.at(self.survey.drifting).map(|watch| match watch.outlook() {
            Outlook::Drift(range) => range,
            _ => Range::ALL,
        });
        self.survey.still = stills.fold(Range::ALL, Range::common);
    }

    fn look_round(&mut self) {
        let mut survey = Survey::EMPTY;
        let mut broken = Word::ZERO;
        for (place, watch) in (0..).zip(self.table.iter().take(self.used)) {
            match watch.outlook() {
                Outlook::None => {}
                Outlook::Any => survey.restless = survey.restless.with(Places::of(place)),
                Outlook::Outside(basis, range) => survey.common.narrow(basis, range),
                Outlook::Drift(range) => {
                    survey.drifting = survey.drifting.with(Places::of(place));
                    survey.still = survey.still.common(range);
                }
            }
            survey.violated = survey.violated.with(Places::when(watch.violated(), place));
            if let Some(bit) = watch.plan.request.filter(|_| watch.engaged()) {
                survey.engaged |= 1_u64.wrapping_shl(u32::from(bit));
            }
            match watch.plan.status {
                Some(bit) if watch.active() => survey.shown = survey.shown.with(bit, true),
                Some(bit) if watch.engaged() | watch.violated() => broken = broken.with(bit, true),
                _ => {}
            }
        }
        for (shown, broken) in survey.shown.0.iter_mut().zip(broken.0) {
            *shown &= !broken;
        }
        self.survey = survey;
        self.surveyed = true;
    }

    /// What still stands of violations that started nothing (DEC-15).
    pub fn look_again(&mut self, asked: u64, sample: &Sample, found: &mut dyn FnMut(&Plan, Violation)) {
        for watch in self.table.iter_mut().take(self.used).filter(|watch| watch.is_asked(asked)) {
            if let Some(violation) = watch.stands(sample) {
                found(&watch.plan, violation);
            }
        }
        self.surveyed = false;
    }

    /// An acknowledgement was accepted; `settled`: every reaction has reached its end state.
    pub fn acknowledge(&mut self, settled: bool) {
        self.table.iter_mut().for_each(|watch| watch.acknowledge(settled));
        self.surveyed = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::approach::{Approach, Slope};
    use crate::engine::stop::Reaction;
    use crate::engine::watch::Quantity;
    use std::vec::Vec;

    fn table() -> Vec<Plan> {
        let quantities = [
            Quantity::Speed,
            Quantity::Position,
            Quantity::Travel,
            Quantity::TravelFromZero(20),
            Quantity::TravelBackFromZero(20),
            Quantity::TravelForthFromZero(20),
            Quantity::SpeedFromZero(20),
            Quantity::TravelFromHighest,
            Quantity::TravelFromLowest,
            Quantity::Acceleration,
            Quantity::Torque,
        ];
        let ramp = Approach {
            slope: Slope { rise: 50, run_ns: 10 },
            window: Range::symmetric(80),
            delay_ns: 5,
            ..Approach::default()
        };
        let plan = |(at, quantity): (usize, Quantity)| Plan {
            quantity,
            approach: if at.is_multiple_of(3) { ramp } else { Approach::default() },
            window: Range { lower: -10 - at as i64, upper: 40 - at as i64 },
            request: (at != 1).then_some(at as u8),
            status: Some(at as u8 / 2),
            reaction: if at.is_multiple_of(4) { Reaction::None } else { Reaction::Sto },
            ..Plan::default()
        };
        let twice = quantities.into_iter().chain(quantities);
        twice.enumerate().map(plan).collect()
    }

    /// Status bits of what is held, where every instance of the bit is.
    fn shown(watches: &[Watch]) -> Word {
        let held = watches.iter().filter(|watch| watch.active()).filter_map(|watch| watch.plan.status);
        let all = held.fold(Word::ZERO, |word, bit| word.with(bit, true));
        let broken = watches.iter().filter(|watch| !watch.active() & (watch.engaged() | watch.violated()));
        broken.filter_map(|watch| watch.plan.status).fold(all, |word, bit| word.with(bit, false))
    }

    #[test]
    fn what_is_judged_together_is_what_each_would_say_by_itself() {
        let mut random = 0x9E37_79B9_u64;
        let mut next = |below: u64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) % below
        };
        let (mut watches, mut alone) = (Watches::new(), Vec::new());
        for plan in table() {
            assert!(watches.add(plan));
            alone.push(Watch::new(plan));
        }
        let (mut asked, mut monitored, mut violations) = (0, true, 0);
        let mut sample = Sample::default();
        for step in 0..200_000 {
            asked = if next(500) == 0 { next(1 << 22) | next(1 << 22) } else { asked };
            monitored = if next(2_000) == 0 { !monitored } else { monitored };
            let mut walk = |value: i64, reach: i64| (value + next(7) as i64 - 3).clamp(-reach, reach);
            sample.position = walk(sample.position, 200);
            sample.speed = walk(sample.speed, 120);
            sample.acceleration = walk(sample.acceleration, 100);
            sample.torque = walk(sample.torque, 100);
            sample.now_ns = step;
            if next(300) == 0 {
                let settled = next(2) == 0;
                watches.acknowledge(settled);
                alone.iter_mut().for_each(|watch| watch.acknowledge(settled));
            }
            let (mut together, mut each) = (Vec::new(), Vec::new());
            watches.step(asked, monitored, &sample, &mut |plan, found| together.push((plan.window, found)));
            for watch in &mut alone {
                if !(monitored & watch.is_asked(asked)) {
                    watch.rest();
                } else if let Some(found) = watch.step(&sample) {
                    each.push((watch.plan.window, found));
                }
            }
            assert_eq!(together, each, "{step}");
            assert_eq!(*watches.shown(), shown(&alone), "{step}");
            violations += each.len();
        }
        assert!(violations > 1_000, "{violations}");
    }
}
