//! Profiles (DEC-27) and the keys of their parameters in the safety image.
//!
//! | profile | key | raw value |
//! |---|---|---|
//! | AMK | parameter number: `Prm67` is 67; `ID33203` is 33203 | the integer of the file |
//! | Lenze | code * 256 + subcode: `C15330/1` is `15330 << 8 \| 1`; without subcode 0 | the integer |
//! | ATV | SC number: `SC57` is 57 | decimals in tenths (50.0 Hz is 500); words as their place in the catalogue's list, from 0 |
//! | ETG | function << 16 \| instance << 8 \| object, numbers of [`crate::facts::etg`]; no suffix is instance 1 | the integer; references as [`reference`] |
//! | all | [`common`] | the integer; encoder slots 1 and 2 |

use crate::enumeration;

enumeration! {
    /// The four profiles.
    pub enum Profile {
        /// None: nothing is permitted.
        #[default]
        None = 0,
        /// `amk-kw`
        AmkKw = 1,
        /// `lenze-sm301`
        LenzeSm301 = 2,
        /// `atv340`
        Atv340 = 3,
        /// `etg-6100-2`
        Etg61002 = 4,
    }
}

impl Profile {
    /// The name a parameter file uses.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::AmkKw => "amk-kw",
            Self::LenzeSm301 => "lenze-sm301",
            Self::Atv340 => "atv340",
            Self::Etg61002 => "etg-6100-2",
        }
    }

    /// Octets of control and status word in replay by default (DEC-41 to DEC-43).
    pub const fn word_octets(self) -> usize {
        match self {
            Self::Atv340 => 2,
            _ => 4,
        }
    }

    /// Control word with nothing requested and no acknowledge (DEC-41 to DEC-43).
    pub const fn neutral_word(self) -> u32 {
        match self {
            Self::None => 0,
            Self::AmkKw => 0x0000_7E7F,
            Self::LenzeSm301 => 0x0180_01FF,
            Self::Atv340 => 0x0001,
            Self::Etg61002 => 0x0F7F_FF7F,
        }
    }
}

/// Keys of the parameters common to profiles that have none of their own (DEC-40, DEC-50).
pub mod common {
    /// `cc_factor`, 7 to 199 (DEC-20).
    pub const CC_FACTOR: u32 = 0xFFFF_0001;
    /// `position_difference`, increments.
    pub const POSITION_DIFFERENCE: u32 = 0xFFFF_0002;
    /// `speed_difference`, rpm.
    pub const SPEED_DIFFERENCE: u32 = 0xFFFF_0003;
    /// `encoder_a`: slot 1 or 2.
    pub const ENCODER_A: u32 = 0xFFFF_0004;
    /// `encoder_b`: slot 1 or 2.
    pub const ENCODER_B: u32 = 0xFFFF_0005;
    /// `periods_per_revolution`.
    pub const PERIODS_PER_REVOLUTION: u32 = 0xFFFF_0006;
    /// `[words]` `control.N = "SLS_5"`: this plus N; the value is a [`super::reference`].
    pub const CONTROL_WORD: u32 = 0xFFFE_0000;
    /// `[words]` `status.N = "SLS_5"`: this plus N.
    pub const STATUS_WORD: u32 = 0xFFFE_1000;
}

/// Key of an ETG object.
pub const fn etg_key(function: u32, instance: u32, object: u32) -> u32 {
    function << 16 | instance << 8 | object
}

/// A reference to a function instance as parameter value (error reactions, activation of
/// SBC, word assignments): function << 8 | instance; 0 is none.
pub const fn reference(function: u32, instance: u32) -> i32 {
    (function << 8 | instance) as i32
}

/// Key of a Lenze code.
pub const fn lenze_key(code: u32, subcode: u32) -> u32 {
    code << 8 | subcode
}
