//! One channel of the ATV340 safety module: STO, SS1, six types of SLS, three modes of SMS.
//!
//! Speeds are judged as electrical frequency (DEC-32), exactly: the speed in 1/1000 rpm
//! times the pole pairs against tenths of a hertz times 6,000. Both channels do the same.

use std::collections::{BTreeMap, BTreeSet};

use shm_schema::facts::atv340::{control, status};
use shm_schema::word::Word;

use super::{Channel, ChannelView, ModelInput, StopState};

#[cfg(test)]
mod tests;

/// One tenth of a hertz in 1/1000 rpm times pole pairs.
const TENTH_HERTZ: i64 = 6000;
/// STO after a completed stop whose request is gone, ms (ATV-SS1-11, DEC-48).
const RELEASE_AFTER: i64 = 100;

/// SME numbers.
mod sme {
    pub const SS1_RAMP: u32 = 0x011;
    pub const SS1_REPEATED: u32 = 0x068;
    pub const SLS_RAMP: u32 = 0x0A9;
    pub const SLS_THRESHOLD: u32 = 0x0AB;
    pub const SMS_POSITIVE: u32 = 0x0B4;
    pub const SMS_NEGATIVE: u32 = 0x0B5;
    pub const RESERVED_BIT: u32 = 0x152;
    pub const SS1_NOT_USED: u32 = 0x156;
    pub const SLS_NOT_USED: u32 = 0x157;
    pub const SMS_NOT_USED: u32 = 0x158;
}

/// Which requests asked for an SS1 while it ran, and hold its end: SS1 itself, and SLS of
/// types 3 and 6 (also for STO below the standstill level).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Holders {
    ss1: bool,
    sls: bool,
}

impl Holders {
    fn and(self, other: Self) -> Self {
        Self { ss1: self.ss1 || other.ss1, sls: self.sls || other.sls }
    }
}

const BY_SS1: Holders = Holders { ss1: true, sls: false };
const BY_SLS: Holders = Holders { ss1: false, sls: true };

/// What waits in STO for its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Waits {
    AfterSs1,
    BelowStandstill,
}

#[derive(Debug, Clone)]
enum Stop {
    None,
    /// Since when, which request holds it besides STO and errors, and whether a completed
    /// stop waits here (ATV-PSF-09).
    Sto {
        since: i64,
        holders: Holders,
        waits: Option<Waits>,
    },
    Ss1 {
        started: i64,
        /// Fastest so far, with its direction.
        fastest: i64,
        holders: Holders,
    },
}

#[derive(Debug, Clone)]
enum Sls {
    Off,
    /// Types 2 and 3 below the standstill level: waits for SC54.
    Waiting {
        started: i64,
    },
    /// Types 2 and 5 above the threshold: line from the frequency at activation.
    Line {
        started: i64,
        latched: i64,
    },
    /// Types 3 and 6 above the threshold: SS1 brakes, and nothing else is monitored.
    Braked,
    /// Constant limits.
    Limits,
}

/// One ATV channel.
#[derive(Debug, Clone)]
pub struct Atv {
    parameters: BTreeMap<u32, i32>,
    now: i64,
    reset_before: Option<bool>,
    stop: Stop,
    sls: Sls,
    signed_before: i64,
    ss1_violations: u32,
    errors: BTreeSet<u32>,
}

impl Atv {
    /// A settled channel.
    pub fn new(given: &BTreeMap<u32, i32>) -> Self {
        Self {
            parameters: given.clone(),
            now: 0,
            reset_before: None,
            stop: Stop::None,
            sls: Sls::Off,
            signed_before: 0,
            ss1_violations: 0,
            errors: BTreeSet::new(),
        }
    }

    fn raw(&self, number: u32) -> i64 {
        i64::from(self.parameters.get(&number).copied().unwrap_or(0))
    }

    /// A frequency parameter in the exact unit of this module.
    fn frequency(&self, number: u32) -> i64 {
        self.raw(number) * TENTH_HERTZ
    }

    fn state(&self) -> StopState {
        match self.stop {
            Stop::None => StopState::None,
            Stop::Sto { .. } => StopState::Sto,
            Stop::Ss1 { .. } => StopState::Ss1,
        }
    }

