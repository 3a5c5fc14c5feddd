//! Kills at random instants of the start (design 5: creation is not crash-safe).

use std::thread;
use std::time::Duration;

use nix::sys::signal::Signal;
use system_tests::compare::random::Random;

use crate::host::judged;
use crate::processes;
use crate::set::{Folder, Role, alone};

/// The part of a start in which processes are killed, µs.
const START_US: i64 = 300_000;

fn rounds(count: u32, seed: u64) {
    let _turn = alone();
    let mut random = Random::new(seed);
    let folder = Folder::new("startup");
    for _ in 0..count {
        let instant = Duration::from_micros(random.between(0, START_US) as u64);
        let role = random.pick(&Role::ALL);
        judged(&format!("{role:?} killed after {instant:?}"), || killed(&folder, role, instant));
        judged("the next start", || folder.energised(0).stop());
    }
}

/// One start, cut short.
fn killed(folder: &Folder, role: Role, instant: Duration) {
    let mut supervisor = folder.launch();
    // The instant itself is what is tried; nothing is waited for here.
    thread::sleep(instant);
    let victim =
        role.program().map_or(Some(supervisor.id()), |program| processes::running(&folder.run(), program));
    // Who has not been started yet cannot be killed: then it is the supervisor.
    processes::send(victim.unwrap_or(supervisor.id()), Signal::SIGKILL);
    let status = supervisor.end();
    assert!(!status.success(), "{role:?} killed after {instant:?}, yet {status}");
    folder.until_deserted();
    drop(supervisor);
}

#[test]
fn after_a_kill_at_any_instant_of_the_start_the_next_start_works() {
    rounds(10, 11);
}

#[test]
#[ignore = "long form: 200 starts"]
fn after_two_hundred_kills_the_next_start_works() {
    rounds(200, 12);
}
