//! One channel of the generic profile ETG.6100.2.
//!
//! Order of a cycle as in the AMK model: acknowledge, leave, request, supervise, monitor,
//! react. Both channels do the same: the profile has no input lines.

mod monitors;
mod parameters;
mod stops;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::{control, status};
use shm_schema::profile::{common, etg_key};
use shm_schema::word::Word;

use monitors::{Monitor, Sample, Sdi};
use parameters::{Instance, Parameters, Reaction};
use stops::{Requests, Stop, StopFinding};

use super::approach::Window;
use super::{Channel, ChannelView, ModelInput, StopState};

/// What a function found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// A standing limit.
    Limit,
    /// The deceleration limit.
    Ramp,
    /// The velocity window of SDI.
    Motion,
}

/// Control bits of function instances (DEC-41).
const CONTROL: [(u8, Instance); 23] = [
    (control::STO, (etg::STO, 1)),
    (control::SS1_1, (etg::SS1, 1)),
    (control::SS2_1, (etg::SS2, 1)),
    (control::SOS_1, (etg::SOS, 1)),
    (control::SSR_1, (etg::SSR, 1)),
    (control::SLS_1, (etg::SLS, 1)),
    (control::SLS_2, (etg::SLS, 2)),
    (control::SLS_3, (etg::SLS, 3)),
    (control::SLS_4, (etg::SLS, 4)),
    (control::SLP_1, (etg::SLP, 1)),
    (control::SLI_1, (etg::SLI, 1)),
    (control::SLT_1, (etg::SLT, 1)),
    (control::SAR_1, (etg::SAR, 1)),
    (control::SSR_2, (etg::SSR, 2)),
    (control::SSR_3, (etg::SSR, 3)),
    (control::SSR_4, (etg::SSR, 4)),
    (control::SOS_2, (etg::SOS, 2)),
    (control::SS1_2, (etg::SS1, 2)),
    (control::SS2_2, (etg::SS2, 2)),
    (control::SLP_2, (etg::SLP, 2)),
    (control::SLI_2, (etg::SLI, 2)),
    (control::SLT_2, (etg::SLT, 2)),
    (control::SAR_2, (etg::SAR, 2)),
];

/// Status bits of function instances (DEC-41).
const STATUS: [(u8, Instance); 27] = [
    (status::SSM_1, (etg::SSM, 1)),
    (status::SSM_2, (etg::SSM, 2)),
    (status::SOS_1, (etg::SOS, 1)),
    (status::SSR_1, (etg::SSR, 1)),
    (status::SLS_1, (etg::SLS, 1)),
    (status::SLS_2, (etg::SLS, 2)),
    (status::SLS_3, (etg::SLS, 3)),
    (status::SLS_4, (etg::SLS, 4)),
    (status::SLP_1, (etg::SLP, 1)),
    (status::SLI_1, (etg::SLI, 1)),
    (status::SLT_1, (etg::SLT, 1)),
    (status::SAR_1, (etg::SAR, 1)),
    (status::SMS, (etg::SMS, 1)),
    (status::SMA, (etg::SMA, 1)),
    (status::SCA_1, (etg::SCA, 1)),
    (status::SCA_2, (etg::SCA, 2)),
    (status::SBC_1, (etg::SBC, 1)),
    (status::SSM_3, (etg::SSM, 3)),
    (status::SSM_4, (etg::SSM, 4)),
    (status::SSR_2, (etg::SSR, 2)),
    (status::SSR_3, (etg::SSR, 3)),
    (status::SSR_4, (etg::SSR, 4)),
    (status::SLP_2, (etg::SLP, 2)),
    (status::SLI_2, (etg::SLI, 2)),
    (status::SLT_2, (etg::SLT, 2)),
    (status::SAR_2, (etg::SAR, 2)),
    (status::SOS_2, (etg::SOS, 2)),
];

/// An error that stands until it is acknowledged.
#[derive(Debug, Clone)]
struct Standing {
    instance: Instance,
    finding: Finding,
    reaction: Reaction,
}

