//! A second start beside a running set (design 5).

use std::time::Duration;

use crate::host::judged;
use crate::set::{Folder, alone};

/// How long torque must last beside and after the second start.
const WATCHED: Duration = Duration::from_millis(200);

#[test]
fn a_second_start_is_refused_with_the_process_and_disturbs_nothing() {
    let _turn = alone();
    judged("a second start", || {
        let folder = Folder::new("second");
        let mut first = folder.energised(0);
        let edges = first.axis.edges();
        let command = folder.command().output().expect("safepair starts");
        assert_eq!(command.status.code(), Some(1), "{command:?}");
        let line = String::from_utf8_lossy(&command.stderr);
        assert!(line.contains(&first.supervisor.id().to_string()), "{line}");
        assert_eq!(line.lines().count(), 1, "one clear line: {line}");
        first.axis.hold("torque beside a second start", WATCHED, crate::axis::Axis::torque);
        let later = first.axis.edges();
        assert!((later[0] > edges[0]) & (later[1] > edges[1]), "refreshed all the time");
        first.stop();
    });
}
