//! One AMK channel: inputs and control word, acknowledgement, stops, monitors, SEM, status.
//!
//! Order of a cycle: acknowledge, leave finished stops, take requests, supervise the stop,
//! evaluate the monitors (not in STO), SEM, react. So an edge clears only what stood
//! before (DEC-16), a finished stop is seen for one cycle at least (DEC-48), and a
//! violation acts in the cycle that finds it (DEC-24).

mod codes;
mod monitors;
mod parameters;
mod sem;
mod stops;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use shm_schema::facts::amk_kw::{control, status};
use shm_schema::word::Word;

use codes::Violation;
use monitors::Monitor;
use parameters::{Parameters, Reaction};
use sem::{Said, Sem};
use stops::{Requests, Stop};

use super::filter::LineFilter;
use super::{Channel, ChannelView, ModelInput, StopState, Which};

/// A code that stands until it is acknowledged.
#[derive(Debug, Clone)]
struct Standing {
    code: [u32; 4],
    /// `None`: a warning without a stop.
    reaction: Option<Reaction>,
    /// The status bit of the violated monitor.
    monitor: Option<u8>,
}

/// One AMK channel.
#[derive(Debug, Clone)]
pub struct Amk {
    parameters: Parameters,
    which: Which,
    now: i64,
    filters: Option<Vec<LineFilter>>,
    acknowledge_before: Option<u32>,
    stop: Stop,
    monitors: Vec<Monitor>,
    sem: Sem,
    standing: Vec<Standing>,
}

/// Filter parameters of the pairs' lines (AMK-FILT-07) and their inversion (AMK-IN-05).
const PAIRS: [(u32, u32, u32); 3] = [(71, 73, 70), (77, 79, 76), (83, 85, 82)];

impl Amk {
    /// A settled channel.
    pub fn new(given: &BTreeMap<u32, i32>, which: Which) -> Self {
        let parameters = Parameters::new(given);
        Self {
            sem: Sem::new(&parameters, which),
            parameters,
            which,
            now: 0,
            filters: None,
            acknowledge_before: None,
            stop: Stop::None,
            monitors: Monitor::all(),
            standing: Vec::new(),
        }
    }

    /// The logical levels of the three pairs as this channel sees them: its own line
    /// (DEC-36), the second one inverted where Prm70, 76, 82 say so.
    fn levels(&mut self, input: &ModelInput) -> [bool; 3] {
        let which = self.which;
        let raw: Vec<bool> =
            input.se[..3].iter().map(|pair| if which == Which::A { pair.0 } else { pair.1 }).collect();
        let parameters = &self.parameters;
        let filters = self.filters.get_or_insert_with(|| {
            let time =
                |pair: (u32, u32, u32)| parameters.raw(if which == Which::A { pair.0 } else { pair.1 });
            PAIRS.iter().zip(&raw).map(|(pair, level)| LineFilter::settled(*level, time(*pair))).collect()
        });
        let mut levels = [false; 3];
        for (index, filter) in filters.iter_mut().enumerate() {
            let inverted = which == Which::B && parameters.raw(PAIRS[index].2) == 1;
            levels[index] = filter.cycle(raw[index]) != inverted;
        }
        levels
    }

    /// AMK-GEN-08: either the control word or the inputs request, never both.
    fn requested(&self, control_word: &Word, levels: [bool; 3]) -> Word {
        let assignable: Vec<u8> = [0, 1, 2, 3, 4, 5, 6, 9, 10, 11, 12, 13, 14].to_vec();
        let mut requested = Word::ZERO;
        if self.parameters.raw(7) == 0 {
            // AMK-FSOE-09: 0 requests.
            for bit in assignable {
                requested = requested.with(bit, !control_word.bit(bit));
            }
            return requested;
        }
        // AMK-IN-02: level 0 requests; the assigned value is the bit number (AMKP-SE-04).
        for (level, assignment) in levels.into_iter().zip([15, 16, 17]) {
            let bit = self.parameters.raw(assignment);
            if bit != 16 && !level {
                requested = requested.with(bit as u8, true);
            }
        }
        requested
    }

    /// AMK-ACK-02: control bit 7 or the non-safe command, on the rising edge; what is high
    /// from the start is no edge (DEC-16).
    fn acknowledge(&mut self, input: &ModelInput) -> u32 {
        let levels = self.acknowledge_levels(input);
        let before = self.acknowledge_before.replace(levels).unwrap_or(levels);
        if levels & !before != 0 {
            self.clear();
        }
        levels
    }

    /// DEC-15: what has reached its end state stands no longer and is cleared.
    fn clear(&mut self) {
        let state = self.stop.state();
        let finished = |reaction: Option<Reaction>| match reaction {
            None => true,
            Some(Reaction::Sto | Reaction::Ss1) => state == StopState::Sto,
            Some(Reaction::Ss2) => state == StopState::Sto || state == StopState::Sos,
        };
        for standing in self.standing.iter().filter(|standing| finished(standing.reaction)) {
            for monitor in self.monitors.iter_mut().filter(|monitor| Some(monitor.bit) == standing.monitor) {
                monitor.cleared();
            }
        }
        self.standing.retain(|standing| !finished(standing.reaction));
    }

