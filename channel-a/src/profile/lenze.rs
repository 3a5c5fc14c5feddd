//! Lenze 9400 SM301, V1.4: stops with one common stopping time, operation modes, emergency
//! stop, cascading, two-channel inputs.

use shm_schema::drive::DriveRequest;
use shm_schema::encoder::SlotKind;
use shm_schema::error::ErrorCode;
use shm_schema::facts::lenze_sm301::{control, status};
use shm_schema::profile::lenze_key;
use shm_schema::word::Word;

use super::contacts::Contact;
use super::pulse::Pulse;
use super::{Fault, Outside, Program, Requests, Response, Rules, Scene, State, edge};
use crate::encoder::{Fault as EncoderFault, Selection};
use crate::engine::approach::{Approach, Fall};
use crate::engine::stop::{self, Active, Demand, End, Reaction, Stops};
use crate::engine::watch::{Part, Plan, Quantity, Violation, Watch};
use crate::engine::{Range, Sample};
use crate::errors::Class;
use crate::image::Image;
use crate::inputs::filter_samples;
use crate::outputs::Gaps;
use crate::partner::Findings;
use crate::path::PathFault;

const RPM: i64 = 1_000;
const MILLISECOND: u64 = 1_000_000;
const SS1: u8 = 0;
const SS2: u8 = 1;
const PAIRS: usize = 4;
/// Fixed filter for test pulses, µs (LNZ-IN-11).
const TEST_PULSE_US: u64 = 2_000;
/// Restart of a cascade after its acknowledgement, ns (LNZ-CAS-06).
const CASCADE_RESTART_NS: u64 = 100 * MILLISECOND;
/// Longest time until the restart has gone round the cascade, ns (DEC-46).
const CASCADE_ROUND_NS: u64 = 1_000 * MILLISECOND;
/// Functions of the control word that are requested by 0.
const ACTIVE_LOW: u32 = 0x0080_01FF;
const NEUTRAL: u32 = 0x0180_01FF;
/// What needs an encoder (LNZ-SPD-09), as control bits.
const NEEDS_ENCODER: u32 = 0x0000_01FC;
/// Gap of the clock output, µs, below 1 ms, and its period, ms (LNZ-PAS-02).
const CLOCK_GAP_US: i64 = 500;
const CLOCK_PERIOD_MS: i64 = 2_000;
const SLI_REQUEST: u8 = 10;
const SMS: u16 = 105;
const SLI: u16 = 111;
const SDI: [(u8, u16); 2] = [(control::SDIPOS, 103), (control::SDINEG, 104)];
const SLS: [u8; 4] = [control::SLS1, control::SLS2, control::SLS3, control::SLS4];
const STOP_LATE: u32 = 97;
const STILL_FAST: u32 = 102;
const SOS_LEFT: u16 = 106;
const RAMP_LEFT: u32 = 110;

/// The role of a safe input (C15031, C15032).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Deactivated,
    /// Bits of the control word that OFF requests.
    Request(u32),
    Mode,
    Enable,
    Cascade,
}

/// Operation mode (LNZ-OMS-04 to LNZ-OMS-07).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Normal,
    /// Special operation; confirmed by the enable switch.
    Special(bool),
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
    roles: [Role; PAIRS],
    contacts: [Contact; PAIRS],
    samples: Option<u64>,
    initialised: bool,
    mode: Mode,
    special_when_low: bool,
    special_stop: i64,
    motion: u32,
    permanent: u32,
    with_sls: [u32; 4],
    limited_increment: bool,
    emergency_ss1: bool,
    emergency: bool,
    emergency_asked: bool,
    cascade: Option<Cascade>,
    response_ns: u64,
    late: Option<u64>,
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
    /// Speed of the step before, 1/1000 rpm.
    speed: i64,
}

fn code(image: &Image, number: u32, subcode: u32) -> i64 {
    image.value(lenze_key(number, subcode))
}

