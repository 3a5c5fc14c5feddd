//! The form of a cell: check sum, layout, length, kind, axis, writer, boot nonce, order
//! (design 3.5). What a cell says, and whether it is fresh, is judged in the step.

pub use crate::crc32::crc32;

use shm_schema::cell::{CRC_START, Header, Kind, Payload};
use shm_schema::exchange::{CellFault, Received, Sampled};
use shm_schema::wire::{Source, Wire};

/// Judges one cell of one axis, cycle by cycle.
#[derive(Debug, Clone)]
pub struct Guard {
    kind: Kind,
    axis: u8,
    boot_nonce: u32,
    sequence: u64,
    timestamp_ns: u64,
}

impl Guard {
    /// A guard that has seen nothing yet.
    pub fn new(kind: Kind, axis: u8, boot_nonce: u32) -> Self {
        Self { kind, axis, boot_nonce, sequence: 0, timestamp_ns: 0 }
    }

    /// The payload of `octets`, or why it is no information. `crc` is CRC-32 (ISO-HDLC).
    ///
    /// # Errors
    /// The first fault found, in the order length, check sum, layout, origin, nonce, order, content.
    pub fn check<T: Payload>(&mut self, octets: &[u8], crc: fn(&[u8]) -> u32) -> Received<T> {
        if octets.len() != T::CELL {
            return Err(CellFault::Length);
        }
        let header = Header::take(&mut Source::new(octets)).ok_or(CellFault::Content)?;
        if header.sequence == 0 {
            return Err(CellFault::Missing);
        }
        let covered = octets.get(CRC_START..).ok_or(CellFault::Length)?;
        if crc(covered) != header.crc32 {
            return Err(CellFault::CheckSum);
        }
        self.form(&header, T::LAYOUT_HASH, T::CELL)?;
        let payload = T::read(octets).ok_or(CellFault::Content)?;
        self.sequence = header.sequence;
        self.timestamp_ns = header.timestamp_ns;
        Ok(Sampled {
            sequence: header.sequence,
            timestamp_ns: header.timestamp_ns,
            crc32: header.crc32,
            payload,
        })
    }

    fn form(&self, header: &Header, layout: u32, length: usize) -> Result<(), CellFault> {
        let origin = (header.kind, header.axis, header.writer);
        if header.layout != layout {
            return Err(CellFault::Layout);
        }
        if usize::from(header.length) != length {
            return Err(CellFault::Length);
        }
        if origin != (self.kind, self.axis, self.kind.writer()) {
            return Err(CellFault::Foreign);
        }
        if header.reserved != [0; 3] {
            return Err(CellFault::Content);
        }
        if header.boot_nonce != self.boot_nonce {
            return Err(CellFault::Nonce);
        }
        self.order(header)
    }

    fn order(&self, header: &Header) -> Result<(), CellFault> {
        let sequence_back = header.sequence < self.sequence;
        let time_back = header.timestamp_ns < self.timestamp_ns;
        if sequence_back | time_back { Err(CellFault::Order) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shm_schema::cell::{Writer, seal};
    use shm_schema::inhibit::Readback;

    fn cell(change: impl Fn(&mut Header)) -> [u8; Readback::CELL] {
        let mut header = Header {
            layout: Readback::LAYOUT_HASH,
            length: Readback::CELL as u16,
            kind: Kind::Readback,
            writer: Writer::Producer,
            boot_nonce: 7,
            axis: 1,
            sequence: 5,
            timestamp_ns: 1_000,
            ..Header::default()
        };
        change(&mut header);
        let mut octets = [0; Readback::CELL];
        Readback { path_a: true, ..Readback::default() }.write(&header, &mut octets);
        seal(&mut octets, crc32, |_| 0);
        octets
    }

    fn judge(octets: &[u8]) -> Result<u64, CellFault> {
        let mut guard = Guard::new(Kind::Readback, 1, 7);
        guard.check::<Readback>(octets, crc32).map(|cell| cell.sequence)
    }

    #[test]
    fn a_sound_cell_passes_and_every_flaw_has_its_name() {
        assert_eq!(judge(&cell(|_| {})), Ok(5));
        assert_eq!(judge(&cell(|h| h.layout ^= 1)), Err(CellFault::Layout));
        assert_eq!(judge(&cell(|h| h.axis = 2)), Err(CellFault::Foreign));
        assert_eq!(judge(&cell(|h| h.writer = Writer::Gateway)), Err(CellFault::Foreign));
        assert_eq!(judge(&cell(|h| h.boot_nonce = 8)), Err(CellFault::Nonce));
        assert_eq!(judge(&cell(|h| h.sequence = 0)), Err(CellFault::Missing));
        assert_eq!(judge(&[0; 3]), Err(CellFault::Length));
    }

    #[test]
    fn every_flipped_bit_is_found() {
        let sound = cell(|_| {});
        for bit in 0..8 * sound.len() {
            let mut octets = sound;
            octets[bit / 8] ^= 1 << (bit % 8);
            let crc32c_only = (4..8).contains(&(bit / 8));
            assert_eq!(judge(&octets).is_ok(), crc32c_only, "bit {bit}");
        }
    }

    #[test]
    fn a_cell_that_goes_backwards_is_refused() {
        let mut guard = Guard::new(Kind::Readback, 1, 7);
        assert!(guard.check::<Readback>(&cell(|_| {}), crc32).is_ok());
        let older = cell(|h| h.sequence = 4);
        assert_eq!(guard.check::<Readback>(&older, crc32).err(), Some(CellFault::Order));
    }
}
