//! Code numbers of the generic profile. ETG.6100.2 leaves them to the maker (ETG-ERR-03): the
//! function, its instance and the row of its error table, or a general fault from 0xFF00 on.

use shm_schema::error::ErrorCode;
use shm_schema::facts::etg;

use super::super::Fault;
use crate::engine::stop::{self, Reaction};
use crate::engine::watch::{Part, Plan, Quantity, Violation};
use crate::errors::Class;
use crate::partner::Findings;
use crate::path::PathFault;

/// General faults: this plus Info2 of the AMK row of the same meaning where there is one.
const GENERAL: u32 = 0xFF00;
const STATE: u32 = GENERAL + 8;

const fn row(function: u16, error: u32) -> ErrorCode {
    ErrorCode::single((function as u32) << 8 | error)
}

/// Without a reaction the cause stands as long as the limit is violated (DEC-15).
fn class_of(reaction: Reaction) -> Class {
    if reaction == Reaction::None { Class::Flaw } else { Class::Limit }
}

/// E1 the window, E2 the deceleration; SDI has E1 for the position and E2 for the velocity.
pub fn watch_code(plan: &Plan, violation: Violation) -> (ErrorCode, Class) {
    let velocity = matches!(plan.quantity, Quantity::SpeedFromZero(_));
    let second = (violation.part == Part::Ramp) | velocity;
    (row(plan.function, if second { 2 } else { 1 }), class_of(plan.reaction))
}

/// SS1: E1 outside the zero window at its end, E2 the deceleration. SS2: E1 the deceleration;
/// from its end on it is E1 of the SOS.
pub fn stop_code(violation: stop::Violation) -> (ErrorCode, Class) {
    let is_ss1 = u32::from(violation.function) >> 8 == etg::SS1;
    let second = is_ss1 & (violation.part == Part::Ramp);
    (row(violation.function, if second { 2 } else { 1 }), class_of(violation.reaction))
}

/// General faults.
pub const fn fault_code(fault: Fault) -> (ErrorCode, Class) {
    let (number, class) = match fault {
        Fault::PartnerLost => (1, Class::Cause),
        Fault::Position => (5, Class::Cause),
        Fault::Speed => (6, Class::Cause),
        Fault::Identity => (8, Class::Cause),
        Fault::OwnPath(PathFault::StuckOn) => (0x11, Class::Cause),
        Fault::OwnPath(PathFault::StuckOff) => (0x12, Class::Cause),
        Fault::PartnerPath(PathFault::StuckOn) => (0x13, Class::Cause),
        Fault::PartnerPath(PathFault::StuckOff) => (0x14, Class::Cause),
        Fault::Dormant => (0x15, Class::StandingWarning),
        Fault::Clock => (0x21, Class::Restart),
        Fault::Image => (0x32, Class::Restart),
        Fault::Overrun => (0x33, Class::Cause),
        Fault::EncoderStale => (0x40, Class::Cause),
        Fault::Encoder(fault) => (0x41 + fault as u32, Class::Cause),
        Fault::Drive(contradiction) => (0x48 + contradiction as u32, Class::Cause),
    };
    (ErrorCode::single(GENERAL + number), class)
}

/// One error for everything that differed from the partner for too long.
pub fn difference_codes(found: &Findings, raise: &mut dyn FnMut(ErrorCode, Class)) {
    let differs = (found.status | found.inputs) != 0;
    if differs | found.other {
        raise(ErrorCode::single(STATE), Class::Cause);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Side;

    #[test]
    fn a_code_is_function_instance_and_row() {
        // ETG-ERR-03: SLS_3, row E2
        let plan = Plan { function: (etg::SLS << 8 | 3) as u16, ..Plan::default() };
        let code = |part| watch_code(&plan, Violation { part, side: Side::Upper }).0.code;
        assert_eq!((code(Part::Window), code(Part::Ramp)), (0x8_0301, 0x8_0302));
        let function = (etg::SS1 << 8 | 1) as u16;
        let stop = |part| {
            let violation = stop::Violation {
                function,
                part,
                side: Side::Upper,
                position: false,
                reaction: Reaction::Sto,
            };
            stop_code(violation).0.code & 0xFF
        };
        assert_eq!((stop(Part::End), stop(Part::Ramp)), (1, 2));
    }
}
