//! What supervises the functions themselves, in every profile alike.

use super::{Probe, REQUEST_MS, Step, Trial};

/// A sample is stale in the third cycle without a new one (docs/architecture.md, Freshness).
const STALE_MS: f64 = 2.0;

/// Name of the step that takes the encoder away.
pub(crate) const ENCODER: &str = "encoder";
/// Name of the step in which the two channels see different positions.
pub(crate) const CROSS_CHECK: &str = "cross-check";

/// How a profile begins a step at standstill, and how it ends one.
pub(super) trait Manners {
    /// Standstill with nothing requested.
    fn begin(&self, function: &str, action: String, source: &str) -> Step;
    /// Still, released, acknowledged.
    fn finish(&self, step: &mut Step, from_ms: f64);
    /// Largest difference of the two positions, increments.
    fn position_difference(&self) -> f64;
}

pub(super) fn trials(manners: &impl Manners) -> [Trial; 2] {
    [encoder(manners), cross_check(manners)]
}

/// Design 8: no new sample is STO after three producer periods.
fn encoder(manners: &impl Manners) -> Trial {
    let mut step = manners.begin(ENCODER, "no new encoder sample for 20 ms".into(), "design 8");
    step.trial.course.set(0.0, "fault", "none").set(REQUEST_MS, "fault", "stale-encoder");
    step.trial.course.set(REQUEST_MS + 20.0, "fault", "none");
    let seen = REQUEST_MS + STALE_MS;
    step.quiet(REQUEST_MS + 1.0);
    step.violation(seen, "", super::Reaction::Sto);
    manners.finish(&mut step, REQUEST_MS + 30.0);
    step.trial
}

/// DEC-22: a difference of the positions is tolerated for one exchange at most.
fn cross_check(manners: &impl Manners) -> Trial {
    let limit = manners.position_difference();
    let mut step = manners.begin(
        CROSS_CHECK,
        format!("let channel B's encoder differ by more than {limit:.0} increments"),
        "DEC-22",
    );
    let column = "enc2_pos_offset_incr";
    step.trial.course.set(0.0, column, 0).set(REQUEST_MS, column, 0);
    step.trial.course.set(REQUEST_MS + 1.0, column, limit + 10.0);
    step.trial.course.set(REQUEST_MS + 20.0, column, limit + 10.0).set(REQUEST_MS + 21.0, column, 0);
    step.quiet(REQUEST_MS + 1.0);
    step.expect("a code", REQUEST_MS + 1.0, REQUEST_MS + 2.0, Probe::Combined(String::new()));
    step.expect("torque off", REQUEST_MS + 1.0, REQUEST_MS + 2.0, Probe::TorqueOff);
    manners.finish(&mut step, REQUEST_MS + 40.0);
    step.trial
}
