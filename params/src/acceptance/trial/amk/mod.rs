//! AMK KW-R07: every function that the command source can request, what is always on, inputs
//! and outputs.

mod always;
mod inputs;

use shm_schema::{
    facts::amk_kw::{control, status},
    word::Word,
};

use super::{Probe, REQUEST_MS, Reaction, Step, Trial, leaves_window_ms, supervision};
use crate::set::AxisSet;

/// How a function is requested.
#[derive(Clone, Copy)]
enum Request {
    /// Bit of the control word, active low.
    Word(u8),
    /// Pair of lines, with the level of the request and its filter time, ms.
    Pair(&'static str, &'static str, f64),
}

struct Amk<'a> {
    axis: &'a AxisSet,
    top: f64,
    neutral: Word,
}

/// Monitoring functions with bit and parameters: delay, ramp, first and second limit, reaction.
const SSR: [(&str, u8, [u32; 5]); 4] = [
    ("SSR1", control::SSR1, [30, 32, 33, 34, 35]),
    ("SSR2", control::SSR2, [36, 38, 39, 40, 41]),
    ("SSR3", control::SSR3, [42, 44, 45, 46, 47]),
    ("SSR4", control::SSR4, [48, 50, 51, 52, 53]),
];
const SLS: [(&str, u8, [u32; 4]); 2] =
    [("SLS1", control::SLS1, [54, 56, 57, 58]), ("SLS2", control::SLS2, [59, 61, 62, 63])];

pub(super) fn trials(axis: &AxisSet) -> Vec<Trial> {
    let amk =
        Amk { axis, top: f64::from(axis.value(67)), neutral: Word::from_u32(axis.profile.neutral_word()) };
    let mut trials = Vec::new();
    amk.stops(&mut trials);
    for (name, bit, keys) in SSR {
        if let Some(request) = amk.request(bit) {
            trials.extend([1.0, -1.0].map(|side| amk.range(name, bit, keys, request, side)));
        }
    }
    for (name, bit, keys) in SLS {
        if let Some(request) = amk.request(bit) {
            trials.extend([1.0, -1.0].map(|side| amk.limit(name, bit, keys, request, side)));
        }
    }
    for (name, bit, side) in [("SDIp", control::SDIP, -1.0), ("SDIn", control::SDIN, 1.0)] {
        trials.extend(amk.request(bit).map(|request| amk.direction(name, bit, request, side)));
    }
    trials.extend(amk.request(control::SLI).map(|request| amk.increment(request)));
    trials.extend([1.0, -1.0].map(|side| amk.maximum(side)));
    trials.extend(amk.inputs());
    trials.extend(amk.outputs());
    trials.extend(amk.standstill_supervision());
    trials.extend(supervision::trials(&amk));
    trials
}

impl supervision::Manners for Amk<'_> {
    fn begin(&self, function: &str, action: String, source: &str) -> Step {
        let mut step = Step::new(function, action, source);
        self.start(&mut step, 0.0);
        step
    }

    fn finish(&self, step: &mut Step, from_ms: f64) {
        self.settle(step, None, from_ms);
    }

    fn position_difference(&self) -> f64 {
        self.value(2)
    }
}

