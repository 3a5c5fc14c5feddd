//! A missed deadline: something above the monitors takes their processor.

use std::thread;
use std::time::Duration;

use producers::clock::{now_ns, prepare, sleep_until};

use crate::chip::{AIE, AIS, Chip};
use crate::machine::{CYCLE_NS, LOOK_NS, Seen};
use crate::set::{PRIORITY, Set};
use crate::verdict::Verdict;

/// The long hold, ns.
const HELD_NS: u64 = 6 * CYCLE_NS;
/// When the lines have fallen for the last time behind the hold, ns.
const BOUND_NS: u64 = 2 * CYCLE_NS + LOOK_NS;
const LONG: Duration = Duration::from_millis(300);

/// A short hold is an overrun that is counted; a long one is torque off, and stays so.
pub fn run(chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    let set = Set::start(chip)?;
    set.energise()?;
    hold(1_200_000);
    thread::sleep(LONG);
    let torque = set.seen(|seen| seen.torque) == Some(true);
    verdict.check(torque, format!("held for 1.2 ms: one cycle late, torque stays; {}", set.state()));

    let end_ns = hold(HELD_NS) + HELD_NS;
    thread::sleep(LONG);
    let found = set.seen(|seen| (seen.risen_ns, behind(seen, end_ns + BOUND_NS)));
    let (risen_ns, late) = found.unwrap_or(([u64::MAX; 2], [9; 2]));
    // Design 3.6: a monitor that comes out of a stall knows all its overruns before it drives.
    let silent = risen_ns.iter().all(|risen_ns| *risen_ns < end_ns);
    verdict.check(
        silent & (late == [0; 2]),
        format!(
            "held for 6 ms: no pulse since: {silent}, edges later than {} µs: {late:?}; {}",
            BOUND_NS / 1_000,
            set.state()
        ),
    );
    let torque = set.seen(|seen| seen.torque) == Some(true);
    verdict.check(!torque, "torque off, and it stays off by itself");
    for terminal in [AIE, AIE, AIS] {
        set.acknowledge(terminal)?;
        thread::sleep(LONG);
    }
    let again = set.until(Duration::from_secs(1), |seen| seen.torque);
    Verdict::note(format!("after acknowledges: torque {again}; {}", set.state()));
    Ok(())
}

fn behind(seen: &Seen, from_ns: u64) -> [usize; 2] {
    seen.edges.each_ref().map(|edges| edges.iter().filter(|at| **at > from_ns).count())
}

/// Spins above the monitors and below the machine; when it began, ns. It begins behind the last
/// process of a cycle, so that the length says how many cycles of all of them are late.
fn hold(length_ns: u64) -> u64 {
    let spin = move || {
        prepare(None, Some(PRIORITY + 1));
        let now = now_ns();
        sleep_until(now - now % CYCLE_NS + 2 * CYCLE_NS + CYCLE_NS / 8 * 7);
        let start_ns = now_ns();
        while now_ns() < start_ns + length_ns {}
        start_ns
    };
    thread::spawn(spin).join().unwrap_or_default()
}
