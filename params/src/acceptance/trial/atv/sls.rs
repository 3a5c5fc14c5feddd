//! SLS by its type: what happens above the threshold, between the levels, and near standstill.

use shm_schema::facts::atv340::control;

use super::{Atv, Probe, REQUEST_MS, Reaction, Step, Trial};

const SIDES: [f64; 2] = [1.0, -1.0];

impl Atv<'_> {
    pub(super) fn limited_speed(&self) -> Vec<Trial> {
        let mut trials: Vec<Trial> = SIDES.map(|side| self.limit(side)).into();
        // SC48 is the threshold; a set whose SMS comes first has nothing above it.
        if self.top() > self.rpm(48) + 1.0 {
            trials.extend(self.above());
        }
        if self.rpm(46) > 0.0 && [1, 2, 3].contains(&self.axis.value(39)) {
            trials.extend(self.slower());
        }
        trials
    }

    fn kind(&self) -> i32 {
        self.axis.value(39)
    }

    fn begin_at(&self, action: &str, rpm: f64) -> Step {
        let action = format!("type {}: {action}", self.kind());
        let mut step = self.start("SLS", action, "ATV-SLS", rpm);
        step.trial.course.command(REQUEST_MS, self.neutral.with(control::SLS, true));
        step
    }

    /// Requested below its set point, then above its threshold.
    fn limit(&self, side: f64) -> Trial {
        // SC49 and SC51 always equal SC48 and SC50.
        let limit = self.rpm(48);
        // Types 2 to 6 brake to their set point; type 1 waits at the threshold.
        let slow = self.rpm(50).min(limit);
        let begin = if self.kind() == 1 { (limit - 1.0).max(0.0) } else { (slow - 1.0).max(0.0) };
        let mut step = self.begin_at(
            &format!("request at {:.0} rpm, exceed {:.0} rpm", side * begin, side * limit),
            side * begin,
        );
        let hold = REQUEST_MS + self.value(54) + 200.0;
        step.trial.course.speed(hold, side * begin);
        let reach = hold + (limit - begin).max(1.0);
        let trip = step.cross(reach, side * limit, side);
        step.quiet(REQUEST_MS + 100.0);
        step.violation(trip, "", Reaction::Sto);
        self.settle(&mut step, trip + 15.0);
        step.trial
    }

    /// Requested above the threshold: a violation (types 1, 4), a ramp (2, 5), or SS1 (3, 6).
    fn above(&self) -> Vec<Trial> {
        match self.kind() {
            1 | 4 => SIDES.map(|side| self.refused(side)).into(),
            2 | 5 => vec![self.ramp(true), self.ramp(false)],
            _ => vec![self.flat("SLS", control::SLS), self.flat_of_ss1()],
        }
    }

    /// SS1 is active through SLS alone: its step counts for both.
    fn flat_of_ss1(&self) -> Trial {
        self.flat("SS1", control::SLS)
    }

    /// ATV-SLST1-02, ATV-SLST4-02
    fn refused(&self, side: f64) -> Trial {
        let top = side * self.top();
        let mut step = self.begin_at(&format!("request at {top:.0} rpm, above the threshold"), top);
        step.quiet(REQUEST_MS);
        step.trial.course.speed(REQUEST_MS + 20.0, top);
        step.violation_near(REQUEST_MS + 1.0, "", Reaction::Sto);
        self.settle(&mut step, REQUEST_MS + 20.0);
        step.trial
    }

    /// ATV-SLST2-01, ATV-SLST5-01: along the line, or off it.
    fn ramp(&self, brakes: bool) -> Trial {
        let (top, slope) = (self.top(), (self.rpm(40) / 1_000.0).max(0.001));
        let how = if brakes { "brake along the ramp" } else { "and do not brake" };
        let mut step = self.begin_at(&format!("request at {top:.0} rpm, {how}"), top);
        let offset = (self.rpm(43) / slope).ceil();
        let from = REQUEST_MS + offset;
        if brakes {
            let slow = (self.rpm(50).min(self.rpm(48)) - 1.0).max(self.rpm(46) + 1.0).max(0.0);
            let end = REQUEST_MS + (top - slow) / (1.2 * slope);
            step.trial.course.speed(REQUEST_MS, top).speed(end, slow).speed(end + 200.0, slow);
            step.quiet(end + 200.0);
            self.settle(&mut step, end + 200.0);
            return step.trial;
        }
        step.quiet(from - 1.0);
        step.expect("a code, both channels", from - 1.0, from + 4.0, Probe::Code(String::new()));
        step.expect("torque off", from - 1.0, from + 4.0, Probe::TorqueOff);
        step.trial.course.speed(from + 20.0, top);
        self.settle(&mut step, from + 20.0);
        step.trial
    }

    /// ATV-SLST1-03, ATV-SLST1-04, ATV-SLST2-03, ATV-SLST2-06: below SC46 follows STO without an
    /// error, at an activation after SC54.
    fn slower(&self) -> Vec<Trial> {
        let level = self.rpm(46);
        let wait = if self.kind() == 1 { 0.0 } else { self.value(54) };
        let mut still = self.begin_at("request at standstill", 0.0);
        still.quiet(REQUEST_MS + (wait - 1.0).max(0.0));
        let end = REQUEST_MS + wait;
        still.expect("STO without a code", end - 1.0, end + 3.0, Probe::TorqueOff);
        self.settle(&mut still, end + 20.0);
        let begin = (level + 2.0).min(self.rpm(48));
        let mut falling = self.begin_at(&format!("fall below {level:.0} rpm"), begin);
        let at = REQUEST_MS + 200.0;
        falling.trial.course.speed(at, begin).speed(at + 50.0, level).speed(at + 55.0, level - 5.0);
        falling.quiet(at + 50.0);
        falling.expect("STO without a code", at + 50.0, at + 53.0, Probe::TorqueOff);
        self.settle(&mut falling, at + 60.0);
        vec![still.trial, falling.trial]
    }
}
