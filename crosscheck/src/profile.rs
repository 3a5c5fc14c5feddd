//! Which bits of a profile's status word combine how, and what STO clears (DEC-14, DEC-25).

use shm_schema::facts::{amk_kw, atv340, etg, etg_6100_2, lenze_sm301};
use shm_schema::profile::Profile;
use shm_schema::word::Word;

/// The rules of one profile's status word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StatusRules {
    /// Bits combined by OR: errors, movements, requests to the operator. All others by AND.
    pub either: Word,
    /// Acknowledgement bits of functions that are not evaluated in STO (DEC-14).
    pub silent_in_sto: Word,
    /// STO active, alone.
    pub sto: Word,
    /// SS1 active, where the profile shows it.
    pub ss1: Word,
    /// SS2 active, where the profile shows it.
    pub ss2: Word,
    /// The error bit.
    pub error: Word,
}

const fn bits(of: &[u8]) -> Word {
    let mut word = Word::ZERO;
    let mut at = 0;
    while at < of.len() {
        word = word.with(of[at], true);
        at += 1;
    }
    word
}

const NONE: StatusRules = StatusRules {
    either: Word::ZERO,
    silent_in_sto: Word([u32::MAX; 8]),
    sto: Word::ZERO,
    ss1: Word::ZERO,
    ss2: Word::ZERO,
    error: Word::ZERO,
};

/// AMK-FSOE-10.
const AMK: StatusRules = {
    use amk_kw::status as s;
    StatusRules {
        either: bits(&[s::ERROR]),
        silent_in_sto: bits(&[
            s::SOS,
            s::SSR1,
            s::SSR2,
            s::SSR3,
            s::SSR4,
            s::SDIP,
            s::SDIN,
            s::SMS,
            s::SLS1,
            s::SLS2,
            s::SLI,
            s::SS1_ACTIVE,
            s::SS2_ACTIVE,
        ]),
        sto: bits(&[s::STO]),
        ss1: bits(&[s::SS1_ACTIVE]),
        ss2: bits(&[s::SS2_ACTIVE]),
        error: bits(&[s::ERROR]),
    }
};

/// DEC-42; ES and OMS active are permissions of special operation, so AND.
const LENZE: StatusRules = {
    use lenze_sm301::status as s;
    StatusRules {
        either: bits(&[s::ERROR_ACTIVE]),
        silent_in_sto: bits(&[
            s::SS1_ACTIVE,
            s::SS2_ACTIVE,
            s::SLS1_ACTIVE,
            s::SLS2_ACTIVE,
            s::SLS3_ACTIVE,
            s::SLS4_ACTIVE,
            s::SDIPOS_ACTIVE,
            s::SDINEG_ACTIVE,
            s::SLI_ACTIVE,
            s::SOS_MONITORED,
            s::SLS1_MONITORED,
            s::SLS2_MONITORED,
            s::SLS3_MONITORED,
            s::SLS4_MONITORED,
            s::SDIPOS_MONITORED,
            s::SDINEG_MONITORED,
        ]),
        sto: bits(&[s::STO_ACTIVE]),
        ss1: bits(&[s::SS1_ACTIVE]),
        ss2: bits(&[s::SS2_ACTIVE]),
        error: bits(&[s::ERROR_ACTIVE]),
    }
};

/// DEC-43.
const ATV: StatusRules = {
    use atv340::status as s;
    StatusRules {
        either: bits(&[s::SAFETY_ERROR, s::RESTART_REQUIRED]),
        silent_in_sto: bits(&[s::SS1, s::SLS, s::SMS, s::SMS_THRESHOLD_2]),
        sto: bits(&[s::STO]),
        ss1: bits(&[s::SS1]),
        ss2: Word::ZERO,
        error: bits(&[s::SAFETY_ERROR]),
    }
};

/// DEC-41; `SDIP` and `SDIN` say "moving" here, so OR; `SBC_1` says "brake open", so AND.
const ETG: StatusRules = {
    use etg_6100_2::status as s;
    StatusRules {
        either: bits(&[s::ERROR, s::SDIP, s::SDIN, s::RESTART_ACKNOWLEDGE_REQUEST]),
        silent_in_sto: bits(&[
            s::SOS_1,
            s::SOS_2,
            s::SSR_1,
            s::SSR_2,
            s::SSR_3,
            s::SSR_4,
            s::SLS_1,
            s::SLS_2,
            s::SLS_3,
            s::SLS_4,
            s::SLP_1,
            s::SLP_2,
            s::SLI_1,
            s::SLI_2,
            s::SLT_1,
            s::SLT_2,
            s::SAR_1,
            s::SAR_2,
            s::SMS,
            s::SMA,
        ]),
        sto: bits(&[s::STO]),
        ss1: Word::ZERO,
        ss2: Word::ZERO,
        error: bits(&[s::ERROR]),
    }
};

impl StatusRules {
    /// The rules of `profile`.
    pub const fn of(profile: Profile) -> Self {
        match profile {
            Profile::None => NONE,
            Profile::AmkKw => AMK,
            Profile::LenzeSm301 => LENZE,
            Profile::Atv340 => ATV,
            Profile::Etg61002 => ETG,
        }
    }

    /// Takes over an assignment of `[words]`: status bit `bit` shows `reference` (DEC-41).
    /// SSM and SCA go on in STO (DEC-14); every other function's bit is silent there.
    pub const fn assign(&mut self, bit: u8, reference: i32) {
        let function = (reference as u32) >> 8;
        let goes_on = matches!(function, etg::SSM | etg::SCA | etg::SBC | etg::STO | etg::SS1 | etg::SS2);
        self.silent_in_sto = self.silent_in_sto.with(bit, !goes_on);
        self.either = self.either.with(bit, function == etg::SDI);
    }
}
