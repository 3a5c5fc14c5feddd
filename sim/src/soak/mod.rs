//! Lives of an axis in virtual time: drive and motor in closed loop with the three cores,
//! commanded at random from a seed, watched by invariants that hold whatever happens. A
//! life that breaks one is shrunk and written as a trace that `replay` runs.

pub mod campaign;
mod judge;
mod life;
mod plan;
mod shrink;

pub use judge::{Broken, Judge};
pub use life::{Life, Moment};
pub use plan::{Act, Event, Plan};
pub use shrink::{Failure, smallest, trace_csv};

use params::AxisSet;

/// How a life went.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Cycles lived.
    pub cycles: u64,
    /// Falling edges of the combined torque.
    pub trips: u64,
    /// Cycles with torque.
    pub energised: u64,
    /// The first invariant that broke, and in which cycle.
    pub broken: Option<(u64, Broken)>,
}

/// Lives through `plan`; ends at the first broken invariant.
pub fn live(set: &AxisSet, plan: &Plan) -> Outcome {
    let mut life = Life::new(set, plan.seed);
    let mut judge = Judge::default();
    let mut outcome = Outcome::default();
    let mut events = plan.events.iter().peekable();
    let mut had_torque = false;
    for cycle in 0..plan.cycles {
        while let Some(event) = events.next_if(|event| event.cycle <= cycle) {
            life.act(&event.act, cycle);
        }
        let moment = life.step(cycle);
        let torque = moment.views[2].torque;
        outcome.cycles += 1;
        outcome.energised += u64::from(torque);
        outcome.trips += u64::from(had_torque && !torque);
        had_torque = torque;
        if let Some(broken) = judge.look(&moment) {
            outcome.broken = Some((cycle, broken));
            break;
        }
    }
    outcome
}

#[cfg(test)]
mod tests;
