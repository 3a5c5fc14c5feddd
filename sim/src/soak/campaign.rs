//! The fault-injection campaign: every fault at random instants of a moving axis, how soon
//! torque is off, who saw it, and whether it stays off.

use params::AxisSet;

use super::{Act, Life};
use crate::control::Instruction;
use crate::random::Random;
use crate::trace::{Fault, Faults};

/// Cycles until the axis moves, before a fault may come.
const WARM_UP: u64 = 1_200;
/// Cycles over which the instant is drawn: longer than a period of the path's dynamic test.
const SPREAD: i64 = 2_000;
/// Cycles for which torque has to stay off when the fault is gone and nobody acknowledges.
const AFTERWARDS: u64 = 300;
/// Set point, rpm: below every default limit.
const SPEED_RPM: f64 = 600.0;

/// A fault of the campaign and what is required of it.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// The fault.
    pub fault: Fault,
    /// Row of the design's fault table, in short.
    pub row: &'static str,
    /// Cycles from the first faulty one to both paths off, at most; the first counts.
    pub bound: u64,
    /// The signals have to be raw, so that the encoder evaluation takes part.
    raw: bool,
}

const fn case(fault: Fault, row: &'static str, bound: u64) -> Case {
    let raw = matches!(fault, Fault::FreezeEncoder1 | Fault::FreezeEncoder2);
    Case { fault, row, bound, raw }
}

/// Every fault (design 8); a stuck path is found by its test, once a second.
pub const CASES: [Case; 10] = [
    case(Fault::FreezeA, "channel A stands still", 3),
    case(Fault::FreezeB, "channel B stands still", 3),
    case(Fault::FreezeCrosscheck, "crosscheck stands still", 3),
    case(Fault::StaleEncoder, "encoder sample is stale", 3),
    case(Fault::FreezeEncoder1, "signals of A stand still in motion", 3),
    case(Fault::FreezeEncoder2, "signals of B stand still in motion", 3),
    case(Fault::CorruptEncoder, "encoder cell is corrupt", 3),
    case(Fault::CorruptReportA, "report of A is corrupt", 3),
    case(Fault::StuckPathA, "path A is stuck on", 1_010),
    case(Fault::StuckPathB, "path B is stuck on", 1_010),
];

/// What became of one case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Result {
    /// Name of the fault.
    pub fault: &'static str,
    /// Row of the design's fault table.
    pub row: &'static str,
    /// Rounds in which torque was on when the fault came.
    pub injected: u64,
    /// Rounds without torque to take away: nothing is shown by them.
    pub idle: u64,
    /// Cycles to torque off: median and worst; `None`: not within the bound.
    pub median: Option<u64>,
    /// The worst round; `None`: at least one was not off within the bound.
    pub worst: Option<u64>,
    /// The bound.
    pub bound: u64,
    /// Rounds in which A, B, crosscheck named an error.
    pub named_by: [u64; 3],
    /// Rounds in which torque came back without an acknowledge.
    pub returned: u64,
}

impl Result {
    /// Injected, in time each time, and never back by itself.
    pub const fn passed(&self) -> bool {
        let shown = self.injected > 0;
        shown & self.worst.is_some() & (self.returned == 0)
    }
}

/// One round.
struct Round {
    off_after: Option<u64>,
    named_by: [bool; 3],
    returned: bool,
}

/// Plays `rounds` rounds of `case`.
pub fn play(set: &AxisSet, case: &Case, rounds: u64, seed: u64) -> Result {
    let mut random = Random::new(seed);
    let played: Vec<_> = (0..rounds).map(|_| round(set, case, &mut random)).collect();
    let shown: Vec<&Round> = played.iter().flatten().collect();
    let mut times: Vec<u64> = shown.iter().filter_map(|round| round.off_after).collect();
    times.sort_unstable();
    let all = times.len() == shown.len();
    let named = |at: usize| shown.iter().filter(|round| round.named_by[at]).count() as u64;
    Result {
        fault: case.fault.name(),
        row: case.row,
        injected: shown.len() as u64,
        idle: rounds - shown.len() as u64,
        median: times.get(times.len() / 2).copied(),
        worst: times.last().copied().filter(|_| all),
        bound: case.bound,
        named_by: [named(0), named(1), named(2)],
        returned: shown.iter().filter(|round| round.returned).count() as u64,
    }
}

/// `None`: there was no torque to take away.
fn round(set: &AxisSet, case: &Case, random: &mut Random) -> Option<Round> {
    let mut life = Life::with_signals(set, random.between(0, i64::from(u32::MAX)) as u64, case.raw);
    let go = Instruction { set_point_rpm: Some(SPEED_RPM), ..Instruction::default() };
    life.act(&Act::Tell(go), 0);
    let start = WARM_UP + random.between(0, SPREAD) as u64;
    let torque_before = (0..start).fold(false, |_, cycle| life.step(cycle).views[2].torque);
    if !torque_before {
        return None;
    }
    life.act(&Act::Inject(Faults::NONE.with(case.fault)), start);
    let mut round = Round { off_after: None, named_by: [false; 3], returned: false };
    let end = start + case.bound;
    for cycle in start..end {
        let moment = life.step(cycle);
        let [a, b, _] = moment.views;
        let off = !(a.path & b.path);
        note(&mut round, moment.views);
        if off & round.off_after.is_none() {
            round.off_after = Some(cycle - start + 1);
        }
    }
    life.act(&Act::Inject(Faults::NONE), end);
    for cycle in end..end + AFTERWARDS {
        let moment = life.step(cycle);
        note(&mut round, moment.views);
        let [a, b, _] = moment.views;
        round.returned |= a.path & b.path;
    }
    Some(round)
}

fn note(round: &mut Round, views: &[crate::machine::View; 3]) {
    for (named, view) in round.named_by.iter_mut().zip(views) {
        *named |= !view.errors.as_slice().is_empty();
    }
}
