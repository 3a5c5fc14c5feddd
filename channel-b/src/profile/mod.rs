//! Profiles (DEC-27): names, numbers, words and codes, and the request logic in front of
//! the engine. A profile builds rows; it changes no primitive.

pub mod amk;
pub mod amk_rules;
pub mod atv;
pub mod atv_rules;
pub mod etg;
pub mod etg_rules;
pub mod lenze;
pub mod lenze_inputs;
pub mod lenze_messages;
pub mod lenze_output;
pub mod lenze_plant;
pub mod lenze_rules;

use shm_schema::error::ErrorCode;
use shm_schema::io::PAIRS;
use shm_schema::profile::{Profile, common};
use shm_schema::word::Word;

use crate::bus::Events;
use crate::bus::inputs::Telegram;
use crate::compare::Limits;
use crate::encoder::EncoderSetup;
use crate::encoder::drive::Contradiction;
use crate::engine::Motion;
use crate::engine::bank::Bank;
use crate::engine::record::{Breach, Phase};
use crate::engine::spec::{NO_BIT, Reaction, Spec};
use crate::engine::stops::{End, Stops};
use crate::image::{Flaw, Image};
use crate::inputs::{Inputs, LineSetup};
use crate::ledger::{Cause, Entry, Ledger, STOP};

/// Step of the fault tolerance time, ns (DEC-20).
const TOLERANCE_STEP_NS: u64 = 15_000_000;

/// Everything a profile makes of a parameter image.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Which profile.
    pub profile: Profile,
    /// Content signature of the image.
    pub signature: u32,
    /// Monitoring functions.
    pub bank: Bank,
    /// Stop functions.
    pub stops: Stops,
    /// Bits of the words.
    pub bits: Bits,
    /// Octets of control and status word on the black channel, where the set says (DEC-41).
    pub words: (u8, u8),
    /// Encoder to evaluate.
    pub encoder: EncoderSetup,
    /// An encoder is evaluated at all.
    pub has_encoder: bool,
    /// Lines .2 of the input pairs.
    pub lines: [LineSetup; PAIRS],
    /// Lines .2 of the safe outputs.
    pub outputs: [crate::outputs::LineSetup; crate::outputs::LINES],
    /// Largest differences between the channels.
    pub position_difference: i64,
    /// 1/1000 rpm.
    pub speed_difference: i64,
    /// Fault tolerance time, ns.
    pub tolerance_ns: u64,
    /// A finished stop is left by a restart acknowledge only (DEC-12).
    pub needs_restart: bool,
    /// Bit n: the SOS at the end of stop n is left by a restart acknowledge only.
    pub sos_needs_restart: u16,
    /// What the profile adds to the engine.
    pub logic: Logic,
}

/// Bits of control and status word that every profile has in one form or another.
#[derive(Debug, Clone, Copy)]
pub struct Bits {
    /// Control: function bits, active low.
    pub low: Word,
    /// Control: function bits, active high.
    pub high: Word,
    /// Control: STO.
    pub sto: u8,
    /// Control: error acknowledge.
    pub acknowledge: u8,
    /// Control: restart acknowledge.
    pub restart: u8,
    /// Status: STO active.
    pub sto_active: u8,
    /// Status: an error stands.
    pub error: u8,
    /// Status: a restart acknowledge is awaited.
    pub restart_request: u8,
    /// Status: functional safety ready.
    pub valid: u8,
    /// Status: level of the first input pair, the others follow.
    pub inputs: u8,
    /// Pairs shown in the status.
    pub pairs: u8,
    /// Status bits that are 1 when either channel says so: errors, movements, requests to the
    /// operator (DEC-25). All others need both.
    pub either: Word,
}

impl Bits {
    /// No bit at all.
    pub const NONE: Self = Self {
        low: Word::ZERO,
        high: Word::ZERO,
        sto: NO_BIT,
        acknowledge: NO_BIT,
        restart: NO_BIT,
        sto_active: NO_BIT,
        error: NO_BIT,
        restart_request: NO_BIT,
        valid: NO_BIT,
        inputs: NO_BIT,
        pairs: 0,
        either: Word::ZERO,
    };
}

