//! A failing life made small, and written as a trace.

use std::fmt::Write as _;

use params::AxisSet;

use super::{Broken, Life, Moment, Plan, live};
use crate::trace::{Fault, Faults};

/// A failing life at its smallest.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// What is left of it.
    pub plan: Plan,
    /// Cycle in which it fails.
    pub cycle: u64,
    /// How it fails.
    pub broken: Broken,
}

/// Takes events out of a failing life as long as it fails in the same way. `None`: it does
/// not fail.
pub fn smallest(set: &AxisSet, plan: &Plan) -> Option<Failure> {
    let mut best = failure(set, plan.clone())?;
    let mut chunk = best.plan.events.len().max(1);
    while chunk > 0 {
        let mut from = 0;
        while from < best.plan.events.len() {
            match without(set, &best, from, chunk) {
                Some(smaller) => best = smaller,
                None => from += chunk,
            }
        }
        chunk /= 2;
    }
    Some(best)
}

fn without(set: &AxisSet, best: &Failure, from: usize, count: usize) -> Option<Failure> {
    let mut plan = best.plan.clone();
    let end = (from + count).min(plan.events.len());
    plan.events.drain(from..end);
    failure(set, plan).filter(|smaller| smaller.broken == best.broken)
}

/// The life cut behind the cycle in which it fails.
fn failure(set: &AxisSet, mut plan: Plan) -> Option<Failure> {
    let (cycle, broken) = live(set, &plan).broken?;
    plan.cycles = cycle + 1;
    plan.events.retain(|event| event.cycle <= cycle);
    Some(Failure { plan, cycle, broken })
}

/// The life as a trace for `replay`: the motion it had, and the steps as they came.
pub fn trace_csv(set: &AxisSet, plan: &Plan) -> String {
    let mut text = String::from(
        "t_ms,axis,speed_rpm,torque_pct,command,se1,se2,se3,se4,ais,aie,clear_error,drive_n0,drive_enabled,fault\n",
    );
    let mut life = Life::new(set, plan.seed);
    let mut events = plan.events.iter().peekable();
    for cycle in 0..plan.cycles {
        while let Some(event) = events.next_if(|event| event.cycle <= cycle) {
            life.act(&event.act, cycle);
        }
        row(&mut text, set.number, &life.step(cycle));
    }
    text
}

fn row(out: &mut String, axis: u8, moment: &Moment<'_>) {
    let stimulus = moment.stimulus;
    let speed = f64::from(stimulus.motion_a.speed_mrpm) / 1_000.0;
    let torque = f64::from(stimulus.torque_ppm) / 10_000.0;
    let word = stimulus.word.0.iter().rev().fold(String::new(), |text, part| text + &format!("{part:08X}"));
    let pairs =
        stimulus.lines.pairs.map(|(one, two)| format!("{}{}", u8::from(one), u8::from(two))).join(",");
    let acknowledge = [stimulus.lines.ais, stimulus.lines.aie, stimulus.clear_error].map(u8::from);
    let drive = [stimulus.drive_n0, stimulus.drive_enabled].map(u8::from);
    let flags = acknowledge.iter().chain(&drive).map(u8::to_string).collect::<Vec<_>>().join(",");
    let fault = fault_name(stimulus.faults);
    let result =
        writeln!(out, "{},{axis},{speed:.3},{torque:.4},0x{word},{pairs},{flags},{fault}", moment.cycle);
    // Writing into a string does not fail.
    debug_assert!(result.is_ok());
}

fn fault_name(faults: Faults) -> &'static str {
    Fault::ALL.into_iter().find(|fault| faults.has(*fault)).map_or("none", Fault::name)
}
