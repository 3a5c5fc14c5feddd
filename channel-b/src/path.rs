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
    pub fn judge(&mut self, readback: Option<&Readback>, partner_drives: bool, now: u64) -> PathFaults {
        let tested_at = *self.tested_at.get_or_insert(now);
        let Some(seen) = readback else {
            self.read_edges = None;
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
        PathFaults {
            own: self.own.judge(seen.path_b, self.own.is_driven, self.factor),
            partner: self.partner.judge(seen.path_a, partner_drives, self.factor),
            blind: false,
            dormant: !is_tested & (now.saturating_sub(tested_at) > DORMANT_NS),
        }
    }

    /// Drives the path for one cycle, or not; `partner_drives` as its report says.
    pub fn drive(&mut self, permit: bool, is_test_pulse: bool, partner_drives: bool) -> Inhibit {
        self.own.is_driven = permit;
        self.partner.is_driven = partner_drives;
        let is_pulse = permit & is_test_pulse;
        self.since_pulse = if is_pulse { 0 } else { self.since_pulse.saturating_add(1) };
        let is_edge = permit & !is_test_pulse;
        self.edges = self.edges.wrapping_add(u64::from(is_edge));
        Inhibit { permit, edges: self.edges, ..Inhibit::default() }
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
            let faults = path.judge(Some(&read(false, false)), false, cycle as u64);
            path.drive(true, false, false);
            faults.own
        });
        assert_eq!(wrong, [false, false, false, false, true]);
    }

    /// Architecture, "Timing": every wait is longer by the factor, none is shorter.
    #[test]
    fn the_relaxed_timing_waits_ten_times_as_long() {
        let mut path = Path::new(10);
        let first = (0..100).find(|cycle| {
            let faults = path.judge(Some(&read(false, false)), false, *cycle);
            path.drive(true, false, false);
            faults.own
        });
        assert_eq!(first, Some(31));
    }

    #[test]
    fn a_stuck_path_of_the_partner_is_seen_after_six_cycles() {
        let mut path = Path::new(1);
        let first = (0..20).find(|cycle| {
            let faults = path.judge(Some(&read(true, false)), false, *cycle);
            path.drive(false, false, false);
            faults.partner
        });
        assert_eq!(first, Some(6));
    }

    /// AMK-PATH-03: an hour without a test is a warning, a seen pause ends it.
    #[test]
    fn an_hour_without_a_pause_is_dormant_until_one_is_seen() {
        let mut path = Path::new(1);
        path.judge(Some(&read(true, true)), true, 0);
        let late = DORMANT_NS + 1;
        path.read_edges = None;
        assert!(path.judge(Some(&read(true, true)), true, late).dormant);
        path.drive(true, true, true);
        assert!(!path.judge(Some(&read(true, true)), true, late).dormant);
        assert!(!path.judge(Some(&read(true, true)), true, late + 1).dormant);
    }

    #[test]
    fn a_test_cycle_comes_once_a_second_three_quarters_in() {
        let cycles: u64 = (0..2_000).filter(|k| Path::is_test_cycle(*k, 1_000)).sum();
        assert_eq!(cycles, 750 + 1_750);
        assert!(!Path::is_test_cycle(5, 0));
    }
}