    fn go_to_sto(&mut self, holders: Holders, waits: Option<Waits>) {
        // An SS1 that has run and is aborted is over, and its requests hold its end state
        // (DEC-13).
        let holders = match self.stop {
            Stop::Ss1 { started, holders: of_ss1, .. } => {
                // What SLS started in this very cycle has not run.
                let by_sls = of_ss1.sls && started < self.now;
                holders.and(Holders { ss1: of_ss1.ss1, sls: by_sls })
            }
            _ => holders,
        };
        if self.state() != StopState::Sto {
            self.stop = Stop::Sto { since: self.now, holders, waits };
        }
    }

    /// Errors whose cause stands in the command itself (ATV-PSF-07, ATV-SS1-18,
    /// ATV-SLS-13, ATV-SMS-14).
    fn command_errors(&self, word: &Word) -> BTreeSet<u32> {
        let known = [control::STO, control::SS1, control::SAFETY_RESET, control::SLS, control::SMS_SWITCH];
        let reserved = (0..16).any(|bit| word.bit(bit) && !known.contains(&bit));
        let rows = [
            (reserved, sme::RESERVED_BIT),
            (word.bit(control::SS1) && self.raw(65) == 0, sme::SS1_NOT_USED),
            (word.bit(control::SLS) && self.raw(66) == 0, sme::SLS_NOT_USED),
            (word.bit(control::SMS_SWITCH) && self.raw(56) == 0, sme::SMS_NOT_USED),
        ];
        rows.into_iter().filter(|row| row.0).map(|row| row.1).collect()
    }

    /// ATV-PSF-08: the rising edge of Safety Reset clears what has no cause any more;
    /// class 4 ends with the power only.
    fn reset(&mut self, word: &Word, standing: &BTreeSet<u32>) -> u32 {
        let level = word.bit(control::SAFETY_RESET);
        let before = self.reset_before.replace(level).unwrap_or(level);
        if level && !before {
            self.errors.retain(|code| *code == sme::SS1_REPEATED || standing.contains(code));
        }
        u32::from(level)
    }

    /// DEC-12, ATV-SS1-11, ATV-SS1-12: nothing asks for a restart acknowledge.
    fn leave(&mut self, sto: bool, ss1: bool, sls: bool) {
        let Stop::Sto { since, holders, waits } = &mut self.stop else { return };
        *holders = Holders { ss1: holders.ss1 && ss1, sls: holders.sls && sls };
        let (since, holders, waits) = (*since, *holders, *waits);
        // DEC-11, DEC-13: what has run stands while its request stands; an SS1 that STO came
        // before is remembered, and begins now.
        let held = holders.ss1 || holders.sls;
        // Only a completed SS1 rests; SLS at standstill ends with its request.
        let rest = if waits == Some(Waits::AfterSs1) { RELEASE_AFTER } else { 0 };
        let over = self.now - since >= rest;
        if !sto && !held && over && self.errors.is_empty() {
            self.stop = Stop::None;
        }
    }

    fn start_ss1(&mut self, holders: Holders, signed: i64) {
        match &mut self.stop {
            Stop::None => self.stop = Stop::Ss1 { started: self.now, fastest: signed, holders },
            Stop::Ss1 { holders: all, .. } => {
                *all = all.and(holders);
            }
            Stop::Sto { .. } => {}
        }
    }

