//! The two switch-off paths: readback supervision, self-test at start, dormant faults.

use shm_schema::agreement::PathTest;
use shm_schema::exchange::Received;
use shm_schema::inhibit::Readback;

use crate::fault::{Fault, FaultSet};

/// Cycles a driven path may take to read on (design 8: three exchange cycles).
const FOLLOW_ON_CYCLES: u32 = 3;
/// Cycles an undriven path may take to read off: as above, plus the evaluator's dead-man.
const FOLLOW_OFF_CYCLES: u32 = 6;
/// Cycles one step of the self-test may take.
const TEST_STEP_CYCLES: u32 = 20;
/// Time without a dynamic test after which a path may hide a dormant fault (AMK-PATH-03), ns.
const DORMANT_NS: u64 = 3_600_000_000_000;

/// The readback as long as it can be believed.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    readback: Option<Readback>,
    sequence: u64,
    silent: u8,
    advanced: bool,
}

impl Seen {
    /// Nothing read yet.
    pub const NEW: Self = Self { readback: None, sequence: 0, silent: 0, advanced: false };

    /// Takes in what the evaluator shows in this cycle.
    pub fn follow(&mut self, received: &Received<Readback>, stale_cycles: u8) {
        self.advanced = false;
        match received {
            Ok(sampled) if self.is_news(sampled.sequence) => {
                self.readback = Some(sampled.payload);
                self.sequence = sampled.sequence;
                self.silent = 0;
                self.advanced = true;
            }
            _ => self.miss(stale_cycles),
        }
    }

    fn is_news(&self, sequence: u64) -> bool {
        let first = self.readback.is_none();
        let newer = sequence > self.sequence;
        first | newer
    }

    fn miss(&mut self, stale_cycles: u8) {
        self.silent = self.silent.saturating_add(1);
        if self.silent >= stale_cycles {
            self.readback = None;
        }
    }

    /// Whether the readback is known.
    pub const fn is_known(&self) -> bool {
        self.readback.is_some()
    }

    fn paths(&self) -> (Option<bool>, Option<bool>) {
        (self.readback.map(|seen| seen.path_a), self.readback.map(|seen| seen.path_b))
    }
}

/// One path against what its channel drives.
#[derive(Debug, Clone, Copy, Default)]
struct Watch {
    driven_cycles: u32,
    idle_cycles: u32,
}

impl Watch {
    /// (stuck on, dead).
    fn observe(&mut self, driven: bool, reads_on: Option<bool>, age_factor: u32) -> (bool, bool) {
        self.driven_cycles = if driven { self.driven_cycles.saturating_add(1) } else { 0 };
        self.idle_cycles = if driven { 0 } else { self.idle_cycles.saturating_add(1) };
        let should_read_off = self.idle_cycles > FOLLOW_OFF_CYCLES.saturating_mul(age_factor);
        let should_read_on = self.driven_cycles > FOLLOW_ON_CYCLES.saturating_mul(age_factor);
        let stuck = should_read_off && (reads_on == Some(true));
        // No readback is no proof that the path follows.
        let dead = should_read_on && (reads_on != Some(true));
        (stuck, dead)
    }
}

/// The dynamic test of a path, and when it was last seen to pause its edges while it was on.
#[derive(Debug, Clone, Copy)]
struct Pulse {
    edges: u64,
    paused_ns: Option<u64>,
    /// Cycles since a test edge was withheld whose pause has not been seen yet.
    awaited_cycles: Option<u32>,
    failed_tests: u32,
}

impl Pulse {
    const NEW: Self = Self { edges: 0, paused_ns: None, awaited_cycles: None, failed_tests: 0 };

    fn observe(&mut self, on: bool, edges: u64, now_ns: u64) {
        let same = edges == self.edges;
        self.edges = edges;
        if on & same {
            self.paused_ns = Some(now_ns);
        }
        if !on | same {
            self.awaited_cycles = None;
            self.failed_tests = 0;
        }
    }

    /// Design 8: a path that goes on while its edge is withheld is stuck; found within one test
    /// period. In the relaxed timing the evaluator itself may miss the pause of a test.
    fn is_stuck(&mut self, tested: bool, age_factor: u32) -> bool {
        if let Some(cycles) = &mut self.awaited_cycles {
            *cycles = cycles.saturating_add(1);
        }
        let over = self.awaited_cycles.is_some_and(|cycles| cycles > FOLLOW_OFF_CYCLES);
        if over {
            self.awaited_cycles = None;
            self.failed_tests = self.failed_tests.saturating_add(1);
        }
        if tested {
            self.awaited_cycles = self.awaited_cycles.or(Some(0));
        }
        self.failed_tests >= age_factor
    }

    fn is_dormant(&mut self, now_ns: u64) -> bool {
        let since_ns = *self.paused_ns.get_or_insert(now_ns);
        now_ns.saturating_sub(since_ns) > DORMANT_NS
    }
}

/// Supervision of both paths.
#[derive(Debug, Clone, Copy)]
pub struct Paths {
    a: Watch,
    b: Watch,
    pulse_a: Pulse,
    pulse_b: Pulse,
    age_factor: u32,
}

impl Paths {
    /// Neither path driven; `age_factor` as in the setup.
    pub fn new(age_factor: u8) -> Self {
        Self {
            a: Watch::default(),
            b: Watch::default(),
            pulse_a: Pulse::NEW,
            pulse_b: Pulse::NEW,
            age_factor: age_factor.max(1).into(),
        }
    }

    /// The self-test runs and judges the paths itself; afterwards both are judged anew.
    pub fn leave_to_test(&mut self, seen: &Seen, now_ns: u64) -> FaultSet {
        (self.a, self.b) = (Watch::default(), Watch::default());
        self.dormant(seen, now_ns)
    }

