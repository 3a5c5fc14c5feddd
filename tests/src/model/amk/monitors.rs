//! The safe operating modes and SMS: what each instance monitors and how it says so.

use crate::model::approach::{Approach, Phase, Window};

use super::codes::{Finding, Violation};
use super::parameters::{Parameters, Reaction};

/// What an instance monitors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// AMK-SMS-01 to 06.
    Sms,
    /// AMK-SOS-01 to 07.
    Sos,
    /// AMK-SSR-01 to 11; parameters from this number on.
    Ssr(u32),
    /// AMK-SLS-01 to 07; parameters from this number on.
    Sls(u32),
    /// AMK-SDI-01.
    Sdip,
    /// AMK-SDI-02.
    Sdin,
    /// AMK-SLI-01 to 06.
    Sli,
}

/// One row for each instance: kind, and the number that is its bit in both words; its
/// Info1 is the bit + 100 (AMKD-NUM-03).
pub const INSTANCES: [(Kind, u8); 11] = [
    (Kind::Sos, 3),
    (Kind::Ssr(30), 4),
    (Kind::Sdip, 5),
    (Kind::Sdin, 6),
    (Kind::Sms, 8),
    (Kind::Ssr(36), 9),
    (Kind::Ssr(42), 10),
    (Kind::Ssr(48), 11),
    (Kind::Sls(54), 12),
    (Kind::Sls(59), 13),
    (Kind::Sli, 14),
];

/// How far an instance is.
#[derive(Debug, Clone)]
enum State {
    Off,
    Running(Running),
    /// AMK-ACK-01: violated, acknowledgement withdrawn, waits for "clear error".
    Violated,
}

/// Latched values of one activation.
#[derive(Debug, Clone)]
struct Running {
    position: i64,
    approach: Option<Approach>,
    in_target: bool,
}

/// One instance.
#[derive(Debug, Clone)]
pub struct Monitor {
    kind: Kind,
    /// Bit of the instance in control and status word.
    pub bit: u8,
    state: State,
}

impl Monitor {
    /// All instances, off.
    pub fn all() -> Vec<Self> {
        INSTANCES.iter().map(|(kind, bit)| Self { kind: *kind, bit: *bit, state: State::Off }).collect()
    }

    /// AMK-SMS-02: always requested, in nobody's hand.
    pub fn is_always_requested(&self) -> bool {
        self.kind == Kind::Sms
    }

    /// Not evaluated, nothing latched (DEC-14).
    pub fn switch_off(&mut self) {
        self.state = State::Off;
    }

    /// After its error was cleared the instance may start again (DEC-17).
    pub fn cleared(&mut self) {
        if matches!(self.state, State::Violated) {
            self.state = State::Off;
        }
    }

    /// Whether the acknowledgement bit is 1.
    pub fn is_acknowledged(&self) -> bool {
        matches!(&self.state, State::Running(running) if running.in_target)
    }

    /// The reaction to a violation (AMK-GEN-19).
    fn reaction(&self, parameters: &Parameters) -> Reaction {
        match self.kind {
            Kind::Sms => parameters.reaction(68),
            Kind::Ssr(first) => parameters.reaction(first + 5),
            Kind::Sls(first) => parameters.reaction(first + 4),
            Kind::Sli => parameters.reaction(103),
            Kind::Sos | Kind::Sdip | Kind::Sdin => Reaction::Sto,
        }
    }

    /// The speed window of an instance.
    fn window(&self, parameters: &Parameters) -> Option<Window> {
        let plus_limit = parameters.value(67).abs() * 1000;
        let direction = parameters.value(64).abs() * 1000;
        match self.kind {
            Kind::Sms => Some(Window::symmetric_rpm(parameters.raw(67))),
            Kind::Sos => Some(Window::symmetric_rpm(parameters.raw(28))),
            Kind::Ssr(first) => {
                Some(Window::between_rpm(parameters.raw(first + 3), parameters.raw(first + 4)))
            }
            Kind::Sls(first) => Some(Window::symmetric_rpm(parameters.raw(first + 3))),
            // AMKP-SDI-02: the permitted side is bounded by Prm67.
            Kind::Sdip => Some(Window { lower: -direction, upper: plus_limit }),
            Kind::Sdin => Some(Window { lower: -plus_limit, upper: direction }),
            Kind::Sli => None,
        }
    }

    /// The position window, relative to the position latched at activation.
    fn position_window(&self, parameters: &Parameters) -> Option<Window> {
        match self.kind {
            // AMK-SOS-05: the half width, whatever its sign.
            Kind::Sos => {
                let half = parameters.value(29).abs();
                Some(Window { lower: -half, upper: half })
            }
            // AMK-SLI-01: swapped entries are equivalent.
            Kind::Sli => {
                let (one, other) = (parameters.value(65), parameters.value(66));
                Some(Window { lower: one.min(other), upper: one.max(other) })
            }
            _ => None,
        }
    }

    fn start(&mut self, parameters: &Parameters, now: i64, position: i64, speed: i64) {
        let target = self.window(parameters);
        let approach = match (self.kind, target) {
            (Kind::Ssr(first) | Kind::Sls(first), Some(target)) => {
                Some(parameters.approach(now, speed, first, first + 2, target))
            }
            _ => None,
        };
        self.state = State::Running(Running { position, approach, in_target: false });
    }

    /// Starts, stops and evaluates the instance at `now`.
    pub fn step(
        &mut self,
        parameters: &Parameters,
        requested: bool,
        now: i64,
        position: i64,
        speed: i64,
    ) -> Option<Violation> {
        if !requested {
            self.state = State::Off;
            return None;
        }
        if matches!(self.state, State::Off) {
            self.start(parameters, now, position, speed);
        }
        let finding = self.evaluate(parameters, now, position, speed)?;
        self.state = State::Violated;
        Some(Violation { function: 100 + u32::from(self.bit), finding, reaction: self.reaction(parameters) })
    }

    fn evaluate(&mut self, parameters: &Parameters, now: i64, position: i64, speed: i64) -> Option<Finding> {
        let speed_side = self.window(parameters).and_then(|window| window.side(speed));
        let position_window = self.position_window(parameters);
        let State::Running(running) = &mut self.state else { return None };
        if let Some(approach) = &running.approach {
            match approach.phase(now) {
                Phase::Delay => return None,
                Phase::Ramp => return Finding::on_ramp(approach, now, speed),
                // DEC-05: outside at the moment the line meets the window.
                Phase::Target if !running.in_target => {
                    running.in_target = speed_side.is_none();
                    return speed_side.map(|side| Finding::end_of_ramp(side, speed));
                }
                Phase::Target => {}
            }
        }
        running.in_target = true;
        let travelled = position - running.position;
        let position_side = position_window.and_then(|window| window.side(travelled));
        speed_side.map(Finding::Speed).or(position_side.map(Finding::Position))
    }
}
