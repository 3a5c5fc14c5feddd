//! Comparison with the partner's report of the same exchange (DEC-21, DEC-22).

use shm_schema::report::{Phase, Report, Stop};
use shm_schema::word::Word;

/// Own reports kept for a partner that is late.
const KEPT: usize = 4;
/// Differing items timed side by side; more share one timer, which only trips earlier.
const TIMED: usize = 24;

/// Limits of the comparison.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Largest difference of the positions, increments (Prm2).
    pub position: i64,
    /// Largest difference of the speeds, 1/1000 rpm (Prm3).
    pub speed: i64,
    /// Fault tolerance time in exchanges (DEC-20).
    pub tolerance: u64,
    /// Status bits that belong to the stops and are timed as [`Item::Stop`].
    pub stop_bits: Word,
}

/// A thing that may differ for the fault tolerance time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Item {
    /// The stop function, with the higher of the two.
    Stop(Stop),
    /// Lane (status, request, input, acknowledge, error) and bit.
    Bit(u8, u8),
}

/// What a comparison found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Differences {
    /// Stop functions differ for longer than tolerated; the higher one.
    pub stop: Option<Stop>,
    /// Another status, request, input or acknowledgement differs for longer.
    pub other: bool,
    /// Positions.
    pub position: bool,
    /// Speeds.
    pub speed: bool,
    /// Parameter signature, build or program flow.
    pub identity: bool,
}

impl Differences {
    /// Nothing that forbids torque.
    pub fn is_clear(&self) -> bool {
        *self == Self::default()
    }
}

#[derive(Debug, Clone, Copy)]
struct Timed {
    item: Item,
    since: u64,
}

/// The own last reports and what differs.
#[derive(Debug, Clone, Copy)]
pub struct Comparison {
    kept: [Option<Report>; KEPT],
    place: usize,
    timed: [Option<Timed>; TIMED],
    /// First exchange with more differences than places.
    crowded: Option<u64>,
    compared: Option<u64>,
    last: Differences,
}

impl Comparison {
    /// Nothing compared yet.
    pub const fn new() -> Self {
        Self {
            kept: [None; KEPT],
            place: 0,
            timed: [None; TIMED],
            crowded: None,
            compared: None,
            last: Differences { stop: None, other: false, position: false, speed: false, identity: false },
        }
    }

    /// The newest comparison found nothing.
    pub fn is_clear(&self) -> bool {
        self.last.is_clear()
    }

    /// Keeps the own report of an exchange.
    pub fn keep(&mut self, own: &Report) {
        self.place = self.place.wrapping_add(1) % KEPT;
        if let Some(place) = self.kept.get_mut(self.place) {
            *place = Some(*own);
        }
    }

    /// Compares the partner's report with the own of the same exchange: `current`, or one
    /// kept. Without a pair the last result stands.
    pub fn compare(
        &mut self,
        current: &Report,
        partner: &Report,
        limits: &Limits,
        build: u32,
    ) -> Differences {
        if self.compared == Some(partner.exchange) {
            return self.last;
        }
        let kept = self.kept.iter().flatten().find(|own| own.exchange == partner.exchange);
        let own = if current.exchange == partner.exchange { Some(*current) } else { kept.copied() };
        let Some(own) = own else { return self.last };
        if !(is_comparable(own.phase) & is_comparable(partner.phase)) {
            return self.last;
        }
        self.compared = Some(partner.exchange);
        self.last = self.difference(&own, partner, limits, build);
        self.last
    }

    fn difference(&mut self, own: &Report, partner: &Report, limits: &Limits, build: u32) -> Differences {
        let expired = self.time(own, partner, limits);
        let distance = own.position.saturating_sub(partner.position).saturating_abs();
        let speed = i64::from(own.speed_mrpm).saturating_sub(i64::from(partner.speed_mrpm));
        let other_build = (build != 0) & (partner.build != build);
        Differences {
            stop: expired.0,
            other: expired.1,
            position: distance > limits.position,
            speed: speed.saturating_abs() > limits.speed,
            identity: other_build | (own.parameter_signature != partner.parameter_signature),
        }
    }

