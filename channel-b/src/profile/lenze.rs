//! Lenze SM301: stops with stopping time, SLS with direction, SDI by position, special
//! operation, emergency stop, cascading, input pairs with discrepancy time.

use shm_schema::error::ErrorCode;
use shm_schema::facts::lenze_sm301::{self, control, status};
use shm_schema::profile::lenze_key;
use shm_schema::word::Word;

use super::lenze_inputs::{Pair, Terminal};
use super::lenze_messages as message;
use super::lenze_output::Feedback;
use super::lenze_plant::{Cascade, set_encoder};
use super::{Asked, Bits, Plan, raise};
use crate::encoder::drive::Contradiction;
use crate::engine::bank::Bank;
use crate::engine::spec::{Approach, MS_NS, NO_BIT, Quantity, RPM, Range, Reaction, Slope, Spec};
use crate::engine::stops::{End, Stop, Stops};
use crate::image::Image;
use crate::inputs::LineSetup;
use crate::ledger::{Cause, Entry, Ledger, NO_OWNER};
use crate::outputs::LineSetup as OutputSetup;

/// Bits of the request word that the control word does not have: what remains after
/// special operation and filter.
mod asked {
    pub const STO: u8 = 64;
    pub const SS1: u8 = 65;
    pub const SS2: u8 = 66;
    pub const SLI: u8 = 67;
    pub const SLS: u8 = 68;
    pub const SDI_POSITIVE: u8 = 72;
    pub const SDI_NEGATIVE: u8 = 73;
}

/// Function bits of the control word, active low: STO to SDIneg, SSE.
const LOW: u32 = 0x0080_01FF;
/// Active high: ES, OMS.
const HIGH: u32 = 0x0000_0A00;
/// Test pulses of active sensors are not seen (LNZ-IN-11), µs.
const FILTER_US: u32 = 2_000;
/// The glitch filter in front, µs.
const GLITCH_US: u32 = 250;

/// The value of a code; what a set leaves out has its documented default.
pub fn parameter(image: &Image<'_>, code: u32, subcode: u32) -> i64 {
    let key = lenze_key(code, subcode);
    let default = || lenze_sm301::PARAMETERS.iter().find(|row| row.key == key).map_or(0, |row| row.default);
    i64::from(image.find(key).unwrap_or_else(default))
}

/// Builds the rows from the parameters.
pub fn build(image: &Image<'_>) -> Plan {
    let mut plan = Plan::new(image);
    plan.set_common(image);
    let code = |number: u32| parameter(image, number, 0);
    plan.bits = bits();
    plan.needs_restart = parameter(image, 15_300, 1) == 0;
    set_encoder(&mut plan, image);
    let ss1 = plan.stops.add(ss1(&code)).unwrap_or(0);
    let ss2 = plan.stops.add(ss2(&code)).unwrap_or(0);
    if parameter(image, 15_300, 2) == 0 {
        plan.sos_needs_restart = 1 << (ss2 & 15);
    }
    let reaction = |value: i64| match value {
        1 => Reaction::Stop(ss1),
        2 => Reaction::Stop(ss2),
        _ => Reaction::Sto,
    };
    add_speed(&mut plan, image, &reaction);
    add_position(&mut plan, &code, &reaction);
    plan.lines = core::array::from_fn(|pair| {
        let delay = parameter(image, 15_034, pair as u32 + 1).clamp(0, 100) as u32;
        let filter_us = delay.saturating_mul(1_000).saturating_add(FILTER_US).saturating_sub(GLITCH_US);
        LineSetup { filter_us, ..LineSetup::default() }
    });
    // LNZ-OUT-02: pulses below 1 ms about every 2 s, a second away from channel A's.
    let pulsed = OutputSetup { phase: 16_000, ..OutputSetup::pulsed(500, 2_000) };
    plan.outputs = [pulsed, OutputSetup::default(), OutputSetup::default()];
    plan.logic = super::Logic::Lenze(Logic::new(image, ss1));
    plan
}

