//! Parameters of one AMK axis: Prm numbers, with the delivery state of DEC-28 behind them.

use std::collections::BTreeMap;

use crate::model::approach::{Approach, Window};
use crate::model::exact::Ratio;

/// "AMK defaults" of the decisions: number, value.
const DEFAULTS: [(u32, i32); 53] = [
    (2, 50),
    (3, 16),
    (4, 1),
    (5, 1),
    (6, 1024),
    (7, 0),
    (8, 1),
    (9, 60),
    (10, 60),
    (15, 16),
    (16, 16),
    (17, 0),
    (18, 0),
    (20, 1000),
    (21, 1),
    (23, 0),
    (25, 1000),
    (26, 1),
    (27, 100),
    (28, 1),
    (29, 100),
    (30, 0),
    (32, 1000),
    (33, 1),
    (34, -1),
    (35, 0),
    (36, 0),
    (38, 1000),
    (39, 1),
    (40, -1),
    (41, 0),
    (42, 0),
    (44, 1000),
    (45, 1),
    (46, -1),
    (47, 0),
    (48, 0),
    (50, 1000),
    (51, 1),
    (52, -1),
    (53, 0),
    (54, 0),
    (56, 1000),
    (57, 1),
    (58, 0),
    (59, 0),
    (61, 1000),
    (62, 1),
    (63, 0),
    (64, 0),
    (65, 1),
    (66, -1),
    (67, 1),
];

/// The filter times and reactions, which follow a pattern of their own.
const MORE_DEFAULTS: [(u32, i32); 12] = [
    (68, 0),
    (70, 0),
    (76, 0),
    (82, 0),
    (71, 1000),
    (73, 1000),
    (77, 1000),
    (79, 1000),
    (83, 1000),
    (85, 1000),
    (103, 0),
    (105, 7),
];

/// A stop that a violation asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reaction {
    /// Torque off at once.
    Sto,
    /// Supervised braking, then torque off.
    Ss1,
    /// Supervised braking, then supervised standstill.
    Ss2,
}

/// Parameters by number.
#[derive(Debug, Clone)]
pub struct Parameters(BTreeMap<u32, i32>);

impl Parameters {
    /// The given values over the delivery state.
    pub fn new(given: &BTreeMap<u32, i32>) -> Self {
        let mut all: BTreeMap<u32, i32> = DEFAULTS.into_iter().chain(MORE_DEFAULTS).collect();
        all.extend(given);
        Self(all)
    }

    /// Raw value of a parameter.
    pub fn raw(&self, number: u32) -> i32 {
        self.0.get(&number).copied().unwrap_or(0)
    }

    /// Raw value as 64 bit.
    pub fn value(&self, number: u32) -> i64 {
        i64::from(self.raw(number))
    }

    /// AMKP-ERR-01: 0 STO, 1 SS1, 2 SS2; anything else takes the torque off.
    pub fn reaction(&self, number: u32) -> Reaction {
        match self.raw(number) {
            1 => Reaction::Ss1,
            2 => Reaction::Ss2,
            _ => Reaction::Sto,
        }
    }

    /// A ramp with slope Prm67 / ramp time (DEC-04, AMK-RAMP-03).
    pub fn approach(&self, started: i64, latched: i64, delay: u32, time: u32, target: Window) -> Approach {
        let time_ms = i128::from(self.raw(time));
        let slope = (time_ms > 0).then(|| Ratio::new(i128::from(self.value(67)) * 1000, time_ms));
        Approach { started, delay: self.value(delay), latched, slope, latest: None, target }
    }
}
