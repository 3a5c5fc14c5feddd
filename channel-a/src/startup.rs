//! From power-up to the first torque (DEC-19).

use shm_schema::agreement::PathTest;
use shm_schema::report::Phase;

/// What one step knows of the conditions.
#[derive(Debug, Clone, Copy)]
pub struct Conditions {
    /// The encoder is plausible.
    pub sound: bool,
    /// Partner and agreement are there, and nothing contradicts them.
    pub agrees: bool,
    /// No item of both reports differs in this exchange.
    pub equal: bool,
    /// The path self-test, as crosscheck leads it.
    pub path_test: PathTest,
    /// An acknowledge edge while no stop is requested and no error stands.
    pub released: bool,
}

/// The start of one axis.
///
/// Only what both channels can see again holds a phase: crosscheck's own error does not (it
/// takes the torque by itself, and its self-test cannot begin without this channel), and a
/// partner that is further on, or that has to begin again, does not either.
#[derive(Debug, Clone, Copy, Default)]
pub struct Startup {
    equal_since_ns: Option<u64>,
    torque_given: bool,
}

impl Startup {
    /// The phase after `phase`; `tolerance_ns` is the fault tolerance time.
    pub fn next(&mut self, phase: Phase, is: &Conditions, now_ns: u64, tolerance_ns: u64) -> Phase {
        let whole = is.sound & is.agrees;
        let equal = whole & is.equal;
        self.equal_since_ns = self.equal_since_ns.or(Some(now_ns)).filter(|_| equal);
        let lasted =
            self.equal_since_ns.is_some_and(|since_ns| now_ns.saturating_sub(since_ns) >= tolerance_ns);
        match phase {
            Phase::Boot if is.sound => Phase::Pairing,
            Phase::Pairing if lasted => Phase::SelfTest,
            // What both channels had agreed on has to be agreed on anew.
            Phase::SelfTest | Phase::AwaitAcknowledge if !whole => Phase::Pairing,
            Phase::SelfTest if is.path_test == PathTest::Passed => Phase::AwaitAcknowledge,
            Phase::AwaitAcknowledge if is.released => Phase::Operational,
            phase => phase,
        }
    }

    /// What the step decided: driven, and with the start behind it.
    pub fn note(&mut self, phase: Phase, driving: bool) {
        let torque = driving & (phase == Phase::Operational);
        self.torque_given |= torque;
    }

    /// Cycle overruns are judged from the first torque on: before it a late step can prolong
    /// nothing, and a host that still loads its pages is no hazard.
    pub const fn judges_overruns(&self) -> bool {
        self.torque_given
    }
}
