//! A second start beside a running set (design 5).

use std::time::Duration;

use crate::set::{ATTEMPTS, Folder, alone};

/// How long torque must last beside and after the second start.
const WATCHED: Duration = Duration::from_millis(200);

/// Whether the first set kept its torque while a second one was refused.
fn undisturbed(folder: &Folder) -> bool {
    let mut first = folder.energised(0);
    let edges = first.axis.edges();
    let command = folder.command().output().expect("safepair starts");
    assert_eq!(command.status.code(), Some(1), "{command:?}");
    let line = String::from_utf8_lossy(&command.stderr);
    assert!(line.contains(&first.supervisor.id().to_string()), "{line}");
    assert_eq!(line.lines().count(), 1, "one clear line: {line}");
    let lost = first.axis.comes(WATCHED, |axis| !axis.torque());
    let later = first.axis.edges();
    let refreshed = (later[0] > edges[0]) & (later[1] > edges[1]);
    if lost {
        println!("torque was lost beside a second start:\n{}", first.axis.in_words());
    }
    first.stop();
    !lost && refreshed
}

#[test]
fn a_second_start_is_refused_with_the_process_and_disturbs_nothing() {
    let _turn = alone();
    let folder = Folder::new("second");
    // A stall of the host can take the torque away at any time: not every time.
    assert!((0..ATTEMPTS).any(|_| undisturbed(&folder)), "torque was lost each time");
}
