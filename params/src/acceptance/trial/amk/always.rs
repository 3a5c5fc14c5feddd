//! SEM: the standstill supervision of sine encoders, which cannot be switched off.

use super::{Amk, Probe, Trial, supervision::Manners as _};

/// A minute, ms.
const MINUTE_MS: f64 = 60_000.0;
/// Longest standstill that a run goes through: hours of virtual time are seconds of real time,
/// weeks are not.
pub(crate) const LONGEST_MIN: f64 = 240.0;
/// Encoder type of each channel, and Info1 of its messages.
const ENCODERS: [(u32, u8); 2] = [(4, 38), (5, 39)];

impl Amk<'_> {
    /// AMK-SEM-04 to AMK-SEM-07: warning after Prm9, error and SS1 after Prm9 + Prm10.
    pub(super) fn standstill_supervision(&self) -> Option<Trial> {
        let sine: Vec<_> = ENCODERS.into_iter().filter(|(kind, _)| self.axis.value(*kind) == 1).collect();
        let minutes = [self.value(9), self.value(9) + self.value(10)];
        if sine.is_empty() || minutes[1] > LONGEST_MIN {
            return None;
        }
        let action = format!("stand still for {:.0} minutes", minutes[1]);
        let mut step = self.begin("SEM", action, "AMK-SEM-04, AMK-SEM-07");
        let [warned, failed] = minutes.map(|minutes| minutes * MINUTE_MS);
        for (_, info1) in &sine {
            let code = format!("3610/{info1}/3");
            let near = (warned - 2.0, warned + 2.0);
            step.expect(format!("warning {code}"), near.0, near.1, Probe::Combined(code));
        }
        for (_, info1) in &sine {
            let code = format!("3606/{info1}/4");
            let near = (failed - 2.0, failed + 2.0);
            step.expect(format!("error {code}"), near.0, near.1, Probe::Combined(code));
        }
        let stop = self.stop_ms();
        step.expect("SS1, then torque off", failed - 2.0, failed + stop, Probe::TorqueOff);
        // Movement alone ends it (AMK-SEM-09): out and back by more than a period of the encoder.
        let moved = failed + stop + 100.0;
        step.trial.course.speed(moved, 0.0).speed(moved + 50.0, 60.0).speed(moved + 150.0, 60.0);
        step.trial.course.speed(moved + 200.0, 0.0);
        self.finish(&mut step, moved + 250.0);
        Some(step.trial)
    }
}
