//! How a run ends when it is asked to: SS1 first, STO at its end; asked twice, STO at once.

use std::path::PathBuf;

use nix::sys::signal::Signal;

use crate::axis::Axis;
use crate::host::judged;
use crate::processes;
use crate::set::{Folder, alone};

#[test]
fn the_first_signal_brakes_with_ss1_and_ends_in_sto() {
    let _turn = alone();
    judged("one signal", || {
        let folder = Folder::new("brake");
        let mut running = folder.energised(300);
        processes::send(running.supervisor.id(), Signal::SIGINT);
        running.axis.expect("SS1 with torque", |axis| axis.brakes() & axis.torque());
        running.axis.expect("STO at its end", |axis| !axis.torque());
        assert!(running.supervisor.end().success(), "{}", folder.said());
        folder.until_deserted();
        assert_eq!(folder.remains(), Vec::<PathBuf>::new());
    });
}

#[test]
fn the_second_signal_is_sto_at_once() {
    let _turn = alone();
    judged("two signals", || {
        let folder = Folder::new("twice");
        let mut running = folder.energised(300);
        processes::send(running.supervisor.id(), Signal::SIGTERM);
        running.axis.expect("SS1 with torque", Axis::brakes);
        processes::send(running.supervisor.id(), Signal::SIGTERM);
        assert!(running.supervisor.end().success(), "{}", folder.said());
        // The delay of SS1 alone is 300 ms: it was cut short, and torque is off all the same.
        assert!(!folder.said().contains("did not"), "{}", folder.said());
        folder.until_deserted();
        assert_eq!(folder.remains(), Vec::<PathBuf>::new());
    });
}
