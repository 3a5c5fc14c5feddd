//! The partner's report against the own one of the same exchange, and the agreement
//! (DEC-21 to DEC-23).

use shm_schema::agreement::{Agreement, Echo, PathTest};
use shm_schema::exchange::{Published, Received};
use shm_schema::report::Report;
use shm_schema::word::Word;

use crate::clock::Measured;
use crate::compare::{Differences, PARTS};
use crate::fresh::Missed;

/// Own reports kept for the comparison and the echo.
const KEPT: usize = 4;
/// Oldest own report an agreement may echo, in exchanges.
const ECHO_AGE: u64 = 2;

/// What the partner may differ by.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tolerance {
    /// Increments (Prm2).
    pub position: i64,
    /// 1/1000 rpm (Prm3).
    pub speed: i64,
    /// Fault tolerance time, ns (DEC-20).
    pub time_ns: u64,
}

/// The compared part of an own report.
#[derive(Debug, Clone, Copy, Default)]
pub struct Own {
    /// Exchange number.
    pub exchange: u64,
    /// Status word.
    pub status: Word,
    /// Requested functions.
    pub requested: Word,
    /// Debounced levels.
    pub inputs: u32,
    /// Acknowledge levels.
    pub acknowledgements: u32,
    /// Increments.
    pub position: i64,
    /// 1/1000 rpm.
    pub speed: i64,
}

/// What the comparison found in this step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Findings {
    /// No report for three cycles.
    pub lost: bool,
    /// Position further apart than permitted.
    pub position: bool,
    /// Speed further apart than permitted.
    pub speed: bool,
    /// Other parameters, build or program flow.
    pub identity: bool,
    /// The partner's clock runs wrong.
    pub clock: bool,
    /// Bits of the status words that differ for too long.
    pub status: u32,
    /// Bits of the debounced levels that differ for too long.
    pub inputs: u32,
    /// Something else of DEC-21 differs for too long.
    pub other: bool,
}

impl Findings {
    /// Nothing found that takes the own permission away.
    pub fn permits(&self) -> bool {
        let values = self.position | self.speed | self.identity | self.clock;
        let states = (self.status != 0) | (self.inputs != 0) | self.other;
        !(self.lost | values | states)
    }
}

/// What the channel knows of the other two.
#[derive(Debug, Clone)]
pub struct Partner {
    tolerance: Tolerance,
    signature: u32,
    build: u32,
    own: [Own; KEPT],
    published: [Published; KEPT],
    missed: Missed,
    missed_agreement: Missed,
    differences: Differences,
    clock: Measured,
    flow: Option<u32>,
    found: Findings,
    /// Newest exchange accepted.
    pub exchange: u64,
    /// The partner's path was refreshed as of its last report.
    pub driving: bool,
    agreement: Option<Agreement>,
    sequence: u64,
}

impl Partner {
    /// A partner not heard of yet; `build` 0 is not checked.
    pub fn new(tolerance: Tolerance, signature: u32, build: u32) -> Self {
        Self {
            tolerance,
            signature,
            build,
            own: [Own { exchange: u64::MAX, ..Own::default() }; KEPT],
            published: [Published { exchange: 0, crc32: 0 }; KEPT],
            missed: Missed::default(),
            missed_agreement: Missed::default(),
            differences: Differences::new(),
            clock: Measured::default(),
            flow: None,
            found: Findings::default(),
            exchange: 0,
            driving: false,
            agreement: None,
            sequence: 0,
        }
    }

    /// Keeps an own report for the comparison.
    pub fn keep(&mut self, own: Own) {
        self.own.rotate_right(1);
        self.own[0] = own;
    }

    /// Keeps what the shell published.
    pub fn published(&mut self, published: Option<Published>) {
        if let Some(published) = published.filter(|new| *new != self.published[0]) {
            self.published.rotate_right(1);
            self.published[0] = published;
        }
    }

