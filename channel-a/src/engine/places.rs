//! Sets of places in a table.

/// A set of places, 0 to 63.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Places(u64);

impl Places {
    /// No place.
    pub const NONE: Self = Self(0);

    /// This place alone.
    pub const fn of(place: u8) -> Self {
        Self(1_u64.wrapping_shl(place as u32))
    }

    /// This place if `is`, else none.
    pub const fn when(is: bool, place: u8) -> Self {
        if is { Self::of(place) } else { Self::NONE }
    }

    /// Whether `place` is in it.
    pub const fn has(self, place: u8) -> bool {
        self.0 & Self::of(place).0 != 0
    }

    /// No place is in it.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// In either.
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// In this one and not in the other.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// In both.
    pub const fn common(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

/// The places of a set, ascending.
#[derive(Debug, Clone)]
pub struct Each(u64);

impl IntoIterator for Places {
    type Item = u8;
    type IntoIter = Each;

    fn into_iter(self) -> Each {
        Each(self.0)
    }
}

impl Iterator for Each {
    type Item = u8;

    fn next(&mut self) -> Option<u8> {
        let place = self.0.trailing_zeros() as u8;
        let found = (self.0 != 0).then_some(place);
        self.0 &= self.0.wrapping_sub(1);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_walked_upwards_and_knows_what_it_has() {
        let set = Places::of(63).with(Places::of(0)).with(Places::when(true, 7));
        assert!(set.into_iter().eq([0, 7, 63]));
        assert!(set.without(Places::of(7)).into_iter().eq([0, 63]));
        assert!(set.has(7) && !set.has(8) && set.common(Places::of(8)).is_empty());
    }
}