impl Standing {
    /// ETG-ERR-03: function, instance and the number of the catalogue's row.
    fn code(&self) -> u32 {
        let (function, instance) = self.instance;
        let deceleration_first = function == etg::SS2;
        let number = match self.finding {
            Finding::Ramp if deceleration_first => 1,
            Finding::Ramp | Finding::Motion => 2,
            Finding::Limit => 1,
        };
        etg_key(function, instance, number)
    }
}

/// One ETG channel.
#[derive(Debug, Clone)]
pub struct Etg {
    parameters: Parameters,
    control: BTreeMap<u8, Instance>,
    status: BTreeMap<u8, Instance>,
    now: i64,
    acknowledge_before: Option<u32>,
    restart_request: bool,
    stop: Stop,
    monitors: Vec<Monitor>,
    sdi: Sdi,
    speed_before: Option<i64>,
    standing: Vec<Standing>,
}

impl Etg {
    /// A settled channel.
    pub fn new(given: &BTreeMap<u32, i32>) -> Self {
        let parameters = Parameters::new(given);
        let mut control: BTreeMap<u8, Instance> = CONTROL.into_iter().collect();
        control.extend(parameters.assignments(common::CONTROL_WORD));
        let mut status: BTreeMap<u8, Instance> = STATUS.into_iter().collect();
        status.extend(parameters.assignments(common::STATUS_WORD));
        Self {
            monitors: Monitor::all(&parameters),
            parameters,
            control,
            status,
            now: 0,
            acknowledge_before: None,
            restart_request: false,
            stop: Stop::None,
            sdi: Sdi::default(),
            speed_before: None,
            standing: Vec::new(),
        }
    }

    /// ETG-CW-03: 0 activates; DEC-40: what is not supported is ignored.
    fn requested(&self, word: &Word) -> Vec<(u8, Instance)> {
        let supported = |instance: Instance| instance.0 == etg::STO || self.parameters.supports(instance);
        let low = self.control.iter().filter(|(bit, instance)| !word.bit(**bit) && supported(**instance));
        low.map(|(bit, instance)| (*bit, *instance)).collect()
    }

    /// Rising edges of error and restart acknowledge (ETG-ERR-04, ETG-RST-03, DEC-16).
    fn acknowledge_edges(&mut self, input: &ModelInput) -> (u32, bool, bool) {
        let levels = self.acknowledge_levels(input);
        let before = self.acknowledge_before.replace(levels).unwrap_or(levels);
        let rising = levels & !before;
        (levels, rising & 1 != 0, rising & 2 != 0)
    }

    /// What this cycle would find without a reaction, of monitors and of braking SS2.
    fn unanswered(&self, requested: &[(u8, Instance)], word: &Word, sample: &Sample) -> Vec<Instance> {
        let mut ahead = self.clone();
        let stops = ahead.supervise(sample);
        let stops =
            stops.into_iter().map(|(function, instance, _, reaction)| ((function, instance), reaction));
        let in_sto = self.stop.state() == StopState::Sto;
        let monitors = if in_sto { Vec::new() } else { ahead.monitor(requested, word, sample) };
        let monitors = monitors.into_iter().map(|(instance, _, reaction)| (instance, reaction));
        let unanswered = stops.chain(monitors).filter(|(_, reaction)| *reaction == Reaction::None);
        unanswered.map(|(instance, _)| instance).collect()
    }

    /// DEC-15: an error whose reaction has ended stands no longer; one without reaction stands
    /// as long as its limit is violated (`unanswered`).
    fn clear(&mut self, unanswered: &[Instance]) {
        let state = self.stop.state();
        let finished = |standing: &Standing| match standing.reaction {
            Reaction::None => !unanswered.contains(&standing.instance),
            Reaction::Sto | Reaction::Ss1(_) => state == StopState::Sto,
            Reaction::Ss2(_) => state == StopState::Sto || state == StopState::Sos,
        };
        for standing in self.standing.iter().filter(|standing| finished(standing)) {
            if standing.instance.0 == etg::SDI {
                self.sdi.cleared();
            }
            for monitor in self.monitors.iter_mut().filter(|monitor| monitor.instance == standing.instance) {
                monitor.cleared();
            }
        }
        self.standing.retain(|standing| !finished(standing));
    }