fn reaction(value: i64) -> Reaction {
    match value {
        1 => Reaction::Stop(SS1),
        2 => Reaction::Stop(SS2),
        _ => Reaction::Sto,
    }
}

/// Directions as request bits: 1 is only positive, 2 only negative.
const fn direction(value: i64) -> u32 {
    match value {
        1 => 1 << control::SDIPOS,
        2 => 1 << control::SDINEG,
        _ => 0,
    }
}

/// Builds the axis.
pub fn build(image: &Image, program: &mut Program) {
    program.take_common(image);
    let c = |number: u32| code(image, number, 0);
    let rpm = |number: u32| c(number).saturating_mul(RPM);
    let after = |delay_ms: i64, window: Range| Approach {
        unmonitored: true,
        limit_ns: Some((delay_ms.max(0) as u64).saturating_mul(MILLISECOND)),
        window,
        ..Approach::default()
    };
    let plan = |quantity, approach: Approach, window, function: u16, request, error| Plan {
        quantity,
        approach,
        window,
        function,
        request,
        status: None,
        reaction: error,
    };
    let top = Range::symmetric(rpm(15_320));
    if c(15_320) > 0 {
        program.add(plan(Quantity::Speed, after(0, top), top, SMS, None, reaction(c(15_321))));
    }
    for (bit, number) in SLS.into_iter().zip(1..) {
        let window = Range::symmetric(code(image, 15_330, number).saturating_mul(RPM));
        let way = after(code(image, 15_331, number), window);
        let error = reaction(code(image, 15_332, number));
        program.add(plan(Quantity::Speed, way, window, 97 + number as u16, Some(bit), error));
    }
    let tolerance = c(15_342);
    let back = Range { lower: tolerance.saturating_neg(), upper: i64::MAX };
    let forth = Range { lower: i64::MIN, upper: tolerance };
    for ((bit, number), (quantity, window)) in
        SDI.into_iter().zip([(Quantity::TravelFromHighest, back), (Quantity::TravelFromLowest, forth)])
    {
        program.add(plan(
            quantity,
            after(c(15_341), Range::ALL),
            window,
            number,
            Some(bit),
            reaction(c(15_343)),
        ));
    }
    let increment = Range::symmetric(c(15_203));
    program.add(plan(
        Quantity::Travel,
        after(0, Range::ALL),
        increment,
        SLI,
        Some(SLI_REQUEST),
        Reaction::Sto,
    ));
    stops(image, program);
    // LNZ-PAS-02: the clock output CLA, short gaps every 2 s.
    program.gaps = [Gaps::default(), Gaps::default(), Gaps::new(CLOCK_GAP_US, CLOCK_PERIOD_MS)];
    program.supplies = true;
    let resolver = c(15_400) == 2;
    program.encoder = encoder(image, program.encoder, resolver);
    program.rules = Rules::Lenze(rules(image, resolver));
}

fn encoder(image: &Image, common: Selection, resolver: bool) -> Selection {
    let c = |number: u32| code(image, number, 0);
    let (kind, periods) = match c(15_400) {
        0 => (Some(SlotKind::Encoderless), 1),
        _ if resolver => (Some(SlotKind::Resolver), c(15_430)),
        _ => (Some(SlotKind::SineCosine), c(15_420)),
    };
    Selection { kind, periods, slot: common.slot, inverted: c(15_409) == 1 }
}

