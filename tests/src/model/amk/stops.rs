//! STO, SS1 and SS2 as one state (AMK-GEN-05, AMK-GEN-07, DEC-11 to DEC-13).

use crate::model::StopState;
use crate::model::approach::{Approach, Phase, Window};

use super::codes::{Finding, Violation};
use super::parameters::{Parameters, Reaction};

/// The stop in force.
#[derive(Debug, Clone)]
pub enum Stop {
    /// None.
    None,
    /// Torque off; whether an SS1 has ended here that is still requested (AMK-SS1-02).
    Sto { ended_ss1: bool },
    /// SS1 supervises the deceleration (AMK-SS1-02).
    Ss1(Approach),
    /// SS2 supervises the deceleration (AMK-SS2-05).
    Ss2(Approach),
    /// The SOS state of SS2 with its reference position (DEC-08).
    Standstill(i64),
}

/// Requested stop functions.
#[derive(Debug, Clone, Copy, Default)]
pub struct Requests {
    /// STO.
    pub sto: bool,
    /// SS1.
    pub ss1: bool,
    /// SS2.
    pub ss2: bool,
}

impl Stop {
    /// As crosscheck sees it.
    pub fn state(&self) -> StopState {
        match self {
            Self::None => StopState::None,
            Self::Sto { .. } => StopState::Sto,
            Self::Ss1(_) => StopState::Ss1,
            Self::Ss2(_) => StopState::Ss2,
            Self::Standstill(_) => StopState::Sos,
        }
    }

    /// DEC-12: a finished stop is left when nothing requests it and no error stands.
    pub fn leave(&mut self, requests: Requests, error_stands: bool) {
        if let Self::Sto { ended_ss1 } = self {
            *ended_ss1 &= requests.ss1;
        }
        let held = match self {
            // DEC-11: an SS1 that has ended here stands while its request stands; DEC-13:
            // one that STO came before is remembered, and begins now.
            Self::Sto { ended_ss1 } => requests.sto || *ended_ss1,
            Self::Standstill(_) => requests.ss2,
            _ => true,
        };
        if !held && !error_stands {
            *self = Self::None;
        }
    }

    /// DEC-13: STO over SS1 over SS2; a running stop is aborted only by a higher one.
    pub fn request(&mut self, requests: Requests, parameters: &Parameters, now: i64, speed: i64) {
        if requests.sto {
            self.go_to_sto();
        } else if requests.ss1 {
            self.start_ss1(parameters, now, speed);
        } else if requests.ss2 {
            self.start_ss2(parameters, now, speed);
        }
    }

    /// Starts a stop as error reaction.
    pub fn react(&mut self, reaction: Reaction, parameters: &Parameters, now: i64, speed: i64) {
        match reaction {
            Reaction::Sto => self.go_to_sto(),
            Reaction::Ss1 => self.start_ss1(parameters, now, speed),
            Reaction::Ss2 => self.start_ss2(parameters, now, speed),
        }
    }

    /// STO aborts what brakes (DEC-13); an SS1 is over then, and its request holds STO.
    pub fn go_to_sto(&mut self) {
        if self.state() != StopState::Sto {
            *self = Self::Sto { ended_ss1: self.state() == StopState::Ss1 };
        }
    }

    fn start_ss1(&mut self, parameters: &Parameters, now: i64, speed: i64) {
        if matches!(self, Self::None | Self::Ss2(_) | Self::Standstill(_)) {
            let target = Window::symmetric_rpm(parameters.raw(21));
            *self = Self::Ss1(parameters.approach(now, speed, 18, 20, target));
        }
    }

    fn start_ss2(&mut self, parameters: &Parameters, now: i64, speed: i64) {
        if matches!(self, Self::None) {
            let target = Window::symmetric_rpm(parameters.raw(26));
            *self = Self::Ss2(parameters.approach(now, speed, 23, 25, target));
        }
    }

    /// Supervises a running or standing stop; goes on to its end state.
    pub fn supervise(
        &mut self,
        parameters: &Parameters,
        now: i64,
        position: i64,
        speed: i64,
    ) -> Option<Violation> {
        match self {
            Self::None | Self::Sto { .. } => None,
            Self::Ss1(approach) => {
                let (phase, finding) = supervise_ramp(approach, now, speed);
                // AMK-SS1-02: at t >= t2 STO, whatever the speed is; AMK-SS1-09: at once when
                // it leaves its ramp.
                if phase == Phase::Target || finding.is_some() {
                    *self = Self::Sto { ended_ss1: true };
                }
                finding.map(|finding| Violation { function: 101, finding, reaction: Reaction::Sto })
            }
            Self::Ss2(approach) => {
                let (phase, finding) = supervise_ramp(approach, now, speed);
                if phase == Phase::Target {
                    *self = Self::Standstill(position);
                }
                finding.map(|finding| Violation { function: 102, finding, reaction: Reaction::Sto })
            }
            Self::Standstill(reference) => {
                let speed_side = Window::symmetric_rpm(parameters.raw(26)).side(speed);
                let half = parameters.value(27).abs();
                let position_side = Window { lower: -half, upper: half }.side(position - *reference);
                let finding = speed_side.map(Finding::Speed).or(position_side.map(Finding::Position));
                finding.map(|finding| Violation { function: 102, finding, reaction: Reaction::Sto })
            }
        }
    }
}

fn supervise_ramp(approach: &Approach, now: i64, speed: i64) -> (Phase, Option<Finding>) {
    let phase = approach.phase(now);
    let finding = match phase {
        Phase::Delay => None,
        Phase::Ramp => Finding::on_ramp(approach, now, speed),
        Phase::Target => approach.target.side(speed).map(|side| Finding::end_of_ramp(side, speed)),
    };
    (phase, finding)
}
