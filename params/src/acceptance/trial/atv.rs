//! ATV340: STO, SS1, SLS by its type, SMS by its mode. Frequencies of the set are in tenths
//! of a hertz; the trace is in rpm (DEC-32).

use shm_schema::facts::atv340::{control, status};

use super::{Probe, REQUEST_MS, Reaction, Step, Trial};
use crate::set::AxisSet;

struct Atv<'a> {
    axis: &'a AxisSet,
    neutral: u64,
}

pub(super) fn trials(axis: &AxisSet) -> Vec<Trial> {
    let atv = Atv { axis, neutral: u64::from(axis.profile.neutral_word()) };
    let mut trials = vec![atv.sto()];
    if axis.value(65) == 1 {
        trials.push(atv.braked());
        trials.push(atv.flat());
    }
    if axis.value(66) == 1 {
        trials.extend([1.0, -1.0].map(|side| atv.limit(side)));
    }
    if axis.value(56) != 0 {
        let codes = [("SME0B4", 57, 1.0), ("SME0B5", 58, -1.0)];
        trials.extend(codes.map(|(code, key, side)| atv.maximum(code, key, side)));
    }
    trials
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
        let reset = self.neutral | 1 << control::SAFETY_RESET;
        step.trial.course.command(still + 900.0, reset).command(still + 1_000.0, self.neutral);
        // ATV: a stop is left after at least 100 ms of STO (DEC-12).
        let pulse = self.neutral & !(1 << control::STO);
        step.trial.course.command(still + 1_100.0, pulse).command(still + 1_300.0, self.neutral);
        step.recovered(still + 1_500.0);
    }

    fn sto(&self) -> Trial {
        let mut step = self.start("STO", format!("request at {:.0} rpm", self.top()), "ATV-STO", self.top());
        step.trial
            .course
            .command(REQUEST_MS, self.neutral & !(1 << control::STO))
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
        step.trial.course.command(REQUEST_MS, self.neutral | 1 << control::SS1);
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

    fn flat(&self) -> Trial {
        let top = self.top();
        let mut step = self.start("SS1", "request, and do not brake".into(), "ATV-SS1", top);
        step.trial.course.command(REQUEST_MS, self.neutral | 1 << control::SS1);
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

    /// SLS: requested below its set point, then above its threshold.
    fn limit(&self, side: f64) -> Trial {
        // SC49 and SC51 always equal SC48 and SC50.
        let limit = self.rpm(48);
        // Types 2 to 6 brake to their set point; type 1 and the standstill case wait at the level.
        let slow = self.rpm(50).min(limit);
        let kind = self.axis.value(39);
        let begin = if kind == 1 { (limit - 1.0).max(0.0) } else { (slow - 1.0).max(0.0) };
        let mut step = self.start(
            &format!("SLS type {kind}"),
            format!("request at {:.0} rpm, exceed {:.0} rpm", side * begin, side * limit),
            "ATV-SLS",
            side * begin,
        );
        step.trial.course.command(REQUEST_MS, self.neutral | 1 << control::SLS);
        let hold = REQUEST_MS + self.value(54) + 200.0;
        step.trial.course.speed(hold, side * begin);
        let reach = hold + (limit - begin).max(1.0);
        let trip = step.cross(reach, side * limit, side);
        step.quiet(REQUEST_MS + 100.0);
        step.violation(trip, "", Reaction::Sto);
        self.settle(&mut step, trip + 15.0);
        step.trial
    }

    fn maximum(&self, code: &str, key: u32, side: f64) -> Trial {
        let limit = self.rpm(key);
        let below = side * (limit - 1.0).max(0.0);
        let mut step = self.start("SMS", format!("exceed {:.0} rpm", side * limit), "ATV-SMS", below);
        if self.axis.value(56) == 3 {
            step.trial.course.command(0.0, self.neutral | 1 << control::SMS_SWITCH);
        }
        let trip = step.cross(REQUEST_MS, side * limit, side);
        step.quiet(trip);
        step.violation(trip, code, Reaction::Sto);
        self.settle(&mut step, trip + 15.0);
        step.trial
    }
}
