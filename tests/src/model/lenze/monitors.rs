//! SMS, SLS and SDI (LNZ-SMS, LNZ-SLS, LNZ-SDI).

use super::number;
use super::parameters::Parameters;
use super::stops::Target;

/// One monitor of speed: SMS (0) or SLS 1 to 4.
#[derive(Debug, Clone, Default)]
pub struct SpeedMonitor {
    /// Requested since, ms.
    pub since: Option<i64>,
    /// Until the acknowledge, or until the request is withdrawn.
    pub violated: bool,
}

/// One monitor of direction.
#[derive(Debug, Clone, Default)]
pub struct DirectionMonitor {
    /// Requested since, ms.
    pub since: Option<i64>,
    /// The furthest position in the permitted direction.
    pub reference: Option<i64>,
    /// Until the acknowledge.
    pub violated: bool,
}

impl SpeedMonitor {
    /// SMS (0) and SLS 1 to 4 (LNZ-SMS-01 to 07, LNZ-SLS-01 to 03).
    pub fn step(
        &mut self,
        parameters: &Parameters,
        index: usize,
        requested: bool,
        now: i64,
        speed: i64,
    ) -> Option<Overspeed> {
        if !requested {
            *self = Self::default();
            return None;
        }
        let since = *self.since.get_or_insert(now);
        let sub = index as u32;
        let (limit, delay, own, reaction) = if index == 0 {
            (parameters.code(15_320), 0, number::SMS, parameters.reaction(15_321, 0))
        } else {
            let delay = parameters.sub(15_331, sub);
            let reaction = parameters.reaction(15_332, sub);
            (parameters.sub(15_330, sub), delay, number::SLS + sub - 1, reaction)
        };
        let limit = limit * 1000;
        if self.violated || speed.abs() <= limit || now - since < delay {
            return None;
        }
        self.violated = true;
        Some(Overspeed { code: own, reaction, at: now, limit })
    }
}

/// A violated limit of speed.
#[derive(Debug, Clone, Copy)]
pub struct Overspeed {
    /// Error number.
    pub code: u32,
    /// The configured stop.
    pub reaction: Target,
    at: i64,
    limit: i64,
}

impl Overspeed {
    /// LNZ-SMS-06: back within C15350, or STO; LNZ-SMS-07: not after STO.
    pub fn is_overdue(&self, parameters: &Parameters, now: i64, speed: i64) -> bool {
        let has_had_its_time = now - self.at >= parameters.code(15_350);
        has_had_its_time && speed.abs() > self.limit && self.reaction != Target::Sto
    }
}

impl DirectionMonitor {
    /// SDI: 0 positive, 1 negative direction permitted (LNZ-SDI-01 to 09, DEC-49).
    pub fn step(
        &mut self,
        parameters: &Parameters,
        index: usize,
        requested: bool,
        now: i64,
        position: i64,
    ) -> Option<(u32, Target)> {
        if !requested {
            *self = Self::default();
            return None;
        }
        let since = *self.since.get_or_insert(now);
        let delay = parameters.code(15_341);
        if self.violated || now - since < delay {
            return None;
        }
        let sign = if index == 0 { 1 } else { -1 };
        let reached = position * sign;
        let furthest = self.reference.map_or(reached, |reference| reference.max(reached));
        self.reference = Some(furthest);
        self.violated = furthest - reached > parameters.code(15_342);
        self.violated.then(|| (number::SDI + index as u32, parameters.reaction(15_343, 0)))
    }
}
