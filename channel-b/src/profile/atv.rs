//! Schneider ATV340 with VW3A3807: SS1 with the peak of its delay, six types of SLS, three
//! modes of SMS, and what the drive is asked for. Frequencies are electrical (DEC-32).

use shm_schema::drive::DriveRequest;
use shm_schema::encoder::SlotKind;
use shm_schema::error::ErrorCode;
use shm_schema::facts::atv340::{self, control, status};
use shm_schema::profile::common;
use shm_schema::word::Word;

use super::{Asked, Bits, Plan};
use crate::bus::Events;
use crate::encoder::drive::Contradiction;
use crate::engine::bank::Bank;
use crate::engine::record::Breach;
use crate::engine::spec::{Approach, MS_NS, NO_BIT, Quantity, Range, SECOND_NS, Slope, Spec};
use crate::engine::stops::{End, Stop, Stops};
use crate::image::Image;
use crate::ledger::{Cause, Entry, Ledger};

/// What the request logic adds to the control word.
mod asked {
    pub const STO: u8 = 64;
    pub const SS1: u8 = 65;
    pub const SLS: u8 = 66;
    pub const SMS_1: u8 = 67;
    pub const SMS_2: u8 = 68;
    pub const SLS_SS1: u8 = 69;
}

/// SME numbers.
mod sme {
    pub const SS1_RAMP: u32 = 0x011;
    pub const DEVIATION: u32 = 0x02C;
    pub const CONFIGURATION: u32 = 0x032;
    pub const SS1_REPEATED: u32 = 0x068;
    pub const FREEWHEEL: u32 = 0x071;
    pub const SINE: u32 = 0x070;
    pub const ENCODER: u32 = 0x094;
    pub const SLS_RAMP: u32 = 0x0A9;
    pub const SLS_THRESHOLD: u32 = 0x0AB;
    pub const SMS_POSITIVE: u32 = 0x0B4;
    pub const SMS_NEGATIVE: u32 = 0x0B5;
    pub const RESOLVER: u32 = 0x0CC;
    pub const UNEXPECTED_STO: u32 = 0x0D4;
    pub const PHASE_INVERSION: u32 = 0x0DA;
    pub const ENCODER_INVERSION: u32 = 0x0DB;
    pub const INTEGRITY: u32 = 0x147;
    pub const RESERVED_BIT: u32 = 0x152;
    pub const TIMEOUT: u32 = 0x153;
    pub const SS1_UNUSED: u32 = 0x156;
    pub const SLS_UNUSED: u32 = 0x157;
    pub const SMS_UNUSED: u32 = 0x158;
}

/// Bits of the two octets that mean something.
const KNOWN: u32 = 1 << control::STO
    | 1 << control::SS1
    | 1 << control::SAFETY_RESET
    | 1 << control::SLS
    | 1 << control::SMS_SWITCH;
/// The STO of a finished stop is held so long (ATV-SS1-11, DEC-48).
const RELEASE_NS: u64 = 100_000_000;
/// Place of the stop that SS1 itself asks for.
const HELD_BY_SS1: u16 = 1;
/// Place of the same stop asked for by SLS.
const HELD_BY_SLS: u16 = 2;
/// Ramp violations of SS1 after which only a restart helps (ATV-SS1-09).
const VIOLATIONS_MAX: u32 = 5;

/// The raw value of a parameter; what a set leaves out has its documented default.
pub fn parameter(image: &Image<'_>, number: u32) -> i64 {
    let default = || atv340::PARAMETERS.iter().find(|row| row.key == number).map_or(0, |row| row.default);
    i64::from(image.find(number).unwrap_or_else(default))
}

/// Conversions with the motor's pole pairs.
#[derive(Debug, Clone, Copy)]
struct Motor {
    pole_pairs: i64,
}

impl Motor {
    /// Tenths of a hertz as 1/1000 rpm, rounded down: a whole speed above the result is
    /// above the exact limit (DEC-01).
    fn limit(self, tenths: i64) -> i64 {
        tenths.saturating_mul(6_000).checked_div(self.pole_pairs).unwrap_or(0)
    }

    /// The same, rounded up, for limits that must not be fallen below.
    fn least(self, tenths: i64) -> i64 {
        let below = self.limit(tenths);
        let is_exact = below.saturating_mul(self.pole_pairs) == tenths.saturating_mul(6_000);
        below.saturating_add(i64::from(!is_exact))
    }