    /// What waits to be left, and whether that asks for an acknowledge (ETG-RST-01, ETG-RST-02).
    fn waiting(&self, requests: &Requests) -> Vec<(Instance, bool)> {
        let object = |function| match function {
            etg::SS2 => etg::ss2::RESTART_ACKNOWLEDGE_BEHAVIOR,
            _ => etg::sto::RESTART_ACKNOWLEDGE_BEHAVIOR,
        };
        let asks = |one: Instance| self.parameters.needs_restart_acknowledge(one, object(one.0));
        let waiting = self.stop.waiting(requests, !self.standing.is_empty());
        waiting.into_iter().map(|one| (one, asks(one))).collect()
    }

    /// ETG-SEQ-15: the edge counts only while the request for it is shown.
    fn leave(&mut self, requests: &Requests, restart_edge: bool) {
        let acknowledged = restart_edge && self.restart_request;
        for (instance, needs_edge) in self.waiting(requests) {
            if !needs_edge || acknowledged {
                self.stop.leave(instance);
            }
        }
    }

    fn remember(&mut self, instance: Instance, finding: Finding, reaction: Reaction) {
        let new = Standing { instance, finding, reaction };
        if !self.standing.iter().any(|standing| standing.code() == new.code()) {
            self.standing.push(new);
        }
    }

    fn sample(&mut self, input: &ModelInput) -> Sample {
        let before = self.speed_before.replace(input.speed_mrpm).unwrap_or(input.speed_mrpm);
        // A change of 1/1000 rpm in 1 ms is 1 rpm/s.
        let derived = (input.speed_mrpm - before) * 1000;
        Sample {
            now: self.now,
            position: input.position,
            speed: input.speed_mrpm,
            acceleration: input.acceleration_mrpm_s.unwrap_or(derived),
            torque: input.torque_ppm,
        }
    }

    /// Monitors run in every state but STO (DEC-14).
    fn monitor(
        &mut self,
        requested: &[(u8, Instance)],
        word: &Word,
        sample: &Sample,
    ) -> Vec<(Instance, Finding, Reaction)> {
        let mut found = Vec::new();
        for monitor in &mut self.monitors {
            let asked = requested.iter().any(|(_, instance)| *instance == monitor.instance);
            let wanted = asked || monitor.is_always_requested(&self.parameters);
            let finding = monitor.step(&self.parameters, wanted, sample);
            found.extend(finding.map(|(finding, reaction)| (monitor.instance, finding, reaction)));
        }
        if self.parameters.supports((etg::SDI, 1)) {
            let forbidden = [!word.bit(control::SDIP), !word.bit(control::SDIN)];
            let finding = self.sdi.step(&self.parameters, forbidden, sample);
            found.extend(finding.map(|finding| ((etg::SDI, 1), finding, Reaction::Sto)));
        }
        found
    }

    fn supervise(&mut self, sample: &Sample) -> Vec<StopFinding> {
        self.stop.supervise(&self.parameters, sample.now, sample.position, sample.speed, &|_| true)
    }

    /// DEC-13: the highest reaction first; what starts now is supervised from now on.
    fn react(&mut self, mut reactions: Vec<Reaction>, sample: &Sample) {
        reactions.sort_unstable();
        let before = self.stop.clone();
        for reaction in reactions {
            self.stop.start(reaction, &self.parameters, sample.now, sample.speed);
        }
        let is_new = |one: Instance| !before.runs(one);
        let (now, position, speed) = (sample.now, sample.position, sample.speed);
        let found = self.stop.supervise(&self.parameters, now, position, speed, &is_new);
        for (function, instance, finding, reaction) in found {
            self.remember((function, instance), finding, reaction);
            self.stop.start(reaction, &self.parameters, now, speed);
        }
    }

    /// ETG-SSM-01, ETG-SCA-01, DEC-29: inside the limits; they go on in STO.
    fn inside(&self, instance: Instance, value: i64, scale: i64) -> bool {
        let (upper, lower) = (self.parameters.object(instance, 1), self.parameters.object(instance, 2));
        let (Some(upper), Some(lower)) = (upper, lower) else { return false };
        let window = Window { lower: lower * scale, upper: upper * scale };
        (upper != 0 || lower != 0) && window.contains(value)
    }