    /// AMK-ACK-01: a violation sets the error bit whatever its reaction; a warning without
    /// a stop does not (DEC-47).
    fn error_stands(&self) -> bool {
        self.standing.iter().any(|standing| standing.reaction.is_some())
    }

    fn remember(&mut self, standing: Standing) {
        if !self.standing.iter().any(|other| other.code == standing.code) {
            self.standing.push(standing);
        }
    }

    fn remember_violation(&mut self, violation: Violation) {
        let monitor = (violation.function >= 103).then(|| (violation.function - 100) as u8);
        let code = violation.code(self.which);
        self.remember(Standing { code, reaction: Some(violation.reaction), monitor });
    }

    /// Monitors run in every state but STO (DEC-14).
    fn monitor(&mut self, requested: Word, input: &ModelInput) -> Vec<Violation> {
        let (parameters, now) = (&self.parameters, self.now);
        self.monitors
            .iter_mut()
            .filter_map(|monitor| {
                let wanted = monitor.is_always_requested() || requested.bit(monitor.bit);
                monitor.step(parameters, wanted, now, input.position, input.speed_mrpm)
            })
            .collect()
    }

    /// AMK-SEM-07: warning, then error with SS1.
    fn supervise_standstill(&mut self, position: i64) -> Option<Reaction> {
        match self.sem.step(self.now, position)? {
            Said::Warning(code) => {
                self.remember(Standing { code, reaction: None, monitor: None });
                None
            }
            Said::Error(code) => {
                self.remember(Standing { code, reaction: Some(Reaction::Ss1), monitor: None });
                Some(Reaction::Ss1)
            }
        }
    }

    /// DEC-13: the highest reaction wins; what starts now is supervised from now on.
    fn react(&mut self, reactions: &[Reaction], input: &ModelInput) {
        let Some(highest) = reactions.iter().min() else { return };
        let before = self.stop.state();
        self.stop.react(*highest, &self.parameters, self.now, input.speed_mrpm);
        if self.stop.state() != before {
            let violation = self.stop.supervise(&self.parameters, self.now, input.position, input.speed_mrpm);
            if let Some(violation) = violation {
                self.remember_violation(violation);
                self.stop.go_to_sto();
            }
        }
    }

    fn status(&self, levels: [bool; 3]) -> Word {
        let state = self.stop.state();
        let mut word = Word::ZERO
            .with(status::STO, state == StopState::Sto)
            .with(status::ERROR, self.error_stands())
            .with(status::SS1_ACTIVE, state == StopState::Ss1)
            .with(status::SS2_ACTIVE, state == StopState::Ss2)
            .with(status::VALID, true)
            .with(status::SE1, levels[0])
            .with(status::SE2, levels[1])
            .with(status::SE3, levels[2]);
        for monitor in &self.monitors {
            word = word.with(monitor.bit, monitor.is_acknowledged());
        }
        // AMK-SS2-05: the standstill of SS2 shows as SOS.
        let sos = word.bit(status::SOS) || state == StopState::Sos;
        word.with(status::SOS, sos)
    }
}

impl Channel for Amk {
    fn step(&mut self, input: &ModelInput, differs: bool) -> ChannelView {
        let levels = self.levels(input);
        let requested = self.requested(&input.control, levels);
        let requests = Requests {
            sto: requested.bit(control::STO) || differs,
            ss1: requested.bit(control::SS1),
            ss2: requested.bit(control::SS2),
        };
        let acknowledge = self.acknowledge(input);
        self.stop.leave(requests, self.error_stands());
        self.stop.request(requests, &self.parameters, self.now, input.speed_mrpm);

        let mut found: Vec<Violation> = Vec::new();
        found.extend(self.stop.supervise(&self.parameters, self.now, input.position, input.speed_mrpm));
        if self.stop.state() != StopState::Sto {
            found.extend(self.monitor(requested, input));
        }
        let mut reactions: Vec<Reaction> = found.iter().map(|violation| violation.reaction).collect();
        for violation in &found {
            self.remember_violation(*violation);
        }
        reactions.extend(self.supervise_standstill(input.position));
        self.react(&reactions, input);
        if self.stop.state() == StopState::Sto {
            self.monitors.iter_mut().for_each(Monitor::switch_off);
        }

        let view = ChannelView {
            status: self.status(levels),
            requested,
            inputs: (0..3).fold(0, |all, index| all | u32::from(levels[index]) << index),
            acknowledge,
            ready: self.stop.state() != StopState::Sto,
            stop: self.stop.state(),
            errors: self.standing.iter().map(|standing| standing.code).collect(),
        };
        self.now += 1;
        view
    }

    fn acknowledge_levels(&self, input: &ModelInput) -> u32 {
        u32::from(input.control.bit(control::ERROR_ACK)) | u32::from(input.clear_error) << 2
    }

    fn fork(&self) -> Box<dyn Channel> {
        Box::new(self.clone())
    }
}
