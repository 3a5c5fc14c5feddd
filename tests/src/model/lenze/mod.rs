//! One channel of the Lenze SM301: STO, SS1, SS2 with SOS, SSE, SMS, SLS, SDI, ramp
//! monitoring, the four safe inputs and special operation with SLI.
//!
//! Both channels do the same: each judges both lines of a pair (DEC-36). Not modelled:
//! cascading and the safe output.

mod inputs;
mod monitors;
mod parameters;
mod pulse;
mod special;
mod stops;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use shm_schema::facts::lenze_sm301::{control, status};
use shm_schema::word::Word;

use inputs::Input;
use monitors::{DirectionMonitor, Overspeed, SpeedMonitor};
use parameters::Parameters;
use pulse::Pulse;
use special::{Change, Special};
use stops::{Stop, Target};

use super::{Channel, ChannelView, ModelInput, StopState};

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
    /// SLI.
    pub const SLI: u32 = 111;
    /// SD-In1; the others follow.
    pub const INPUT: u32 = 49;
}

/// What is requested, by the bus or by an input.
#[derive(Debug, Clone, Copy, Default)]
struct Demands {
    functions: Word,
    emergency: bool,
    special: bool,
    enable: bool,
}

/// One Lenze channel.
#[derive(Debug, Clone)]
pub struct Lenze {
    parameters: Parameters,
    now: i64,
    bus_before: Option<(bool, bool)>,
    ais: Pulse,
    aie: Pulse,
    inputs: Option<Vec<Input>>,
    special: Special,
    moved_from: i64,
    stop: Stop,
    speeds: [SpeedMonitor; 5],
    directions: [DirectionMonitor; 2],
    /// By error number, until the acknowledge: the time runs on without the request.
    overspeeds: BTreeMap<u32, Overspeed>,
    errors: BTreeMap<u32, Target>,
}

impl Lenze {
    /// A settled channel.
    pub fn new(given: &BTreeMap<u32, i32>) -> Self {
        Self {
            parameters: Parameters::new(given),
            now: 0,
            bus_before: None,
            ais: Pulse::default(),
            aie: Pulse::default(),
            inputs: None,
            special: Special::default(),
            moved_from: 0,
            stop: Stop::NONE,
            speeds: Default::default(),
            directions: Default::default(),
            overspeeds: BTreeMap::new(),
            errors: BTreeMap::new(),
        }
    }

    /// LNZ-BUS-08, DEC-49: a bit that the filter inhibits reads as inactive.
    fn passes(&self, bit: u8) -> bool {
        self.parameters.code(15_113) >> bit & 1 == 1
    }

    /// LNZ-BUS-07: 0 requests.
    fn requests(&self, word: &Word, bit: u8) -> bool {
        !word.bit(bit) && self.passes(bit)
    }

    fn is_used(&self, number: u32) -> bool {
        self.parameters.sub(15_030, number) != 0
    }

    /// LNZ-IN-04: a faulty input is OFF, which is new at the moment it fails.
    fn read_inputs(&mut self, input: &ModelInput) {
        let now = self.now;
        let parameters = &self.parameters;
        let inputs =
            self.inputs.get_or_insert_with(|| input.se.iter().map(|pair| Input::settled(*pair)).collect());
        for (number, (one, levels)) in (1..).zip(inputs.iter_mut().zip(input.se)) {
            if parameters.sub(15_030, number) != 0 {
                one.step(parameters, number, levels, now);
                if one.has_failed() {
                    self.errors.entry(self::number::INPUT + number - 1).or_insert(Target::Sto);
                }
            }
        }
    }

    fn is_on(&self, number: u32) -> bool {
        let inputs = self.inputs.as_deref().unwrap_or_default();
        inputs.get(number as usize - 1).is_some_and(|input| self.is_used(number) && input.is_on())
    }

