//! Lenze SM301: every function that the safety bus or an input requests and the set gives a
//! limit, special operation, the inputs, and the cascade.

mod inputs;
mod special;

use shm_schema::{
    facts::lenze_sm301::{control, status},
    profile::{common, lenze_key},
    word::Word,
};

use super::{Probe, REQUEST_MS, Reaction, Step, Trial, leaves_window_ms, supervision};
use crate::set::AxisSet;

struct Lenze<'a> {
    axis: &'a AxisSet,
    top: f64,
    neutral: Word,
}

/// Function numbers of a free assignment (C15032) and of C15201: the bit of the control word.
const FUNCTIONS: [(&str, u8, i32); 9] = [
    ("STO", control::STO, 0),
    ("SS1", control::SS1, 1),
    ("SS2", control::SS2, 2),
    ("SLS1", control::SLS1, 3),
    ("SLS2", control::SLS2, 4),
    ("SLS3", control::SLS3, 5),
    ("SLS4", control::SLS4, 6),
    ("SDIpos", control::SDIPOS, 7),
    ("SDIneg", control::SDINEG, 8),
];
/// Glitch filter in front of every input, and a cycle, ms (LNZ-IN-11).
const FILTER_MS: f64 = 3.0;

/// How a function is requested.
#[derive(Clone, Copy)]
enum Request {
    /// Bit of the control word, active low.
    Word(u8),
    /// Input, by number.
    Input(u32),
    /// Nobody: it is always on.
    Always,
}

pub(super) fn trials(axis: &AxisSet) -> Vec<Trial> {
    let value = |code: u32, sub: u32| f64::from(axis.value(lenze_key(code, sub)));
    let top = if value(15_320, 0) > 0.0 { value(15_320, 0) } else { 1_000.0 };
    let lenze = Lenze { axis, top, neutral: Word::from_u32(axis.profile.neutral_word()) };
    let mut trials = lenze.stops();
    let encoder = lenze.set(15_400, 0) != 0;
    if encoder {
        trials.extend((1..=4).flat_map(|number| lenze.limits(number)));
        trials.extend(lenze.directions());
    }
    if value(15_320, 0) > 0.0 {
        trials.extend([1.0, -1.0].into_iter().filter_map(|side| lenze.maximum(side)));
    }
    trials.extend(lenze.special());
    trials.extend(lenze.inputs());
    trials.extend(supervision::trials(&lenze));
    trials
}

impl supervision::Manners for Lenze<'_> {
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