    /// Judges one cycle; `driven` says what A and B drive.
    ///
    /// `tested`: A and B withhold their edge in the report that came in this cycle.
    pub fn observe(
        &mut self,
        driven: (bool, bool),
        tested: (bool, bool),
        seen: &Seen,
        now_ns: u64,
    ) -> FaultSet {
        let (reads_a, reads_b) = seen.paths();
        let (stuck_a, dead_a) = self.a.observe(driven.0, reads_a, self.age_factor);
        let (stuck_b, dead_b) = self.b.observe(driven.1, reads_b, self.age_factor);
        let mut faults = self.dormant(seen, now_ns);
        let conducts_a = self.pulse_a.is_stuck(tested.0 & driven.0, self.age_factor);
        let conducts_b = self.pulse_b.is_stuck(tested.1 & driven.1, self.age_factor);
        faults.add_if(stuck_a | conducts_a, Fault::PathAStuck);
        faults.add_if(dead_a, Fault::PathADead);
        faults.add_if(stuck_b | conducts_b, Fault::PathBStuck);
        faults.add_if(dead_b, Fault::PathBDead);
        faults
    }

    fn dormant(&mut self, seen: &Seen, now_ns: u64) -> FaultSet {
        if let Some(readback) = seen.readback.filter(|_| seen.advanced) {
            self.pulse_a.observe(readback.path_a, readback.edges_a, now_ns);
            self.pulse_b.observe(readback.path_b, readback.edges_b, now_ns);
        }
        let mut faults = FaultSet::EMPTY;
        faults.add_if(self.pulse_a.is_dormant(now_ns), Fault::DormantA);
        faults.add_if(self.pulse_b.is_dormant(now_ns), Fault::DormantB);
        faults
    }
}

/// Steps of the self-test (DEC-19), in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Idle,
    BothOff,
    RaiseA,
    OffAgain,
    RaiseB,
    OffAtLast,
    Passed,
    Failed,
}

impl Step {
    /// What is published, what A and B must read, and what follows.
    const fn row(self) -> (PathTest, bool, bool, Self) {
        match self {
            Self::Idle => (PathTest::None, false, false, Self::Idle),
            Self::BothOff => (PathTest::None, false, false, Self::RaiseA),
            Self::RaiseA => (PathTest::RaiseA, true, false, Self::OffAgain),
            Self::OffAgain => (PathTest::None, false, false, Self::RaiseB),
            Self::RaiseB => (PathTest::RaiseB, false, true, Self::OffAtLast),
            Self::OffAtLast => (PathTest::None, false, false, Self::Passed),
            Self::Passed => (PathTest::Passed, true, true, Self::Passed),
            Self::Failed => (PathTest::None, false, false, Self::Failed),
        }
    }

    const fn runs(self) -> bool {
        !matches!(self, Self::Idle | Self::Passed | Self::Failed)
    }
}

/// The self-test at start, led by crosscheck.
#[derive(Debug, Clone, Copy)]
pub struct SelfTest {
    step: Step,
    cycles: u32,
    cycles_max: u32,
}

impl SelfTest {
    /// `passed`: the start-up is complete already (settled start).
    pub fn new(passed: bool, age_factor: u8) -> Self {
        let step = if passed { Step::Passed } else { Step::Idle };
        Self { step, cycles: 0, cycles_max: TEST_STEP_CYCLES.saturating_mul(age_factor.max(1).into()) }
    }

    /// What the agreement shows.
    pub const fn shown(self) -> PathTest {
        self.step.row().0
    }

    /// Whether both paths have been seen on and off.
    pub fn is_passed(self) -> bool {
        self.step == Step::Passed
    }

    /// Whether the test is under way.
    pub const fn runs(self) -> bool {
        self.step.runs()
    }

    /// Back to the beginning: a channel started anew, or a failed test was acknowledged.
    pub const fn reset(&mut self) {
        self.enter(Step::Idle);
    }

    /// Whether a test failed and waits for the acknowledgement.
    pub fn is_failed(self) -> bool {
        self.step == Step::Failed
    }

    /// One cycle; the test begins when `may_begin`. A fault ends it.
    pub fn advance(&mut self, may_begin: bool, seen: &Seen) -> FaultSet {
        let begins = (self.step == Step::Idle) & may_begin;
        if begins {
            self.enter(Step::BothOff);
        }
        if !self.step.runs() {
            return FaultSet::EMPTY;
        }
        self.cycles = self.cycles.saturating_add(1);
        let (_, wants_a, wants_b, next) = self.step.row();
        let (reads_a, reads_b) = seen.paths();
        if (reads_a, reads_b) == (Some(wants_a), Some(wants_b)) {
            self.enter(next);
            return FaultSet::EMPTY;
        }
        if self.cycles <= self.cycles_max {
            return FaultSet::EMPTY;
        }
        self.enter(Step::Failed);
        blame((wants_a, reads_a), (wants_b, reads_b))
    }

    const fn enter(&mut self, step: Step) {
        self.step = step;
        self.cycles = 0;
    }
}

/// Which path did not read what was wanted; without a readback both count as dead.
fn blame(a: (bool, Option<bool>), b: (bool, Option<bool>)) -> FaultSet {
    let mut faults = FaultSet::EMPTY;
    faults.add_if(a == (false, Some(true)), Fault::PathAStuck);
    faults.add_if(b == (false, Some(true)), Fault::PathBStuck);
    faults.add_if(a == (true, Some(false)), Fault::PathADead);
    faults.add_if(b == (true, Some(false)), Fault::PathBDead);
    faults.add_if(a.1.is_none(), Fault::PathADead);
    faults.add_if(b.1.is_none(), Fault::PathBDead);
    faults
}
