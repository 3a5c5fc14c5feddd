//! AMK KW-R07/R17/R27: the instances, the words and the codes of the safety board.

use shm_schema::drive::DriveRequest;
use shm_schema::encoder::SlotKind;
use shm_schema::error::ErrorCode;
use shm_schema::facts::amk_kw::{control, status};
use shm_schema::word::Word;

use super::{Fault, Outside, Program, Requests, Rules, Sem, State, tolerance_ns};
use crate::encoder::{Fault as EncoderFault, NO_GEAR, Selection};
use crate::engine::approach::{Approach, Slope};
use crate::engine::places::Places;
use crate::engine::stop::{self, Demand, End, Reaction};
use crate::engine::watch::{Part, Plan, Quantity, Violation};
use crate::engine::{Range, Side};
use crate::errors::{Class, Errors};
use crate::image::Image;
use crate::inputs::{Line, Newest, Pulses, filter_samples};
use crate::outputs::Gaps;
use crate::partner::{Findings, Tolerance};
use crate::path::PathFault;

const RPM: i64 = 1_000;
/// Speed a monitored ramp never tolerates (AMKP-RAMP-04), 1/1000 rpm.
const CEILING: i64 = 60_000 * RPM;
const SS1: u8 = 0;
const SS2: u8 = 1;
/// Control bits that request a function, all active low (AMK-FSOE-09).
const FUNCTIONS: u32 = 0x0000_7E7F;
const NONE_ASSIGNED: i64 = 16;
/// Info1 of this channel where the channels have numbers of their own (AMKD-NUM-02).
const RESOLVER: u32 = 3;
const SINE: u32 = 5;
const PULSE_CHECK: u32 = 18;
const SEM: u32 = 38;
const CROSS: u32 = 13;
const CLOCK: u32 = 71;
const PATH: u32 = 75;

/// Code of the warnings (DEC-44).
const WARNING: u32 = 3610;

/// Info1 of the functions: 100 plus the control bit (AMKD-NUM-03).
const fn info1(bit: u8) -> u16 {
    100 + bit as u16
}

/// SSR1 to SSR4: bit, delay, ramp time, two limits, reaction (AMKP-SSR-01).
const SSR: [(u8, [u32; 5]); 4] = [
    (control::SSR1, [30, 32, 33, 34, 35]),
    (control::SSR2, [36, 38, 39, 40, 41]),
    (control::SSR3, [42, 44, 45, 46, 47]),
    (control::SSR4, [48, 50, 51, 52, 53]),
];
/// SLS1, SLS2: bit, delay, ramp time, limit, reaction (AMKP-SLS-01).
const SLS: [(u8, [u32; 4]); 2] = [(control::SLS1, [54, 56, 57, 58]), (control::SLS2, [59, 61, 62, 63])];
/// Lines SE1.1 to SE3.1: filter time, test pulse check, period.
const INPUTS: [(u32, u32, u32); 3] = [(71, 69, 72), (77, 75, 78), (83, 81, 84)];
const INPUT_STATUS: [u8; 3] = [status::SE1, status::SE2, status::SE3];

/// The own line of a safe input.
#[derive(Debug, Clone, Copy)]
struct Input {
    line: Line,
    pulses: Option<Pulses>,
}

/// The own part of an axis.
#[derive(Debug, Clone)]
pub struct Amk {
    by_inputs: bool,
    assigned: [u32; 3],
    inputs: [Input; 3],
    samples: Option<u64>,
    acknowledge_armed: bool,
    clear_armed: bool,
    resolver: bool,
    outputs_by_word: bool,
    inverted: u8,
    ss1_brakes: bool,
    ss1_slope_rpm_s: u32,
}

fn milliseconds(value: i64) -> u64 {
    (value.max(0) as u64).saturating_mul(1_000_000)
}

fn reaction(value: i64) -> Reaction {
    match value {
        1 => Reaction::Stop(SS1),
        2 => Reaction::Stop(SS2),
        _ => Reaction::Sto,
    }
}

