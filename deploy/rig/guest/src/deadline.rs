//! A missed deadline: something above the monitors takes their processor.

use std::thread;
use std::time::Duration;

use producers::clock::{now_ns, prepare};

use crate::chip::{AIE, AIS, Chip};
use crate::machine::{CYCLE_NS, LOOK_NS, Seen};
use crate::set::{PRIORITY, Set};
use crate::verdict::Verdict;

/// Three periods, and what the probe adds.
const BOUND_NS: u64 = 3 * CYCLE_NS + LOOK_NS;
const LONG: Duration = Duration::from_millis(300);

/// A short hold is an overrun that is counted; a long one is torque off, and stays so.
pub fn run(chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    let set = Set::start(chip)?;
    set.energise()?;
    hold(1_200_000);
    thread::sleep(LONG);
    let torque = set.seen(|seen| seen.torque) == Some(true);
    verdict.check(torque, format!("held for 1.2 ms: one cycle late, torque stays; {}", set.state()));

    let held_ns = hold(6 * CYCLE_NS);
    thread::sleep(LONG);
    let found = set.seen(|seen| (behind(seen, held_ns + BOUND_NS), seen.risen_ns));
    let (late, risen_ns) = found.unwrap_or(([9; 2], [u64::MAX; 2]));
    let last_us = risen_ns.map(|at_ns| at_ns.saturating_sub(held_ns) / 1_000);
    let still = late.iter().all(|edges| *edges <= 1);
    verdict.check(
        still & last_us.iter().all(|after| *after <= BOUND_NS / 1_000),
        format!(
            "held for 6 ms: last pulses after {last_us:?} µs (bound {}), edges behind it {late:?}; {}",
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

/// Spins above the monitors and below the machine; when it began, ns.
fn hold(length_ns: u64) -> u64 {
    let spin = move || {
        prepare(None, Some(PRIORITY + 1));
        let start_ns = now_ns();
        while now_ns() < start_ns + length_ns {}
        start_ns
    };
    thread::spawn(spin).join().unwrap_or_default()
}
