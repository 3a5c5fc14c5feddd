//! Safety variables kept beside their bitwise complement.
//!
//! Design 3.1: a bit that flips in memory must not steer the protocol. Whoever
//! reads a mirrored value gets it only while value and complement still agree.

/// A value that can be written down as whole words, without losing anything.
pub(super) trait Words<const N: usize>: Copy {
    /// The value as words; different values give different words.
    fn words(&self) -> [u64; N];
}

/// A value together with the complement of its words.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mirrored<T, const N: usize> {
    value: T,
    complement: [u64; N],
}

impl<T: Words<N>, const N: usize> Mirrored<T, N> {
    /// Stores `value` and its complement.
    pub(super) fn new(value: T) -> Self {
        let complement = value.words().map(|word| !word);
        Self { value, complement }
    }

    /// The value, or `None` when it and its complement have come apart.
    pub(super) fn read(&self) -> Option<T> {
        let words = self.value.words();
        let mut pairs = words.iter().zip(&self.complement);
        let agrees = pairs.all(|(word, complement)| *word == !*complement);
        agrees.then_some(self.value)
    }

    /// The value as it stands, for recovery only.
    pub(super) const fn unchecked(&self) -> &T {
        &self.value
    }

    /// Spoils the value as a memory fault would.
    #[cfg(test)]
    pub(super) fn spoil(&mut self, change: impl FnOnce(&mut T)) {
        change(&mut self.value);
    }
}

/// Up to `N` octets of process data beside their complement.
#[derive(Clone, Copy, Debug)]
pub(super) struct MirroredOctets<const N: usize> {
    octets: [u8; N],
    complement: [u8; N],
}

impl<const N: usize> MirroredOctets<N> {
    /// All octets zero: the fail-safe values (DEC-18).
    pub(super) const fn zeros() -> Self {
        Self { octets: [0; N], complement: [0xFF; N] }
    }

    /// Replaces the first octets by `source`, leaving the others as they are.
    pub(super) fn store(&mut self, source: impl IntoIterator<Item = u8>) {
        let places = self.octets.iter_mut().zip(&mut self.complement);
        for ((octet, complement), new) in places.zip(source) {
            *octet = new;
            *complement = !new;
        }
    }

    /// The first `length` octets, or `None` when one of them has been spoilt.
    pub(super) fn read(&self, length: usize) -> Option<&[u8]> {
        let octets = self.octets.get(..length)?;
        let mut pairs = octets.iter().zip(&self.complement);
        pairs.all(|(octet, complement)| *octet == !*complement).then_some(octets)
    }

    /// Spoils the first octet as a memory fault would.
    #[cfg(test)]
    pub(super) fn spoil(&mut self) {
        if let Some(octet) = self.octets.first_mut() {
            *octet ^= 0x10;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Words<1> for u16 {
        fn words(&self) -> [u64; 1] {
            [u64::from(*self)]
        }
    }

    #[test]
    fn every_spoilt_bit_is_seen() {
        for bit in 0..16 {
            let mut mirrored = Mirrored::new(0x1234_u16);
            assert_eq!(mirrored.read(), Some(0x1234));
            mirrored.spoil(|value| *value ^= 1 << bit);
            assert_eq!(mirrored.read(), None);
        }
    }

    #[test]
    fn spoilt_octets_are_not_handed_out() {
        let mut octets = MirroredOctets::<4>::zeros();
        octets.store([1, 2, 3]);
        assert_eq!(octets.read(4), Some(&[1, 2, 3, 0][..]));
        octets.spoil();
        assert_eq!(octets.read(4), None);
        assert_eq!(octets.read(5), None);
    }
}
