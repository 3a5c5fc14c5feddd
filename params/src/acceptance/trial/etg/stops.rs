//! STO, SS1, SS2 and SBC.

use super::{Etg, Instance, Probe, RAMP, REQUEST_MS, Reaction, Trial, WINDOW};
use crate::acceptance::trial::BRAKE_OPEN;

/// Slope, 1/min a second, and delay of a stop that is monitored while it brakes.
struct Line {
    delay_ms: f64,
    slope: f64,
}

impl Etg<'_> {
    pub(super) fn torque_off(&self) -> Vec<Trial> {
        let Some(bit) = self.request("STO") else { return Vec::new() };
        let mut step = self.start("STO", format!("request at {:.0} rpm", self.top), self.top);
        self.ask(&mut step, bit);
        step.quiet(REQUEST_MS);
        step.expect("torque off", REQUEST_MS, REQUEST_MS + 2.0, Probe::TorqueOff);
        step.trial.course.speed(REQUEST_MS + 20.0, self.top);
        self.settle(&mut step, REQUEST_MS + 20.0, self.top);
        vec![step.trial]
    }

    /// SS1 that brakes as it should, and one that does not.
    pub(super) fn stop_1(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let time = self.time(of, "time_to_sto");
        let top = if time > 20.0 { self.top } else { 0.0 };
        let mut step = self.start(of.name, format!("request at {top:.0} rpm, brake"), top);
        self.ask(&mut step, bit);
        let braked = self.braking_ms(of.name, time, top);
        step.trial.course.speed(REQUEST_MS, top).speed(REQUEST_MS + braked, 0.0);
        step.quiet(REQUEST_MS);
        // Standstill or its line may end it before its time, never later.
        step.expect("torque off", REQUEST_MS, REQUEST_MS + time + 3.0, Probe::TorqueOff);
        self.release(&mut step, REQUEST_MS + time + braked + 100.0 + self.longest());
        let flat = self.flat(of, bit, &Reaction::Sto, RAMP);
        [step.trial].into_iter().chain(flat).collect()
    }

    pub(super) fn stop_2(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let time = self.time(of, "time_to_sos");
        let top = if time > 20.0 { self.top } else { 0.0 };
        let mut step = self.start(of.name, format!("request at {top:.0} rpm, brake and hold"), top);
        self.ask(&mut step, bit);
        let braked = self.braking_ms(of.name, time, top);
        step.trial.course.speed(REQUEST_MS, top).speed(REQUEST_MS + braked, 0.0);
        let end = REQUEST_MS + time + 3.0;
        step.quiet(end + 50.0);
        if let Some(bit) = self.status(&format!("SOS_{}", of.number)) {
            step.expect(
                format!("SOS_{} (status bit {bit}), torque stays on", of.number),
                REQUEST_MS,
                end,
                Probe::Bit(bit, true),
            );
        }
        self.release(&mut step, end + braked + 100.0 + self.longest());
        let flat = self.flat(of, bit, &self.reaction(of), WINDOW);
        [step.trial].into_iter().chain(flat).collect()
    }

    fn line(&self, of: Instance<'_>) -> Option<Line> {
        let slope = self.value(of.function, of.number, "deceleration_limit").filter(|slope| *slope > 0.0)?;
        Some(Line { delay_ms: self.time(of, "time_delay_deceleration_monitoring"), slope })
    }

    /// A drive that does not brake leaves the line as soon as it falls (DEC-03).
    fn flat(&self, of: Instance<'_>, bit: u8, reaction: &Reaction, row: u32) -> Option<Trial> {
        let line = self.line(of)?;
        let mut step = self.start(of.name, "request, and do not brake".into(), self.top);
        self.ask(&mut step, bit);
        let seen = REQUEST_MS + line.delay_ms + (1.0 / line.slope).max(1.0).ceil();
        step.quiet(seen - 1.0);
        let code = (of.reference << 8 | row).to_string();
        let window = (seen - 1.0, seen + 1.0);
        step.expect(format!("code {code}, both channels"), window.0, window.1, Probe::Code(code));
        self.follows(&mut step, window, reaction);
        step.trial.course.speed(seen + 5.0, self.top);
        self.brake_and_settle(&mut step, seen + 5.0, self.top, reaction);
        Some(step.trial)
    }

    /// ETG-SBC-01, ETG-SBC-02: closed by STO, and by its own bit where it has one.
    pub(super) fn brake(&self, of: Instance<'_>, bit: Option<u8>) -> Vec<Trial> {
        let by = [self.request("STO").map(|bit| ("STO", bit)), bit.map(|bit| (of.name, bit))];
        let status = self.status(of.name);
        let of_request = |(name, bit): (&str, u8)| {
            let mut step = self.start(of.name, format!("request {name} at standstill"), 0.0);
            self.ask(&mut step, bit);
            let window = (REQUEST_MS, REQUEST_MS + 2.0);
            step.expect("the brake is to close", window.0, window.1, Probe::Output(BRAKE_OPEN, false));
            if let Some(bit) = status {
                let what = format!("brake closed (status bit {bit} is 0)");
                step.expect(what, window.0, window.1, Probe::Bit(bit, false));
            }
            self.settle(&mut step, REQUEST_MS + 50.0, 0.0);
            step.trial
        };
        by.into_iter().flatten().map(of_request).collect()
    }
}
