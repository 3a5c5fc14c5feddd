//! The own inhibit path: refresh, withheld edge once a second, readback of both paths.

use crate::fresh::Patience;

/// Cycles a driven path has to follow (design 5).
const FOLLOW_ON: u8 = 3;
/// Cycles a path that is no longer driven has to follow: dead-man and readback.
const FOLLOW_OFF: u8 = 6;
/// Time without a seen test from which on a fault may be dormant (AMK-PATH-03), ns.
const DORMANT_NS: u64 = 3_600_000_000_000;
/// Cycles in which the readback has to show the withheld edge.
const PAUSE_CYCLES: u8 = 6;

/// What the readback of one path contradicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PathFault {
    /// Driven, but reads off.
    StuckOff,
    /// Not driven, but reads on.
    StuckOn,
}

/// Supervision of one path: how long driving and readback have contradicted each other.
#[derive(Debug, Clone, Copy)]
pub struct Follow {
    driven: bool,
    cycles: u16,
    on_cycles: u16,
    off_cycles: u16,
}

impl Follow {
    /// A path that is not driven yet.
    pub fn new(patience: Patience) -> Self {
        let (on_cycles, off_cycles) = (patience.cycles(FOLLOW_ON), patience.cycles(FOLLOW_OFF));
        Self { driven: false, cycles: 0, on_cycles, off_cycles }
    }

    /// One cycle: whether the path was driven, and what it reads.
    pub fn step(&mut self, driven: bool, reads: Option<bool>) -> Option<PathFault> {
        let contradicts = reads.is_some_and(|reads| reads != driven);
        let goes_on = contradicts & (driven == self.driven);
        self.driven = driven;
        self.cycles = if goes_on { self.cycles.saturating_add(1) } else { u16::from(contradicts) };
        match driven {
            true if self.cycles > self.on_cycles => Some(PathFault::StuckOff),
            false if self.cycles > self.off_cycles => Some(PathFault::StuckOn),
            _ => None,
        }
    }
}

/// The dynamic test of one path: each withheld edge has to show as a pause (AMK-PATH-01).
#[derive(Debug, Clone, Copy)]
pub struct Pause {
    seen_edges: u64,
    /// Cycles since an edge was withheld; 0: none is waited for.
    waiting: u16,
    missed: u16,
    longest: u16,
    missed_most: u16,
}

impl Pause {
    /// No edge withheld yet. The relaxed timing forgives as many tests as its factor says less
    /// one: a late evaluator may jump over the pause.
    pub fn new(patience: Patience) -> Self {
        let (longest, missed_most) = (patience.cycles(PAUSE_CYCLES), patience.cycles(1));
        Self { seen_edges: 0, waiting: 0, missed: 0, longest, missed_most }
    }

    /// The edge of this cycle was withheld.
    pub fn begin(&mut self) {
        self.waiting = 1;
    }

    /// One cycle: whether the path is driven, and what a new readback shows of it (reads on,
    /// edges). `None`: nothing to say; else whether the test was passed.
    pub fn step(&mut self, driven: bool, readback: Option<(bool, u64)>) -> Option<bool> {
        let before = self.seen_edges;
        let (on, edges) = readback.unwrap_or((true, before.wrapping_add(1)));
        self.seen_edges = if readback.is_some() { edges } else { before };
        if self.waiting == 0 {
            return None;
        }
        // A path that goes off meanwhile tells nothing; its level is judged elsewhere.
        if !(driven & on) {
            self.waiting = 0;
            return None;
        }
        if edges == before {
            (self.waiting, self.missed) = (0, 0);
            return Some(true);
        }
        self.waiting = self.waiting.saturating_add(1);
        if self.waiting <= self.longest {
            return None;
        }
        self.waiting = 0;
        self.missed = self.missed.saturating_add(1);
        if self.missed < self.missed_most {
            return None;
        }
        self.missed = 0;
        Some(false)
    }
}

