//! AMK KW-R07/R17/R27: the functions as rows, requests from FSoE or inputs, SEM, codes.

use shm_schema::encoder::SlotKind;
use shm_schema::error::ErrorCode;
use shm_schema::facts::amk_kw::{self, control, status};
use shm_schema::word::Word;

use super::{Asked, Bits, Plan, plain_requests};
use crate::bus::Events;
use crate::engine::Motion;
use crate::engine::record::Breach;
use crate::engine::spec::{Approach, MS_NS, NO_BIT, Quantity, RPM, Range, Reaction, Slope, Spec};
use crate::engine::stops::{End, Stop};
use crate::image::Image;
use crate::inputs::LineSetup;
use crate::ledger::{Cause, Entry, Ledger, NO_OWNER};
use crate::outputs::{LINES, LineSetup as OutputSetup};
use crate::twin::Twin;

/// Bits of the control word that request a function at 0 (AMK-FSOE-09).
const FUNCTIONS: u32 = 0x0000_7E7F;
/// SS1 brakes by itself when bit 0 of this parameter is 1, the default (AMK-GEN-06).
const ID33203: u32 = 33_203;
/// Info1 of the functions, as the codes name them.
const SS1: u32 = 101;
const SS2: u32 = 102;
const SOS: u32 = 103;
const SDIP: u32 = 105;
const SDIN: u32 = 106;
const SMS: u32 = 108;
const SLI: u32 = 114;

/// SSR and SLS: Info1, control and status bit, parameters of delay, ramp time, limits, reaction.
const RAMPED: [(u32, u8, u8, [u32; 5]); 6] = [
    (104, control::SSR1, status::SSR1, [30, 32, 33, 34, 35]),
    (109, control::SSR2, status::SSR2, [36, 38, 39, 40, 41]),
    (110, control::SSR3, status::SSR3, [42, 44, 45, 46, 47]),
    (111, control::SSR4, status::SSR4, [48, 50, 51, 52, 53]),
    (112, control::SLS1, status::SLS1, [54, 56, 57, 57, 58]),
    (113, control::SLS2, status::SLS2, [59, 61, 62, 62, 63]),
];

/// Input pairs: dynamic sampling, inversion, filter and period of line .2 (DEC-36).
const PAIRS: [[u32; 4]; 3] = [[69, 70, 73, 74], [75, 76, 79, 80], [81, 82, 85, 86]];

/// The value of a parameter; what a set leaves out has its documented default (DEC-28).
pub fn parameter(image: &Image<'_>, number: u32) -> i32 {
    let default = || amk_kw::PARAMETERS.iter().find(|row| row.key == number).map_or(0, |row| row.default);
    image.find(number).unwrap_or_else(default)
}

/// Builds the rows from the parameters.
pub fn build(image: &Image<'_>) -> Plan {
    let mut plan = Plan::new(image);
    let prm = |number: u32| i64::from(parameter(image, number));
    plan.bits = bits();
    plan.set_comparison(parameter(image, 105), parameter(image, 2), parameter(image, 3));
    plan.encoder.kind = Some(if prm(5) == 0 { SlotKind::Resolver } else { SlotKind::SineCosine });
    plan.encoder.periods = parameter(image, 6).max(1).unsigned_abs();
    let ss1 = add_stop(&mut plan, SS1, control::SS1, status::SS1_ACTIVE, [prm(18), prm(20), prm(21)], &prm);
    let ss2 = add_stop(&mut plan, SS2, control::SS2, status::SS2_ACTIVE, [prm(23), prm(25), prm(26)], &prm);
    let reaction = |number: u32| match prm(number) {
        1 => Reaction::Stop(ss1),
        2 => Reaction::Stop(ss2),
        _ => Reaction::Sto,
    };
    for row in RAMPED {
        let (id, request, shown, [delay, ramp, one, other, react]) = row;
        // AMK-SLS-01: one value, both directions.
        let window = if one == other {
            Range::around_zero(Quantity::Speed, prm(one).saturating_mul(RPM))
        } else {
            Range::between(Quantity::Speed, prm(one).saturating_mul(RPM), prm(other).saturating_mul(RPM))
        };
        let approach = approach(prm(delay), prm(ramp), prm(67));
        plan.bank.add(Spec { approach, reaction: reaction(react), ..row_of(id, request, shown, window) });
    }
    add_plain(&mut plan, &prm, reaction(68), reaction(103));
    plan.lines = lines(image);
    plan.outputs = outputs(&prm);
    plan.logic = super::Logic::Amk(Logic::new(image, ss1));
    plan
}

