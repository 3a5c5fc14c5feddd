//! The own inhibit path: edges, test pulses, and what the readback of both paths must say.

use shm_schema::inhibit::{Inhibit, Readback};

/// Cycles until a driven path must read on (design 5).
const ON_CYCLES: u32 = 3;
/// Cycles until a path that is no longer driven must read off: three missing edges, three
/// cycles of readback.
const OFF_CYCLES: u32 = 6;
/// Without a seen pause of the edges for so long the path is not known to switch off.
const DORMANT_NS: u64 = 3_600_000_000_000;
/// Cycles after a withheld edge in which its pause must show.
const PAUSE_CYCLES: u32 = 4;

/// Cycles after a withheld edge in which its pause must have been read back.
const TEST_CYCLES: u32 = 6;

/// The dynamic test of one path: each withheld edge must show as a pause.
#[derive(Debug, Clone, Copy, Default)]
struct Tested {
    /// Cycles since an edge was withheld whose pause has not shown.
    age: Option<u32>,
    /// Tests in a row without a pause.
    missed: u32,
    edges: Option<u64>,
}

impl Tested {
    /// One cycle; whether the path is stuck. In the relaxed timing the evaluator may miss a
    /// withheld edge by jitter: as many tests in a row count as the factor says.
    fn judge(&mut self, reads_on: bool, edges: u64, is_pulse: bool, factor: u32) -> bool {
        let is_paused = self.edges == Some(edges);
        self.edges = Some(edges);
        let is_idle = self.age.is_none() & !is_pulse;
        if is_idle {
            // No edge was withheld: a pause only tells that the path can.
            self.missed = if is_paused { 0 } else { self.missed };
            return self.missed >= factor;
        }
        self.age = if is_pulse { Some(0) } else { self.age.map(|age| age.saturating_add(1)) };
        if is_paused | !reads_on {
            // Seen, or off meanwhile: nothing to be tested.
            self.missed = if is_paused { 0 } else { self.missed };
            self.age = None;
        }
        if self.age.is_some_and(|age| age > TEST_CYCLES.saturating_mul(factor)) {
            self.age = None;
            self.missed = self.missed.saturating_add(1);
        }
        self.missed >= factor
    }

    fn forget(&mut self) {
        self.age = None;
        self.edges = None;
    }
}

/// One path as the readback shows it.
#[derive(Debug, Clone, Copy, Default)]
struct Watched {
    is_driven: bool,
    /// Cycles in a row in which it was driven and read off, or not driven and read on.
    wrong: u32,
}

impl Watched {
    /// One cycle; `drives_now` is what its owner says in this cycle, which the readback may
    /// already show or not yet.
    fn judge(&mut self, reads_on: bool, drives_now: bool, factor: u32) -> bool {
        let is_steady = self.is_driven == drives_now;
        let is_wrong = is_steady & (reads_on != self.is_driven);
        self.wrong = if is_wrong { self.wrong.saturating_add(1) } else { 0 };
        let patience = if self.is_driven { ON_CYCLES } else { OFF_CYCLES };
        self.wrong > patience.saturating_mul(factor)
    }
}

/// What the readback says about the paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PathFaults {
    /// The own path does not follow.
    pub own: bool,
    /// The partner's path does not follow its report.
    pub partner: bool,
    /// A path is driven and nothing is read back.
    pub blind: bool,
    /// The own path has not been seen to pause for an hour.
    pub dormant: bool,
}

/// The own path and the supervision of both.
#[derive(Debug, Clone, Copy)]
pub struct Path {
    edges: u64,
    own: Watched,
    partner: Watched,
    own_test: Tested,
    partner_test: Tested,
    read_edges: Option<u64>,
    since_pulse: u32,
    tested_at: Option<u64>,
    /// Of the timing: how much longer than strict every wait is.
    factor: u32,
}

impl Path {
    /// Not driven; `factor` on every wait (architecture, "Timing").
    pub const fn new(factor: u8) -> Self {
        let idle = Watched { is_driven: false, wrong: 0 };
        Self {
            edges: 0,
            own: idle,
            partner: idle,
            own_test: Tested { age: None, missed: 0, edges: None },
            partner_test: Tested { age: None, missed: 0, edges: None },
            read_edges: None,
            since_pulse: u32::MAX,
            tested_at: None,
            factor: factor as u32,
        }
    }

