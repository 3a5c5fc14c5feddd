//! ETG.6100.2: every instance that the set names and that can be requested, that is always on,
//! or that shows something.

mod limits;
mod positions;
mod signals;
mod stops;

use std::sync::LazyLock;

use serde::Deserialize;
use shm_schema::{catalogue, facts::etg_6100_2::control, profile::common, word::Word};

use super::{Probe, REQUEST_MS, Step, Trial, supervision};
use crate::{key, set::AxisSet};

#[derive(Deserialize)]
struct Words {
    control: Vec<Bit>,
    status: Vec<Bit>,
}

#[derive(Deserialize)]
struct Bit {
    bit: u8,
    name: String,
}

static WORDS: LazyLock<Words> = LazyLock::new(|| {
    toml::from_str(catalogue::WORDS_ETG_6100_2)
        .expect("the fact tables are part of the build and checked by its tests")
});

/// Bits of a word, 256 from its key on.
const WORD_BITS: u32 = 256;
/// Rows of the profile's error table (docs/decisions 0002, ETG error codes).
const WINDOW: u32 = 1;
const RAMP: u32 = 2;

struct Etg<'a> {
    axis: &'a AxisSet,
    /// Speed that no limit that is always on forbids, and the steepest change, rpm per ms.
    top: f64,
    steep: f64,
}

/// A function instance of the set.
#[derive(Clone, Copy)]
struct Instance<'a> {
    function: &'a str,
    number: u32,
    name: &'a str,
    /// As the image refers to it.
    reference: u32,
}

pub(super) fn trials(axis: &AxisSet) -> Vec<Trial> {
    let mut etg = Etg { axis, top: 1_000.0, steep: 1.0 };
    let sms = ["velocity_maximum_positive", "velocity_maximum_negative"];
    let sms = sms.into_iter().filter_map(|object| etg.value("SMS", 1, object));
    etg.top = sms.filter(|limit| *limit > 0.0).fold(etg.top, f64::min);
    let sma = ["acceleration_maximum", "deceleration_maximum"];
    let gentle = sma.into_iter().filter_map(|object| etg.value("SMA", 1, object)).map(f64::abs);
    etg.steep =
        gentle.filter(|limit| *limit > 0.0).fold(etg.steep, |steep, limit| steep.min(limit / 2_000.0));
    let instances = instances(axis);
    let own = instances.into_iter().flat_map(|instance| etg.of(instance));
    own.chain(supervision::trials(&etg)).collect()
}

/// Every instance that a key of the set names, as references.
pub(crate) fn instances(axis: &AxisSet) -> Vec<u32> {
    let keys = axis.values.keys().filter(|key| **key < common::CONTROL_WORD);
    let mut instances: Vec<u32> = keys.map(|key| key >> 8).collect();
    instances.dedup();
    instances
}

impl supervision::Manners for Etg<'_> {
    fn begin(&self, function: &str, action: String, source: &str) -> Step {
        let mut step = self.start(function, action, 0.0);
        step.trial.source = source.into();
        step
    }

    fn finish(&self, step: &mut Step, from_ms: f64) {
        self.settle(step, from_ms, 0.0);
    }

    fn position_difference(&self) -> f64 {
        f64::from(self.axis.value(common::POSITION_DIFFERENCE))
    }
}