/// AIS and AIE in the levels of all lines.
pub const TERMINALS: u32 = 0b11_0000;

fn bits() -> Bits {
    Bits {
        // OMS and ES select and confirm; they are no requested functions that the channels compare.
        low: Word::from_u32(LOW),
        sto: asked::STO,
        acknowledge: control::PS_AIE,
        restart: control::PS_AIS,
        sto_active: status::STO_ACTIVE,
        error: status::ERROR_ACTIVE,
        either: Word::from_u32(1 << status::ERROR_ACTIVE),
        ..Bits::NONE
    }
}

/// Times and line that SS1 and SS2 have in common (LNZ-RAMP-02 to 04, DEC-49).
fn braking(code: &dyn Fn(u32) -> i64, dwell_ns: i64) -> Approach {
    let time = code(15_305).saturating_mul(MS_NS);
    let base = Approach {
        timeout_ns: time.max(0),
        timeout_strict: true,
        dwell_ns,
        line_ends: false,
        watch_line: false,
        ..Approach::NONE
    };
    if code(15_315) != 1 {
        return base;
    }
    // t_V = C15305 * (10 % + 20 % * C15316 / 100), in thousandths.
    let share = code(15_316).saturating_mul(2).saturating_add(100);
    let delay_ns = time.saturating_mul(share).checked_div(1_000).unwrap_or(0);
    let offset = if code(15_317) == 0 { code(15_310).saturating_mul(RPM) } else { 0 };
    Approach {
        delay_ns,
        slope: Slope { num: 1, den: time.saturating_sub(delay_ns).max(1) },
        falls_to_zero: true,
        watch_line: true,
        watch_start: true,
        offset,
        offset_permille: code(15_317).saturating_mul(10),
        ..base
    }
}

fn standstill(code: &dyn Fn(u32) -> i64) -> Range {
    Range::around_zero(Quantity::Speed, code(15_310).saturating_mul(RPM))
}

fn ss1(code: &dyn Fn(u32) -> i64) -> Stop {
    // LNZ-SS1-04: mode 1 ends at n = 0 plus C15307.
    let dwell = if code(15_306) == 1 { code(15_307).saturating_mul(MS_NS) } else { -1 };
    let spec = Spec {
        id: message::STOPPING_TIME,
        control: asked::SS1,
        status: status::SS1_ACTIVE,
        approach: braking(code, dwell),
        window: standstill(code),
        ..Spec::IDLE
    };
    Stop { spec, end: End::Sto, standing_status: NO_BIT, resumes: false }
}

fn ss2(code: &dyn Fn(u32) -> i64) -> Stop {
    let dwell = if code(15_308) == 1 { 0 } else { -1 };
    let spec = Spec {
        id: message::STOPPING_TIME,
        control: asked::SS2,
        status: status::SS2_ACTIVE,
        approach: braking(code, dwell),
        window: standstill(code),
        hold: Range::around_zero(Quantity::Travel, code(15_311)),
        hold_only: true,
        latch_late: true,
        ..Spec::IDLE
    };
    Stop { spec, end: End::Sos, standing_status: status::SOS_MONITORED, resumes: true }
}

/// SMS and SLS1 to 4.
fn add_speed(plan: &mut Plan, image: &Image<'_>, reaction: &dyn Fn(i64) -> Reaction) {
    let maximum = parameter(image, 15_320, 0);
    if maximum > 0 {
        let window = Range::around_zero(Quantity::Speed, maximum.saturating_mul(RPM));
        let reaction = reaction(parameter(image, 15_321, 0));
        plan.bank.add(Spec { id: message::SMS, window, reaction, ..Spec::IDLE });
    }
    for number in 0..4_u8 {
        let of = |code: u32| parameter(image, code, u32::from(number).saturating_add(1));
        plan.bank.add(Spec {
            id: message::SLS.saturating_add(u32::from(number)),
            control: asked::SLS.saturating_add(number),
            status: status::SLS1_MONITORED.saturating_add(number),
            approach: Approach::line(of(15_331).saturating_mul(MS_NS), Slope::NONE),
            window: Range::around_zero(Quantity::Speed, of(15_330).saturating_mul(RPM)),
            shows_inside: true,
            reaction: reaction(of(15_332)),
            ..Spec::IDLE
        });
    }
}

