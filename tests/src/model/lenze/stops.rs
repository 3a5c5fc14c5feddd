//! STO, SS1, SS2 and SOS of the SM301 (LNZ-SS1, LNZ-SS2, LNZ-SOS, LNZ-RAMP, LNZ-PRIO).

use crate::model::StopState;
use crate::model::exact::Ratio;

use super::number;
use super::parameters::Parameters;

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

/// How a stop is.
#[derive(Debug, Clone, Copy)]
pub enum State {
    /// None.
    None,
    /// Torque off; whether SS1 led here, and whether the request of an SS1 that has run holds it.
    Sto { after_ss1: bool, held: bool },
    /// SS1 brakes.
    Ss1(Braking),
    /// SS2 brakes.
    Ss2(Braking),
    /// Position held.
    Sos(i64),
}

/// The stop in force.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    state: State,
    /// An emergency stop or an error is behind it: ES does not end it (LNZ-OMS-10).
    hard: bool,
    /// Only AIS ends it, whatever C15300 says (LNZ-OMS-12).
    needs_restart: bool,
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
    /// STO by emergency stop or crosscheck.
    pub emergency_sto: bool,
    /// SS1 by emergency stop.
    pub emergency_ss1: bool,
}

impl Requests {
    fn asks_for_sto(&self) -> bool {
        self.sto || self.emergency_sto
    }

    fn asks_for_ss1(&self) -> bool {
        self.ss1 || self.emergency_ss1
    }
}

impl Stop {
    /// No stop.
    pub const NONE: Self = Self { state: State::None, hard: false, needs_restart: false };

    /// As crosscheck sees it.
    pub fn state(&self) -> StopState {
        match self.state {
            State::None => StopState::None,
            State::Sto { .. } => StopState::Sto,
            State::Ss1(_) => StopState::Ss1,
            State::Ss2(_) => StopState::Ss2,
            State::Sos(_) => StopState::Sos,
        }
    }

    /// LNZ-SS1-11: at the end the STO bit is set in addition.
    pub fn shows_ss1(&self) -> bool {
        matches!(self.state, State::Ss1(_) | State::Sto { after_ss1: true, .. })
    }

    /// LNZ-SOS-06: at the end the SOS bit is set in addition.
    pub fn shows_ss2(&self) -> bool {
        matches!(self.state, State::Ss2(_) | State::Sos(_))
    }

    /// LNZ-OMS-10, LNZ-OMS-14: ES ends simple stops at once, not what is hard.
    pub fn confirm(&mut self, error: bool) {
        if !error && !self.hard {
            *self = Self::NONE;
        }
    }

    /// LNZ-OMS-13: nothing restarts by itself on the way back.
    pub fn demand_restart(&mut self) {
        self.needs_restart = !matches!(self.state, State::None);
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
        let (held, sub) = match &mut self.state {
            // DEC-11: an SS1 that has run stands; DEC-13: another one begins now.
            State::Sto { held, .. } => {
                *held &= requests.asks_for_ss1();
                (requests.asks_for_sto() || *held, 1)
            }
            State::Sos(_) => (requests.ss2, 2),
            _ => return,
        };
        let automatic = parameters.sub(15_300, sub) == 1 && !self.needs_restart;
        if held || error || !(automatic || restart) {
            return;
        }
        let to_sos = self.state() == StopState::Sto && requests.ss2 && !requests.asks_for_ss1();
        *self = Self::NONE;
        if to_sos {
            self.state = State::Sos(position);
        }
    }

    /// By priority.
    pub fn request(&mut self, requests: Requests, now: i64, speed: i64) {
        let rows = [
            (requests.emergency_sto, Target::Sto, true),
            (requests.sto, Target::Sto, false),
            (requests.emergency_ss1, Target::Ss1, true),
            (requests.ss1, Target::Ss1, false),
            (requests.ss2, Target::Ss2, false),
        ];
        for (_, target, hard) in rows.into_iter().filter(|row| row.0) {
            self.start(target, now, speed, hard);
        }
    }

    /// Starts a stop unless the same or a higher one is in force (DEC-13).
    pub fn start(&mut self, target: Target, now: i64, speed: i64, hard: bool) {
        let braking = Braking { started: now, latched: speed, standing_since: None };
        self.hard |= hard;
        match (target, &self.state) {
            (Target::Sto, State::Sto { .. }) | (Target::Ss1, State::Ss1(_)) | (_, State::Sto { .. }) => {}
            (Target::Sto, state) => {
                let held = matches!(state, State::Ss1(_));
                self.state = State::Sto { after_ss1: false, held };
            }
            (Target::Ss1, _) => self.state = State::Ss1(braking),
            (Target::Ss2, State::None) => self.state = State::Ss2(braking),
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
        match &mut self.state {
            State::None | State::Sto { .. } => None,
            State::Sos(reference) => {
                let left = (position - *reference).abs() > p.code(15_311);
                left.then_some(number::SOS)
            }
            State::Ss1(braking) => {
                let outcome = braking.step(p, now, speed, drive_n0, p.code(15_306) == 1, p.code(15_307));
                if outcome != Outcome::Brakes {
                    // LNZ-SS1-11: the bit of an SS1 that ended as it should.
                    self.state = State::Sto { after_ss1: outcome == Outcome::Done, held: true };
                }
                outcome.error()
            }
            State::Ss2(braking) => {
                let outcome = braking.step(p, now, speed, drive_n0, p.code(15_308) == 1, 0);
                if outcome == Outcome::Done {
                    self.state = State::Sos(position);
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
