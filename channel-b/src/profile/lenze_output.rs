//! Lenze SM301: when SD-Out1 is on (LNZ-OUT-05).

use shm_schema::facts::lenze_sm301::status;
use shm_schema::word::Word;

use super::lenze::parameter;
use crate::engine::spec::NO_BIT;
use crate::image::Image;

/// Status bits of C15051: bit 2 n selects the n-th, bit 2 n + 1 its negation.
const CONDITIONS_1: [u8; 12] = [
    status::STO_ACTIVE,
    status::SS1_ACTIVE,
    status::SS2_ACTIVE,
    status::SLS1_ACTIVE,
    status::SLS2_ACTIVE,
    status::SLS3_ACTIVE,
    status::SLS4_ACTIVE,
    status::SDIPOS_ACTIVE,
    status::SDINEG_ACTIVE,
    status::ES_ACTIVE,
    status::SLI_ACTIVE,
    status::OMS,
];
/// The same of C15052; places 12 and 14 are reserved.
const CONDITIONS_2: [u8; 16] = [
    status::SOS_MONITORED,
    status::SLS1_MONITORED,
    status::SLS2_MONITORED,
    status::SLS3_MONITORED,
    status::SLS4_MONITORED,
    status::SDIPOS_MONITORED,
    status::SDINEG_MONITORED,
    status::SSE_ACTIVE,
    status::SD_IN1,
    status::SD_IN1 + 1,
    status::SD_IN1 + 2,
    status::SD_IN1 + 3,
    NO_BIT,
    status::OMS_ACTIVE,
    NO_BIT,
    status::ERROR_ACTIVE,
];

/// Feedback conditions of SD-Out1.
#[derive(Debug, Clone, Copy)]
pub struct Feedback {
    /// Status bits of which a 1 is a fulfilled condition, and of which a 0 is.
    by_one: u32,
    by_zero: u32,
    needs_all: bool,
}

impl Feedback {
    /// The conditions of the set.
    pub fn new(image: &Image<'_>) -> Self {
        let words = [parameter(image, 15_051, 1) as u32, parameter(image, 15_052, 1) as u32];
        let mut selected = [0_u32; 2];
        let mut select = |word: u32, bits: &[u8]| {
            for (place, bit) in (0_u32..).zip(bits).filter(|(_, bit)| **bit != NO_BIT) {
                for (negation, mask) in (0_u32..).zip(&mut selected) {
                    let is_selected = word >> (place.wrapping_mul(2).wrapping_add(negation) & 31) & 1;
                    *mask |= is_selected << (bit & 31);
                }
            }
        };
        let [first, second] = words;
        select(first, &CONDITIONS_1);
        select(second, &CONDITIONS_2);
        let [by_one, by_zero] = selected;
        Self { by_one, by_zero, needs_all: parameter(image, 15_055, 1) == 1 }
    }

    /// Without a condition the output is the bus's alone (the catalogue leaves it open).
    pub fn is_on(&self, status: &Word) -> bool {
        let [shown, ..] = status.0;
        let is_free = self.by_one | self.by_zero == 0;
        let any = (shown & self.by_one) | (!shown & self.by_zero) != 0;
        let all = (!shown & self.by_one) | (shown & self.by_zero) == 0;
        is_free | if self.needs_all { all } else { any }
    }
}
