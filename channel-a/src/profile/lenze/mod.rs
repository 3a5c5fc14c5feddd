//! Lenze 9400 SM301, V1.4: stops with one common stopping time, operation modes, emergency
//! stop, cascading, two-channel inputs.

mod build;
pub mod codes;
mod contacts;
mod overspeed;
mod pairs;
mod pulse;
mod rules;

use super::{Outside, Requests, Response, Scene, State, edge};
use crate::engine::places::Places;
use crate::engine::stop::{Demand, Reaction, Stops};
use crate::engine::watch::{Quantity, Watch};
use crate::engine::watches::Watches;
use crate::engine::{Range, Sample};
use crate::errors::{Class, Errors};
use crate::image::Image;
use contacts::Contact;
use overspeed::Overspeed;
use pairs::{Pairs, Role};
use pulse::Pulse;
use shm_schema::drive::DriveRequest;
use shm_schema::error::ErrorCode;
use shm_schema::facts::lenze_sm301::{control, status};
use shm_schema::profile::lenze_key;
use shm_schema::word::Word;

pub use build::build;
pub use rules::findings;

const RPM: i64 = 1_000;
const MILLISECOND: u64 = 1_000_000;
const SS1: u8 = 0;
const SS2: u8 = 1;
const PAIRS: usize = 4;
/// Restart of a cascade after its acknowledgement, ns (LNZ-CAS-06).
const CASCADE_RESTART_NS: u64 = 100 * MILLISECOND;
/// A restart comes round a cascade in this time at the latest: 100 drives of 14 ms each (LNZ-CAS-13, DEC-46).
const CASCADE_ROUND_NS: u64 = 1_400 * MILLISECOND;
/// Functions of the control word that are requested by 0.
const ACTIVE_LOW: u32 = 0x0080_01FF;
const NEUTRAL: u32 = 0x0180_01FF;
/// What needs an encoder (LNZ-SPD-09), as control bits.
const NEEDS_ENCODER: u32 = 0x0000_01FC;
const SLI_REQUEST: u8 = 10;
/// The valuations in the reported inputs.
const VALUATIONS: u32 = (1 << PAIRS) - 1;
const SLS: [u8; 4] = [control::SLS1, control::SLS2, control::SLS3, control::SLS4];
/// Codes of the limits that C15350 knows: SLS1 to SLS4 from here on, and SMS.
const SLS_CODE: u16 = 98;
const SMS_CODE: u16 = 105;
const OVERSPEEDS: usize = (SMS_CODE - SLS_CODE) as usize + 1;
const STILL_FAST: u32 = 102;
/// LNZ-SPD-10
const NO_ENCODER: u32 = 107;
/// LNZ-CAS-13
const CASCADE_LATE: u32 = 108;
const CASCADE_HARDWARE: u32 = 109;

/// What may change the operation mode, from the bus, and whether the enable switch may.
#[derive(Debug, Clone, Copy)]
struct Switches {
    mode_bus: bool,
    enable_bus: Option<bool>,
    kept: bool,
}

/// Operation mode (LNZ-OMS-04 to LNZ-OMS-07).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    /// State 1, and the stops of normal operation.
    Normal,
    /// State 2: special operation, stopped until the enable switch confirms.
    Waiting,
    /// State 3: special operation, confirmed.
    Confirmed,
}

/// Where a cascade is (LNZ-CAS-04 to LNZ-CAS-06).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cascade {
    Closed,
    /// Tripped; its input has been OFF since.
    Tripped(bool),
    /// Acknowledged at this time.
    Restarting(u64),
}

/// The own part of an axis.
#[derive(Debug, Clone)]
pub struct Lenze {
    filter: u32,
    bus: bool,
    pairs: Pairs,
    mode: Mode,
    special_when_low: bool,
    special_stop: Reaction,
    motion: u32,
    permanent: u32,
    with_sls: [u32; 4],
    /// Requests of the SLS with a direction (C15333).
    directed_sls: u32,
    limited_increment: bool,
    emergency_stop: Reaction,
    emergency: bool,
    emergency_asked: bool,
    cascade: Option<Cascade>,
    overspeed: Overspeed,
    encoderless: bool,
    enable_armed: bool,
    ais_armed: bool,
    aie_armed: bool,
    ais: Pulse,
    aie: Pulse,
    special_requested: bool,
    output_by_bus: bool,
    output_off: bool,
    output_conditions: [u32; 2],
    output_and: bool,
    resolver: bool,
    window: Range,
}

fn code(image: &Image, number: u32, subcode: u32) -> i64 {
    image.value(lenze_key(number, subcode))
}