    /// Functions of the bus and of the inputs (LNZ-IN-06, LNZ-IN-19, LNZ-OMS-11, LNZ-ES-02).
    fn demands(&self, word: &Word) -> Demands {
        let by_bus = (0..=8).filter(|bit| self.requests(word, *bit));
        let mut demands = Demands {
            functions: by_bus.fold(Word::ZERO, |all, bit| all.with(bit, true)),
            emergency: self.requests(word, control::SSE),
            special: word.bit(control::OMS) && self.passes(control::OMS),
            enable: word.bit(control::ES) && self.passes(control::ES),
        };
        for number in (1..=4).filter(|number| self.is_used(*number)) {
            let on = self.is_on(number);
            match (self.parameters.sub(15_031, number), self.parameters.sub(15_032, number)) {
                (0, function @ 0..=8) if !on => {
                    demands.functions = demands.functions.with(function as u8, true);
                }
                (1, _) => demands.emergency |= !on,
                (2, _) => demands.special |= self.selects_special(number, on),
                (3, _) => demands.enable |= on,
                _ => {}
            }
        }
        demands
    }

    /// LNZ-OMS-17; LNZ-OMS-16: a faulty selector means normal operation.
    fn selects_special(&self, number: u32, on: bool) -> bool {
        let has_failed = self.errors.contains_key(&(self::number::INPUT + number - 1));
        let at_low = self.parameters.code(15_202) == 1;
        !has_failed && on != at_low
    }

    /// Error acknowledge and restart acknowledge (LNZ-ACK-01 to 06).
    fn acknowledges(&mut self, input: &ModelInput) -> (u32, bool, bool) {
        if self.bus_before.is_none() {
            // DEC-16: what is high from the start is neither edge nor pulse.
            self.ais.level = input.ais;
            self.aie.level = input.aie;
        }
        let levels = self.acknowledge_levels(input);
        let bus = (levels & 1 != 0, levels & 2 != 0);
        let before = self.bus_before.replace(bus).unwrap_or(bus);
        let error = self.aie.is_given(input.aie, self.now) || (bus.0 && !before.0);
        let restart = self.ais.is_given(input.ais, self.now) || (bus.1 && !before.1);
        (levels, error, restart)
    }

