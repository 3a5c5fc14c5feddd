//! What crosscheck takes from the safety image: its own limits and the content signature.
//!
//! Crosscheck reads encoding A and checks its form; the plausibility of the parameters is
//! the channels' business.

use shm_schema::image::{ENTRIES_MAX, HEADER_WORDS, MAGIC, VERSION};
use shm_schema::profile::{Profile, common};

use crate::guard::crc32;
use crate::profile::StatusRules;

/// Smallest and largest cc_factor (DEC-20, 3605/13/9).
const CC_FACTOR: core::ops::RangeInclusive<i32> = 7..=199;
/// Unit of the fault tolerance time, ns: tcc = (cc_factor + 1) * 15 ms (DEC-20).
const TCC_UNIT_NS: u64 = 15_000_000;

/// Numbers of the AMK parameters of the same meaning as the common ones.
mod amk {
    pub const POSITION_DIFFERENCE: u32 = 2;
    pub const SPEED_DIFFERENCE: u32 = 3;
    pub const CC_FACTOR: u32 = 105;
}

/// Limits of the comparison of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// The image is sound and its cc_factor is inside 7 to 199. Without it: no permit, ever.
    pub acceptable: bool,
    /// Profile of the axis.
    pub profile: Profile,
    /// Number of the axis the image is for.
    pub axis: u8,
    /// Content signature both channels must report (DEC-22); 0: only compared with each other.
    pub signature: u32,
    /// Largest difference of the positions, increments; equal is inside (AMK-PRM-01).
    pub position_difference: i64,
    /// Largest difference of the speeds, 1/1000 rpm; equal is inside (AMK-PRM-03).
    pub speed_difference_mrpm: i64,
    /// Fault tolerance time, ns (DEC-20).
    pub tcc_ns: u64,
    /// Build of channel A in the release manifest; 0: not checked (simulation).
    pub build_a: u32,
    /// Build of channel B in the release manifest; 0: not checked (simulation).
    pub build_b: u32,
    /// Program-flow signature of channel A in the release manifest; 0: not checked.
    pub flow_a: u32,
    /// Program-flow signature of channel B in the release manifest; 0: not checked.
    pub flow_b: u32,
    /// How the status words combine (DEC-25), with the assignments of `[words]`.
    pub status: StatusRules,
}

impl Limits {
    /// Limits that permit nothing.
    pub const REFUSED: Self = Self {
        acceptable: false,
        profile: Profile::None,
        axis: 0,
        signature: 0,
        position_difference: 0,
        speed_difference_mrpm: 0,
        tcc_ns: 0,
        build_a: 0,
        build_b: 0,
        flow_a: 0,
        flow_b: 0,
        status: StatusRules::of(Profile::None),
    };

    /// Reads encoding A of a safety image. A damaged image, another format or a refused
    /// cc_factor gives limits that permit nothing (3605/13/9).
    pub fn from_image(image: &[u8]) -> Self {
        Self::read(image).unwrap_or(Self::REFUSED)
    }

    fn read(image: &[u8]) -> Option<Self> {
        let (covered, sum) = image.split_last_chunk::<4>()?;
        let sound = u32::from_le_bytes(*sum) == crc32(covered);
        let (header, entries) = covered.split_at_checked(4 * HEADER_WORDS)?;
        let mut words = header.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
        let known = words.next()? == MAGIC;
        let format = words.next()?;
        let count = words.next()? as usize;
        let signature = words.nth(1)?;
        let version_known = format >> 16 == u32::from(VERSION);
        let counted = count <= ENTRIES_MAX;
        let complete = entries.len() == count.saturating_mul(8);
        if !(sound & known & version_known & counted & complete) {
            return None;
        }
        let profile = Profile::from_octet((format >> 8) as u8)?;
        Self::of_entries(profile, format as u8, signature, entries)
    }

    fn of_entries(profile: Profile, axis: u8, signature: u32, entries: &[u8]) -> Option<Self> {
        let mut raw = Raw::defaults(profile)?;
        let mut status = StatusRules::of(profile);
        for entry in entries.as_chunks::<8>().0 {
            // One little-endian number of 64 bits: the key below, the value above.
            let both = u64::from_le_bytes(*entry);
            raw.take(both as u32, (both >> 32) as i32, &mut status);
        }
        Some(Self {
            acceptable: CC_FACTOR.contains(&raw.cc_factor),
            profile,
            axis,
            signature,
            // A negative limit is no limit anybody meant: nothing may differ.
            position_difference: i64::from(raw.position.max(0)),
            speed_difference_mrpm: i64::from(raw.speed_rpm.max(0)).saturating_mul(1_000),
            tcc_ns: u64::try_from(raw.cc_factor).unwrap_or(0).saturating_add(1).saturating_mul(TCC_UNIT_NS),
            status,
            ..Self::REFUSED
        })
    }
}

/// The raw integers, before they become limits.
struct Raw {
    keys: [u32; 3],
    position: i32,
    speed_rpm: i32,
    cc_factor: i32,
}

impl Raw {
    /// Values an image leaves out: DEC-28 for AMK, DEC-50 for the others.
    const fn defaults(profile: Profile) -> Option<Self> {
        match profile {
            Profile::None => None,
            Profile::AmkKw => Some(Self {
                keys: [amk::POSITION_DIFFERENCE, amk::SPEED_DIFFERENCE, amk::CC_FACTOR],
                position: 50,
                speed_rpm: 16,
                cc_factor: 7,
            }),
            _ => Some(Self {
                keys: [common::POSITION_DIFFERENCE, common::SPEED_DIFFERENCE, common::CC_FACTOR],
                position: 450,
                speed_rpm: 315,
                cc_factor: 7,
            }),
        }
    }

    const fn take(&mut self, key: u32, value: i32, status: &mut StatusRules) {
        let [position, speed, cc_factor] = self.keys;
        if key == position {
            self.position = value;
        } else if key == speed {
            self.speed_rpm = value;
        } else if key == cc_factor {
            self.cc_factor = value;
        } else if key & !0xFF == common::STATUS_WORD {
            status.assign(key as u8, value);
        }
    }
}
