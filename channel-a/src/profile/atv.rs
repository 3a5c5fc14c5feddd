//! ATV340 with VW3A3807: SS1, one SLS of six types, SMS in three modes. All levels are
//! electrical frequencies; the functions see the speed times the pole pairs (DEC-32).

use shm_schema::drive::DriveRequest;
use shm_schema::encoder::SlotKind;
use shm_schema::error::ErrorCode;
use shm_schema::facts::atv340::{control, status};
use shm_schema::word::Word;

use super::atv_sls::{Levels, Sls, Verdict};
use super::{Fault, Outside, Program, Requests, Response, Rules, Scene, State, edge};
use crate::encoder::twin::{Compared, Contradiction, Twin};
use crate::encoder::{Fault as EncoderFault, Selection};
use crate::engine::approach::{Approach, Origin, Slope};
use crate::engine::places::Places;
use crate::engine::stop::{self, Demand, End, Reaction, Stops};
use crate::engine::watch::{Plan, Quantity, Violation};
use crate::engine::{Range, Sample, Side};
use crate::errors::{Class, Errors};
use crate::image::Image;
use crate::partner::Findings;

/// A tenth of a hertz in 1/1000 rpm times pole pairs: 60 / 10 * 1000.
const TENTH_HZ: i64 = 6_000;
const MILLISECOND: u64 = 1_000_000;
const SECOND: i64 = 1_000_000_000;
/// STO at the end of an SS1 whose request is gone (ATV-SS1-11), ns.
const RELEASE_NS: u64 = 100 * MILLISECOND;
const SS1: u8 = 0;
/// Violations of SS1 after which only a restart helps (ATV-SS1-09).
const VIOLATIONS_MAX: u8 = 5;
const KNOWN: u32 = 1 << control::STO
    | 1 << control::SS1
    | 1 << control::SAFETY_RESET
    | 1 << control::SLS
    | 1 << control::SMS_SWITCH;
const THRESHOLD_1: u8 = 60;
const THRESHOLD_2: u8 = 61;

/// The own part of an axis.
#[derive(Debug, Clone)]
pub struct Atv {
    pole_pairs: i64,
    encoder: i64,
    ss1_used: bool,
    sls_used: bool,
    sls: Sls,
    /// SLS has led to STO, or to SS1, while it is requested.
    sls_stopped: bool,
    sls_braked: bool,
    /// That SS1 has begun; a higher stop of the same instant lets it not.
    sls_ran: bool,
    sms_mode: i64,
    restricted: bool,
    violations: u8,
    automatic: bool,
    deceleration_rpm_s: u32,
    reset_armed: bool,
    asked_before: (bool, bool),
    enabled: bool,
}

/// Builds the axis.
pub fn build(image: &Image, program: &mut Program) {
    program.take_common(image);
    let p = |number: u32| image.value(number);
    let level = |number: u32| p(number).saturating_mul(TENTH_HZ);
    let pole_pairs = p(2).max(1);
    let sms = |negative: u32, positive: u32, request, bit| Plan {
        quantity: Quantity::Speed,
        approach: Approach { unmonitored: true, limit_ns: Some(0), ..Approach::default() },
        window: Range { lower: level(negative).saturating_neg(), upper: level(positive) },
        request: Some(request),
        status: Some(bit),
        reaction: Reaction::Sto,
        ..Plan::default()
    };
    if p(56) != 0 {
        program.add(sms(58, 57, THRESHOLD_1, status::SMS));
        program.add(sms(60, 59, THRESHOLD_2, status::SMS_THRESHOLD_2));
    }
    let approach = Approach {
        delay_ns: (p(34).max(0) as u64).saturating_mul(MILLISECOND),
        slope: Slope { rise: level(31), run_ns: SECOND },
        origin: Origin::Highest(level(32)),
        window: Range::symmetric(level(33)),
        // ATV-SS1-10: standstill ends it without a dwell of its own.
        dwell_ns: Some(0),
        dwell_in_delay: true,
        ..Approach::default()
    };
    program
        .stops
        .set(SS1, stop::Plan { end: End::Sto, approach, judged_at_end: true, ..stop::Plan::default() });
    program.stops.sto_least_ns = RELEASE_NS;
    program.tolerance.speed = level(4).checked_div(pole_pairs).unwrap_or(0);
    program.encoder = selection(image, program.encoder, pole_pairs);
    // ATV-ENC-03: with STO alone neither motor nor encoder is known.
    let known = (p(65) == 1) | (p(66) == 1) | (p(56) != 0);
    program.twin = known.then(|| Twin::new(Compared::Direction));
    let levels = Levels {
        kind: p(39),
        standstill: level(46),
        threshold: level(48),
        set_point: level(50),
        offset: level(43),
        slope: level(40),
        wait_ns: (p(54).max(0) as u64).saturating_mul(MILLISECOND),
    };
    let deceleration = p(30).saturating_mul(6).checked_div(pole_pairs).unwrap_or(0);
    program.rules = Rules::Atv(Atv {
        pole_pairs,
        encoder: p(5),
        ss1_used: p(65) == 1,
        sls_used: p(66) == 1,
        sls: Sls::new(levels),
        sls_stopped: false,
        sls_braked: false,
        sls_ran: false,
        sms_mode: p(56),
        restricted: p(35) == 1,
        violations: 0,
        automatic: p(36) == 1,
        deceleration_rpm_s: deceleration.max(0) as u32,
        reset_armed: false,
        asked_before: (false, false),
        enabled: true,
    });
}