    /// DEC-15.
    fn clear(&mut self) {
        for (index, input) in self.inputs.iter_mut().flatten().enumerate() {
            input.acknowledge();
            if !input.has_failed() {
                self.errors.remove(&(number::INPUT + index as u32));
            }
        }
        let state = self.stop.state();
        let finished = |code: u32, target: Target| match target {
            // A faulty input stands until it was seen right (LNZ-IN-15, LNZ-IN-17).
            _ if (number::INPUT..number::INPUT + 4).contains(&code) => false,
            Target::Sto | Target::Ss1 => state == StopState::Sto,
            Target::Ss2 => state == StopState::Sto || state == StopState::Sos,
        };
        let ended = self.errors.iter().filter(|(code, target)| finished(**code, **target));
        let cleared: BTreeSet<u32> = ended.map(|(code, _)| *code).collect();
        self.errors.retain(|code, _| !cleared.contains(code));
        self.overspeeds.retain(|code, _| !cleared.contains(code));
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

    /// Special operation; what it changes about the stop.
    fn follow_special(&mut self, demands: &Demands, speed: i64) {
        // 3 to 6 are SLS1 to SLS4 (LNZ-OMS-22).
        let motion = self.parameters.code(15_201);
        let limit = self.parameters.sub(15_330, (motion - 2).clamp(0, 4) as u32) * 1000;
        let kept = motion == 11 || speed.abs() <= limit;
        // LNZ-OMS-08: an emergency stop is state 5, which ES does not lead out of.
        let may_confirm = kept && !demands.emergency;
        match self.special.step(demands.special, demands.enable, may_confirm) {
            Change::None => {}
            // LNZ-OMS-14: running stopping times need not be waited for.
            Change::Confirmed => self.stop.confirm(!self.errors.is_empty()),
            // LNZ-OMS-12, LNZ-OMS-13
            Change::Left => self.stop.demand_restart(),
        }
    }

    /// Which stops are requested (LNZ-OMS-02, LNZ-OMS-07, LNZ-OMS-10, LNZ-SSE-01).
    fn stop_requests(&self, demands: &Demands, differs: bool) -> stops::Requests {
        let of_special = (!self.special.confirmed).then(|| self.parameters.reaction(15_200, 0));
        let simple = |bit: u8, target: Target| {
            if self.special.active { of_special == Some(target) } else { demands.functions.bit(bit) }
        };
        let emergency_is_ss1 = self.parameters.code(15_205) == 1;
        stops::Requests {
            sto: simple(control::STO, Target::Sto),
            ss1: simple(control::SS1, Target::Ss1),
            ss2: simple(control::SS2, Target::Ss2),
            emergency_sto: (demands.emergency && !emergency_is_ss1) || differs,
            emergency_ss1: demands.emergency && emergency_is_ss1,
        }
    }

    /// Which monitors are requested: SMS and SLS, both directions.
    fn wanted(&self, demands: &Demands) -> ([bool; 5], [bool; 2]) {
        let mut speeds = [self.parameters.code(15_320) > 0, false, false, false, false];
        let mut directions = [false; 2];
        for index in 0..4u8 {
            let bit = control::SLS1 + index;
            // LNZ-OMS-03: the motion function is monitored from the change on.
            let by_special = self.special.active && self.parameters.code(15_201) == i64::from(bit);
            let wanted = demands.functions.bit(bit) || by_special;
            speeds[usize::from(index) + 1] = wanted;
            // LNZ-SLS-04: one request triggers both.
            let with = self.parameters.sub(15_333, u32::from(index) + 1);
            directions[0] |= wanted && with == 1;
            directions[1] |= wanted && with == 2;
        }
        // LNZ-SDI-08: permanent in normal operation.
        let permanent = if self.special.active { 0 } else { self.parameters.code(15_340) };
        directions[0] |= permanent == 1 || demands.functions.bit(control::SDIPOS);
        directions[1] |= permanent == 2 || demands.functions.bit(control::SDINEG);
        (speeds, directions)
    }

    /// SLI, from the confirmation on, or from the end of STO on (LNZ-SLI-01, LNZ-SLI-02,
    /// LNZ-OMS-15, DEC-14).
    fn watch_increments(&mut self, position: i64, begins: bool) -> Option<(u32, Target)> {
        if begins {
            self.moved_from = position;
        }
        let limit = self.parameters.code(15_203);
        let watches = self.special.confirmed && limit > 0;
        let moved = (position - self.moved_from).abs() > limit;
        (watches && moved && !self.errors.contains_key(&number::SLI)).then_some((number::SLI, Target::Sto))
    }

    fn inputs_shown(&self) -> u32 {
        (1..=4).fold(0, |all, number| all | u32::from(self.is_on(number)) << (number - 1))
    }

    fn status(&self, demands: &Demands, speed: i64) -> Word {
        let state = self.stop.state();
        let mut shown = Word::ZERO
            .with(status::STO_ACTIVE, state == StopState::Sto)
            .with(status::SS1_ACTIVE, self.stop.shows_ss1())
            .with(status::SS2_ACTIVE, self.stop.shows_ss2())
            .with(status::SOS_MONITORED, state == StopState::Sos)
            .with(status::SSE_ACTIVE, demands.emergency)
            .with(status::ES_ACTIVE, self.special.confirmed)
            .with(status::OMS, demands.special)
            .with(status::OMS_ACTIVE, self.special.active)
            .with(status::ERROR_ACTIVE, !self.errors.is_empty());
        for number in 0..4 {
            shown = shown.with(status::SD_IN1 + number, self.inputs_shown() >> number & 1 == 1);
        }
        if state == StopState::Sto {
            return shown;
        }
        let has_limit = self.parameters.code(15_203) > 0;
        shown = shown.with(status::SLI_ACTIVE, self.special.confirmed && has_limit);
        for index in 1..5u8 {
            let monitor = &self.speeds[usize::from(index)];
            let limit = self.parameters.sub(15_330, index.into()) * 1000;
            let is_kept = speed.abs() <= limit && !monitor.violated;
            let active = monitor.since.is_some() && !monitor.violated;
            shown = shown.with(status::SLS1_ACTIVE + index - 1, active);
            // LNZ-SLS-02: as soon as the speed is below the limit.
            shown = shown.with(status::SLS1_MONITORED + index - 1, active && is_kept);
        }
        for index in 0..2u8 {
            let monitor = &self.directions[usize::from(index)];
            shown = shown.with(status::SDIPOS_ACTIVE + index, monitor.since.is_some() && !monitor.violated);
            let monitored = monitor.reference.is_some() && !monitor.violated;
            shown = shown.with(status::SDIPOS_MONITORED + index, monitored);
        }
        shown
    }
}

impl Channel for Lenze {
    fn step(&mut self, input: &ModelInput, differs: bool) -> ChannelView {
        let (now, position, speed) = (self.now, input.position, input.speed_mrpm);
        let (acknowledge, error_edge, restart_edge) = self.acknowledges(input);
        self.read_inputs(input);
        if error_edge {
            self.clear();
        }
        let demands = self.demands(&input.control);
        let (confirmed_before, was_in_sto) = (self.special.confirmed, self.stop.state() == StopState::Sto);
        self.follow_special(&demands, speed);
        let requests = self.stop_requests(&demands, differs);
        // LNZ-ACK-06: the error first, then the restart.
        let restart = restart_edge && !error_edge;
        self.stop.leave(requests, !self.errors.is_empty(), restart, position, &self.parameters);
        self.stop.request(requests, now, speed);

        let mut found = Vec::new();
        let stop_finding = self.stop.supervise(&self.parameters, now, position, speed, input.drive_n0);
        found.extend(stop_finding.map(|code| (code, Target::Sto)));
        if self.stop.state() != StopState::Sto {
            let (speeds, directions) = self.wanted(&demands);
            for (index, wanted) in speeds.into_iter().enumerate() {
                let overspeed = self.speeds[index].step(&self.parameters, index, wanted, now, speed);
                if let Some(new) = overspeed {
                    self.overspeeds.entry(new.code).or_insert(new);
                    found.push((new.code, new.reaction));
                }
            }
            let is_late = |one: &Overspeed| one.is_overdue(&self.parameters, now, speed);
            let late = self.overspeeds.values().any(is_late);
            found.extend(late.then_some((number::NOT_BACK, Target::Sto)));
            for (index, wanted) in directions.into_iter().enumerate() {
                found.extend(self.directions[index].step(&self.parameters, index, wanted, now, position));
            }
            let confirmed_now = self.special.confirmed && !confirmed_before;
            let begins = confirmed_now || was_in_sto;
            found.extend(self.watch_increments(position, begins));
        }
        self.react(found, input);
        if self.stop.state() == StopState::Sto {
            self.speeds = Default::default();
            self.directions = Default::default();
            self.overspeeds.clear();
        }
        let terminals = u32::from(input.ais) << 4 | u32::from(input.aie) << 5;
        let view = ChannelView {
            status: self.status(&demands, speed),
            requested: demands.functions.with(control::SSE, demands.emergency),
            inputs: self.inputs_shown() | terminals,
            acknowledge,
            ready: self.stop.state() != StopState::Sto,
            stop: self.stop.state(),
            errors: self.errors.keys().map(|code| [*code, 0, 0, 0]).collect(),
        };
        self.now += 1;
        view
    }

    fn acknowledge_levels(&self, input: &ModelInput) -> u32 {
        let given = |bit: u8| u32::from(input.control.bit(bit) && self.passes(bit));
        given(control::PS_AIE) | given(control::PS_AIS) << 1
    }

    fn fork(&self) -> Box<dyn Channel> {
        Box::new(self.clone())
    }
}

impl Lenze {
    /// DEC-13: the highest reaction first; what starts now is supervised from now on.
    fn react(&mut self, mut found: Vec<(u32, Target)>, input: &ModelInput) {
        let (now, speed) = (self.now, input.speed_mrpm);
        found.sort_by_key(|(_, target)| *target);
        let before = self.stop.state();
        for (code, target) in found {
            self.errors.entry(code).or_insert(target);
            self.stop.start(target, now, speed, true);
        }
        if self.stop.state() != before {
            let late = self.stop.supervise(&self.parameters, now, input.position, speed, input.drive_n0);
            if let Some(code) = late {
                self.errors.insert(code, Target::Sto);
                self.stop.start(Target::Sto, now, speed, true);
            }
        }
    }
}
