//! One instant of what runs or stands.

use super::{Instance, Part, Places, Reaction, Sample, Stops, Violation};
use crate::engine::approach::Stage;

impl Stops {
    /// Judges all that runs or stands by this instant, whatever the first of them leads to.
    pub fn advance(&mut self, sample: &Sample, found: &mut dyn FnMut(Violation)) {
        let (standing, braking) = (self.standing, self.braking);
        standing.into_iter().for_each(|place| self.stand(place, sample, found));
        braking.into_iter().for_each(|place| self.brake(place, sample, found));
        // DEC-02: one that begins in this instant is in force in it; what it leads to follows from
        // what this instant showed.
        let shut = self.shut;
        let begun = self.braking.without(braking);
        begun.into_iter().for_each(|place| self.brake(place, sample, found));
        self.shut = shut;
    }

    fn brake(&mut self, place: u8, sample: &Sample, found: &mut dyn FnMut(Violation)) {
        let Some(instance) = self.instances.get_mut(usize::from(place)) else { return };
        let plan = &instance.plan;
        let stage = instance.progress.step(&plan.approach, sample.now_ns, sample.speed);
        let outside = plan.approach.window.left_by(sample.speed).filter(|_| plan.judged_at_end);
        let (part, side) = match (stage, outside) {
            (Stage::Under, _) => return,
            (Stage::Arrived, None) => return self.arrive(place, sample, found),
            (Stage::Arrived, Some(side)) => (Part::End, side),
            (Stage::Violated(side), _) => (Part::Ramp, side),
        };
        let (function, reaction) = (plan.function, plan.reaction);
        found(Violation { function, part, side, position: false, reaction });
        if reaction == Reaction::None {
            // ETG-ERR-02: it brakes on, and is judged again.
            return;
        }
        // DEC-14: an SS1 is over, on its line or beside it: nothing is judged beside its end.
        self.shut |= self.to_sto.has(place);
        self.fail(place, reaction, sample);
    }

    /// What this instant still violates without any reaction (DEC-15).
    pub fn look_again(&mut self, sample: &Sample, found: &mut dyn FnMut(Violation)) {
        for place in self.braking {
            let Some(Instance { plan, progress, .. }) = self.instances.get_mut(usize::from(place)) else {
                continue;
            };
            let goes_on = plan.reaction == Reaction::None;
            if let (true, Stage::Violated(side)) =
                (goes_on, progress.step(&plan.approach, sample.now_ns, sample.speed))
            {
                let (function, reaction) = (plan.function, plan.reaction);
                found(Violation { function, part: Part::Ramp, side, position: false, reaction });
            }
        }
    }

    fn arrive(&mut self, place: u8, sample: &Sample, found: &mut dyn FnMut(Violation)) {
        if !self.braking.has(place) {
            // Another one has ended it in this instant.
            return;
        }
        if self.to_sto.has(place) {
            self.enter_sto(sample.now_ns);
            (self.ended, self.shut) = (Some(place), true);
            return;
        }
        self.stand_at(place, sample.position);
        self.stand(place, sample, found);
    }

    /// A stop that failed leaves no torque without another stop.
    fn fail(&mut self, place: u8, reaction: Reaction, sample: &Sample) {
        match reaction {
            Reaction::Stop(other) if other != place => {
                self.braking = self.braking.without(Places::of(place));
                self.failed = self.failed.with(Places::of(place));
                self.react(reaction, sample);
            }
            _ => {
                self.react(Reaction::Sto, sample);
            }
        }
    }

    fn stand(&mut self, place: u8, sample: &Sample, found: &mut dyn FnMut(Violation)) {
        let Some(instance) = self.instances.get(usize::from(place)) else { return };
        let plan = &instance.plan;
        let function = plan.stand_function;
        let travel = sample.position.saturating_sub(instance.stood_at);
        let left =
            [(plan.stand_speed.left_by(sample.speed), false), (plan.stand_position.left_by(travel), true)];
        for (side, position) in left {
            if let Some(side) = side {
                found(Violation { function, part: Part::Window, side, position, reaction: Reaction::Sto });
                self.react(Reaction::Sto, sample);
            }
        }
    }
}