impl Amk<'_> {
    fn value(&self, number: u32) -> f64 {
        f64::from(self.axis.value(number))
    }

    /// Prm7: the fieldbus commands everything, or the inputs what is assigned to them.
    fn request(&self, bit: u8) -> Option<Request> {
        if self.axis.value(7) == 0 {
            return Some(Request::Word(bit));
        }
        let wanted = i32::from(bit);
        inputs::PAIRS.iter().find(|pair| self.axis.value(pair.function) == wanted).map(|pair| self.by(pair))
    }

    fn start(&self, step: &mut Step, rpm: f64) {
        step.trial.course.speed(0.0, rpm).command(0.0, self.neutral);
        self.connect(step);
    }

    /// Requests at [`REQUEST_MS`]; returns when it is in force.
    fn ask(&self, step: &mut Step, request: Request) -> f64 {
        match request {
            Request::Word(bit) => {
                step.trial.course.command(REQUEST_MS, self.neutral.with(bit, false));
                REQUEST_MS
            }
            Request::Pair(column, lines, filter_ms) => {
                step.trial.course.set(REQUEST_MS, column, lines);
                REQUEST_MS + filter_ms
            }
        }
    }

    /// Still, released, acknowledged.
    fn settle(&self, step: &mut Step, request: Option<Request>, from_ms: f64) {
        let still = from_ms + 50.0 + self.stop_ms();
        step.trial.course.speed(still, 0.0);
        match request {
            Some(Request::Pair(column, lines, _)) => {
                step.trial.course.set(still + 50.0, column, inputs::opposite(lines));
            }
            Some(Request::Word(_)) => {
                step.trial.course.command(still + 50.0, self.neutral);
            }
            None => {}
        }
        step.trial.course.set(0.0, "clear_error", 0).set(still + 200.0, "clear_error", 1);
        step.recovered(still + 250.0);
    }

    /// Longest way of a stop, ms.
    fn stop_ms(&self) -> f64 {
        let way = |delay: u32, ramp: u32| self.value(delay) + self.value(ramp);
        way(18, 20).max(way(23, 25)) + 100.0
    }

    /// DEC-04: rpm per ms.
    fn slope(&self, ramp: u32) -> f64 {
        self.top.max(1.0) / self.value(ramp).max(1.0)
    }

    fn reaction(&self, key: u32, function: u8) -> (String, Reaction) {
        // DEC-44: an error when it ends in STO, else a warning with its stop.
        let warning = format!("3610/{}", 100 + u32::from(function));
        // A stop without a way to brake is in its end state at once.
        let immediate =
            |delay, window| [self.value(delay) == 0.0, self.top <= self.value(window)] == [true; 2];
        match self.axis.value(key) {
            0 => (format!("3606/{}", 100 + u32::from(function)), Reaction::Sto),
            1 if immediate(18, 21) => (warning, Reaction::Sto),
            1 => (warning, Reaction::Stop(status::SS1_ACTIVE)),
            _ if immediate(23, 26) => (warning, Reaction::Stop(status::SOS)),
            _ => (warning, Reaction::Stop(status::SS2_ACTIVE)),
        }
    }

    fn stops(&self, trials: &mut Vec<Trial>) {
        if let Some(request) = self.request(control::STO) {
            let mut step = Step::new("STO", format!("request at {:.0} rpm", self.top), "AMK-STO");
            self.start(&mut step, self.top);
            let at = self.ask(&mut step, request);
            step.quiet(at.min(REQUEST_MS + 1.0));
            step.expect("torque off", at.min(REQUEST_MS + 1.0), at, Probe::TorqueOff);
            step.trial.course.speed(at + 20.0, self.top);
            self.settle(&mut step, Some(request), at + 20.0);
            trials.push(step.trial);
        }
        if let Some(request) = self.request(control::SS1) {
            trials.push(self.braked(request, "SS1", [18, 20, 21]));
            if self.top > self.value(21) {
                trials.push(self.flat(request, "SS1", [18, 20], "3606/101"));
            }
        }
        if let Some(request) = self.request(control::SS2) {
            trials.push(self.braked(request, "SS2", [23, 25, 26]));
            if self.top > self.value(26) {
                trials.push(self.flat(request, "SS2", [23, 25], "3606/102"));
            }
        }
        if let Some(request) = self.request(control::SOS) {
            trials.push(self.standstill(request));
        }
    }

    /// A stop that brakes as it should: its end state when the line meets the window (DEC-05).
    fn braked(&self, request: Request, name: &str, [delay, ramp, window]: [u32; 3]) -> Trial {
        let mut step = Step::new(
            name,
            format!("request at {:.0} rpm, brake steeper than the ramp", self.top),
            "AMK-RAMP, DEC-05",
        );
        self.start(&mut step, self.top);
        let at = self.ask(&mut step, request);
        let from = at + self.value(delay);
        let line = ((self.top - self.value(window)) / self.slope(ramp)).max(0.0);
        let end = from + line;
        step.trial.course.speed(from, self.top).speed(from + 0.9 * line.max(1.0), 0.0);
        let bit = if name == "SS1" { status::SS1_ACTIVE } else { status::SS2_ACTIVE };
        // Without a way to brake the end state follows at once.
        if end - at > 4.0 {
            step.expect(format!("{name} runs (status bit {bit})"), at - 1.0, at + 2.0, Probe::Bit(bit, true));
        }
        if name == "SS1" {
            step.expect("STO when the line meets the window", end - 1.0, end + 3.0, Probe::TorqueOff);
        } else {
            step.expect(
                "SOS when the line meets the window",
                end - 1.0,
                end + 3.0,
                Probe::Bit(status::SOS, true),
            );
        }
        self.settle(&mut step, Some(request), end + 20.0);
        step.trial
    }

    /// A drive that does not brake is stopped as soon as the line falls below it.
    fn flat(&self, request: Request, name: &str, [delay, ramp]: [u32; 2], code: &str) -> Trial {
        let mut step = Step::new(name, "request, and do not brake".into(), "AMK-RAMP, DEC-03");
        self.start(&mut step, self.top);
        let at = self.ask(&mut step, request);
        let seen = at + self.value(delay) + (0.001 / self.slope(ramp)).max(1.0).ceil();
        step.quiet(seen - 1.0);
        step.violation_near(seen, code, Reaction::Sto);
        step.trial.course.speed(seen + 20.0, self.top);
        self.settle(&mut step, Some(request), seen + 20.0);
        step.trial
    }

    fn standstill(&self, request: Request) -> Trial {
        let (speed, window) = (self.value(28), self.value(29).abs());
        let mut step =
            Step::new("SOS", format!("request at standstill, turn out of {window:.0} increments"), "AMK-SOS");
        self.start(&mut step, 0.0);
        let at = self.ask(&mut step, request);
        let from = at + 100.0;
        let rpm = if speed > 0.0 { speed } else { 1.0 };
        let trip = if speed > 0.0 { leaves_window_ms(from, rpm, window) } else { from + 1.0 };
        step.quiet(trip);
        step.trial.course.speed(from, 0.0).speed(from + 0.001, rpm).speed(trip + 5.0, rpm);
        step.violation_near(trip, "3606/103", Reaction::Sto);
        self.settle(&mut step, Some(request), trip + 20.0);
        step.trial
    }

    fn range(&self, name: &str, bit: u8, keys: [u32; 5], request: Request, side: f64) -> Trial {
        let [delay, ramp, first, second, reaction] = keys;
        let (high, low) =
            (self.value(first).max(self.value(second)), self.value(first).min(self.value(second)));
        let (limit, middle) = (if side > 0.0 { high } else { low }, f64::midpoint(high, low));
        let mut step = Step::new(
            name,
            format!("request at {middle:.0} rpm, leave the range at {limit:.0} rpm"),
            "AMK-SSR",
        );
        self.start(&mut step, middle);
        let at = self.ask(&mut step, request);
        let hold = at + self.value(delay) + self.value(ramp) + 50.0;
        step.trial.course.speed(hold, middle);
        let reach = hold + (limit - middle).abs().max(1.0);
        let trip = step.cross(reach, limit, side);
        let (code, reaction) = self.reaction(reaction, bit);
        step.quiet(trip);
        step.violation(trip, &code, reaction);
        self.settle(&mut step, Some(request), trip + 15.0);
        step.trial
    }

    fn limit(&self, name: &str, bit: u8, keys: [u32; 4], request: Request, side: f64) -> Trial {
        let [delay, ramp, limit, reaction] = keys;
        let limit = self.value(limit).abs();
        let top = self.top.max(limit);
        let mut step = Step::new(
            name,
            format!("request at {:.0} rpm, brake to {limit:.0} rpm, exceed it", side * top),
            "AMK-SLS",
        );
        self.start(&mut step, side * top);
        let at = self.ask(&mut step, request);
        let from = at + self.value(delay);
        let line = (top - limit) / self.slope(ramp);
        step.trial
            .course
            .speed(from, side * top)
            .speed(from + 0.9 * line + 1.0, side * (limit - 1.0).max(0.0));
        let hold = from + line + 50.0;
        let trip = step.cross(hold, side * limit, side);
        let (code, reaction) = self.reaction(reaction, bit);
        step.quiet(trip);
        step.violation(trip, &code, reaction);
        self.settle(&mut step, Some(request), trip + 15.0);
        step.trial
    }

    fn direction(&self, name: &str, bit: u8, request: Request, side: f64) -> Trial {
        let window = self.value(64);
        let mut step = Step::new(
            name,
            format!("request at standstill, exceed {:.0} rpm", side * window + 0.0),
            "AMK-SDI",
        );
        self.start(&mut step, 0.0);
        let at = self.ask(&mut step, request);
        step.trial.course.speed(at + 50.0, 0.0);
        let trip = step.cross(at + 60.0 + window, side * window, side);
        step.quiet(trip);
        step.violation(trip, &format!("3606/{}", 100 + u32::from(bit)), Reaction::Sto);
        self.settle(&mut step, Some(request), trip + 15.0);
        step.trial
    }

    fn increment(&self, request: Request) -> Trial {
        let window = self.value(65).max(self.value(66)).max(0.0);
        let rpm = self.top.clamp(1.0, 60.0);
        let mut step =
            Step::new("SLI", format!("request, move by more than {window:.0} increments"), "AMK-SLI");
        self.start(&mut step, 0.0);
        let from = self.ask(&mut step, request) + 50.0;
        let trip = leaves_window_ms(from, rpm, window);
        step.trial.course.speed(from, 0.0).speed(from + 0.001, rpm).speed(trip + 5.0, rpm);
        let (code, reaction) = self.reaction(103, control::SLI);
        step.quiet(trip - 1.0);
        step.violation_near(trip, &code, reaction);
        self.settle(&mut step, Some(request), trip + 15.0);
        step.trial
    }

    fn maximum(&self, side: f64) -> Trial {
        let mut step = Step::new("SMS", format!("exceed {:.0} rpm", side * self.top), "AMK-SMS");
        self.start(&mut step, side * (self.top - 1.0).max(0.0));
        let trip = step.cross(REQUEST_MS, side * self.top, side);
        let (code, reaction) = self.reaction(68, 8);
        step.quiet(trip);
        step.violation(trip, &code, reaction);
        self.settle(&mut step, None, trip + 15.0);
        step.trial
    }
}
