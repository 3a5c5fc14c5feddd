//! The form of a cell: every octet is checked before one is believed (design 3.5).
//!
//! Code of its own, as in each channel. Crosscheck checks CRC-32; the age is judged in the
//! step, where the time is known.

use crc::{CRC_32_ISCSI, CRC_32_ISO_HDLC, Crc, Table};
use shm_schema::cell::{CRC_START, Header, Kind, Payload};
use shm_schema::exchange::{CellFault, Received, Sampled};
use shm_schema::wire::{Source, Wire};

static CRC32: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);
static CRC32C: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISCSI);

/// CRC-32 (ISO-HDLC) of `octets`.
pub fn crc32(octets: &[u8]) -> u32 {
    reflected(CRC32.table(), octets)
}

/// CRC-32C (iSCSI) of `octets`.
pub fn crc32c(octets: &[u8]) -> u32 {
    reflected(CRC32C.table(), octets)
}

/// Walks the library's tables, 16 octets at a time; its own walk can panic as far as the
/// compiler knows. Table n is for an octet that n others follow.
fn reflected(tables: &[[u32; 256]; 16], octets: &[u8]) -> u32 {
    let (blocks, rest) = octets.as_chunks::<16>();
    let mut sum = u32::MAX;
    for block in blocks {
        let mut mixed = *block;
        for (octet, part) in mixed.iter_mut().zip(sum.to_le_bytes()) {
            *octet ^= part;
        }
        sum = 0;
        for (table, octet) in tables.iter().rev().zip(mixed) {
            sum ^= table[usize::from(octet)];
        }
    }
    let [last, ..] = tables;
    for octet in rest {
        sum = sum >> 8 ^ last[usize::from(sum as u8 ^ octet)];
    }
    !sum
}

/// Judges the cells of one kind and axis.
#[derive(Debug, Clone, Copy)]
pub struct Guard {
    kind: Kind,
    axis: u8,
    boot_nonce: u32,
    sequence: u64,
    timestamp_ns: u64,
}

impl Guard {
    /// A guard for cells of `kind` of `axis` (1 to 64) in the run `boot_nonce`.
    pub const fn new(kind: Kind, axis: u8, boot_nonce: u32) -> Self {
        Self { kind, axis, boot_nonce, sequence: 0, timestamp_ns: 0 }
    }

    /// The content of a cell, or why it is no information. The same cell again is fine:
    /// whether it is too old is not a matter of form. `crc` computes CRC-32 (ISO-HDLC).
    pub fn check<T: Payload>(&mut self, octets: &[u8], crc: fn(&[u8]) -> u32) -> Received<T> {
        if octets.len() != T::CELL {
            return Err(CellFault::Length);
        }
        let mut source = Source::new(octets);
        let covered = octets.get(CRC_START..).ok_or(CellFault::Length)?;
        let Some(header) = Header::take(&mut source) else {
            // An unknown kind or writer: damaged, unless the check sum says it was meant.
            return Err(Self::unreadable(octets, covered, crc));
        };
        if header.length == 0 {
            return Err(CellFault::Missing);
        }
        if header.crc32 != crc(covered) {
            return Err(CellFault::CheckSum);
        }
        self.origin(&header, T::LAYOUT_HASH, octets.len())?;
        let payload = T::read(octets).ok_or(CellFault::Content)?;
        self.order(&header)?;
        Ok(Sampled {
            sequence: header.sequence,
            timestamp_ns: header.timestamp_ns,
            crc32: header.crc32,
            payload,
        })
    }

    fn unreadable(octets: &[u8], covered: &[u8], crc: fn(&[u8]) -> u32) -> CellFault {
        let stored = octets.first_chunk::<4>().map(|sum| u32::from_le_bytes(*sum));
        if stored == Some(crc(covered)) { CellFault::Content } else { CellFault::CheckSum }
    }

    fn origin(&self, header: &Header, layout: u32, length: usize) -> Result<(), CellFault> {
        if header.layout != layout {
            return Err(CellFault::Layout);
        }
        if usize::from(header.length) != length {
            return Err(CellFault::Length);
        }
        let named = (header.kind, header.axis, header.writer);
        if named != (self.kind, self.axis, self.kind.writer()) {
            return Err(CellFault::Foreign);
        }
        if header.boot_nonce != self.boot_nonce {
            return Err(CellFault::Nonce);
        }
        Ok(())
    }

    fn order(&mut self, header: &Header) -> Result<(), CellFault> {
        let unwritten = header.sequence == 0;
        let backwards = header.sequence < self.sequence;
        let earlier = header.timestamp_ns < self.timestamp_ns;
        if unwritten | backwards | earlier {
            return Err(CellFault::Order);
        }
        self.sequence = header.sequence;
        self.timestamp_ns = header.timestamp_ns;
        Ok(())
    }
}
