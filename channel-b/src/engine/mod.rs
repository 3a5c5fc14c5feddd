//! The function engine (design 6), channel B's way: nothing is integrated from cycle to
//! cycle. What remains of an active function is a small record of its start; whether the
//! motion is permitted is a pure function of that record, the time since, and the motion.
//!
//! - [`spec`]: what a function is, built once from the parameters
//! - [`record`]: what is remembered of an active one, and the verdict on it
//! - [`bank`]: all monitoring functions of an axis · [`calm`]: how long they answer the same
//! - [`stops`]: stop functions, their priority, and how they are left

pub mod bank;
pub mod calm;
pub mod record;
pub mod spec;
pub mod stops;
#[cfg(test)]
mod tests;

/// The motion of one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Motion {
    /// Speed, 1/1000 rpm.
    pub speed: i64,
    /// Extended position, increments.
    pub position: i64,
    /// Acceleration, 1/1000 rpm/s.
    pub acceleration: i64,
    /// Torque, millionths of the rated torque.
    pub torque: i64,
}

impl Motion {
    /// Standstill at zero.
    pub const ZERO: Self = Self { speed: 0, position: 0, acceleration: 0, torque: 0 };
}
