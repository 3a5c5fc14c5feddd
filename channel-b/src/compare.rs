//! Comparison with the partner's report of the same exchange (DEC-21, DEC-22).

use shm_schema::error::{ErrorCode, ErrorList};
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
    /// Status bits of STO, SS1 and SS2: they belong to the item of their stop.
    pub stop_bits: [Word; STOPS],
    /// The status bit that shows an error.
    pub error_bit: Word,
    /// Errors about differences.
    pub own_codes: [ErrorCode; DIFFERENCE_CODES],
}

/// Stops that are items of their own: STO, SS1, SS2.
pub const STOPS: usize = 3;
const STOP_ITEMS: [Stop; STOPS] = [Stop::Sto, Stop::Ss1, Stop::Ss2];
/// Codes of DEC-45: 3606/13/1 to 8 as the profile names them.
pub const DIFFERENCE_CODES: usize = 8;
/// AMK: warnings do not count as errors, some belong to one channel's path alone (DEC-47).
const WARNING: u32 = 3610;

/// What a comparison found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Differences {
    /// One channel has been alone in STO, SS1, SS2 for longer than tolerated.
    pub stops: [bool; STOPS],
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

/// What of an own report is compared.
#[derive(Debug, Clone, Copy)]
pub struct Said {
    exchange: u64,
    status: Word,
    requested: Word,
    inputs: u32,
    acknowledgements: u32,
    session_id: u16,
    frame_digest: u32,
    stop: Stop,
    phase: Phase,
    position: i64,
    speed_mrpm: i32,
    parameter_signature: u32,
    /// Nothing stands; an error stands, in a run and in a start-up.
    is_free: bool,
    errs: bool,
    errs_starting: bool,
}

