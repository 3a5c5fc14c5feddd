//! ETG.6100.2: any number of instances of sixteen functions, mapped to bits of the words.

mod build;
pub mod codes;
mod object;
mod reach;
mod rules;
mod stops;
mod words;

use super::{Outside, Requests, State};
use crate::engine::Range;
use crate::engine::places::Places;
use crate::engine::stop::{Demand, STOPS, Stops};
use shm_schema::drive::DriveRequest;
use shm_schema::facts::etg_6100_2::{control, status};
use shm_schema::word::Word;

pub use build::build;
pub use rules::findings;

const RPM: i64 = 1_000;
/// Requests the watches can have; the places behind are the modes of SDI.
const SEATS: usize = 60;
const SDI_BOTH: u8 = 60;
const SDI_POSITIVE_ONLY: u8 = 61;
const SDI_NEGATIVE_ONLY: u8 = 62;
/// Monitors of the status word that ask for nothing.
const SIGNALS: usize = 16;

/// What a control bit requests.
#[derive(Debug, Clone, Copy)]
enum Target {
    Watch(u8),
    Stop(u8),
    Brake,
}

/// SSM or SCA.
#[derive(Debug, Clone, Copy)]
struct Signal {
    position: bool,
    range: Range,
    status: u8,
}

/// The own part of an axis.
#[derive(Debug, Clone)]
pub struct Etg {
    targets: [Option<(u8, Target)>; SEATS],
    used: usize,
    known: Word,
    signals: [Option<Signal>; SIGNALS],
    standing_status: [Option<u8>; STOPS],
    stop_times_ns: [Option<(u64, u64)>; STOPS],
    brake_status: Option<u8>,
    brake_requested: bool,
    sdi: Option<i64>,
    error_armed: bool,
    restart_armed: bool,
}

impl Etg {
    /// Requests of this step.
    pub fn requests(&mut self, outside: &Outside, stops: &Stops) -> Requests {
        let mut requests = Requests::default();
        let word = outside.word.unwrap_or(Word::ZERO);
        let mut requested = self.known;
        for (asked, word) in requested.0.iter_mut().zip(word.0) {
            *asked &= !word;
        }
        requests.requested = requested;
        self.brake_requested = false;
        requests.demand = Demand { sto: requested.bit(control::STO), ..Demand::default() };
        for (bit, target) in self.targets.iter().take(self.used).flatten() {
            if !requested.bit(*bit) {
                continue;
            }
            match target {
                Target::Watch(seat) => requests.watches |= 1_u64.wrapping_shl(u32::from(*seat)),
                Target::Stop(place) => {
                    requests.demand.stops = requests.demand.stops.with(Places::of(*place));
                }
                Target::Brake => self.brake_requested = true,
            }
        }
        let mode = match (requested.bit(control::SDIP), requested.bit(control::SDIN)) {
            (false, false) => None,
            (true, true) => Some(SDI_BOTH),
            (false, true) => Some(SDI_POSITIVE_ONLY),
            (true, false) => Some(SDI_NEGATIVE_ONLY),
        };
        requests.watches |= mode.map_or(0, |mode| 1_u64.wrapping_shl(u32::from(mode)));
        let level = |bit: u8| outside.word.map(|word| word.bit(bit));
        let (error, restart) = (level(control::ERROR_ACK), level(control::RESTART_ACKNOWLEDGE));
        requests.acknowledgements = u32::from(error == Some(true)) | u32::from(restart == Some(true)) << 1;
        requests.acknowledge = super::edge(&mut self.error_armed, error);
        // ETG-RST-03: while the request is shown; the first torque after the start has none (DEC-19).
        let awaited = stops.restart_pending | !outside.operational;
        requests.demand.restart = super::edge(&mut self.restart_armed, restart) & awaited;
        requests
    }

    /// Status word; SSM, SCA and the moving bits go on in STO (DEC-14).
    pub fn status(&self, state: &State) -> Word {
        let mut word = Word::ZERO.with(status::STO, state.sto).with(status::ERROR, state.error);
        for signal in self.signals.iter().flatten() {
            let value = if signal.position { state.sample.position } else { state.sample.speed };
            word = word.with(signal.status, signal.range.left_by(value).is_none());
        }
        if let Some(zero) = self.sdi {
            let speed = state.sample.speed;
            word = word.with(status::SDIP, speed > zero).with(status::SDIN, speed < zero.saturating_neg());
        }
        if let Some(bit) = self.brake_status {
            word = word.with(bit, self.brake_open(state));
        }
        word = word.with(status::RESTART_ACKNOWLEDGE_REQUEST, state.stops.restart_pending);
        if state.sto {
            return word;
        }
        for (part, shown) in word.0.iter_mut().zip(state.watches.shown().0) {
            *part |= shown;
        }
        for place in state.stops.standing() {
            let bit = self.standing_status.get(usize::from(place)).copied().flatten();
            word = bit.map_or(word, |bit| word.with(bit, true));
        }
        word
    }

    /// ETG-SBC-01 to ETG-SBC-06.
    fn brake_open(&self, state: &State) -> bool {
        let closing = state.stops.braking().into_iter().any(|place| self.closes(place, state));
        !(state.sto | self.brake_requested | closing)
    }

    /// The stop at `place` has come so far that the brake has to close.
    fn closes(&self, place: u8, state: &State) -> bool {
        let times = self.stop_times_ns.get(usize::from(place)).copied().flatten();
        let Some(((late_ns, dwell_ns), progress)) = times.zip(state.stops.progress(place)) else {
            return false;
        };
        let now_ns = state.sample.now_ns;
        let late = now_ns.saturating_sub(progress.since_ns()) >= late_ns;
        let inside = progress.inside_since_ns();
        let dwelt = inside.is_some_and(|since| now_ns.saturating_sub(since) >= dwell_ns);
        late | dwelt
    }

    /// What is asked of the drive.
    pub fn drive(&self, state: &State) -> DriveRequest {
        DriveRequest { brake_open: self.brake_open(state), ..DriveRequest::default() }
    }
}
