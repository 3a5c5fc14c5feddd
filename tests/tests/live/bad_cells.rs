//! Cells of a running set that no honest producer writes (design 3.5, 8).

use std::time::Duration;

use crate::axis::now_ns;
use crate::host::judged;
use crate::set::{AGES, CYCLE, Folder, alone};

/// Until the instruction is taken, and the three cycles of a stale sample (architecture:
/// frozen from cycle k on, the path is dropped in cycle k + 2), with the host's stalls.
const BOUND: Duration = Duration::from_millis(36 + 12 * AGES as u64);

fn drops(fault: &str) {
    let _turn = alone();
    judged(fault, || {
        let folder = Folder::new(fault);
        let mut running = folder.energised(0);
        running.tell(&format!(r#"{{"fault": "{fault}"}}"#));
        let since_ns = now_ns();
        running.axis.expect("silence on both paths", |axis| axis.silent(BOUND + CYCLE));
        for (name, path) in ["A", "B"].into_iter().zip(&running.axis.paths) {
            let late = Duration::from_nanos(path.refreshed_ns.saturating_sub(since_ns));
            assert!(
                late <= BOUND,
                "path {name}: an edge {late:?} after {fault}:\n{}",
                running.axis.in_words()
            );
        }
        let edges = running.axis.edges();
        running.tell(r#"{"fault": "none"}"#);
        let quiet = |axis: &crate::axis::Axis| axis.edges() == edges;
        running.axis.hold("torque off once the cells are sound again", Duration::from_millis(200), quiet);
        running.stop();
    });
}

#[test]
fn encoder_cells_with_a_wrong_check_sum_take_the_torque_away() {
    drops("corrupt-encoder");
}

#[test]
fn encoder_cells_that_stand_still_take_the_torque_away() {
    drops("stale-encoder");
}