    /// Tenths of a hertz per second as an exact slope.
    fn slope(self, tenths: i64) -> Slope {
        Slope { num: tenths.saturating_mul(6_000), den: self.pole_pairs.saturating_mul(SECOND_NS) }
    }

    /// Tenths of a hertz per second in rpm/s.
    fn rate(self, tenths: i64) -> u32 {
        let rate = tenths.saturating_mul(6).checked_div(self.pole_pairs).unwrap_or(0);
        rate.clamp(0, i64::from(u32::MAX)) as u32
    }
}

/// Builds the rows from the parameters.
pub fn build(image: &Image<'_>) -> Plan {
    let mut plan = Plan::new(image);
    plan.set_common(image);
    let sc = |number: u32| parameter(image, number);
    let motor = Motor { pole_pairs: sc(2).max(1) };
    plan.bits = bits();
    // ATV-FREQ-03: the deviation of the two frequencies is SC04.
    let factor = image.value(common::CC_FACTOR, 7);
    plan.set_comparison(factor, image.value(common::POSITION_DIFFERENCE, 450), 0);
    plan.speed_difference = motor.limit(sc(4));
    set_encoder(&mut plan, &sc, motor);
    plan.stops.hold_sto(RELEASE_NS);
    // The same stop for each of its requests: which of them holds STO afterwards is its own
    // affair (ATV-SS1-12).
    for control in [asked::SS1, asked::SLS_SS1] {
        plan.stops.add(ss1(control, &sc, motor));
    }
    add_sls(&mut plan, &sc, motor);
    add_sms(&mut plan, &sc, motor);
    plan.logic = super::Logic::Atv(Logic::new(&sc, motor));
    plan
}

fn bits() -> Bits {
    let high = 1 << control::SS1 | 1 << control::SLS | 1 << control::SMS_SWITCH;
    Bits {
        low: Word::from_u32(1 << control::STO),
        high: Word::from_u32(high),
        sto: asked::STO,
        acknowledge: control::SAFETY_RESET,
        sto_active: status::STO,
        error: status::SAFETY_ERROR,
        either: Word::from_u32(1 << status::SAFETY_ERROR | 1 << status::RESTART_REQUIRED),
        ..Bits::NONE
    }
}

fn set_encoder(plan: &mut Plan, sc: &dyn Fn(u32) -> i64, motor: Motor) {
    let kind = match sc(5) {
        1 => Some(SlotKind::Encoderless),
        2 | 6 => Some(SlotKind::Counter),
        3 | 4 => Some(SlotKind::Digital),
        5 | 7 => Some(SlotKind::SineCosine),
        8 => Some(SlotKind::Resolver),
        _ => None,
    };
    plan.has_encoder = kind.is_some();
    plan.encoder.kind = kind;
    let resolution = sc(6).clamp(1, 65_535) as u32;
    plan.encoder.periods = resolution;
    let is_resolver = kind == Some(SlotKind::Resolver);
    plan.encoder.pole_pairs = if is_resolver { resolution } else { motor.pole_pairs.clamp(1, 65_535) as u32 };
    plan.encoder.is_inverted = (sc(7) == 1) & (kind != Some(SlotKind::Encoderless));
}

/// ATV-SS1-06, ATV-SS1-07, ATV-SS1-10.
fn ss1(control: u8, sc: &dyn Fn(u32) -> i64, motor: Motor) -> Stop {
    let approach = Approach {
        delay_ns: sc(34).saturating_mul(MS_NS),
        slope: motor.slope(sc(31)),
        offset: motor.limit(sc(32)),
        track_peak: true,
        dwell_ns: 0,
        ..Approach::NONE
    };
    let spec = Spec {
        id: sme::SS1_RAMP,
        control,
        status: status::SS1,
        approach,
        window: Range::around_zero(Quantity::Speed, motor.limit(sc(33))),
        ..Spec::IDLE
    };
    Stop { spec, end: End::Sto, standing_status: NO_BIT, resumes: false }
}

/// The threshold of every type; types 2 and 5 lead to it along a line.
fn add_sls(plan: &mut Plan, sc: &dyn Fn(u32) -> i64, motor: Motor) {
    let has_line = matches!(sc(39), 2 | 5);
    // SC41 is SC40, SC49 is SC48 (ATV-SLS-03).
    let line =
        Approach { slope: motor.slope(sc(40)), offset: motor.limit(sc(43)), dwell_ns: 0, ..Approach::NONE };
    plan.bank.add(Spec {
        id: sme::SLS_THRESHOLD,
        control: asked::SLS,
        status: status::SLS,
        approach: if has_line { line } else { Approach::NONE },
        window: Range::around_zero(Quantity::Speed, motor.limit(sc(48))),
        ..Spec::IDLE
    });
}

