//! Lenze SM301: message numbers (LNZ-ERR) of violations, of the black channel and of the channel
//! itself.

use shm_schema::error::ErrorCode;

use crate::bus::Events;
use crate::engine::record::Breach;
use crate::engine::spec::Spec;
use crate::ledger::{Cause, Entry, Ledger};

pub(super) const BUS_CORRUPT: u32 = 34;
pub(super) const BUS_TIMEOUT: u32 = 35;
pub(super) const DISCREPANCY: u32 = 49;
pub(super) const DEACTIVATED: u32 = 57;
pub(super) const OUTPUT: u32 = 89;
pub(super) const STOPPING_TIME: u32 = 97;
pub(super) const SLS: u32 = 98;
pub(super) const RESPONSE_TIME: u32 = 102;
pub(super) const SDI_POSITIVE: u32 = 103;
pub(super) const SDI_NEGATIVE: u32 = 104;
pub(super) const SMS: u32 = 105;
pub(super) const SOS: u32 = 106;
pub(super) const RAMP: u32 = 110;
pub(super) const SLI: u32 = 111;
pub(super) const NO_ENCODER: u32 = 107;
pub(super) const CIRCULATION: u32 = 108;
pub(super) const CASCADE: u32 = 109;
pub(super) const SPEED_COMPARISON: u32 = 212;

/// Message number of a violation.
pub const fn code(spec: &Spec, breach: Breach) -> ErrorCode {
    let is_stop = spec.id == STOPPING_TIME;
    ErrorCode::single(match breach {
        Breach::Damage => 1,
        Breach::Line | Breach::TooFast if is_stop => RAMP,
        Breach::Above(_) | Breach::Below(_) if is_stop => SOS,
        _ => spec.id,
    })
}

/// LNZ-BUS-13, LNZ-BUS-14, LNZ-BUS-17: messages without error status; the passivated data are
/// the stop, and nothing has to be acknowledged.
pub fn watch_bus(events: &Events, ledger: &mut Ledger) {
    let seen = [
        (events.is_corrupt, BUS_CORRUPT),
        (events.has_timed_out, BUS_TIMEOUT),
        (events.parameter_fault.is_some(), u32::from(events.parameter_fault.unwrap_or(0))),
    ];
    for (_, number) in seen.into_iter().filter(|(is_seen, _)| *is_seen) {
        ledger.raise(Entry::warning(ErrorCode::single(number), Cause::Passing));
    }
}

/// Message number of a fault of the channel itself.
pub const fn internal(code: ErrorCode) -> ErrorCode {
    ErrorCode::single(match (code.info1, code.info2) {
        (13, 6) => SPEED_COMPARISON,
        (76, 6) => 94,
        (76, _) => 93,
        (72, _) => 213,
        (6, _) => 209,
        (4, _) => 210,
        (7, _) => 208,
        (74, _) => 165,
        _ => 1,
    })
}
