//! Profiles: each turns the raw parameters into a table of function instances, names
//! what goes wrong, reads its control word and builds its status word (DEC-27).

mod amk;
mod amk_rules;
mod atv;
mod atv_sls;
mod etg;
mod lenze;
mod sem;
mod telegram;

use shm_schema::drive::DriveRequest;
use shm_schema::error::ErrorCode;
use shm_schema::io::Io;
use shm_schema::profile::{Profile, common};
use shm_schema::word::Word;

use crate::bus::BusFault;
use crate::encoder::twin::{Contradiction, Twin};
use crate::encoder::{Fault as EncoderFault, NO_GEAR, Selection};
use crate::engine::Sample;
use crate::engine::stop::{self, Demand, Stops};
use crate::engine::watch::{Plan, Violation};
use crate::engine::watches::Watches;
use crate::errors::{Class, Errors};
use crate::image::{Image, Refusal};
use crate::outputs::{Gaps, LINES};
use crate::partner::{Findings, Tolerance};
use crate::path::PathFault;

pub use sem::Sem;
pub use telegram::Telegram;

/// What a step knows of the outside, already judged: stale is `None`.
#[derive(Debug, Clone, Copy)]
pub struct Outside<'a> {
    /// Own clock, ns.
    pub now_ns: u64,
    /// Control word; `None`: no valid command.
    pub word: Option<Word>,
    /// Level of the drive's non-safe clear command; `None`: no command at all.
    pub clear: Option<bool>,
    /// The drive's power stage is enabled.
    pub drive_enabled: bool,
    /// Safe inputs.
    pub io: Option<&'a Io>,
    /// What the functions judge as speed, 1/1000 rpm.
    pub speed: i64,
    /// These inputs have stood for ever.
    pub settle: bool,
    /// The phase is Operational.
    pub operational: bool,
}

/// What a profile made of it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Requests {
    /// For the stop functions.
    pub demand: Demand,
    /// Bit n: request n of the watches.
    pub watches: u64,
    /// For the report, 1 = requested.
    pub requested: Word,
    /// Debounced levels.
    pub inputs: u32,
    /// Acknowledge levels.
    pub acknowledgements: u32,
    /// An edge that acknowledges errors.
    pub acknowledge: bool,
    /// The next leaving of a stop needs a restart acknowledge.
    pub restart_once: bool,
}

/// What the status word is built from.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    /// Instances.
    pub watches: &'a Watches,
    /// Stop functions.
    pub stops: &'a Stops,
    /// An error stands.
    pub error: bool,
    /// Start-up has passed the self-test.
    pub ready: bool,
    /// Torque is off, whatever the reason.
    pub sto: bool,
    /// What was requested.
    pub requests: &'a Requests,
    /// Motion.
    pub sample: &'a Sample,
    /// An error of the own safe outputs stands.
    pub output_fault: bool,
}

/// What the profile's own judgement sees, behind stops and watches.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// Instances.
    pub watches: &'a Watches,
    /// Stop functions.
    pub stops: &'a Stops,
    /// Motion.
    pub sample: &'a Sample,
    /// What was requested.
    pub requests: &'a Requests,
    /// Motion is monitored: no STO.
    pub monitored: bool,
    /// STO was left in this instant: monitoring begins anew (DEC-14).
    pub restarts: bool,
}

/// What follows from it.
#[derive(Debug, Clone, Copy)]
pub struct Response {
    /// An error.
    pub error: Option<(ErrorCode, Class)>,
    /// A stop.
    pub reaction: stop::Reaction,
}

impl Response {
    /// Nothing.
    pub const NOTHING: Self = Self { error: None, reaction: stop::Reaction::None };
}

