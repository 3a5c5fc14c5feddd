//! From what was found to the numbers of the diagnosis (AMKD-NUM-03 to 05, DEC-44, DEC-45).

use crate::model::Which;
use crate::model::approach::{Approach, Side};

use super::parameters::Reaction;

/// Speed that every ramp monitoring refuses, 1/1000 rpm (AMKP-RAMP-04).
const FASTEST: i64 = 60_000_000;

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// Speed window of a standing function.
    Speed(Side),
    /// Position window.
    Position(Side),
    /// Line or far limit during the ramp.
    Ramp(Side),
    /// Target window at the moment the ramp ends.
    EndOfRamp(Side),
    /// Beyond 60,000 rpm during the ramp.
    TooFast,
}

impl Finding {
    /// A deviation from the ramp, or a speed that no ramp permits.
    pub fn on_ramp(approach: &Approach, now: i64, speed: i64) -> Option<Self> {
        if speed.abs() > FASTEST {
            return Some(Self::TooFast);
        }
        approach.ramp_side(now, speed).map(Self::Ramp)
    }

    /// Outside the window at the end of the ramp.
    pub fn end_of_ramp(side: Side, speed: i64) -> Self {
        if speed.abs() > FASTEST { Self::TooFast } else { Self::EndOfRamp(side) }
    }
}

/// A violated function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Violation {
    /// Info1: the function's number.
    pub function: u32,
    /// What was found.
    pub finding: Finding,
    /// What follows.
    pub reaction: Reaction,
}

/// SLI is the one function whose warning numbers its limits differently (AMKD-FNM-04).
const SLI: u32 = 114;

impl Violation {
    /// The code as channel `which` raises it.
    pub fn code(self, which: Which) -> [u32; 4] {
        // DEC-44: an error when the reaction is STO, a warning when it is SS1 or SS2.
        let is_error = self.reaction == Reaction::Sto;
        let message = if is_error { 3606 } else { 3610 };
        let (info2, info3) = match self.finding {
            Finding::Speed(side) => (3 + below(side), 0),
            Finding::Position(side) if self.function == SLI && !is_error => (3 + below(side), 0),
            Finding::Position(side) => (5 + below(side), 0),
            Finding::TooFast => (0, 1),
            // DEC-45: A reports ramps with 8 and 9, B with 14 and 15.
            Finding::Ramp(side) | Finding::EndOfRamp(side) if which == Which::A => (0, 8 + below(side)),
            Finding::Ramp(_) => (0, 14),
            Finding::EndOfRamp(_) => (0, 15),
        };
        [message, self.function, info2, info3]
    }
}

fn below(side: Side) -> u32 {
    u32::from(side == Side::Below)
}
