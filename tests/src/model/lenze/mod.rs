//! One channel of the Lenze SM301: STO, SS1, SS2 with SOS, SSE, SMS, SLS, SDI and ramp
//! monitoring, commanded over the safety bus.
//!
//! Not modelled: the four input pairs with their discrepancy times, special operation
//! (OMS, ES, SLI) and cascading; scenarios that use them are not for this model.

mod stops;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use shm_schema::facts::lenze_sm301::{control, status};
use shm_schema::profile::lenze_key;
use shm_schema::word::Word;

use stops::{Stop, Target};

use super::{Channel, ChannelView, ModelInput, StopState};

/// Parameters by code and subcode.
#[derive(Debug, Clone)]
pub struct Parameters(BTreeMap<u32, i32>);

impl Parameters {
    /// A code without subcode.
    pub fn code(&self, code: u32) -> i64 {
        self.sub(code, 0)
    }

    /// A code with subcode; what has a default beside 0 is listed.
    pub fn sub(&self, code: u32, sub: u32) -> i64 {
        // LNZ-SDI-05, LNZ-SMS-03, DEC-49.
        let default = match code {
            15_343 | 15_320 => 1,
            15_113 => -1,
            _ => 0,
        };
        self.0.get(&lenze_key(code, sub)).map_or(default, |value| i64::from(*value))
    }

    /// 0 STO, 1 SS1, 2 SS2.
    pub fn reaction(&self, code: u32, sub: u32) -> Target {
        match self.sub(code, sub) {
            1 => Target::Ss1,
            2 => Target::Ss2,
            _ => Target::Sto,
        }
    }
}

/// Error numbers of the module.
pub mod number {
    /// Zero speed not reached in the stopping time.
    pub const NOT_STOPPED: u32 = 97;
    /// SLS1; the others follow.
    pub const SLS: u32 = 98;
    /// Not back within C15350.
    pub const NOT_BACK: u32 = 102;
    /// SDIpos; SDIneg follows.
    pub const SDI: u32 = 103;
    /// SMS.
    pub const SMS: u32 = 105;
    /// SOS.
    pub const SOS: u32 = 106;
    /// Ramp.
    pub const RAMP: u32 = 110;
}

/// One monitor of speed: SMS (0) or SLS 1 to 4.
#[derive(Debug, Clone, Default)]
struct SpeedMonitor {
    since: Option<i64>,
    violated_at: Option<i64>,
}

/// One monitor of direction.
#[derive(Debug, Clone, Default)]
struct DirectionMonitor {
    since: Option<i64>,
    reference: Option<i64>,
    violated: bool,
}

/// Pulse of an acknowledge terminal (LNZ-ACK-01, LNZ-ACK-03, LNZ-ACK-05).
#[derive(Debug, Clone, Default)]
struct Pulse {
    level: bool,
    high_since: Option<i64>,
}

impl Pulse {
    /// The falling edge of a pulse of 0.3 to 10 s.
    fn is_given(&mut self, level: bool, now: i64) -> bool {
        let rises = level && !self.level;
        let falls = !level && self.level;
        self.level = level;
        if rises {
            self.high_since = Some(now);
        }
        let length = self.high_since.map(|since| now - since);
        if falls {
            self.high_since = None;
        }
        falls && length.is_some_and(|length| (300..=10_000).contains(&length))
    }
}

/// One Lenze channel.
pub struct Lenze {
    parameters: Parameters,
    now: i64,
    bus_before: Option<(bool, bool)>,
    ais: Pulse,
    aie: Pulse,
    stop: Stop,
    speeds: [SpeedMonitor; 5],
    directions: [DirectionMonitor; 2],
    errors: BTreeMap<u32, Target>,
}

impl Lenze {
    /// A settled channel.
    pub fn new(given: &BTreeMap<u32, i32>) -> Self {
        Self {
            parameters: Parameters(given.clone()),
            now: 0,
            bus_before: None,
            ais: Pulse::default(),
            aie: Pulse::default(),
            stop: Stop::None,
            speeds: Default::default(),
            directions: Default::default(),
            errors: BTreeMap::new(),
        }
    }

    /// LNZ-BUS-07, LNZ-BUS-08, DEC-49: 0 requests, if the filter lets the bit pass.
    fn requests(&self, word: &Word, bit: u8) -> bool {
        let filter = self.parameters.code(15_113);
        !word.bit(bit) && filter >> bit & 1 == 1
    }