fn selection(image: &Image, common: Selection, pole_pairs: i64) -> Selection {
    let resolution = image.value(6).max(1);
    let (kind, periods) = match image.value(5) {
        2 | 6 => (SlotKind::Counter, resolution),
        3 | 4 => (SlotKind::Digital, 1),
        5 | 7 => (SlotKind::SineCosine, resolution),
        8 => (SlotKind::Resolver, resolution),
        _ => (SlotKind::Encoderless, pole_pairs),
    };
    // Without encoder the phase order decides what the output frequency means (SC03).
    let number = if kind == SlotKind::Encoderless { 3 } else { 7 };
    let inverted = image.value(number) == 1;
    Selection { kind: Some(kind), periods, inverted, ..common }
}

impl Atv {
    const fn open_loop(&self) -> bool {
        self.encoder <= 1
    }

    /// The speed as electrical frequency.
    pub fn sample(&self, sample: Sample) -> Sample {
        Sample { speed: sample.speed.saturating_mul(self.pole_pairs), ..sample }
    }

    /// Requests of this step.
    pub fn requests(&mut self, outside: &Outside, stops: &Stops, errors: &mut Errors) -> Requests {
        let mut requests = Requests::default();
        let word = outside.word.map_or(0, |word| word.0[0]);
        let bit = |number: u8| word.wrapping_shr(u32::from(number)) & 1 == 1;
        let (ss1, sls, switch) = (bit(control::SS1), bit(control::SLS), bit(control::SMS_SWITCH));
        self.enabled = outside.drive_enabled;
        // ATV-SLS-07: what SLS has led to stands as long as SLS is requested.
        self.sls_stopped &= sls;
        self.sls_braked &= sls;
        let runs = stops.braking().has(SS1) | (stops.ended() == Some(SS1));
        self.sls_ran = self.sls_braked & (self.sls_ran | runs);
        // DEC-11: an SS1 of SLS that is over holds its STO by itself; a request of SS1 whose edge
        // came in that STO has still to be executed.
        let over = self.sls_ran & stops.is_sto();
        let braking = (ss1 & self.ss1_used) | (self.sls_braked & !over);
        requests.demand = Demand {
            sto: !bit(control::STO) | self.sls_stopped | over,
            stops: Places::when(braking, SS1),
            ..Demand::default()
        };
        let second = (self.sms_mode == 2) & switch;
        let first = match self.sms_mode {
            1 => true,
            2 => !switch,
            3 => switch,
            _ => false,
        };
        let own = sls & self.sls_used;
        requests.watches = u64::from(first) << THRESHOLD_1
            | u64::from(second) << THRESHOLD_2
            | u64::from(own) << control::SLS;
        let asked = u32::from(!bit(control::STO)) << control::STO;
        requests.requested =
            Word::from_u32(asked | (word & KNOWN & !(1 << control::STO | 1 << control::SAFETY_RESET)));
        let reset = outside.word.map(|_| bit(control::SAFETY_RESET));
        requests.acknowledgements = u32::from(reset == Some(true));
        requests.acknowledge = edge(&mut self.reset_armed, reset);
        // ATV-SMS-03, ATV-SMS-14: with one threshold the bit has no effect, and is no error.
        let unused_switch = switch & (self.sms_mode == 0);
        let faults = [
            (word & !KNOWN & 0xFFFF != 0, 0x152),
            (ss1 & !self.ss1_used, 0x156),
            (sls & !self.sls_used, 0x157),
            (unused_switch, 0x158),
            (self.freewheel(ss1, own), 0x071),
        ];
        for (is, number) in faults {
            if is {
                errors.raise(ErrorCode::single(number), Class::Cause);
            }
        }
        requests
    }

