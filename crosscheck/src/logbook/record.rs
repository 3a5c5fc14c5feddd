//! Records: their content, their octets, their chain.

use std::string::String;
use std::vec::Vec;

use sha2::{Digest, Sha256};

use super::moment::{Moment, WORDS};
use crate::guard::crc32;

/// Start of every record.
pub const MAGIC: [u8; 4] = *b"SPLR";
/// Octets in front of the body.
pub const FRONT: usize = 24;
/// Octets behind the body: hash and check sum.
pub const BACK: usize = 36;
/// Longest body believed, octets; more is damage.
pub const BODY_MAX: usize = 4 * 1024 * 1024;

/// A link of the chain.
pub type Hash = [u8; 32];

/// What a record says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Entry {
    /// The set started: version of the program, boot nonce, and of each axis number, profile
    /// and content signature.
    Start {
        /// Version and build of the program.
        version: String,
        /// Boot nonce of the run.
        nonce: u32,
        /// Axis, profile octet, content signature.
        axes: Vec<(u8, u8, u32)>,
    },
    /// State or codes of an axis changed.
    Change(Moment),
    /// A trip, with the second that led to it, oldest first.
    Trip {
        /// The cycle of the trip.
        moment: Moment,
        /// Up to one second before, the cycle of the trip included.
        second: Vec<Moment>,
    },
    /// Somebody did something, or the logbook repaired itself.
    Intervention(String),
    /// Moments that did not fit into the ring, changes that came too fast.
    Lost {
        /// Moments dropped by the ring.
        moments: u64,
        /// Changes not recorded, because there were too many in one second.
        changes: u64,
    },
    /// The set ended in order.
    End,
}

/// A record as read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    /// Number, from 1 without gaps.
    pub number: u64,
    /// Time since 1970, ns.
    pub unix_ns: u64,
    /// Its content; `None`: of a kind this version does not know.
    pub entry: Option<Entry>,
    /// Its link of the chain.
    pub hash: Hash,
}

/// A record as octets, and its link.
pub fn compose(number: u64, unix_ns: u64, entry: &Entry, before: &Hash) -> (Vec<u8>, Hash) {
    let body = body(entry);
    let mut octets = Vec::with_capacity(FRONT + body.len() + BACK);
    octets.extend(MAGIC);
    octets.extend((body.len() as u32).to_le_bytes());
    octets.extend(number.to_le_bytes());
    octets.extend(unix_ns.to_le_bytes());
    octets.extend(body);
    let hash = link(before, &octets);
    octets.extend(hash);
    octets.extend(crc32(&octets).to_le_bytes());
    (octets, hash)
}

fn link(before: &Hash, octets: &[u8]) -> Hash {
    Sha256::new().chain_update(before).chain_update(octets).finalize().into()
}

/// The record at the start of `octets` and its length, or why there is none.
pub fn parse(octets: &[u8]) -> Result<(Record, usize), Broken> {
    let front = octets.first_chunk::<FRONT>().ok_or(Broken::Short)?;
    let mut numbers = front.as_chunks::<8>().0.iter().map(|chunk| u64::from_le_bytes(*chunk));
    let (start, number, unix_ns) = (numbers.next(), numbers.next(), numbers.next());
    let start = start.unwrap_or(0);
    if (start as u32).to_le_bytes() != MAGIC {
        return Err(Broken::Start);
    }
    let length = (start >> 32) as usize;
    if length > BODY_MAX {
        return Err(Broken::Start);
    }
    let whole = octets.get(..FRONT + length + BACK).ok_or(Broken::Short)?;
    let (covered, sum) = whole.split_last_chunk::<4>().ok_or(Broken::Short)?;
    if crc32(covered) != u32::from_le_bytes(*sum) {
        return Err(Broken::CheckSum);
    }
    let (_, hash) = covered.split_last_chunk::<32>().ok_or(Broken::Short)?;
    let body = covered.get(FRONT..FRONT + length).ok_or(Broken::Short)?;
    let record = Record {
        number: number.unwrap_or(0),
        unix_ns: unix_ns.unwrap_or(0),
        entry: entry(body),
        hash: *hash,
    };
    Ok((record, whole.len()))
}

