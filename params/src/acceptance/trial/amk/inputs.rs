//! Safe inputs and outputs.

use shm_schema::facts::amk_kw::{control, status};

use super::{Amk, Probe, REQUEST_MS, Request, Step, Trial, supervision::Manners as _};
use crate::acceptance::trial::course::Pulses;

/// An input pair: its parameters and its status bit.
pub(super) struct Pair {
    name: &'static str,
    column: &'static str,
    /// Its function.
    pub(super) function: u32,
    sampled: u32,
    inverted: u32,
    /// Filter of each line, µs.
    filter: [u32; 2],
    /// Period of each line's test pulses, ms.
    period: [u32; 2],
    status: u8,
}

pub(super) const PAIRS: [Pair; 3] = [
    Pair {
        name: "SE1",
        column: "se1",
        function: 15,
        sampled: 69,
        inverted: 70,
        filter: [71, 73],
        period: [72, 74],
        status: status::SE1,
    },
    Pair {
        name: "SE2",
        column: "se2",
        function: 16,
        sampled: 75,
        inverted: 76,
        filter: [77, 79],
        period: [78, 80],
        status: status::SE2,
    },
    Pair {
        name: "SE3",
        column: "se3",
        function: 17,
        sampled: 81,
        inverted: 82,
        filter: [83, 85],
        period: [84, 86],
        status: status::SE3,
    },
];

/// Levels of SA1.1 and SA2.1 among the outputs.
const SA1: u8 = 0;
const SA2: u8 = 2;
/// The first test pulse of line .1 and of line .2, ms: never at once.
const FIRST_PULSE_MS: [f64; 2] = [20.0, 35.0];

/// The other levels of both lines.
pub(super) const fn opposite(lines: &str) -> &'static str {
    match lines.as_bytes() {
        b"00" => "11",
        b"11" => "00",
        b"10" => "01",
        _ => "10",
    }
}