fn stops(image: &Image, program: &mut Program) {
    let c = |number: u32| code(image, number, 0);
    let time_ns = |number: u32| (c(number).max(0) as u64).saturating_mul(MILLISECOND);
    let end_ns = time_ns(15_305);
    let window = Range::symmetric(c(15_310).saturating_mul(RPM));
    // LNZ-RAMP-04: 10 % of the stopping time, 30 % at full S-ramp time; in thousandths.
    let share = 100_u64.saturating_add((c(15_316).max(0) as u64).saturating_mul(2));
    let fall = Fall {
        percent: c(15_317),
        least: window.upper,
        hold_ns: end_ns.saturating_mul(share) / 1_000,
        end_ns,
    };
    let way = Approach {
        unmonitored: true,
        limit_ns: Some(end_ns),
        window,
        dwell_in_delay: true,
        fall: (c(15_315) == 1).then_some(fall),
        ..Approach::default()
    };
    let at_zero_1 = (c(15_306) == 1).then(|| time_ns(15_307));
    let at_zero_2 = (c(15_308) == 1).then_some(0);
    let plan = |end, approach, restart| stop::Plan {
        end,
        approach,
        restart,
        judged_at_end: true,
        stand_speed: Range::ALL,
        stand_position: Range::symmetric(c(15_311)),
        stand_function: SOS_LEFT,
        ..stop::Plan::default()
    };
    let restart = |subcode: u32| code(image, 15_300, subcode) == 0;
    program.stops.set(SS1, plan(End::Sto, Approach { dwell_ns: at_zero_1, ..way }, false));
    program.stops.set(SS2, plan(End::Sos, Approach { dwell_ns: at_zero_2, ..way }, restart(2)));
    program.stops.restart = restart(1);
    program.stops.direct_sos = true;
}

fn rules(image: &Image, resolver: bool) -> Lenze {
    let c = |number: u32| code(image, number, 0);
    let each = |number: u32| [1, 2, 3, 4].map(|subcode| code(image, number, subcode));
    let cascading = c(15_035) == 4;
    let mut roles = [Role::Deactivated; PAIRS];
    let rows = each(15_030).into_iter().zip(each(15_031)).zip(each(15_032));
    for (role, ((sensor, function), assigned)) in roles.iter_mut().zip(rows) {
        *role = match (sensor, function) {
            (0, _) => Role::Deactivated,
            (_, 1) => Role::Request(1 << control::SSE),
            (_, 2) => Role::Mode,
            (_, 3) => Role::Enable,
            _ if assigned >= 9 => Role::Request(0),
            _ => Role::Request(1_u32.wrapping_shl(assigned as u32)),
        };
    }
    if cascading {
        roles[3] = Role::Cascade;
    }
    let contact = |(discrepancy, delay): (i64, i64)| {
        let filter_us = TEST_PULSE_US.saturating_add((delay.max(0) as u64).saturating_mul(1_000));
        Contact::new(filter_samples(filter_us), (discrepancy.max(0) as u64).saturating_mul(MILLISECOND))
    };
    let mut contacts = [Contact::default(); PAIRS];
    for (place, row) in contacts.iter_mut().zip(each(15_033).into_iter().zip(each(15_034))) {
        *place = contact(row);
    }
    let filter = c(15_113) as u32;
    Lenze {
        filter,
        bus: c(15_100) != 0,
        roles,
        contacts,
        samples: None,
        initialised: false,
        mode: Mode::Normal,
        special_when_low: c(15_202) == 1,
        special_stop: c(15_200),
        motion: if (3..=6).contains(&c(15_201)) { 1_u32.wrapping_shl(c(15_201) as u32) } else { 0 },
        permanent: direction(c(15_340)),
        with_sls: each(15_333).map(direction),
        limited_increment: c(15_203) > 0,
        emergency_ss1: c(15_205) == 1,
        emergency: false,
        emergency_asked: false,
        cascade: cascading.then_some(Cascade::Closed),
        response_ns: (c(15_350).max(0) as u64).saturating_mul(MILLISECOND),
        late: None,
        encoderless: c(15_400) == 0,
        enable_armed: false,
        ais_armed: false,
        aie_armed: false,
        ais: Pulse::default(),
        aie: Pulse::default(),
        special_requested: false,
        output_off: false,
        output_by_bus: filter & (1 << control::SD_OUT1) != 0,
        output_conditions: [code(image, 15_051, 1) as u32, code(image, 15_052, 1) as u32],
        output_and: code(image, 15_055, 1) == 1,
        resolver,
        window: Range::symmetric(c(15_310).saturating_mul(RPM)),
        speed: 0,
    }
}