/// SDI by position (DEC-49) and SLI.
fn add_position(plan: &mut Plan, code: &dyn Fn(u32) -> i64, reaction: &dyn Fn(i64) -> Reaction) {
    let delay = Approach::line(code(15_341).saturating_mul(MS_NS), Slope::NONE);
    let base = Spec { approach: delay, latch_late: true, reaction: reaction(code(15_343)), ..Spec::IDLE };
    let tolerance = code(15_342);
    plan.bank.add(Spec {
        id: message::SDI_POSITIVE,
        control: asked::SDI_POSITIVE,
        status: status::SDIPOS_MONITORED,
        window: Range { quantity: Quantity::Travel, lower: tolerance.saturating_neg(), upper: i64::MAX },
        ratchet: 1,
        ..base
    });
    plan.bank.add(Spec {
        id: message::SDI_NEGATIVE,
        control: asked::SDI_NEGATIVE,
        status: status::SDINEG_MONITORED,
        window: Range { quantity: Quantity::Travel, lower: i64::MIN, upper: tolerance },
        ratchet: -1,
        ..base
    });
    let increment = code(15_203);
    if increment > 0 {
        let window = Range::around_zero(Quantity::Travel, increment);
        plan.bank.add(Spec {
            id: message::SLI,
            control: asked::SLI,
            status: status::SLI_ACTIVE,
            window,
            ..Spec::IDLE
        });
    }
}

/// Special operation (LNZ-OMS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operation {
    Normal,
    /// Stopped by C15200.
    Special,
    /// Moved by the enable switch.
    Confirmed,
}

/// Requests, special operation and what hangs on them.
#[derive(Debug, Clone, Copy)]
pub struct Logic {
    pairs: [Pair; 4],
    filter: u32,
    operation: Operation,
    oms_by_input: Option<bool>,
    stop: i64,
    motion: i64,
    directions: [i64; 5],
    emergency_is_ss1: bool,
    is_cascaded: bool,
    has_sli: bool,
    ss1: u8,
    es_before: bool,
    completes: bool,
    oms_requested: bool,
    emergency: bool,
    /// An emergency stop or an error has been behind the stop that stands.
    is_hard_stop: bool,
    levels_on: u32,
    ais: Terminal,
    aie: Terminal,
    limits: [i64; 5],
    /// Since when the stop that answers a violated limit runs, ns (LNZ-SMS-06).
    responses: [Option<u64>; 5],
    response_ns: u64,
    output: Feedback,
    is_output_faulty: bool,
    /// Special operation was left; its stop waits for AIS.
    waits_for_restart: bool,
    has_encoder: bool,
    /// C15411, 1/1000 rpm; the parameter counts whole rpm.
    deviation_most: i64,
    cascade: Cascade,
}

impl Logic {
    /// Pairs that are on, bit n for SD-In n + 1; a deactivated one is not.
    pub const fn levels_on(&self) -> u32 {
        self.levels_on
    }