/// The own path.
#[derive(Debug, Clone, Copy)]
pub struct Path {
    edges: u64,
    cycles_per_second: u64,
    pause: Pause,
    last_test_ns: Option<u64>,
}

impl Path {
    /// A path that has never been refreshed.
    pub fn new(cycle_ns: u64, patience: Patience) -> Self {
        let cycles = 1_000_000_000_u64.checked_div(cycle_ns).unwrap_or(1).max(1);
        Self { edges: 0, cycles_per_second: cycles, pause: Pause::new(patience), last_test_ns: None }
    }

    /// Edges so far.
    pub const fn edges(&self) -> u64 {
        self.edges
    }

    /// One cycle; `true` when the edge is withheld to test the path.
    pub fn refresh(&mut self, driving: bool, exchange: u64) -> bool {
        if !driving {
            return false;
        }
        let phase = exchange.checked_rem(self.cycles_per_second).unwrap_or(0);
        let test = phase == self.cycles_per_second / 4;
        if test {
            self.pause.begin();
        } else {
            self.edges = self.edges.wrapping_add(1);
        }
        test
    }

    /// Looks for the pause of a withheld edge in a new readback; `true` when it did not come.
    pub fn look_back(&mut self, driven: bool, readback: Option<(bool, u64)>, now_ns: u64) -> bool {
        let passed = self.pause.step(driven, readback);
        if passed == Some(true) {
            self.last_test_ns = Some(now_ns);
        }
        passed == Some(false)
    }

    /// No test has been seen for an hour (AMK-PATH-03).
    pub fn dormant(&mut self, now_ns: u64) -> bool {
        let last = *self.last_test_ns.get_or_insert(now_ns);
        now_ns.saturating_sub(last) > DORMANT_NS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_edge_in_a_second_is_withheld_and_its_pause_is_the_test() {
        // AMK-PATH-01
        let mut path = Path::new(1_000_000, Patience::new(1));
        let mut withheld = 0;
        for exchange in 0..2_000_u64 {
            withheld += u32::from(path.refresh(true, exchange));
            assert!(!path.look_back(true, Some((true, path.edges())), exchange * 1_000_000));
        }
        assert_eq!(withheld, 2);
        assert_eq!(path.last_test_ns, Some(1_250_000_000));
    }

    #[test]
    fn a_pause_that_does_not_come_means_a_path_that_is_stuck() {
        // AMK-PATH-01, design 8: one test period
        let stuck = |age_factor: u8, off_at: u64| {
            let mut path = Path::new(1_000_000, Patience::new(age_factor));
            (1..20_000_u64).find(|exchange| {
                path.refresh(true, *exchange);
                path.look_back(true, Some((*exchange != off_at, *exchange)), exchange * 1_000_000)
            })
        };
        assert_eq!(stuck(1, 0), Some(255));
        assert_eq!(stuck(10, 0), Some(9_309));
        assert_eq!(stuck(1, 252), Some(1_255), "the path went off meanwhile");
    }

    #[test]
    fn an_hour_without_a_test_is_dormant() {
        // AMK-PATH-03
        let mut path = Path::new(1_000_000, Patience::new(1));
        assert!(!path.dormant(5));
        assert!(!path.dormant(DORMANT_NS + 5));
        assert!(path.dormant(DORMANT_NS + 6));
    }

    #[test]
    fn a_path_that_does_not_follow_is_found() {
        let mut follow = Follow::new(Patience::new(1));
        assert!((0..3).all(|_| follow.step(true, Some(false)).is_none()));
        assert_eq!(follow.step(true, Some(false)), Some(PathFault::StuckOff));
        let mut follow = Follow::new(Patience::new(1));
        assert!((0..6).all(|_| follow.step(false, Some(true)).is_none()));
        assert_eq!(follow.step(false, Some(true)), Some(PathFault::StuckOn));
        let mut relaxed = Follow::new(Patience::new(10));
        assert!((0..30).all(|_| relaxed.step(true, Some(false)).is_none()));
        assert_eq!(relaxed.step(true, Some(false)), Some(PathFault::StuckOff));
    }
}