fn bits() -> Bits {
    Bits {
        low: Word::from_u32(FUNCTIONS),
        sto: control::STO,
        acknowledge: control::ERROR_ACK,
        sto_active: status::STO,
        error: status::ERROR,
        valid: status::VALID,
        inputs: status::SE1,
        pairs: 3,
        either: Word::from_u32(1 << status::ERROR),
        ..Bits::NONE
    }
}

/// AMK-RAMP-03: the ramp time is the time from Prm67 to 0.
fn approach(delay_ms: i64, ramp_ms: i64, reference_rpm: i64) -> Approach {
    let slope = Slope::over(reference_rpm.saturating_mul(RPM), ramp_ms.saturating_mul(MS_NS));
    Approach::line(delay_ms.saturating_mul(MS_NS), slope)
}

const fn row_of(id: u32, control: u8, status: u8, window: Range) -> Spec {
    Spec { id, control, status, window, ..Spec::IDLE }
}

fn add_stop(
    plan: &mut Plan,
    id: u32,
    request: u8,
    shown: u8,
    [delay, ramp, zero]: [i64; 3],
    prm: &dyn Fn(u32) -> i64,
) -> u8 {
    let window = Range::around_zero(Quantity::Speed, zero.saturating_mul(RPM));
    let is_ss2 = id == SS2;
    let spec = Spec {
        approach: approach(delay, ramp, prm(67)),
        hold: if is_ss2 { Range::around_zero(Quantity::Travel, prm(27)) } else { Range::OPEN },
        latch_late: is_ss2,
        ..row_of(id, request, shown, window)
    };
    let end = if is_ss2 { End::Sos } else { End::Sto };
    let standing_status = if is_ss2 { status::SOS } else { NO_BIT };
    plan.stops.add(Stop { spec, end, standing_status, resumes: false }).unwrap_or(0)
}

/// The functions without approach: SOS, SDIp, SDIn, SMS, SLI.
fn add_plain(plan: &mut Plan, prm: &dyn Fn(u32) -> i64, sms: Reaction, sli: Reaction) {
    let rpm = |number: u32| prm(number).saturating_mul(RPM);
    let speed = |lower: i64, upper: i64| Range { quantity: Quantity::Speed, lower, upper };
    let sos = row_of(SOS, control::SOS, status::SOS, Range::around_zero(Quantity::Speed, rpm(28)));
    plan.bank.add(Spec { hold: Range::around_zero(Quantity::Travel, prm(29)), ..sos });
    // AMKP-SDI-02: the permitted direction ends at Prm67.
    plan.bank.add(row_of(SDIP, control::SDIP, status::SDIP, speed(rpm(64).saturating_neg(), rpm(67))));
    plan.bank.add(row_of(SDIN, control::SDIN, status::SDIN, speed(rpm(67).saturating_neg(), rpm(64))));
    let maximum = Range::around_zero(Quantity::Speed, rpm(67));
    // AMKP-RAMP-04 has no rows for SMS and SLI.
    let plain = |spec: Spec, reaction: Reaction| Spec { names_too_fast: false, reaction, ..spec };
    plan.bank.add(plain(row_of(SMS, NO_BIT, status::SMS, maximum), sms));
    let increment = Range::between(Quantity::Travel, prm(65), prm(66));
    plan.bank.add(plain(row_of(SLI, control::SLI, status::SLI, increment), sli));
}

/// SE1 to SE3 in the levels of all pairs.
pub const PAIRS_USED: u32 = 0b111;

fn lines(image: &Image<'_>) -> [LineSetup; shm_schema::io::PAIRS] {
    let mut lines = [LineSetup::default(); shm_schema::io::PAIRS];
    let prm = |number: u32| parameter(image, number).max(0).unsigned_abs();
    for (line, [pulsed, inverted, filter, period]) in lines.iter_mut().zip(PAIRS) {
        *line = LineSetup {
            filter_us: prm(filter),
            is_inverted: prm(inverted) == 1,
            is_pulsed: prm(pulsed) == 1,
            period_ms: prm(period),
        };
    }
    lines
}