/// Thresholds 1 and 2 (ATV-SMS-10: negative ones are entered as positive numbers).
fn add_sms(plan: &mut Plan, sc: &dyn Fn(u32) -> i64, motor: Motor) {
    for (control, positive, negative) in [(asked::SMS_1, 57, 58), (asked::SMS_2, 59, 60)] {
        let window = Range {
            quantity: Quantity::Speed,
            lower: motor.limit(sc(negative)).saturating_neg(),
            upper: motor.limit(sc(positive)),
        };
        plan.bank.add(Spec { id: sme::SMS_POSITIVE, control, status: status::SMS, window, ..Spec::IDLE });
    }
}

/// SME number of a violation.
pub const fn code(spec: &Spec, breach: Breach) -> ErrorCode {
    ErrorCode::single(match (spec.id, breach) {
        (_, Breach::Damage) => sme::UNEXPECTED_STO,
        (sme::SMS_POSITIVE, Breach::Below(_)) => sme::SMS_NEGATIVE,
        (sme::SLS_THRESHOLD, Breach::Line | Breach::Landing | Breach::TooFast)
            if spec.approach.slope.num > 0 =>
        {
            sme::SLS_RAMP
        }
        (id, _) => id,
    })
}

/// ATV-PSF-17: class 2, STO until a Safety Reset in a standing connection.
pub fn watch_bus(events: &Events, ledger: &mut Ledger) {
    let seen = [(events.is_corrupt, sme::INTEGRITY), (events.has_timed_out, sme::TIMEOUT)];
    for (_, number) in seen.into_iter().filter(|(is_seen, _)| *is_seen) {
        ledger.raise(Entry::sto(ErrorCode::single(number), Cause::Live));
    }
}

/// SME number of a fault of the channel itself.
pub const fn internal(code: ErrorCode) -> ErrorCode {
    ErrorCode::single(match (code.info1, code.info2) {
        (13, 5 | 6) => sme::DEVIATION,
        (74, _) => sme::CONFIGURATION,
        (6, _) => sme::SINE,
        (4, _) => sme::RESOLVER,
        (7, _) => sme::ENCODER,
        _ => sme::UNEXPECTED_STO,
    })
}

/// What SLS does (ATV-SLST1 to 6).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Limited {
    Off,
    /// Below standstill, the wait time runs since then, ns.
    Waiting(u64),
    /// Monitored; the sign is the direction of types 1 to 3.
    Monitored(i64),
    /// An internal SS1 runs or has ended.
    Stopping,
    /// Fallen below standstill: STO without error while the request stands.
    Standing,
}

/// Requests, SLS types, and what the drive is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Logic {
    has_ss1: bool,
    is_automatic: bool,
    /// No encoder: the motor frequency is that of the output phases.
    is_open_loop: bool,
    /// SC33, 1/1000 rpm.
    slowest: i64,
    restricts: bool,
    violations: u32,
    was_violated: bool,
    has_sls: bool,
    kind: i64,
    threshold: i64,
    standstill: i64,
    set_point: i64,
    held: i64,
    wait_ns: u64,
    limited: Limited,
    /// `limited` came to its stop by itself, not in an STO that was there already.
    leads: bool,
    mode: i64,
    second: bool,
    ss1_rate: u32,
    sls_rate: u32,
}

impl Logic {
    fn new(sc: &dyn Fn(u32) -> i64, motor: Motor) -> Self {
        Self {
            has_ss1: sc(65) == 1,
            is_automatic: sc(36) == 1,
            is_open_loop: sc(5) == 1,
            slowest: motor.limit(sc(33)),
            restricts: sc(35) == 1,
            violations: 0,
            was_violated: false,
            has_sls: sc(66) == 1,
            kind: sc(39),
            threshold: motor.limit(sc(48)),
            standstill: motor.least(sc(46)),
            set_point: motor.limit(sc(50)),
            held: 0,
            wait_ns: sc(54).max(0).unsigned_abs().saturating_mul(MS_NS as u64),
            limited: Limited::Off,
            leads: false,
            mode: sc(56),
            second: false,
            ss1_rate: motor.rate(sc(30)),
            sls_rate: motor.rate(sc(40)),
        }
    }