    /// ATV-SEQ-01, ATV-SS1-06 to 10.
    fn supervise_ss1(&mut self, signed: i64) {
        let magnitude = signed.abs();
        let now = self.now;
        let delay = self.raw(34);
        let Stop::Ss1 { started, fastest, holders } = &mut self.stop else { return };
        let (started, holders) = (*started, *holders);
        let elapsed = now - started - delay;
        if elapsed < 0 {
            // DEC-03: from the highest frequency seen during the delay.
            if magnitude > fastest.abs() {
                *fastest = signed;
            }
        }
        let (highest, own) = (fastest.abs(), if *fastest < 0 { -signed } else { signed });
        if magnitude <= self.frequency(33) {
            self.go_to_sto(holders, Some(Waits::AfterSs1));
            return;
        }
        // Compared in thousandths, so that the slope needs no division.
        let line = (highest + self.frequency(32)) * 1000 - self.frequency(31) * elapsed;
        // DEC-06: in its own direction the line, on the other side the standstill level.
        let over_line = own * 1000 > line || own < -self.frequency(33);
        let line_has_ended = line <= self.frequency(33) * 1000;
        if elapsed >= 0 && (over_line || line_has_ended) {
            self.ss1_violations += 1;
            // ATV-SS1-09: the fifth needs the power off.
            let fifth = self.raw(35) == 1 && self.ss1_violations >= 5;
            self.errors.insert(if fifth { sme::SS1_REPEATED } else { sme::SS1_RAMP });
            // DEC-11: the SS1 that left its ramp has ended too, and its request holds it.
            self.go_to_sto(holders, None);
        }
    }

    fn sls_type(&self) -> i64 {
        self.raw(39)
    }

    /// Types 1 to 3 have a standstill level, unless it is inactive.
    fn is_below_standstill(&self, magnitude: i64) -> bool {
        let has_level = self.sls_type() <= 3 && self.raw(46) > 0;
        has_level && magnitude < self.frequency(46)
    }

    /// The zones at activation, row by row of the catalogue's table.
    #[allow(clippy::match_same_arms, reason = "row by row as the catalogue's table")]
    fn activate_sls(&mut self, signed: i64) {
        let magnitude = signed.abs();
        let above = magnitude > self.frequency(48);
        match (self.sls_type(), above) {
            (1 | 4, true) => self.violate_sls(sme::SLS_THRESHOLD),
            (2 | 5, true) => self.sls = Sls::Line { started: self.now, latched: magnitude },
            (3 | 6, true) => {
                self.start_ss1(BY_SLS, signed);
                self.sls = Sls::Braked;
            }
            // ATV-SLST1-04: no wait time.
            (1, false) => self.sls = Sls::Limits,
            (2 | 3, false) if self.is_below_standstill(magnitude) => {
                self.sls = Sls::Waiting { started: self.now };
            }
            (2..=6, false) => self.sls = Sls::Limits,
            // No type: nothing is permitted.
            _ => self.violate_sls(sme::SLS_NOT_USED),
        }
    }

    fn violate_sls(&mut self, code: u32) {
        self.errors.insert(code);
        self.go_to_sto(Holders::default(), None);
    }

    /// ATV-SLST4-01, ATV-SLST5-03: only types 4 to 6 let the direction change; a reversal
    /// between two samples has passed the standstill level.
    fn has_passed_standstill(&self, signed: i64) -> bool {
        let reversed = self.signed_before.signum() * signed.signum() < 0;
        self.is_below_standstill(0) && reversed
    }

    fn supervise_sls(&mut self, signed: i64) {
        let magnitude = signed.abs();
        if let Sls::Line { started, latched } = self.sls {
            // ATV-SLST2-02: from the threshold on constant limits.
            if magnitude <= self.frequency(48) {
                self.sls = Sls::Limits;
            } else {
                let elapsed = self.now - started;
                // SC41 is forced equal to SC40, as SC47, SC49 and SC51 to their fellows (ATV-SLS-03).
                let line = (latched + self.frequency(43)) * 1000 - self.frequency(40) * elapsed;
                let ended = line <= self.frequency(48) * 1000;
                if magnitude * 1000 > line || ended {
                    self.violate_sls(sme::SLS_RAMP);
                }
                return;
            }
        }
        if let Sls::Waiting { started } = self.sls {
            if self.is_below_standstill(magnitude) {
                // ATV-SLST2-06: no error at the end of the wait.
                if self.now - started >= self.raw(54) {
                    self.go_to_sto(BY_SLS, Some(Waits::BelowStandstill));
                }
                return;
            }
            self.sls = Sls::Limits;
        }
        if matches!(self.sls, Sls::Limits) {
            if magnitude > self.frequency(48) {
                self.violate_sls(sme::SLS_THRESHOLD);
            } else if self.is_below_standstill(magnitude) || self.has_passed_standstill(signed) {
                self.go_to_sto(BY_SLS, Some(Waits::BelowStandstill));
            }
        }
    }

