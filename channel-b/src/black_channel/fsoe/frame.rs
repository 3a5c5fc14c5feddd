//! The FSoE frame on the wire (black-channel 2.1 to 2.5).

use core::slice::Chunks;

use super::super::answer::Answer;
use super::super::division::FrameCheck;

/// Largest number of safe data octets of one direction.
pub(super) const LARGEST_DATA: usize = 126;

/// Number of safe data octets of one direction: 1, or even and at most 126.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DataSize(u8);

impl DataSize {
    /// `None` for a size that no frame can carry.
    pub(super) fn new(octets: usize) -> Option<Self> {
        let is_whole = octets == 1 || octets & 1 == 0;
        let in_range = (1..=LARGEST_DATA).contains(&octets);
        (in_range && is_whole).then_some(Self(octets as u8))
    }

    pub(super) const fn octets(self) -> usize {
        self.0 as usize
    }

    /// Octets of a whole frame.
    pub(super) const fn frame_length(self) -> usize {
        match self.0 {
            1 => 6,
            octets => (octets as usize).wrapping_mul(2).wrapping_add(3),
        }
    }
}

/// What a command octet asks for (black-channel 2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    /// 0: the bus has just started and nobody has written yet.
    Idle,
    Reset,
    Session,
    Connection,
    Parameter,
    ProcessData,
    FailSafeData,
    Unknown,
}

impl Command {
    pub(super) const fn of(octet: u8) -> Self {
        match octet {
            0x00 => Self::Idle,
            0x2A => Self::Reset,
            0x4E => Self::Session,
            0x64 => Self::Connection,
            0x52 => Self::Parameter,
            0x36 => Self::ProcessData,
            0x08 => Self::FailSafeData,
            _ => Self::Unknown,
        }
    }

    /// The octet on the wire.
    pub(super) const fn octet(self) -> u8 {
        match self {
            Self::Idle | Self::Unknown => 0x00,
            Self::Reset => 0x2A,
            Self::Session => 0x4E,
            Self::Connection => 0x64,
            Self::Parameter => 0x52,
            Self::ProcessData => 0x36,
            Self::FailSafeData => 0x08,
        }
    }
}

/// Everything that enters the check sums without being data: all CRCs of one
/// frame share it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    /// CRC_0 of the partner's last frame.
    pub(super) inherited: u16,
    pub(super) connection_id: u16,
    /// Sequence number of this direction, never 0.
    pub(super) number: u16,
}

impl Link {
    /// The beginning of every chain: Reset frames and the first Session frame.
    pub(super) const ORIGIN: Self = Self { inherited: 0, connection_id: 0, number: 1 };

    /// The division after the octets that all blocks have in common.
    fn opening(self, command: u8) -> FrameCheck {
        FrameCheck::preset(0)
            .then_low_first(self.inherited)
            .then_low_first(self.connection_id)
            .then_low_first(self.number)
            .then(command)
    }

    /// CRC_0 of a frame that begins with the octets `block`.
    pub(super) fn first_check(self, command: u8, block: impl IntoIterator<Item = u8>) -> u16 {
        block_check(self.opening(command), 0, block)
    }

    /// This link with the number that follows `last`, stepped on once more when
    /// CRC_0 would repeat `avoided` (collision rule, black-channel 2.5).
    ///
    /// One more step is always enough: two numbers differ by a polynomial of
    /// degree below 16, which the generator, odd and of degree 16, never divides.
    pub(super) fn numbered(
        self,
        last: u16,
        avoided: u16,
        command: u8,
        block: impl Iterator<Item = u8>,
    ) -> Self {
        let next = Self { number: successor(last), ..self };
        if next.first_check(command, block) == avoided {
            return Self { number: successor(next.number), ..self };
        }
        next
    }
}

/// The number after `number`: 65,535 is followed by 1, 0 is never used.
pub(super) const fn successor(number: u16) -> u16 {
    match number {
        u16::MAX => 1,
        _ => number.wrapping_add(1),
    }
}

fn block_check(opening: FrameCheck, index: u16, block: impl IntoIterator<Item = u8>) -> u16 {
    let indexed = match index {
        0 => opening, // block 0 carries no index word (trap of black-channel 14)
        _ => opening.then_low_first(index),
    };
    indexed.then_all(block).then_all([0; 3]).value() as u16
}

/// A received frame of the right length, not yet believed.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    pub(super) command: u8,
    /// Data blocks, each followed by its check sum.
    body: &'a [u8],
    is_single: bool,
    pub(super) connection_id: u16,
}

impl<'a> Frame<'a> {
    /// `None` for a length that fits no frame of this direction: the content is
    /// not even looked at.
    pub(super) fn parse(image: &'a [u8], size: DataSize) -> Option<Self> {
        if image.len() != size.frame_length() {
            return None;
        }
        let (&command, rest) = image.split_first()?;
        let (body, connection_id) = rest.split_last_chunk::<2>()?;
        let connection_id = u16::from_le_bytes(*connection_id);
        Some(Self { command, body, is_single: size.octets() == 1, connection_id })
    }

