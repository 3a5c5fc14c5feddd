//! The safety image in both encodings ([`shm_schema::image`]).

use std::collections::BTreeMap;

use crc::{CRC_32_AIXM, CRC_32_ISCSI, CRC_32_ISO_HDLC, Crc};
use serde::Serialize;
use shm_schema::{
    image::{ENTRIES_MAX, HEADER_WORDS, MAGIC, SERIAL_OCTETS, VALIDATED, VERSION},
    profile::Profile,
};

use crate::set::AxisSet;

const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const CRC32C: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// What FSoE masters send (black-channel.md 2.7).
const SRA: Crc<u32> = Crc::<u32>::new(&CRC_32_AIXM);

/// The three signatures of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Signatures {
    /// Over version, profile and all keys.
    pub template: u32,
    /// Over profile and all entries: what a person types back.
    pub content: u32,
    /// Over the content signature and the serial number.
    pub device: u32,
}

/// A read image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Image {
    /// Number of the profile.
    pub profile: u8,
    /// Axis.
    pub axis: u8,
    /// The signatures as the image states them; [`Image::read`] has checked them.
    pub signatures: Signatures,
    /// The set was validated for this device.
    pub validated: bool,
    /// Serial number.
    pub serial: String,
    /// Raw values by key.
    pub values: BTreeMap<u32, i32>,
}

/// Why an image is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ImageError {
    /// Length is no image's, or does not fit the number of entries.
    Length,
    /// The check sum at the end is wrong.
    CheckSum,
    /// First word or version.
    Format,
    /// Keys are not in ascending order.
    Order,
    /// A signature does not fit the content.
    Signature,
}

impl std::fmt::Display for ImageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Length => "the length is no image's",
            Self::CheckSum => "the check sum is wrong",
            Self::Format => "this is no image of this version",
            Self::Order => "the keys are not in ascending order",
            Self::Signature => "a signature does not fit the content",
        })
    }
}

impl std::error::Error for ImageError {}

impl AxisSet {
    /// The signatures of this set for its serial number.
    pub fn signatures(&self) -> Signatures {
        signatures(self.profile as u32, &self.serial, &self.values)
    }

    /// The SRA CRC over keys and values, which an FSoE master sends in the first four octets of
    /// its application parameters where the machine file says `sra = true`.
    pub fn sra_crc(&self) -> u32 {
        let mut digest = SRA.digest();
        for (key, value) in &self.values {
            digest.update(&key.to_le_bytes());
            digest.update(&value.to_le_bytes());
        }
        digest.finalize()
    }

    /// Encoding A: little endian.
    pub fn image_a(&self, validated: bool) -> Vec<u8> {
        let mut octets: Vec<u8> = self.words(validated).into_iter().flat_map(u32::to_le_bytes).collect();
        octets.extend(CRC32.checksum(&octets).to_le_bytes());
        octets
    }

    /// Encoding B: every word complemented, big endian.
    pub fn image_b(&self, validated: bool) -> Vec<u8> {
        let mut octets: Vec<u8> =
            self.words(validated).into_iter().flat_map(|word| (!word).to_be_bytes()).collect();
        octets.extend((!CRC32C.checksum(&octets)).to_be_bytes());
        octets
    }

    /// All words but the last.
    fn words(&self, validated: bool) -> Vec<u32> {
        let signatures = self.signatures();
        let mut words = vec![
            MAGIC,
            u32::from(VERSION) << 16 | (self.profile as u32) << 8 | u32::from(self.number),
            self.values.len() as u32,
            signatures.template,
            signatures.content,
            signatures.device,
            if validated { VALIDATED } else { 0 },
        ];
        let serial = serial_octets(&self.serial);
        words.extend(
            serial.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])),
        );
        words.extend(self.values.iter().flat_map(|(key, value)| [*key, *value as u32]));
        words
    }
}