/// SA1.2, SA2.2, SDYN2 (AMKP-SA-01 to 05).
fn outputs(prm: &dyn Fn(u32) -> i64) -> [OutputSetup; LINES] {
    let of = |number: u32| prm(number).clamp(0, 100_000) as u32;
    let line = |pulse: u32, period: u32| OutputSetup::pulsed(of(pulse), of(period));
    let switched = |number: u32, line: OutputSetup| {
        if prm(number) == 1 { line } else { OutputSetup { pulse: 0, ..line } }
    };
    let first = OutputSetup { is_low_side: prm(104) == 1, ..switched(87, line(90, 91)) };
    let supply = OutputSetup { is_watched: false, ..line(101, 102) };
    [first, switched(93, line(96, 97)), supply]
}

/// What a violation is called: 3606 when it ends in STO, 3610 when a stop follows (DEC-44);
/// channel 2 reports ramps with Info3 14 and 15 (DEC-45).
pub fn code(spec: &Spec, breach: Breach, reaction: Reaction) -> ErrorCode {
    let number = if reaction == Reaction::Sto { 3606 } else { 3610 };
    let (info2, info3) = match breach {
        Breach::Damage => return ErrorCode::amk(3607, 100, 121, spec.id),
        Breach::TooFast => (0, 1),
        Breach::Line => (0, 14),
        Breach::Landing => (0, 15),
        Breach::Above(Quantity::Speed) => (3, 0),
        Breach::Below(Quantity::Speed) => (4, 0),
        Breach::Above(_) => (if is_warned_sli(spec, number) { 3 } else { 5 }, 0),
        Breach::Below(_) => (if is_warned_sli(spec, number) { 4 } else { 6 }, 0),
    };
    ErrorCode::amk(number, spec.id, info2, info3)
}

/// AMKD-3606-070: channel 2 has seen the FSoE watchdog expire (AMK-FSOE-06).
const FSOE_WATCHDOG: ErrorCode = ErrorCode::amk(3606, 70, 6, 4);

/// AMKD-FSM-01.
pub fn watch_bus(events: &Events, ledger: &mut Ledger) {
    if events.has_timed_out {
        ledger.raise(Entry::sto(FSOE_WATCHDOG, Cause::Live));
    }
}

/// AMKD-3606-028: channel 2 reads back another level than it drives.
pub fn watch_outputs(wrong: u8, ledger: &mut Ledger) {
    for output in (1..=2_u32).filter(|output| u32::from(wrong) >> (output.wrapping_sub(1) & 1) & 1 == 1) {
        ledger.raise(Entry::sto(ErrorCode::amk(3606, 28, 1, output), Cause::Live));
    }
}

/// AMKD-3610-114: the warning numbers its position limits 3 and 4, the error 5 and 6.
fn is_warned_sli(spec: &Spec, number: u32) -> bool {
    (spec.id == SLI) & (number == 3610)
}

/// Minute, ns.
const MINUTE_NS: u64 = 60_000_000_000;
/// Minutes after which an error without movement is sent again (AMK-SEM-08).
const REPEAT_MINUTES: u64 = 30;

/// Requests and standstill supervision.
#[derive(Debug, Clone, Copy)]
pub struct Logic {
    by_inputs: bool,
    /// Control bit each pair requests; 16 and above: none.
    pairs: [u8; 3],
    free_outputs: bool,
    inverted: [bool; 2],
    brakes: bool,
    ss1: u8,
    standstill: Option<Standstill>,
}

/// SEM: no movement of a whole sine period for too long (AMK-SEM-02 to 09).
#[derive(Debug, Clone, Copy)]
struct Standstill {
    period: i64,
    warning_ns: u64,
    error_ns: u64,
    position: Option<Twin>,
    since: Twin,
    /// Next time the error is sent, ns after `since`.
    due: Twin,
    warned: bool,
}

impl Logic {
    fn new(image: &Image<'_>, ss1: u8) -> Self {
        let prm = |number: u32| parameter(image, number);
        let pair = |number: u32| prm(number).clamp(0, 16) as u8;
        Self {
            by_inputs: prm(7) == 1,
            pairs: [pair(15), pair(16), pair(17)],
            free_outputs: (prm(7) == 0) & (prm(8) == 0),
            inverted: [prm(92) == 1, prm(98) == 1],
            brakes: image.value(ID33203, 1) & 1 == 1,
            ss1,
            // AMK-SEM-10: a resolver is exempt.
            standstill: (prm(5) == 1).then(|| Standstill::new(prm(6), prm(9), prm(10))),
        }
    }