    /// ATV-ENC-09: the drive turns the other way. Without an encoder that is the phase rotation
    /// (SC03), with one its inversion (SC07).
    pub fn watch_drive(&self, found: &Contradiction, ledger: &mut Ledger) {
        let number = if self.is_open_loop { sme::PHASE_INVERSION } else { sme::ENCODER_INVERSION };
        if found.is_opposite {
            ledger.raise(Entry::sto(ErrorCode::single(number), Cause::Live));
        }
    }

    /// SLS is off, or has no standstill level that the motion could reach.
    pub fn rests(&self) -> bool {
        match self.limited {
            Limited::Off => true,
            Limited::Monitored(_) => !self.has_standstill(),
            Limited::Waiting(_) | Limited::Standing | Limited::Stopping => false,
        }
    }

    /// Everything requested in this cycle.
    pub fn requests(&mut self, asked: &Asked<'_>, ledger: &mut Ledger) -> Word {
        let [given, rest @ ..] = asked.word.0;
        let has = |bit: u8| given >> bit & 1 == 1;
        let (ss1, sls, switch) = (has(control::SS1), has(control::SLS), has(control::SMS_SWITCH));
        let is_reserved = (given & !KNOWN != 0) | rest.iter().any(|part| *part != 0);
        let refused = [
            (is_reserved, sme::RESERVED_BIT),
            (ss1 & !self.has_ss1, sme::SS1_UNUSED),
            (sls & !self.has_sls, sme::SLS_UNUSED),
            // ATV-SMS-14, ATV-SMS-03: with one threshold the bit has no effect and is no error.
            (switch & (self.mode == 0), sme::SMS_UNUSED),
        ];
        for (is_wrong, number) in refused {
            if is_wrong {
                ledger.raise(Entry::sto(ErrorCode::single(number), Cause::Live));
            }
        }
        // DEC-14: nothing is evaluated in STO; what leads to a stop counts from the cycle in
        // which nothing else holds STO.
        let is_kept = asked.rests | (ss1 & self.has_ss1 & (asked.held & HELD_BY_SS1 != 0));
        let is_held = !has(control::STO) | ledger.has_error() | (asked.in_sto & is_kept);
        let (stood, stopped) = (self.stands(), self.stops());
        // ATV-SLS-09: the motor coasts, switched off by the drive, when SLS is activated.
        let begins = sls & self.has_sls & ((self.limited == Limited::Off) | asked.in_sto) & !is_held;
        let coasts = !asked.drive_enabled & (asked.motion.speed.saturating_abs() > self.slowest);
        if begins & coasts & !self.is_open_loop {
            ledger.raise(Entry::sto(ErrorCode::single(sme::FREEWHEEL), Cause::Reaction));
        }
        // ATV-SS1-13: without an encoder a frequency that nothing drives cannot be observed.
        let is_blind = self.is_open_loop & !asked.drive_enabled & ((ss1 & self.has_ss1) | self.stops());
        self.limit(sls & self.has_sls, is_held, asked);
        self.second = (self.mode == 2) & switch;
        let is_maintained = (self.mode == 3) & switch;
        let first = (self.mode == 1) | is_maintained | ((self.mode == 2) & !switch);
        let is_monitored = matches!(self.limited, Limited::Monitored(_) | Limited::Waiting(_));
        let requested = [
            (control::STO, !has(control::STO)),
            (control::SS1, ss1),
            (control::SLS, sls),
            (control::SMS_SWITCH, switch),
            (asked::STO, !has(control::STO) | (stood & self.stands()) | is_blind),
            (asked::SS1, ss1 & self.has_ss1),
            (asked::SLS_SS1, stopped & self.stops()),
            (asked::SLS, is_monitored),
            (asked::SMS_1, first),
            (asked::SMS_2, self.second),
        ];
        requested.iter().fold(Word::ZERO, |word, (bit, value)| word.with(*bit, *value))
    }

    /// What SLS leads to begins like the reaction to a violation: after the stops of the cycle have
    /// begun, and the highest of what one sample asks for (DEC-13).
    pub fn settle(&self, requested: &Word) -> Option<Word> {
        match (self.stands(), self.stops()) {
            (true, _) => Some(requested.with(asked::STO, true)),
            (false, true) => Some(requested.with(asked::SLS_SS1, true)),
            (false, false) => None,
        }
    }

