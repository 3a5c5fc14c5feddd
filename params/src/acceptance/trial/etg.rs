//! ETG.6100.2: every instance that the set names and that can be requested or is always on.

use std::sync::LazyLock;

use serde::Deserialize;
use shm_schema::{catalogue, profile::common};

use super::{Probe, REQUEST_MS, Step, Trial, leaves_window_ms};
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

struct Etg<'a> {
    axis: &'a AxisSet,
    neutral: u64,
    /// Speed that no limit that is always on forbids, and the steepest change, rpm per ms.
    top: f64,
    steep: f64,
}

pub(super) fn trials(axis: &AxisSet) -> Vec<Trial> {
    let mut etg = Etg { axis, neutral: u64::from(axis.profile.neutral_word()), top: 1_000.0, steep: 1.0 };
    let sms =
        [etg.value("SMS", 1, "velocity_maximum_positive"), etg.value("SMS", 1, "velocity_maximum_negative")];
    etg.top = sms.into_iter().flatten().filter(|limit| *limit > 0.0).fold(etg.top, f64::min);
    let sma = [etg.value("SMA", 1, "acceleration_maximum"), etg.value("SMA", 1, "deceleration_maximum")];
    let gentle = sma.into_iter().flatten().map(f64::abs).filter(|limit| *limit > 0.0);
    etg.steep = gentle.fold(etg.steep, |steep, limit| steep.min(limit / 2_000.0));
    let mut instances: Vec<u32> =
        axis.values.keys().filter(|key| **key < common::CONTROL_WORD).map(|key| key >> 8).collect();
    instances.dedup();
    instances.into_iter().flat_map(|instance| etg.of(instance)).collect()
}

