//! The function engine: every function of every profile is an instance of a few
//! primitives (design 6). Tables of instances come from [`crate::profile`].
//!
//! - [`approach`]: delay, monitored ramp, dwell, then the target window
//! - [`watch`]: a window on one quantity, requested or always on; [`watches`] walks their table
//! - [`stop`]: the stop functions, their priority and how they are left; [`places`] says which

pub mod approach;
pub mod places;
pub mod stop;
pub mod watch;
pub mod watches;

/// What the functions judge, of one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sample {
    /// Own clock, ns.
    pub now_ns: u64,
    /// Increments (DEC-10).
    pub position: i64,
    /// 1/1000 rpm.
    pub speed: i64,
    /// 1/1000 rpm/s.
    pub acceleration: i64,
    /// Millionths of the rated torque.
    pub torque: i64,
}

/// A closed range: a value equal to a limit is inside (DEC-01).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Range {
    /// Smallest permitted value.
    pub lower: i64,
    /// Largest permitted value.
    pub upper: i64,
}

/// Which limit was left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Above the upper limit.
    Upper,
    /// Below the lower limit.
    Lower,
    /// Beyond what a ramp monitors at all (AMKP-RAMP-04).
    Ceiling,
}

impl Range {
    /// Everything.
    pub const ALL: Self = Self { lower: i64::MIN, upper: i64::MAX };

    /// What both permit.
    pub const fn common(self, other: Self) -> Self {
        let lower = if self.lower > other.lower { self.lower } else { other.lower };
        let upper = if self.upper < other.upper { self.upper } else { other.upper };
        Self { lower, upper }
    }

    /// The same around `place`.
    pub const fn around(self, place: i64) -> Self {
        Self { lower: self.lower.saturating_add(place), upper: self.upper.saturating_add(place) }
    }

    /// Whether `value` is inside.
    pub const fn has(&self, value: i64) -> bool {
        (self.lower <= value) & (value <= self.upper)
    }

    /// From `-magnitude` to `+magnitude`.
    pub const fn symmetric(magnitude: i64) -> Self {
        let magnitude = magnitude.saturating_abs();
        Self { lower: -magnitude, upper: magnitude }
    }

    /// The limit `value` lies beyond, if any.
    pub const fn left_by(&self, value: i64) -> Option<Side> {
        if value > self.upper {
            Some(Side::Upper)
        } else if value < self.lower {
            Some(Side::Lower)
        } else {
            None
        }
    }
}