/// What the request logic of a profile sees in one cycle.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// Control word as received; zeros when there is none (DEC-18).
    pub word: &'a Word,
    /// Debounced level of each pair, bit n.
    pub levels: u32,
    /// Debounced level of the partner's line of each pair.
    pub others: u32,
    /// The lines can be read; otherwise every level is low (DEC-18).
    pub are_lines_read: bool,
    /// First step.
    pub is_first: bool,
    /// First step of a settled start.
    pub is_settled: bool,
    /// The axis has not been operational yet.
    pub is_starting: bool,
    /// The drive's own status, non-safe.
    pub drive_n0: bool,
    /// Its power stage is enabled, non-safe.
    pub drive_enabled: bool,
    /// Motion of this cycle.
    pub motion: &'a Motion,
    /// Torque was off in the cycle before.
    pub in_sto: bool,
    /// No stop braked or stood then, and torque was on.
    pub is_idle: bool,
    /// The STO of a finished stop has its least time still before it (DEC-48).
    pub rests: bool,
    /// Bit n: while the request of stop n stands, STO stands.
    pub held: u16,
    /// Own clock, ns.
    pub now: u64,
}

/// What a profile adds to the engine.
#[expect(clippy::large_enum_variant, reason = "one of them for each axis, and no allocator")]
#[derive(Debug, Clone, Copy)]
pub enum Logic {
    /// AMK KW-R07/R17/R27.
    Amk(amk::Logic),
    /// ETG.6100.2 generic profile.
    Etg(etg::Logic),
    /// Lenze SM301.
    Lenze(lenze::Logic),
    /// Schneider ATV340 with VW3A3807.
    Atv(atv::Logic),
    /// No profile: nothing is permitted.
    None,
}

impl Plan {
    /// A plan that permits nothing, with what all profiles have in common.
    pub fn new(image: &Image<'_>) -> Self {
        Self::base(image.profile, image.signature)
    }

    fn base(profile: Profile, signature: u32) -> Self {
        Self {
            profile,
            signature,
            bank: Bank::new(),
            stops: Stops::new(),
            bits: Bits::NONE,
            words: (4, 4),
            encoder: EncoderSetup {
                slot: None,
                kind: None,
                periods: 1024,
                pole_pairs: 1,
                is_inverted: false,
                gear_percent: 100,
            },
            has_encoder: true,
            lines: [LineSetup::default(); PAIRS],
            outputs: [crate::outputs::LineSetup::default(); crate::outputs::LINES],
            position_difference: 0,
            speed_difference: 0,
            tolerance_ns: 0,
            needs_restart: false,
            sos_needs_restart: 0,
            logic: Logic::None,
        }
    }

    /// A plan without profile: nothing is permitted.
    pub fn empty() -> Self {
        Self::base(Profile::None, 0)
    }

    /// Builds the plan of the image's profile.
    pub fn build(image: &Image<'_>) -> Self {
        match image.profile {
            Profile::AmkKw => amk::build(image),
            Profile::Etg61002 => etg::build(image),
            Profile::LenzeSm301 => lenze::build(image),
            Profile::Atv340 => atv::build(image),
            Profile::None => Self::new(image),
        }
    }

    /// Enters cc-factor and comparison limits (DEC-20).
    pub fn set_comparison(&mut self, factor: i32, position: i32, speed_rpm: i32) {
        let steps = u64::from(factor.clamp(7, 199).unsigned_abs()).saturating_add(1);
        self.tolerance_ns = steps.saturating_mul(TOLERANCE_STEP_NS);
        self.position_difference = i64::from(position.max(0));
        self.speed_difference = i64::from(speed_rpm.max(0)).saturating_mul(1_000);
    }

