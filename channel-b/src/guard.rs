//! The form of a cell, judged before any of its content is used (design 3.5).

use shm_schema::cell::{CRC_START, Header, Kind, Payload};
use shm_schema::exchange::{CellFault, Received, Sampled};
use shm_schema::wire::{Sink, Source, Wire};

/// Judges the cells of one kind and one axis.
#[derive(Debug, Clone, Copy)]
pub struct Guard {
    kind: Kind,
    axis: u8,
    boot_nonce: u32,
    /// Layout to reserved octets of a header that is right, as one number.
    fixed: u128,
    newest: Option<(u64, u64)>,
}

/// Where the fixed part of a header, its sequence and its time stamp begin.
const FIXED: usize = CRC_START;
const SEQUENCE: usize = FIXED + 16;
const TIMESTAMP: usize = SEQUENCE + 8;
const _: () = assert!(Header::LENGTH == TIMESTAMP + 8);

impl Guard {
    /// A guard for cells of `kind`, axis 1 to 64, of the run `boot_nonce`.
    pub fn new(kind: Kind, axis: u8, boot_nonce: u32) -> Self {
        let mut octets = [0; Header::LENGTH];
        Header::of(kind, axis, boot_nonce).put(&mut Sink::new(&mut octets));
        let fixed = chunk(&octets, FIXED).map_or(0, u128::from_le_bytes);
        Self { kind, axis, boot_nonce, fixed, newest: None }
    }

    /// Judges `octets` with `crc`, a CRC-32C over octets 8 to the end ([`crate::crc::crc32c`]
    /// or a hardware version of it).
    ///
    /// # Errors
    /// Why the cell is no information; the same cell read twice is no fault.
    pub fn check<T: Payload>(&mut self, octets: &[u8], crc: fn(&[u8]) -> u32) -> Received<T> {
        self.form::<T>(octets, crc)?;
        let stamps = (chunk(octets, SEQUENCE), chunk(octets, TIMESTAMP), chunk(octets, 0));
        let (Some(sequence), Some(timestamp), Some(sum)) = stamps else { return Err(CellFault::Length) };
        let (sequence, timestamp_ns) = (u64::from_le_bytes(sequence), u64::from_le_bytes(timestamp));
        self.order(sequence, timestamp_ns)?;
        let payload = T::read(octets).ok_or(CellFault::Content)?;
        self.newest = Some((sequence, timestamp_ns));
        Ok(Sampled { sequence, timestamp_ns, crc32: u32::from_le_bytes(sum), payload })
    }

    fn form<T: Payload>(&self, octets: &[u8], crc: fn(&[u8]) -> u32) -> Result<(), CellFault> {
        if octets.len() != T::CELL {
            return Err(CellFault::Length);
        }
        if octets.iter().take(Header::LENGTH).all(|octet| *octet == 0) {
            return Err(CellFault::Missing);
        }
        let covered = octets.get(CRC_START..).ok_or(CellFault::Length)?;
        let sum = octets.get(4..CRC_START).and_then(<[u8]>::first_chunk::<4>);
        if sum.map(|sum| u32::from_le_bytes(*sum)) != Some(crc(covered)) {
            return Err(CellFault::CheckSum);
        }
        // The usual case: everything fixed is as it has to be. Otherwise what is wrong is named.
        let is_right = chunk(octets, FIXED).map(u128::from_le_bytes) == Some(self.fixed);
        let is_kind = (self.kind.layout() == T::LAYOUT_HASH) & (self.kind.length() == T::CELL);
        if is_right & is_kind {
            return Ok(());
        }
        let header = Header::take(&mut Source::new(octets)).ok_or(CellFault::Content)?;
        self.identity::<T>(&header)
    }

