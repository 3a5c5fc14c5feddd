//! Start-up (DEC-19): how far the axis has come, and what is missing for torque.
//!
//! Until the first torque nothing has to be latched: what disturbs the start-up withholds
//! the next step or begins anew, and the first torque needs an acknowledge edge anyway. A
//! partner that begins anew takes this channel along, so that neither waits for ever.

#[cfg(test)]
mod tests;

use shm_schema::agreement::PathTest;
use shm_schema::inhibit::Readback;
use shm_schema::report::Phase;

/// Cycles the own path may stay raised in the self-test: crosscheck gives up after 20.
const RAISED_MAX: u32 = 24;

/// What a step tells the start-up.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// Image sound and encoder plausible.
    pub is_sound: bool,
    /// Agreement fresh, own report echoed, nothing differs from the partner.
    pub is_equal: bool,
    /// What the accepted agreement asks of the paths.
    pub path_test: PathTest,
    /// Both paths as read back; `None` without readback.
    pub readback: Option<Readback>,
    /// Phase of the partner's report; `None` when it is lost.
    pub partner: Option<Phase>,
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
    /// Since when the partner has not followed into [`Phase::Operational`].
    alone_since: Option<u64>,
    test: PathsSeen,
    raised: u32,
    /// The path was driven under torque: from here on nothing begins anew by itself.
    has_driven: bool,
}

/// What this channel itself has seen of the path self-test.
#[derive(Debug, Clone, Copy, Default)]
struct PathsSeen {
    /// Edges of A and B counted by the evaluator when B's last grew.
    from: Option<(u64, u64)>,
    has_raised: bool,
    on: bool,
    off: bool,
}

impl PathsSeen {
    /// The evaluator's counts tell of a step this channel slept through: edges of A without
    /// one on the own path are a partner raised alone, edges of B a raise that arrived.
    fn look(&mut self, readback: &Readback) {
        let (from_a, from_b) = *self.from.get_or_insert((readback.edges_a, readback.edges_b));
        let grew = readback.edges_b != from_b;
        if grew {
            self.from = Some((readback.edges_a, readback.edges_b));
        }
        let is_alone = readback.path_a | (readback.edges_a != from_a);
        self.off |= is_alone & !readback.path_b & !grew;
        self.on |= self.has_raised & (readback.path_b | grew);
    }
}

impl Startup {
    /// In `phase`.
    pub const fn new(phase: Phase) -> Self {
        let test = PathsSeen { from: None, has_raised: false, on: false, off: false };
        // A settled start (design 10) stands as if under torque for ever.
        let has_driven = matches!(phase, Phase::Operational);
        Self { phase, equal_since: None, alone_since: None, test, raised: 0, has_driven }
    }

    /// How far it is.
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// Before the first torque.
    pub const fn is_starting(&self) -> bool {
        !self.has_driven
    }

    /// The path is driven under torque.
    pub const fn note_driven(&mut self) {
        self.has_driven = true;
    }

    /// The own path is to be raised for its test in this cycle.
    pub fn raises(&mut self, path_test: PathTest) -> bool {
        let is_asked = path_test == PathTest::RaiseB;
        let raises = (self.phase == Phase::SelfTest) & is_asked & (self.raised < RAISED_MAX);
        self.test.has_raised |= raises;
        raises
    }

    /// One step.
    pub fn step(&mut self, progress: &Progress, tolerance_ns: u64, now: u64) {
        if self.falls_back(progress) {
            return;
        }
        match self.phase {
            Phase::Boot if progress.is_sound => self.phase = Phase::Pairing,
            Phase::Pairing => self.pair(progress, tolerance_ns, now),
            Phase::SelfTest => self.test(progress),
            Phase::AwaitAcknowledge => self.await_edge(progress),
            Phase::Operational if !self.has_driven => self.await_partner(progress, tolerance_ns, now),
            _ => {}
        }
    }

    /// A partner that begins anew before the first torque: crosscheck repeats the test after
    /// a report in Boot, so this channel has to see it anew too.
    fn falls_back(&mut self, progress: &Progress) -> bool {
        let is_waiting = matches!(self.phase, Phase::AwaitAcknowledge | Phase::Operational);
        let may = !self.has_driven & (is_waiting | (self.phase == Phase::SelfTest));
        match progress.partner {
            Some(Phase::Boot) if may => self.begin_anew(),
            Some(Phase::Pairing) if may & is_waiting => self.fall_to(Phase::Pairing),
            _ => return false,
        }
        true
    }

    fn begin_anew(&mut self) {
        *self = Self::new(Phase::Boot);
    }

    const fn fall_to(&mut self, phase: Phase) {
        self.phase = phase;
        self.equal_since = None;
        self.alone_since = None;
    }

    fn pair(&mut self, progress: &Progress, tolerance_ns: u64, now: u64) {
        if let Some(readback) = &progress.readback {
            self.test.look(readback);
        }
        let is_disturbed = !progress.is_equal | !progress.is_sound;
        if is_disturbed {
            self.equal_since = None;
            return;
        }
        let since = *self.equal_since.get_or_insert(now);
        if now.saturating_sub(since) >= tolerance_ns {
            self.phase = Phase::SelfTest;
        }
    }

    /// Passed only when this channel itself has seen its path off while the partner's was
    /// raised, and on while its own was. A test passed without that has to be repeated.
    fn test(&mut self, progress: &Progress) {
        let raises = progress.path_test == PathTest::RaiseB;
        self.raised = if raises { self.raised.saturating_add(1) } else { 0 };
        if let Some(readback) = &progress.readback {
            self.test.look(readback);
        }
        let passed = progress.path_test == PathTest::Passed;
        let has_seen = self.test.on & self.test.off;
        if passed & has_seen {
            self.phase = Phase::AwaitAcknowledge;
        } else if passed {
            self.begin_anew();
        }
    }

    /// The edge counts once the partner has come as far: it sees the edge in the same
    /// exchange or the next.
    fn await_edge(&mut self, progress: &Progress) {
        let is_accompanied = progress.partner >= Some(Phase::AwaitAcknowledge);
        if progress.edge & is_accompanied & !progress.is_stopped {
            self.fall_to(Phase::Operational);
        }
    }

    /// Nothing was driven yet, so an edge the partner has not seen is void after one fault
    /// tolerance time: the next one counts for both.
    fn await_partner(&mut self, progress: &Progress, tolerance_ns: u64, now: u64) {
        if progress.partner != Some(Phase::AwaitAcknowledge) {
            self.alone_since = None;
            return;
        }
        let since = *self.alone_since.get_or_insert(now);
        if now.saturating_sub(since) >= tolerance_ns {
            self.fall_to(Phase::AwaitAcknowledge);
        }
    }
}