impl Said {
    /// Of `report`.
    pub fn of(report: &Report, limits: &Limits) -> Self {
        let is_free = report.errors.is_empty();
        let &Report {
            exchange,
            status,
            requested,
            inputs,
            acknowledgements,
            session_id,
            frame_digest,
            stop,
            phase,
            position,
            speed_mrpm,
            parameter_signature,
            ..
        } = report;
        Self {
            exchange,
            status,
            requested,
            inputs,
            acknowledgements,
            session_id,
            frame_digest,
            stop,
            phase,
            position,
            speed_mrpm,
            parameter_signature,
            is_free,
            errs: !is_free && is_counted(&report.errors, limits, false),
            errs_starting: !is_free && is_counted(&report.errors, limits, true),
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Timed {
    /// Lane (status, request, single items) and bit.
    item: (u8, u8),
    since: u64,
}

/// The own last reports and what differs.
#[derive(Debug, Clone, Copy)]
pub struct Comparison {
    kept: [Option<Said>; KEPT],
    place: usize,
    timers: Timers,
    compared: Option<u64>,
    last: Differences,
    /// `last` forbids nothing.
    is_clear: bool,
}

/// A timer for each item that differs (DEC-21).
#[derive(Debug, Clone, Copy)]
struct Timers {
    timed: [Option<Timed>; TIMED],
    /// First exchange with more differences than places.
    crowded: Option<u64>,
    /// Nothing differed in the newest exchange, tolerated or not.
    is_quiet: bool,
    /// A timer may run.
    is_timing: bool,
}

impl Comparison {
    /// Nothing compared yet.
    pub const fn new() -> Self {
        Self {
            kept: [None; KEPT],
            place: 0,
            timers: Timers { timed: [None; TIMED], crowded: None, is_quiet: false, is_timing: false },
            compared: None,
            is_clear: true,
            last: Differences {
                stops: [false; STOPS],
                other: false,
                position: false,
                speed: false,
                identity: false,
            },
        }
    }

    /// Nothing differed in the newest exchange: what start-up asks for (DEC-19).
    pub const fn is_equal(&self) -> bool {
        self.timers.is_quiet & self.is_clear
    }

    /// The newest comparison found nothing.
    pub const fn is_clear(&self) -> bool {
        self.is_clear
    }

    /// Keeps the own report of an exchange.
    pub fn keep(&mut self, own: &Said) {
        self.place = self.place.wrapping_add(1) % KEPT;
        if let Some(place) = self.kept.get_mut(self.place) {
            *place = Some(*own);
        }
    }

    /// Compares the partner's report with the own of the same exchange: `current`, or one
    /// kept. Without a pair the last result stands. `is_starting`: before the first torque.
    pub fn compare(
        &mut self,
        current: &Said,
        partner: &Report,
        limits: &Limits,
        build: u32,
        is_starting: bool,
    ) -> Differences {
        if self.compared == Some(partner.exchange) {
            return self.last;
        }
        let own = if current.exchange == partner.exchange {
            current
        } else {
            let mut kept = self.kept.iter().flatten();
            let Some(own) = kept.find(|own| own.exchange == partner.exchange) else { return self.last };
            own
        };
        if !(is_comparable(own.phase) & is_comparable(partner.phase)) {
            self.timers.is_quiet = false;
            return self.last;
        }
        self.compared = Some(partner.exchange);
        let expired = if is_alike(own, partner) {
            self.timers.rest(true);
            ([false; STOPS], false)
        } else {
            self.timers.time(own, partner, limits, is_starting)
        };
        self.last = difference(own, partner, limits, build, expired);
        self.is_clear = self.last.is_clear();
        self.last
    }
}

impl Timers {
    /// Advances the timers of everything that differs; what has differed for too long.
    fn time(
        &mut self,
        own: &Said,
        partner: &Report,
        limits: &Limits,
        is_starting: bool,
    ) -> ([bool; STOPS], bool) {
        // One channel may come to the next phase of start-up before the other: what its status
        // shows then, and an error of one that pairs, only keeps the other waiting.
        let is_ahead = is_starting & (own.phase != partner.phase);
        let theirs = is_counted(&partner.errors, limits, is_starting);
        let differs_by_error = theirs != if is_starting { own.errs_starting } else { own.errs };
        let mut masked = if is_ahead { Word([u32::MAX; 8]) } else { Word::ZERO };
        masked = if is_starting { joined(masked, limits.error_bit) } else { masked };
        let mut status = masked_out(&xor(&own.status, &partner.status), &masked);
        let stops = if is_ahead { 0 } else { alone(own, partner, &status, limits) };
        for bits in &limits.stop_bits {
            status = masked_out(&status, bits);
        }
        let single = single(own, partner, differs_by_error & !is_starting, stops);
        let lanes = [status, xor(&own.requested, &partner.requested), single];
        let is_still = lanes.iter().all(|lane| lane.0 == [0; 8]);
        if is_still {
            self.rest(!differs_by_error);
            return ([false; STOPS], false);
        }
        self.is_quiet = false;
        self.is_timing = true;
        self.forget(&lanes);
        self.enter(&lanes, own.exchange);
        self.expired(own.exchange, limits.tolerance)
    }

    /// Nothing differs: no timer runs.
    fn rest(&mut self, is_quiet: bool) {
        self.is_quiet = is_quiet;
        if self.is_timing {
            self.timed = [None; TIMED];
            self.crowded = None;
            self.is_timing = false;
        }
    }

    /// An item that agrees again loses its timer (DEC-21).
    fn forget(&mut self, lanes: &[Word; LANES]) {
        for place in &mut self.timed {
            let differs = place.is_some_and(|timed| {
                let (lane, bit) = timed.item;
                lanes.get(usize::from(lane)).is_some_and(|word| word.bit(bit))
            });
            if !differs {
                *place = None;
            }
        }
    }

    fn enter(&mut self, lanes: &[Word; LANES], exchange: u64) {
        let mut fits = true;
        for (lane, word) in (0..).zip(lanes) {
            for (part, bits) in (0..8_u8).zip(word.0) {
                let mut rest = bits;
                while rest != 0 {
                    let bit = (part << 5) | (rest.trailing_zeros() as u8 & 31);
                    fits &= self.enter_one((lane, bit), exchange);
                    rest &= rest.wrapping_sub(1);
                }
            }
        }
        self.crowded = if fits { None } else { Some(self.crowded.unwrap_or(exchange)) };
    }

    fn enter_one(&mut self, item: (u8, u8), exchange: u64) -> bool {
        if self.timed.iter().flatten().any(|timed| timed.item == item) {
            return true;
        }
        match self.timed.iter_mut().find(|place| place.is_none()) {
            Some(place) => *place = Some(Timed { item, since: exchange }),
            None => return false,
        }
        true
    }

    fn expired(&self, exchange: u64, tolerance: u64) -> ([bool; STOPS], bool) {
        let is_old = |since: u64| exchange.saturating_sub(since) >= tolerance;
        let mut stops = [false; STOPS];
        let mut other = self.crowded.is_some_and(is_old);
        for timed in self.timed.iter().flatten().filter(|timed| is_old(timed.since)) {
            let (lane, bit) = timed.item;
            let stop = (lane == SINGLE).then(|| stops.get_mut(usize::from(bit.wrapping_sub(STOP_BIT))));
            match stop.flatten() {
                Some(stop) => *stop = true,
                None => other = true,
            }
        }
        (stops, other)
    }
}

impl Default for Comparison {
    fn default() -> Self {
        Self::new()
    }
}

/// What this exchange differs in; `expired` by the timers.
fn difference(
    own: &Said,
    partner: &Report,
    limits: &Limits,
    build: u32,
    expired: ([bool; STOPS], bool),
) -> Differences {
    let distance = own.position.saturating_sub(partner.position).saturating_abs();
    let speed = i64::from(own.speed_mrpm).saturating_sub(i64::from(partner.speed_mrpm));
    let other_build = (build != 0) & (partner.build != build);
    Differences {
        stops: expired.0,
        other: expired.1,
        position: distance > limits.position,
        speed: speed.saturating_abs() > limits.speed,
        identity: other_build | (own.parameter_signature != partner.parameter_signature),
    }
}

/// The usual case: everything that is timed is the same.
fn is_alike(own: &Said, partner: &Report) -> bool {
    let words = (own.status == partner.status) & (own.requested == partner.requested);
    let levels = (own.inputs ^ partner.inputs) | (own.acknowledgements ^ partner.acknowledgements);
    let bus = (own.session_id == partner.session_id) & (own.frame_digest == partner.frame_digest);
    let state = (own.stop == partner.stop) & (own.phase == partner.phase);
    let errors = own.is_free & partner.errors.is_empty();
    words & (levels == 0) & bus & state & errors
}

/// An error stands. In a start-up those about differences between the channels do not count:
/// one that has been found would keep itself alive where the partner does not compare yet.
fn is_counted(errors: &ErrorList, limits: &Limits, is_starting: bool) -> bool {
    errors.iter().any(|code| {
        let is_own = is_starting && limits.own_codes.contains(code);
        (code.code != WARNING) & !is_own
    })
}

const LANES: usize = 3;
/// Lane of the single items: inputs, acknowledgements, then error presence, session, digest.
const SINGLE: u8 = 2;
/// Bit of the first stop in that lane.
const STOP_BIT: u8 = 96;

fn is_comparable(phase: Phase) -> bool {
    !matches!(phase, Phase::Boot | Phase::Refused)
}

/// One channel alone in a stop, by its report or its status bit; bit n for the n-th.
fn alone(own: &Said, partner: &Report, status: &Word, limits: &Limits) -> u32 {
    let stops = (0_u32..).zip(STOP_ITEMS).zip(&limits.stop_bits);
    stops.fold(0, |all, ((place, stop), bits)| {
        let by_state = (own.stop == stop) != (partner.stop == stop);
        let by_bit = masked_out(status, bits) != *status;
        all | u32::from(by_state | by_bit) << (place & 3)
    })
}

fn single(own: &Said, partner: &Report, differs_by_error: bool, stops: u32) -> Word {
    let inputs = own.inputs ^ partner.inputs;
    let acknowledgements = own.acknowledgements ^ partner.acknowledgements;
    let others =
        [differs_by_error, own.session_id != partner.session_id, own.frame_digest != partner.frame_digest];
    let others = (0..).zip(others).fold(0, |all, (place, differs)| all | u32::from(differs) << (place & 3));
    Word([inputs, acknowledgements, others, stops, 0, 0, 0, 0])
}

fn masked_out(word: &Word, mask: &Word) -> Word {
    let mut parts = word.0;
    for (part, mask) in parts.iter_mut().zip(mask.0) {
        *part &= !mask;
    }
    Word(parts)
}

fn joined(one: Word, other: Word) -> Word {
    let mut parts = one.0;
    for (part, other) in parts.iter_mut().zip(other.0) {
        *part |= other;
    }
    Word(parts)
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

    const OWN: ErrorCode = ErrorCode::amk(3606, 13, 8, 0);
    const LIMITS: Limits = Limits {
        position: 50,
        speed: 16_000,
        tolerance: 120,
        stop_bits: [Word::from_u32(1), Word::from_u32(1 << 26), Word::from_u32(1 << 27)],
        error_bit: Word::from_u32(1 << 7),
        own_codes: [OWN; DIFFERENCE_CODES],
    };

    fn report(exchange: u64, status: u32, position: i64) -> Report {
        let status = Word::from_u32(status);
        Report { exchange, status, position, phase: Phase::Operational, ..Report::default() }
    }

    fn said(report: &Report) -> Said {
        Said::of(report, &LIMITS)
    }

    fn first(found: impl Fn(&Differences) -> bool, partner: impl Fn(u64) -> u32) -> Option<u64> {
        let mut comparison = Comparison::new();
        (0..400).find(|k| {
            let theirs = report(*k, partner(*k), 0);
            found(&comparison.compare(&said(&report(*k, 0, 0)), &theirs, &LIMITS, 0, false))
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
            comparison.compare(&said(&report(1, 0, 0)), &report(1, 0, position), &LIMITS, 0, false).position
        };
        assert_eq!([50, -50, 51, -51].map(judged), [false, false, true, true]);
    }

    fn with_error(report: Report, code: ErrorCode) -> Report {
        let mut errors = ErrorList::default();
        errors.insert(code);
        Report { errors, status: Word::from_u32(1 << 7), ..report }
    }

    /// DEC-21: error presence; before the first torque the error about a difference is none.
    #[test]
    fn an_error_of_one_channel_is_a_difference_and_keeps_no_start_up_alive() {
        let seen = |code: ErrorCode, is_starting: bool| {
            let mut comparison = Comparison::new();
            let trips = (0..=120).any(|k| {
                let mut own = with_error(report(k, 0, 0), code);
                own.status = Word::ZERO;
                comparison.compare(&said(&own), &report(k, 0, 0), &LIMITS, 0, is_starting).other
            });
            (trips, comparison.is_equal())
        };
        let stale = ErrorCode::amk(3606, 7, 3, 0);
        assert_eq!([seen(stale, false), seen(stale, true)], [(true, false), (false, false)]);
        assert_eq!([seen(OWN, false), seen(OWN, true)], [(true, false), (false, true)]);
        assert!(!seen(ErrorCode::amk(3610, 76, 6, 0), false).0);
    }

    /// DEC-19: before the first torque a partner in another phase is waited for.
    #[test]
    fn what_a_later_phase_shows_is_no_difference_before_the_first_torque() {
        for (is_starting, trips) in [(true, false), (false, true)] {
            let mut comparison = Comparison::new();
            let seen = (0..=120).any(|k| {
                let partner = Report { phase: Phase::AwaitAcknowledge, ..report(k, 1 << 28, 0) };
                comparison.compare(&said(&report(k, 0, 0)), &partner, &LIMITS, 0, is_starting).other
            });
            assert_eq!(seen, trips);
        }
        let mut comparison = Comparison::new();
        let partner = with_error(report(1, 0, 0), ErrorCode::amk(3606, 7, 3, 0));
        comparison.compare(&said(&report(1, 0, 0)), &partner, &LIMITS, 0, true);
        assert!(!comparison.is_equal() & comparison.is_clear());
    }

    #[test]
    fn a_late_partner_is_paired_with_the_kept_report_of_its_exchange() {
        let mut comparison = Comparison::new();
        for k in 0..4 {
            comparison.keep(&said(&report(k, 0, 1_000 * k as i64)));
        }
        let now = said(&report(4, 0, 4_000));
        assert!(comparison.compare(&now, &report(2, 0, 2_000), &LIMITS, 0, false).is_clear());
        assert!(comparison.compare(&now, &report(3, 0, 3_999), &LIMITS, 0, false).position);
    }

    /// DEC-21, DEC-22: each stop is an item with a timer of its own.
    #[test]
    fn one_channel_alone_in_a_stop_is_named_as_such_after_the_tolerance_of_that_stop() {
        let mut comparison = Comparison::new();
        let first = (0..400).find_map(|k| {
            let (stop, status) = if k < 60 { (Stop::Ss1, 1 << 26) } else { (Stop::Sto, 1) };
            let theirs = Report { stop, ..report(k, status, 0) };
            let found = comparison.compare(&said(&report(k, 0, 0)), &theirs, &LIMITS, 0, false);
            (!found.is_clear()).then_some((k, found.stops, found.other))
        });
        assert_eq!(first, Some((180, [true, false, false], false)));
    }
}
