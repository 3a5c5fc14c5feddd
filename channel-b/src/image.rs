//! Channel B's copy of the safety image: complemented words, big endian, CRC-32C.

use shm_schema::image::{ENTRIES_MAX, HEADER_WORDS, MAGIC, OCTETS_MAX, VERSION};
use shm_schema::profile::Profile;

use crate::crc::{Signature, crc32c};

/// What is wrong with an image before any parameter is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flaw {
    /// Length, magic or number of entries.
    Form,
    /// Another version of the format, or an unknown profile.
    Version,
    /// Check sum over the whole image.
    CheckSum,
    /// A signature inside is not the one computed from the entries.
    Signature,
    /// Keys are not in ascending order.
    Order,
}

/// A checked image.
#[derive(Debug, Clone, Copy)]
pub struct Image<'a> {
    words: &'a [[u8; 4]],
    /// The profile its parameters belong to.
    pub profile: Profile,
    /// Axis it was made for.
    pub axis: u8,
    /// Content signature, computed from this copy.
    pub signature: u32,
}

/// Whether a copy still carries the check sum it was loaded with.
pub fn is_sound(octets: &[u8]) -> bool {
    octets.split_last_chunk::<4>().is_some_and(|(body, sum)| plain(*sum) == crc32c(body))
}

/// The check sum an image names for itself, for a [`crate::crc::Walk`] over all but its
/// last four octets.
pub fn named_sum(octets: &[u8]) -> Option<(&[u8], u32)> {
    octets.split_last_chunk::<4>().map(|(body, sum)| (body, plain(*sum)))
}

const fn plain(octets: [u8; 4]) -> u32 {
    !u32::from_be_bytes(octets)
}

impl<'a> Image<'a> {
    /// Checks form, check sum and signatures.
    ///
    /// # Errors
    /// The first flaw found.
    pub fn open(octets: &'a [u8]) -> Result<Self, Flaw> {
        if octets.len() > OCTETS_MAX {
            return Err(Flaw::Form);
        }
        let (words, []) = octets.as_chunks::<4>() else {
            return Err(Flaw::Form);
        };
        let at = |index: usize| words.get(index).map_or(0, |word| plain(*word));
        let entries = at(2) as usize;
        if at(0) != MAGIC {
            return Err(Flaw::Form);
        }
        if entries > ENTRIES_MAX {
            return Err(Flaw::Form);
        }
        // Bounded just above; the sum cannot overflow.
        let length = entries.saturating_mul(2).saturating_add(HEADER_WORDS).saturating_add(1);
        if words.len() != length {
            return Err(Flaw::Form);
        }
        if !is_sound(octets) {
            return Err(Flaw::CheckSum);
        }
        let [axis, profile, low, high] = at(1).to_le_bytes();
        if u16::from_le_bytes([low, high]) != VERSION {
            return Err(Flaw::Version);
        }
        let profile = Profile::from_octet(profile).ok_or(Flaw::Version)?;
        let mut image = Self { words, profile, axis, signature: at(4) };
        image.check_signatures(at(5))?;
        image.check_order()?;
        image.signature = image.content();
        Ok(image)
    }

    /// Key and value of every entry.
    pub fn entries(&self) -> impl Iterator<Item = (u32, i32)> + Clone + use<'a> {
        let body = self.words.split_last().map_or(&[][..], |(_, body)| body);
        let (pairs, _) = body.get(HEADER_WORDS..).unwrap_or(&[]).as_chunks::<2>();
        pairs.iter().map(|[key, value]| (plain(*key), plain(*value) as i32))
    }

    /// The SRA CRC over keys and values, low octet first (black-channel 2.7).
    pub fn sra_crc(&self) -> u32 {
        let words = self.entries().flat_map(|(key, value)| [key, value.cast_unsigned()]);
        crate::black_channel::parameter_signature(words.flat_map(u32::to_le_bytes))
    }

    /// The value of `key`, or `default` when the set does not carry it.
    pub fn value(&self, key: u32, default: i32) -> i32 {
        self.find(key).unwrap_or(default)
    }

    /// The value of `key`.
    pub fn find(&self, key: u32) -> Option<i32> {
        let body = self.words.split_last().map_or(&[][..], |(_, body)| body);
        let (pairs, _) = body.get(HEADER_WORDS..)?.as_chunks::<2>();
        let place = pairs.partition_point(|[found, _]| plain(*found) < key);
        let [found, value] = pairs.get(place)?;
        if plain(*found) == key { Some(plain(*value) as i32) } else { None }
    }

    fn content(&self) -> u32 {
        let start = Signature::new().word(self.profile as u32);
        self.entries().fold(start, |sum, (key, value)| sum.word(key).word(value as u32)).finish()
    }

    fn check_signatures(&self, device: u32) -> Result<(), Flaw> {
        let content = self.content();
        let serial = self.words.get(7..HEADER_WORDS).unwrap_or(&[]);
        let own = serial.iter().fold(Signature::new().word(content), |sum, word| sum.word(plain(*word)));
        if (content, own.finish()) == (self.signature, device) { Ok(()) } else { Err(Flaw::Signature) }
    }

    fn check_order(&self) -> Result<(), Flaw> {
        let keys = self.entries().map(|(key, _)| key);
        if keys.clone().zip(keys.skip(1)).all(|(one, next)| one < next) { Ok(()) } else { Err(Flaw::Order) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// black-channel 2.7: its vector 00 … 0F as two entries.
    #[test]
    fn the_sra_crc_is_over_the_plain_keys_and_values() {
        let entries = [(0x0302_0100, 0x0706_0504), (0x0B0A_0908, 0x0F0E_0D0C)];
        let octets = crate::testing::of_values(Profile::Etg61002, &entries.into());
        assert_eq!(Image::open(&octets).map(|image| image.sra_crc()), Ok(0x0CD4_BE50));
    }
}