    fn identity<T: Payload>(&self, header: &Header) -> Result<(), CellFault> {
        if header.layout != T::LAYOUT_HASH {
            return Err(CellFault::Layout);
        }
        if usize::from(header.length) != T::CELL {
            return Err(CellFault::Length);
        }
        let found = (header.kind, header.axis, header.writer, header.reserved);
        if found != (self.kind, self.axis, self.kind.writer(), [0; 3]) {
            return Err(CellFault::Foreign);
        }
        if header.boot_nonce != self.boot_nonce {
            return Err(CellFault::Nonce);
        }
        Ok(())
    }

    /// Sequence and time stamp go forward together or not at all.
    fn order(&self, sequence: u64, timestamp_ns: u64) -> Result<(), CellFault> {
        let fits = match self.newest {
            None => sequence != 0,
            Some((newest, newest_ns)) if sequence == newest => timestamp_ns == newest_ns,
            Some((newest, newest_ns)) => (sequence > newest) & (timestamp_ns >= newest_ns),
        };
        if fits { Ok(()) } else { Err(CellFault::Order) }
    }
}

/// `N` octets from `start` on.
fn chunk<const N: usize>(octets: &[u8], start: usize) -> Option<[u8; N]> {
    octets.get(start..)?.first_chunk().copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crc::{crc32, crc32c};
    use shm_schema::cell::seal;
    use shm_schema::inhibit::Readback;

    fn cell(sequence: u64, timestamp_ns: u64) -> [u8; Readback::CELL] {
        let header = Header {
            layout: Readback::LAYOUT_HASH,
            length: Readback::CELL as u16,
            kind: Kind::Readback,
            writer: Kind::Readback.writer(),
            boot_nonce: 77,
            axis: 3,
            sequence,
            timestamp_ns,
            ..Header::default()
        };
        let mut octets = [0; Readback::CELL];
        Readback { path_a: true, ..Readback::default() }.write(&header, &mut octets);
        seal(&mut octets, crc32, crc32c);
        octets
    }

    fn judge(guard: &mut Guard, octets: &[u8]) -> Result<u64, CellFault> {
        guard.check::<Readback>(octets, crc32c).map(|cell| cell.sequence)
    }

    #[test]
    fn a_sound_cell_passes_and_every_flipped_bit_is_refused() {
        let sound = cell(5, 1_000);
        assert_eq!(judge(&mut Guard::new(Kind::Readback, 3, 77), &sound), Ok(5));
        for bit in 32..8 * sound.len() {
            let mut torn = sound;
            torn[bit / 8] ^= 1 << (bit % 8);
            assert!(judge(&mut Guard::new(Kind::Readback, 3, 77), &torn).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn a_cell_of_another_axis_run_or_kind_is_refused() {
        let sound = cell(5, 1_000);
        let judged = |kind, axis, nonce| judge(&mut Guard::new(kind, axis, nonce), &sound);
        assert_eq!(judged(Kind::Readback, 4, 77), Err(CellFault::Foreign));
        assert_eq!(judged(Kind::InhibitA, 3, 77), Err(CellFault::Foreign));
        assert_eq!(judged(Kind::Readback, 3, 78), Err(CellFault::Nonce));
        assert_eq!(judge(&mut Guard::new(Kind::Readback, 3, 77), &sound[1..]), Err(CellFault::Length));
        let empty = [0; Readback::CELL];
        assert_eq!(judge(&mut Guard::new(Kind::Readback, 3, 77), &empty), Err(CellFault::Missing));
    }

    #[test]
    fn order_goes_forward_only_and_a_second_reading_is_no_fault() {
        let mut guard = Guard::new(Kind::Readback, 3, 77);
        assert_eq!(judge(&mut guard, &cell(5, 1_000)), Ok(5));
        assert_eq!(judge(&mut guard, &cell(5, 1_000)), Ok(5));
        assert_eq!(judge(&mut guard, &cell(5, 1_001)), Err(CellFault::Order));
        assert_eq!(judge(&mut guard, &cell(4, 2_000)), Err(CellFault::Order));
        assert_eq!(judge(&mut guard, &cell(6, 999)), Err(CellFault::Order));
        assert_eq!(judge(&mut guard, &cell(9, 2_000)), Ok(9));
    }
}
