//! Words and codes of a profile as replay shows them.

use std::fmt::Write as _;

use std::collections::BTreeMap;

use params::AxisSet;
use shm_schema::error::ErrorCode;
use shm_schema::facts::{amk_kw, atv340, etg, etg_6100_2, lenze_sm301};
use shm_schema::profile::{Profile, common};
use shm_schema::word::Word;

/// Shape of the words of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Words {
    /// Profile.
    pub profile: Profile,
    /// Octets of the status word that are shown.
    pub status_octets: usize,
    /// Control word with nothing requested and no acknowledge.
    pub neutral: Word,
}

impl Words {
    /// The words of a parameter set, with what its `[words]` add (DEC-41).
    pub fn of(set: &AxisSet) -> Self {
        let assigned = |base: u32| {
            let bits = set.values.range(base..base + 256).filter(|(_, function)| **function != 0);
            bits.map(move |(key, _)| (key - base) as u8)
        };
        let last_status = assigned(common::STATUS_WORD).max().unwrap_or(0);
        let neutral = Word::from_u32(set.profile.neutral_word());
        // Requests are low-active: a function that the file assigned is not requested.
        let requests = assigned(common::CONTROL_WORD).filter(|bit| *bit > 31);
        Self {
            profile: set.profile,
            status_octets: set.profile.word_octets().max(usize::from(last_status) / 8 + 1),
            neutral: requests.fold(neutral, |word, bit| word.with(bit, true)),
        }
    }

    /// Appends a status word as one hexadecimal number.
    pub fn write_status(&self, out: &mut String, status: &Word) {
        out.push_str("0x");
        for octet in (0..self.status_octets).rev() {
            write_hex(out, status.octet(octet as u8));
        }
    }
}

fn write_hex(out: &mut String, octet: u8) {
    const DIGITS: [char; 16] =
        ['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'A', 'B', 'C', 'D', 'E', 'F'];
    out.push(DIGITS[usize::from(octet >> 4)]);
    out.push(DIGITS[usize::from(octet & 15)]);
}

/// Name and number of the bits of one word.
pub type Bits = BTreeMap<String, u8>;

/// Control bits of a parameter set by their names, with what its `[words]` add (DEC-41).
pub fn control_bits(set: &AxisSet) -> Bits {
    let own = match set.profile {
        Profile::None => &[],
        Profile::AmkKw => amk_kw::control::BITS,
        Profile::LenzeSm301 => lenze_sm301::control::BITS,
        Profile::Atv340 => atv340::control::BITS,
        Profile::Etg61002 => etg_6100_2::control::BITS,
    };
    named(own, set, common::CONTROL_WORD)
}

/// Status bits of a parameter set by their names, with what its `[words]` add (DEC-41).
pub fn status_bits(set: &AxisSet) -> Bits {
    let own = match set.profile {
        Profile::None => &[],
        Profile::AmkKw => amk_kw::status::BITS,
        Profile::LenzeSm301 => lenze_sm301::status::BITS,
        Profile::Atv340 => atv340::status::BITS,
        Profile::Etg61002 => etg_6100_2::status::BITS,
    };
    named(own, set, common::STATUS_WORD)
}

fn named(own: &[(&str, u8)], set: &AxisSet, base: u32) -> Bits {
    let own = own.iter().map(|(name, bit)| ((*name).to_owned(), *bit));
    let assigned = set.values.range(base..base + 256).filter(|(_, reference)| **reference != 0);
    let assigned = assigned.map(|(key, reference)| (instance(*reference), (key - base) as u8));
    own.chain(assigned).collect()
}

/// A function instance as a parameter file names it.
fn instance(reference: i32) -> String {
    let (function, number) = (reference as u32 >> 8, reference & 255);
    let name = etg::FUNCTIONS.iter().find(|(_, known)| *known == function).map_or("?", |(name, _)| name);
    format!("{name}_{number}")
}

/// Appends a code as its profile writes it: AMK `code/info1/info2/info3`, ATV `SME0A9`
/// (DEC-43), the others their number. An AMK code of crosscheck's own under another profile
/// keeps its form, so that it cannot be mistaken for one of that profile.
pub fn code_text(out: &mut String, profile: Profile, code: &ErrorCode) {
    let ErrorCode { code: number, info1, info2, info3 } = code;
    let detailed = (*info1, *info2, *info3) != (0, 0, 0);
    let result = match profile {
        Profile::AmkKw => write!(out, "{number}/{info1}/{info2}/{info3}"),
        _ if detailed => write!(out, "{number}/{info1}/{info2}/{info3}"),
        Profile::Atv340 => write!(out, "SME{number:03X}"),
        _ => write!(out, "{number}"),
    };
    // Writing into a string does not fail.
    debug_assert!(result.is_ok());
}