    /// ATV-SLS-09: closed loop, a function activated while the power stage is off.
    fn freewheel(&mut self, ss1: bool, sls: bool) -> bool {
        let begins = (ss1 & !self.asked_before.0) | (sls & !self.asked_before.1);
        self.asked_before = (ss1, sls);
        begins & !self.enabled & !self.open_loop()
    }

    /// SLS; and the open loop that sees nothing with the power stage off (ATV-SS1-13, ATV-SLS-06).
    pub fn respond(&mut self, scene: &Scene) -> Response {
        let braking = !scene.stops.braking().is_empty();
        let asked = scene.requests.watches & (1 << control::SLS) != 0;
        if scene.restarts | !(asked & scene.monitored) {
            self.sls.rest();
        }
        let verdict = if asked & scene.monitored & !self.sls_braked {
            self.sls.step(scene.sample.speed, scene.sample.now_ns)
        } else {
            Verdict::Kept
        };
        let one_way = self.sls.engaged() & (self.sls.levels.kind <= 3);
        let blind = self.open_loop() & !self.enabled & (braking | one_way);
        let error = |number| Response {
            error: Some((ErrorCode::single(number), Class::Limit)),
            reaction: Reaction::Sto,
        };
        match verdict {
            Verdict::Kept if blind => {
                self.sls_stopped = asked;
                Response { error: None, reaction: Reaction::Sto }
            }
            Verdict::Kept => Response::NOTHING,
            Verdict::Standstill => {
                self.sls_stopped = true;
                Response { error: None, reaction: Reaction::Sto }
            }
            Verdict::Stop => {
                self.sls_braked = true;
                Response { error: None, reaction: Reaction::Stop(SS1) }
            }
            Verdict::Threshold => error(0x0AB),
            Verdict::Ramp => error(0x0A9),
        }
    }

    /// Status word (DEC-43).
    pub fn status(&self, state: &State) -> Word {
        let mut word = 0_u32;
        let mut set = |bit: u8, value: bool| word |= u32::from(value).wrapping_shl(u32::from(bit));
        let ended = state.stops.ended().is_some() | self.sls_stopped;
        set(status::STO, state.sto);
        set(status::SAFETY_ERROR, state.error);
        // ATV-PSF-09: an error changes nothing about the stop that is active.
        set(status::RESTART_REQUIRED, state.sto & ended);
        if !state.sto {
            let shown = state.watches.shown();
            let second = shown.bit(status::SMS_THRESHOLD_2);
            set(status::SS1, !state.stops.braking().is_empty());
            set(status::SLS, self.sls.engaged());
            set(status::SMS, shown.bit(status::SMS) | second);
            set(status::SMS_THRESHOLD_2, second);
        }
        Word::from_u32(word)
    }

    /// Set-point limits of SLS, braking of SS1.
    pub fn drive(&self, state: &State) -> DriveRequest {
        let running = !(state.stops.braking().is_empty() | state.sto);
        let brake = running & self.automatic;
        let limits = self.sls.set_point().filter(|_| !state.sto);
        let rpm = |frequency: i64| {
            frequency
                .checked_div(self.pole_pairs)
                .unwrap_or(0)
                .clamp(i64::from(i32::MIN), i64::from(i32::MAX))
        };
        let (least, most) = limits.map_or((0, 0), |(least, most)| (rpm(least), rpm(most)));
        DriveRequest {
            brake,
            deceleration_rpm_s: if brake { self.deceleration_rpm_s } else { 0 },
            limit_set_point: limits.is_some(),
            set_point_max_mrpm: most as i32,
            set_point_min_mrpm: least as i32,
            brake_open: !state.sto,
            ..DriveRequest::default()
        }
    }

    /// SME011, the fifth time SME068 (ATV-SS1-08, ATV-SS1-09).
    pub fn stop_code(&mut self) -> (ErrorCode, Class) {
        self.violations = self.violations.saturating_add(1);
        if self.restricted & (self.violations >= VIOLATIONS_MAX) {
            return (ErrorCode::single(0x068), Class::Restart);
        }
        (ErrorCode::single(0x011), Class::Limit)
    }