    /// Enters what profiles without parameters of their own take from `[common]` (DEC-50).
    pub fn set_common(&mut self, image: &Image<'_>) {
        let factor = image.value(common::CC_FACTOR, 7);
        let position = image.value(common::POSITION_DIFFERENCE, 450);
        self.set_comparison(factor, position, image.value(common::SPEED_DIFFERENCE, 315));
        let slot = image.value(common::ENCODER_B, 1);
        self.encoder.slot = Some(u8::from(slot == 2));
        self.encoder.periods = image.value(common::PERIODS_PER_REVOLUTION, 1024).max(1).unsigned_abs();
    }

    /// Whether a violation is over (DEC-15); its function may start again then (DEC-17).
    pub fn settles(&mut self, entry: &Entry, word: &Word, motion: &Motion, now: u64) -> bool {
        let stop = entry.owner & !STOP;
        let is_stop = entry.owner & STOP != 0;
        let stands = match entry.reaction {
            Reaction::Sto => self.stops.braking() != 0,
            // The end state of this one counts, whatever brakes beside it (ETG-GEN-12).
            Reaction::Stop(place) => self.stops.is_pending(place),
            // No end state ends it: the limit itself must be kept (ETG-ERR-04).
            Reaction::None if is_stop => self.stops.is_violated(stop, now, motion),
            Reaction::None => {
                let requested = plain_requests(&self.bits, word);
                self.bank.is_violated(entry.owner, &requested, now, motion)
            }
        };
        if stands {
            return false;
        }
        if is_stop {
            self.stops.release(stop);
        } else {
            self.bank.release(entry.owner);
        }
        true
    }

    /// The input lines the profile evaluates.
    pub fn inputs(&self) -> Inputs {
        let (pairs, has_others) = match self.profile {
            Profile::AmkKw => (3, false),
            Profile::LenzeSm301 => (PAIRS, true),
            _ => (0, false),
        };
        Inputs::new(self.lines, pairs, has_others)
    }

    /// What travels on the black channel.
    pub fn telegram(&self) -> Telegram {
        Telegram::new(self.profile, self.words, self.bits.either, self.position_difference)
    }

    /// Limits of the comparison for a cycle of `cycle_ns`.
    pub fn limits(&self, cycle_ns: u64) -> Limits {
        let mark = |word: Word, bit: u8| if bit == NO_BIT { word } else { word.with(bit, true) };
        let [mut sto, mut ss1, mut ss2] = [Word::ZERO; 3];
        sto = mark(sto, self.bits.sto_active);
        for (_, stop) in self.stops.all() {
            let word = if stop.end == End::Sto { &mut ss1 } else { &mut ss2 };
            *word = mark(*word, stop.spec.status);
        }
        let stop_bits = [sto, ss1, ss2];
        let tolerance = self.tolerance_ns.checked_div(cycle_ns).unwrap_or(0);
        let has_error_bit = self.bits.error != NO_BIT;
        let error_bit = if has_error_bit { Word::ZERO.with(self.bits.error, true) } else { Word::ZERO };
        let named = |at: usize| self.logic.internal(ErrorCode::amk(3606, 13, at as u32 + 1, 0));
        Limits {
            position: self.position_difference,
            speed: self.speed_difference,
            tolerance,
            stop_bits,
            error_bit,
            own_codes: core::array::from_fn(named),
        }
    }
}

impl Logic {
    /// Functions requested in this cycle, 1 = requested.
    pub fn requests(&mut self, bits: &Bits, asked: &Asked<'_>, bank: &Bank, ledger: &mut Ledger) -> Word {
        match self {
            Self::Amk(logic) => logic.requests(bits, asked),
            Self::Lenze(logic) => logic.requests(asked, bank, ledger),
            Self::Atv(logic) => logic.requests(asked, ledger),
            Self::Etg(_) | Self::None => plain_requests(bits, asked.word),
        }
    }

    /// Levels that leave in the report: only of what the profile evaluates.
    pub const fn shown_inputs(&self, levels: u32) -> u32 {
        match self {
            Self::Amk(_) => levels & amk::PAIRS_USED,
            Self::Lenze(logic) => logic.levels_on() | levels & lenze::TERMINALS,
            Self::Etg(_) | Self::Atv(_) | Self::None => 0,
        }
    }

