//! Both inhibit backends from start to STO, the lines watched from outside.
//!
//! A static level is no evidence (after the death of its holder gpio-sim puts a line back to its
//! pull, many real drivers do not): the pulse train is.

use std::thread;
use std::time::Duration;

use nix::sys::signal::Signal;
use producers::clock::now_ns;

use crate::chip::{AIS, Chip, PAIR_1, PATH_A, PATH_B};
use crate::machine::{CYCLE_NS, LOOK_NS, Seen};
use crate::set::{Role, Set};
use crate::verdict::Verdict;

const NAMES: [&str; 2] = ["A", "B"];
/// Three periods, and what the probe adds.
const BOUND_NS: u64 = 3 * CYCLE_NS + LOOK_NS;
/// Filter of the input (2 ms), settling and sampling of the terminals.
const INPUT_NS: u64 = 3 * CYCLE_NS;
const LONG: Duration = Duration::from_millis(300);

/// Start, self-test, torque, request; then every way a holder of a line can end.
pub fn run(chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    alive(chip, verdict)?;
    for signal in [Signal::SIGTERM, Signal::SIGKILL, Signal::SIGSTOP] {
        for role in [Role::A, Role::B] {
            ends(chip, verdict, role, signal)?;
        }
    }
    ends(chip, verdict, Role::Crosscheck, Signal::SIGKILL)
}

fn counts(seen: &Seen) -> [usize; 2] {
    seen.edges.each_ref().map(Vec::len)
}

/// Edges after `from_ns`.
fn behind(seen: &Seen, from_ns: u64) -> [usize; 2] {
    seen.edges.each_ref().map(|edges| edges.iter().filter(|at| **at > from_ns).count())
}

fn last(seen: &Seen) -> [u64; 2] {
    seen.edges.each_ref().map(|edges| edges.last().copied().unwrap_or(0))
}

fn alive(chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    let set = Set::start(chip)?;
    verdict.check(set.awaits_acknowledge(), format!("start: {}", set.state()));
    let tested = set.seen(|seen| counts(seen)).unwrap_or_default();
    verdict.check(
        tested.iter().all(|edges| *edges > 0),
        format!("the self-test raised each path once, edges {tested:?}"),
    );
    thread::sleep(LONG);
    let waiting = set.seen(|seen| counts(seen)).unwrap_or_default();
    verdict.check(waiting == tested, "no pulses before the acknowledge");
    set.energise()?;
    let from_ns = now_ns();
    thread::sleep(Duration::from_millis(2_100));
    let to_ns = now_ns();
    set.seen(|seen| pulses(seen, verdict, from_ns, to_ns));

    // A request on the terminal: STO in both channels (LNZ SSE), lines still and low.
    let asked_ns = now_ns();
    for line in PAIR_1 {
        chip.pull(line, false)?;
    }
    thread::sleep(LONG);
    let ended = set.seen(|seen| last(seen)).unwrap_or_default();
    for (name, end_ns) in NAMES.iter().zip(ended) {
        let after = end_ns.saturating_sub(asked_ns);
        let held = after < INPUT_NS + BOUND_NS;
        verdict.check(held, format!("emergency stop: path {name} still after {} µs", after / 1_000));
    }
    let low = [PATH_A, PATH_B].map(|line| chip.probe(line).map(|probe| !probe.high()));
    verdict.check(low == [Ok(true), Ok(true)], "both lines low");
    for line in PAIR_1 {
        chip.pull(line, true)?;
    }
    thread::sleep(LONG);
    let still = set.seen(|seen| last(seen)) == Some(ended);
    verdict.check(still, "the terminal closed again: no torque without an acknowledge");
    set.acknowledge(AIS)?;
    let again = set.until(Duration::from_secs(1), |seen| seen.torque);
    verdict.check(again, format!("restart acknowledged: torque; {}", set.state()));
    let unasked = set.seen(|seen| seen.unasked).unwrap_or([9; 2]);
    verdict.check(unasked == [0; 2], format!("pulses without a driving channel: {unasked:?}"));
    Ok(())
}

/// One edge a cycle, but for the one withheld each second (docs/architecture.md, Paths).
fn pulses(seen: &mut Seen, verdict: &mut Verdict, from_ns: u64, to_ns: u64) {
    let cycles = ((to_ns - from_ns) / CYCLE_NS) as usize;
    for (name, edges) in NAMES.iter().zip(&seen.edges) {
        let inside: Vec<u64> = edges.iter().copied().filter(|at| (from_ns..to_ns).contains(at)).collect();
        let gaps = inside.windows(2).map(|pair| pair[1] - pair[0]);
        let longest = gaps.clone().max().unwrap_or(u64::MAX);
        let withheld = gaps.filter(|gap| *gap > CYCLE_NS + 2 * LOOK_NS).count();
        let missing = cycles.saturating_sub(inside.len());
        let regular = (missing <= withheld + 2) & (longest <= 2 * CYCLE_NS + 2 * LOOK_NS);
        verdict.check(
            regular & (1..=3).contains(&withheld),
            format!(
                "torque: path {name} {} edges in {cycles} cycles, {withheld} withheld, longest gap {} µs",
                inside.len(),
                longest / 1_000
            ),
        );
    }
}

/// Both lines are still within three periods, and stay so.
fn ends(chip: &Chip, verdict: &mut Verdict, role: Role, signal: Signal) -> Result<(), String> {
    let set = Set::start(chip)?;
    set.energise()?;
    let sent_ns = set.send(role, signal);
    thread::sleep(LONG / 3);
    let end = set.seen(|seen| End::of(seen, sent_ns)).unwrap_or_default();
    let levels = [PATH_A, PATH_B].map(|line| chip.probe(line).is_ok_and(|probe| probe.high()));
    verdict.check(
        end.holds(),
        format!(
            "{signal} to {role:?}: last pulses after {:?} µs (bound {}), edges behind it {:?}, evaluator on {:?}, levels {levels:?}",
            end.pulses_us,
            BOUND_NS / 1_000,
            end.late,
            end.on,
        ),
    );
    if signal == Signal::SIGSTOP {
        set.send(role, Signal::SIGCONT);
        thread::sleep(LONG / 3);
        let end = set.seen(|seen| End::of(seen, sent_ns)).unwrap_or_default();
        verdict.check(
            end.holds(),
            format!("{role:?} goes on: edges behind the bound {:?}, evaluator on {:?}", end.late, end.on),
        );
    }
    Ok(())
}

/// How both paths ended.
struct End {
    /// From the signal to the newest rising edge of each path, µs.
    pulses_us: [u64; 2],
    /// Edges behind the bound.
    late: [usize; 2],
    /// What the evaluator makes of it.
    on: [bool; 2],
}

impl Default for End {
    /// Nothing seen is nothing ended.
    fn default() -> Self {
        Self { pulses_us: [u64::MAX; 2], late: [usize::MAX; 2], on: [true; 2] }
    }
}

impl End {
    fn of(seen: &mut Seen, sent_ns: u64) -> Self {
        let pulses_us = seen.risen_ns.map(|at_ns| at_ns.saturating_sub(sent_ns) / 1_000);
        Self { pulses_us, late: behind(seen, sent_ns + BOUND_NS), on: seen.on }
    }

    /// A line that stood high falls once more, when the kernel takes it from its dead holder or
    /// the holder goes on.
    fn holds(&self) -> bool {
        let ended = self.pulses_us.iter().all(|after| *after <= BOUND_NS / 1_000);
        let still = self.late.iter().all(|edges| *edges <= 1);
        ended & still & (self.on == [false; 2])
    }
}
