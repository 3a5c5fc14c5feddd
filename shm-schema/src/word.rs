//! Control and status words of up to 32 octets (DEC-41).

use crate::wire::{Sink, Source, Wire, digest};

/// A word of 256 bits; bit `n` is bit `n % 8` of octet `n / 8`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Word(pub [u32; 8]);

impl Word {
    /// No bit set: every active-low function requested (DEC-18).
    pub const ZERO: Self = Self([0; 8]);

    /// A word of at most 32 bits.
    pub const fn from_u32(value: u32) -> Self {
        Self([value, 0, 0, 0, 0, 0, 0, 0])
    }

    /// Whether bit `bit` is 1.
    #[inline]
    pub const fn bit(&self, bit: u8) -> bool {
        self.0[(bit >> 5) as usize] >> (bit & 31) & 1 == 1
    }

    /// The word with bit `bit` set to `value`.
    #[inline]
    #[must_use]
    pub const fn with(mut self, bit: u8, value: bool) -> Self {
        let mask = 1 << (bit & 31);
        let part = (bit >> 5) as usize;
        self.0[part] = if value { self.0[part] | mask } else { self.0[part] & !mask };
        self
    }

    /// Octet `index` (0 to 31).
    pub const fn octet(&self, index: u8) -> u8 {
        (self.0[((index >> 2) & 7) as usize] >> (8 * (index & 3))) as u8
    }
}

impl Wire for Word {
    const LENGTH: usize = 32;
    const LAYOUT: u32 = digest(crate::wire::DIGEST_START, "Word256");
    #[inline]
    fn put(&self, out: &mut Sink<'_>) {
        self.0.put(out);
    }
    #[inline]
    fn take(from: &mut Source<'_>) -> Option<Self> {
        Wire::take(from).map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_counted_as_the_catalogues_count_them() {
        let word = Word::ZERO.with(0, true).with(13, true).with(255, true);
        assert!(word.bit(0) && word.bit(13) && word.bit(255) && !word.bit(14));
        assert_eq!((word.octet(0), word.octet(1), word.octet(31)), (1, 0x20, 0x80));
        assert_eq!(word.with(13, false).octet(1), 0);
    }
}