    /// Codes of the general faults.
    pub fn fault_code(&self, fault: Fault) -> (ErrorCode, Class) {
        let (number, class) = match fault {
            Fault::Encoder(fault) => self.encoder_code(fault),
            Fault::EncoderStale => (0x094, Class::Cause),
            Fault::Position | Fault::Speed | Fault::Drive(Contradiction::Speed) => (0x02C, Class::Cause),
            // ATV-ENC-09: without encoder it is the phases that are inverted, with it the encoder.
            Fault::Drive(Contradiction::Direction) => {
                (if self.open_loop() { 0x0DA } else { 0x0DB }, Class::Cause)
            }
            Fault::Identity => (0x032, Class::Cause),
            Fault::Image => (0x032, Class::Restart),
            Fault::Clock => (0x0D4, Class::Restart),
            Fault::Overrun | Fault::PartnerLost | Fault::OwnPath(_) | Fault::PartnerPath(_) => {
                (0x0D4, Class::Cause)
            }
            Fault::Dormant => (0x0D4, Class::StandingWarning),
        };
        (ErrorCode::single(number), class)
    }

    /// Resolver errors are cleared by a restart only (ATV-ENC-07).
    const fn encoder_code(&self, fault: EncoderFault) -> (u32, Class) {
        match (self.encoder, fault) {
            (8, EncoderFault::RadiusSmall | EncoderFault::Absent) => (0x0CD, Class::Restart),
            (8, EncoderFault::RadiusLarge) => (0x0CE, Class::Restart),
            (8, EncoderFault::Jump) => (0x0C9, Class::Restart),
            (8, _) => (0x0CB, Class::Restart),
            (7, _) => (0x070, Class::Cause),
            (5, _) => (0x093, Class::Cause),
            (_, EncoderFault::Jump) => (0x096, Class::Cause),
            _ => (0x094, Class::Cause),
        }
    }
}

/// SME0B4 above, SME0B5 below.
pub fn watch_code(violation: Violation) -> (ErrorCode, Class) {
    let number = if violation.side == Side::Lower { 0x0B5 } else { 0x0B4 };
    (ErrorCode::single(number), Class::Limit)
}

/// The channels differ: the nearest code of the catalogue (docs/decisions/0002).
pub fn difference_codes(found: &Findings, raise: &mut dyn FnMut(ErrorCode, Class)) {
    let differs = (found.status | found.inputs) != 0;
    if differs | found.other {
        raise(ErrorCode::single(0x0D4), Class::Cause);
    }
}

/// SME032 for every broken rule; Info1 names the parameter.
pub fn findings(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    let p = |number: u32| image.value(number);
    let kind = p(39);
    let sls = p(66) == 1;
    let internal = sls & ((kind == 3) | (kind == 6));
    let ss1 = (p(65) == 1) | internal;
    let sms = p(56) != 0;
    let any = ss1 | sls | sms;
    let ramped = sls & ((kind == 2) | (kind == 5));
    let mut lowest = p(57).min(p(58));
    if p(56) == 2 {
        lowest = lowest.min(p(59)).min(p(60));
    }
    let above_sms = |number: u32| sls & sms & (p(number) > lowest);
    let rows = [
        (1, any & (p(1) == 0)),
        (2, any & (p(2) == 0)),
        // ATV-ENC-10: permanent-magnet motors only with an encoder.
        (5, any & ((p(5) == 0) | ((p(1) == 2) & (p(5) == 1)))),
        (6, any & (p(5) > 1) & (p(6) == 0)),
        (31, ss1 & (p(31) == 0)),
        (33, ss1 & (p(33) == 0)),
        (36, internal & (p(36) != 1)),
        (39, sls & (kind == 0)),
        (40, ramped & (p(40) == 0)),
        (46, sls & (kind == 1) & (p(46) > p(48))),
        (46, sls & ((kind == 2) | (kind == 3)) & (p(46) > p(50))),
        (46, above_sms(46)),
        (48, above_sms(48)),
        (50, above_sms(50)),
        (50, sls & (kind != 1) & (p(50) > p(48))),
        (59, (p(56) == 2) & (p(59) > p(57))),
        (60, (p(56) == 2) & (p(60) > p(58))),
    ];
    for (number, is_broken) in rows {
        if is_broken {
            report(ErrorCode { code: 0x032, info1: number, info2: 0, info3: 0 });
        }
    }
    for key in image.keys() {
        let row = image.table().iter().find(|row| row.key == key);
        let common = shm_schema::facts::common::PARAMETERS.iter().any(|row| row.key == key);
        let inside = row.is_some_and(|row| (row.min..=row.max).contains(&image.value(key)));
        if !(inside | common) {
            report(ErrorCode { code: 0x032, info1: key, info2: 0, info3: 0 });
        }
    }
    super::common_findings(image, report);
}
