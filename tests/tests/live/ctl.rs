//! `safepair ctl` and `safepair top` on a running set.

use std::process::{Command, Output};

use serde_json::Value;

use crate::axis::Axis;
use crate::host::judged;
use crate::programs::safepair;
use crate::set::{Folder, alone};

fn ctl(folder: &Folder, words: &[&str]) -> Output {
    let mut command = Command::new(safepair());
    command.arg("ctl").arg("--run-dir").arg(folder.run()).args(words);
    command.output().expect("safepair starts")
}

fn status(folder: &Folder) -> Value {
    let output = ctl(folder, &["--json", "status"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn a_running_set_is_asked_and_commanded_by_name() {
    let _turn = alone();
    judged("safepair ctl", || {
        let folder = Folder::new("ctl");
        let mut running = folder.energised(300);
        let before = status(&folder);
        assert_eq!((&before[0]["axis"], &before[0]["torque"]), (&Value::from(1), &Value::from(true)));
        assert!(before[0]["speed"].as_f64().is_some_and(|rpm| rpm > 250.0), "{before}");

        assert_eq!(ctl(&folder, &["request", "SLS1"]).status.code(), Some(0));
        running.axis.expect("torque under SLS1", Axis::torque);
        assert_eq!(ctl(&folder, &["request", "STO"]).status.code(), Some(0));
        running.axis.expect("STO", |axis| !axis.torque());
        let stopped = status(&folder);
        assert!(
            stopped[0]["status_bits"].as_array().is_some_and(|bits| bits.contains(&"STO".into())),
            "{stopped}"
        );
        assert_eq!(ctl(&folder, &["release", "STO", "SLS1"]).status.code(), Some(0));
        running.axis.expect("torque when nobody asks for STO", Axis::torque);

        let wrong = ctl(&folder, &["request", "SLX"]);
        assert_eq!(wrong.status.code(), Some(2), "{wrong:?}");
        let line = String::from_utf8_lossy(&wrong.stderr);
        assert!(line.contains("\"SLX\"") & line.contains("SLS1") & (line.lines().count() == 1), "{line}");

        let mut top = Command::new(safepair());
        top.args(["top", "--count", "2", "--run-dir"]).arg(folder.run());
        let shown = top.output().expect("safepair starts");
        assert!(String::from_utf8_lossy(&shown.stdout).contains("axis 1 (amk-kw): TORQUE"), "{shown:?}");
        running.stop();
    });
}

#[test]
fn without_a_set_there_is_one_clear_line() {
    let folder = Folder::new("nobody");
    for words in [&["status"][..], &["acknowledge"]] {
        let output = ctl(&folder, words);
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        assert_eq!(String::from_utf8_lossy(&output.stderr).lines().count(), 1, "{output:?}");
    }
}
