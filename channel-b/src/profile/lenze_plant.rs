//! Lenze SM301: the encoders of the axis, and the drives it is cascaded with.

use shm_schema::encoder::SlotKind;
use shm_schema::error::ErrorCode;

use super::Plan;
use super::lenze::parameter;
use super::lenze_messages as message;
use crate::image::Image;
use crate::ledger::{Cause, Entry, Ledger};

/// Longest way of a stop through a cascade: 100 drives (LNZ-CAS-07), each with an input delay of
/// 10 ms (LNZ-CAS-09) and 4 ms to its output (LNZ-EX-18). The catalogue gives no limit (DEC-46).
const CIRCULATION_NS: u64 = 1_400_000_000;
/// From the acknowledge of a cascade to its restart (LNZ-CAS-06).
const RESTART_NS: u64 = 100_000_000;

/// The motor encoder, or the position encoder where the second slot carries one. Both are seen at
/// the motor: C15501 turns of it for 100 of the encoder (LNZ-EX-04); mounted directions as Tab. 1-4
/// has them (LNZ-SPD-12, LNZ-EX-05).
pub fn set_encoder(plan: &mut Plan, image: &Image<'_>) {
    let of = |number: u32| parameter(image, number, 0);
    let system = of(15_400);
    plan.has_encoder = system != 0;
    let is_motor_reversed = of(15_409) == 1;
    let has_position_encoder = (of(15_500) != 0) & (plan.encoder.slot == Some(1));
    if has_position_encoder {
        let is_digital = of(15_500) == 2;
        plan.encoder.kind = Some(if is_digital { SlotKind::Digital } else { SlotKind::SineCosine });
        plan.encoder.gear_percent = of(15_501).clamp(20, 50_000) as u32;
        plan.encoder.is_inverted = is_motor_reversed != (of(15_502) == 1);
    } else {
        plan.encoder.kind = Some(if system == 2 { SlotKind::Resolver } else { SlotKind::SineCosine });
        plan.encoder.is_inverted = is_motor_reversed;
    }
    plan.encoder.periods = parameter(image, 15_420, 0).clamp(1, 65_536) as u32;
    plan.encoder.pole_pairs = parameter(image, 15_430, 0).clamp(1, 10) as u32;
}

/// The way of a stop through the ring, and of its restart.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cascade {
    /// Since when SD-Out1 is off and SD-In4 not yet, ns.
    circulates_since: Option<u64>,
    /// The stop has run through the ring.
    has_circulated: bool,
    /// When the restart was acknowledged, ns.
    restart_since: Option<u64>,
}

impl Cascade {
    /// LNZ-CAS-13: SD-In4 must follow SD-Out1.
    pub fn watch(&mut self, is_fed_back: bool, in_sto: bool, now: u64, ledger: &mut Ledger) {
        self.has_circulated = in_sto & (self.has_circulated | is_fed_back);
        let circulates = in_sto & !self.has_circulated;
        self.circulates_since = circulates.then(|| self.circulates_since.unwrap_or(now));
        let took = self.circulates_since.map_or(0, |since| now.saturating_sub(since));
        if took > CIRCULATION_NS {
            ledger.raise(Entry::sto(ErrorCode::single(message::CIRCULATION), Cause::Live));
        }
    }

    /// Whether an acknowledge counts now: at once, or in a ring 100 ms later (LNZ-CAS-06).
    pub fn restarts(&mut self, edge: bool, is_awaited: bool, is_ring: bool, now: u64) -> bool {
        if !is_awaited {
            self.restart_since = None;
            return false;
        }
        if edge {
            self.restart_since = Some(now);
        }
        let delay_ns = if is_ring { RESTART_NS } else { 0 };
        let restarts = self.restart_since.is_some_and(|since| now.saturating_sub(since) >= delay_ns);
        if restarts {
            self.restart_since = None;
        }
        restarts
    }
}
