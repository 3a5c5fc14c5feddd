//! The FSoE frame on the wire (black-channel 2.1, 2.2).

use super::super::answer::Answer;
use super::check::{Block, Link};

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

/// A received frame of the right length, not yet believed.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    pub(super) command: u8,
    /// Data blocks, each followed by its check sum.
    body: &'a [u8],
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
        Some(Self { command, body, connection_id })
    }

    /// The blocks with the check sums that came with them.
    fn blocks(&self) -> impl Iterator<Item = (Block, u16)> + Clone + use<'a> {
        // A body of three octets is the single block of a frame with one.
        let chunks = if self.body.len() == 3 { self.body.chunks(3) } else { self.body.chunks(4) };
        chunks.filter_map(|chunk| match *chunk {
            [d0, d1, low, high] => Some((Block::Pair([d0, d1]), u16::from_le_bytes([low, high]))),
            [d0, low, high] => Some((Block::Single(d0), u16::from_le_bytes([low, high]))),
            _ => None, // no length that `parse` lets pass leaves such a rest
        })
    }

    /// The safe data octets in their order; a single one is followed by a zero
    /// that nobody takes.
    pub(super) fn data(&self) -> impl Iterator<Item = u8> + Clone + use<'a> {
        self.blocks().flat_map(|(block, _)| match block {
            Block::Single(octet) => [octet, 0],
            Block::Pair(octets) => octets,
        })
    }

    /// Block 0 and the CRC_0 that came with it.
    pub(super) fn first(&self) -> (Block, u16) {
        self.blocks().next().unwrap_or((Block::Single(0), 0))
    }

    /// Whether every check sum is the one that `link` demands, of which
    /// `first_check` is CRC_0.
    pub(super) fn is_checked_by(&self, link: Link, first_check: u16) -> bool {
        let (_, received) = self.first();
        if received != first_check {
            return false;
        }
        let further = link.further_checks(self.command);
        let mut blocks = self.blocks().zip(0_u16..).skip(1);
        blocks.all(|((block, check), index)| check == further.of(index, block))
    }
}

/// The first block of a frame of `size` octets that begins with `data`.
pub(super) fn first_block(size: DataSize, mut data: impl Iterator<Item = u8>) -> Block {
    let low = data.next().unwrap_or(0);
    match size.octets() {
        1 => Block::Single(low),
        _ => Block::Pair([low, data.next().unwrap_or(0)]),
    }
}

/// Writes a whole frame with `size` octets taken from `data`, zeros where it
/// ends; `first_check` is the CRC_0 that `link` gives it.
pub(super) fn compose(
    answer: &mut Answer,
    (size, command): (DataSize, u8),
    (link, first_check): (Link, u16),
    data: impl Iterator<Item = u8>,
) {
    let mut octets = [0; LARGEST_DATA];
    octets.iter_mut().zip(data).for_each(|(to, from)| *to = from);
    answer.clear();
    answer.push(command);
    if let Block::Single(octet) = first_block(size, octets.into_iter()) {
        answer.push(octet);
        answer.push_check(first_check.to_le_bytes());
    }
    // No pair for a single octet: half of one is none.
    let (pairs, _) = octets.as_chunks::<2>();
    let further = link.further_checks(command);
    for (pair, index) in pairs.iter().zip(0_u16..).take(size.octets() >> 1) {
        let check = match index {
            0 => first_check,
            _ => further.of(index, Block::Pair(*pair)),
        };
        for octet in pair {
            answer.push(*octet);
        }
        answer.push_check(check.to_le_bytes());
    }
    link.connection_id.to_le_bytes().into_iter().for_each(|octet| answer.push(octet));
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