    /// Advances the timers of everything that differs; what has differed for too long.
    fn time(&mut self, own: &Report, partner: &Report, limits: &Limits) -> (Option<Stop>, bool) {
        let stop = differing_stop(own.stop, partner.stop);
        let lanes = lanes(own, partner, if stop.is_some() { limits.stop_bits } else { Word::ZERO });
        let is_quiet = lanes.iter().all(|lane| lane.0 == [0; 8]) & stop.is_none();
        if is_quiet {
            self.timed = [None; TIMED];
            self.crowded = None;
            return (None, false);
        }
        self.forget(&lanes, stop);
        self.enter(&lanes, stop, own.exchange);
        self.expired(own.exchange, limits.tolerance)
    }

    /// An item that agrees again loses its timer (DEC-21).
    fn forget(&mut self, lanes: &[Word; LANES], stop: Option<Stop>) {
        for place in &mut self.timed {
            let differs = place.is_some_and(|timed| match timed.item {
                Item::Stop(_) => stop.is_some(),
                Item::Bit(lane, bit) => lanes.get(usize::from(lane)).is_some_and(|word| word.bit(bit)),
            });
            if !differs {
                *place = None;
            }
        }
    }

    fn enter(&mut self, lanes: &[Word; LANES], stop: Option<Stop>, exchange: u64) {
        let mut fits = true;
        if let Some(stop) = stop {
            fits &= self.enter_one(Item::Stop(stop), exchange);
        }
        for (lane, word) in (0..).zip(lanes) {
            for (part, bits) in (0..8_u8).zip(word.0) {
                let mut rest = bits;
                while rest != 0 {
                    let bit = (part << 5) | (rest.trailing_zeros() as u8 & 31);
                    fits &= self.enter_one(Item::Bit(lane, bit), exchange);
                    rest &= rest.wrapping_sub(1);
                }
            }
        }
        self.crowded = if fits { None } else { Some(self.crowded.unwrap_or(exchange)) };
    }

    fn enter_one(&mut self, item: Item, exchange: u64) -> bool {
        let same = |timed: &&mut Timed| match (timed.item, item) {
            (Item::Stop(_), Item::Stop(_)) => true,
            (one, other) => one == other,
        };
        if let Some(timed) = self.timed.iter_mut().flatten().find(same) {
            timed.item = item;
            return true;
        }
        match self.timed.iter_mut().find(|place| place.is_none()) {
            Some(place) => *place = Some(Timed { item, since: exchange }),
            None => return false,
        }
        true
    }

    fn expired(&self, exchange: u64, tolerance: u64) -> (Option<Stop>, bool) {
        let is_old = |since: u64| exchange.saturating_sub(since) >= tolerance;
        let mut stop = None;
        let mut other = self.crowded.is_some_and(is_old);
        for timed in self.timed.iter().flatten().filter(|timed| is_old(timed.since)) {
            match timed.item {
                Item::Stop(higher) => stop = Some(higher),
                Item::Bit(..) => other = true,
            }
        }
        (stop, other)
    }
}

impl Default for Comparison {
    fn default() -> Self {
        Self::new()
    }
}

const LANES: usize = 4;

fn is_comparable(phase: Phase) -> bool {
    !matches!(phase, Phase::Boot | Phase::Refused)
}

fn differing_stop(own: Stop, partner: Stop) -> Option<Stop> {
    let rank = |stop: Stop| match stop {
        Stop::Sto => 4,
        Stop::Ss1 => 3,
        Stop::Ss2 => 2,
        Stop::Sos => 1,
        Stop::None => 0,
    };
    if own == partner {
        None
    } else if rank(own) > rank(partner) {
        Some(own)
    } else {
        Some(partner)
    }
}