    fn status_of(&self, instance: Instance, word: &Word, sample: &Sample) -> bool {
        match instance.0 {
            etg::SSM => self.inside(instance, sample.speed, 1000),
            etg::SCA => self.inside(instance, sample.position, 1),
            // ETG-SBC-02: open when STO is not active and the control bit is 1.
            etg::SBC => {
                let supported = self.parameters.supports(instance);
                let closed = self.stop.state() == StopState::Sto || self.stop.has_closed_the_brake();
                supported && !closed && word.bit(control::SBC_1)
            }
            etg::SOS if self.stop.stands_in_sos(instance.1) => true,
            _ => self.monitors.iter().any(|monitor| monitor.instance == instance && monitor.is_active()),
        }
    }

    fn status(&self, word: &Word, sample: &Sample) -> Word {
        let mut shown = Word::ZERO
            .with(status::STO, self.stop.state() == StopState::Sto)
            .with(status::ERROR, !self.standing.is_empty())
            .with(status::RESTART_ACKNOWLEDGE_REQUEST, self.restart_request);
        if self.parameters.supports((etg::SDI, 1)) {
            // ETG-SDI-04: a sensor of motion, in whatever state.
            let zero = self.parameters.value((etg::SDI, 1), etg::sdi::VELOCITY_ZERO_WINDOW).abs() * 1000;
            shown = shown.with(status::SDIP, sample.speed > zero).with(status::SDIN, sample.speed < -zero);
        }
        for (bit, instance) in &self.status {
            shown = shown.with(*bit, self.status_of(*instance, word, sample));
        }
        shown
    }

    /// ETG-RST-03: shown while nothing but the acknowledge is missing.
    fn update_restart_request(&mut self, requests: &Requests) {
        self.restart_request = self.waiting(requests).iter().any(|(_, needs_edge)| *needs_edge);
    }
}

impl Channel for Etg {
    fn step(&mut self, input: &ModelInput, differs: bool) -> ChannelView {
        let sample = self.sample(input);
        let word = input.control;
        let requested = self.requested(&word);
        let of = |function| requested.iter().filter(move |(_, one)| one.0 == function).map(|(_, one)| one.1);
        let requests = Requests {
            sto: of(etg::STO).next().is_some() || differs,
            ss1: of(etg::SS1).collect(),
            ss2: of(etg::SS2).collect(),
        };
        let (acknowledge, error_edge, restart_edge) = self.acknowledge_edges(input);
        if error_edge {
            let unanswered = self.unanswered(&requested, &word, &sample);
            self.clear(&unanswered);
        }
        self.leave(&requests, restart_edge);
        self.stop.request(&requests, &self.parameters, self.now, sample.speed);

        let mut reactions = Vec::new();
        for (function, instance, finding, reaction) in self.supervise(&sample) {
            self.remember((function, instance), finding, reaction);
            reactions.push(reaction);
        }
        if self.stop.state() != StopState::Sto {
            for (instance, finding, reaction) in self.monitor(&requested, &word, &sample) {
                self.remember(instance, finding, reaction);
                reactions.push(reaction);
            }
        }
        self.react(reactions, &sample);
        if self.stop.state() == StopState::Sto {
            self.monitors.iter_mut().for_each(Monitor::switch_off);
            self.sdi.switch_off();
        }
        self.sdi.note(sample.speed);
        self.update_restart_request(&requests);

        let view = ChannelView {
            status: self.status(&word, &sample),
            requested: requested.iter().fold(Word::ZERO, |all, (bit, _)| all.with(*bit, true)),
            inputs: 0,
            acknowledge,
            ready: self.stop.state() != StopState::Sto,
            stop: self.stop.state(),
            errors: self.standing.iter().map(|one| [one.code(), 0, 0, 0]).collect(),
        };
        self.now += 1;
        view
    }

    fn acknowledge_levels(&self, input: &ModelInput) -> u32 {
        let word = input.control;
        u32::from(word.bit(control::ERROR_ACK)) | u32::from(word.bit(control::RESTART_ACKNOWLEDGE)) << 1
    }

    fn fork(&self) -> Box<dyn Channel> {
        Box::new(self.clone())
    }
}