    /// Whether B withholds its edge in this exchange: three quarters into each second, half
    /// a second away from A (DEC-19).
    pub fn is_test_cycle(exchange: u64, cycles_per_second: u64) -> bool {
        let place = cycles_per_second.saturating_mul(3) >> 2;
        exchange.checked_rem(cycles_per_second) == Some(place)
    }

    /// Judges the readback of this cycle against what was driven in the cycles before.
    /// `partner`: what its report says, that it drives, and that it withholds an edge.
    pub fn judge(&mut self, readback: Option<&Readback>, partner: (bool, bool), now: u64) -> PathFaults {
        let (partner_drives, partner_tests) = partner;
        if let Some(seen) = readback.filter(|seen| self.is_usual(seen, partner, now)) {
            self.read_edges = Some(seen.edges_b);
            (self.own_test.edges, self.partner_test.edges) = (Some(seen.edges_b), Some(seen.edges_a));
            (self.own.wrong, self.partner.wrong) = (0, 0);
            return PathFaults::default();
        }
        let tested_at = *self.tested_at.get_or_insert(now);
        let Some(seen) = readback else {
            self.read_edges = None;
            self.own_test.forget();
            self.partner_test.forget();
            let is_driven = self.own.is_driven;
            let blind = self.own.judge(!is_driven, is_driven, self.factor);
            return PathFaults { blind, ..PathFaults::default() };
        };
        let paused = self.read_edges == Some(seen.edges_b);
        self.read_edges = Some(seen.edges_b);
        let is_tested = paused & seen.path_b & (self.since_pulse < PAUSE_CYCLES.saturating_mul(self.factor));
        if is_tested {
            self.tested_at = Some(now);
        }
        let own_tests = self.since_pulse == 0;
        let own_stuck = self.own_test.judge(seen.path_b, seen.edges_b, own_tests, self.factor);
        let partner_stuck =
            self.partner_test.judge(seen.path_a, seen.edges_a, partner_tests & partner_drives, self.factor);
        PathFaults {
            own: self.own.judge(seen.path_b, self.own.is_driven, self.factor) | own_stuck,
            partner: self.partner.judge(seen.path_a, partner_drives, self.factor) | partner_stuck,
            blind: false,
            dormant: !is_tested & (now.saturating_sub(tested_at) > DORMANT_NS),
        }
    }

    /// Both paths read as they are driven, their edges go on, and no test is under way.
    fn is_usual(&self, seen: &Readback, (partner_drives, partner_tests): (bool, bool), now: u64) -> bool {
        let is_driven = self.own.is_driven & self.partner.is_driven & partner_drives;
        let reads_on = seen.path_a & seen.path_b;
        let goes_on = (self.read_edges.is_some_and(|edges| edges != seen.edges_b))
            & (self.partner_test.edges.is_some_and(|edges| edges != seen.edges_a));
        let is_tested = (self.since_pulse == 0)
            | partner_tests
            | self.own_test.age.is_some()
            | self.partner_test.age.is_some()
            | (self.own_test.missed | self.partner_test.missed != 0);
        let is_young = self.tested_at.is_some_and(|tested| now.saturating_sub(tested) <= DORMANT_NS);
        is_driven & reads_on & goes_on & !is_tested & is_young
    }

    /// Drives the path for one cycle, or not; `partner_drives` as its report says.
    pub fn drive(&mut self, permit: bool, is_test_pulse: bool, partner_drives: bool, inhibit: &mut Inhibit) {
        self.own.is_driven = permit;
        self.partner.is_driven = partner_drives;
        let is_pulse = permit & is_test_pulse;
        self.since_pulse = if is_pulse { 0 } else { self.since_pulse.saturating_add(1) };
        let is_edge = permit & !is_test_pulse;
        self.edges = self.edges.wrapping_add(u64::from(is_edge));
        (inhibit.permit, inhibit.edges) = (permit, self.edges);
    }
}