    /// Requests that monitoring adds once the stops of this cycle have begun: like a violation
    /// they abort what has begun in the same cycle.
    pub fn settle(&self, requested: &Word) -> Option<Word> {
        match self {
            Self::Atv(logic) => logic.settle(requested),
            _ => None,
        }
    }

    /// What a violation is called.
    pub fn code(&self, spec: &Spec, breach: Breach, _phase: Phase, reaction: Reaction) -> ErrorCode {
        match self {
            Self::Amk(_) => amk::code(spec, breach, reaction),
            Self::Etg(_) => etg::code(spec, breach),
            Self::Lenze(_) => lenze_messages::code(spec, breach),
            Self::Atv(_) => atv::code(spec, breach),
            Self::None => ErrorCode::single(1),
        }
    }

    /// Own lines of the safe outputs that do not follow, bit n for output n + 1.
    pub fn watch_outputs(&mut self, wrong: u8, ledger: &mut Ledger) {
        match self {
            Self::Amk(_) if wrong != 0 => amk::watch_outputs(wrong, ledger),
            Self::Lenze(logic) => logic.watch_outputs(wrong, ledger),
            _ => {}
        }
    }

    /// What the profile says about its black channel. Torque is off by the zeros that its
    /// control word reads then (DEC-18); some profiles want an acknowledge besides.
    pub fn watch_bus(&self, events: &Events, ledger: &mut Ledger) {
        match self {
            Self::Amk(_) => amk::watch_bus(events, ledger),
            Self::Lenze(_) => lenze_messages::watch_bus(events, ledger),
            Self::Atv(_) => atv::watch_bus(events, ledger),
            // ETG-ERR-03 names no error of the communication.
            Self::Etg(_) | Self::None => {}
        }
        if events.is_damaged {
            let code = self.internal(ErrorCode::amk(3606, 70, 4, 5));
            ledger.raise(Entry::sto(code, Cause::Live));
        }
    }

    /// The profile compares the own movement with the drive's own position.
    pub const fn watches_drive(&self) -> bool {
        matches!(self, Self::Lenze(_) | Self::Atv(_))
    }

    /// The own movement and the drive's own position contradict each other.
    pub fn watch_drive(&self, found: &Contradiction, ledger: &mut Ledger) {
        match self {
            Self::Lenze(logic) => logic.watch_drive(found, ledger),
            Self::Atv(logic) => logic.watch_drive(found, ledger),
            _ => {}
        }
    }

    /// The profile's name for an internal fault that AMK numbers as `code`.
    pub const fn internal(&self, code: ErrorCode) -> ErrorCode {
        match self {
            Self::Amk(_) | Self::None => code,
            Self::Etg(_) => etg::internal(code),
            Self::Lenze(_) => lenze_messages::internal(code),
            Self::Atv(_) => atv::internal(code),
        }
    }

    /// Acknowledge terminals: restart and error edge (DEC-15).
    pub fn terminals(&mut self, asked: &Asked<'_>) -> (bool, bool) {
        let Self::Lenze(logic) = self else { return (false, false) };
        if asked.are_lines_read {
            return logic.terminals(asked);
        }
        logic.forget_terminals();
        (false, false)
    }

    /// A stop waits for a restart acknowledge whatever the set says (LNZ-OMS-13).
    pub const fn waits_for_restart(&self) -> bool {
        match self {
            Self::Lenze(logic) => logic.waits_for_restart(),
            _ => false,
        }
    }

    /// A restart acknowledge counts in this cycle: it has come, or the time since it is over.
    pub fn restarts(&mut self, edge: bool, is_awaited: bool, now: u64) -> bool {
        match self {
            Self::Lenze(logic) => logic.restarts(edge, is_awaited, now),
            _ => edge & is_awaited,
        }
    }

    /// A simple stop is cancelled in this cycle (LNZ-OMS-14).
    pub const fn completes_stops(&self) -> bool {
        match self {
            Self::Lenze(logic) => logic.completes_stops(),
            _ => false,
        }
    }

