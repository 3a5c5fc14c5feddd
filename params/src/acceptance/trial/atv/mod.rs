//! ATV340: STO, SS1, SLS by its type, SMS by its mode. Frequencies of the set are in tenths
//! of a hertz; the trace is in rpm (DEC-32).

mod sls;

use shm_schema::{
    facts::atv340::{control, status},
    profile::common,
    word::Word,
};

use super::{Probe, REQUEST_MS, Reaction, Step, Trial, supervision};
use crate::set::AxisSet;

struct Atv<'a> {
    axis: &'a AxisSet,
    neutral: Word,
}

pub(super) fn trials(axis: &AxisSet) -> Vec<Trial> {
    let atv = Atv { axis, neutral: Word::from_u32(axis.profile.neutral_word()) };
    let mut trials = vec![atv.sto()];
    if axis.value(65) == 1 {
        trials.push(atv.braked());
        trials.push(atv.flat("SS1", control::SS1));
    }
    if axis.value(66) == 1 {
        trials.extend(atv.limited_speed());
    }
    let first = [("SME0B4", 57, 1.0), ("SME0B5", 58, -1.0)];
    let second = [("SME0B4", 59, 1.0), ("SME0B5", 60, -1.0)];
    // SC56: 1 threshold, 2 thresholds by the bit, or one by the bit (maintenance).
    match axis.value(56) {
        1 => trials.extend(first.map(|(code, key, side)| atv.maximum(code, key, side, false))),
        2 => {
            trials.extend(first.map(|(code, key, side)| atv.maximum(code, key, side, false)));
            trials.extend(second.map(|(code, key, side)| atv.maximum(code, key, side, true)));
        }
        3 => trials.extend(first.map(|(code, key, side)| atv.maximum(code, key, side, true))),
        _ => {}
    }
    trials.extend(supervision::trials(&atv));
    trials
}

impl supervision::Manners for Atv<'_> {
    fn begin(&self, function: &str, action: String, source: &str) -> Step {
        self.start(function, action, source, 0.0)
    }

    fn finish(&self, step: &mut Step, from_ms: f64) {
        self.settle(step, from_ms);
    }

    fn position_difference(&self) -> f64 {
        f64::from(self.axis.value(common::POSITION_DIFFERENCE))
    }
}

impl Atv<'_> {
    fn value(&self, number: u32) -> f64 {
        f64::from(self.axis.value(number))
    }

    /// rpm of a parameter in tenths of a hertz.
    fn rpm(&self, number: u32) -> f64 {
        self.value(number) / 10.0 * 60.0 / self.value(2).max(1.0)
    }

    /// Highest speed that nothing forbids.
    fn top(&self) -> f64 {
        let smallest = self.rpm(57).min(self.rpm(58));
        let limit = if self.axis.value(56) == 0 || smallest <= 0.0 {
            1_500.0 / self.value(2).max(1.0)
        } else {
            smallest
        };
        (limit - 1.0).max(0.0)
    }

    fn start(&self, function: &str, action: String, source: &str, rpm: f64) -> Step {
        let mut step = Step::new(function, action, source);
        step.trial.course.speed(0.0, rpm).command(0.0, self.neutral);
        step
    }

    fn settle(&self, step: &mut Step, from_ms: f64) {
        let still = from_ms + 200.0;
        step.trial.course.speed(still, 0.0).command(still + 500.0, self.neutral);
        let reset = self.neutral.with(control::SAFETY_RESET, true);
        step.trial.course.command(still + 900.0, reset).command(still + 1_000.0, self.neutral);
        // ATV: a stop is left after at least 100 ms of STO (DEC-12).
        let pulse = self.neutral.with(control::STO, false);
        step.trial.course.command(still + 1_100.0, pulse).command(still + 1_300.0, self.neutral);
        step.recovered(still + 1_500.0);
    }

    fn sto(&self) -> Trial {
        let mut step = self.start("STO", format!("request at {:.0} rpm", self.top()), "ATV-STO", self.top());
        step.trial
            .course
            .command(REQUEST_MS, self.neutral.with(control::STO, false))
            .speed(REQUEST_MS + 20.0, self.top());
        step.quiet(REQUEST_MS);
        step.expect("torque off", REQUEST_MS, REQUEST_MS + 2.0, Probe::TorqueOff);
        self.settle(&mut step, REQUEST_MS + 20.0);
        step.trial
    }

    /// SS1: from the highest frequency of the delay, with offset, down to the standstill level.
    fn braked(&self) -> Trial {
        let top = self.top();
        let mut step =
            self.start("SS1", format!("request at {top:.0} rpm, brake as monitored"), "ATV-SS1", top);
        step.trial.course.command(REQUEST_MS, self.neutral.with(control::SS1, true));
        let slope = (self.rpm(31) / 1_000.0).max(0.001);
        let from = REQUEST_MS + self.value(34);
        let still = from + 0.9 * top / slope;
        let reached = from + 0.9 * (top - self.rpm(33)).max(0.0) / slope;
        step.trial.course.speed(from, top).speed(still.max(from + 1.0), 0.0);
        step.expect("SS1 runs", REQUEST_MS, REQUEST_MS + 2.0, Probe::Bit(status::SS1, true));
        let latest = from + (top + self.rpm(32)) / slope + 4.0;
        step.expect("STO at the standstill level SC33", reached - 2.0, latest, Probe::TorqueOff);
        self.settle(&mut step, latest);
        step.trial
    }

    /// SS1 off its line; SLS types 3 and 6 start it themselves above their threshold.
    fn flat(&self, function: &str, bit: u8) -> Trial {
        let top = self.top();
        let action = format!("request at {top:.0} rpm, and do not brake: SS1 is violated");
        let mut step = self.start(function, action, "ATV-SS1-08", top);
        step.trial.course.command(REQUEST_MS, self.neutral.with(bit, true));
        let slope = (self.rpm(31) / 1_000.0).max(0.001);
        // The line begins SC32 above the speed.
        let seen = REQUEST_MS + self.value(34) + (self.rpm(32) / slope).ceil();
        step.quiet(seen - 1.0);
        step.expect("code SME011, both channels", seen - 1.0, seen + 3.0, Probe::Code("SME011".into()));
        step.expect("torque off", seen - 1.0, seen + 3.0, Probe::TorqueOff);
        step.trial.course.speed(seen + 20.0, top);
        self.settle(&mut step, seen + 20.0);
        step.trial
    }

    /// With the switch bit where the threshold needs it (ATV-SMS-04, ATV-SMS-08).
    fn maximum(&self, code: &str, key: u32, side: f64, switched: bool) -> Trial {
        let limit = self.rpm(key);
        let below = side * (limit - 1.0).max(0.0);
        let mut step = self.start("SMS", format!("exceed {:.0} rpm", side * limit), "ATV-SMS", below);
        if switched {
            step.trial.course.command(0.0, self.neutral.with(control::SMS_SWITCH, true));
        }
        let trip = step.cross(REQUEST_MS, side * limit, side);
        step.quiet(trip);
        step.violation(trip, code, Reaction::Sto);
        self.settle(&mut step, trip + 15.0);
        step.trial
    }
}
