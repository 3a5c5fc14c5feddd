//! Messages: which number a fault or a violation has.

use super::super::Fault;
use super::{CASCADE_HARDWARE, Cascade, Lenze};
use crate::encoder::Fault as EncoderFault;
use crate::engine::stop;
use crate::engine::watch::{Part, Plan, Violation};
use crate::errors::Class;
use crate::partner::Findings;
use crate::path::PathFault;
use shm_schema::error::ErrorCode;

const STOP_LATE: u32 = 97;
const RAMP_LEFT: u32 = 110;
const OUTPUT_SHORT: u32 = 89;

impl Lenze {
    /// The own line of SD-Out1 does not follow. A cascade that has tripped has to switch it off.
    pub const fn output_code(&self) -> (ErrorCode, Class) {
        match self.cascade {
            Some(Cascade::Tripped(_)) => (ErrorCode::single(CASCADE_HARDWARE), Class::Cause),
            _ => (ErrorCode::single(OUTPUT_SHORT), Class::Output),
        }
    }

    /// Codes of the general faults.
    pub fn fault_code(&self, fault: Fault) -> (ErrorCode, Class) {
        let (number, class) = match fault {
            Fault::Encoder(EncoderFault::Absent) | Fault::EncoderStale | Fault::Position => {
                (208, Class::Cause)
            }
            Fault::Encoder(_) => (if self.resolver { 210 } else { 209 }, Class::Cause),
            Fault::Speed | Fault::Drive(_) => (212, Class::Cause),
            Fault::PartnerLost => (213, Class::Cause),
            Fault::Identity => (163, Class::Cause),
            Fault::Clock => (1, Class::Restart),
            Fault::Overrun => (1, Class::Cause),
            Fault::OwnPath(PathFault::StuckOn | PathFault::StuckOff) | Fault::PartnerPath(_) => {
                (93, Class::Cause)
            }
            Fault::Dormant => (94, Class::StandingWarning),
            Fault::Image => (165, Class::Restart),
        };
        (ErrorCode::single(number), class)
    }
}

/// The function's number is its code.
pub fn watch_code(plan: &Plan, _: Violation) -> (ErrorCode, Class) {
    (ErrorCode::single(u32::from(plan.function)), Class::Limit)
}

/// 97 at the end of the stopping time, 110 on the ramp, 106 in standstill.
pub fn stop_code(violation: stop::Violation) -> (ErrorCode, Class) {
    let number = match violation.part {
        Part::Window => u32::from(violation.function),
        Part::End => STOP_LATE,
        Part::Ramp => RAMP_LEFT,
    };
    (ErrorCode::single(number), Class::Limit)
}

/// An internal error with STO.
pub fn difference_codes(found: &Findings, raise: &mut dyn FnMut(ErrorCode, Class)) {
    let differs = (found.status | found.inputs) != 0;
    if differs | found.other {
        raise(ErrorCode::single(1), Class::Cause);
    }
}