impl Etg<'_> {
    fn value(&self, function: &str, instance: u32, object: &str) -> Option<f64> {
        let parts = key::etg(&format!("{function}_{instance}.{object}")).ok()?;
        self.axis.values.get(&parts.number).map(|value| f64::from(*value))
    }

    fn time(&self, of: Instance<'_>, object: &str) -> f64 {
        self.value(of.function, of.number, object).unwrap_or_default()
    }

    /// Bit of a word that the set assigns to an instance (DEC-41).
    fn assigned(&self, word: u32, name: &str) -> Option<u8> {
        let mut assigned = self.axis.values.range(word..word + WORD_BITS);
        let own = assigned.find(|(_, target)| key::reference_name(**target) == name);
        own.map(|(key, _)| (key - word) as u8)
    }

    fn request(&self, name: &str) -> Option<u8> {
        let fixed = || WORDS.control.iter().find(|bit| bit.name == name).map(|bit| bit.bit);
        self.assigned(common::CONTROL_WORD, name).or_else(fixed)
    }

    fn status(&self, name: &str) -> Option<u8> {
        let fixed = || WORDS.status.iter().find(|bit| bit.name == name).map(|bit| bit.bit);
        self.assigned(common::STATUS_WORD, name).or_else(fixed)
    }

    fn of(&self, reference: u32) -> Vec<Trial> {
        let name = key::reference_name(reference as i32);
        let function = key::function_name(reference >> 8).unwrap_or_default();
        let of = Instance { function, number: reference & 0xFF, name: &name, reference };
        match (function, self.request(&name)) {
            ("STO", _) => self.torque_off(),
            ("SS1", Some(bit)) => self.stop_1(of, bit),
            ("SS2", Some(bit)) => self.stop_2(of, bit),
            ("SOS", Some(bit)) => self.standstill(of, bit),
            ("SLS", Some(bit)) => self.limited_speed(of, bit),
            ("SSR", Some(bit)) => self.speed_range(of, bit),
            ("SAR", Some(bit)) => self.acceleration_range(of, bit),
            ("SLT", Some(bit)) => self.limited_torque(of, bit),
            ("SLI", Some(bit)) => self.limited_increment(of, bit),
            ("SLP", Some(bit)) => self.limited_position(of, bit),
            ("SMS", _) => self.maximum_speed(),
            ("SMA", _) => self.maximum_acceleration(),
            ("SDI", _) => self.directions(),
            ("SSM", _) => self.speed_signal(of),
            ("SCA", _) => self.position_signal(of),
            ("SBC", bit) => self.brake(of, bit),
            _ => Vec::new(),
        }
    }

    fn start(&self, function: &str, action: String, rpm: f64) -> Step {
        let mut step = self.start_still(function, action);
        step.trial.course.speed(0.0, rpm);
        step
    }

    /// Without a movement yet.
    fn start_still(&self, function: &str, action: String) -> Step {
        let source = format!("ETG-{}", function.split('_').next().unwrap_or_default());
        let mut step = Step::new(function, action, &source);
        step.trial.course.command(0.0, self.word());
        step
    }

    /// Nothing requested: assigned requests are active low too.
    fn word(&self) -> Word {
        let neutral = Word::from_u32(self.axis.profile.neutral_word());
        let assigned = self.axis.values.range(common::CONTROL_WORD..common::CONTROL_WORD + WORD_BITS);
        let used = assigned.filter(|(_, target)| **target != 0);
        used.fold(neutral, |word, (key, _)| word.with((key - common::CONTROL_WORD) as u8, true))
    }

    fn ask(&self, step: &mut Step, bit: u8) {
        step.trial.course.command(REQUEST_MS, self.word().with(bit, false));
    }

    /// Brakes to standstill, then releases and acknowledges.
    fn settle(&self, step: &mut Step, from_ms: f64, rpm: f64) {
        let still = from_ms + 100.0 + self.longest() + rpm.abs() / self.steep;
        step.trial.course.speed(from_ms, rpm).speed(from_ms + rpm.abs() / self.steep + 1.0, 0.0);
        self.release(step, still);
    }

    /// Longest time of the set, ms.
    fn longest(&self) -> f64 {
        let times = self.axis.values.iter().filter(|(key, _)| self.axis.name(**key).contains("time_"));
        times.map(|(_, value)| f64::from(*value)).fold(0.0, f64::max)
    }

    /// Releases, then acknowledges error and restart.
    fn release(&self, step: &mut Step, still_ms: f64) {
        step.trial.course.command(still_ms + 50.0, self.word());
        for (at, bit) in [(200.0, control::ERROR_ACK), (300.0, control::RESTART_ACKNOWLEDGE)] {
            let word = self.word().with(bit, true);
            step.trial.course.command(still_ms + at, word).command(still_ms + at + 50.0, self.word());
        }
        step.recovered(still_ms + 400.0);
    }

    /// The violation in a window, with its code, and what follows from its error reaction.
    fn violated(&self, step: &mut Step, window: (f64, f64), of: Instance<'_>, row: u32) -> Reaction {
        let code = (of.reference << 8 | row).to_string();
        step.expect(format!("code {code}, both channels"), window.0, window.1, Probe::Code(code));
        let reaction = self.reaction(of);
        self.follows(step, window, &reaction);
        reaction
    }

    /// SOS, SDI and SS1 have none of their own: STO.
    fn reaction(&self, of: Instance<'_>) -> Reaction {
        let fixed = ["SOS", "SDI", "SS1"].contains(&of.function);
        let object = self.value(of.function, of.number, "error_reaction").filter(|_| !fixed);
        let Some(reference) = object else { return Reaction::Sto };
        let name = key::reference_name(reference as i32);
        let number = name.split_once('_').and_then(|(_, number)| number.parse().ok()).unwrap_or(1);
        match name.split('_').next() {
            Some("none") => Reaction::None,
            Some("SS1") => {
                let time_ms = self.value("SS1", number, "time_to_sto").unwrap_or_default();
                Reaction::Ss1(name, time_ms)
            }
            Some("SS2") => {
                let time_ms = self.value("SS2", number, "time_to_sos").unwrap_or_default();
                Reaction::Ss2(name, time_ms, self.status(&format!("SOS_{number}")))
            }
            _ => Reaction::Sto,
        }
    }

    fn follows(&self, step: &mut Step, (first, last): (f64, f64), reaction: &Reaction) {
        match reaction {
            Reaction::Sto => step.expect("torque off", first, last, Probe::TorqueOff),
            Reaction::None => {
                step.expect("torque stays on: the reaction is none", first, last + 20.0, Probe::TorqueOn);
            }
            Reaction::Ss1(name, time_ms) => {
                if *time_ms > 5.0 {
                    step.expect(format!("torque on while {name} brakes"), first, last + 2.0, Probe::TorqueOn);
                }
                step.expect(
                    format!("{name}, then torque off"),
                    first,
                    last + time_ms + 3.0,
                    Probe::TorqueOff,
                );
            }
            Reaction::Ss2(name, time_ms, standing) => {
                let end = last + time_ms + 3.0;
                step.expect(format!("torque on while {name} brakes and holds"), first, end, Probe::TorqueOn);
                if let Some(bit) = standing {
                    step.expect(
                        format!("{name}, then SOS (status bit {bit})"),
                        first,
                        end,
                        Probe::Bit(*bit, true),
                    );
                }
            }
        }
    }

    /// Ends a step that went beyond a limit at `ms` with `rpm`: brakes as the reaction wants it.
    fn brake_and_settle(&self, step: &mut Step, ms: f64, rpm: f64, reaction: &Reaction) {
        let braked = match reaction {
            Reaction::Sto | Reaction::None => ms + (rpm.abs() / self.steep).max(1.0),
            Reaction::Ss1(name, time_ms) | Reaction::Ss2(name, time_ms, _) => {
                ms + self.braking_ms(name, *time_ms, rpm)
            }
        };
        step.trial.course.speed(ms, rpm).speed(braked.max(ms + 1.0), 0.0);
        self.release(step, braked + 100.0 + self.longest());
    }

    /// A time in which a stop has braked from `rpm` without leaving its own line.
    fn braking_ms(&self, name: &str, time_ms: f64, rpm: f64) -> f64 {
        let (function, number) = name.split_once('_').unwrap_or((name, "1"));
        let slope = self.value(function, number.parse().unwrap_or(1), "deceleration_limit");
        let line = slope.filter(|slope| *slope > 0.0).map_or(f64::MAX, |slope| rpm.abs() * 1_000.0 / slope);
        (0.5 * time_ms).min(0.9 * line).max(1.0)
    }

    /// A speed that no limit but that of the step forbids.
    fn permitted(&self, rpm: f64) -> bool {
        rpm.abs() <= self.top
    }
}

/// What a violation leads to.
enum Reaction {
    Sto,
    None,
    /// Name and time until STO, ms.
    Ss1(String, f64),
    /// Name, time until SOS, ms, and the status bit of that SOS.
    Ss2(String, f64, Option<u8>),
}
