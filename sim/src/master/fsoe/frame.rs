//! Octets of a frame and their check sums (black-channel.md 2.1, 2.4).

use crc::{Algorithm, Crc};

/// Generator 139B7: start 0, not reflected, not inverted.
const GENERATOR: Algorithm<u16> = Algorithm {
    width: 16,
    poly: 0x39B7,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0,
    check: 0,
    residue: 0,
};
const CRC: Crc<u16> = Crc::<u16>::new(&GENERATOR);

/// What goes into the check sums and is not in the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Implicit {
    /// CRC_0 of the partner's last frame.
    pub inherited: u16,
    /// Number of this frame in its direction.
    pub number: u16,
}

/// The inputs of a Reset and of the first Session frame.
pub const FRESH: Implicit = Implicit { inherited: 0, number: 1 };

/// Octets of a frame with `data` safe octets.
pub const fn length(data: usize) -> usize {
    if data == 1 { 6 } else { 2 * data + 3 }
}

/// A frame taken apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// First octet.
    pub command: u8,
    /// Safe data.
    pub data: Vec<u8>,
    /// One check sum for each block.
    pub check_sums: Vec<u16>,
    /// Last two octets.
    pub connection_id: u16,
}

impl Frame {
    /// Takes a frame of `data` safe octets apart; `None` when the length is another.
    pub fn parse(image: &[u8], data: usize) -> Option<Self> {
        let (command, rest) = image.split_first()?;
        let (blocks, id) = rest.split_last_chunk::<2>()?;
        let width = data.min(2);
        let mut frame = Self {
            command: *command,
            data: Vec::new(),
            check_sums: Vec::new(),
            connection_id: u16::from_le_bytes(*id),
        };
        for block in blocks.chunks(width + 2) {
            let (octets, sum) = block.split_last_chunk::<2>()?;
            frame.data.extend(octets);
            frame.check_sums.push(u16::from_le_bytes(*sum));
        }
        (image.len() == length(data)).then_some(frame)
    }

    /// Puts a frame together, with the check sums these inputs give.
    pub fn build(command: u8, data: &[u8], connection_id: u16, implicit: Implicit) -> Self {
        let blocks = data.chunks(2).enumerate();
        let sum = |(index, block)| check_sum(implicit, connection_id, command, index, block);
        Self { command, data: data.to_vec(), check_sums: blocks.map(sum).collect(), connection_id }
    }

    /// The frame as it goes over the bus.
    pub fn octets(&self) -> Vec<u8> {
        let mut octets = vec![self.command];
        for (block, sum) in self.data.chunks(2).zip(&self.check_sums) {
            octets.extend(block);
            octets.extend(sum.to_le_bytes());
        }
        octets.extend(self.connection_id.to_le_bytes());
        octets
    }

    /// The check sum that the partner inherits.
    pub fn first_check_sum(&self) -> u16 {
        self.check_sums.first().copied().unwrap_or(0)
    }
}

/// The Reset frame: a constant for each length (2.5).
pub fn reset(code: u8, data: usize) -> Frame {
    let mut octets = vec![0; data];
    octets[0] = code;
    Frame::build(super::command::RESET, &octets, 0, FRESH)
}

/// CRC of one block, octet for octet in the order of 2.4.
pub fn check_sum(implicit: Implicit, connection_id: u16, command: u8, index: usize, block: &[u8]) -> u16 {
    let mut digest = CRC.digest();
    digest.update(&implicit.inherited.to_le_bytes());
    digest.update(&connection_id.to_le_bytes());
    digest.update(&implicit.number.to_le_bytes());
    digest.update(&[command]);
    if index > 0 {
        digest.update(&(index as u16).to_le_bytes());
    }
    digest.update(block);
    digest.update(&[0; 3]);
    digest.finalize()
}