/// General faults that every profile names in its own way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The encoder's signals.
    Encoder(EncoderFault),
    /// The drive's own movement.
    Drive(Contradiction),
    /// No believable sample for too long.
    EncoderStale,
    /// No report or agreement for three cycles.
    PartnerLost,
    /// Position of the channels differs.
    Position,
    /// Speed of the channels differs.
    Speed,
    /// Signature, build or program flow of the partner.
    Identity,
    /// A clock runs wrong.
    Clock,
    /// Channel A's path.
    OwnPath(PathFault),
    /// Channel B's path.
    PartnerPath(PathFault),
    /// No test of the path for an hour.
    Dormant,
    /// The image no longer passes its check.
    Image,
    /// Too many cycle overruns in a row.
    Overrun,
}

/// The built program of one axis.
#[derive(Debug, Clone)]
pub struct Program {
    /// Content signature of the image.
    pub signature: u32,
    /// Instances.
    pub watches: Watches,
    /// Stop functions.
    pub stops: Stops,
    /// What the partner may differ by.
    pub tolerance: Tolerance,
    /// Profile.
    pub profile: Profile,
    /// Process data on the black channel.
    pub telegram: Telegram,
    /// Test pulses of the own safe outputs.
    pub gaps: [Gaps; LINES],
    /// The third own line is a supply that is always on.
    pub supplies: bool,
    /// The encoder.
    pub encoder: Selection,
    /// What the drive's own movement is compared for, where the profile has it.
    pub twin: Option<Twin>,
    /// Supervision of standstill, where the profile has it.
    pub sem: Option<Sem>,
    /// The first instance that found no place: it refuses the set.
    pub excess: Option<ErrorCode>,
    /// The profile's own part.
    pub rules: Rules,
}

/// The own part of each profile.
// One program lives for the whole run in a fixed place; there is no allocator.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone)]
pub enum Rules {
    /// Nothing: refused.
    Refused,
    /// AMK KW.
    Amk(amk::Amk),
    /// ETG.6100.2.
    Etg(etg::Etg),
    /// Lenze SM301.
    Lenze(lenze::Lenze),
    /// ATV340.
    Atv(atv::Atv),
}

impl Program {
    /// A program that permits nothing.
    pub fn refused() -> Self {
        Self {
            signature: 0,
            watches: Watches::new(),
            stops: Stops::default(),
            tolerance: Tolerance::default(),
            profile: Profile::None,
            telegram: Telegram::NONE,
            gaps: [Gaps::default(); LINES],
            supplies: false,
            encoder: Selection { kind: None, slot: 1, periods: 1, inverted: false, gear: NO_GEAR },
            twin: None,
            sem: None,
            excess: None,
            rules: Rules::Refused,
        }
    }

    /// Builds the program of `image`.
    pub fn build(image: &Image) -> Self {
        let mut program = Self::refused();
        program.signature = image.signature;
        program.profile = image.profile;
        program.telegram = Telegram::of(image);
        match image.profile {
            Profile::AmkKw => amk::build(image, &mut program),
            Profile::Etg61002 => etg::build(image, &mut program),
            Profile::LenzeSm301 => lenze::build(image, &mut program),
            Profile::Atv340 => atv::build(image, &mut program),
            Profile::None => {}
        }
        program
    }

    /// Adds one instance; one too many refuses the set.
    pub fn add(&mut self, plan: Plan) {
        if !self.watches.add(plan) {
            self.excess.get_or_insert(no_place(u32::from(plan.function)));
        }
    }

    /// Tolerance and encoder from `[common]` (DEC-50).
    pub fn take_common(&mut self, image: &Image) {
        self.tolerance = Tolerance {
            position: image.value(common::POSITION_DIFFERENCE),
            speed: image.value(common::SPEED_DIFFERENCE).saturating_mul(1_000),
            time_ns: tolerance_ns(image.value(common::CC_FACTOR)),
            warnings: 0,
        };
        self.encoder = Selection {
            kind: None,
            slot: image.value(common::ENCODER_A) as u8,
            periods: image.value(common::PERIODS_PER_REVOLUTION),
            inverted: false,
            gear: NO_GEAR,
        };
    }
}

/// DEC-20: (factor + 1) * 15 ms.
pub const fn tolerance_ns(factor: i64) -> u64 {
    (factor.saturating_add(1) as u64).saturating_mul(15_000_000)
}

