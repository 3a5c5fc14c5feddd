//! What crosscheck itself finds wrong, as a set, and the code each finding has in each profile.
//!
//! The profiles other than AMK have no code for a fault between the channels; they get the
//! nearest of their catalogue (Lenze 1 "internal error, STO active", 93 disconnecting path,
//! 212 and 213 speed comparison and synchronisation; ATV SME02C frequency deviation,
//! SME032 configuration, SME0D4 STO circuit). ETG.6100.2 leaves codes to the maker
//! (ETG-ERR-03): 0xFF00 plus Info2 of the AMK row.

use shm_schema::error::{ErrorCode, ErrorList};
use shm_schema::profile::Profile;

/// A finding of crosscheck's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// A channel's report has not advanced for three cycles, or they do not pair (DEC-23);
    /// also cycle overruns in a row, crosscheck's or a channel's.
    PartnerLost,
    /// One channel alone in STO beyond tcc (DEC-22).
    StoAlone,
    /// One channel alone in SS1 beyond tcc (DEC-21).
    Ss1Alone,
    /// One channel alone in SS2 beyond tcc (DEC-21).
    Ss2Alone,
    /// Positions differ by more than the limit (AMK-PRM-01).
    Position,
    /// Speeds differ by more than the limit (AMK-PRM-03).
    Speed,
    /// Any other item of DEC-21 differs beyond tcc.
    State,
    /// Parameter signature, build or program flow is not the one expected (DEC-22).
    Identity,
    /// Path A reads on although it is not driven.
    PathAStuck,
    /// Path A reads off although it is driven.
    PathADead,
    /// Path B reads on although it is not driven.
    PathBStuck,
    /// Path B reads off although it is driven.
    PathBDead,
    /// Channel A's clock (DEC-26).
    ClockA,
    /// Channel B's clock (DEC-26).
    ClockB,
    /// The producer's rate or crosscheck's own clock (DEC-26).
    ClockWitness,
    /// The safety image is refused, or its cc_factor is (DEC-20).
    Parameter,
    /// No dynamic test of path A for an hour (AMK-PATH-03).
    DormantA,
    /// No dynamic test of path B for an hour (AMK-PATH-03).
    DormantB,
}

/// What ends a finding (DEC-15).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Class {
    /// An acknowledge edge, once the cause is gone.
    Acknowledge,
    /// A restart of the set.
    Restart,
    /// As `Acknowledge`; removes no torque (DEC-47).
    Warning,
}

struct Row {
    fault: Fault,
    class: Class,
    amk: ErrorCode,
    lenze: u32,
    atv: u32,
    etg: u32,
}

const fn row(fault: Fault, class: Class, amk: [u32; 3], lenze: u32, atv: u32, etg: u32) -> Row {
    let [code, info1, info2] = amk;
    Row { fault, class, amk: ErrorCode::amk(code, info1, info2, 0), lenze, atv, etg }
}

use Class::{Acknowledge, Restart, Warning};

/// DEC-45 for 3606/13; 3606/75 and 76 Info2 4 short to supply, 5 short to ground;
/// 3607/71 and 72 clock monitoring; 3605/13/9 fault tolerance time.
const ROWS: [Row; 18] = [
    row(Fault::PartnerLost, Acknowledge, [3606, 13, 1], 1, 0x0D4, 0xFF01),
    row(Fault::StoAlone, Acknowledge, [3606, 13, 2], 1, 0x0D4, 0xFF02),
    row(Fault::Ss1Alone, Acknowledge, [3606, 13, 3], 1, 0x0D4, 0xFF03),
    row(Fault::Ss2Alone, Acknowledge, [3606, 13, 4], 1, 0x0D4, 0xFF04),
    row(Fault::Position, Acknowledge, [3606, 13, 5], 1, 0x02C, 0xFF05),
    row(Fault::Speed, Acknowledge, [3606, 13, 6], 212, 0x02C, 0xFF06),
    row(Fault::State, Acknowledge, [3606, 13, 8], 1, 0x0D4, 0xFF08),
    row(Fault::Identity, Restart, [3606, 13, 8], 1, 0x032, 0xFF08),
    row(Fault::PathAStuck, Acknowledge, [3606, 75, 4], 93, 0x0D4, 0xFF11),
    row(Fault::PathADead, Acknowledge, [3606, 75, 5], 93, 0x0D4, 0xFF12),
    row(Fault::PathBStuck, Acknowledge, [3606, 76, 4], 93, 0x0D4, 0xFF13),
    row(Fault::PathBDead, Acknowledge, [3606, 76, 5], 93, 0x0D4, 0xFF14),
    row(Fault::ClockA, Restart, [3607, 71, 2], 213, 0x0D4, 0xFF21),
    row(Fault::ClockB, Restart, [3607, 72, 2], 213, 0x0D4, 0xFF22),
    row(Fault::ClockWitness, Restart, [3607, 71, 1], 213, 0x0D4, 0xFF23),
    row(Fault::Parameter, Restart, [3605, 13, 9], 1, 0x032, 0xFF31),
    row(Fault::DormantA, Warning, [3610, 75, 6], 0, 0, 0),
    row(Fault::DormantB, Warning, [3610, 76, 6], 0, 0, 0),
];

const fn of_class(class: Class) -> FaultSet {
    let mut set = FaultSet::EMPTY;
    let mut at = 0;
    while at < ROWS.len() {
        if ROWS[at].class as u8 == class as u8 {
            set = set.with(ROWS[at].fault);
        }
        at += 1;
    }
    set
}

/// Findings that only a restart of the set ends.
const RESTART: FaultSet = of_class(Restart);
/// Findings that remove no torque.
const WARNINGS: FaultSet = of_class(Warning);

/// A set of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FaultSet(u32);

impl FaultSet {
    /// Nothing found.
    pub const EMPTY: Self = Self(0);

    /// The set with `fault`.
    #[must_use]
    pub const fn with(self, fault: Fault) -> Self {
        Self(self.0 | 1 << (fault as u8))
    }

    /// Adds `fault` if `found`.
    pub const fn add_if(&mut self, found: bool, fault: Fault) {
        if found {
            *self = self.with(fault);
        }
    }

    /// Everything of both.
    #[must_use]
    pub const fn and_also(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether `fault` is in the set.
    pub const fn contains(self, fault: Fault) -> bool {
        self.0 >> (fault as u8) & 1 == 1
    }

    /// Whether anything here removes torque (DEC-47: warnings do not).
    pub const fn removes_torque(self) -> bool {
        self.0 & !WARNINGS.0 != 0
    }

    /// What an acknowledge edge leaves: what still stands and what only a restart ends (DEC-15).
    #[must_use]
    pub const fn acknowledged(self, standing: Self) -> Self {
        Self(self.0 & (standing.0 | RESTART.0))
    }

    /// The codes of the set in `profile`.
    pub fn errors(self, profile: Profile) -> ErrorList {
        let mut list = ErrorList::default();
        if self.0 == 0 {
            return list;
        }
        for row in ROWS.iter().filter(|row| self.contains(row.fault)) {
            let code = row.code(profile);
            if !code.is_none() {
                list.insert(code);
            }
        }
        list
    }
}

impl Row {
    const fn code(&self, profile: Profile) -> ErrorCode {
        match profile {
            // An image that names no profile is reported in the form that says most.
            Profile::AmkKw | Profile::None => self.amk,
            Profile::LenzeSm301 => ErrorCode::single(self.lenze),
            Profile::Atv340 => ErrorCode::single(self.atv),
            Profile::Etg61002 => ErrorCode::single(self.etg),
        }
    }
}