    fn new(image: &Image<'_>, ss1: u8) -> Self {
        let code = |number: u32| parameter(image, number, 0);
        let pairs: [Pair; 4] = core::array::from_fn(|at| {
            let of = |number: u32| parameter(image, number, at as u32 + 1);
            Pair {
                is_used: of(15_030) != 0,
                function: of(15_031),
                assignment: of(15_032),
                discrepancy_ns: of(15_033).max(0).unsigned_abs().saturating_mul(MS_NS as u64),
                agreed: false,
                differs_since: None,
                is_faulty: false,
            }
        });
        let has = |function: i64| pairs.iter().any(|pair| pair.is_used & (pair.function == function));
        let direction = |at: u32| if at == 4 { code(15_340) } else { parameter(image, 15_333, at + 1) };
        let limit = |at: u32| if at == 4 { code(15_320) } else { parameter(image, 15_330, at + 1) };
        Self {
            pairs,
            // Without a safety bus nothing in the control word counts.
            filter: if code(15_100) == 0 { 0 } else { code(15_113) as u32 },
            operation: Operation::Normal,
            oms_by_input: has(2).then(|| code(15_202) == 1),
            stop: code(15_200),
            motion: code(15_201),
            directions: core::array::from_fn(|at| direction(at as u32)),
            emergency_is_ss1: code(15_205) == 1,
            is_cascaded: code(15_035) == 4,
            has_sli: code(15_203) > 0,
            ss1,
            es_before: true,
            completes: false,
            oms_requested: false,
            emergency: false,
            is_hard_stop: false,
            levels_on: 0,
            ais: Terminal::default(),
            aie: Terminal::default(),
            limits: core::array::from_fn(|at| limit(at as u32).saturating_mul(RPM)),
            responses: [None; 5],
            output: Feedback::new(image),
            is_output_faulty: false,
            waits_for_restart: false,
            has_encoder: code(15_400) != 0,
            deviation_most: code(15_411).saturating_add(1).saturating_mul(RPM),
            cascade: Cascade::default(),
            response_ns: code(15_350).max(0).unsigned_abs().saturating_mul(MS_NS as u64),
        }
    }

    /// AIS and AIE: the end of a pulse of 0.3 to 10 s.
    pub fn terminals(&mut self, asked: &Asked<'_>) -> (bool, bool) {
        let level = |bit: u32| asked.levels >> bit & 1 == 1;
        let restart = self.ais.edge(level(4), asked.is_first, asked.now);
        (restart, self.aie.edge(level(5), asked.is_first, asked.now))
    }

    /// The stop of special operation waits for its restart acknowledge.
    pub const fn waits_for_restart(&self) -> bool {
        self.waits_for_restart
    }

    /// The restart acknowledge has come; in a cascade 100 ms ago (LNZ-CAS-06). A stop meanwhile
    /// takes it back.
    pub fn restarts(&mut self, edge: bool, is_awaited: bool, now: u64) -> bool {
        let restarts = self.cascade.restarts(edge, is_awaited, self.is_cascaded, now);
        self.waits_for_restart &= !restarts;
        restarts
    }

    /// LNZ-SPD-06: the drive's speed and the own one differ by more than C15411.
    pub fn watch_drive(&self, found: &Contradiction, ledger: &mut Ledger) {
        if found.deviation_mrpm >= self.deviation_most {
            let code = ErrorCode::single(message::SPEED_COMPARISON);
            ledger.raise(Entry::sto(code, Cause::Live));
        }
    }

    /// LNZ-SS2-04: what needs a speed is asked for and there is no encoder.
    fn watch_encoder(&self, all: &Word, ledger: &mut Ledger) {
        let needs = (0..4).any(|number| all.bit(asked::SLS.saturating_add(number)))
            | [asked::SS2, asked::SLI, asked::SDI_POSITIVE, asked::SDI_NEGATIVE]
                .iter()
                .any(|bit| all.bit(*bit));
        if needs & !self.has_encoder {
            ledger.raise(Entry::sto(ErrorCode::single(message::NO_ENCODER), Cause::Live));
        }
    }

    /// Unreadable terminals: what they were is forgotten, or a lost line would be an edge (DEC-18).
    pub fn forget_terminals(&mut self) {
        (self.ais, self.aie) = (Terminal::default(), Terminal::default());
    }

    /// No discrepancy time runs.
    pub fn rests(&self) -> bool {
        self.pairs.iter().all(|pair| pair.differs_since.is_none())
    }

    /// A simple stop ends in this cycle because the enable switch was confirmed.
    pub const fn completes_stops(&self) -> bool {
        self.completes
    }

