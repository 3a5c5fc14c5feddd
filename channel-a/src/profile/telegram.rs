//! What a profile's process data are on the black channel, and how two status words become
//! the one that leaves (DEC-25).

use shm_schema::facts::{amk_kw, atv340, etg, etg_6100_2, lenze_sm301};
use shm_schema::profile::{Profile, common};
use shm_schema::word::Word;

use crate::image::Image;

/// Octets of control and status word before any `[words]` (DEC-41 to DEC-43).
const FOUR: u8 = 4;
const TWO: u8 = 2;
/// Octets of safe position and safe speed behind the AMK status word (AMK-FSOE-12).
const VALUES: u8 = 8;

/// Shape of the process data of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Telegram {
    /// Octets of the control word.
    pub control: u8,
    /// Octets of the status word.
    pub status: u8,
    /// Position and speed follow the status word.
    pub values: bool,
    /// Status bits combined by OR: errors, movements, requests to the operator.
    pub either: Word,
}

impl Telegram {
    /// No process data.
    pub const NONE: Self = Self { control: 0, status: 0, values: false, either: Word::ZERO };

    /// The shape that `image` asks for.
    pub fn of(image: &Image) -> Self {
        let plain = |octets, bits: &[u8]| Self {
            control: octets,
            status: octets,
            values: false,
            either: bits.iter().fold(Word::ZERO, |word, bit| word.with(*bit, true)),
        };
        match image.profile {
            Profile::None => Self::NONE,
            Profile::AmkKw => Self { values: true, ..plain(FOUR, &[amk_kw::status::ERROR]) },
            Profile::LenzeSm301 => plain(FOUR, &[lenze_sm301::status::ERROR_ACTIVE]),
            Profile::Atv340 => plain(TWO, &[atv340::status::SAFETY_ERROR, atv340::status::RESTART_REQUIRED]),
            Profile::Etg61002 => {
                use etg_6100_2::status as s;
                let plain = plain(FOUR, &[s::ERROR, s::SDIP, s::SDIN, s::RESTART_ACKNOWLEDGE_REQUEST]);
                plain.with_words(image)
            }
        }
    }

    /// DEC-41: further octets as `[words]` assigns them, always an even number.
    fn with_words(mut self, image: &Image) -> Self {
        for key in image.keys() {
            let control = key.wrapping_sub(common::CONTROL_WORD);
            let status = key.wrapping_sub(common::STATUS_WORD);
            if control < 256 {
                self.control = self.control.max(octets_to(control));
            }
            if status < 256 {
                self.status = self.status.max(octets_to(status));
                let moving = (image.value(key) as u32) >> 8 == etg::SDI;
                self.either = self.either.with(status as u8, moving);
            }
        }
        self
    }

    /// Octets of the process data sent.
    pub const fn inputs(&self) -> u8 {
        if self.values { self.status.saturating_add(VALUES) } else { self.status }
    }

    /// Status bits: errors and movements by OR, everything else by AND.
    pub fn combine(&self, own: &Word, other: &Word) -> Word {
        let mut combined = Word::ZERO;
        let parts = own.0.iter().zip(other.0).zip(self.either.0);
        for (out, ((own, other), either)) in combined.0.iter_mut().zip(parts) {
            let any = (own | other) & either;
            *out = (own & other) | any;
        }
        combined
    }
}

/// Octets of a word that reaches up to `bit`, rounded up to an even number.
const fn octets_to(bit: u32) -> u8 {
    ((bit / 16 + 1) * 2) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::bench::image;

    fn telegram(profile: Profile, entries: &[(u32, i64)]) -> Telegram {
        Telegram::of(&Image::parse(&image(profile, entries)).unwrap())
    }

    #[test]
    fn every_profile_has_the_process_data_of_its_document() {
        // AMK-FSOE-03, LNZ-BUS-05, ATV-PSF-06, DEC-41
        let shape = |profile, entries| {
            let telegram = telegram(profile, entries);
            (telegram.control, telegram.inputs())
        };
        assert_eq!(shape(Profile::AmkKw, &[]), (4, 12));
        assert_eq!(shape(Profile::LenzeSm301, &[]), (4, 4));
        assert_eq!(shape(Profile::Atv340, &[]), (2, 2));
        assert_eq!(shape(Profile::Etg61002, &[]), (4, 4));
        let words = [(common::CONTROL_WORD + 32, 1), (common::STATUS_WORD + 255, 1)];
        assert_eq!(shape(Profile::Etg61002, &words), (6, 32));
    }

    #[test]
    fn activity_needs_both_channels_and_an_error_one() {
        // DEC-25
        let amk = telegram(Profile::AmkKw, &[]);
        let (one, two) = (Word::from_u32(0b0000_1101), Word::from_u32(0b1000_1001));
        assert_eq!(amk.combine(&one, &two), Word::from_u32(0b1000_1001));
    }
}