impl Lenze {
    /// Requests of this step.
    pub fn requests(
        &mut self,
        outside: &Outside,
        watches: &Watches,
        stops: &Stops,
        errors: &mut Errors,
    ) -> Requests {
        let mut requests = Requests::default();
        // LNZ-EX-14: an inhibited bit is inactive.
        let word = outside.word.map(|word| word.0[0]);
        let word = if self.bus { word } else { Some(NEUTRAL) };
        let passed = (word.unwrap_or(0) & self.filter) | (NEUTRAL & !self.filter);
        let bit = |number: u8| word.map(|_| passed.wrapping_shr(u32::from(number)) & 1 == 1);
        let mut asked = !passed & ACTIVE_LOW;
        let mode_bus = bit(control::OMS) == Some(true);
        let enable_bus = bit(control::ES);
        let acknowledged =
            self.acknowledgements(outside, bit(control::PS_AIS), bit(control::PS_AIE), &mut requests);
        // DEC-15: a violation is acknowledged once its reaction has reached its end state.
        if acknowledged & stops.is_settled() {
            self.overspeed.end();
        }
        requests.inputs |= self.pairs.take(outside, acknowledged, errors);
        asked |= self.pairs.asked();
        // What bus or inputs ask for; what a parameter, another function or special operation adds
        // or holds back is no request.
        requests.requested = Word::from_u32(asked);
        self.output_off = passed & (1 << control::SD_OUT1) == 0;
        let switches = Switches { mode_bus, enable_bus, kept: self.keeps_limit(outside, watches, stops) };
        let asked = self.operate(asked, switches, &mut requests);
        self.demand(asked, outside, stops, &mut requests, errors);
        requests
    }

    /// Bus edges and terminal pulses (LNZ-ACK-01 to LNZ-ACK-06).
    fn acknowledgements(
        &mut self,
        outside: &Outside,
        ais: Option<bool>,
        aie: Option<bool>,
        requests: &mut Requests,
    ) -> bool {
        let terminal = |pattern: Option<u64>| pattern.map(|pattern| pattern & 1 == 1);
        let ais_level = terminal(outside.io.map(|io| io.ais));
        let aie_level = terminal(outside.io.map(|io| io.aie));
        let by_bus = (edge(&mut self.ais_armed, ais), edge(&mut self.aie_armed, aie));
        let by_pulse = (self.ais.step(ais_level, outside.now_ns), self.aie.step(aie_level, outside.now_ns));
        requests.acknowledge = by_bus.1 | by_pulse.1;
        requests.demand.restart = by_bus.0 | by_pulse.0;
        // A pulse at a terminal acknowledges crosscheck's errors as well: it shows for one exchange.
        let error = u32::from((aie == Some(true)) | by_pulse.1);
        let restart = u32::from((ais == Some(true)) | by_pulse.0) << 1;
        requests.acknowledgements = error | restart;
        requests.inputs |= u32::from(ais_level == Some(true)) << 4 | u32::from(aie_level == Some(true)) << 5;
        requests.acknowledge
    }

    /// LNZ-OMS-22: the limited speed has to be monitored and kept, as the status says it. In STO
    /// nothing is monitored (DEC-14): there the limit itself is asked.
    fn keeps_limit(&self, outside: &Outside, watches: &Watches, stops: &Stops) -> bool {
        let waits = self.mode == Mode::Waiting;
        if !waits | (self.motion == 0) {
            return waits;
        }
        let limits = |watch: &&Watch| {
            watch.plan.request.is_some_and(|bit| self.motion == 1_u32.wrapping_shl(u32::from(bit)))
        };
        let in_sto = stops.is_sto();
        let keeps = |watch: &Watch| {
            let inside = watch.plan.window.has(outside.speed);
            if in_sto { inside } else { is_monitored(watch, outside.speed) }
        };
        watches.iter().filter(limits).any(keeps)
    }

