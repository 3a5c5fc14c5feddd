//! Lenze SM301: every function that the safety bus lets through and the set gives a limit.
//! Special operation, enable switch and cascading need switches of the plant: by hand.

use shm_schema::{
    facts::lenze_sm301::{control, status},
    profile::lenze_key,
};

use super::{Probe, REQUEST_MS, Reaction, Step, Trial, leaves_window_ms};
use crate::set::AxisSet;

struct Lenze<'a> {
    axis: &'a AxisSet,
    top: f64,
    neutral: u64,
}

pub(super) fn trials(axis: &AxisSet) -> Vec<Trial> {
    let value = |code: u32, sub: u32| f64::from(axis.value(lenze_key(code, sub)));
    let top = if value(15_320, 0) > 0.0 { value(15_320, 0) } else { 1_000.0 };
    let lenze = Lenze { axis, top, neutral: u64::from(axis.profile.neutral_word()) };
    let mut trials = lenze.stops();
    let sls = [control::SLS1, control::SLS2, control::SLS3, control::SLS4];
    for (number, bit) in (1..).zip(sls) {
        let used = [lenze.value(15_330, number) > 0.0, lenze.passes(bit)];
        if !used.contains(&false) {
            trials.extend([1.0, -1.0].into_iter().filter_map(|side| lenze.limit(number, bit, side)));
        }
    }
    for (name, bit, code, side) in
        [("SDIpos", control::SDIPOS, "103", -1.0), ("SDIneg", control::SDINEG, "104", 1.0)]
    {
        if lenze.passes(bit) {
            trials.push(lenze.direction(name, bit, code, side));
        }
    }
    if lenze.value(15_320, 0) > 0.0 {
        trials.extend([1.0, -1.0].into_iter().filter_map(|side| lenze.maximum(side)));
    }
    trials
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

    fn start(&self, function: &str, action: String, source: &str, rpm: f64) -> Step {
        let mut step = Step::new(function, action, source);
        step.trial.course.speed(0.0, rpm).command(0.0, self.neutral);
        step
    }

    fn ask(&self, step: &mut Step, bit: u8) {
        step.trial.course.command(REQUEST_MS, self.neutral & !(1 << bit));
    }

    /// Still, released; error and restart acknowledged one after the other.
    fn settle(&self, step: &mut Step, from_ms: f64) {
        let still = from_ms + 100.0 + self.value(15_305, 0) + self.value(15_307, 0);
        step.trial.course.speed(still, 0.0).command(still + 50.0, self.neutral);
        for (at, bit) in [(200.0, control::PS_AIE), (300.0, control::PS_AIS)] {
            let word = self.neutral | 1 << bit;
            step.trial.course.command(still + at, word).command(still + at + 50.0, self.neutral);
        }
        step.recovered(still + 360.0);
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
        let at = REQUEST_MS;
        for (name, bit) in [("STO", control::STO), ("SSE", control::SSE)] {
            let ends_in_sto = bit == control::STO || self.axis.value(lenze_key(15_205, 0)) == 0;
            if self.passes(bit) && ends_in_sto {
                let mut step =
                    self.start(name, format!("request at {:.0} rpm", self.top), "LNZ-STO", self.top);
                self.ask(&mut step, bit);
                step.quiet(at);
                step.expect("torque off", at, at + 2.0, Probe::TorqueOff);
                step.trial.course.speed(at + 20.0, self.top);
                self.settle(&mut step, at + 20.0);
                trials.push(step.trial);
            }
        }
        let stopping = self.value(15_305, 0);
        let at_zero = |code| self.axis.value(lenze_key(code, 0)) == 1;
        if self.passes(control::SS1) && !at_zero(15_306) {
            trials.push(self.braked("SS1", control::SS1, status::SS1_ACTIVE, Probe::TorqueOff));
        }
        if self.passes(control::SS2) && self.value(15_400, 0) > 0.0 {
            if !at_zero(15_308) {
                let sos = Probe::Bit(status::SOS_MONITORED, true);
                trials.push(self.braked("SS2", control::SS2, status::SS2_ACTIVE, sos));
            }
            trials.push(self.standstill(at + stopping));
        }
        trials
    }

    /// A stop that is still well before the stopping time ends.
    fn braked(&self, name: &str, bit: u8, active: u8, end: Probe) -> Trial {
        let at = REQUEST_MS;
        let stopping = self.value(15_305, 0);
        let top = if stopping < 20.0 { 0.0 } else { self.top };
        let mut step = self.start(name, format!("request at {top:.0} rpm, brake in time"), "LNZ-SS1", top);
        self.ask(&mut step, bit);
        // Straight to standstill, steeper than any ramp the stopping time permits.
        step.trial.course.speed(at, top).speed(at + 0.5 * stopping.max(2.0), 0.0);
        if stopping > 4.0 {
            step.expect(format!("{name} runs (status bit {active})"), at, at + 2.0, Probe::Bit(active, true));
        }
        step.expect(
            "end state after the stopping time C15305",
            at + stopping - 1.0,
            at + stopping + 4.0,
            end,
        );
        self.settle(&mut step, at + stopping);
        step.trial
    }

    fn standstill(&self, end_ms: f64) -> Trial {
        let window = self.value(15_311, 0);
        let mut step = self.start(
            "SOS",
            format!("request SS2 at standstill, turn out of {window:.0} increments"),
            "LNZ-SOS",
            0.0,
        );
        self.ask(&mut step, control::SS2);
        let from = end_ms + 100.0;
        let rpm = self.value(15_310, 0).clamp(1.0, 60.0);
        let trip = leaves_window_ms(from, rpm, window);
        step.trial.course.speed(from, 0.0).speed(from + 0.001, rpm).speed(trip + 5.0, rpm);
        step.quiet(from);
        step.violation_near(trip, "106", Reaction::Sto);
        self.settle(&mut step, trip + 10.0);
        step.trial
    }

    fn limit(&self, number: u32, bit: u8, side: f64) -> Option<Trial> {
        // C15333: in a direction that is not enabled there is no speed to exceed.
        let blocked = if side > 0.0 { 2 } else { 1 };
        if self.axis.value(lenze_key(15_333, number)) == blocked {
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
        self.ask(&mut step, bit);
        let braking = self.value(15_331, number);
        let slow = side * (limit - 1.0).max(0.0);
        let begin = if braking < 4.0 { REQUEST_MS - 60.0 } else { REQUEST_MS };
        step.trial.course.speed(begin, side * top);
        step.trial.course.speed(begin + (0.8 * braking).max(50.0).min(braking.max(55.0)), slow);
        let hold = REQUEST_MS + braking + 60.0;
        let trip = step.cross(hold, side * limit, side);
        step.quiet(trip);
        step.violation(trip, &(97 + number).to_string(), self.timed(15_332, number));
        self.settle(&mut step, trip + 15.0 + self.value(15_350, 0));
        Some(step.trial)
    }

    fn direction(&self, name: &str, bit: u8, code: &str, side: f64) -> Trial {
        let (delay, window) = (self.value(15_341, 0), self.value(15_342, 0));
        let mut step = self.start(
            name,
            format!("request at standstill, move {window:.0} increments the other way"),
            "LNZ-SDI",
            0.0,
        );
        self.ask(&mut step, bit);
        let from = REQUEST_MS + delay + 50.0;
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
        let blocked = if side > 0.0 { 2 } else { 1 };
        if self.axis.value(lenze_key(15_340, 0)) == blocked {
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