    /// One cycle of the partner's report.
    pub fn compare(&mut self, received: &Received<Report>, now_ns: u64) -> Findings {
        let sample = received.as_ref().ok();
        let lost = self.missed.step(sample.map(|sample| sample.sequence));
        self.found.lost = lost;
        if lost {
            self.clock.restart();
            self.differences.clear();
        }
        let fresh = sample.filter(|sample| sample.sequence != self.sequence);
        if let Some(sample) = fresh {
            self.sequence = sample.sequence;
            self.driving = sample.payload.driving;
            self.judge(&sample.payload, now_ns);
        }
        self.found
    }

    fn judge(&mut self, report: &Report, now_ns: u64) {
        let lost = self.found.lost;
        self.found = Findings { lost, ..Findings::default() };
        self.found.clock = !self.clock.step(now_ns, report.time_ns);
        let other_build = (self.build != 0) & (report.build != self.build);
        let flow = *self.flow.get_or_insert(report.flow);
        let other_flow = flow != report.flow;
        let other_set = report.parameter_signature != self.signature;
        self.found.identity = other_build | other_flow | other_set;
        self.exchange = report.exchange;
        let Some(own) = self.own.iter().find(|own| own.exchange == report.exchange).copied() else {
            return;
        };
        let apart = own.position.saturating_sub(report.position).saturating_abs();
        self.found.position = apart > self.tolerance.position;
        let faster = own.speed.saturating_sub(i64::from(report.speed_mrpm)).saturating_abs();
        self.found.speed = faster > self.tolerance.speed;
        self.states(&own, report, now_ns);
    }

    fn states(&mut self, own: &Own, report: &Report, now_ns: u64) {
        let words_agree = (own.status == report.status) & (own.requested == report.requested);
        let levels_agree = (own.inputs, own.acknowledgements) == (report.inputs, report.acknowledgements);
        if words_agree & levels_agree {
            self.differences.clear();
            return;
        }
        let mut masks = [0; PARTS];
        let words = own.status.0.iter().zip(&report.status.0);
        let requests = own.requested.0.iter().zip(&report.requested.0);
        let single = [(&own.inputs, &report.inputs), (&own.acknowledgements, &report.acknowledgements)];
        let pairs = words.chain(requests).chain(single);
        for (mask, (own, other)) in masks.iter_mut().zip(pairs) {
            *mask = own ^ other;
        }
        let expired = self.differences.step(&masks, now_ns, self.tolerance.time_ns);
        self.found.status = expired[0];
        self.found.inputs = expired[16];
        let rest = expired.iter().enumerate().filter(|(part, _)| (*part != 0) & (*part != 16));
        self.found.other = rest.fold(0, |all, (_, bits)| all | bits) != 0;
    }

    /// One cycle of the agreement; `true` while it is lost.
    pub fn agree(&mut self, received: &Received<Agreement>) -> bool {
        let sample = received.as_ref().ok();
        let lost = self.missed_agreement.step(sample.map(|sample| sample.sequence));
        if let Some(sample) = sample {
            self.agreement = Some(sample.payload);
        }
        lost
    }

    /// The agreement echoes an own report of at most two exchanges ago; an exchange whose sample
    /// this channel never saw is missed and does not count.
    pub fn echoed(&self, exchange: u64, boot_nonce: u32) -> bool {
        let Some(Agreement { echo_a: Echo { exchange: number, boot_nonce: nonce, crc32 }, .. }) =
            self.agreement
        else {
            return false;
        };
        let age = exchange.wrapping_sub(number);
        let known = self.published.iter().any(|own| (own.exchange, own.crc32) == (number, crc32));
        let newest = self.published.iter().take(ECHO_AGE as usize);
        let recent = newest.into_iter().any(|own| own.exchange == number);
        let young = (age <= ECHO_AGE) | recent;
        young & known & (nonce == boot_nonce)
    }

    /// Crosscheck permits torque.
    pub fn permitted(&self) -> bool {
        self.agreement.as_ref().is_some_and(|agreement| agreement.permit & !agreement.error)
    }

    /// An error of crosscheck's own stands.
    pub fn error(&self) -> bool {
        self.agreement.as_ref().is_some_and(|agreement| agreement.error)
    }

    /// The path crosscheck wants raised.
    pub fn path_test(&self) -> PathTest {
        self.agreement.as_ref().map_or(PathTest::None, |agreement| agreement.path_test)
    }
}
