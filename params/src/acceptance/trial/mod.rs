//! Test steps for every active function of a set, derived from the set itself.
//!
//! A [`Trial`] is a trace that the cores can be driven over, and what has to be seen, when.
//! The same steps stand in the report to be done by hand, and run in the acceptance run.

mod amk;
mod atv;
mod course;
mod etg;
mod judge;
mod lenze;
pub(crate) mod supervision;

use serde::Serialize;
use shm_schema::profile::Profile;

use crate::set::AxisSet;
pub use course::Course;
pub(crate) use etg::instances as etg_instances;
pub use judge::{Measured, Seen, judge};

/// One step: what is done, and what has to happen.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Function that is proved.
    pub function: String,
    /// What is done.
    pub action: String,
    /// Requirement.
    pub source: String,
    /// The movement and the commands, as `safepair replay` reads them.
    #[serde(skip)]
    pub course: Course,
    /// What has to happen.
    pub expectations: Vec<Expectation>,
}

/// One thing that has to happen.
#[derive(Clone, Debug, Serialize)]
pub struct Expectation {
    /// What, in words.
    pub what: String,
    /// Earliest and latest time, ms of the trace.
    pub window_ms: (f64, f64),
    /// How it is seen.
    #[serde(skip)]
    pub probe: Probe,
}

/// How something is seen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Probe {
    /// Torque of the combined view goes off in the window.
    TorqueOff,
    /// The same, where it has gone off and on before.
    LaterOff,
    /// A bit of the combined status goes to 1 in the window, where it has done so before.
    LaterBit(u8),
    /// A bit of the combined status takes this level in the window.
    Bit(u8, bool),
    /// A code that begins so appears in the window, at both channels; empty: any code.
    Code(String),
    /// The same in the combined view: from one channel, or from crosscheck.
    Combined(String),
    /// All the time torque is on, whatever stands.
    TorqueOn,
    /// A level of the safe outputs, or the release of the brake (bit 7), goes to this in the window.
    Output(u8, bool),
    /// All the time torque is on and no code stands.
    Quiet,
    /// At the end of the window torque is on and no code stands.
    Recovered,
}

impl Expectation {
    fn new(what: impl Into<String>, from_ms: f64, to_ms: f64, probe: Probe) -> Self {
        Self { what: what.into(), window_ms: (from_ms, to_ms), probe }
    }

    /// The window as a person reads it.
    pub fn when(&self) -> String {
        let (from, to) = self.window_ms;
        if (to - from) < 0.05 { format!("{from:.0} ms") } else { format!("{from:.0} to {to:.0} ms") }
    }
}

/// Every step that the set asks for.
pub fn trials(axis: &AxisSet) -> Vec<Trial> {
    match axis.profile {
        Profile::AmkKw => amk::trials(axis),
        Profile::LenzeSm301 => lenze::trials(axis),
        Profile::Atv340 => atv::trials(axis),
        Profile::Etg61002 => etg::trials(axis),
        Profile::None => Vec::new(),
    }
}

/// Instant of the request in every trace, ms.
const REQUEST_MS: f64 = 100.0;

/// What a violation leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reaction {
    /// Its code alone.
    Code,
    /// Torque off in the cycle of the violation.
    Sto,
    /// A stop function, whose status bit shows it.
    Stop(u8),
}

/// Where the release of the brake stands among the outputs of [`Seen`].
pub const BRAKE_OPEN: u8 = 7;

/// A step under construction.
struct Step {
    trial: Trial,
}

impl Step {
    /// Crosses `limit` at one rpm in a millisecond from `ms` on; the next cycle sees it.
    fn cross(&mut self, ms: f64, limit: f64, side: f64) -> f64 {
        let ms = ms.ceil();
        let beyond = limit + side * 5.0;
        self.trial.course.speed(ms, limit).speed(ms + 5.0, beyond).speed(ms + 15.0, beyond);
        ms + 1.0
    }

    fn new(function: &str, action: String, source: &str) -> Self {
        let trial = Trial {
            function: function.into(),
            action,
            source: source.into(),
            course: Course::default(),
            expectations: Vec::new(),
        };
        Self { trial }
    }

    fn expect(&mut self, what: impl Into<String>, from_ms: f64, to_ms: f64, probe: Probe) {
        self.trial.expectations.push(Expectation::new(what, from_ms, to_ms, probe));
    }

    /// Nothing happens before `ms`.
    fn quiet(&mut self, until_ms: f64) {
        self.expect("torque on, no code, up to the limit", 0.0, until_ms - 1.0, Probe::Quiet);
    }

    /// The violation in the cycle at `ms`, its code and its reaction (design 8: the cycle that
    /// reads the sample).
    fn violation(&mut self, ms: f64, code: &str, reaction: Reaction) {
        self.violated((ms, ms), code, reaction);
    }

    /// The same where rounding decides between neighbouring cycles.
    fn violation_near(&mut self, ms: f64, code: &str, reaction: Reaction) {
        self.violated((ms - 1.0, ms + 1.0), code, reaction);
    }

    fn violated(&mut self, (from, to): (f64, f64), code: &str, reaction: Reaction) {
        let named = if code.is_empty() { "error".to_string() } else { format!("code {code}") };
        self.expect(format!("{named}, both channels"), from, to, Probe::Code(code.into()));
        match reaction {
            Reaction::Code => {}
            Reaction::Sto => self.expect("torque off", from, to, Probe::TorqueOff),
            Reaction::Stop(bit) => {
                self.expect(
                    format!("stop function runs (status bit {bit})"),
                    from,
                    to,
                    Probe::Bit(bit, true),
                );
            }
        }
    }

    /// Afterwards, still and acknowledged, the axis is ready again.
    fn recovered(&mut self, ms: f64) {
        self.expect("torque on again, no code, after the acknowledge", ms, ms + 50.0, Probe::Recovered);
        self.trial.course.end(ms + 60.0);
    }
}

/// First whole millisecond after `from_ms` at which a constant speed has moved the axis by
/// more than `increments` (DEC-01: strictly outside; whole increments, rounded).
fn leaves_window_ms(from_ms: f64, rpm: f64, increments: f64) -> f64 {
    let per_ms = rpm.abs() * 65_536.0 / 60_000.0;
    (from_ms + (increments + 0.5) / per_ms).ceil()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::definition;

    /// Design: every function of the delivery state of every profile has a step, and each
    /// step is a trace with a time column and something to expect.
    #[test]
    fn every_profile_derives_steps_from_its_set() {
        for profile in definition::PROFILES {
            let all = trials(&AxisSet::delivery(profile, 1, "S"));
            assert!(all.iter().any(|trial| trial.function.starts_with("STO")), "{}", profile.name());
            for trial in &all {
                assert!(trial.course.csv().starts_with("t_ms,"), "{}", trial.function);
                assert!(!trial.expectations.is_empty(), "{}", trial.function);
            }
        }
    }

    #[test]
    fn a_limit_of_the_set_moves_its_step() {
        let of = |limit: i32| {
            let text = format!("profile = \"amk-kw\"\n[parameters]\nPrm67 = 3000\nPrm57 = {limit}");
            let set = crate::parse(&text, "x").expect("right").axes.remove(0);
            let all = trials(&set);
            let sls = all.iter().find(|trial| trial.function == "SLS1").expect("a step");
            sls.expectations.last().expect("something").window_ms
        };
        assert!(of(500).0 > of(2_500).0, "the longer ramp ends later");
    }
}