impl Rules {
    /// Requests of this step; what is wrong with the inputs is raised.
    pub fn requests(
        &mut self,
        outside: &Outside,
        watches: &Watches,
        stops: &Stops,
        errors: &mut Errors,
    ) -> Requests {
        match self {
            Self::Refused => {
                Requests { demand: Demand { sto: true, ..Demand::default() }, ..Requests::default() }
            }
            Self::Amk(amk) => amk.requests(outside, errors),
            Self::Etg(etg) => etg.requests(outside, stops),
            Self::Lenze(lenze) => lenze.requests(outside, watches, stops, errors),
            Self::Atv(atv) => atv.requests(outside, stops, errors),
        }
    }

    /// Status word, without the agreement's influence.
    pub fn status(&self, state: &State) -> Word {
        match self {
            // Bit 0 is STO and bit 7 an error in every profile that has them.
            Self::Refused => Word::from_u32(0x81),
            Self::Amk(_) => amk::Amk::status(state),
            Self::Etg(etg) => etg.status(state),
            Self::Lenze(lenze) => lenze.status(state),
            Self::Atv(atv) => atv.status(state),
        }
    }

    /// What is asked of the drive.
    pub fn drive(&self, state: &State) -> DriveRequest {
        match self {
            Self::Refused => DriveRequest::default(),
            Self::Amk(amk) => amk.drive(state),
            Self::Etg(etg) => etg.drive(state),
            Self::Lenze(lenze) => lenze.drive(state),
            Self::Atv(atv) => atv.drive(state),
        }
    }

    /// Code and class of a violated watch.
    pub fn watch_code(&self, plan: &Plan, violation: Violation) -> (ErrorCode, Class) {
        match self {
            Self::Refused => (ErrorCode::default(), Class::Restart),
            Self::Amk(_) => amk::watch_code(plan, violation),
            Self::Etg(_) => etg::codes::watch_code(plan, violation),
            Self::Lenze(_) => lenze::codes::watch_code(plan, violation),
            Self::Atv(_) => atv::watch_code(violation),
        }
    }

    /// Code and class of a stop that was violated.
    pub fn stop_code(&mut self, violation: stop::Violation) -> (ErrorCode, Class) {
        match self {
            Self::Refused => (ErrorCode::default(), Class::Restart),
            Self::Amk(_) => amk::stop_code(violation),
            Self::Etg(_) => etg::codes::stop_code(violation),
            Self::Lenze(_) => lenze::codes::stop_code(violation),
            Self::Atv(atv) => atv.stop_code(),
        }
    }

    /// Code and class of a general fault.
    pub fn fault_code(&self, fault: Fault) -> (ErrorCode, Class) {
        match self {
            Self::Refused => (ErrorCode::default(), Class::Restart),
            Self::Amk(amk) => amk.fault_code(fault),
            Self::Etg(_) => etg::codes::fault_code(fault),
            Self::Lenze(lenze) => lenze.fault_code(fault),
            Self::Atv(atv) => atv.fault_code(fault),
        }
    }

    /// Code and class of a disturbed black channel. ETG has none, and in Lenze it is no error
    /// state (LNZ-BUS-14): the zeros that the functions then see are all that follows.
    pub const fn bus_code(&self, fault: BusFault) -> Option<(ErrorCode, Class)> {
        match (self, fault) {
            // AMK-FSOE-06: Info2 6 the watchdog, Info3 3 channel 1; FSoE has no other row.
            (Self::Amk(_), _) => Some((ErrorCode::amk(3606, 70, 6, 3), Class::Cause)),
            // ATV-PSF-17
            (Self::Atv(_), BusFault::Integrity) => Some((ErrorCode::single(0x147), Class::Cause)),
            (Self::Atv(_), BusFault::Watchdog) => Some((ErrorCode::single(0x153), Class::Cause)),
            _ => None,
        }
    }