impl Image {
    /// Reads either encoding.
    pub fn read(octets: &[u8]) -> Result<Self, ImageError> {
        let (first, _) = octets.split_first_chunk::<4>().ok_or(ImageError::Length)?;
        if u32::from_le_bytes(*first) == MAGIC {
            Self::read_words(&checked(octets, false)?)
        } else if !u32::from_be_bytes(*first) == MAGIC {
            Self::read_words(&checked(octets, true)?)
        } else {
            Err(ImageError::Format)
        }
    }

    fn read_words(words: &[u32]) -> Result<Self, ImageError> {
        let (header, entries) = words.split_at_checked(HEADER_WORDS).ok_or(ImageError::Length)?;
        if header[1] >> 16 != u32::from(VERSION) {
            return Err(ImageError::Format);
        }
        let count = entries.len() / 2;
        if entries.len() % 2 != 0 || count > ENTRIES_MAX || header[2] as usize != count {
            return Err(ImageError::Length);
        }
        let keys: Vec<u32> = entries.chunks_exact(2).map(|entry| entry[0]).collect();
        if !keys.is_sorted_by(|left, right| left < right) {
            return Err(ImageError::Order);
        }
        let serial: Vec<u8> = header[7..].iter().flat_map(|word| word.to_le_bytes()).collect();
        let image = Self {
            profile: (header[1] >> 8) as u8,
            axis: header[1] as u8,
            signatures: Signatures { template: header[3], content: header[4], device: header[5] },
            validated: header[6] & VALIDATED != 0,
            serial: String::from_utf8_lossy(&serial).trim_end_matches('\0').into(),
            values: entries.chunks_exact(2).map(|entry| (entry[0], entry[1] as i32)).collect(),
        };
        let expected = signatures(u32::from(image.profile), &image.serial, &image.values);
        if expected == image.signatures { Ok(image) } else { Err(ImageError::Signature) }
    }

    /// The profile, if the number is one.
    pub fn profile(&self) -> Option<Profile> {
        crate::definition::PROFILES.into_iter().find(|profile| *profile as u8 == self.profile)
    }
}

/// The words of an image without its check sum, in plain form, if the check sum holds.
fn checked(octets: &[u8], complemented: bool) -> Result<Vec<u32>, ImageError> {
    let (body, last) = octets.split_last_chunk::<4>().ok_or(ImageError::Length)?;
    if body.len() % 4 != 0 {
        return Err(ImageError::Length);
    }
    let right = if complemented {
        !u32::from_be_bytes(*last) == CRC32C.checksum(body)
    } else {
        u32::from_le_bytes(*last) == CRC32.checksum(body)
    };
    if !right {
        return Err(ImageError::CheckSum);
    }
    let words = body.chunks_exact(4).map(|word| [word[0], word[1], word[2], word[3]]);
    Ok(words
        .map(|word| if complemented { !u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
        .collect())
}

/// The three signatures, each over little-endian words.
fn signatures(profile: u32, serial: &str, values: &BTreeMap<u32, i32>) -> Signatures {
    let keys = values.keys().copied();
    let template = crc_of_words([u32::from(VERSION), profile].into_iter().chain(keys));
    let entries = values.iter().flat_map(|(key, value)| [*key, *value as u32]);
    let content = crc_of_words([profile].into_iter().chain(entries));
    let mut digest = CRC32.digest();
    digest.update(&content.to_le_bytes());
    digest.update(&serial_octets(serial));
    Signatures { template, content, device: digest.finalize() }
}

fn crc_of_words(words: impl Iterator<Item = u32>) -> u32 {
    let mut digest = CRC32.digest();
    words.for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}

/// The serial number as the image holds it, padded with 0.
fn serial_octets(serial: &str) -> [u8; SERIAL_OCTETS] {
    let mut octets = [0; SERIAL_OCTETS];
    octets.iter_mut().zip(serial.bytes()).for_each(|(to, from)| *to = from);
    octets
}

#[cfg(test)]
mod tests;