    /// Error acknowledge and restart acknowledge (LNZ-ACK-01 to 06).
    fn acknowledges(&mut self, input: &ModelInput) -> (u32, bool, bool) {
        if self.bus_before.is_none() {
            // DEC-16: what is high from the start is neither edge nor pulse.
            self.ais.level = input.ais;
            self.aie.level = input.aie;
        }
        let bus = (input.control.bit(control::PS_AIE), input.control.bit(control::PS_AIS));
        let before = self.bus_before.replace(bus).unwrap_or(bus);
        let error = self.aie.is_given(input.aie, self.now) || (bus.0 && !before.0);
        let restart = self.ais.is_given(input.ais, self.now) || (bus.1 && !before.1);
        (u32::from(bus.0) | u32::from(bus.1) << 1, error, restart)
    }

    /// DEC-15.
    fn clear(&mut self) {
        let state = self.stop.state();
        let finished = |target: Target| match target {
            Target::Sto | Target::Ss1 => state == StopState::Sto,
            Target::Ss2 => state == StopState::Sto || state == StopState::Sos,
        };
        let cleared: BTreeSet<u32> =
            self.errors.iter().filter(|(_, target)| finished(**target)).map(|(code, _)| *code).collect();
        self.errors.retain(|code, _| !cleared.contains(code));
        for (index, monitor) in self.speeds.iter_mut().enumerate() {
            let own = if index == 0 { number::SMS } else { number::SLS + index as u32 - 1 };
            if cleared.contains(&own) {
                *monitor = SpeedMonitor::default();
            }
        }
        for (index, monitor) in self.directions.iter_mut().enumerate() {
            if cleared.contains(&(number::SDI + index as u32)) {
                *monitor = DirectionMonitor::default();
            }
        }
    }

    /// SMS and SLS (LNZ-SMS-01 to 07, LNZ-SLS-01 to 03).
    fn watch_speed(&mut self, index: usize, requested: bool, speed: i64) -> Vec<(u32, Target)> {
        let monitor = &mut self.speeds[index];
        if !requested {
            *monitor = SpeedMonitor::default();
            return Vec::new();
        }
        let since = *monitor.since.get_or_insert(self.now);
        let sub = index as u32;
        let (limit, delay, own, reaction) = if index == 0 {
            (self.parameters.code(15_320), 0, number::SMS, self.parameters.reaction(15_321, 0))
        } else {
            let delay = self.parameters.sub(15_331, sub);
            let reaction = self.parameters.reaction(15_332, sub);
            (self.parameters.sub(15_330, sub), delay, number::SLS + sub - 1, reaction)
        };
        let too_fast = speed.abs() > limit * 1000;
        let mut found = Vec::new();
        if monitor.violated_at.is_none() && too_fast && self.now - since >= delay {
            monitor.violated_at = Some(self.now);
            found.push((own, reaction));
        }
        // LNZ-SMS-06: back within C15350, or STO; LNZ-SMS-07: not after STO.
        let response = self.parameters.code(15_350);
        let overdue = monitor.violated_at.is_some_and(|at| self.now - at >= response);
        if overdue && too_fast && reaction != Target::Sto {
            found.push((number::NOT_BACK, Target::Sto));
        }
        found
    }

    /// SDI: 0 positive, 1 negative direction permitted (LNZ-SDI-01 to 09, DEC-49).
    fn watch_direction(&mut self, index: usize, requested: bool, position: i64) -> Option<(u32, Target)> {
        let monitor = &mut self.directions[index];
        if !requested {
            *monitor = DirectionMonitor::default();
            return None;
        }
        let since = *monitor.since.get_or_insert(self.now);
        let delay = self.parameters.code(15_341);
        if monitor.violated || self.now - since < delay {
            return None;
        }
        let sign = if index == 0 { 1 } else { -1 };
        let reached = position * sign;
        let furthest = monitor.reference.map_or(reached, |reference| reference.max(reached));
        monitor.reference = Some(furthest);
        monitor.violated = furthest - reached > self.parameters.code(15_342);
        monitor.violated.then(|| (number::SDI + index as u32, self.parameters.reaction(15_343, 0)))
    }

    /// Which monitors are requested: SMS and SLS, both directions.
    fn wanted(&self, word: &Word) -> ([bool; 5], [bool; 2]) {
        let sls = [control::SLS1, control::SLS2, control::SLS3, control::SLS4];
        let mut speeds = [self.parameters.code(15_320) > 0, false, false, false, false];
        let mut directions = [false; 2];
        for (index, bit) in sls.into_iter().enumerate() {
            speeds[index + 1] = self.requests(word, bit);
            // LNZ-SLS-04: one request triggers both.
            let with = self.parameters.sub(15_333, index as u32 + 1);
            directions[0] |= speeds[index + 1] && with == 1;
            directions[1] |= speeds[index + 1] && with == 2;
        }
        let permanent = self.parameters.code(15_340);
        directions[0] |= permanent == 1 || self.requests(word, control::SDIPOS);
        directions[1] |= permanent == 2 || self.requests(word, control::SDINEG);
        (speeds, directions)
    }