    /// Thresholds in force: positive, negative (ATV-SMS-03, 04, 08, 10).
    fn sms_thresholds(&self, switch: bool) -> Option<(u32, u32)> {
        match (self.raw(56), switch) {
            (1, _) | (2, false) | (3, true) => Some((57, 58)),
            (2, true) => Some((59, 60)),
            _ => None,
        }
    }

    fn supervise_sms(&mut self, switch: bool, signed: i64) {
        let Some((positive, negative)) = self.sms_thresholds(switch) else { return };
        let (upper, lower) = (self.frequency(positive), -self.frequency(negative));
        let code = if signed > upper {
            sme::SMS_POSITIVE
        } else if signed < lower {
            sme::SMS_NEGATIVE
        } else {
            return;
        };
        self.errors.insert(code);
        self.go_to_sto(Holders::default(), None);
    }

    fn status(&self, word: &Word) -> Word {
        let state = self.state();
        let switch = word.bit(control::SMS_SWITCH);
        let enabled = state != StopState::Sto;
        let sms = enabled && self.sms_thresholds(switch).is_some();
        let waits = matches!(self.stop, Stop::Sto { waits: Some(_), .. });
        Word::ZERO
            .with(status::STO, !enabled)
            .with(status::SS1, state == StopState::Ss1)
            .with(status::SAFETY_ERROR, !self.errors.is_empty())
            .with(status::RESTART_REQUIRED, waits)
            .with(status::SLS, enabled && !matches!(self.sls, Sls::Off | Sls::Braked))
            .with(status::SMS, sms)
            .with(status::SMS_THRESHOLD_2, sms && self.raw(56) == 2 && switch)
    }
}

impl Channel for Atv {
    fn step(&mut self, input: &ModelInput, differs: bool) -> ChannelView {
        let word = input.control;
        let signed = input.speed_mrpm * self.raw(2).max(1);
        let sto = !word.bit(control::STO) || differs;
        let ss1 = word.bit(control::SS1) && self.raw(65) != 0;
        let sls = word.bit(control::SLS) && self.raw(66) != 0;

        let standing = self.command_errors(&word);
        let acknowledge = self.reset(&word, &standing);
        self.leave(sto, ss1, sls);
        self.errors.extend(&standing);
        if sto || !standing.is_empty() {
            self.go_to_sto(Holders::default(), None);
        }
        if ss1 {
            self.start_ss1(BY_SS1, signed);
        }
        let was_in_sto = self.state() == StopState::Sto;
        let errors_before = self.errors.len();
        self.supervise_ss1(signed);
        // In STO, also in that of an SS1 just ended, nothing is evaluated (DEC-14); a
        // violation leaves the other monitors their look at the same sample.
        let ended = self.state() == StopState::Sto && self.errors.len() == errors_before;
        if !was_in_sto && !ended {
            match (&self.sls, sls) {
                (_, false) => self.sls = Sls::Off,
                // DEC-14: a monitor requested while SS1 brakes monitors at once.
                (Sls::Off, true) => self.activate_sls(signed),
                _ => {}
            }
            self.supervise_sls(signed);
            self.supervise_sms(word.bit(control::SMS_SWITCH), signed);
            // An SS1 that SLS has just started is supervised from now on.
            self.supervise_ss1(signed);
        }
        if self.state() == StopState::Sto {
            self.sls = Sls::Off;
        }

        self.signed_before = signed;
        let requested = Word::ZERO
            .with(control::STO, !word.bit(control::STO))
            .with(control::SS1, ss1)
            .with(control::SLS, sls);
        let view = ChannelView {
            status: self.status(&word),
            requested,
            inputs: 0,
            acknowledge,
            ready: self.state() != StopState::Sto,
            stop: self.state(),
            errors: self.errors.iter().map(|code| [*code, 0, 0, 0]).collect(),
        };
        self.now += 1;
        view
    }

    fn acknowledge_levels(&self, input: &ModelInput) -> u32 {
        u32::from(input.control.bit(control::SAFETY_RESET))
    }

    fn fork(&self) -> Box<dyn Channel> {
        Box::new(self.clone())
    }
}