impl Lenze {
    /// Requests of this step.
    pub fn requests(&mut self, outside: &Outside, watches: &[Watch], stops: &Stops) -> Requests {
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
        self.inputs(outside, acknowledged, &mut requests);
        asked |= self.asked_by_inputs();
        // What bus or inputs ask for; what a parameter, another function or special operation adds
        // or holds back is no request.
        requests.requested = Word::from_u32(asked);
        self.output_off = passed & (1 << control::SD_OUT1) == 0;
        let asked = self.operate(asked, mode_bus, enable_bus, watches, &mut requests);
        self.demand(asked, outside, stops, &mut requests);
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
        let error = u32::from(aie == Some(true));
        let restart = u32::from(ais == Some(true)) << 1;
        requests.acknowledgements = error | restart;
        requests.inputs |= u32::from(ais_level == Some(true)) << 4 | u32::from(aie_level == Some(true)) << 5;
        requests.acknowledge
    }

    fn inputs(&mut self, outside: &Outside, acknowledged: bool, requests: &mut Requests) {
        let Some(io) = outside.io else {
            self.samples = None;
            self.contacts.iter_mut().for_each(|contact| contact.settle(false, false));
            return;
        };
        let new = self.samples.map_or(0, |before| io.samples.wrapping_sub(before));
        self.samples = Some(io.samples);
        let lines = io.line_1.iter().zip(&io.line_2);
        let rows = self.contacts.iter_mut().zip(&self.roles).zip(lines).zip(&mut requests.faults);
        for (pair, (((contact, role), (own, other)), place)) in (0_u32..).zip(rows) {
            if outside.settle {
                contact.settle(own & 1 == 1, other & 1 == 1);
            }
            if acknowledged {
                contact.acknowledge();
            }
            let faulty = contact.take((*own, *other), new, outside.now_ns);
            if *role == Role::Deactivated {
                // LNZ-IN-03: only during initialisation.
                let live = contact.has_signal() & !self.initialised & !outside.settle;
                *place = live.then(|| (ErrorCode::single(57 + pair), Class::Cause));
                continue;
            }
            requests.inputs |= u32::from(contact.is_on()).wrapping_shl(pair);
            *place = faulty.then(|| (ErrorCode::single(49 + pair), Class::Flaw));
        }
        self.initialised |= outside.operational | outside.settle;
    }

    fn asked_by_inputs(&self) -> u32 {
        let rows = self.roles.iter().zip(&self.contacts);
        rows.fold(0, |asked, (role, contact)| match role {
            Role::Request(bits) if !contact.is_on() => asked | bits,
            _ => asked,
        })
    }

    fn input(&self, wanted: Role) -> Option<&Contact> {
        self.roles.iter().zip(&self.contacts).find(|(role, _)| **role == wanted).map(|(_, contact)| contact)
    }

