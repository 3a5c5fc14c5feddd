//! Injected faults: both paths off in time.

use params::{AxisSet, Machine};
use shm_schema::profile::{Profile, lenze_key};

use crate::support::{Seen, replay_on, replayed};

fn faulty(fault: &str) -> Seen {
    replayed(&format!("t_ms,speed_rpm,fault\n0,1500,none\n50,1500,{fault}\n400,1500,\n"))
}

fn dropped(seen: &Seen, source: &str) -> f64 {
    seen.first(source, "path", false).unwrap_or(f64::NAN)
}

/// DEC-23, design 8: whoever of the three stops, both paths are off in the third cycle.
#[test]
fn whatever_stops_both_paths_are_off_in_the_third_cycle() {
    for fault in ["freeze-a", "freeze-b", "freeze-crosscheck", "corrupt-report-a"] {
        let seen = faulty(fault);
        for source in ["a", "b", "crosscheck"] {
            let at = dropped(&seen, source);
            assert!((50.0..=52.0).contains(&at), "{fault}: path of {source} off at {at} ms\n{seen}");
        }
        assert_eq!(seen.summary.trips, 1, "{fault}");
    }
}

/// Design 8: a sample is stale in the third cycle, and nobody is lost.
#[test]
fn without_encoder_samples_both_paths_drop_in_the_third_cycle() {
    for fault in ["stale-encoder", "corrupt-encoder"] {
        let seen = faulty(fault);
        for source in ["a", "b", "crosscheck"] {
            assert!((dropped(&seen, source) - 52.0).abs() < 0.1, "{fault}: {source}\n{seen}");
        }
        assert!(!seen.errors("crosscheck").contains("3606/13/1"), "{fault}: {seen}");
        assert_eq!(seen.summary.trips, 1, "{fault}");
    }
}

/// Design 8: one lost sample is no reason.
#[test]
fn a_sample_that_is_missing_once_trips_nothing() {
    for fault in ["stale-encoder", "corrupt-encoder", "corrupt-report-a"] {
        let seen = replayed(&format!(
            "t_ms,speed_rpm,fault\n0,1500,none\n50,1500,{fault}\n51,1500,none\n400,1500,\n"
        ));
        assert!(seen.quiet(), "{fault}: {seen}");
    }
}

/// Design 8: a path stuck on is seen when it should be off, and the other one holds.
#[test]
fn a_stuck_path_is_found_when_torque_is_withdrawn() {
    for (fault, free) in [("stuck-path-a", "b"), ("stuck-path-b", "a")] {
        let trace = format!("t_ms,fault,command\n0,none,7E7F\n20,{fault},\n30,,7E7E\n90,,\n");
        let seen = replayed(&trace);
        assert_eq!(seen.first(free, "path", false), Some(30.0), "{fault}");
        assert_eq!(seen.first("crosscheck", "path", false), Some(30.0), "{fault}");
        assert_ne!(seen.errors("crosscheck"), "[]", "{fault}");
    }
}

/// LNZ-ACK: a pulse at the AIE terminal clears what crosscheck holds, too.
#[test]
fn a_pulse_at_the_terminal_reaches_crosscheck() {
    let mut set = AxisSet::delivery(Profile::LenzeSm301, 1, "SIM-0001");
    set.values.insert(lenze_key(15_400, 0), 1);
    let machine = Machine { file: "set.toml".to_owned(), axes: vec![set] };
    let trip = "t_ms,fault,aie\n0,none,0\n50,corrupt-report-a,0\n80,none,0\n";
    let held = replay_on(&machine, &format!("{trip}900,none,0\n"), false);
    assert_ne!(held.errors("crosscheck"), "[]", "{held}");
    let cleared = replay_on(&machine, &format!("{trip}200,none,1\n700,none,0\n900,none,0\n"), false);
    for source in ["a", "b", "crosscheck"] {
        assert_eq!(cleared.errors(source), "[]", "{source}: {cleared}");
    }
}
