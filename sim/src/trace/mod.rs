//! Traces as design section 10 writes them: a table of times and columns, joined by
//! straight lines or held, and evaluated without rounding before the last step.

mod cursor;
pub(crate) mod decimal;
mod fault;
mod parse;
mod polyline;

pub use cursor::{Between, Cursor, Instant};
pub use fault::{Fault, Faults};
pub use parse::{parse, word};
pub use polyline::{Polyline, Walker};

use std::{collections::BTreeMap, fmt};

use shm_schema::word::Word;

/// Nanoseconds of one cycle of replay.
pub const CYCLE_NS: i64 = 1_000_000;

/// Why a trace cannot be used: one clear line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TraceError {
    /// Line of the file, from 1.
    pub line: usize,
    /// What was read and what was expected.
    pub message: String,
}

impl fmt::Display for TraceError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "line {}: {}", self.line, self.message)
    }
}

impl std::error::Error for TraceError {}

/// A whole trace.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Columns of each axis that has a row.
    pub axes: BTreeMap<u8, AxisTrace>,
    /// Time of the last row of any axis, ns.
    pub end_ns: i64,
}

impl Trace {
    /// Number of the last cycle: `floor(last t_ms)`.
    pub const fn last_cycle(&self) -> u64 {
        (self.end_ns / CYCLE_NS) as u64
    }

    /// Whether a fault of the trace acts on the raw encoder signals, which then have to be
    /// evaluated from the first cycle on.
    pub fn needs_raw_encoder(&self) -> bool {
        let raw = |faults: Faults| faults.has(Fault::FreezeEncoder1) | faults.has(Fault::FreezeEncoder2);
        self.axes.values().any(|axis| axis.steps.iter().any(|(_, step)| raw(step.faults)))
    }
}

/// What gives an axis its motion.
#[derive(Debug, Clone)]
pub enum Course {
    /// `speed_rpm`: position is its integral from 0.
    Speed(Polyline),
    /// `pos_incr`: speed is the slope of the segment that ends at t.
    Position(Polyline),
}

impl Default for Course {
    fn default() -> Self {
        Self::Speed(Polyline::constant())
    }
}

/// All columns of one axis.
#[derive(Debug, Clone, Default)]
pub struct AxisTrace {
    /// `speed_rpm` or `pos_incr`.
    pub course: Course,
    /// `enc2_speed_rpm`
    pub second_speed: Option<Polyline>,
    /// `enc2_pos_offset_incr`
    pub second_offset: Option<Polyline>,
    /// `torque_pct`
    pub torque: Option<Polyline>,
    /// `accel_rpm_s`
    pub acceleration: Option<Polyline>,
    /// Step columns: from this time (ns) on they hold these values.
    pub steps: Vec<(i64, Step)>,
}

/// The values of all step columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "the columns of the contract")]
pub struct Step {
    /// `command`; `None`: the profile's neutral word.
    pub command: Option<Word>,
    /// `se1` to `se4`: levels of line .1 and line .2.
    pub pairs: [(bool, bool); 4],
    /// `ais`
    pub ais: bool,
    /// `aie`
    pub aie: bool,
    /// `clear_error`
    pub clear_error: bool,
    /// `drive_n0`
    pub drive_n0: bool,
    /// `drive_enabled`
    pub drive_enabled: bool,
    /// `fault`
    pub faults: Faults,
}

impl Default for Step {
    fn default() -> Self {
        Self {
            command: None,
            pairs: [(true, true); 4],
            ais: false,
            aie: false,
            clear_error: false,
            drive_n0: false,
            drive_enabled: true,
            faults: Faults::NONE,
        }
    }
}

#[cfg(test)]
mod tests;
