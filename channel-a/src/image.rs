//! The safety image in encoding A: sound or refused, then looked up by key.

use crate::crc32::crc32;
use shm_schema::facts::Parameter;
use shm_schema::image::{ENTRIES_MAX, HEADER_WORDS, MAGIC, VERSION};
use shm_schema::profile::Profile;

const WORD: usize = 4;
const ENTRY: usize = 2 * WORD;
const PREFIX: usize = HEADER_WORDS * WORD;
const AT_CONTENT: usize = 4 * WORD;
const SERIAL_AT: usize = 7 * WORD;

/// Why an image is refused: Info2 of 3609/128, the set is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Check sum of the set differs.
    CheckSum = 4,
    /// The set does not fit this version, profile or axis.
    Unfit = 6,
    /// A signature inside differs.
    Signature = 9,
}

/// A sound image.
#[derive(Debug, Clone, Copy)]
pub struct Image<'a> {
    entries: &'a [[u8; ENTRY]],
    defaults: &'static [Parameter],
    /// Profile.
    pub profile: Profile,
    /// Number of the axis.
    pub axis: u8,
    /// Content signature.
    pub signature: u32,
}

fn word(octets: &[u8], index: usize) -> u32 {
    let at = index.saturating_mul(WORD);
    octets.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |chunk| u32::from_le_bytes(*chunk))
}

/// Whether `octets` still is the image it was: every signature and check sum inside holds.
pub fn sound(octets: &[u8]) -> bool {
    Image::parse(octets).is_ok()
}

/// Parts that do not lie side by side, joined in one buffer of fixed size for one sum.
struct Joined {
    buffer: [u8; WORD + ENTRIES_MAX * ENTRY],
    used: usize,
}

impl Joined {
    const fn new() -> Self {
        Self { buffer: [0; WORD + ENTRIES_MAX * ENTRY], used: 0 }
    }

    fn add(&mut self, part: &[u8]) -> &mut Self {
        let end = self.used.saturating_add(part.len());
        if let Some(place) = self.buffer.get_mut(self.used..end) {
            for (to, from) in place.iter_mut().zip(part) {
                *to = *from;
            }
            self.used = end;
        }
        self
    }

    fn sum(&self) -> u32 {
        self.buffer.get(..self.used).map_or(0, crc32)
    }
}

impl<'a> Image<'a> {
    /// Checks all of `octets`.
    ///
    /// # Errors
    /// The first reason to refuse it.
    pub fn parse(octets: &'a [u8]) -> Result<Self, Refusal> {
        let (body, sum) = octets.split_last_chunk::<WORD>().ok_or(Refusal::CheckSum)?;
        if crc32(body) != u32::from_le_bytes(*sum) {
            return Err(Refusal::CheckSum);
        }
        let kind = word(body, 1);
        let profile = Profile::from_octet((kind >> 8) as u8).ok_or(Refusal::Unfit)?;
        let fit = (word(body, 0), kind >> 16) == (MAGIC, u32::from(VERSION));
        if !fit | (profile == Profile::None) {
            return Err(Refusal::Unfit);
        }
        let (entries, rest) = body.get(PREFIX..).ok_or(Refusal::Unfit)?.as_chunks::<ENTRY>();
        let counted = entries.len() == word(body, 2) as usize;
        if !counted | !rest.is_empty() | (entries.len() > ENTRIES_MAX) {
            return Err(Refusal::Unfit);
        }
        let image = Self {
            entries,
            defaults: defaults(profile),
            profile,
            axis: kind as u8,
            signature: word(body, 4),
        };
        image.signatures(body)?;
        Ok(image)
    }

    fn signatures(&self, body: &[u8]) -> Result<(), Refusal> {
        let profile = (self.profile as u32).to_le_bytes();
        let mut content = Joined::new();
        content.add(&profile);
        self.entries.iter().for_each(|entry| {
            content.add(entry);
        });
        let mut template = Joined::new();
        template.add(&u32::from(VERSION).to_le_bytes()).add(&profile);
        self.keys().for_each(|key| {
            template.add(&key.to_le_bytes());
        });
        let mut device = Joined::new();
        device.add(body.get(AT_CONTENT..AT_CONTENT + WORD).unwrap_or(&[]));
        device.add(body.get(SERIAL_AT..PREFIX).unwrap_or(&[]));
        let inside = (word(body, 3), word(body, 4), word(body, 5));
        if inside != (template.sum(), content.sum(), device.sum()) {
            return Err(Refusal::Signature);
        }
        let mut keys = self.keys();
        let mut before = keys.next().unwrap_or(0);
        let ascending = keys.all(|key| core::mem::replace(&mut before, key) < key);
        if ascending { Ok(()) } else { Err(Refusal::Signature) }
    }

    /// Octets of all entries, the subject of the SRA CRC.
    pub const fn content(&self) -> &'a [u8] {
        self.entries.as_flattened()
    }

    /// All keys the image holds, ascending.
    pub fn keys(&self) -> impl Iterator<Item = u32> + '_ {
        self.entries.iter().map(|entry| word(entry, 0))
    }

    /// The value under `key`, if the image names it.
    pub fn named(&self, key: u32) -> Option<i64> {
        let found = self.entries.binary_search_by_key(&key, |entry| word(entry, 0)).ok()?;
        self.entries.get(found).map(|entry| i64::from(word(entry, 1) as i32))
    }

    /// The value under `key`, or the default of the profile (DEC-28), or 0.
    pub fn value(&self, key: u32) -> i64 {
        self.named(key).unwrap_or_else(|| self.default_of(key))
    }

    fn default_of(&self, key: u32) -> i64 {
        let common = shm_schema::facts::common::PARAMETERS.iter();
        let mut rows = self.defaults.iter().chain(common);
        rows.find(|row| row.key == key).map_or(0, |row| i64::from(row.default))
    }

    /// Parameters of the profile with their ranges.
    pub fn table(&self) -> &'static [Parameter] {
        self.defaults
    }
}

fn defaults(profile: Profile) -> &'static [Parameter] {
    use shm_schema::facts;
    match profile {
        Profile::None => &[],
        Profile::AmkKw => &facts::amk_kw::PARAMETERS,
        Profile::LenzeSm301 => &facts::lenze_sm301::PARAMETERS,
        Profile::Atv340 => &facts::atv340::PARAMETERS,
        Profile::Etg61002 => &facts::etg_6100_2::PARAMETERS,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::black_channel::parameter_signature;
    use crate::tests::bench::image;

    #[test]
    fn the_sra_crc_is_over_keys_and_values_low_octet_first() {
        // black-channel.md 2.7: its vector 00 … 0F as two entries.
        let octets = image(Profile::Etg61002, &[(0x0302_0100, 0x0706_0504), (0x0B0A_0908, 0x0F0E_0D0C)]);
        let sra = Image::parse(&octets).map(|image| parameter_signature(image.content()));
        assert_eq!(sra, Ok(0x0CD4_BE50));
    }
}