    /// One cycle of SLS. In STO it begins anew every cycle (DEC-14), unless it led there.
    fn limit(&mut self, is_requested: bool, is_held: bool, asked: &Asked<'_>) {
        let speed = asked.motion.speed;
        // Its SS1 has run; what a higher stop of the same sample has kept from beginning has not.
        let has_run = !asked.in_sto | (asked.held & HELD_BY_SLS != 0);
        let ended_here = self.stands() | (self.stops() & has_run);
        let begins = (self.limited == Limited::Off) | (asked.in_sto & !ended_here);
        self.limited = if !is_requested {
            Limited::Off
        } else if begins {
            self.held = speed;
            self.begin(speed, asked.now)
        } else {
            self.go_on(speed, asked.now)
        };
        let has_ended = matches!(self.limited, Limited::Standing | Limited::Stopping);
        self.leads = has_ended & (ended_here | !is_held);
    }

    /// The SLS standstill level has led to STO.
    const fn stands(&self) -> bool {
        self.leads & matches!(self.limited, Limited::Standing)
    }

    /// SLS has begun an SS1.
    fn stops(&self) -> bool {
        self.leads & (self.limited == Limited::Stopping)
    }

    fn has_standstill(&self) -> bool {
        (self.standstill > 0) & matches!(self.kind, 1..=3)
    }

    fn begin(&self, speed: i64, now: u64) -> Limited {
        let magnitude = speed.saturating_abs();
        let is_above = magnitude > self.threshold;
        let is_below = self.has_standstill() & (magnitude < self.standstill);
        if is_above & matches!(self.kind, 3 | 6) {
            return Limited::Stopping;
        }
        if is_below {
            let waits = (self.kind != 1) & (self.wait_ns > 0);
            return if waits { Limited::Waiting(now) } else { Limited::Standing };
        }
        Limited::Monitored(if speed < 0 { -1 } else { 1 })
    }

    fn go_on(&self, speed: i64, now: u64) -> Limited {
        let magnitude = speed.saturating_abs();
        match self.limited {
            Limited::Waiting(_) if magnitude >= self.standstill => {
                Limited::Monitored(if speed < 0 { -1 } else { 1 })
            }
            // ATV-SLST2-06: STO without error at the end of the wait time.
            Limited::Waiting(since) if now.saturating_sub(since) >= self.wait_ns => Limited::Standing,
            Limited::Monitored(sign)
                if self.has_standstill() & (speed.saturating_mul(sign) < self.standstill) =>
            {
                Limited::Standing
            }
            other => other,
        }
    }

    /// The fifth ramp violation of SS1 is for good (ATV-SS1-09).
    pub fn watch(&mut self, ledger: &mut Ledger) {
        let is_violated = ledger.any(|entry| entry.code.code == sme::SS1_RAMP);
        if is_violated & !self.was_violated {
            self.violations = self.violations.saturating_add(1);
        }
        self.was_violated = is_violated;
        if self.restricts & (self.violations >= VIOLATIONS_MAX) {
            ledger.raise(Entry::sto(ErrorCode::single(sme::SS1_REPEATED), Cause::Lasting));
        }
    }

    /// Restart required, SLS from its activation on (ATV-SLST2-01: the line is monitored
    /// from then on), and the selected threshold.
    pub fn show(&self, word: &mut Word, stops: &Stops, bank: &Bank) {
        let ended = stops.in_sto() & ((stops.origin() != 0) | self.stands());
        let is_second = self.second & bank.is_active(status::SMS);
        let is_limited = bank.is_active(status::SLS);
        *word = word
            .with(status::RESTART_REQUIRED, ended)
            .with(status::SLS, is_limited)
            .with(status::SMS_THRESHOLD_2, is_second);
    }

    /// Braking of SS1 and the limits of SLS (ATV-SS1-05, ATV-SLS-01).
    pub fn drive(&self, ss1_brakes: bool) -> DriveRequest {
        let brake = ss1_brakes & (self.is_automatic | self.stops());
        let base = DriveRequest { brake, ..DriveRequest::default() };
        let Limited::Monitored(sign) = self.limited else {
            return DriveRequest { deceleration_rpm_s: if brake { self.ss1_rate } else { 0 }, ..base };
        };
        let most = if self.kind == 1 { self.held.saturating_abs() } else { self.set_point };
        let is_two_sided = self.kind >= 4;
        let (forward, backward) = (is_two_sided | (sign > 0), is_two_sided | (sign < 0));
        let of = |permitted: bool| if permitted { most.min(i64::from(i32::MAX)) as i32 } else { 0 };
        DriveRequest {
            deceleration_rpm_s: if brake { self.ss1_rate } else { self.sls_rate },
            limit_set_point: true,
            set_point_max_mrpm: of(forward),
            set_point_min_mrpm: of(backward).saturating_neg(),
            ..base
        }
    }
}