/// What differs, bit by bit. Bits masked by a differing stop are not counted twice.
fn lanes(own: &Report, partner: &Report, masked: Word) -> [Word; LANES] {
    let status = xor(&own.status, &partner.status);
    let inputs = own.inputs ^ partner.inputs;
    let acknowledgements = own.acknowledgements ^ partner.acknowledgements;
    let has_error = own.errors.is_empty() != partner.errors.is_empty();
    let single = [inputs, acknowledgements, u32::from(has_error), 0, 0, 0, 0, 0];
    let mut shown = status.0;
    for (part, mask) in shown.iter_mut().zip(masked.0) {
        *part &= !mask;
    }
    [Word(shown), xor(&own.requested, &partner.requested), Word(single), Word::ZERO]
}

fn xor(one: &Word, other: &Word) -> Word {
    let mut parts = one.0;
    for (part, other) in parts.iter_mut().zip(other.0) {
        *part ^= other;
    }
    Word(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits =
        Limits { position: 50, speed: 16_000, tolerance: 120, stop_bits: Word::from_u32(1) };

    fn report(exchange: u64, status: u32, position: i64) -> Report {
        let status = Word::from_u32(status);
        Report { exchange, status, position, phase: Phase::Operational, ..Report::default() }
    }

    fn first(found: impl Fn(&Differences) -> bool, partner: impl Fn(u64) -> u32) -> Option<u64> {
        let mut comparison = Comparison::new();
        (0..400).find(|k| {
            let theirs = report(*k, partner(*k), 0);
            found(&comparison.compare(&report(*k, 0, 0), &theirs, &LIMITS, 0))
        })
    }

    /// DEC-21: first seen in exchange 10, trips in 10 + tcc / cycle.
    #[test]
    fn a_difference_trips_after_the_fault_tolerance_time_to_the_exchange() {
        assert_eq!(first(|d| d.other, |k| u32::from(k >= 10) << 4), Some(130));
    }

    /// DEC-21: when the item agrees again its timer restarts; each item has its own.
    #[test]
    fn an_item_that_agrees_once_starts_again_and_another_item_does_not_help_it() {
        assert_eq!(first(|d| d.other, |k| u32::from((k != 100) & (k >= 10)) << 4), Some(221));
        assert_eq!(first(|d| d.other, |k| if k % 100 < 50 { 16 } else { 32 }), None);
    }

    /// AMK-PRM-01, AMK-PRM-03: equal to the limit is still permitted, beyond it trips at once.
    #[test]
    fn positions_may_differ_by_the_limit_and_no_further() {
        let judged = |position| {
            let mut comparison = Comparison::new();
            comparison.compare(&report(1, 0, 0), &report(1, 0, position), &LIMITS, 0).position
        };
        assert_eq!([50, -50, 51, -51].map(judged), [false, false, true, true]);
    }

    #[test]
    fn a_late_partner_is_paired_with_the_kept_report_of_its_exchange() {
        let mut comparison = Comparison::new();
        for k in 0..4 {
            comparison.keep(&report(k, 0, 1_000 * k as i64));
        }
        let now = report(4, 0, 4_000);
        assert!(comparison.compare(&now, &report(2, 0, 2_000), &LIMITS, 0).is_clear());
        assert!(comparison.compare(&now, &report(3, 0, 3_999), &LIMITS, 0).position);
    }

    #[test]
    fn one_channel_alone_in_a_stop_is_named_as_such() {
        let mut comparison = Comparison::new();
        let last = (0..=120).map(|k| {
            let theirs = Report { stop: Stop::Ss1, ..report(k, 0, 0) };
            comparison.compare(&report(k, 0, 0), &theirs, &LIMITS, 0)
        });
        assert_eq!(last.last().and_then(|d| d.stop), Some(Stop::Ss1));
    }
}
