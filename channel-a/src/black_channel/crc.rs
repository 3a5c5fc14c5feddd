//! Check sums of both protocols, one octet at a time from constant tables.
//!
//! All protocol sums run most significant bit first, without reflection and
//! without a final inversion. The 24-bit sum lives in the upper three octets of
//! a 32-bit register, so that it shares the step of the 32-bit sum.

/// FSoE frame sum, x^16 plus this value (black-channel.md 2.4).
const FSOE: [u16; 256] = table_16(0x39B7);
/// PROFIsafe CRC1 over the F-parameters (7.2).
const F_PARAMETERS: [u16; 256] = table_16(0x4EAB);
/// PROFIsafe 24-bit CRC2, shifted up by one octet (7.4).
const PROFISAFE: [u32; 256] = table_32(0x5D6D_CB00);
/// Signature of the safety parameter set (2.7).
const SIGNATURE: [u32; 256] = table_32(0x8141_41AB);
/// Digest of a frame: the reflected CRC-32 of Ethernet.
const DIGEST: [u32; 256] = table_reflected(0xEDB8_8320);

const fn table_16(polynomial: u16) -> [u16; 256] {
    let mut table = [0_u16; 256];
    let mut index = 0;
    while index < 256 {
        let mut register = (index as u16) << 8;
        let mut bit = 0;
        while bit < 8 {
            let carry = register & 0x8000 != 0;
            register <<= 1;
            if carry {
                register ^= polynomial;
            }
            bit += 1;
        }
        table[index] = register;
        index += 1;
    }
    table
}

const fn table_32(polynomial: u32) -> [u32; 256] {
    let mut table = [0_u32; 256];
    let mut index = 0;
    while index < 256 {
        let mut register = (index as u32) << 24;
        let mut bit = 0;
        while bit < 8 {
            let carry = register & 0x8000_0000 != 0;
            register <<= 1;
            if carry {
                register ^= polynomial;
            }
            bit += 1;
        }
        table[index] = register;
        index += 1;
    }
    table
}

const fn table_reflected(polynomial: u32) -> [u32; 256] {
    let mut table = [0_u32; 256];
    let mut index = 0;
    while index < 256 {
        let mut register = index as u32;
        let mut bit = 0;
        while bit < 8 {
            let carry = register & 1 != 0;
            register >>= 1;
            if carry {
                register ^= polynomial;
            }
            bit += 1;
        }
        table[index] = register;
        index += 1;
    }
    table
}

fn step_16(table: &[u16; 256], register: u16, octet: u8) -> u16 {
    let [high, low] = register.to_be_bytes();
    u16::from_be_bytes([low, 0]) ^ table[usize::from(high ^ octet)]
}

fn step_32(table: &[u32; 256], register: u32, octet: u8) -> u32 {
    let [high, ..] = register.to_be_bytes();
    (register << 8) ^ table[usize::from(high ^ octet)]
}

/// Running FSoE sum; [`FsoeSum::finish`] adds the three closing zero octets.
#[derive(Clone, Copy)]
pub(super) struct FsoeSum(u16);

impl FsoeSum {
    pub(super) const fn start() -> Self {
        Self(0)
    }

    pub(super) fn octet(self, octet: u8) -> Self {
        Self(step_16(&FSOE, self.0, octet))
    }

    /// A 16-bit value enters low octet first.
    pub(super) fn word(self, word: u16) -> Self {
        let [low, high] = word.to_le_bytes();
        self.octet(low).octet(high)
    }

    pub(super) fn octets(self, octets: &[u8]) -> Self {
        octets.iter().fold(self, |sum, octet| sum.octet(*octet))
    }

    pub(super) fn finish(self) -> u16 {
        self.octets(&[0; 3]).0
    }
}

/// CRC1 over octets in the order of black-channel.md 7.2.
pub(super) fn f_parameter_sum(octets: impl Iterator<Item = u8>) -> u16 {
    octets.fold(0, |register, octet| step_16(&F_PARAMETERS, register, octet))
}

/// CRC2 (24 bit) over octets already in the order of black-channel.md 7.4,
/// starting from CRC1.
pub(super) fn profisafe_sum(crc1: u16, octets: impl Iterator<Item = u8>) -> u32 {
    let register = octets.fold(u32::from(crc1) << 8, |register, octet| step_32(&PROFISAFE, register, octet));
    register >> 8
}

/// Signature over a safety parameter set as FSoE carries it in the first four
/// application parameter octets, low octet first (black-channel.md 2.7).
#[must_use]
pub fn parameter_signature(octets: &[u8]) -> u32 {
    octets.iter().fold(0, |register, octet| step_32(&SIGNATURE, register, *octet))
}

/// Digest of a frame, CRC-32 as Ethernet uses it: both channels report it, and
/// an answer leaves only when the two are equal (design 9).
#[must_use]
pub fn frame_digest(octets: &[u8]) -> u32 {
    let register = octets.iter().fold(u32::MAX, |register, octet| {
        let [low, ..] = register.to_le_bytes();
        (register >> 8) ^ DIGEST[usize::from(low ^ octet)]
    });
    !register
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fsoe(inherited: u16, conn_id: u16, number: u16, index: u16, octets: &[u8]) -> u16 {
        let (command, data) = octets.split_first().unwrap();
        let sum = FsoeSum::start().word(inherited).word(conn_id).word(number).octet(*command);
        let sum = if index > 0 { sum.word(index) } else { sum };
        sum.octets(data).finish()
    }

    /// black-channel.md 2.4 and 4.1.
    #[test]
    fn fsoe_sums_of_the_catalogue() {
        assert_eq!(FsoeSum::start().octet(1).finish(), 0x7648);
        assert_eq!(fsoe(0, 0, 1, 0, &[0x4E, 0x12, 0x34]), 0x4D07);
        assert_eq!(fsoe(0, 0, 1, 0, &[0x4E, 0x12]), 0xA176);
        assert_eq!(fsoe(0xABCD, 7, 2, 1, &[0x36, 0xDE, 0xAD]), 0xBC47);
    }

    /// black-channel.md 2.7.
    #[test]
    fn parameter_signatures_of_the_catalogue() {
        let counting: [u8; 16] = core::array::from_fn(|index| index as u8);
        assert_eq!(parameter_signature(&[1]), 0x8141_41AB);
        assert_eq!(parameter_signature(&[1, 2]), 0x03C3_71CF);
        assert_eq!(parameter_signature(&[1, 2, 3, 4]), 0x552B_9287);
        assert_eq!(parameter_signature(&counting), 0x0CD4_BE50);
        assert_eq!(parameter_signature(b"123456789"), 0x3010_BF7F);
    }

    /// The published check value of this sum.
    #[test]
    fn the_digest_is_the_ethernet_sum() {
        assert_eq!(frame_digest(b"123456789"), 0xCBF4_3926);
        assert_eq!(frame_digest(&[]), 0);
    }
}
