//! The settled start, and a machine that just runs.

use sim::replay::Summary;

use crate::support::{bit, replay_with, replayed};

/// Design 10: start-up is complete and acknowledged, and nothing happens by itself.
#[test]
fn a_settled_axis_shows_each_source_once_and_the_end() {
    let seen = replayed("t_ms,speed_rpm\n0,1500\n5000,1500\n");
    let sources: Vec<_> = seen.lines.iter().map(|line| line["source"].as_str().unwrap_or("")).collect();
    assert_eq!(sources, ["a", "b", "crosscheck", "end"], "{seen}");
    assert!(seen.lines[..3].iter().all(|line| (line["torque"] == true) && (line["path"] == true)));
    assert_eq!(seen.summary, Summary { cycles: 5_001, trips: 0 });
}

/// Design 10: also from raw signals a starting or constant motion permits torque without a gap.
#[test]
fn a_settled_axis_with_raw_signals_has_torque_without_a_gap() {
    for speed in [0, 1, 57, 1_500, -1_500, 2_999] {
        let trace = format!("t_ms,speed_rpm\n0,{speed}\n2000,{speed}\n");
        let seen = replay_with(&[], &trace, true);
        assert!(seen.quiet(), "{speed} rpm: {seen}");
    }
}

/// Design 10, DEC-16: a standing request has t0 = 0, a standing acknowledge is no edge.
#[test]
fn a_request_of_the_first_row_begins_in_cycle_0_with_its_speed() {
    let seen = replayed("t_ms,speed_rpm,command\n0,600,0x7EFD\n100,0,\n300,0,\n");
    assert_eq!(seen.shown(bit::SS1_ACTIVE, true), Some(0.0), "{seen}");
    // (600 - 30) rpm at 6,000 rpm/s are 95 ms.
    assert_eq!(seen.tripped(), Some(95.0), "{seen}");
    assert_eq!(seen.errors("crosscheck"), "[]");
}
