//! Clock supervision (DEC-26): rates and steps of other clocks against the own one.

use shm_schema::exchange::Sampled;
use shm_schema::report::Report;

use crate::fault::{Fault, FaultSet};
use crate::pairing::Follower;

/// Time over which a rate is measured, ns.
const WINDOW_NS: u64 = 1_000_000_000;
/// Inverse of the largest rate difference: 2 %.
const RATE: u64 = 50;
/// Cycles by which a clock may jump against the own one. A report may come up to three
/// cycles late before its writer counts as lost, so less would be no clock fault.
const STEP_CYCLES: u64 = 3;

/// How far two clocks may differ; `age_factor` widens both limits (Setup).
#[derive(Debug, Clone, Copy)]
struct Limit {
    step_max_ns: u64,
    age_factor: u64,
}

impl Limit {
    fn new(cycle_ns: u64, age_factor: u8) -> Self {
        let age_factor = u64::from(age_factor.max(1));
        let step_max_ns = cycle_ns.saturating_mul(STEP_CYCLES).saturating_mul(age_factor);
        Self { step_max_ns, age_factor }
    }
}

/// Two clocks, one judged by the other.
#[derive(Debug, Clone, Copy, Default)]
struct Watch {
    begun: bool,
    start: (u64, u64),
    last: (u64, u64),
}

impl Watch {
    /// Takes one reading of both, ns; whether they go differently.
    fn observe(&mut self, own_ns: u64, other_ns: u64, limit: Limit) -> bool {
        if !self.begun {
            *self = Self { begun: true, start: (own_ns, other_ns), last: (own_ns, other_ns) };
            return false;
        }
        let backwards = (own_ns < self.last.0) || (other_ns < self.last.1);
        let step = advance(self.last, own_ns, other_ns);
        let stepped = step.0.abs_diff(step.1) > limit.step_max_ns;
        self.last = (own_ns, other_ns);
        let off = backwards | stepped | self.drifts(own_ns, other_ns, limit.age_factor);
        if off {
            *self = Self::default();
        }
        off
    }

    fn drifts(&mut self, own_ns: u64, other_ns: u64, age_factor: u64) -> bool {
        let (own, other) = advance(self.start, own_ns, other_ns);
        if own < WINDOW_NS {
            return false;
        }
        self.start = (own_ns, other_ns);
        own.abs_diff(other).saturating_mul(RATE) > own.saturating_mul(age_factor)
    }
}

fn advance(from: (u64, u64), own_ns: u64, other_ns: u64) -> (u64, u64) {
    (own_ns.saturating_sub(from.0), other_ns.saturating_sub(from.1))
}

/// All clocks crosscheck can see.
#[derive(Debug, Clone, Copy, Default)]
pub struct Clocks {
    a: Watch,
    b: Watch,
    each_other: Watch,
    producer: Watch,
    newest_sample: Option<u64>,
    standing_cycles: u8,
    now_ns: u64,
    age_factor: u8,
}

impl Clocks {
    /// Nothing seen yet; `age_factor` as in the setup.
    pub fn new(age_factor: u8) -> Self {
        Self { age_factor, ..Self::default() }
    }

    /// Judges the clocks of both channels by crosscheck's own and by each other.
    pub fn channels(
        &mut self,
        a: &Follower,
        b: &Follower,
        pair: Option<[&Sampled<Report>; 2]>,
        cycle_ns: u64,
    ) -> FaultSet {
        let limit = Limit::new(cycle_ns, self.age_factor);
        let mut faults = FaultSet::EMPTY;
        faults.add_if(against_own(&mut self.a, a, self.now_ns, limit), Fault::ClockA);
        faults.add_if(against_own(&mut self.b, b, self.now_ns, limit), Fault::ClockB);
        if let Some([a, b]) = pair {
            let (time_a, time_b) = (a.payload.time_ns, b.payload.time_ns);
            if self.each_other.observe(time_a, time_b, limit) {
                // Neither agrees with the other: nobody knows which one is right.
                faults = faults.with(Fault::ClockA).with(Fault::ClockB);
            }
        }
        faults
    }

    /// Judges crosscheck's own clock and the rate of the producer's samples. A producer that
    /// stands still is the channels' business; its rate is measured anew when it goes on.
    pub fn witnesses(
        &mut self,
        sample: Option<u64>,
        now_ns: u64,
        cycle_ns: u64,
        stale_cycles: u8,
    ) -> FaultSet {
        let own_backwards = now_ns < self.now_ns;
        self.now_ns = now_ns;
        let went_on = match (sample, self.newest_sample) {
            (Some(sample), Some(newest)) => sample > newest,
            (Some(_), None) => true,
            (None, _) => false,
        };
        if went_on {
            self.newest_sample = sample;
        }
        self.standing_cycles = if went_on { 0 } else { self.standing_cycles.saturating_add(1) };
        if self.standing_cycles >= stale_cycles {
            self.producer = Watch::default();
        }
        let producer_off = match sample {
            Some(sample) if went_on => {
                let any_step = Limit { step_max_ns: u64::MAX, ..Limit::new(cycle_ns, self.age_factor) };
                self.producer.observe(now_ns, sample.saturating_mul(cycle_ns), any_step)
            }
            _ => false,
        };
        let mut faults = FaultSet::EMPTY;
        faults.add_if(own_backwards | producer_off, Fault::ClockWitness);
        faults
    }
}

fn against_own(watch: &mut Watch, channel: &Follower, now_ns: u64, limit: Limit) -> bool {
    if channel.is_lost() {
        *watch = Watch::default();
    }
    match channel.newest() {
        Some(report) if channel.advanced() => watch.observe(now_ns, report.payload.time_ns, limit),
        _ => false,
    }
}