    /// Control word behind the filter of C15113: an inhibited bit requests nothing (DEC-49).
    fn filtered(&self, word: &Word) -> u32 {
        let [given, ..] = word.0;
        let inactive = LOW | 1 << control::SD_OUT1;
        (given & self.filter) | (inactive & !self.filter)
    }

    /// Everything requested in this cycle.
    pub fn requests(&mut self, asked: &Asked<'_>, bank: &Bank, ledger: &mut Ledger) -> Word {
        let bus = self.filtered(asked.word);
        self.read_pairs(asked, ledger);
        let mut word = Word::from_u32((!bus & LOW) | (bus & HIGH));
        self.emergency = word.bit(control::SSE);
        let (mut oms, mut es) = (word.bit(control::OMS), word.bit(control::ES));
        for (at, pair) in (0..4_u32).zip(self.pairs) {
            let is_on = self.levels_on >> at & 1 == 1;
            let is_low = pair.is_used & !is_on;
            let is_cascade = self.is_cascaded & (at == 3);
            self.emergency |= is_low & ((pair.function == 1) | is_cascade);
            let is_assigned = (pair.function == 0) & (pair.assignment < 9) & !is_cascade;
            if is_low & is_assigned {
                word = word.with(pair.assignment.clamp(0, 8) as u8, true);
            }
            if pair.is_used & (pair.function == 2) {
                // LNZ-OMS-16: a faulty selector selects normal operation, whatever its level.
                oms = (is_on != self.oms_by_input.unwrap_or(false)) & !pair.is_faulty;
            }
            if pair.is_used & (pair.function == 3) {
                es = is_on;
            }
        }
        if self.is_cascaded {
            let is_fed_back = self.levels_on >> 3 & 1 == 0;
            self.cascade.watch(is_fed_back, asked.in_sto, asked.now, ledger);
        }
        // LNZ-STOP-02: until torque is on again, the stop is more than one of special operation.
        let is_hard = self.emergency | ledger.has_error();
        self.is_hard_stop = is_hard | (self.is_hard_stop & !asked.is_idle);
        self.operate(oms, es, bank, asked);
        let all = self.resolve(word);
        self.watch_encoder(&all, ledger);
        all
    }

    /// State 1, 2, 3 of special operation (LNZ-OMS-04 to 12).
    fn operate(&mut self, oms: bool, es: bool, bank: &Bank, asked: &Asked<'_>) {
        // LNZ-ES-03: the edge confirms; a level that was there before does not.
        let edge = es & !self.es_before & !asked.is_settled;
        self.es_before = es;
        self.completes = false;
        self.oms_requested = oms;
        let next = match self.operation {
            Operation::Normal if oms => Operation::Special,
            Operation::Normal => Operation::Normal,
            Operation::Special if !oms => Operation::Normal,
            Operation::Special if edge & self.may_confirm(bank, asked) => Operation::Confirmed,
            Operation::Confirmed if es => Operation::Confirmed,
            Operation::Special | Operation::Confirmed => Operation::Special,
        };
        // LNZ-OMS-12, LNZ-OMS-13: on the way back the drive must never restart by itself,
        // whatever C15300 says. To select special operation again is no acknowledge: what waits
        // does so until AIS, or until the enable switch has brought torque back.
        let returns = (next == Operation::Normal) & (self.operation != Operation::Normal);
        let still_waits = self.waits_for_restart & !asked.is_idle;
        self.waits_for_restart = returns | still_waits;
        let confirms = (next == Operation::Confirmed) & (self.operation == Operation::Special);
        // LNZ-OMS-10, LNZ-OMS-14: only what special operation has stopped.
        self.completes = confirms & !self.is_hard_stop;
        self.operation = next;
    }

