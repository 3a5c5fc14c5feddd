//! STO, SS1, SS2 and SOS of the SM301 (LNZ-SS1, LNZ-SS2, LNZ-SOS, LNZ-RAMP, LNZ-PRIO).

use crate::model::StopState;
use crate::model::exact::Ratio;

use super::{Parameters, number};

/// A stop that a request or a violation asks for, by priority (LNZ-PRIO-01, LNZ-PRIO-02).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// Torque off.
    Sto,
    /// Brake, then torque off.
    Ss1,
    /// Brake, then hold.
    Ss2,
}

/// One braking.
#[derive(Debug, Clone, Copy)]
pub struct Braking {
    started: i64,
    latched: i64,
    standing_since: Option<i64>,
}

/// The stop in force.
#[derive(Debug, Clone, Copy)]
pub enum Stop {
    /// None.
    None,
    /// Torque off; whether SS1 led here.
    Sto { after_ss1: bool },
    /// SS1 brakes.
    Ss1(Braking),
    /// SS2 brakes.
    Ss2(Braking),
    /// Position held.
    Sos(i64),
}

/// Requested stops.
#[derive(Debug, Clone, Copy)]
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
            Self::Sos(_) => StopState::Sos,
        }
    }

    /// LNZ-SS1-11: at the end the STO bit is set in addition.
    pub fn shows_ss1(&self) -> bool {
        matches!(self, Self::Ss1(_) | Self::Sto { after_ss1: true })
    }

    /// LNZ-SOS-06: at the end the SOS bit is set in addition.
    pub fn shows_ss2(&self) -> bool {
        matches!(self, Self::Ss2(_) | Self::Sos(_))
    }

    /// DEC-12, LNZ-RST-01; LNZ-PRIO-04, LNZ-SOS-04: from STO straight to a standing SS2's SOS.
    pub fn leave(
        &mut self,
        requests: Requests,
        error: bool,
        restart: bool,
        position: i64,
        parameters: &Parameters,
    ) {
        let (held, sub) = match self {
            Self::Sto { .. } => (requests.sto || requests.ss1, 1),
            Self::Sos(_) => (requests.ss2, 2),
            _ => return,
        };
        let automatic = parameters.sub(15_300, sub) == 1;
        if held || error || !(automatic || restart) {
            return;
        }
        let to_sos = matches!(self, Self::Sto { .. }) && requests.ss2;
        *self = if to_sos { Self::Sos(position) } else { Self::None };
    }

    /// By priority.
    pub fn request(&mut self, requests: Requests, now: i64, speed: i64) {
        let rows = [(requests.sto, Target::Sto), (requests.ss1, Target::Ss1), (requests.ss2, Target::Ss2)];
        for (_, target) in rows.into_iter().filter(|row| row.0) {
            self.start(target, now, speed);
        }
    }

    /// Starts a stop unless the same or a higher one is in force (DEC-13).
    pub fn start(&mut self, target: Target, now: i64, speed: i64) {
        let braking = Braking { started: now, latched: speed, standing_since: None };
        match (target, &*self) {
            (Target::Sto, Self::Sto { .. }) | (Target::Ss1, Self::Ss1(_)) | (_, Self::Sto { .. }) => {}
            (Target::Sto, _) => *self = Self::Sto { after_ss1: false },
            (Target::Ss1, _) => *self = Self::Ss1(braking),
            (Target::Ss2, Self::None) => *self = Self::Ss2(braking),
            (Target::Ss2, _) => {}
        }
    }

    /// Supervises; goes on to the end state; an error's number.
    pub fn supervise(
        &mut self,
        p: &Parameters,
        now: i64,
        position: i64,
        speed: i64,
        drive_n0: bool,
    ) -> Option<u32> {
        match self {
            Self::None | Self::Sto { .. } => None,
            Self::Sos(reference) => {
                let left = (position - *reference).abs() > p.code(15_311);
                left.then_some(number::SOS)
            }
            Self::Ss1(braking) => {
                let outcome = braking.step(p, now, speed, drive_n0, p.code(15_306) == 1, p.code(15_307));
                if outcome != Outcome::Brakes {
                    *self = Self::Sto { after_ss1: true };
                }
                outcome.error()
            }
            Self::Ss2(braking) => {
                let outcome = braking.step(p, now, speed, drive_n0, p.code(15_308) == 1, 0);
                if outcome == Outcome::Done {
                    *self = Self::Sos(position);
                }
                outcome.error()
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Brakes,
    Done,
    NotStopped,
    OffRamp,
}

impl Outcome {
    fn error(self) -> Option<u32> {
        match self {
            Self::NotStopped => Some(number::NOT_STOPPED),
            Self::OffRamp => Some(number::RAMP),
            _ => None,
        }
    }
}

impl Braking {
    fn step(
        &mut self,
        p: &Parameters,
        now: i64,
        speed: i64,
        drive_n0: bool,
        at_zero: bool,
        wait: i64,
    ) -> Outcome {
        let window = p.code(15_310) * 1000;
        let has_encoder = p.code(15_400) != 0;
        // LNZ-SS1-02: without an encoder the drive's own word for it.
        let stands = if has_encoder { speed.abs() <= window } else { drive_n0 };
        self.standing_since = if stands { self.standing_since.or(Some(now)) } else { None };
        if now - self.started >= p.code(15_305) {
            return if stands { Outcome::Done } else { Outcome::NotStopped };
        }
        // LNZ-SS1-04, LNZ-SS2-02: at n = 0, after the additional time.
        if at_zero && self.standing_since.is_some_and(|since| now - since >= wait) {
            return Outcome::Done;
        }
        let off = has_encoder && p.code(15_315) == 1 && self.is_off_the_ramp(p, now, speed, window);
        if off { Outcome::OffRamp } else { Outcome::Brakes }
    }

    /// LNZ-RAMP-03, LNZ-RAMP-04, DEC-49.
    fn is_off_the_ramp(&self, p: &Parameters, now: i64, speed: i64, window: i64) -> bool {
        let size = self.latched.abs();
        let percent = p.code(15_317);
        let offset = if percent == 0 { Ratio::whole(window) } else { Ratio::whole(size * percent).over(100) };
        let start = Ratio::whole(size).plus(offset);
        // 10 % to 30 % of the stopping time.
        let total = Ratio::whole(p.code(15_305));
        let delay = total.times(1000 + 20 * p.code(15_316)).over(10_000);
        let elapsed = Ratio::whole(now - self.started);
        let line = if elapsed <= delay {
            start
        } else {
            let left = total.minus(elapsed);
            start.scaled(left, total.minus(delay))
        };
        let line = line.max(Ratio::whole(window));
        let own = if self.latched < 0 { -speed } else { speed };
        Ratio::whole(own) > line || own < -window
    }
}
