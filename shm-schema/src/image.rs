//! The safety image: the parameters of one axis as raw integers, in two encodings.
//!
//! Encoding A is a sequence of 32-bit words, little endian:
//!
//! | word | content |
//! |---|---|
//! | 0 | [`MAGIC`] |
//! | 1 | version << 16 \| profile << 8 \| axis |
//! | 2 | number of entries, at most [`ENTRIES_MAX`] |
//! | 3 | template signature: CRC-32 over version, profile and all keys |
//! | 4 | content signature: CRC-32 over profile (one word) and all entries |
//! | 5 | device signature: CRC-32 over the content signature (one word) and the serial number |
//! | 6 | flags, [`VALIDATED`] |
//! | 7 to 12 | serial number, 24 octets, padded with 0 |
//! | 13 … | entries in ascending order of their key: key, value (two words each) |
//! | last | CRC-32 (ISO-HDLC) over all octets before |
//!
//! Encoding B is the same words, each complemented and big endian; its last word is the
//! complement of CRC-32C (iSCSI) over all octets before, big endian. The signatures inside
//! are those of A's encoding, so that both channels report the same numbers; channel B
//! computes them from its own copy.
//!
//! The SRA CRC of a set (black-channel.md 2.7), for an FSoE master, is the CRC-32/AIXM over the
//! octets of all entries in encoding A: keys and values, no header, so that it is the same for
//! every device and axis that carries the set.

/// First word of every image ("SPI1").
pub const MAGIC: u32 = 0x3149_5053;
/// Version of this format.
pub const VERSION: u16 = 1;
/// Words in front of the entries.
pub const HEADER_WORDS: usize = 13;
/// Most entries of one image.
pub const ENTRIES_MAX: usize = 1_536;
/// Octets of the longest image.
pub const OCTETS_MAX: usize = 4 * (HEADER_WORDS + 2 * ENTRIES_MAX + 1);
/// Octets of a serial number.
pub const SERIAL_OCTETS: usize = 24;
/// Flag: the set was validated (sealed) for this device; without it the set dies with the
/// next restart (design 7).
pub const VALIDATED: u32 = 1;