    /// LNZ-OMS-22: a limited speed must be kept and monitored; in STO nothing is (DEC-14), elsewhere
    /// the SLS is active above its limit too in its braking time. LNZ-OMS-08: an emergency stop is a
    /// state of its own, which the edge does not leave. A standing error does not refuse it: the
    /// error stop runs whatever the enable switch says (LNZ-OMS-10).
    fn may_confirm(&self, bank: &Bank, asked: &Asked<'_>) -> bool {
        let number = self.motion.saturating_sub(3);
        let is_free = !(0..4).contains(&number);
        let place = number.clamp(0, 3) as u8;
        let limit = self.limits.get(usize::from(place)).copied().unwrap_or(0);
        let is_slow = asked.motion.speed.saturating_abs() <= limit;
        let is_monitored = bank.is_active(status::SLS1_MONITORED.saturating_add(place));
        let is_watched = is_monitored | asked.in_sto;
        let is_kept = is_slow & is_watched;
        let is_suitable = is_free | is_kept;
        is_suitable & !self.emergency
    }

    /// What stops and monitoring functions see.
    fn resolve(&self, word: Word) -> Word {
        let is_special = self.operation != Operation::Normal;
        let is_confirmed = self.operation == Operation::Confirmed;
        let simple = |bit: u8| word.bit(bit) & !is_special;
        let stop = |number: i64| (self.operation == Operation::Special) & (self.stop == number);
        let mut all = word;
        let mut set = |bit: u8, value: bool| {
            if value {
                all = all.with(bit, true);
            }
        };
        let emergency_sto = self.emergency & !self.emergency_is_ss1;
        set(control::SSE, self.emergency);
        set(asked::STO, simple(control::STO) | stop(0) | emergency_sto);
        set(asked::SS1, simple(control::SS1) | stop(1) | (self.emergency & self.emergency_is_ss1));
        set(asked::SS2, simple(control::SS2) | stop(2));
        set(asked::SLI, is_confirmed & self.has_sli);
        let mut positive = word.bit(control::SDIPOS);
        let mut negative = word.bit(control::SDINEG);
        let [.., permanent] = self.directions;
        // LNZ-SDI-08: the permanent one belongs to normal operation.
        positive |= !is_special & (permanent == 1);
        negative |= !is_special & (permanent == 2);
        for (number, direction) in (0..4_u8).zip(self.directions) {
            let by_motion = is_special & (self.motion == i64::from(number).saturating_add(3));
            let requested = word.bit(control::SLS1.saturating_add(number)) | by_motion;
            set(asked::SLS.saturating_add(number), requested);
            positive |= requested & (direction == 1);
            negative |= requested & (direction == 2);
        }
        set(asked::SDI_POSITIVE, positive);
        set(asked::SDI_NEGATIVE, negative);
        all
    }

    /// Contact function test of every used pair.
    fn read_pairs(&mut self, asked: &Asked<'_>, ledger: &mut Ledger) {
        self.levels_on = 0;
        for (at, pair) in (0..4_u32).zip(&mut self.pairs) {
            let lines = (asked.levels >> at & 1 == 1, asked.others >> at & 1 == 1);
            if !pair.is_used {
                // LNZ-IN-03: looked at during initialisation.
                if asked.is_starting & (lines.0 | lines.1) {
                    let code = ErrorCode::single(message::DEACTIVATED.saturating_add(at));
                    ledger.raise(Entry::sto(code, Cause::Live));
                }
                continue;
            }
            let is_faulty = pair.judge(lines, asked.is_first, asked.now);
            // LNZ-IN-04: OFF until the error is acknowledged.
            let is_cascade = self.is_cascaded & (at == 3);
            let own = message::DISCREPANCY.saturating_add(at);
            // LNZ-CAS-13: the cascade has a message and a reaction of its own.
            let code = ErrorCode::single(if is_cascade { message::CASCADE } else { own });
            let reaction = if is_cascade { Reaction::Sto } else { Reaction::None };
            pair.is_faulty = is_faulty | ledger.any(|entry| entry.code == code);
            let is_on = pair.agreed & pair.differs_since.is_none() & !pair.is_faulty;
            self.levels_on |= u32::from(is_on) << at;
            if is_faulty {
                ledger.raise(Entry { code, reaction, is_error: true, cause: Cause::Live, owner: NO_OWNER });
            }
        }
    }

