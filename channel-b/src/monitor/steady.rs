//! The usual cycle: torque is on, no stop is asked for, nothing stands and nothing has changed. Its
//! answer is the one of the cycle before, at another time and place.
//!
//! What decides that is asked in every cycle: the circumstances are compared, the motion is inside
//! the closed form of the bank, and the kept answer matches its complement. Anything else takes
//! the whole way.

use shm_schema::drive::DriveRequest;
use shm_schema::report::{Phase, Report};
use shm_schema::word::Word;

use super::Monitor;
use super::senses::Cells;

/// Whole cycles under the same circumstances before one is usual: what has an edge has had it.
const CYCLES: u8 = 2;

/// What the decisions of a cycle hang on, besides motion and time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Circumstances {
    word: Word,
    levels: u32,
    others: u32,
    acknowledge: u32,
    are_lines_read: bool,
    is_connected: bool,
    drive_n0: bool,
    drive_enabled: bool,
}

impl Circumstances {
    #[inline]
    fn are(self, cells: &Cells) -> bool {
        let flags = (self.are_lines_read == cells.are_lines_read)
            & (self.is_connected == cells.is_connected)
            & (self.drive_n0 == cells.drive_n0)
            & (self.drive_enabled == cells.drive_enabled);
        let levels = (self.levels ^ cells.levels)
            | (self.others ^ cells.others)
            | (self.acknowledge ^ cells.acknowledge);
        flags & (levels == 0) & (self.word == cells.word)
    }
}

/// The answer of the cycles before.
#[derive(Debug, Clone, Copy)]
pub struct Steady {
    circumstances: Circumstances,
    cycles: u8,
    status: Word,
    mirror: Word,
    drive: DriveRequest,
}

impl Steady {
    /// Nothing answered yet.
    pub fn new() -> Self {
        let circumstances = Circumstances {
            word: Word::ZERO,
            levels: 0,
            others: 0,
            acknowledge: 0,
            are_lines_read: false,
            is_connected: false,
            drive_n0: false,
            drive_enabled: false,
        };
        Self {
            circumstances,
            cycles: 0,
            status: Word::ZERO,
            mirror: inverse(&Word::ZERO),
            drive: DriveRequest::default(),
        }
    }
}

fn inverse(word: &Word) -> Word {
    Word(word.0.map(|part| !part))
}

impl Monitor {
    /// Whether this cycle is a usual one. Counts the whole cycles that were like the one before.
    pub(super) fn is_steady(&mut self, cells: &Cells, now: u64) -> bool {
        let steady = &mut self.steady;
        if !steady.circumstances.are(cells) {
            steady.cycles = 0;
            steady.circumstances = Circumstances {
                word: cells.word,
                levels: cells.levels,
                others: cells.others,
                acknowledge: cells.acknowledge,
                are_lines_read: cells.are_lines_read,
                is_connected: cells.is_connected,
                drive_n0: cells.drive_n0,
                drive_enabled: cells.drive_enabled,
            };
            return false;
        }
        let is_kept = steady.mirror == inverse(&steady.status);
        let is_tried = steady.cycles >= CYCLES;
        let is_calm = self.plan.bank.is_calm(&self.requested, &cells.motion, now);
        is_kept & is_tried & is_calm & self.is_quiet(cells)
    }

    /// Nothing is asked of the stops, nothing stands, and the profile has nothing of its own under way.
    fn is_quiet(&self, cells: &Cells) -> bool {
        let is_running = (self.startup.phase() == Phase::Operational) & !self.startup.is_starting();
        let is_asked = (self.asked != 0) | self.asks_sto | cells.crosscheck_error;
        let is_free = self.ledger.is_empty() & self.plan.stops.is_quiet();
        is_running & is_free & !is_asked & self.plan.logic.rests()
    }

    /// After a whole cycle: its answer, and whether it was a quiet one.
    pub(super) fn keep_answer(&mut self, cells: &Cells, report: &Report) {
        let is_quiet = self.is_quiet(cells);
        let steady = &mut self.steady;
        steady.cycles = if is_quiet { steady.cycles.saturating_add(1) } else { 0 };
        (steady.status, steady.mirror, steady.drive) = (report.status, inverse(&report.status), report.drive);
    }

    /// The decisions of a usual cycle: none.
    pub(super) fn stay(&mut self, cells: &Cells) {
        self.visit(2);
        self.visit(3);
        self.plan.logic.pass(&cells.motion, cells.now, &mut self.ledger);
    }

    /// What the report of a usual cycle says as before.
    pub(super) fn repeat(&self, report: &mut Report) {
        report.status = self.steady.status;
        report.drive = self.steady.drive;
    }
}

#[cfg(test)]
mod tests {
    use shm_schema::facts::amk_kw::control;
    use shm_schema::profile::Profile;

    use crate::monitor::FLOW;
    use crate::testing::{Rig, codes, status};

    const NEUTRAL: u32 = 0x0000_7E7F;
    /// SLS1 limits to 500 rpm from the first cycle on.
    const LIMITED: [(u32, i32); 5] = [(2, 1_000_000), (3, 60_000), (67, 3_000), (57, 500), (56, 1)];

    fn limited() -> Rig {
        let mut rig = Rig::new(Profile::AmkKw, &LIMITED);
        rig.world.word = NEUTRAL & !(1 << control::SLS1);
        for _ in 0..20 {
            rig.step();
        }
        rig
    }

    /// DEC-22, DEC-24: a usual cycle has every station of a whole one, and the violation ends it at once.
    #[test]
    fn usual_cycles_answer_as_whole_ones_until_a_limit_is_violated() {
        let mut rig = limited();
        let before = status(&rig.step());
        for speed in [1_000, 499_000, -500_000, 500_000] {
            rig.world.speed = speed;
            let usual = rig.step();
            assert!(rig.monitors[1].steady.cycles >= super::CYCLES);
            assert_eq!((status(&usual), usual.report.flow), (before, FLOW));
            assert_eq!(i64::from(usual.report.speed_mrpm), speed);
        }
        rig.world.speed = 500_001;
        assert_eq!(codes(&rig.step())[0][..3], [3606, 112, 3]);
    }

    /// Design 3.1: what is kept is checked on use.
    #[test]
    fn a_damaged_answer_is_made_anew() {
        let mut rig = limited();
        let before = status(&rig.step());
        for monitor in &mut rig.monitors {
            monitor.steady.status.0[0] ^= 1 << 5;
        }
        assert_eq!(status(&rig.step()), before);
    }
}
