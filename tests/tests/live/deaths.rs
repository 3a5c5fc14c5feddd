//! Processes that are killed or stopped while the axis has torque (design 3.4, 3.7, 8).

use std::collections::BTreeSet;
use std::time::Duration;

use nix::sys::signal::Signal;
use system_tests::compare::random::Random;

use crate::axis::now_ns;
use crate::host::judged;
use crate::processes;
use crate::set::{AGES, CYCLE, Folder, Role, Running, alone};

/// The last edge of either path comes at most so many cycles after the fault: the cycle it
/// falls into and the three of a lost partner, sample or agreement (DEC-23), as the timing has
/// them.
const CYCLES: u32 = 1 + 3 * AGES;
/// Longest silence of a supervisor before the channels take it for dead.
const SIGNS_OF_LIFE: Duration = Duration::from_millis(250);
/// What a host may stall in that time; a stall of the observer counts in as well.
const STALL: Duration = Duration::from_millis(24);
/// Both paths have been quiet for so long when they are off: well beyond the dead-man.
const SILENCE: Duration = Duration::from_millis(160);
/// Torque must not come back in this time.
const AFTERWARDS: Duration = Duration::from_millis(120);
/// Speed of every other round, rpm.
const SPEED: u32 = 300;

/// What one round does.
#[derive(Debug, Clone, Copy)]
struct Fault {
    role: Role,
    signal: Signal,
    rpm: u32,
    after: Duration,
    resume: bool,
}

fn rounds(count: u32, roles: &[Role], signal: Signal, seed: u64) {
    let _turn = alone();
    let mut random = Random::new(seed);
    let mut everything_left = Vec::new();
    for role in roles {
        let folder = Folder::new("death");
        let mut left = BTreeSet::new();
        let mut worst = Duration::ZERO;
        for round in 0..count {
            let fault = Fault {
                role: *role,
                signal,
                rpm: if round % 2 == 0 { 0 } else { SPEED },
                after: Duration::from_micros(random.between(0, 40_000) as u64),
                resume: random.chance(50),
            };
            // The next round is the next start: it finds what this one left.
            let Some(reaction) = judged(&format!("{fault:?}"), || round_of(&folder, fault)) else { continue };
            worst = worst.max(reaction);
            left.extend(folder.remains());
        }
        judged("the next start", || folder.start().stop());
        everything_left.extend(left.into_iter().map(|path| (*role, path)));
        println!("{role:?} {signal}: last edge at most {:.1} ms after it", worst.as_secs_f64() * 1e3);
    }
    // A killed supervisor cannot tidy up: what it left is the next start's, tried above.
    everything_left.retain(|(role, _)| *role != Role::Supervisor);
    assert!(everything_left.is_empty(), "left behind by who was killed: {everything_left:?}");
}

/// One set, one fault; the time from the fault to the last edge of either path.
fn round_of(folder: &Folder, fault: Fault) -> Duration {
    let mut running = folder.energised(fault.rpm);
    // The instant itself is what is tried: nothing is waited for here.
    running.axis.comes(fault.after, |_| false);
    let victim = running.process(fault.role);
    processes::send(victim, fault.signal);
    let since_ns = now_ns();
    running.axis.expect("silence on both paths", |axis| axis.silent(SILENCE));
    let last_ns = running.axis.paths.iter().map(|path| path.refreshed_ns).max().unwrap_or(u64::MAX);
    let reaction = Duration::from_nanos(last_ns.saturating_sub(since_ns));
    let seen = running.axis.in_words();
    // A stopped supervisor is only missed by its signs of life (docs/architecture.md).
    let silence = if fault.role == Role::Supervisor { SIGNS_OF_LIFE } else { Duration::ZERO };
    assert!(
        reaction <= CYCLE * CYCLES + STALL + silence,
        "{fault:?}: an edge {reaction:?} after it:\n{seen}"
    );
    stays_off(&mut running, fault);
    let goes_on = fault.signal == Signal::SIGSTOP;
    if goes_on & (fault.role == Role::Supervisor) {
        // The channels have ended by then; the supervisor finds that out and ends the rest.
        processes::send(victim, Signal::SIGCONT);
        killed(running, folder, fault);
    } else if goes_on {
        stopped(running, folder, victim, fault);
    } else {
        killed(running, folder, fault);
    }
    reaction
}

fn stays_off(running: &mut Running<'_>, fault: Fault) {
    let edges = running.axis.edges();
    let quiet = |axis: &crate::axis::Axis| axis.edges() == edges;
    running.axis.hold(&format!("torque off ({fault:?})"), AFTERWARDS, quiet);
}

/// The end of one ends all, by itself.
fn killed(mut running: Running<'_>, folder: &Folder, fault: Fault) {
    let status = running.supervisor.end();
    assert!(!status.success(), "{fault:?}: the set ended with {status}:\n{}", folder.said());
    folder.until_deserted();
}

/// Whoever goes on brings no torque back, and the set ends in order, gone on or not.
fn stopped(mut running: Running<'_>, folder: &Folder, victim: u32, fault: Fault) {
    if fault.resume {
        processes::send(victim, Signal::SIGCONT);
        stays_off(&mut running, fault);
    }
    assert!(processes::lives(running.supervisor.id()), "{fault:?}:\n{}", folder.said());
    running.stop();
}

const PROCESSES: [Role; 4] = [Role::Sim, Role::ChannelA, Role::ChannelB, Role::Crosscheck];

#[test]
fn whoever_is_killed_takes_the_torque_away_and_ends_the_set() {
    rounds(3, &Role::ALL, Signal::SIGKILL, 1);
}

#[test]
fn whoever_is_stopped_takes_the_torque_away_for_good() {
    rounds(3, &PROCESSES, Signal::SIGSTOP, 2);
}

/// Design 5: death or stop of the supervisor is STO.
#[test]
fn a_stopped_supervisor_takes_the_torque_away_for_good() {
    rounds(3, &[Role::Supervisor], Signal::SIGSTOP, 3);
}

#[test]
#[ignore = "long form: 100 rounds of each process"]
fn a_hundred_of_each_killed() {
    rounds(100, &Role::ALL, Signal::SIGKILL, 4);
}

#[test]
#[ignore = "long form: 100 rounds of each process"]
fn a_hundred_of_each_stopped() {
    rounds(100, &PROCESSES, Signal::SIGSTOP, 5);
}