/// Builds the axis.
pub fn build(image: &Image, program: &mut Program) {
    let p = |number: u32| image.value(number);
    let approach = |delay: u32, ramp: u32, window: Range| Approach {
        delay_ns: milliseconds(p(delay)),
        // DEC-04: Prm67 over the function's ramp time.
        slope: Slope { rise: p(67).saturating_mul(RPM), run_ns: milliseconds(p(ramp)) as i64 },
        window,
        ceiling: Some(CEILING),
        ..Approach::default()
    };
    let speed = |bit: u8, request: Option<u8>, approach: Approach, error: Reaction| Plan {
        quantity: Quantity::Speed,
        approach,
        window: approach.window,
        function: info1(bit),
        request,
        status: Some(bit),
        reaction: error,
    };
    let at_once = |window: Range| Approach { window, ..Approach::default() };

    let top = p(67).saturating_mul(RPM);
    program.add(speed(status::SMS, None, at_once(Range::symmetric(top)), reaction(p(68))));
    for (bit, [delay, ramp, upper, lower, error]) in SSR {
        // docs/decisions/0002: sorted by value, as SLI (AMK-SSR-06 leaves it open).
        let (one, other) = (p(lower).saturating_mul(RPM), p(upper).saturating_mul(RPM));
        let window = Range { lower: one.min(other), upper: one.max(other) };
        program.add(speed(bit, Some(bit), approach(delay, ramp, window), reaction(p(error))));
    }
    for (bit, [delay, ramp, limit, error]) in SLS {
        let window = Range::symmetric(p(limit).saturating_mul(RPM));
        program.add(speed(bit, Some(bit), approach(delay, ramp, window), reaction(p(error))));
    }
    // AMKP-SDI-02: the permitted side is bounded by Prm67.
    let zero = p(64).saturating_mul(RPM);
    let positive = at_once(Range { lower: zero.saturating_neg(), upper: top });
    let negative = at_once(Range { lower: top.saturating_neg(), upper: zero });
    program.add(speed(control::SDIP, Some(control::SDIP), positive, Reaction::Sto));
    program.add(speed(control::SDIN, Some(control::SDIN), negative, Reaction::Sto));
    let travel = |bit: u8, window: Range, error: Reaction| Plan {
        quantity: Quantity::Travel,
        window,
        function: info1(bit),
        request: Some(bit),
        status: Some(bit),
        reaction: error,
        approach: Approach::default(),
    };
    // AMK-SLI-01: the parameters are sorted by value.
    let (one, other) = (p(65), p(66));
    let increment = Range { lower: one.min(other), upper: one.max(other) };
    program.add(travel(control::SLI, increment, reaction(p(103))));
    program.add(travel(control::SOS, Range::symmetric(p(29)), Reaction::Sto));
    let standstill = at_once(Range::symmetric(p(28).saturating_mul(RPM)));
    program.add(speed(control::SOS, Some(control::SOS), standstill, Reaction::Sto));

    let brake = |end: End, bit: u8, approach: Approach| stop::Plan {
        end,
        approach,
        judged_at_end: true,
        function: info1(bit),
        stand_function: info1(bit),
        ..stop::Plan::default()
    };
    let ss1 = approach(18, 20, Range::symmetric(p(21).saturating_mul(RPM)));
    let ss1_brakes = p(33_203) & 1 == 1;
    program.stops.set(SS1, brake(End::Sto, control::SS1, ss1));
    let ss2 = approach(23, 25, Range::symmetric(p(26).saturating_mul(RPM)));
    program.stops.set(
        SS2,
        stop::Plan {
            stand_speed: ss2.window,
            stand_position: Range::symmetric(p(27)),
            ..brake(End::Sos, control::SS2, ss2)
        },
    );
    program.tolerance = Tolerance {
        position: p(2),
        speed: p(3).saturating_mul(RPM),
        time_ns: tolerance_ns(p(105)),
        warnings: WARNING,
    };
    // AMK-DYN-09: SA1.1 and SA2.1 by their switches, SDYN1 always.
    let gaps = |on: bool, pulse: u32, period: u32| {
        if on { Gaps::new(p(pulse), p(period)) } else { Gaps::default() }
    };
    program.gaps = [gaps(p(87) == 1, 88, 89), gaps(p(93) == 1, 94, 95), gaps(true, 99, 100)];
    program.supplies = true;
    let resolver = p(4) == 0;
    let kind = if resolver { SlotKind::Resolver } else { SlotKind::SineCosine };
    let periods = if resolver { 1 } else { p(6) };
    program.encoder = Selection { kind: Some(kind), slot: 0, periods, inverted: false, gear: NO_GEAR };
    // AMK-SEM-10: a resolver is exempt.
    let period = 65_536_i64.checked_div(p(6)).unwrap_or(1).max(1);
    program.sem = (!resolver).then(|| Sem::new(p(9), p(10), period));
    let slope = p(67).saturating_mul(1_000).checked_div(p(20)).unwrap_or(0);
    program.rules = Rules::Amk(Amk {
        by_inputs: p(7) == 1,
        assigned: [15, 16, 17].map(|number| assigned_bits(p(number))),
        inputs: INPUTS.map(|(filter, check, period)| Input {
            line: Line::new(filter_samples(p(filter) as u64)),
            pulses: (p(check) == 1).then(|| Pulses::new(p(period) as u64)),
        }),
        samples: None,
        acknowledge_armed: false,
        clear_armed: false,
        resolver,
        outputs_by_word: (p(7), p(8)) == (0, 0),
        inverted: ((p(92) & 1) << 1 | (p(98) & 1) << 3) as u8,
        ss1_brakes,
        ss1_slope_rpm_s: slope as u32,
    });
}

