//! One axis: follow, pair, compare, judge, combine.

use shm_schema::agreement::{Agreement, Echo};
use shm_schema::exchange::{CrosscheckInputs, CrosscheckOutputs, Setup, Start};
use shm_schema::report::{Phase, Report};
use shm_schema::word::Word;

use crate::clock::Clocks;
use crate::combine;
use crate::compare::{Differences, Patience, Timers, at_once};
use crate::fault::{Fault, FaultSet};
use crate::limits::Limits;
use crate::pairing::{Follower, Pair, silent_max};
use crate::path::{Paths, Seen, SelfTest};

/// The cross-communication of one axis.
#[derive(Debug, Clone, Copy)]
pub struct Crosscheck {
    setup: Setup,
    limits: Limits,
    a: Follower,
    b: Follower,
    pair: Option<Pair>,
    unpaired_cycles: u8,
    missed: u64,
    /// Both channels have come so far that their reports mean something.
    comparing: bool,
    equal_since_ns: Option<u64>,
    timers: Timers,
    /// What the newest comparison found; stands until the next one.
    compared: FaultSet,
    clocks: Clocks,
    seen: Seen,
    paths: Paths,
    test: SelfTest,
    latched: FaultSet,
}

impl Crosscheck {
    /// Crosscheck of the axis `setup` names, within `limits`. Limits that are not acceptable,
    /// or are those of another axis, give a crosscheck that never permits torque.
    pub fn new(setup: &Setup, limits: &Limits) -> Self {
        let settled = setup.start == Start::Settled;
        let factor = setup.age_factor;
        Self {
            setup: *setup,
            limits: *limits,
            a: Follower::new(settled, silent_max(factor)),
            b: Follower::new(settled, silent_max(factor)),
            pair: None,
            unpaired_cycles: 0,
            missed: 0,
            comparing: settled,
            equal_since_ns: None,
            timers: Timers::NEW,
            compared: FaultSet::EMPTY,
            clocks: Clocks::new(factor),
            seen: Seen::NEW,
            paths: Paths::new(factor),
            test: SelfTest::new(settled, factor),
            latched: FaultSet::EMPTY,
        }
    }

    /// One cycle. `now_ns` is crosscheck's own clock, ns.
    pub fn step(&mut self, inputs: &CrosscheckInputs, now_ns: u64) -> CrosscheckOutputs {
        let cycle_ns = self.setup.cycle_ns;
        let sample = inputs.encoder_sequence;
        self.a.follow(&inputs.report_a, sample, now_ns, cycle_ns);
        self.b.follow(&inputs.report_b, sample, now_ns, cycle_ns);
        let stale_cycles = self.relaxed(self.setup.stale_cycles);
        self.seen.follow(&inputs.readback, stale_cycles);
        let witnesses = self.clocks.witnesses(sample, now_ns, cycle_ns, stale_cycles);

        let news = Pair::find(&self.a, &self.b, self.pair.as_ref());
        let clocks = self.clocks.channels(&self.a, &self.b, news, cycle_ns);
        let before = self.pair.as_ref().map(Pair::exchange);
        if let Some([a, b]) = news {
            match &mut self.pair {
                Some(pair) => (pair.a, pair.b) = (*a, *b),
                None => self.pair = Some(Pair { a: *a, b: *b }),
            }
            self.take_pair(before, now_ns);
        } else {
            self.unpaired_cycles = self.unpaired_cycles.saturating_add(1);
        }

        let mut standing = self.compared.and_also(witnesses).and_also(clocks);
        standing = standing.and_also(self.presence(inputs.overruns));
        standing = standing.and_also(self.self_test(now_ns));
        standing = standing.and_also(self.supervise_paths(now_ns));
        self.acknowledge(standing);
        self.outputs()
    }

    /// Exchanges on which only one channel, or none, has reported so far.
    pub const fn missed_exchanges(&self) -> u64 {
        self.missed
    }

    /// The newest reports that were compared, A's first: for the logbook.
    pub const fn compared_reports(&self) -> Option<(&Report, &Report)> {
        match &self.pair {
            Some(pair) => Some((&pair.a.payload, &pair.b.payload)),
            None => None,
        }
    }

    /// A limit in cycles, widened by the age factor.
    fn relaxed(&self, cycles: u8) -> u8 {
        cycles.saturating_mul(self.setup.age_factor.max(1))
    }

    /// Judges the new pair; `before`: the exchange of the last one.
    fn take_pair(&mut self, before: Option<u64>, now_ns: u64) {
        let Some(pair) = &self.pair else { return };
        if let Some(before) = before {
            let distance = pair.exchange().saturating_sub(before);
            self.missed = self.missed.saturating_add(distance.saturating_sub(1));
        }
        self.unpaired_cycles = 0;
        let (a, b) = (&pair.a.payload, &pair.b.payload);
        let past_boot = a.phase.min(b.phase) >= Phase::Pairing;
        let in_boot = a.phase.min(b.phase) == Phase::Boot;
        self.comparing |= past_boot;
        if self.comparing {
            self.compare(now_ns);
        }
        if !past_boot {
            // A channel that begins again has to be tested again (DEC-19).
            self.equal_since_ns = None;
            if in_boot {
                self.test.reset();
            }
        }
    }

    fn compare(&mut self, now_ns: u64) {
        let Some(pair) = &self.pair else { return };
        let (a, b) = (&pair.a.payload, &pair.b.payload);
        let differences = Differences::between(a, b, &self.limits);
        let patience = Patience { now_ns, tcc_ns: self.limits.tcc_ns, slack_ns: self.setup.cycle_ns >> 1 };
        let lasting = self.timers.follow(&differences, &patience);
        let immediate = at_once(a, b, &self.limits);
        self.compared = lasting.and_also(immediate);
        let equal = differences.is_empty() && (immediate == FaultSet::EMPTY);
        self.equal_since_ns = if equal { self.equal_since_ns.or(Some(now_ns)) } else { None };
    }