    /// Code and class of an own safe output that does not follow, by its number from 0.
    pub const fn output_code(&self, line: u8) -> Option<(ErrorCode, Class)> {
        match self {
            // 3606/27: channel 1, Info3 the number of the output.
            Self::Amk(_) => Some((ErrorCode::amk(3606, 27, 1, line as u32 + 1), Class::Cause)),
            Self::Lenze(lenze) => Some(lenze.output_code()),
            _ => None,
        }
    }

    /// Codes for what differed from the partner for too long (DEC-45).
    pub fn difference_codes(&self, found: &Findings, raise: &mut dyn FnMut(ErrorCode, Class)) {
        match self {
            Self::Refused => {}
            Self::Amk(_) => amk::difference_codes(found, raise),
            Self::Etg(_) => etg::codes::difference_codes(found, raise),
            Self::Lenze(_) => lenze::codes::difference_codes(found, raise),
            Self::Atv(_) => atv::difference_codes(found, raise),
        }
    }

    /// What the profile makes of the measured motion.
    pub fn sample(&self, sample: Sample, drive_n0: bool) -> Sample {
        match self {
            Self::Lenze(lenze) => lenze.sample(sample, drive_n0),
            Self::Atv(atv) => atv.sample(sample),
            _ => sample,
        }
    }

    /// What only the profile judges.
    pub fn respond(&mut self, scene: &Scene) -> Response {
        match self {
            Self::Lenze(lenze) => lenze.respond(scene),
            Self::Atv(atv) => atv.respond(scene),
            _ => Response::NOTHING,
        }
    }
}

/// Every plausibility rule this channel is responsible for, broken by `image`. An image
/// that cannot be read breaks one rule.
pub fn findings(image: &[u8], report: &mut dyn FnMut(ErrorCode)) {
    match Image::parse(image) {
        Ok(image) => {
            load(&image, report);
        }
        Err(refusal) => report(refusal_code(refusal)),
    }
}

/// 3609/128: the current set is invalid; Info3 55: check at start, channel 1.
pub const fn refusal_code(refusal: Refusal) -> ErrorCode {
    ErrorCode::amk(3609, 128, refusal as u32, 55)
}

/// 3605 with function and instance: more of them than one axis can have.
pub const fn no_place(reference: u32) -> ErrorCode {
    ErrorCode::amk(3605, reference >> 8, reference & 0xFF, 0)
}

/// The program of `image`, and every rule it breaks.
pub fn load(image: &Image, report: &mut dyn FnMut(ErrorCode)) -> Program {
    rules(image, report);
    let program = Program::build(image);
    program.excess.into_iter().for_each(report);
    program
}

/// The rules of the image's profile.
fn rules(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    match image.profile {
        Profile::AmkKw => amk_rules::findings(image, report),
        Profile::Etg61002 => etg::findings(image, report),
        Profile::LenzeSm301 => lenze::findings(image, report),
        Profile::Atv340 => atv::findings(image, report),
        Profile::None => report(refusal_code(Refusal::Unfit)),
    }
}

/// Code, class and reaction of SEM; only AMK has it.
pub const fn sem_code(notice: sem::Notice) -> (ErrorCode, Class, stop::Reaction) {
    match notice {
        sem::Notice::Warning => (amk::SEM_WARNING, Class::Warning, stop::Reaction::None),
        sem::Notice::Error => (amk::SEM_ERROR, Class::Limit, amk::SEM_REACTION),
    }
}

/// A rising level counts only after a low one of the same connection (DEC-16).
pub(crate) fn edge(armed: &mut bool, level: Option<bool>) -> bool {
    let rises = *armed & (level == Some(true));
    *armed = level == Some(false);
    rises
}

/// The common parameters lie in their ranges (DEC-20, DEC-50); a factor out of range is
/// 3605/13/9 in every profile.
pub fn common_findings(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    for row in &shm_schema::facts::common::PARAMETERS {
        if !(row.min..=row.max).contains(&image.value(row.key)) {
            let factor = row.key == common::CC_FACTOR;
            report(if factor { ErrorCode::amk(3605, 13, 9, 0) } else { ErrorCode::amk(3605, 0, row.key, 0) });
        }
    }
}
