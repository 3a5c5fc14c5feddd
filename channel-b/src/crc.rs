//! CRC-32C (iSCSI) of the cells and CRC-32 (ISO-HDLC) of the signatures.
//!
//! Both are reflected; four octets at a time are taken through tables that hold the
//! remainder of an octet followed by 0 to 3 zero octets. The live shell may hand the
//! core a hardware version instead; replay runs this one.

const CASTAGNOLI: u32 = 0x82F6_3B78;
const ETHERNET: u32 = 0xEDB8_8320;

type Tables = [[u32; 256]; 4];

const fn remainder(polynomial: u32, octet: u32) -> u32 {
    let mut rest = octet;
    let mut bit = 0;
    while bit < 8 {
        rest = if rest & 1 == 1 { rest >> 1 ^ polynomial } else { rest >> 1 };
        bit += 1;
    }
    rest
}

const fn tables(polynomial: u32) -> Tables {
    let mut all = [[0; 256]; 4];
    let mut octet = 0;
    while octet < 256 {
        let mut rest = remainder(polynomial, octet as u32);
        all[0][octet] = rest;
        let mut zeros = 1;
        while zeros < 4 {
            rest = rest >> 8 ^ remainder(polynomial, rest & 0xFF);
            all[zeros][octet] = rest;
            zeros += 1;
        }
        octet += 1;
    }
    all
}

static ISCSI: Tables = tables(CASTAGNOLI);
static HDLC: Tables = tables(ETHERNET);

#[inline]
fn four(tables: &Tables, rest: u32, octets: [u8; 4]) -> u32 {
    let [a, b, c, d] = (rest ^ u32::from_le_bytes(octets)).to_le_bytes();
    tables[3][a as usize] ^ tables[2][b as usize] ^ tables[1][c as usize] ^ tables[0][d as usize]
}

#[inline]
fn one(tables: &Tables, rest: u32, octet: u8) -> u32 {
    let [low, ..] = rest.to_le_bytes();
    rest >> 8 ^ tables[0][(low ^ octet) as usize]
}

fn run(tables: &Tables, start: u32, octets: &[u8]) -> u32 {
    let mut rest = start;
    let (quads, tail) = octets.as_chunks::<4>();
    for quad in quads {
        rest = four(tables, rest, *quad);
    }
    for octet in tail {
        rest = one(tables, rest, *octet);
    }
    rest
}

/// CRC-32C (iSCSI) over `octets`: the check sum channel B verifies.
pub fn crc32c(octets: &[u8]) -> u32 {
    !run(&ISCSI, !0, octets)
}

/// CRC-32 (ISO-HDLC) over `octets`: what A verifies and what signatures are made of.
pub fn crc32(octets: &[u8]) -> u32 {
    !run(&HDLC, !0, octets)
}

/// A CRC-32 (ISO-HDLC) that is fed piece by piece.
#[derive(Debug, Clone, Copy)]
pub struct Signature(u32);

impl Signature {
    /// Nothing fed yet.
    pub const fn new() -> Self {
        Self(!0)
    }

    /// Feeds one word, little endian.
    #[must_use]
    pub fn word(self, word: u32) -> Self {
        Self(four(&HDLC, self.0, word.to_le_bytes()))
    }

    /// The check sum over everything fed.
    pub const fn finish(self) -> u32 {
        !self.0
    }
}

impl Default for Signature {
    fn default() -> Self {
        Self::new()
    }
}

/// A CRC-32C over a long block, a few octets in each cycle.
#[derive(Debug, Clone, Copy)]
pub struct Walk {
    rest: u32,
    at: usize,
}

impl Walk {
    /// At the start of the block.
    pub const fn new() -> Self {
        Self { rest: !0, at: 0 }
    }

    /// Takes at most `count` octets of `block`; the check sum once the end is reached,
    /// then the walk begins again.
    pub fn advance(&mut self, block: &[u8], count: usize) -> Option<u32> {
        let end = self.at.saturating_add(count).min(block.len());
        self.rest = run(&ISCSI, self.rest, block.get(self.at..end).unwrap_or(&[]));
        self.at = end;
        if end < block.len() {
            return None;
        }
        let sum = !self.rest;
        *self = Self::new();
        Some(sum)
    }
}

impl Default for Walk {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_values_of_both_polynomials_come_out() {
        assert_eq!(crc32c(b"123456789"), 0xE306_9283);
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn a_walk_in_small_steps_ends_at_the_same_sum() {
        let block = [0x5A; 103];
        let mut walk = Walk::new();
        let sum = (0..).find_map(|_| walk.advance(&block, 7));
        assert_eq!(sum, Some(crc32c(&block)));
    }

    #[test]
    fn words_feed_as_their_little_endian_octets() {
        assert_eq!(Signature::new().word(0x3433_3231).finish(), crc32(b"1234"));
    }
}