    /// DEC-23, overruns, and what the image alone decides.
    fn presence(&self, overruns: u8) -> FaultSet {
        let both_heard = self.a.newest().is_some() & self.b.newest().is_some();
        let never_meet = both_heard && (self.unpaired_cycles >= silent_max(self.setup.age_factor));
        let max = self.relaxed(self.setup.overruns_max.max(1));
        let late = [Some(overruns), overruns_of(&self.a), overruns_of(&self.b)];
        let too_late = late.iter().flatten().any(|count| *count >= max);
        let own_image = self.limits.acceptable && (self.limits.axis == self.setup.axis);
        let mut faults = FaultSet::EMPTY;
        faults.add_if(self.a.is_lost() | self.b.is_lost(), Fault::PartnerLost);
        faults.add_if(never_meet | too_late, Fault::PartnerLost);
        faults.add_if(!own_image, Fault::Parameter);
        faults
    }

    fn supervise_paths(&mut self, now_ns: u64) -> FaultSet {
        if self.test.runs() {
            return self.paths.leave_to_test(&self.seen, now_ns);
        }
        self.paths.observe(self.driven(), self.tested(), &self.seen, now_ns)
    }

    /// What A and B drive. A channel that is lost drives nothing as far as anyone knows; a
    /// withheld test edge is no end of driving.
    fn driven(&self) -> (bool, bool) {
        let drives = |channel: &Follower| {
            let report = channel.newest().filter(|_| channel.is_present());
            report.is_some_and(|report| report.payload.driving | report.payload.test_pulse)
        };
        (drives(&self.a), drives(&self.b))
    }

    /// Whose edge is withheld by a report of this cycle.
    fn tested(&self) -> (bool, bool) {
        let tests = |channel: &Follower| {
            let report = channel.newest().filter(|_| channel.advanced());
            report.is_some_and(|report| report.payload.test_pulse)
        };
        (tests(&self.a), tests(&self.b))
    }

    /// DEC-19: after one fault tolerance time of equality, when both channels wait for it.
    fn self_test(&mut self, now_ns: u64) -> FaultSet {
        let waits = |channel: &Follower| {
            channel.newest().is_some_and(|report| report.payload.phase == Phase::SelfTest)
        };
        let both_wait = waits(&self.a) & waits(&self.b);
        let equal_ns = self.equal_since_ns.map_or(0, |since_ns| now_ns.saturating_sub(since_ns));
        let long_equal = equal_ns >= self.limits.tcc_ns.max(1);
        let may_begin = [both_wait, long_equal, self.limits.acceptable, !self.latched.removes_torque()];
        self.test.advance(!may_begin.contains(&false), &self.seen)
    }

    /// DEC-15: one edge clears everything whose cause is gone and whose class allows it.
    fn acknowledge(&mut self, standing: FaultSet) {
        let before = self.latched;
        if self.a.edge() | self.b.edge() {
            self.latched = self.latched.acknowledged(standing);
        }
        self.latched = self.latched.and_also(standing);
        let cleared = before.removes_torque() & !self.latched.removes_torque();
        if cleared & self.test.is_failed() {
            self.test.reset();
        }
    }

    /// Whether torque is permitted as far as crosscheck is concerned.
    fn permits(&self) -> bool {
        let ready = |channel: &Follower| {
            let report = channel.newest().filter(|_| channel.is_present());
            report.is_some_and(|report| report.payload.ready)
        };
        let reasons = [
            self.limits.acceptable,
            self.comparing,
            self.pair.is_some_and(|pair| pair.a.payload.ready & pair.b.payload.ready),
            self.unpaired_cycles < silent_max(self.setup.age_factor),
            // The newest word of each counts too: what is withdrawn is withdrawn at once.
            ready(&self.a),
            ready(&self.b),
            self.test.is_passed(),
            self.seen.is_known(),
            !self.latched.removes_torque(),
        ];
        !reasons.contains(&false)
    }

    fn outputs(&self) -> CrosscheckOutputs {
        let permit = self.permits();
        let error = self.latched.removes_torque();
        let (driven_a, driven_b) = self.driven();
        let torque = [permit, driven_a, driven_b];
        let mut agreement = Agreement {
            permit,
            error,
            path_test: self.test.shown(),
            errors: self.latched.errors(self.limits.profile),
            ..Agreement::default()
        };
        let rules = &self.limits.status;
        let mut drive = combine::DRIVE_SAFE;
        agreement.status = combine::overlay_sto(&Word::ZERO, rules, error);
        if let Some(pair) = &self.pair {
            let (a, b) = (&pair.a.payload, &pair.b.payload);
            let combined = combine::status(&a.status, &b.status, rules);
            agreement.status = if error { combine::overlay_sto(&combined, rules, true) } else { combined };
            agreement.exchange = pair.exchange();
            agreement.echo_a = self.echo(pair.a.payload.exchange, pair.a.crc32);
            agreement.echo_b = self.echo(pair.b.payload.exchange, pair.b.crc32);
            agreement.position = a.position;
            agreement.speed_mrpm = combine::speed_mrpm(a, b);
            if !error {
                drive = combine::drive(&a.drive, &b.drive);
            }
        }
        CrosscheckOutputs { agreement, drive, torque: !torque.contains(&false) }
    }

    const fn echo(&self, exchange: u64, crc32: u32) -> Echo {
        Echo { exchange, boot_nonce: self.setup.boot_nonce, crc32 }
    }
}

fn overruns_of(channel: &Follower) -> Option<u8> {
    channel.newest().map(|report| report.payload.overruns)
}