/// AMK-IN-04: the value is the bit of the function in the control word.
fn assigned_bits(value: i64) -> u32 {
    if value >= NONE_ASSIGNED { 0 } else { 1_u32.wrapping_shl(value as u32) & FUNCTIONS }
}

impl Amk {
    /// Requests of this step.
    pub fn requests(&mut self, outside: &Outside, errors: &mut Errors) -> Requests {
        let inputs = self.take_inputs(outside, errors);
        let mut requests = Requests { inputs, ..Requests::default() };
        let word = outside.word.unwrap_or(Word::ZERO).0[0];
        let requested = if self.by_inputs { self.by_inputs(requests.inputs) } else { !word & FUNCTIONS };
        let bit = |number: u8| requested.wrapping_shr(u32::from(number)) & 1 == 1;
        requests.demand = Demand {
            sto: bit(control::STO),
            stops: Places::when(bit(control::SS1), SS1).with(Places::when(bit(control::SS2), SS2)),
            ..Demand::default()
        };
        requests.watches = u64::from(requested);
        requests.requested = Word::from_u32(requested | (word & (1 << control::SA1 | 1 << control::SA2)));
        let acknowledge = outside.word.map(|word| word.bit(control::ERROR_ACK));
        // AMK-ACK-02: the drive's own path; it needs no safe control word.
        let clear = outside.clear;
        requests.acknowledgements =
            u32::from(acknowledge == Some(true)) | u32::from(clear == Some(true)) << 2;
        let by_word = super::edge(&mut self.acknowledge_armed, acknowledge);
        let by_drive = super::edge(&mut self.clear_armed, clear);
        requests.acknowledge = by_word | by_drive;
        requests
    }

    fn by_inputs(&self, levels: u32) -> u32 {
        let pairs = self.assigned.iter().enumerate();
        let low = pairs.filter(|(pair, _)| levels.wrapping_shr(*pair as u32) & 1 == 0);
        low.fold(0, |all, (_, bits)| all | bits)
    }