    fn status(&self, word: &Word, speed: i64) -> Word {
        let state = self.stop.state();
        let mut shown = Word::ZERO
            .with(status::STO_ACTIVE, state == StopState::Sto)
            .with(status::SS1_ACTIVE, self.stop.shows_ss1())
            .with(status::SS2_ACTIVE, self.stop.shows_ss2())
            .with(status::SOS_MONITORED, state == StopState::Sos)
            .with(status::SSE_ACTIVE, self.requests(word, control::SSE))
            .with(status::ERROR_ACTIVE, !self.errors.is_empty());
        if state == StopState::Sto {
            return shown;
        }
        for index in 1..5u8 {
            let monitor = &self.speeds[usize::from(index)];
            let limit = self.parameters.sub(15_330, index.into()) * 1000;
            let is_kept = speed.abs() <= limit && monitor.violated_at.is_none();
            let active = monitor.since.is_some();
            shown = shown.with(status::SLS1_ACTIVE + index - 1, active);
            // LNZ-SLS-02: as soon as the speed is below the limit.
            shown = shown.with(status::SLS1_MONITORED + index - 1, active && is_kept);
        }
        for index in 0..2u8 {
            let monitor = &self.directions[usize::from(index)];
            shown = shown.with(status::SDIPOS_ACTIVE + index, monitor.since.is_some());
            let monitored = monitor.reference.is_some() && !monitor.violated;
            shown = shown.with(status::SDIPOS_MONITORED + index, monitored);
        }
        shown
    }
}

impl Channel for Lenze {
    fn step(&mut self, input: &ModelInput, crosscheck_error: bool) -> ChannelView {
        let (word, now) = (input.control, self.now);
        let (position, speed) = (input.position, input.speed_mrpm);
        let emergency = self.requests(&word, control::SSE);
        let emergency_is_ss1 = self.parameters.code(15_205) == 1;
        let requests = stops::Requests {
            sto: self.requests(&word, control::STO) || (emergency && !emergency_is_ss1) || crosscheck_error,
            ss1: self.requests(&word, control::SS1) || (emergency && emergency_is_ss1),
            ss2: self.requests(&word, control::SS2),
        };
        let (acknowledge, error_edge, restart_edge) = self.acknowledges(input);
        if error_edge {
            self.clear();
        }
        // LNZ-ACK-06: the error first, then the restart.
        let restart = restart_edge && !error_edge;
        self.stop.leave(requests, !self.errors.is_empty(), restart, position, &self.parameters);
        self.stop.request(requests, now, speed);

        let mut found = Vec::new();
        let stop_finding = self.stop.supervise(&self.parameters, now, position, speed, input.drive_n0);
        found.extend(stop_finding.map(|code| (code, Target::Sto)));
        if self.stop.state() != StopState::Sto {
            let (speeds, directions) = self.wanted(&word);
            for (index, wanted) in speeds.into_iter().enumerate() {
                found.extend(self.watch_speed(index, wanted, speed));
            }
            for (index, wanted) in directions.into_iter().enumerate() {
                found.extend(self.watch_direction(index, wanted, position));
            }
        }
        found.sort_by_key(|(_, target)| *target);
        let before = self.stop.state();
        for (code, target) in found {
            self.errors.entry(code).or_insert(target);
            self.stop.start(target, now, speed);
        }
        if self.stop.state() != before {
            let late = self.stop.supervise(&self.parameters, now, position, speed, input.drive_n0);
            if let Some(code) = late {
                self.errors.insert(code, Target::Sto);
                self.stop.start(Target::Sto, now, speed);
            }
        }
        if self.stop.state() == StopState::Sto {
            self.speeds = Default::default();
            self.directions = Default::default();
        }
        let functions = (0..=8).chain([23]);
        let requested = functions.filter(|bit| self.requests(&word, *bit));
        let view = ChannelView {
            status: self.status(&word, speed),
            requested: requested.fold(Word::ZERO, |all, bit| all.with(bit, true)),
            inputs: 0,
            acknowledge,
            ready: self.stop.state() != StopState::Sto,
            stop: self.stop.state(),
            errors: self.errors.keys().map(|code| [*code, 0, 0, 0]).collect(),
        };
        self.now += 1;
        view
    }
}
