//! The safety telegram of the basic protocol with three octets of CRC2
//! (black-channel 7.3 to 7.6).

use super::super::answer::Answer;
use super::super::division::TelegramCheck;

/// Largest number of F-data octets with three octets of CRC2.
pub(super) const LARGEST_DATA: usize = 12;

/// Octets behind the data: control or status, and CRC2.
const TRAILER: usize = 4;

/// The virtual consecutive number has 24 bits.
const LAST_NUMBER: u32 = 0xFF_FFFF;

/// The number after `number`: the last one is followed by 1, since 0 belongs to
/// the reset request (black-channel 7.5).
pub(super) const fn successor(number: u32) -> u32 {
    match number {
        LAST_NUMBER.. => 1,
        _ => number.wrapping_add(1),
    }
}

/// The control octet of the host, bits as in black-channel 7.6 (LNZ-BUS-10).
#[derive(Clone, Copy)]
pub(super) struct Control(pub(super) u8);

impl Control {
    pub(super) const fn resets_number(self) -> bool {
        self.0 & 1 << 2 != 0
    }

    pub(super) const fn activates_fail_safe_values(self) -> bool {
        self.0 & 1 << 4 != 0
    }

    pub(super) const fn toggle(self) -> bool {
        self.0 & 1 << 5 != 0
    }
}

/// A received telegram of the right length, not yet believed.
#[derive(Clone, Copy)]
pub(super) struct Telegram<'a> {
    pub(super) data: &'a [u8],
    pub(super) control: Control,
    check: u32,
}

impl<'a> Telegram<'a> {
    /// `None` unless there are exactly `octets` octets of data.
    pub(super) fn parse(image: &'a [u8], octets: usize) -> Option<Self> {
        let (data, trailer) = image.split_last_chunk::<TRAILER>()?;
        let [control, high, middle, low] = *trailer;
        let check = u32::from_be_bytes([0, high, middle, low]);
        (data.len() == octets).then_some(Self { data, control: Control(control), check })
    }

    /// Whether CRC2 is right for `number`, under the parameters of CRC1 `preset`.
    pub(super) fn is_checked_by(&self, preset: u16, number: u32) -> bool {
        let data = self.data.iter().rev().copied();
        self.check == check_2(preset, number, self.control.0, data)
    }
}

/// CRC2. The octets enter in reverse order, the consecutive number low octet
/// first behind them, and then one octet 00 (black-channel 7.4).
fn check_2(preset: u16, number: u32, octet: u8, reversed: impl Iterator<Item = u8>) -> u32 {
    let [low, middle, high, _] = number.to_le_bytes();
    TelegramCheck::preset(u32::from(preset))
        .then(octet)
        .then_all(reversed)
        .then_all([low, middle, high, 0])
        .value()
}

/// Writes a telegram with `octets` octets of `data`, zeros where it ends.
pub(super) fn compose(
    answer: &mut Answer,
    (preset, number): (u16, u32),
    status: u8,
    data: &[u8],
    octets: usize,
) {
    let mut padded = [0; LARGEST_DATA];
    padded.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    let padded = padded.get(..octets).unwrap_or(&[]);
    let check = check_2(preset, number, status, padded.iter().rev().copied());
    let [_, high, middle, low] = check.to_be_bytes();
    answer.clear();
    for octet in padded {
        answer.push(*octet);
    }
    answer.push(status);
    answer.push_check([high, middle, low]);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Black-channel 9.2: recorded at a device, CRC1 22FF.
    #[test]
    fn recorded_crc2_vectors_hold() {
        let first = [0x41, 0x01, 0, 4, 0, 0, 0, 0];
        let later = [0x41, 0x4D, 0, 4, 0, 0, 0, 0];
        let vectors = [
            (0x40, 0xBB_5FB5),
            (0x20, 0x81_1199),
            (0x00, 0xE1_8AA8),
            (0x20, 0xB5_474A),
            (0x00, 0xF5_CF7D),
            (0x20, 0xA1_029F),
            (0x00, 0x32_D777),
            (0x20, 0x66_1A95),
            (0x00, 0xDD_44D7),
            (0x20, 0x89_8935),
            (0x00, 0x1A_5CDD),
            (0x20, 0x4E_913F),
        ];
        for ((status, check), number) in vectors.into_iter().zip(0_u32..) {
            let data = if number < 2 { first } else { later };
            let mut answer = Answer::empty();
            compose(&mut answer, (0x22FF, number), status, &data, 8);
            let telegram = Telegram::parse(answer.octets(), 8).expect("12 octets");
            assert_eq!(telegram.check, check, "{number}");
            assert!(telegram.is_checked_by(0x22FF, number));
        }
    }

    /// Black-channel 7.5.
    #[test]
    fn the_last_number_is_followed_by_1() {
        assert_eq!(successor(0), 1);
        assert_eq!(successor(0xFF_FFFE), 0xFF_FFFF);
        assert_eq!(successor(0xFF_FFFF), 1);
    }
}