    /// The debounced levels.
    fn take_inputs(&mut self, outside: &Outside, errors: &mut Errors) -> u32 {
        let Some(io) = outside.io else {
            // DEC-18: an unreadable input is low, and has to prove itself again.
            self.samples = None;
            self.inputs.iter_mut().for_each(|input| input.line.settle(false));
            return 0;
        };
        let new = self.samples.map_or(0, |before| io.samples.wrapping_sub(before));
        self.samples = Some(io.samples);
        let newest = Newest::new(new);
        let mut levels = 0;
        for (pair, (input, pattern)) in (0..).zip(self.inputs.iter_mut().zip(&io.line_1)) {
            if outside.settle {
                input.line.settle(pattern & 1 == 1);
            }
            input.line.take(*pattern, newest);
            let level = input.line.level();
            levels |= u32::from(level).wrapping_shl(pair);
            let fault = input.pulses.as_mut().and_then(|pulses| pulses.take(*pattern, newest, level));
            if let Some(fault) = fault {
                errors.raise(ErrorCode::amk(3606, PULSE_CHECK, fault as u32, pair + 1), Class::Cause);
            }
        }
        levels
    }

    /// Status word (AMK-FSOE-10).
    pub fn status(state: &State) -> Word {
        let mut word = 0_u32;
        let mut set = |bit: u8, value: bool| word |= u32::from(value).wrapping_shl(u32::from(bit));
        set(status::STO, state.sto);
        set(status::ERROR, state.error);
        set(status::VALID, state.ready);
        for (pair, bit) in INPUT_STATUS.into_iter().enumerate() {
            set(bit, state.requests.inputs.wrapping_shr(pair as u32) & 1 == 1);
        }
        if !state.sto {
            set(status::SS1_ACTIVE, state.stops.braking().has(SS1));
            set(status::SS2_ACTIVE, state.stops.braking().has(SS2));
            set(status::SOS, state.stops.standing().has(SS2));
            word |= state.watches.shown().0[0];
        }
        Word::from_u32(word)
    }

    /// SS1 may brake by itself (AMK-SS1-03); outputs as AMK-OUT-01 to AMK-OUT-07.
    pub fn drive(&self, state: &State) -> DriveRequest {
        let running = state.stops.braking().has(SS1);
        let word = state.requests.requested;
        let (one, two) = if self.outputs_by_word {
            (word.bit(control::SA1), word.bit(control::SA2))
        } else {
            (self.acknowledged(state), state.sto)
        };
        let levels = (u8::from(one) * 0b0011) | (u8::from(two) * 0b1100);
        DriveRequest {
            brake: running & self.ss1_brakes,
            deceleration_rpm_s: if running & self.ss1_brakes { self.ss1_slope_rpm_s } else { 0 },
            brake_open: !state.sto,
            outputs: levels ^ self.inverted,
            ..DriveRequest::default()
        }
    }

    /// AMK-OUT-01, AMK-OUT-02: every function requested by SE1 and SE2 is active.
    fn acknowledged(&self, state: &State) -> bool {
        let [one, two, _] = self.assigned;
        let asked = (one | two) & state.requests.watches as u32;
        if asked == 0 {
            return false;
        }
        let all = state.watches.shown().0[0] & asked == asked;
        all & !state.sto
    }

    /// Codes of the general faults.
    pub fn fault_code(&self, fault: Fault) -> (ErrorCode, Class) {
        let tracks = |resolver: u32, sine: u32| {
            if self.resolver {
                ErrorCode::amk(3606, RESOLVER, resolver, 0)
            } else {
                ErrorCode::amk(3606, SINE, sine, 0)
            }
        };
        let code = match fault {
            Fault::Encoder(EncoderFault::RadiusSmall) => tracks(1, 2),
            Fault::Encoder(EncoderFault::RadiusLarge) => tracks(2, 1),
            Fault::Encoder(EncoderFault::Quadrant) => ErrorCode::amk(3606, SINE, 3, 0),
            // Nothing in the catalogue names these; two positions that should agree do not.
            Fault::Encoder(EncoderFault::Absent | EncoderFault::Jump | EncoderFault::Frozen)
            | Fault::EncoderStale
            | Fault::Drive(_) => ErrorCode::amk(3606, 7, 3, 0),
            Fault::PartnerLost => ErrorCode::amk(3606, CROSS, 1, 0),
            Fault::Position => ErrorCode::amk(3606, CROSS, 5, 0),
            Fault::Speed => ErrorCode::amk(3606, CROSS, 6, 0),
            Fault::Identity => ErrorCode::amk(3606, CROSS, 8, 0),
            Fault::Clock => return (ErrorCode::amk(3607, CLOCK, 2, 0), Class::Restart),
            Fault::Overrun => ErrorCode::amk(3607, 29, 6, 0),
            Fault::Image => return (ErrorCode::amk(3607, 30, 0, 1), Class::Restart),
            // A's path is the upper driver, B's the lower (design 3.4).
            Fault::OwnPath(PathFault::StuckOn) => ErrorCode::amk(3606, PATH, 4, 0),
            Fault::OwnPath(PathFault::StuckOff) => ErrorCode::amk(3606, PATH, 2, 0),
            Fault::PartnerPath(_) => ErrorCode::amk(3606, PATH, 1, 0),
            Fault::Dormant => return (ErrorCode::amk(WARNING, PATH, 6, 0), Class::StandingWarning),
        };
        (code, Class::Cause)
    }
}

