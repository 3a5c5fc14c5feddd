//! A safety variable kept together with its complement (design 3.1, channel B).
//!
//! Every value that outlives a step is a [`Twin`]; a cell that lost a bit is seen when
//! the value is used, and what is seen as damaged is answered with torque off.

/// A 64-bit value and its complement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Twin {
    value: i64,
    mirror: i64,
}

impl Twin {
    /// Stores `value`.
    #[inline]
    pub const fn new(value: i64) -> Self {
        Self { value, mirror: !value }
    }

    /// Stores a time in ns.
    #[inline]
    pub const fn time(value: u64) -> Self {
        Self::new(value as i64)
    }

    /// Stores a flag with a distance of many bits between the two values.
    #[inline]
    pub const fn flag(value: bool) -> Self {
        Self::new(if value { YES } else { NO })
    }

    /// The value; `None` when value and complement no longer match.
    #[inline]
    pub const fn get(self) -> Option<i64> {
        if self.value == !self.mirror { Some(self.value) } else { None }
    }

    /// Value and complement match.
    #[inline]
    pub const fn is_kept(self) -> bool {
        self.value == !self.mirror
    }

    /// The value as it is; only beside [`Twin::is_kept`].
    #[inline]
    pub const fn seen(self) -> i64 {
        self.value
    }

    /// The value as a time in ns.
    #[inline]
    pub const fn get_time(self) -> Option<u64> {
        if self.value == !self.mirror { Some(self.value as u64) } else { None }
    }

    /// The flag; damage reads as `safe`.
    #[inline]
    pub const fn is(self, safe: bool) -> bool {
        match self.get() {
            Some(YES) => true,
            Some(NO) => false,
            _ => safe,
        }
    }
}

#[cfg(test)]
impl Twin {
    /// Loses a bit.
    pub const fn damage(&mut self) {
        self.mirror ^= 1 << 40;
    }
}

const YES: i64 = 0x5AA5_C33C_0FF0_9669;
const NO: i64 = 0x2552_3CC3_7007_6996;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_whose_complement_does_not_match_is_no_value() {
        let mut twin = Twin::new(-7);
        assert_eq!(twin.get(), Some(-7));
        twin.value ^= 1 << 40;
        assert_eq!(twin.get(), None);
    }

    #[test]
    fn a_damaged_flag_reads_as_the_safe_one() {
        let mut flag = Twin::flag(false);
        flag.mirror ^= 2;
        assert!(flag.is(true));
        assert!(!Twin::flag(false).is(true));
    }
}
