//! What is known about a profile when two channels are compared and combined.

use std::collections::BTreeMap;

use shm_schema::profile::{Profile, common};
use shm_schema::word::Word;

use crate::model::StopState;

/// What crosscheck knows about a profile.
#[derive(Debug, Clone)]
pub struct Rules {
    /// Fault tolerance time, ms (DEC-20).
    pub tcc: i64,
    /// Status bits combined by OR: errors and moving bits (DEC-25).
    pub combined_by_or: Word,
    /// The status bit that shows STO.
    pub sto_bit: u8,
    /// The status bit that shows errors.
    pub error_bit: u8,
    /// Status bits that are 0 in STO (DEC-14).
    pub cleared_in_sto: Word,
    /// Status bits that show a stop, which is an item of its own.
    pub stop_bits: &'static [u8],
    /// Code of a lasting difference, by the stop one channel is alone in.
    pub code: fn(StopState) -> [u32; 4],
}

/// A word with the given bits set.
pub fn word_of(bits: &[u8]) -> Word {
    bits.iter().fold(Word::ZERO, |word, bit| word.with(*bit, true))
}

/// DEC-45: 2, 3, 4 one channel alone in STO, SS1, SS2; 8 any other item.
fn info2(alone_in: StopState) -> u32 {
    match alone_in {
        StopState::Sto => 2,
        StopState::Ss1 => 3,
        StopState::Ss2 => 4,
        _ => 8,
    }
}

fn amk_code(alone_in: StopState) -> [u32; 4] {
    [3606, 13, info2(alone_in), 0]
}

/// ETG-ERR-03 leaves codes to the maker.
fn etg_code(alone_in: StopState) -> [u32; 4] {
    [0xFF00 + info2(alone_in), 0, 0, 0]
}

/// "Internal error, STO active", the nearest of the catalogue.
fn lenze_code(_: StopState) -> [u32; 4] {
    [1, 0, 0, 0]
}

/// SME0D4, the nearest of the catalogue.
fn atv_code(_: StopState) -> [u32; 4] {
    [0x0D4, 0, 0, 0]
}

/// One row for each profile: bits by OR, STO bit, error bit, bits cleared in STO, codes.
struct Row(&'static [u8], u8, u8, &'static [u8], fn(StopState) -> [u32; 4]);

fn row_of(profile: Profile) -> Row {
    use shm_schema::facts::{amk_kw, atv340, etg_6100_2, lenze_sm301};
    match profile {
        // AMK-FSOE-10: what monitors or brakes.
        Profile::AmkKw => {
            use amk_kw::status as s;
            Row(&[s::ERROR], s::STO, s::ERROR, &[3, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 26, 27], amk_code)
        }
        // DEC-41: SDI bits say "moving"; SSM, SCA, brake and moving bits go on (DEC-14).
        Profile::Etg61002 => {
            use etg_6100_2::status as s;
            let monitors = &[3, 4, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 24, 25, 26, 27, 28, 29, 30, 31];
            let by_or = &[s::ERROR, s::SDIP, s::SDIN, s::RESTART_ACKNOWLEDGE_REQUEST];
            Row(by_or, s::STO, s::ERROR, monitors, etg_code)
        }
        Profile::LenzeSm301 => {
            use lenze_sm301::status as s;
            Row(&[s::ERROR_ACTIVE], s::STO_ACTIVE, s::ERROR_ACTIVE, LENZE_MONITORS, lenze_code)
        }
        Profile::Atv340 => {
            use atv340::status as s;
            let monitors = &[s::SS1, s::SLS, s::SMS, s::SMS_THRESHOLD_2];
            Row(&[s::SAFETY_ERROR, s::RESTART_REQUIRED], s::STO, s::SAFETY_ERROR, monitors, atv_code)
        }
        Profile::None => panic!("no model without a profile"),
    }
}

/// Bits of STO, SS1 and SS2 in the status word.
fn stop_bits_of(profile: Profile) -> &'static [u8] {
    use shm_schema::facts::{amk_kw, atv340, lenze_sm301};
    match profile {
        Profile::AmkKw => &[amk_kw::status::STO, amk_kw::status::SS1_ACTIVE, amk_kw::status::SS2_ACTIVE],
        Profile::LenzeSm301 => {
            use lenze_sm301::status as s;
            &[s::STO_ACTIVE, s::SS1_ACTIVE, s::SS2_ACTIVE]
        }
        Profile::Atv340 => &[atv340::status::STO, atv340::status::SS1],
        _ => &[0],
    }
}

/// DEC-42: what is active or monitored.
const LENZE_MONITORS: &[u8] = {
    use shm_schema::facts::lenze_sm301::status as s;
    &[
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
    ]
};

impl Rules {
    /// The rules of a profile.
    ///
    /// # Panics
    /// On [`Profile::None`].
    pub fn of(profile: Profile, parameters: &BTreeMap<u32, i32>) -> Self {
        let factor_key = if profile == Profile::AmkKw { 105 } else { common::CC_FACTOR };
        let factor = i64::from(parameters.get(&factor_key).copied().unwrap_or(7));
        let Row(by_or, sto_bit, error_bit, cleared, code) = row_of(profile);
        Self {
            tcc: (factor + 1) * 15,
            combined_by_or: word_of(by_or),
            sto_bit,
            error_bit,
            cleared_in_sto: word_of(cleared),
            stop_bits: stop_bits_of(profile),
            code,
        }
    }
}