/// DEC-44: an error when the reaction is STO, a warning when a stop is started.
pub fn watch_code(plan: &Plan, violation: Violation) -> (ErrorCode, Class) {
    let error = plan.reaction == Reaction::Sto;
    let code = if error { 3606 } else { WARNING };
    let position = plan.quantity == Quantity::Travel;
    // AMKD-FNM-04: the warning of SLI counts its limits as 3 and 4.
    let (info2, info3) = infos(violation.part, violation.side, position & error);
    (ErrorCode::amk(code, u32::from(plan.function), info2, info3), Class::Limit)
}

/// A violated stop is an error and ends in STO (AMKD-FNM-01, AMK-SS1-09).
pub fn stop_code(violation: stop::Violation) -> (ErrorCode, Class) {
    let (info2, info3) = infos(violation.part, violation.side, violation.position);
    (ErrorCode::amk(3606, u32::from(violation.function), info2, info3), Class::Limit)
}

/// Movement block and ramp block (AMKD-NUM-04, AMKD-NUM-05).
const fn infos(part: Part, side: Side, position: bool) -> (u32, u32) {
    match (part, side, position) {
        (_, Side::Ceiling, _) => (0, 1),
        (Part::Ramp | Part::End, Side::Upper, _) => (0, 8),
        (Part::Ramp | Part::End, Side::Lower, _) => (0, 9),
        (Part::Window, Side::Upper, false) => (3, 0),
        (Part::Window, Side::Lower, false) => (4, 0),
        (Part::Window, Side::Upper, true) => (5, 0),
        (Part::Window, Side::Lower, true) => (6, 0),
    }
}

/// DEC-45: what differed for the whole tolerance time.
pub fn difference_codes(found: &Findings, raise: &mut dyn FnMut(ErrorCode, Class)) {
    const STOPS: [(u8, u32); 3] = [(status::STO, 2), (status::SS1_ACTIVE, 3), (status::SS2_ACTIVE, 4)];
    let mut other = found.status;
    for (bit, info2) in STOPS {
        let mask = 1_u32 << (bit & 31);
        if found.status & mask != 0 {
            raise(ErrorCode::amk(3606, CROSS, info2, 0), Class::Cause);
        }
        other &= !mask;
    }
    // Info2 7, the emergency stop bit, is no item of this profile's words.
    let rest = (other | found.inputs) != 0;
    if rest | found.other {
        raise(ErrorCode::amk(3606, CROSS, 8, 0), Class::Cause);
    }
}

/// SEM (AMK-SEM-04, AMK-SEM-07).
pub const SEM_WARNING: ErrorCode = ErrorCode::amk(WARNING, SEM, 3, 0);
/// SEM's error; its fixed reaction is SS1.
pub const SEM_ERROR: ErrorCode = ErrorCode::amk(3606, SEM, 4, 0);
/// Where SEM's reaction stands among the stops.
pub const SEM_REACTION: Reaction = Reaction::Stop(SS1);
