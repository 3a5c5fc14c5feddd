//! Start-up (DEC-19): how far the axis has come, and what is missing for torque.

use shm_schema::agreement::PathTest;
use shm_schema::report::Phase;

/// Cycles the own path may stay raised in the self-test: crosscheck gives up after 20.
const RAISED_MAX: u32 = 24;

/// What a step tells the start-up.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// Image sound and encoder plausible.
    pub is_sound: bool,
    /// Agreement fresh, own report echoed, no difference to the partner.
    pub is_equal: bool,
    /// What the agreement asks of the paths.
    pub path_test: PathTest,
    /// The own path reads on; `None` without readback.
    pub reads_on: Option<bool>,
    /// An acknowledge edge in this cycle.
    pub edge: bool,
    /// A stop request or an error stands.
    pub is_stopped: bool,
}

/// State of the start-up.
#[derive(Debug, Clone, Copy)]
pub struct Startup {
    phase: Phase,
    equal_since: Option<u64>,
    raised: u32,
    seen_on: bool,
    seen_off: bool,
}

impl Startup {
    /// In `phase`.
    pub const fn new(phase: Phase) -> Self {
        Self { phase, equal_since: None, raised: 0, seen_on: false, seen_off: false }
    }

    /// How far it is.
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// The own path is to be raised for its test in this cycle.
    pub fn raises(&self, path_test: PathTest) -> bool {
        let is_asked = path_test == PathTest::RaiseB;
        (self.phase == Phase::SelfTest) & is_asked & (self.raised < RAISED_MAX)
    }

    /// One step.
    pub fn step(&mut self, progress: &Progress, tolerance_ns: u64, now: u64) {
        match self.phase {
            Phase::Boot if progress.is_sound => self.phase = Phase::Pairing,
            Phase::Pairing => self.pair(progress.is_equal, tolerance_ns, now),
            Phase::SelfTest => self.test(progress),
            Phase::AwaitAcknowledge if progress.edge & !progress.is_stopped => {
                self.phase = Phase::Operational;
            }
            _ => {}
        }
    }

    fn pair(&mut self, is_equal: bool, tolerance_ns: u64, now: u64) {
        if !is_equal {
            self.equal_since = None;
            return;
        }
        let since = *self.equal_since.get_or_insert(now);
        if now.saturating_sub(since) >= tolerance_ns {
            self.phase = Phase::SelfTest;
        }
    }

    /// Passed only when this channel itself has seen its path off while the partner's was
    /// raised, and on while its own was.
    fn test(&mut self, progress: &Progress) {
        let raises = progress.path_test == PathTest::RaiseB;
        self.raised = if raises { self.raised.saturating_add(1) } else { 0 };
        let is_off = progress.reads_on == Some(false);
        self.seen_on |= raises & (progress.reads_on == Some(true));
        self.seen_off |= is_off & (progress.path_test == PathTest::RaiseA);
        let passed = progress.path_test == PathTest::Passed;
        if passed & self.seen_on & self.seen_off {
            self.phase = Phase::AwaitAcknowledge;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn progress(path_test: PathTest, reads_on: bool) -> Progress {
        let reads_on = Some(reads_on);
        Progress { is_sound: true, is_equal: true, path_test, reads_on, edge: false, is_stopped: false }
    }

    /// DEC-19: equality for one fault tolerance time, then each path seen off and on.
    #[test]
    fn torque_waits_for_equality_self_test_and_an_edge() {
        let mut startup = Startup::new(Phase::Boot);
        let idle = progress(PathTest::None, false);
        for cycle in 0..=121 {
            assert_ne!(startup.phase(), Phase::SelfTest);
            startup.step(&idle, 120 * MS, cycle * MS);
        }
        assert_eq!(startup.phase(), Phase::SelfTest);
        startup.step(&progress(PathTest::Passed, false), 0, 0);
        assert_eq!(startup.phase(), Phase::SelfTest, "nothing was seen yet");
        startup.step(&progress(PathTest::RaiseA, false), 0, 0);
        startup.step(&progress(PathTest::RaiseB, true), 0, 0);
        startup.step(&progress(PathTest::Passed, false), 0, 0);
        assert_eq!(startup.phase(), Phase::AwaitAcknowledge);
        let edge = Progress { edge: true, ..progress(PathTest::Passed, false) };
        startup.step(&Progress { is_stopped: true, ..edge }, 0, 0);
        assert_eq!(startup.phase(), Phase::AwaitAcknowledge);
        startup.step(&edge, 0, 0);
        assert_eq!(startup.phase(), Phase::Operational);
    }

    #[test]
    fn the_path_is_not_raised_for_ever() {
        let mut startup = Startup::new(Phase::SelfTest);
        let raised = (0..100).filter(|_| {
            let raises = startup.raises(PathTest::RaiseB);
            startup.step(&progress(PathTest::RaiseB, false), 0, 0);
            raises
        });
        assert_eq!(raised.count(), 24);
    }
}