    fn blocks(&self) -> Chunks<'a, u8> {
        if self.is_single { self.body.chunks(3) } else { self.body.chunks(4) }
    }

    /// The safe data octets in their order.
    pub(super) fn data(&self) -> impl Iterator<Item = u8> + Clone + use<'a> {
        self.blocks().flat_map(|block| split_block(block).0.iter().copied())
    }

    /// The data octets of block 0.
    pub(super) fn first_block(&self) -> impl Iterator<Item = u8> + use<'a> {
        let width = if self.is_single { 1 } else { 2 };
        self.data().take(width)
    }

    /// Whether every check sum is the one that `link` demands.
    pub(super) fn is_checked_by(&self, link: Link) -> bool {
        let opening = link.opening(self.command);
        self.blocks().zip(0_u16..).all(|(block, index)| {
            let (data, check) = split_block(block);
            check == Some(block_check(opening, index, data.iter().copied()))
        })
    }
}

fn split_block(block: &[u8]) -> (&[u8], Option<u16>) {
    match block.split_last_chunk::<2>() {
        Some((data, check)) => (data, Some(u16::from_le_bytes(*check))),
        None => (&[], None),
    }
}

/// Writes a whole frame with `size` octets taken from `data`, zeros where it ends.
pub(super) fn compose(
    answer: &mut Answer,
    size: DataSize,
    command: u8,
    link: Link,
    data: impl Iterator<Item = u8>,
) {
    let opening = link.opening(command);
    let width: usize = if size.octets() == 1 { 1 } else { 2 };
    let mut octets = data.chain(core::iter::repeat(0)).take(size.octets());
    answer.clear();
    answer.push(command);
    for index in 0_u16..(LARGEST_DATA as u16) {
        let Some(low) = octets.next() else { break };
        let block = [low, octets.next().unwrap_or(0)];
        let block = block.iter().copied().take(width);
        block.clone().for_each(|octet| answer.push(octet));
        answer.push_check(block_check(opening, index, block).to_le_bytes());
    }
    link.connection_id.to_le_bytes().into_iter().for_each(|octet| answer.push(octet));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Black-channel 4.1.
    #[test]
    fn single_check_sum_vectors_hold() {
        let origin = Link::ORIGIN;
        assert_eq!(origin.first_check(0x4E, [0x12, 0x34]), 0x4D07);
        assert_eq!(origin.first_check(0x4E, [0x12]), 0xA176);
        let link = Link { inherited: 0xABCD, connection_id: 7, number: 2 };
        assert_eq!(block_check(link.opening(0x36), 1, [0xDE, 0xAD]), 0xBC47);
    }

    /// Black-channel 2.1: 1, or even and at most 126.
    #[test]
    fn only_sizes_that_a_frame_can_carry_are_accepted() {
        for octets in 0..200 {
            let expected = octets == 1 || (2..=126).step_by(2).any(|even| even == octets);
            assert_eq!(DataSize::new(octets).is_some(), expected, "{octets}");
        }
        assert_eq!(DataSize::new(1).map(DataSize::frame_length), Some(6));
        assert_eq!(DataSize::new(12).map(DataSize::frame_length), Some(27));
        assert_eq!(DataSize::new(126).map(DataSize::frame_length), Some(255));
    }

    /// Black-channel 2.5.
    #[test]
    fn number_65535_is_followed_by_1() {
        assert_eq!(successor(0), 1);
        assert_eq!(successor(65_534), 65_535);
        assert_eq!(successor(65_535), 1);
    }

    /// The proof in the comment of `numbered`, by trying all of them.
    #[test]
    fn all_sequence_numbers_give_different_check_sums() {
        extern crate std;
        let mut seen = std::vec![false; 65_536];
        for number in 1..=u16::MAX {
            let check = Link { inherited: 5, connection_id: 7, number }.first_check(0x36, [1, 2]);
            assert!(!core::mem::replace(&mut seen[usize::from(check)], true));
        }
    }

    #[test]
    fn a_collision_steps_the_number_on_once_more() {
        let link = Link { inherited: 0x1111, connection_id: 7, number: 0 };
        let plain = link.numbered(9, 0, 0x36, [1, 2].into_iter());
        assert_eq!(plain.number, 10);
        let repeated = plain.first_check(0x36, [1, 2]);
        let stepped = link.numbered(9, repeated, 0x36, [1, 2].into_iter());
        assert_eq!(stepped.number, 11);
        let at_wrap = Link { number: 65_535, ..link }.first_check(0x36, [1, 2]);
        assert_eq!(link.numbered(65_534, at_wrap, 0x36, [1, 2].into_iter()).number, 1);
    }
}