impl Lenze<'_> {
    fn value(&self, code: u32, sub: u32) -> f64 {
        f64::from(self.axis.value(lenze_key(code, sub)))
    }

    /// C15100: there is a bus; C15113: its bit passes the filter.
    fn passes(&self, bit: u8) -> bool {
        let filter = self.axis.value(lenze_key(15_113, 0)) as u32;
        let bus = self.axis.value(lenze_key(15_100, 0)) != 0;
        bus && filter >> bit & 1 == 1
    }

    fn set(&self, code: u32, sub: u32) -> i32 {
        self.axis.value(lenze_key(code, sub))
    }

    /// By the bus, or by the first input that has the function.
    fn request(&self, name: &str) -> Option<Request> {
        let (_, bit, function) = FUNCTIONS.into_iter().find(|row| row.0 == name)?;
        let input = || self.inputs_of(0).find(|input| self.set(15_032, *input) == function);
        if self.passes(bit) { Some(Request::Word(bit)) } else { input().map(Request::Input) }
    }

    /// SSE has an input of its own kind.
    fn emergency(&self) -> Option<Request> {
        let input = || self.inputs_of(1).next();
        if self.passes(control::SSE) {
            Some(Request::Word(control::SSE))
        } else {
            input().map(Request::Input)
        }
    }

    fn start(&self, function: &str, action: String, source: &str, rpm: f64) -> Step {
        let mut step = Step::new(function, action, source);
        step.trial.course.speed(0.0, rpm).command(0.0, self.neutral);
        self.connect(&mut step);
        if self.set(15_400, 0) == 0 {
            step.trial.course.set(0.0, "drive_n0", u8::from(rpm == 0.0));
        }
        step
    }

    /// Requests at [`REQUEST_MS`]; returns when it is in force.
    fn ask(&self, step: &mut Step, request: Request) -> f64 {
        match request {
            Request::Word(bit) => {
                step.trial.course.command(REQUEST_MS, self.neutral.with(bit, false));
                REQUEST_MS
            }
            Request::Input(input) => {
                step.trial.course.set(REQUEST_MS, inputs::COLUMNS[input as usize - 1], "00");
                REQUEST_MS + FILTER_MS + self.value(15_034, input)
            }
            Request::Always => REQUEST_MS,
        }
    }

    /// Still, released; error and restart acknowledged one after the other.
    fn settle(&self, step: &mut Step, from_ms: f64) {
        let still = from_ms + 100.0 + self.value(15_305, 0) + self.value(15_307, 0);
        step.trial.course.speed(still, 0.0).command(still + 50.0, self.neutral);
        if self.set(15_400, 0) == 0 {
            step.trial.course.set(still, "drive_n0", 1);
        }
        self.disconnect(step, from_ms, still + 50.0);
        let acknowledge = still + 200.0;
        for (at, bit) in [(0.0, control::PS_AIE), (100.0, control::PS_AIS)] {
            let word = self.neutral.with(bit, true);
            step.trial.course.command(acknowledge + at, word);
            step.trial.course.command(acknowledge + at + 50.0, self.neutral);
        }
        if self.by_bus() {
            // A cascade closes 100 ms after its acknowledgement (LNZ-CAS-06).
            step.recovered(acknowledge + 300.0);
            return;
        }
        // LNZ-ACK-01, LNZ-ACK-03: pulses of 0.3 s to 10 s at the terminals.
        step.trial.course.set(0.0, "aie", 0).set(acknowledge, "aie", 1).set(acknowledge + 400.0, "aie", 0);
        step.trial.course.set(0.0, "ais", 0).set(acknowledge + 500.0, "ais", 1).set(
            acknowledge + 900.0,
            "ais",
            0,
        );
        step.recovered(acknowledge + 1_100.0);
    }

    /// The acknowledge bits of the bus are heard.
    fn by_bus(&self) -> bool {
        self.passes(control::PS_AIE) && self.passes(control::PS_AIS)
    }

    /// LNZ-SMS-06: SLS and SMS have C15350 for their stop; without it STO follows at once.
    fn timed(&self, code: u32, sub: u32) -> Reaction {
        if self.value(15_350, 0) == 0.0 { Reaction::Sto } else { self.reaction(code, sub) }
    }

    fn reaction(&self, code: u32, sub: u32) -> Reaction {
        // Without a stopping time the end state follows at once.
        let immediate = self.value(15_305, 0) == 0.0;
        match (self.axis.value(lenze_key(code, sub)), immediate) {
            (0, _) | (1, true) => Reaction::Sto,
            (1, false) => Reaction::Stop(status::SS1_ACTIVE),
            (_, true) => Reaction::Stop(status::SOS_MONITORED),
            (_, false) => Reaction::Stop(status::SS2_ACTIVE),
        }
    }

    fn stops(&self) -> Vec<Trial> {
        let mut trials = Vec::new();
        let sse_is_sto = self.set(15_205, 0) == 0;
        let at_once = [("STO", self.request("STO")), ("SSE", self.emergency().filter(|_| sse_is_sto))];
        for (name, request) in at_once {
            trials.extend(request.map(|request| self.torque_off(name, request)));
        }
        let braked = [("SSE", self.emergency().filter(|_| !sse_is_sto)), ("SS1", self.request("SS1"))];
        for (name, request) in braked {
            let Some(request) = request else { continue };
            trials.push(self.braked(name, request, status::SS1_ACTIVE, Probe::TorqueOff, 15_306));
            trials.extend(self.flat(name, request));
        }
        if let Some(request) = self.request("SS2").filter(|_| self.set(15_400, 0) != 0) {
            let sos = Probe::Bit(status::SOS_MONITORED, true);
            trials.push(self.braked("SS2", request, status::SS2_ACTIVE, sos, 15_308));
            trials.extend(self.flat("SS2", request));
            trials.push(self.standstill(request));
        }
        trials
    }

    fn torque_off(&self, name: &str, request: Request) -> Trial {
        let mut step = self.start(name, format!("request at {:.0} rpm", self.top), "LNZ-STO", self.top);
        let at = self.ask(&mut step, request);
        step.quiet(REQUEST_MS);
        step.expect("torque off", REQUEST_MS, at + 2.0, Probe::TorqueOff);
        step.trial.course.speed(at + 20.0, self.top);
        self.settle(&mut step, at + 20.0);
        step.trial
    }

    /// A stop that is still well before the stopping time ends; `mode` 1 ends it there.
    fn braked(&self, name: &str, request: Request, active: u8, end: Probe, mode: u32) -> Trial {
        let stopping = self.value(15_305, 0);
        let top = if stopping < 20.0 { 0.0 } else { self.top };
        let mut step = self.start(name, format!("request at {top:.0} rpm, brake in time"), "LNZ-SS1", top);
        let at = self.ask(&mut step, request);
        // Straight to standstill, steeper than any ramp the stopping time permits.
        let still = at + 0.5 * stopping.max(2.0);
        step.trial.course.speed(REQUEST_MS, top).speed(still, 0.0);
        if self.set(15_400, 0) == 0 {
            step.trial.course.set(still, "drive_n0", 1);
        }
        if stopping > 4.0 {
            let what = format!("{name} runs (status bit {active})");
            step.expect(what, REQUEST_MS, at + 2.0, Probe::Bit(active, true));
        }
        let at_zero = self.set(mode, 0) == 1;
        let (what, earliest) = if at_zero {
            ("end state at standstill, after the stopping time at the latest", REQUEST_MS)
        } else {
            ("end state after the stopping time C15305", REQUEST_MS + stopping - 1.0)
        };
        step.expect(what, earliest, at + stopping + 4.0, end);
        self.settle(&mut step, at + stopping);
        step.trial
    }

    /// LNZ-SS1-03, LNZ-SS2-06, LNZ-RAMP-05: a drive that does not brake.
    fn flat(&self, name: &str, request: Request) -> Option<Trial> {
        let stopping = self.value(15_305, 0);
        if self.top <= self.value(15_310, 0) || stopping < 20.0 {
            return None;
        }
        let mut step = self.start(name, "request, and do not brake".into(), "LNZ-SS1-03", self.top);
        let at = self.ask(&mut step, request);
        let ramp = self.set(15_315, 0) == 1 && self.set(15_400, 0) != 0;
        let (earliest, code) = if ramp { (REQUEST_MS, "110") } else { (REQUEST_MS + stopping - 1.0, "97") };
        step.quiet(REQUEST_MS);
        let latest = at + stopping + 3.0;
        step.expect(format!("code {code}, both channels"), earliest, latest, Probe::Code(code.into()));
        step.expect("torque off", earliest, latest, Probe::TorqueOff);
        step.trial.course.speed(latest + 10.0, self.top);
        self.settle(&mut step, latest + 10.0);
        Some(step.trial)
    }

    fn standstill(&self, request: Request) -> Trial {
        let window = self.value(15_311, 0);
        let mut step = self.start(
            "SOS",
            format!("request SS2 at standstill, turn out of {window:.0} increments"),
            "LNZ-SOS",
            0.0,
        );
        let from = self.ask(&mut step, request) + self.value(15_305, 0) + 100.0;
        let rpm = self.value(15_310, 0).clamp(1.0, 60.0);
        let trip = leaves_window_ms(from, rpm, window);
        step.trial.course.speed(from, 0.0).speed(from + 0.001, rpm).speed(trip + 5.0, rpm);
        step.quiet(from);
        step.violation_near(trip, "106", Reaction::Sto);
        self.settle(&mut step, trip + 10.0);
        step.trial
    }

    /// SLSn on each side that it enables.
    fn limits(&self, number: u32) -> Vec<Trial> {
        let request = self.request(&format!("SLS{number}")).filter(|_| self.value(15_330, number) > 0.0);
        let Some(request) = request else { return Vec::new() };
        [1.0, -1.0].into_iter().filter_map(|side| self.limit(number, request, side)).collect()
    }

    /// A direction that C15340 or C15333 does not enable.
    fn blocked(&self, enabled: i32, side: f64) -> bool {
        enabled == if side > 0.0 { 2 } else { 1 }
    }

    fn limit(&self, number: u32, request: Request, side: f64) -> Option<Trial> {
        // C15333: in a direction that is not enabled there is no speed to exceed.
        let blocked = [self.set(15_333, number), self.set(15_340, 0)];
        if blocked.into_iter().any(|enabled| self.blocked(enabled, side)) {
            return None;
        }
        let limit = self.value(15_330, number);
        let top = self.top.max(limit);
        let mut step = self.start(
            &format!("SLS{number}"),
            format!("request at {:.0} rpm, brake to {limit:.0} rpm, exceed it", side * top),
            "LNZ-SLS",
            side * top,
        );
        let at = self.ask(&mut step, request);
        let braking = self.value(15_331, number);
        let slow = side * (limit - 1.0).max(0.0);
        let begin = if braking < 4.0 { REQUEST_MS - 60.0 } else { REQUEST_MS };
        step.trial.course.speed(begin, side * top);
        step.trial.course.speed(begin + (0.8 * braking).max(50.0).min(braking.max(55.0)), slow);
        let hold = at + braking + 60.0;
        let trip = step.cross(hold, side * limit, side);
        step.quiet(trip);
        step.violation(trip, &(97 + number).to_string(), self.timed(15_332, number));
        self.settle(&mut step, trip + 15.0 + self.value(15_350, 0));
        Some(step.trial)
    }

    /// LNZ-SDI-08: by request, permanently, or with an SLS.
    fn directions(&self) -> Vec<Trial> {
        let rows = [("SDIpos", 1, "103", -1.0), ("SDIneg", 2, "104", 1.0)];
        let of = |(name, enabled, code, side)| {
            let with_sls = || {
                let mut directed = (1..=4).filter(|number| self.set(15_333, *number) == enabled);
                directed.find_map(|number| self.request(&format!("SLS{number}")))
            };
            let always = (self.set(15_340, 0) == enabled).then_some(Request::Always);
            let request = always.or_else(|| self.request(name)).or_else(with_sls)?;
            // Where the other direction is never enabled, this one cannot be left by itself.
            Some(self.direction(name, request, code, side))
        };
        rows.into_iter().filter_map(of).collect()
    }

    fn direction(&self, name: &str, request: Request, code: &str, side: f64) -> Trial {
        let (delay, window) = (self.value(15_341, 0), self.value(15_342, 0));
        let mut step = self.start(
            name,
            format!("request at standstill, move {window:.0} increments the other way"),
            "LNZ-SDI",
            0.0,
        );
        let from = self.ask(&mut step, request) + delay + 50.0;
        let rpm = 60.0_f64.min(self.top);
        let trip = leaves_window_ms(from, rpm, window);
        step.trial.course.speed(from, 0.0).speed(from + 0.001, side * rpm).speed(trip + 5.0, side * rpm);
        step.quiet(from);
        step.violation_near(trip, code, self.reaction(15_343, 0));
        self.settle(&mut step, trip + 10.0);
        step.trial
    }

    fn maximum(&self, side: f64) -> Option<Trial> {
        // C15340: a direction that is never enabled has no speed to exceed.
        if self.blocked(self.set(15_340, 0), side) {
            return None;
        }
        let below = side * (self.top - 1.0).max(0.0);
        let mut step = self.start("SMS", format!("exceed {:.0} rpm", side * self.top), "LNZ-SMS", below);
        let trip = step.cross(REQUEST_MS, side * self.top, side);
        step.quiet(trip);
        step.violation(trip, "105", self.timed(15_321, 0));
        self.settle(&mut step, trip + 15.0 + self.value(15_350, 0));
        Some(step.trial)
    }
}
