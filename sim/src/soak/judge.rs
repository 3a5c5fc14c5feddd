//! Invariants: what must hold in every cycle of every life, whatever the functions do.

use std::fmt;

use super::Moment;
use crate::trace::{Fault, Faults};

/// An invariant that did not hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Broken {
    /// Torque although a channel does not permit it (design 3.3).
    TorqueAlone,
    /// A path that is not stuck stayed on in a cycle without permission (design 3.4).
    PathWithoutPermission,
    /// Torque in the third cycle of a fault that stops one of the three (DEC-23, design 8).
    TorqueWithFault,
    /// The channels differed although nothing was injected (DEC-21, DEC-22).
    ChannelsDiffer,
}

impl fmt::Display for Broken {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::TorqueAlone => "torque although a channel does not permit it",
            Self::PathWithoutPermission => "a path stayed on without permission",
            Self::TorqueWithFault => "torque in the third cycle of a fault",
            Self::ChannelsDiffer => "the channels differed although nothing was injected",
        })
    }
}

/// Faults after which torque is off in the third cycle.
const STOPPING: [Fault; 6] = [
    Fault::FreezeA,
    Fault::FreezeB,
    Fault::FreezeCrosscheck,
    Fault::StaleEncoder,
    Fault::CorruptEncoder,
    Fault::CorruptReportA,
];

/// Watches a life.
#[derive(Debug, Clone, Copy, Default)]
pub struct Judge {
    stopping: u64,
    injected: bool,
}

impl Judge {
    /// The first invariant that does not hold in this cycle.
    pub fn look(&mut self, moment: &Moment<'_>) -> Option<Broken> {
        let faults = moment.stimulus.faults;
        let stops = STOPPING.iter().any(|fault| faults.has(*fault));
        self.stopping = if stops { self.stopping + 1 } else { 0 };
        self.injected |= faults != Faults::NONE;
        let [a, b, combined] = moment.views;
        let stuck = faults.has(Fault::StuckPathA) | faults.has(Fault::StuckPathB);
        let a_free = a.path && !a.torque;
        let b_free = b.path && !b.torque;
        let differ =
            combined.errors.as_slice().iter().any(|code| (code.code, code.info1) == CROSS_COMMUNICATION);
        let rules = [
            (combined.torque && !(a.torque && b.torque), Broken::TorqueAlone),
            ((a_free | b_free) && !stuck, Broken::PathWithoutPermission),
            ((self.stopping >= 3) & a.path & b.path, Broken::TorqueWithFault),
            (differ && !self.injected, Broken::ChannelsDiffer),
        ];
        rules.into_iter().find(|(broken, _)| *broken).map(|(_, rule)| rule)
    }
}

/// AMK 3606, Info1 13 (DEC-45); other profiles have codes of their own, which this rule misses.
const CROSS_COMMUNICATION: (u32, u32) = (3_606, 13);