    /// Mode and enable switch; what is asked for in the mode (LNZ-OMS, LNZ-ES).
    fn operate(&mut self, asked: u32, switches: Switches, requests: &mut Requests) -> u32 {
        let Switches { mode_bus, enable_bus, kept } = switches;
        let special = match self.pairs.with(Role::Mode) {
            // LNZ-OMS-16: a faulty selector means normal operation, whatever level selects.
            Some(contact) if self.special_when_low => !(contact.is_on() | contact.is_faulty()),
            Some(contact) => contact.is_on(),
            None => mode_bus,
        };
        let enable = match self.pairs.with(Role::Enable) {
            Some(contact) => Some(contact.is_on()),
            None => enable_bus,
        };
        self.special_requested = special;
        let confirmed = edge(&mut self.enable_armed, enable);
        // LNZ-OMS-08: the emergency stop is a state of its own, an edge in it confirms nothing.
        let accepted = confirmed & kept & (asked & (1 << control::SSE) == 0);
        let left = (self.mode == Mode::Waiting) & !special;
        self.mode = match self.mode {
            Mode::Normal if special => Mode::Waiting,
            Mode::Waiting if !special => Mode::Normal,
            Mode::Waiting if accepted => Mode::Confirmed,
            Mode::Confirmed if enable != Some(true) => Mode::Waiting,
            mode => mode,
        };
        requests.restart_once = left;
        let in_special = self.mode != Mode::Normal;
        let mut asked = asked;
        if in_special {
            // LNZ-OMS-07: simple stops are not executed in special operation.
            asked &= !(1 << control::STO | 1 << control::SS1 | 1 << control::SS2);
            asked |= self.motion;
        } else {
            asked |= self.permanent;
        }
        if self.directed_sls & asked == 0 {
            return asked;
        }
        let sls = SLS.into_iter().zip(self.with_sls).filter(|(bit, _)| asked & (1 << (bit & 31)) != 0);
        sls.fold(asked, |all, (_, direction)| all | direction)
    }

    fn demand(
        &mut self,
        asked: u32,
        outside: &Outside,
        stops: &Stops,
        requests: &mut Requests,
        errors: &mut Errors,
    ) {
        let bit = |number: u8| asked.wrapping_shr(u32::from(number)) & 1 == 1;
        let emergency = bit(control::SSE);
        let idle = stops.is_idle();
        self.emergency_asked = emergency;
        self.emergency = emergency | (self.emergency & !idle);
        let (cascade_trips, restart) = self.cascade_demand(outside, stops, requests.demand.restart, errors);
        requests.demand = Demand {
            sto: bit(control::STO) | cascade_trips,
            stops: Places::when(bit(control::SS1), SS1).with(Places::when(bit(control::SS2), SS2)),
            restart,
            ..Demand::default()
        };
        if emergency {
            requests.demand.ask(self.emergency_stop);
        }
        if self.mode == Mode::Waiting {
            requests.demand.ask(self.special_stop);
        }
        // LNZ-OMS-14: the enable switch ends the stop of special operation at once.
        let confirmed = self.mode == Mode::Confirmed;
        let ended = stops.is_settled() & !stops.is_sto();
        let may_release = self.cascade.is_none() | ended;
        requests.demand.release = confirmed & !self.emergency & may_release & !idle;
        requests.watches = u64::from(asked);
        if confirmed & self.limited_increment {
            requests.watches |= 1 << SLI_REQUEST;
        }
        let unseen = self.encoderless & (asked & NEEDS_ENCODER != 0);
        if unseen {
            errors.raise(ErrorCode::single(NO_ENCODER), Class::Cause);
        }
    }

    /// Whether the cascade asks for STO, and whether a restart takes place: with a cascade when
    /// it has come round, not with the edge (LNZ-CAS-06).
    fn cascade_demand(
        &mut self,
        outside: &Outside,
        stops: &Stops,
        restart: bool,
        errors: &mut Errors,
    ) -> (bool, bool) {
        let Some(cascade) = self.cascade else { return (false, restart) };
        let on = self.pairs.with(Role::Cascade).is_some_and(Contact::is_on);
        let now_ns = outside.now_ns;
        let next = match cascade {
            Cascade::Closed if stops.is_sto() | !on => Cascade::Tripped(!on),
            Cascade::Tripped(seen) if restart & (seen | !on) => Cascade::Restarting(now_ns),
            Cascade::Tripped(seen) => Cascade::Tripped(seen | !on),
            Cascade::Restarting(since) => {
                let waited = now_ns.saturating_sub(since);
                match (waited >= CASCADE_RESTART_NS, on) {
                    (true, true) => Cascade::Closed,
                    (true, false) if waited > CASCADE_ROUND_NS => Cascade::Tripped(true),
                    _ => cascade,
                }
            }
            Cascade::Closed => cascade,
        };
        let restarting = matches!(cascade, Cascade::Restarting(_));
        let late = restarting & matches!(next, Cascade::Tripped(_));
        if late {
            errors.raise(ErrorCode::single(CASCADE_LATE), Class::Limit);
        }
        let released = restarting & (next == Cascade::Closed);
        self.cascade = Some(next);
        (next != Cascade::Closed, released)
    }