    /// Status bits a profile adds to those of the engine.
    pub fn show(
        &self,
        word: &mut Word,
        requested: &Word,
        motion: &Motion,
        stops: &Stops,
        now: u64,
        bank: &Bank,
    ) {
        match self {
            Self::Lenze(logic) => logic.show(word, requested, stops, bank),
            Self::Etg(logic) => logic.show(word, requested, motion, stops, now),
            Self::Atv(logic) => logic.show(word, stops, bank),
            Self::Amk(_) | Self::None => {}
        }
    }

    /// With nothing asked for and nothing changed, nothing of the profile's own is under way that
    /// motion or time could end, but for what [`Logic::pass`] does.
    pub fn rests(&self) -> bool {
        match self {
            Self::Amk(_) => true,
            Self::Etg(logic) => logic.rests(),
            Self::Lenze(logic) => logic.rests(),
            Self::Atv(logic) => logic.rests(),
            Self::None => false,
        }
    }

    /// Time passes in a cycle without a decision (AMK: SEM).
    pub fn pass(&mut self, motion: &Motion, now: u64, ledger: &mut Ledger) {
        if let Self::Amk(logic) = self {
            logic.pass(motion, now, ledger);
        }
    }

    /// Supervision a profile has beside the functions (AMK: SEM).
    pub fn watch(&mut self, asked: &Asked<'_>, requested: &Word, in_sto: bool, ledger: &mut Ledger) {
        match self {
            Self::Amk(logic) => logic.pass(asked.motion, asked.now, ledger),
            Self::Etg(logic) => logic.watch(asked, requested, in_sto, ledger),
            Self::Lenze(logic) => logic.watch(asked, in_sto, ledger),
            Self::Atv(logic) => logic.watch(ledger),
            Self::None => {}
        }
    }
}

/// Sets a bit, where the profile has it.
#[inline]
pub fn raise(word: &mut Word, bit: u8, is_set: bool) {
    let part = word.0.get_mut(usize::from(bit >> 5));
    if let Some(part) = part.filter(|_| (bit != NO_BIT) & is_set) {
        *part |= 1 << (bit & 31);
    }
}

/// Requests straight from the control word.
pub fn plain_requests(bits: &Bits, word: &Word) -> Word {
    let mut parts = [0; 8];
    let masks = bits.low.0.iter().zip(bits.high.0);
    for ((part, given), (low, high)) in parts.iter_mut().zip(word.0).zip(masks) {
        *part = (!given & low) | (given & high);
    }
    Word(parts)
}

/// Every plausibility rule this channel is responsible for, told to `report` with the code
/// of its row. An image that cannot be read at all is reported as such.
pub fn findings(image: &[u8], report: &mut dyn FnMut(ErrorCode)) {
    match Image::open(image) {
        Ok(image) => judge(&image, report),
        Err(flaw) => report(image_code(flaw)),
    }
}

/// The rules of the image's profile.
pub fn judge(image: &Image<'_>, report: &mut dyn FnMut(ErrorCode)) {
    match image.profile {
        Profile::AmkKw => amk_rules::findings(
            &|number| i64::from(amk::parameter(image, number)),
            &|number| image.find(number).map(i64::from),
            report,
        ),
        Profile::Etg61002 => etg_rules::findings(image, report),
        Profile::LenzeSm301 => lenze_rules::findings(image, report),
        Profile::Atv340 => atv_rules::findings(image, report),
        Profile::None => report(ErrorCode::amk(3609, 128, 6, 56)),
    }
}

/// 3609/128: the current set is invalid, found by channel 2 at start (Info3 56).
const fn image_code(flaw: Flaw) -> ErrorCode {
    let info2 = match flaw {
        Flaw::Form | Flaw::Version => 6,
        Flaw::CheckSum | Flaw::Order => 4,
        Flaw::Signature => 9,
    };
    ErrorCode::amk(3609, 128, info2, 56)
}