impl Etg<'_> {
    fn value(&self, function: &str, instance: u32, object: &str) -> Option<f64> {
        let parts = key::etg(&format!("{function}_{instance}.{object}")).ok()?;
        self.axis.values.get(&parts.number).map(|value| f64::from(*value))
    }

    /// Bit of the control word, fixed or assigned (DEC-41).
    fn request(&self, name: &str) -> Option<u8> {
        let fixed = WORDS.control.iter().find(|bit| bit.name == name).map(|bit| bit.bit);
        let mut assigned = self.axis.values.range(common::CONTROL_WORD..common::STATUS_WORD);
        let own = assigned.find(|(_, target)| key::reference_name(**target) == name);
        own.map(|(key, _)| (key - common::CONTROL_WORD) as u8).or(fixed).filter(|bit| *bit < 64)
    }

    fn status(name: &str) -> Option<u8> {
        WORDS.status.iter().find(|bit| bit.name == name).map(|bit| bit.bit)
    }

    fn of(&self, instance: u32) -> Vec<Trial> {
        let name = key::reference_name(instance as i32);
        let function = key::function_name(instance >> 8).unwrap_or_default();
        let number = instance & 0xFF;
        let request = self.request(&name);
        match (function, request) {
            ("STO", _) => self.request("STO").map(|bit| self.stop("STO", bit, 0.0)).into_iter().collect(),
            ("SS1", Some(bit)) => {
                let time = self.value(function, number, "time_to_sto").unwrap_or_default();
                vec![self.stop(&name, bit, time)]
            }
            ("SLS", Some(bit)) => self.limit(&name, bit, number),
            ("SSR", Some(bit)) => self.range(&name, bit, number),
            ("SOS", Some(bit)) => {
                self.window(&name, bit, self.value(function, number, "position_zero_window"))
            }
            ("SLI", Some(bit)) => {
                self.window(&name, bit, self.value(function, number, "position_relative_upper_limit"))
            }
            ("SMS", _) => self.maximum(),
            ("SDI", _) => {
                let both = [("SDIP", -1.0), ("SDIN", 1.0)];
                both.into_iter().filter_map(|(bit, side)| self.direction(bit, side)).collect()
            }
            ("SLT", Some(bit)) => self.torque(&name, bit, number),
            _ => Vec::new(),
        }
    }

    fn start(&self, function: &str, action: String, rpm: f64) -> Step {
        let source = format!("ETG-{}", function.split('_').next().unwrap_or_default());
        let mut step = Step::new(function, action, &source);
        step.trial.course.speed(0.0, rpm).command(0.0, self.word());
        step
    }

    /// Assigned requests are active low too.
    fn word(&self) -> u64 {
        let assigned = self.axis.values.range(common::CONTROL_WORD..common::CONTROL_WORD + 64);
        assigned
            .filter(|(_, target)| **target != 0)
            .fold(self.neutral, |word, (key, _)| word | 1 << (key - common::CONTROL_WORD))
    }

    fn ask(&self, step: &mut Step, bit: u8) {
        step.trial.course.command(REQUEST_MS, self.word() & !(1 << bit));
    }

    fn settle(&self, step: &mut Step, from_ms: f64, rpm: f64) {
        let longest = self
            .axis
            .values
            .iter()
            .filter(|(key, _)| self.axis.name(**key).contains("time_to_"))
            .map(|(_, value)| f64::from(*value))
            .fold(0.0, f64::max);
        let still = from_ms + 100.0 + longest + rpm.abs() / self.steep;
        step.trial.course.speed(from_ms, rpm).speed(still, 0.0).command(still + 50.0, self.word());
        for (at, name) in [(200.0, "ERROR_ACK"), (300.0, "RESTART_ACKNOWLEDGE")] {
            if let Some(bit) = WORDS.control.iter().find(|bit| bit.name == name) {
                let word = self.word() | 1 << bit.bit;
                step.trial.course.command(still + at, word).command(still + at + 50.0, self.word());
            }
        }
        step.recovered(still + 400.0);
    }

    fn stop(&self, name: &str, bit: u8, time: f64) -> Trial {
        let top = if time > 20.0 { self.top } else { 0.0 };
        let top = if name == "STO" { self.top } else { top };
        let mut step = self.start(name, format!("request at {top:.0} rpm"), top);
        self.ask(&mut step, bit);
        step.trial.course.speed(REQUEST_MS, top);
        if name == "STO" {
            step.trial.course.speed(REQUEST_MS + 20.0, top);
        } else {
            step.trial.course.speed(REQUEST_MS + (0.5 * time).max(1.0), 0.0);
        }
        let end = REQUEST_MS + time;
        step.quiet(REQUEST_MS);
        // Standstill may end it before its time (C1), never later.
        let earliest = if name == "STO" { end } else { REQUEST_MS };
        step.expect("torque off", earliest, end + 3.0, Probe::TorqueOff);
        self.settle(&mut step, end + 20.0, if name == "STO" { top } else { 0.0 });
        step.trial
    }

    /// The profile gives its errors no numbers: the error bit shows them.
    fn violation(&self, step: &mut Step, (first, last): (f64, f64), from: &str, number: u32) {
        let reaction = self.value(from, number, "error_reaction").unwrap_or(257.0);
        let reaction = key::reference_name(reaction as i32);
        if let Some(bit) = Self::status("ERROR") {
            step.expect(format!("error bit, then {reaction}"), first, last, Probe::Bit(bit, true));
        }
        if reaction == "STO" {
            step.expect("torque off", first, last, Probe::TorqueOff);
        }
    }

    fn cross(&self, step: &mut Step, ms: f64, limit: f64, side: f64) -> f64 {
        let ms = ms.ceil();
        step.trial.course.speed(ms, limit).speed(ms + 5.0 / self.steep, limit + side * 5.0);
        // The first cycle that is above by more than a thousandth.
        ms + 1.0
    }

    fn limit(&self, name: &str, bit: u8, number: u32) -> Vec<Trial> {
        let Some(limit) = self.value("SLS", number, "velocity_limit") else { return Vec::new() };
        let delay = self.value("SLS", number, "time_to_velocity_monitoring").unwrap_or_default();
        let side = |side: f64| {
            let mut step = self.start(
                name,
                format!("request below, exceed {:.0} rpm", side * limit),
                side * (limit - 1.0).max(0.0),
            );
            self.ask(&mut step, bit);
            let hold = REQUEST_MS + delay + 100.0;
            step.trial.course.speed(hold, side * (limit - 1.0).max(0.0));
            let trip = self.cross(&mut step, hold + 1.0 / self.steep, side * limit, side);
            step.quiet(trip);
            self.violation(&mut step, (trip, trip), "SLS", number);
            self.settle(&mut step, trip + 5.0 / self.steep + 20.0, side * (limit + 5.0));
            step.trial
        };
        vec![side(1.0), side(-1.0)]
    }

    fn range(&self, name: &str, bit: u8, number: u32) -> Vec<Trial> {
        let of = |object| self.value("SSR", number, object);
        let (Some(high), Some(low)) = (of("velocity_upper_limit"), of("velocity_lower_limit")) else {
            return Vec::new();
        };
        let delay = of("time_to_velocity_monitoring").unwrap_or_default();
        let side = |side: f64| {
            let (limit, middle) = (if side > 0.0 { high } else { low }, f64::midpoint(high, low));
            let mut step =
                self.start(name, format!("request at {middle:.0} rpm, leave at {limit:.0} rpm"), middle);
            self.ask(&mut step, bit);
            let hold = REQUEST_MS + delay + 100.0;
            step.trial.course.speed(hold, middle);
            let reach = hold + (limit - middle).abs().max(1.0) / self.steep;
            let trip = self.cross(&mut step, reach, limit, side);
            step.quiet(trip);
            self.violation(&mut step, (trip, trip), "SSR", number);
            self.settle(&mut step, trip + 5.0 / self.steep + 20.0, limit + side * 5.0);
            step.trial
        };
        vec![side(1.0), side(-1.0)]
    }

    fn window(&self, name: &str, bit: u8, window: Option<f64>) -> Vec<Trial> {
        let Some(window) = window.filter(|window| *window > 0.0) else { return Vec::new() };
        let (function, number) = name.split_once('_').unwrap_or((name, "1"));
        let number = number.parse().unwrap_or(1);
        let speed = self.value(function, number, "velocity_zero_window").filter(|rpm| *rpm > 0.0);
        let rpm = speed.unwrap_or(10.0).min(10.0);
        let mut step =
            self.start(name, format!("request at standstill, move by more than {window:.0} increments"), 0.0);
        self.ask(&mut step, bit);
        let from = REQUEST_MS + 100.0;
        let trip = leaves_window_ms(from + 5.0 / self.steep, rpm, window);
        step.trial.course.speed(from, 0.0).speed(from + rpm / self.steep, rpm).speed(trip + 5.0, rpm);
        step.quiet(from);
        let seen = (from + 0.5 * rpm / self.steep, rpm);
        let trip = leaves_window_ms(seen.0, seen.1, window);
        self.violation(&mut step, (trip - 1.0, trip + 1.0), function, number);
        self.settle(&mut step, trip + 20.0, rpm);
        vec![step.trial]
    }

    fn maximum(&self) -> Vec<Trial> {
        let objects = [("velocity_maximum_positive", 1.0), ("velocity_maximum_negative", -1.0)];
        let of = |(object, side): (&str, f64)| {
            let limit = self.value("SMS", 1, object).filter(|limit| *limit > 0.0)?;
            let below = side * (limit - 1.0).max(0.0);
            let mut step = self.start("SMS", format!("exceed {:.0} rpm", side * limit), below);
            let trip = self.cross(&mut step, REQUEST_MS, side * limit, side);
            step.quiet(trip);
            self.violation(&mut step, (trip, trip), "SMS", 1);
            self.settle(&mut step, trip + 5.0 / self.steep + 20.0, side * (limit + 5.0));
            Some(step.trial)
        };
        objects.into_iter().filter_map(of).collect()
    }

    fn direction(&self, name: &str, side: f64) -> Option<Trial> {
        let window = self.value("SDI", 1, "position_zero_window")?;
        let bit = self.request(name)?;
        let mut step = self.start(
            name,
            format!("forbid the direction at standstill, move {window:.0} increments in it"),
            0.0,
        );
        self.ask(&mut step, bit);
        let from = REQUEST_MS + 100.0;
        let rpm = 10.0;
        let trip = leaves_window_ms(from + 0.5 * rpm / self.steep, rpm, window);
        // SDIP 0 disables the positive direction.
        let forbidden = -side;
        step.trial.course.speed(from, 0.0).speed(from + rpm / self.steep, forbidden * rpm);
        step.trial.course.speed(trip + 5.0, forbidden * rpm);
        step.quiet(from);
        self.violation(&mut step, (trip - 1.0, trip + 1.0), "SDI", 1);
        self.settle(&mut step, trip + 20.0, forbidden * rpm);
        Some(step.trial)
    }

    fn torque(&self, name: &str, bit: u8, number: u32) -> Vec<Trial> {
        let Some(limit) = self.value("SLT", number, "torque_limit_positive_direction") else {
            return Vec::new();
        };
        let percent = limit / 10.0;
        let mut step = self.start(name, format!("request, exceed {percent:.1} % of the rated torque"), 0.0);
        self.ask(&mut step, bit);
        let from = REQUEST_MS + 100.0;
        step.trial.course.set(0.0, "torque_pct", 0).set(from, "torque_pct", percent);
        step.trial.course.set(from + 10.0, "torque_pct", percent + 10.0).set(
            from + 30.0,
            "torque_pct",
            percent + 10.0,
        );
        step.trial.course.set(from + 40.0, "torque_pct", 0);
        step.quiet(from);
        self.violation(&mut step, (from + 1.0, from + 1.0), "SLT", number);
        self.settle(&mut step, from + 60.0, 0.0);
        vec![step.trial]
    }
}