    /// AMK-GEN-08: inputs or FSoE, never both.
    pub fn requests(&self, bits: &Bits, asked: &Asked<'_>) -> Word {
        if !self.by_inputs {
            return plain_requests(bits, asked.word);
        }
        let mut word = Word::ZERO;
        for (pair, bit) in (0..3).zip(self.pairs) {
            let is_low = asked.levels >> pair & 1 == 0;
            let is_assigned = bit < 16;
            if is_low & is_assigned {
                word = word.with(bit, true);
            }
        }
        word
    }

    /// Standstill times.
    pub fn pass(&mut self, motion: &Motion, now: u64, ledger: &mut Ledger) {
        let ss1 = self.ss1;
        if let Some(standstill) = &mut self.standstill {
            standstill.watch(motion.position, now, ss1, ledger);
        }
    }

    /// SS1 withdraws controller enable by itself (AMK-GEN-06).
    pub const fn brakes(&self) -> bool {
        self.brakes
    }

    /// Levels of SA1.1, SA1.2, SA2.1, SA2.2 (AMK-OUT-01, AMK-OUT-05, AMK-OUT-07); the
    /// supply outputs stand at 1.
    pub fn outputs(&self, word: &Word, requested: &Word, in_sto: bool, stands: &dyn Fn(u8) -> bool) -> u8 {
        let (first, second) = if self.free_outputs {
            (word.bit(control::SA1), word.bit(control::SA2))
        } else {
            (self.is_acknowledged(requested, stands), in_sto)
        };
        let [invert_first, invert_second] = self.inverted;
        let levels = [first, first != invert_first, second, second != invert_second, true, true];
        (0..).zip(levels).fold(0, |octet, (bit, level)| octet | u8::from(level) << (bit & 7))
    }

    /// SA1: every function requested through SE1 and SE2 is active.
    fn is_acknowledged(&self, requested: &Word, stands: &dyn Fn(u8) -> bool) -> bool {
        if !self.by_inputs {
            return false;
        }
        let asked = |bit: &&u8| (**bit < 16) && requested.bit(**bit);
        let mut functions = self.pairs.iter().take(2).filter(asked).peekable();
        functions.peek().is_some() && functions.all(|bit| stands(*bit))
    }
}

impl Standstill {
    fn new(periods: i32, warning_min: i32, error_min: i32) -> Self {
        let minutes = |count: i32| u64::from(count.max(0).unsigned_abs()).saturating_mul(MINUTE_NS);
        let warning_ns = minutes(warning_min);
        let error_ns = warning_ns.saturating_add(minutes(error_min));
        let period = 65_536_i64.checked_div(i64::from(periods.max(1))).unwrap_or(1);
        Self {
            period,
            warning_ns,
            error_ns,
            position: None,
            since: Twin::time(0),
            due: Twin::time(error_ns),
            warned: false,
        }
    }

    fn watch(&mut self, position: i64, now: u64, ss1: u8, ledger: &mut Ledger) {
        let rest = self.position.and_then(Twin::get);
        let moved = rest.is_none_or(|rest| position.saturating_sub(rest).saturating_abs() >= self.period);
        if moved {
            self.position = Some(Twin::new(position));
            self.since = Twin::time(now);
            self.due = Twin::time(self.error_ns);
            self.warned = false;
            return;
        }
        let (Some(since), Some(due)) = (self.since.get_time(), self.due.get_time()) else {
            return ledger.raise(Entry::sto(ErrorCode::amk(3607, 39, 5, 0), Cause::Lasting));
        };
        let still = now.saturating_sub(since);
        if (still >= self.warning_ns) & !self.warned {
            // AMK-SEM-04: clearing the message does not reset the time, nor raise it again.
            self.warned = true;
            ledger.raise(Entry::warning(ErrorCode::amk(3610, 39, 3, 0), Cause::Reaction));
        }
        if still >= due {
            self.due = Twin::time(due.saturating_add(REPEAT_MINUTES.saturating_mul(MINUTE_NS)));
            ledger.raise(Entry {
                code: ErrorCode::amk(3606, 39, 4, 0),
                reaction: Reaction::Stop(ss1),
                is_error: true,
                cause: Cause::Reaction,
                owner: NO_OWNER,
            });
        }
    }
}
