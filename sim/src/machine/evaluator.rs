//! The evaluator of one inhibit path: drive or charge pump behind the pulses (design 3.4).

use shm_schema::inhibit::{Inhibit, MISSING_EDGES};

/// Evaluates the pulses of one path, once a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Evaluator {
    on: bool,
    edges: u64,
    seen: u64,
    missing: u8,
    patience: u8,
}

impl Evaluator {
    /// A path that has been refreshed for ever, or one that is off.
    pub const fn new(on: bool) -> Self {
        Self { on, edges: 0, seen: 0, missing: 0, patience: MISSING_EDGES }
    }

    /// A path that is off, with the dead-man of a timing: `age_factor` times the strict one.
    pub const fn relaxed(age_factor: u8) -> Self {
        Self { patience: MISSING_EDGES.saturating_mul(age_factor), ..Self::new(false) }
    }

    /// Looks at what the channel drives now. Withdrawn permission drops the path at once,
    /// the third cycle without a new edge drops it too (in the strict timing).
    pub fn step(&mut self, driven: &Inhibit) {
        if driven.edges == self.edges {
            self.missing = self.missing.saturating_add(1);
        } else {
            self.edges = driven.edges;
            self.seen += 1;
            self.missing = 0;
            self.on = true;
        }
        let refreshed = self.missing < self.patience;
        self.on &= refreshed & driven.permit;
    }

    /// A line stuck on: the switch conducts whatever the channel drives.
    pub fn stick(&mut self) {
        self.on = true;
        self.seen += 1;
    }

    /// The path permits torque.
    pub const fn on(&self) -> bool {
        self.on
    }

    /// Edges seen.
    pub const fn seen(&self) -> u64 {
        self.seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(evaluator: &mut Evaluator, permit: bool, edges: u64) -> bool {
        evaluator.step(&Inhibit { permit, edges, ..Inhibit::default() });
        evaluator.on()
    }

    #[test]
    fn withdrawn_permission_drops_at_once_and_the_third_missing_edge_too() {
        let mut path = Evaluator::new(true);
        assert!(drive(&mut path, true, 1));
        assert!(drive(&mut path, true, 1));
        assert!(drive(&mut path, true, 1));
        assert!(!drive(&mut path, true, 1), "third cycle without a new edge");
        assert!(drive(&mut path, true, 2), "refreshed again");
        assert!(!drive(&mut path, false, 3), "permission withdrawn");
    }

    #[test]
    fn permission_alone_does_not_raise_a_path() {
        let mut path = Evaluator::new(false);
        assert!(!drive(&mut path, true, 0));
        assert!(!drive(&mut path, false, 1));
        assert!(!drive(&mut path, true, 1), "the edge came before the permission");
        assert!(drive(&mut path, true, 2));
    }

    #[test]
    fn one_withheld_edge_is_seen_and_drops_nothing() {
        let mut path = Evaluator::new(true);
        drive(&mut path, true, 1);
        assert!(drive(&mut path, true, 1));
        assert_eq!(path.seen(), 1);
        assert!(drive(&mut path, true, 2));
        assert_eq!(path.seen(), 2);
    }
}
