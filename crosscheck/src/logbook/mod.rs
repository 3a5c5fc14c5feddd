//! The logbook: what happened, kept so that it can be proved later.
//!
//! The cycle hands over one [`Moment`] for each axis through a bounded ring without locks
//! ([`ring`]); when the ring is full the moment is dropped and counted, the cycle never waits.
//! A thread of normal priority ([`recorder`]) keeps the last second of every axis, notices
//! changes and trips and appends records to a file ([`book`]).
//!
//! **Format.** A file begins with a head: the text `SPLOG1`, two zero octets, the hash the
//! chain comes from (32 octets), the number of the first record (8), CRC-32 (4). Each record
//! is: `SPLR`, octets of the body (4), number (8), time since 1970, ns (8), the body, SHA-256
//! over the hash before and everything of this record so far, CRC-32 over the whole record so
//! far. All numbers are little endian. Beside the file stands `<file>.head` with number and
//! hash of the newest record in two slots written in turn, so that records cut off at the end
//! are missed.
//!
//! **Size.** A full file is renamed to `<file>.<number of its first record>` and the chain goes
//! on in a new one. 16 files of 64 MiB are kept, 1 GiB in all: a trip with its second of data
//! takes up to 140 KiB, 45 KiB in steady motion, so that five years hold 12 trips a day beside
//! 50 other records a day. The oldest file goes first, and what is gone is named.
//!
//! **Against whom.** Check sums and chain show damage, loss and careless editing. Someone who
//! rewrites file and `<file>.head` together with all hashes is shown only by a copy of a hash
//! kept elsewhere, which is why every export states the newest one.

pub mod book;
pub mod export;
pub mod lenze;
pub mod moment;
pub mod record;
pub mod recorder;
pub mod ring;
pub mod verify;

#[cfg(test)]
mod tests;

pub use book::{Book, Size};
pub use moment::Moment;
pub use record::{Entry, Record};
pub use verify::{Findings, verify};