impl Default for Path {
    fn default() -> Self {
        Self::new(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(path_a: bool, path_b: bool) -> Readback {
        Readback { path_a, path_b, edges_a: 0, edges_b: 0 }
    }

    #[test]
    fn a_driven_path_must_read_on_after_three_cycles() {
        let mut path = Path::new(1);
        let wrong: [bool; 5] = core::array::from_fn(|cycle| {
            let faults = path.judge(Some(&read(false, false)), (false, false), cycle as u64);
            path.drive(true, false, false, &mut Inhibit::default());
            faults.own
        });
        assert_eq!(wrong, [false, false, false, false, true]);
    }

    /// Architecture, "Timing": every wait is longer by the factor, none is shorter.
    #[test]
    fn the_relaxed_timing_waits_ten_times_as_long() {
        let mut path = Path::new(10);
        let first = (0..100).find(|cycle| {
            let faults = path.judge(Some(&read(false, false)), (false, false), *cycle);
            path.drive(true, false, false, &mut Inhibit::default());
            faults.own
        });
        assert_eq!(first, Some(31));
    }

    #[test]
    fn a_stuck_path_of_the_partner_is_seen_after_six_cycles() {
        let mut path = Path::new(1);
        let first = (0..20).find(|cycle| {
            let faults = path.judge(Some(&read(true, false)), (false, false), *cycle);
            path.drive(false, false, false, &mut Inhibit::default());
            faults.partner
        });
        assert_eq!(first, Some(6));
    }

    /// AMK-PATH-03: an hour without a test is a warning, a seen pause ends it.
    #[test]
    fn an_hour_without_a_pause_is_dormant_until_one_is_seen() {
        let mut path = Path::new(1);
        path.judge(Some(&read(true, true)), (true, false), 0);
        let late = DORMANT_NS + 1;
        path.read_edges = None;
        assert!(path.judge(Some(&read(true, true)), (true, false), late).dormant);
        path.drive(true, true, true, &mut Inhibit::default());
        assert!(!path.judge(Some(&read(true, true)), (true, false), late).dormant);
        assert!(!path.judge(Some(&read(true, true)), (true, false), late + 1).dormant);
    }

    /// First cycle in which a path under test is said to be stuck; `counts`: the evaluator's edges.
    fn stuck(factor: u8, counts: impl Fn(u64) -> u64) -> Option<u64> {
        let mut path = Path::new(factor);
        (0..20_000).find(|cycle| {
            let is_pulse = cycle % 1_000 == 750;
            let edges = counts(*cycle);
            let seen = Readback { path_a: true, path_b: true, edges_a: 2 * cycle, edges_b: edges };
            let faults = path.judge(Some(&seen), (true, false), *cycle);
            path.drive(true, is_pulse, true, &mut Inhibit::default());
            faults.own
        })
    }

    /// Design 8: stuck on, seen after one test period; healthy is healthy.
    #[test]
    fn a_path_whose_withheld_edge_does_not_show_is_stuck() {
        // A cycle later the count stands for the withheld edge.
        let healthy = |cycle: u64| cycle - (cycle + 248) / 1_000;
        assert_eq!(stuck(1, healthy), None);
        assert_eq!(stuck(1, |cycle| cycle), Some(758));
        // Relaxed: as many tests in a row as the factor.
        assert_eq!(stuck(10, |cycle| cycle), Some(9_000 + 750 + 62));
    }

    /// AMK-PATH: the partner's path, and a path that goes off meanwhile.
    #[test]
    fn the_partners_path_is_judged_by_its_own_pulses_and_not_while_it_is_off() {
        let first = |reads_on: bool| {
            let mut path = Path::new(1);
            (0..3_000).find(|cycle| {
                let path_a = reads_on | (cycle % 1_000 < 752);
                let seen = Readback { path_a, path_b: false, edges_a: *cycle, edges_b: 0 };
                path.judge(Some(&seen), (path_a, cycle % 1_000 == 750), *cycle).partner
            })
        };
        assert_eq!(first(true), Some(757));
        assert_eq!(first(false), None);
    }

    #[test]
    fn a_test_cycle_comes_once_a_second_three_quarters_in() {
        let cycles: u64 = (0..2_000).filter(|k| Path::is_test_cycle(*k, 1_000)).sum();
        assert_eq!(cycles, 750 + 1_750);
        assert!(!Path::is_test_cycle(5, 0));
    }
}