    /// SLS and SMS: back inside when C15350 has elapsed since the violation was detected, or STO
    /// with 102 (LNZ-SMS-06, LNZ-EX-27).
    pub fn respond(&mut self, scene: &Scene) -> Response {
        if !scene.monitored {
            self.overspeed.end();
            return Response::NOTHING;
        }
        self.overspeed.begin(scene.watches.violated());
        if self.overspeed.is_late(scene.sample) {
            let error = Some((ErrorCode::single(STILL_FAST), Class::Limit));
            return Response { error, reaction: Reaction::Sto };
        }
        Response::NOTHING
    }

    /// Without an encoder the drive's own standstill is all there is (LNZ-SS1-02).
    pub fn sample(&self, sample: Sample, drive_n0: bool) -> Sample {
        if !self.encoderless {
            return sample;
        }
        let unknown = self.window.upper.saturating_add(1);
        Sample { speed: if drive_n0 { 0 } else { unknown }, ..sample }
    }

    /// Status word.
    pub fn status(&self, state: &State) -> Word {
        let mut word = 0_u32;
        let mut set = |bit: u8, value: bool| word |= u32::from(value).wrapping_shl(u32::from(bit));
        let braking = |place| state.stops.braking().has(place);
        let standing = state.stops.standing().has(SS2);
        set(status::STO_ACTIVE, state.sto);
        // LNZ-SS1-11, LNZ-SOS-06: the end is shown additionally.
        set(status::SS1_ACTIVE, braking(SS1) | (state.stops.ended() == Some(SS1)));
        set(status::SS2_ACTIVE, braking(SS2) | standing);
        set(status::SOS_MONITORED, standing);
        let special = self.mode != Mode::Normal;
        set(status::OMS, self.special_requested);
        set(status::OMS_ACTIVE, special);
        set(status::ES_ACTIVE, self.mode == Mode::Confirmed);
        // LNZ-SSE-04: the request; its end shows as STO or SS1.
        set(status::SSE_ACTIVE, self.emergency_asked);
        set(status::ERROR_ACTIVE, state.error);
        // SD-In1 to SD-In4 stand side by side.
        word |= (state.requests.inputs & VALUATIONS) << status::SD_IN1;
        if state.sto {
            return Word::from_u32(word);
        }
        word |= state.watches.engaged() as u32 | state.watches.shown().0[0];
        for watch in state.watches.restless() {
            let early = is_monitored(watch, state.sample.speed);
            if let Some(bit) = watch.plan.status.filter(|_| early) {
                word |= 1_u32.wrapping_shl(u32::from(bit));
            }
        }
        Word::from_u32(word)
    }

    /// SD-Out1 in bits 0 and 1.
    pub fn drive(&self, state: &State) -> DriveRequest {
        let by_bus = !self.output_off | !self.output_by_bus;
        // LNZ-OUT-03: a detected fault of the output sets it off.
        let permitted = by_bus & !state.output_fault;
        let on = match self.cascade {
            Some(Cascade::Closed) => !state.sto,
            Some(Cascade::Restarting(since)) => {
                state.sample.now_ns.saturating_sub(since) >= CASCADE_RESTART_NS
            }
            Some(Cascade::Tripped(_)) => false,
            None if self.output_conditions == [0, 0] => false,
            None => self.output(self.status(state).0[0]),
        };
        let outputs = u8::from(on & permitted) * 0b0011;
        DriveRequest { brake_open: !state.sto, outputs, ..DriveRequest::default() }
    }

    /// C15051/1, C15052/1: pairs of a condition and its inverse; C15055/1 joins them.
    fn output(&self, word: u32) -> bool {
        const FIRST: [u8; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 29];
        const SECOND: [u8; 16] = [16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31];
        let [first, second] = self.output_conditions;
        let rows = FIRST.into_iter().zip(0..).map(|(bit, at)| (bit, first, at));
        let rows = rows.chain(SECOND.into_iter().zip(0..).map(|(bit, at)| (bit, second, at)));
        let mut any = false;
        let mut all = true;
        let mut selected = false;
        for (bit, conditions, at) in rows {
            let value = word.wrapping_shr(u32::from(bit)) & 1 == 1;
            let at: u32 = at;
            for (offset, met) in [(0, value), (1, !value)] {
                let wanted = conditions.wrapping_shr(2 * at + offset) & 1 == 1;
                selected |= wanted;
                any |= wanted & met;
                all &= !wanted | met;
            }
        }
        selected & if self.output_and { all } else { any }
    }
}

/// LNZ-SLS-02: a limited speed from V1.3 on as soon as the speed is below the limit.
fn is_monitored(watch: &Watch, speed: i64) -> bool {
    let inside = watch.plan.window.left_by(speed).is_none();
    let early = (watch.plan.quantity == Quantity::Speed) & watch.engaged() & inside;
    watch.active() | early
}
