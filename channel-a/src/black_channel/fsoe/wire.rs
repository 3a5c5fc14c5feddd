//! FSoE frames: commands, lengths, blocks (black-channel.md 2.1 to 2.4).

use super::super::answer::{Answer, Data, Layout};
use super::super::crc::FsoeSum;

/// Command octets of black-channel.md 2.2.
pub(super) mod command {
    pub(in super::super) const PROCESS_DATA: u8 = 0x36;
    pub(in super::super) const RESET: u8 = 0x2A;
    pub(in super::super) const SESSION: u8 = 0x4E;
    pub(in super::super) const CONNECTION: u8 = 0x64;
    pub(in super::super) const PARAMETER: u8 = 0x52;
    pub(in super::super) const FAIL_SAFE_DATA: u8 = 0x08;
    /// Not a command: the bus has just started (3.2).
    pub(in super::super) const NONE: u8 = 0;
}

/// Number of safe data octets of one direction: 1, or even up to 126.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DataLength(u8);

impl DataLength {
    pub(super) const fn new(octets: u8) -> Option<Self> {
        match octets {
            1 => Some(Self(1)),
            2..=126 if octets & 1 == 0 => Some(Self(octets)),
            _ => None,
        }
    }

    pub(super) fn octets(self) -> usize {
        usize::from(self.0)
    }

    pub(super) fn frame(self) -> usize {
        match self.0 {
            1 => 6,
            octets => usize::from(octets).saturating_mul(2).saturating_add(3),
        }
    }

    fn layout(self) -> Layout {
        match self.0 {
            1 => Layout::FsoeSingle,
            _ => Layout::FsoeBlocks,
        }
    }
}

/// What every check sum of one frame begins with (2.4, items 1 to 3).
#[derive(Clone, Copy)]
pub(super) struct Link {
    pub(super) inherited: u16,
    pub(super) conn_id: u16,
    pub(super) number: u16,
}

impl Link {
    fn begin(self, command: u8) -> FsoeSum {
        FsoeSum::start().word(self.inherited).word(self.conn_id).word(self.number).octet(command)
    }
}

/// Block 0 carries no index (trap of black-channel.md 14).
fn block_sum(begin: FsoeSum, index: u16, data: &[u8]) -> u16 {
    let indexed = match index {
        0 => begin,
        _ => begin.word(index),
    };
    indexed.octets(data).finish()
}

/// A received frame of the right length, its check sums not yet judged.
pub(super) struct Received<'frame> {
    command: u8,
    conn_id: u16,
    body: &'frame [u8],
    length: DataLength,
}

impl<'frame> Received<'frame> {
    pub(super) fn parse(octets: &'frame [u8], length: DataLength) -> Option<Self> {
        if octets.len() != length.frame() {
            return None;
        }
        let (command, rest) = octets.split_first()?;
        let (body, conn_id) = rest.split_last_chunk::<2>()?;
        Some(Self { command: *command, conn_id: u16::from_le_bytes(*conn_id), body, length })
    }

    pub(super) const fn command(&self) -> u8 {
        self.command
    }

    pub(super) const fn conn_id(&self) -> u16 {
        self.conn_id
    }

    /// Data octets and check sum of each block.
    fn blocks(&self) -> impl Iterator<Item = (&'frame [u8], u16)> {
        let blocks = match self.length.0 {
            1 => self.body.chunks_exact(3),
            _ => self.body.chunks_exact(4),
        };
        blocks.filter_map(|block| {
            let (data, sum) = block.split_last_chunk::<2>()?;
            Some((data, u16::from_le_bytes(*sum)))
        })
    }

    /// Safe data without the check sums between them.
    pub(super) fn data(&self) -> Data {
        let octets = self.blocks().flat_map(|(data, _)| data.iter().copied());
        Data::from_octets(self.length.octets(), octets)
    }

    /// First check sum as received; the next link of the chain.
    pub(super) fn crc_0(&self) -> u16 {
        self.blocks().next().map_or(0, |(_, sum)| sum)
    }

    /// First check sum as it ought to be under `link`.
    pub(super) fn expected_crc_0(&self, link: Link) -> u16 {
        let first = self.blocks().next().map_or(&[] as &[u8], |(data, _)| data);
        block_sum(link.begin(self.command), 0, first)
    }

    /// Whether every check sum is right under `link`.
    pub(super) fn is_linked_by(&self, link: Link) -> bool {
        let begin = link.begin(self.command);
        (0_u16..).zip(self.blocks()).all(|(index, (data, sum))| block_sum(begin, index, data) == sum)
    }
}

/// A frame to send, before its check sums are known.
pub(super) struct Draft {
    pub(super) command: u8,
    pub(super) data: Data,
    pub(super) length: DataLength,
}

impl Draft {
    /// A frame whose data octets are `octets`, filled up with zeros.
    pub(super) fn new(command: u8, length: DataLength, octets: &[u8]) -> Self {
        Self { command, data: Data::from_octets(length.octets(), octets.iter().copied()), length }
    }

    pub(super) fn crc_0(&self, link: Link) -> u16 {
        let first = self.data.octets().chunks(2).next().unwrap_or(&[]);
        block_sum(link.begin(self.command), 0, first)
    }

    pub(super) fn seal(&self, link: Link) -> Answer {
        let begin = link.begin(self.command);
        let mut answer = Answer::empty(self.length.layout());
        answer.push(&[self.command]);
        for (index, data) in (0_u16..).zip(self.data.octets().chunks(2)) {
            answer.push(data);
            answer.push(&block_sum(begin, index, data).to_le_bytes());
        }
        answer.push(&link.conn_id.to_le_bytes());
        answer
    }
}