/// Whether `whole`, a record as octets, follows `before` in the chain.
pub fn follows(whole: &[u8], before: &Hash) -> bool {
    let hashed = whole.len().checked_sub(BACK).and_then(|end| whole.split_at_checked(end));
    hashed.is_some_and(|(hashed, rest)| rest.first_chunk::<32>() == Some(&link(before, hashed)))
}

/// Why octets are no record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Broken {
    /// They end before the record does.
    Short,
    /// They do not begin like one.
    Start,
    /// The check sum is wrong.
    CheckSum,
}

fn body(entry: &Entry) -> Vec<u8> {
    let mut out = Vec::new();
    match entry {
        Entry::Start { version, nonce, axes } => {
            out.push(1);
            out.extend(nonce.to_le_bytes());
            out.push(axes.len() as u8);
            for (axis, profile, signature) in axes {
                out.extend([*axis, *profile]);
                out.extend(signature.to_le_bytes());
            }
            out.extend(version.as_bytes());
        }
        Entry::Change(moment) => {
            out.push(2);
            put_moment(&mut out, moment, &mut [0; WORDS]);
        }
        Entry::Trip { moment, second } => {
            out.push(3);
            let mut last = [0; WORDS];
            put_moment(&mut out, moment, &mut last);
            out.extend((second.len() as u32).to_le_bytes());
            for moment in second {
                put_moment(&mut out, moment, &mut last);
            }
        }
        Entry::Intervention(text) => {
            out.push(4);
            out.extend(text.as_bytes());
        }
        Entry::Lost { moments, changes } => {
            out.push(5);
            out.extend(moments.to_le_bytes());
            out.extend(changes.to_le_bytes());
        }
        Entry::End => out.push(6),
    }
    out
}

fn entry(body: &[u8]) -> Option<Entry> {
    let mut from = body;
    let [kind] = take(&mut from)?;
    let entry = match kind {
        1 => start(&mut from)?,
        2 => Entry::Change(take_moment(&mut from, &mut [0; WORDS])?),
        3 => {
            let mut last = [0; WORDS];
            let moment = take_moment(&mut from, &mut last)?;
            let count = u32::from_le_bytes(take(&mut from)?);
            let second = (0..count).map(|_| take_moment(&mut from, &mut last)).collect::<Option<_>>()?;
            Entry::Trip { moment, second }
        }
        4 => Entry::Intervention(text(&mut from)),
        5 => Entry::Lost {
            moments: u64::from_le_bytes(take(&mut from)?),
            changes: u64::from_le_bytes(take(&mut from)?),
        },
        6 => Entry::End,
        _ => return None,
    };
    from.is_empty().then_some(entry)
}

fn start(from: &mut &[u8]) -> Option<Entry> {
    let nonce = u32::from_le_bytes(take(from)?);
    let [count] = take(from)?;
    let mut axes = Vec::new();
    for _ in 0..count {
        let [axis, profile] = take(from)?;
        axes.push((axis, profile, u32::from_le_bytes(take(from)?)));
    }
    Some(Entry::Start { version: text(from), nonce, axes })
}

fn text(from: &mut &[u8]) -> String {
    String::from_utf8_lossy(std::mem::take(from)).into_owned()
}

fn take<const N: usize>(from: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = from.split_first_chunk::<N>()?;
    *from = tail;
    Some(*head)
}

/// Only the words that differ from those before: a second of standstill is a few octets each.
fn put_moment(out: &mut Vec<u8>, moment: &Moment, last: &mut [u64; WORDS]) {
    let words = moment.to_words();
    let changed = words.iter().zip(last.iter()).enumerate();
    let mask = changed.fold(0_u32, |mask, (at, (word, before))| mask | u32::from(word != before) << at);
    out.extend(mask.to_le_bytes());
    for (at, word) in words.iter().enumerate() {
        if mask >> at & 1 == 1 {
            out.extend(word.to_le_bytes());
        }
    }
    *last = words;
}

fn take_moment(from: &mut &[u8], last: &mut [u64; WORDS]) -> Option<Moment> {
    let mask = u32::from_le_bytes(take(from)?);
    for (at, word) in last.iter_mut().enumerate() {
        if mask >> at & 1 == 1 {
            *word = u64::from_le_bytes(take(from)?);
        }
    }
    Some(Moment::from_words(last))
}