impl Amk<'_> {
    /// Levels of a pair that requests its function.
    fn requesting(&self, pair: &Pair) -> &'static str {
        if self.axis.value(pair.inverted) == 0 { "00" } else { "01" }
    }

    fn filter_ms(&self, pair: &Pair) -> f64 {
        let [first, second] = pair.filter.map(|filter| self.value(filter));
        (first.max(second) / 1_000.0).ceil() + 1.0
    }

    pub(super) fn by(&self, pair: &Pair) -> Request {
        Request::Pair(pair.column, self.requesting(pair), self.filter_ms(pair))
    }

    /// Nothing requested by any pair; test pulses where they are looked for.
    pub(super) fn connect(&self, step: &mut Step) {
        for pair in &PAIRS {
            step.trial.course.set(0.0, pair.column, opposite(self.requesting(pair)));
            if self.axis.value(pair.sampled) != 0 {
                step.trial.course.sample(pair.column, self.pulses(pair));
            }
        }
    }

    /// Pulses of the supply that feeds each line (AMK-DYN-06): its period, Prm99 and Prm101.
    fn pulses(&self, pair: &Pair) -> [Pulses; 2] {
        let of = |at: usize, length: u32| Pulses {
            period_us: (self.value(pair.period[at]) * 1_000.0) as u64,
            pulse_us: self.value(length) as u64,
            first_us: (FIRST_PULSE_MS[at] * 1_000.0) as u64,
        };
        [of(0, 99), of(1, 101)]
    }

    pub(super) fn inputs(&self) -> Vec<Trial> {
        let levels = PAIRS.iter().map(|pair| self.level(pair));
        let commanding = PAIRS.iter().filter(|pair| self.commands(pair));
        levels.chain(commanding.map(|pair| self.discrepancy(pair))).collect()
    }

    /// AMK-IN-04, AMK-IN-07: a function of its own, with commands from the inputs.
    pub(crate) fn commands(&self, pair: &Pair) -> bool {
        self.axis.value(7) == 1 && self.axis.value(pair.function) != 16
    }

    /// AMK-IN-09: the state of the pair in the status word.
    fn level(&self, pair: &Pair) -> Trial {
        let mut step = self.begin(pair.name, "both lines to their other level".into(), "AMK-IN-09");
        let request = self.by(pair);
        let at = self.ask(&mut step, request);
        let what = format!("status bit {} is 0", pair.status);
        step.expect(what, REQUEST_MS, at + 2.0, Probe::Bit(pair.status, false));
        self.settle(&mut step, Some(request), at + 20.0);
        step.trial
    }

    /// AMK-IN-08: the lines of a pair may differ for less than tcc.
    fn discrepancy(&self, pair: &Pair) -> Trial {
        let tcc = (self.value(105) + 1.0) * 15.0;
        let mut step = self.begin(
            pair.name,
            format!("line .1 alone to its other level, for {tcc:.0} ms"),
            "AMK-IN-08, DEC-21",
        );
        let normal = opposite(self.requesting(pair));
        let lines = match normal {
            "11" => "01",
            _ => "00",
        };
        step.trial.course.set(REQUEST_MS, pair.column, lines);
        let latest = REQUEST_MS + self.filter_ms(pair) + tcc + 3.0;
        step.expect("torque off", REQUEST_MS, latest, Probe::TorqueOff);
        step.expect("code 3606/13", REQUEST_MS + tcc, latest, Probe::Combined("3606/13".into()));
        let request = Request::Pair(pair.column, opposite(normal), 0.0);
        step.trial.course.set(latest + 20.0, pair.column, opposite(normal));
        self.settle(&mut step, Some(request), latest + 30.0);
        step.trial
    }

    /// AMK-OUT-07: what SA1 and SA2 mean.
    pub(super) fn outputs(&self) -> Vec<Trial> {
        let free = self.axis.value(7) == 0 && self.axis.value(8) == 0;
        if free {
            let by = [("SA1", control::SA1, SA1), ("SA2", control::SA2, SA2)];
            return by.map(|(name, bit, output)| self.set_by_word(name, bit, output)).into();
        }
        let acknowledged = PAIRS.iter().take(2).filter(|pair| self.commands(pair));
        acknowledged.map(|pair| self.acknowledged(pair)).chain([self.torque_acknowledged()]).collect()
    }

    fn set_by_word(&self, name: &str, bit: u8, output: u8) -> Trial {
        let mut step = self.begin(name, format!("set control bit {bit}, and reset it"), "AMK-OUT-07");
        let reset = REQUEST_MS + 50.0;
        step.trial.course.command(REQUEST_MS, self.neutral.with(bit, true)).command(reset, self.neutral);
        step.expect("output on", REQUEST_MS, REQUEST_MS + 2.0, Probe::Output(output, true));
        step.expect("output off", reset, reset + 2.0, Probe::Output(output, false));
        self.finish(&mut step, reset + 20.0);
        step.trial
    }

    /// AMK-OUT-01: the function that the pair requests is active.
    fn acknowledged(&self, pair: &Pair) -> Trial {
        let rpm = self.permitted(pair);
        let mut step = self.begin("SA1", format!("request by {} at {rpm:.0} rpm", pair.name), "AMK-OUT-01");
        step.trial.course.speed(0.0, rpm);
        let request = self.by(pair);
        let at = self.ask(&mut step, request);
        // The longest way of a monitoring function until it is active.
        let ways = [(30, 32), (36, 38), (42, 44), (48, 50), (54, 56), (59, 61)];
        let longest = ways.map(|(delay, ramp)| self.value(delay) + self.value(ramp));
        let latest = at + longest.into_iter().fold(0.0, f64::max) + 5.0;
        step.expect("output on", REQUEST_MS, latest, Probe::Output(SA1, true));
        step.trial.course.speed(latest, rpm);
        self.settle(&mut step, Some(request), latest);
        step.trial
    }

    /// A speed that the function of a pair permits: standstill, or the middle of an SSR.
    fn permitted(&self, pair: &Pair) -> f64 {
        let function = self.axis.value(pair.function);
        let range = super::SSR.iter().find(|(_, bit, _)| i32::from(*bit) == function);
        range.map_or(0.0, |(_, _, [_, _, first, second, _])| {
            f64::midpoint(self.value(*first), self.value(*second))
        })
    }

    /// AMK-OUT-05: STO, here of a lost encoder.
    fn torque_acknowledged(&self) -> Trial {
        let mut step = self.begin("SA2", "no new encoder sample for 20 ms: STO".into(), "AMK-OUT-05");
        step.trial.course.set(0.0, "fault", "none").set(REQUEST_MS, "fault", "stale-encoder");
        step.trial.course.set(REQUEST_MS + 20.0, "fault", "none");
        step.expect("output on", REQUEST_MS, REQUEST_MS + 4.0, Probe::Output(SA2, true));
        self.finish(&mut step, REQUEST_MS + 30.0);
        step.trial
    }
}