    /// LNZ-OUT-03: a faulty SD-Out1 is switched off until its error is acknowledged.
    pub fn watch_outputs(&mut self, wrong: u8, ledger: &mut Ledger) {
        let code = ErrorCode::single(if self.is_cascaded { message::CASCADE } else { message::OUTPUT });
        if wrong != 0 {
            let reaction = if self.is_cascaded { Reaction::Sto } else { Reaction::None };
            ledger.raise(Entry { reaction, ..Entry::sto(code, Cause::Live) });
        }
        self.is_output_faulty = ledger.any(|entry| entry.code == code);
    }

    /// A violated limit must be kept when C15350 is over and from then on, otherwise STO
    /// (LNZ-SMS-06, LNZ-EX-27). DEC-14: not in STO.
    pub fn watch(&mut self, asked: &Asked<'_>, in_sto: bool, ledger: &mut Ledger) {
        let is_unanswered = in_sto | !ledger.has_error();
        if is_unanswered {
            self.responses = [None; 5];
            return;
        }
        let speed = asked.motion.speed.saturating_abs();
        let mut is_late = false;
        for ((at, response), limit) in (0_u32..).zip(&mut self.responses).zip(self.limits) {
            let number = if at == 4 { message::SMS } else { message::SLS.saturating_add(at) };
            let stands = ledger.any(|entry| {
                let is_stop = matches!(entry.reaction, Reaction::Stop(_));
                is_stop & (entry.code.code == number)
            });
            if !stands {
                *response = None;
                continue;
            }
            let since = *response.get_or_insert(asked.now);
            let is_over = asked.now.saturating_sub(since) >= self.response_ns;
            is_late |= is_over & (speed > limit);
        }
        if is_late {
            ledger.raise(Entry::sto(ErrorCode::single(message::RESPONSE_TIME), Cause::Reaction));
        }
    }

    /// Active and mode bits.
    pub fn show(&self, word: &mut Word, requested: &Word, stops: &Stops, bank: &Bank) {
        let mut set = |bit: u8, value: bool| raise(word, bit, value);
        // LNZ-SS1-11, LNZ-SOS-06: the end state is shown additionally.
        let ended = stops.origin() >> (self.ss1 & 15) & 1 == 1;
        set(status::SS1_ACTIVE, stops.in_sto() & ended);
        set(status::SS2_ACTIVE, stops.is_in_ss2());
        let runs = !stops.in_sto();
        for number in 0..4_u8 {
            let is_active = bank.is_active(status::SLS1_MONITORED.saturating_add(number));
            set(status::SLS1_ACTIVE.saturating_add(number), runs & is_active);
        }
        set(status::SDIPOS_ACTIVE, runs & bank.is_active(status::SDIPOS_MONITORED));
        set(status::SDINEG_ACTIVE, runs & bank.is_active(status::SDINEG_MONITORED));
        set(status::ES_ACTIVE, self.operation == Operation::Confirmed);
        set(status::OMS, self.oms_requested);
        set(status::OMS_ACTIVE, self.operation != Operation::Normal);
        set(status::SSE_ACTIVE, requested.bit(control::SSE));
        for at in 0..4_u8 {
            set(status::SD_IN1.saturating_add(at), self.levels_on >> at & 1 == 1);
        }
    }

    /// SD-Out1. Cascaded it is off in STO (LNZ-CAS-04); otherwise the conditions of C15051 and
    /// C15052 and the bus must agree (LNZ-OUT-01, LNZ-OUT-05).
    pub fn outputs(&self, word: &Word, status: &Word, in_sto: bool) -> u8 {
        let by_bus = self.filtered(word) >> control::SD_OUT1 & 1 == 1;
        let is_on = if self.is_cascaded { !in_sto } else { by_bus & self.output.is_on(status) };
        if is_on & !self.is_output_faulty { 0b11 } else { 0 }
    }
}
