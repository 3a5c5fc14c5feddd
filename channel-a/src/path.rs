//! The own inhibit path: refresh, withheld edge once a second, readback of both paths.

use shm_schema::inhibit::Readback;

use crate::fresh::Patience;

/// Cycles a driven path has to follow (design 5).
const FOLLOW_ON: u8 = 3;
/// Cycles a path that is no longer driven has to follow: dead-man and readback.
const FOLLOW_OFF: u8 = 6;
/// Time without a seen test from which on a fault may be dormant (AMK-PATH-03), ns.
const DORMANT_NS: u64 = 3_600_000_000_000;
/// Cycles in which the readback may show the withheld edge.
const PAUSE_CYCLES: u8 = 4;

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

/// The own path.
#[derive(Debug, Clone, Copy, Default)]
pub struct Path {
    edges: u64,
    cycles_per_second: u64,
    watch_pause: u16,
    pause_cycles: u16,
    seen_edges: u64,
    last_test_ns: Option<u64>,
}

impl Path {
    /// A path that has never been refreshed.
    pub fn new(cycle_ns: u64, patience: Patience) -> Self {
        let cycles = 1_000_000_000_u64.checked_div(cycle_ns).unwrap_or(1).max(1);
        Self { cycles_per_second: cycles, pause_cycles: patience.cycles(PAUSE_CYCLES), ..Self::default() }
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
            self.watch_pause = self.pause_cycles;
        } else {
            self.edges = self.edges.wrapping_add(1);
        }
        test
    }

    /// Looks for the pause of a withheld edge in a new readback.
    pub fn look_back(&mut self, readback: Option<&Readback>, now_ns: u64) {
        let Some(readback) = readback else { return };
        let paused = readback.edges_a == self.seen_edges;
        self.seen_edges = readback.edges_a;
        let watching = self.watch_pause > 0;
        self.watch_pause = self.watch_pause.saturating_sub(1);
        if watching & paused {
            self.watch_pause = 0;
            self.last_test_ns = Some(now_ns);
        }
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
            let readback = Readback { edges_a: path.edges(), ..Readback::default() };
            path.look_back(Some(&readback), exchange * 1_000_000);
        }
        assert_eq!(withheld, 2);
        assert_eq!(path.last_test_ns, Some(1_250_000_000));
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