    /// Mode and enable switch; what is asked for in the mode (LNZ-OMS, LNZ-ES).
    fn operate(
        &mut self,
        asked: u32,
        mode_bus: bool,
        enable_bus: Option<bool>,
        watches: &[Watch],
        requests: &mut Requests,
    ) -> u32 {
        let special = match self.input(Role::Mode) {
            // LNZ-OMS-16: a faulty selector means normal operation.
            Some(contact) if self.special_when_low => !contact.is_on() & !contact.level(),
            Some(contact) => contact.is_on(),
            None => mode_bus,
        };
        let enable = match self.input(Role::Enable) {
            Some(contact) => Some(contact.is_on()),
            None => enable_bus,
        };
        self.special_requested = special;
        let confirmed = edge(&mut self.enable_armed, enable);
        // LNZ-OMS-22: the limited speed has to be monitored and kept, as the status says it.
        let limited = |watch: &Watch| {
            let wanted =
                watch.plan.request.is_some_and(|bit| self.motion == 1_u32.wrapping_shl(u32::from(bit)));
            wanted & is_monitored(watch, self.speed)
        };
        let kept = (self.motion == 0) | watches.iter().any(limited);
        let left = matches!(self.mode, Mode::Special(false)) & !special;
        self.mode = match self.mode {
            Mode::Normal if special => Mode::Special(false),
            Mode::Special(false) if !special => Mode::Normal,
            Mode::Special(false) if confirmed & kept => Mode::Special(true),
            Mode::Special(true) if enable != Some(true) => Mode::Special(false),
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
        let sls = SLS.into_iter().zip(self.with_sls).filter(|(bit, _)| asked & (1 << (bit & 31)) != 0);
        sls.fold(asked, |all, (_, direction)| all | direction)
    }

    fn demand(&mut self, asked: u32, outside: &Outside, stops: &Stops, requests: &mut Requests) {
        let bit = |number: u8| asked.wrapping_shr(u32::from(number)) & 1 == 1;
        let emergency = bit(control::SSE);
        let idle = stops.active() == Active::None;
        self.emergency_asked = emergency;
        self.emergency = emergency | (self.emergency & !idle);
        let waiting = self.mode == Mode::Special(false);
        let special_stop = self.special_stop;
        let special = |stop: i64| waiting & (special_stop == stop);
        let cascade = self.cascade_demand(outside, stops, requests.demand.restart);
        requests.demand = Demand {
            sto: bit(control::STO) | special(0) | (emergency & !self.emergency_ss1) | cascade.0,
            stops: u8::from(bit(control::SS1) | special(1) | (emergency & self.emergency_ss1)) << SS1
                | u8::from(bit(control::SS2) | special(2)) << SS2,
            restart: requests.demand.restart & cascade.1,
            ..Demand::default()
        };
        // LNZ-OMS-14: the enable switch ends the stop of special operation at once.
        let confirmed = self.mode == Mode::Special(true);
        let may_release = match (self.cascade, stops.active()) {
            (Some(_), Active::Standing(..) | Active::None) | (None, _) => true,
            (Some(_), _) => false,
        };
        requests.demand.release = confirmed & !self.emergency & may_release & !idle;
        requests.watches = u64::from(asked);
        if confirmed & self.limited_increment {
            requests.watches |= 1 << SLI_REQUEST;
        }
        let unseen = self.encoderless & (asked & NEEDS_ENCODER != 0);
        if let Some(place) = requests.faults.last_mut().filter(|place| unseen & place.is_none()) {
            *place = Some((ErrorCode::single(107), Class::Cause));
        }
    }

    /// Whether the cascade asks for STO, and whether a restart may take place.
    fn cascade_demand(&mut self, outside: &Outside, stops: &Stops, restart: bool) -> (bool, bool) {
        let Some(cascade) = self.cascade else { return (false, true) };
        let on = self.contacts[3].is_on();
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
        let released = matches!(cascade, Cascade::Restarting(_)) & (next == Cascade::Closed);
        self.cascade = Some(next);
        (next != Cascade::Closed, released)
    }

    /// SLS and SMS: back inside within C15350, or STO with 102 (LNZ-SMS-06).
    pub fn respond(&mut self, scene: &Scene) -> Response {
        self.speed = scene.sample.speed;
        let Scene { watches, sample, monitored, .. } = *scene;
        let outside = |watch: &&Watch| {
            let speed = watch.plan.quantity == Quantity::Speed;
            let stops = matches!(watch.plan.reaction, Reaction::Stop(_));
            let fast = watch.plan.window.left_by(sample.speed).is_some();
            speed & stops & fast & watch.violated()
        };
        if !watches.iter().any(|watch| outside(&watch)) {
            self.late = None;
            return Response::NOTHING;
        }
        let since = *self.late.get_or_insert(sample.now_ns);
        let late = sample.now_ns.saturating_sub(since) >= self.response_ns;
        if late & monitored {
            return Response {
                error: Some((ErrorCode::single(STILL_FAST), Class::Limit)),
                reaction: Reaction::Sto,
            };
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
        let braking = |place| matches!(state.stops.active(), Active::Braking(at, _) if at == place);
        let standing = matches!(state.stops.active(), Active::Standing(SS2, _));
        set(status::STO_ACTIVE, state.sto);
        // LNZ-SS1-11, LNZ-SOS-06: the end is shown additionally.
        set(status::SS1_ACTIVE, braking(SS1) | (state.stops.ended() == Some(SS1)));
        set(status::SS2_ACTIVE, braking(SS2) | standing);
        set(status::SOS_MONITORED, standing);
        let special = self.mode != Mode::Normal;
        set(status::OMS, self.special_requested);
        set(status::OMS_ACTIVE, special);
        set(status::ES_ACTIVE, self.mode == Mode::Special(true));
        // LNZ-SSE-04: the request; its end shows as STO or SS1.
        set(status::SSE_ACTIVE, self.emergency_asked);
        set(status::ERROR_ACTIVE, state.error);
        for (pair, bit) in
            [status::SD_IN1, status::SD_IN2, status::SD_IN3, status::SD_IN4].into_iter().enumerate()
        {
            set(bit, state.requests.inputs.wrapping_shr(pair as u32) & 1 == 1);
        }
        if state.sto {
            return Word::from_u32(word);
        }
        for watch in state.watches {
            let Some(request) = watch.plan.request else { continue };
            let monitored = match request {
                control::SLS1..=control::SLS4 => Some(status::SLS1_MONITORED + (request - control::SLS1)),
                control::SDIPOS => Some(status::SDIPOS_MONITORED),
                control::SDINEG => Some(status::SDINEG_MONITORED),
                _ => None,
            };
            set(request, watch.engaged());
            if let Some(bit) = monitored {
                set(bit, is_monitored(watch, state.sample.speed));
            }
        }
        Word::from_u32(word)
    }

    /// SD-Out1 in bits 0 and 1.
    pub fn drive(&self, state: &State) -> DriveRequest {
        let by_bus = !self.output_off | !self.output_by_bus;
        let on = match self.cascade {
            Some(Cascade::Closed) => !state.sto,
            Some(Cascade::Restarting(since)) => {
                state.sample.now_ns.saturating_sub(since) >= CASCADE_RESTART_NS
            }
            Some(Cascade::Tripped(_)) => false,
            None if self.output_conditions == [0, 0] => false,
            None => self.output(self.status(state).0[0]),
        };
        let outputs = u8::from(on & by_bus) * 0b0011;
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

    /// Codes of the general faults.
    pub fn fault_code(&self, fault: Fault) -> (ErrorCode, Class) {
        let (number, class) = match fault {
            Fault::Encoder(EncoderFault::Absent) | Fault::EncoderStale | Fault::Position => {
                (208, Class::Cause)
            }
            Fault::Encoder(_) => (if self.resolver { 210 } else { 209 }, Class::Cause),
            Fault::Speed => (212, Class::Cause),
            Fault::PartnerLost => (213, Class::Cause),
            Fault::Identity => (163, Class::Cause),
            Fault::Clock => (1, Class::Restart),
            Fault::Overrun => (1, Class::Cause),
            Fault::OwnPath(PathFault::StuckOn | PathFault::StuckOff) | Fault::PartnerPath(_) => {
                (93, Class::Cause)
            }
            Fault::Dormant => (94, Class::StandingWarning),
            Fault::Image => (165, Class::Restart),
        };
        (ErrorCode::single(number), class)
    }
}

/// LNZ-SLS-02: a limited speed from V1.3 on as soon as the speed is below the limit.
fn is_monitored(watch: &Watch, speed: i64) -> bool {
    let inside = watch.plan.window.left_by(speed).is_none();
    let early = (watch.plan.quantity == Quantity::Speed) & watch.engaged() & inside;
    watch.active() | early
}

/// The function's number is its code.
pub fn watch_code(plan: &Plan, _: Violation) -> (ErrorCode, Class) {
    (ErrorCode::single(u32::from(plan.function)), Class::Limit)
}

/// 97 at the end of the stopping time, 110 on the ramp, 106 in standstill.
pub fn stop_code(violation: stop::Violation) -> (ErrorCode, Class) {
    let number = match violation.part {
        Part::Window => u32::from(violation.function),
        Part::End => STOP_LATE,
        Part::Ramp => RAMP_LEFT,
    };
    (ErrorCode::single(number), Class::Limit)
}

/// An internal error with STO.
pub fn difference_codes(found: &Findings, raise: &mut dyn FnMut(ErrorCode, Class)) {
    let differs = (found.status | found.inputs) != 0;
    if differs | found.other {
        raise(ErrorCode::single(1), Class::Cause);
    }
}

/// 167 for every broken rule; Info1 and Info2 name code and subcode.
pub fn findings(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    let c = |number: u32| code(image, number, 0);
    let each = |number: u32| [1, 2, 3, 4].map(|subcode| code(image, number, subcode));
    let broken = |number: u32, subcode: u32| ErrorCode { code: 167, info1: number, info2: subcode, info3: 0 };
    let functions = each(15_031);
    let count = |wanted: i64| functions.iter().filter(|function| **function == wanted).count();
    let filter = c(15_113) as u32;
    let passes = |bit: u8| filter & (1 << (bit & 31)) != 0;
    let by_bus = (c(15_100) != 0) & passes(control::OMS) & (count(2) == 0);
    let stop_passes = passes(control::STO) | passes(control::SS1) | passes(control::SS2);
    let cascading = c(15_035) == 4;
    let encoderless = c(15_400) == 0;
    let assigned = each(15_032);
    let seeing = assigned.iter().any(|function| (2..=8).contains(function));
    let sole_resolver = (c(15_400) == 2) & (c(15_500) == 0);
    let rows = [
        (15_031, 0, (count(2) > 1) | (count(3) > 1)),
        (15_113, 11, (count(2) > 0) & passes(control::OMS)),
        (15_113, 9, (count(3) > 0) & passes(control::ES)),
        (15_113, 0, by_bus & !stop_passes),
        (15_202, 0, by_bus & (c(15_202) != 0)),
        (15_030, 4, cascading & (code(image, 15_030, 4) != 2)),
        (15_031, 4, cascading & (code(image, 15_031, 4) != 1)),
        (15_034, 4, cascading & (code(image, 15_034, 4) > 10)),
        (15_205, 0, cascading & (c(15_205) != 0)),
        (15_300, 1, cascading & (code(image, 15_300, 1) != 0)),
        (15_306, 0, cascading & (c(15_306) != 0)),
        (15_113, 24, cascading & passes(control::SD_OUT1)),
        (15_320, 0, encoderless & (c(15_320) != 0)),
        (15_203, 0, encoderless & (c(15_203) != 0)),
        (15_340, 0, encoderless & (c(15_340) != 0)),
        (15_315, 0, encoderless & (c(15_315) != 0)),
        (15_032, 0, encoderless & seeing),
        (15_410, 0, sole_resolver & (c(15_410) == 0)),
    ];
    for (number, subcode, is_broken) in rows {
        if is_broken {
            report(broken(number, subcode));
        }
    }
    for (subcode, (function, assigned)) in (1..).zip(functions.into_iter().zip(assigned)) {
        // LNZ-IN-07
        if (function != 0) & (assigned != 9) {
            report(broken(15_032, subcode));
        }
    }
    for key in image.keys() {
        let row = image.table().iter().find(|row| row.key == key);
        let common = shm_schema::facts::common::PARAMETERS.iter().any(|row| row.key == key);
        let bits = row.is_some_and(|row| row.max > i64::from(i32::MAX));
        let inside = row.is_some_and(|row| (row.min..=row.max).contains(&image.value(key)));
        if !(inside | bits | common) {
            report(broken(key >> 8, key & 0xFF));
        }
    }
    super::common_findings(image, report);
}
