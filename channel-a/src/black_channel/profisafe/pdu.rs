//! Safety PDU of the basic protocol: data, one status or control octet, CRC2
//! high octet first (black-channel.md 7.3 to 7.6).

use super::super::answer::{Answer, Layout};
use super::super::crc;

/// Most data octets with a 3-octet CRC2.
pub(super) const MAX_DATA: u8 = 12;
/// Status or control octet and CRC2.
pub(super) const TRAILER: usize = 4;

/// Bits of the control octet, host to device.
pub(super) mod control {
    pub(in super::super) const OPERATOR_REQUEST: u8 = 1 << 1;
    pub(in super::super) const RESET_NUMBER: u8 = 1 << 2;
    pub(in super::super) const ACTIVATE_FV: u8 = 1 << 4;
    pub(in super::super) const TOGGLE: u8 = 1 << 5;
}

/// Bits of the status octet, device to host.
pub(super) mod status {
    pub(in super::super) const DEVICE_FAULT: u8 = 1 << 1;
    pub(in super::super) const CRC_FAULT: u8 = 1 << 2;
    pub(in super::super) const WATCHDOG: u8 = 1 << 3;
    pub(in super::super) const FV_ACTIVATED: u8 = 1 << 4;
    pub(in super::super) const TOGGLE: u8 = 1 << 5;
    pub(in super::super) const NUMBER_RESET: u8 = 1 << 6;
}

/// Virtual consecutive number, 24 bits, never transmitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Number(pub(super) u32);

impl Number {
    pub(super) const RESET: Self = Self(0);

    /// FFFFFF is followed by 1; 0 comes only from a reset (7.5).
    pub(super) const fn following(self) -> Self {
        match self.0 {
            0x00FF_FFFF.. => Self(1),
            number => Self(number.saturating_add(1)),
        }
    }
}

/// CRC2: octets enter backwards, then the number low octet first, then a zero.
pub(super) fn sum(crc1: u16, number: Number, octet: u8, data: &[u8]) -> u32 {
    let backwards = data.iter().rev().copied();
    let [low, middle, high, _] = number.0.to_le_bytes();
    let octets = core::iter::once(octet).chain(backwards).chain([low, middle, high, 0]);
    crc::profisafe_sum(crc1, octets)
}

/// A received PDU, its CRC2 not yet judged.
#[derive(Clone, Copy)]
pub(super) struct Received<'frame> {
    pub(super) data: &'frame [u8],
    control: u8,
    sum: u32,
}

impl<'frame> Received<'frame> {
    pub(super) fn parse(octets: &'frame [u8], data_length: u8) -> Option<Self> {
        let (data, trailer) = octets.split_last_chunk::<TRAILER>()?;
        if data.len() != usize::from(data_length) {
            return None;
        }
        let [control, high, middle, low] = *trailer;
        Some(Self { data, control, sum: u32::from_be_bytes([0, high, middle, low]) })
    }

    pub(super) const fn has(&self, bit: u8) -> bool {
        self.control & bit != 0
    }

    pub(super) fn carries(&self, crc1: u16, number: Number) -> bool {
        sum(crc1, number, self.control, self.data) == self.sum
    }
}

/// A PDU of the device.
pub(super) fn seal(crc1: u16, number: Number, status: u8, data: &[u8]) -> Answer {
    let [_, sum @ ..] = sum(crc1, number, status, data).to_be_bytes();
    let mut answer = Answer::empty(Layout::Profisafe);
    answer.push(data);
    answer.push(&[status]);
    answer.push(&sum);
    answer
}

#[cfg(test)]
mod tests {
    use super::*;

    /// black-channel.md 9.2: number, second data octet, status, CRC2 of a
    /// recorded device with CRC1 22FF.
    const RECORDED: [(u32, u8, u8, u32); 12] = [
        (0, 0x01, 0x40, 0xBB_5FB5),
        (1, 0x01, 0x20, 0x81_1199),
        (2, 0x4D, 0x00, 0xE1_8AA8),
        (3, 0x4D, 0x20, 0xB5_474A),
        (4, 0x4D, 0x00, 0xF5_CF7D),
        (5, 0x4D, 0x20, 0xA1_029F),
        (6, 0x4D, 0x00, 0x32_D777),
        (7, 0x4D, 0x20, 0x66_1A95),
        (8, 0x4D, 0x00, 0xDD_44D7),
        (9, 0x4D, 0x20, 0x89_8935),
        (10, 0x4D, 0x00, 0x1A_5CDD),
        (11, 0x4D, 0x20, 0x4E_913F),
    ];

    #[test]
    fn crc2_of_the_recorded_device() {
        for (number, second, status, expected) in RECORDED {
            let data = [0x41, second, 0, 4, 0, 0, 0, 0];
            let number = Number(number);
            assert_eq!(sum(0x22FF, number, status, &data), expected, "{number:?}");
        }
    }

    /// black-channel.md 7.5.
    #[test]
    fn the_highest_number_is_followed_by_one() {
        assert_eq!(Number(0).following(), Number(1));
        assert_eq!(Number(0x00FF_FFFE).following(), Number(0x00FF_FFFF));
        assert_eq!(Number(0x00FF_FFFF).following(), Number(1));
    }
}
