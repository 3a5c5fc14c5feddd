//! Traces through the real cores: what leaves the machine, to the cycle.

use params::{AxisSet, Machine};
use shm_schema::profile::Profile;
use sim::replay::{ReplayOptions, Summary, replay_to};

/// An AMK axis with SMS at 3,000 rpm and an SS1 ramp of 6,000 rpm/s.
fn machine() -> Machine {
    let mut set = AxisSet::delivery(Profile::AmkKw, 1, "SIM-0001");
    for (key, value) in [(20, 500), (21, 30), (67, 3_000)] {
        set.values.insert(key, value);
    }
    Machine { file: "set.toml".to_owned(), axes: vec![set] }
}

struct Seen {
    lines: Vec<serde_json::Value>,
    summary: Summary,
}

impl Seen {
    /// Time in ms of the first line of `source` behind cycle 0 with `field` as given.
    fn first(&self, source: &str, field: &str, value: bool) -> Option<f64> {
        let matches = |line: &&serde_json::Value| {
            (line["source"] == source) && (line[field] == value) && (line["t_ms"] != 0.0)
        };
        self.lines.iter().find(matches).and_then(|line| line["t_ms"].as_f64())
    }

    fn errors(&self, source: &str) -> String {
        let own = self.lines.iter().rfind(|line| line["source"] == source);
        own.map(|line| line["errors"].to_string()).unwrap_or_default()
    }
}

fn replayed(trace: &str) -> Seen {
    let trace = sim::trace::parse(trace).expect("a sound trace");
    let mut out = Vec::new();
    let summary = replay_to(&machine(), &trace, ReplayOptions::default(), &mut out).expect("replays");
    let text = String::from_utf8(out).expect("text");
    let lines =
        text.lines().map(|line| serde_json::from_str(line).expect("one JSON object a line")).collect();
    Seen { lines, summary }
}

fn faulty(fault: &str) -> Seen {
    replayed(&format!("t_ms,speed_rpm,fault\n0,1500,none\n50,1500,{fault}\n90,1500,\n"))
}

#[test]
fn a_settled_axis_shows_each_source_once_and_the_end() {
    let seen = replayed("t_ms,speed_rpm\n0,1500\n90,1500\n");
    let sources: Vec<_> = seen.lines.iter().map(|line| line["source"].as_str().unwrap_or("")).collect();
    assert_eq!(sources, ["a", "b", "crosscheck", "end"]);
    assert!(seen.lines[..3].iter().all(|line| (line["torque"] == true) && (line["path"] == true)));
    assert_eq!(seen.summary, Summary { cycles: 91, trips: 0 });
}

/// AMK-EX-STO, DEC-24: the request acts in its own cycle, the permission one cycle after.
#[test]
fn sto_acts_in_the_cycle_of_its_request_on_every_source() {
    let seen = replayed("t_ms,speed_rpm,command\n0,1500,0x7E7F\n40,1500,0x7E7E\n60,1500,0x7E7F\n90,1500,\n");
    for source in ["a", "b", "crosscheck"] {
        assert_eq!(seen.first(source, "torque", false), Some(40.0), "{source}");
        assert_eq!(seen.first(source, "path", false), Some(40.0), "{source}");
    }
    assert_eq!(seen.summary.trips, 1);
}

/// AMK-EX-SS1-1: at the latest at t1 + Prm20 STO without error; DEC-05: the line ends the ramp.
#[test]
fn ss1_ends_in_sto_where_the_line_meets_the_window() {
    let seen = replayed("t_ms,speed_rpm,command\n0,600,0x7E7F\n10,600,0x7E7D\n110,0,\n115,0,\n");
    for source in ["a", "b", "crosscheck"] {
        // (600 - 30) rpm at 6,000 rpm/s are 95 ms.
        assert_eq!(seen.first(source, "torque", false), Some(105.0), "{source}");
        assert_eq!(seen.errors(source), "[]");
    }
}

/// AMK-SMS-05, DEC-01: the limit itself is inside, 1/1000 rpm above it is not.
#[test]
fn a_speed_limit_trips_in_the_cycle_behind_the_limit() {
    let seen = replayed("t_ms,speed_rpm\n0,2990\n20,3010\n90,3010\n");
    assert_eq!(seen.first("a", "torque", false), Some(11.0), "3,000 rpm at 10 ms are inside");
    assert_eq!(seen.first("b", "torque", false), Some(11.0));
}

/// DEC-23, design 8: whoever of the three stops, both paths are off in the third cycle.
#[test]
fn whatever_stops_both_paths_are_off_in_the_third_cycle() {
    for fault in
        ["freeze-a", "freeze-b", "freeze-crosscheck", "stale-encoder", "corrupt-encoder", "corrupt-report-a"]
    {
        let seen = faulty(fault);
        for source in ["a", "b", "crosscheck"] {
            let dropped = seen.first(source, "path", false).unwrap_or(f64::NAN);
            assert!((50.0..=53.0).contains(&dropped), "{fault}: path of {source} off at {dropped} ms");
        }
        assert_eq!(seen.summary.trips, 1, "{fault}");
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

/// Design 10: raw signals evaluated give the same speed within 1 rpm, the same trip within
/// 2 cycles.
#[test]
fn raw_signals_give_the_same_within_the_stated_bounds() {
    let trace = sim::trace::parse("t_ms,speed_rpm\n0,2900\n100,3100\n150,3100\n").expect("sound");
    let mut out = Vec::new();
    let options = ReplayOptions { encoder: true, cold: false };
    replay_to(&machine(), &trace, options, &mut out).expect("replays");
    let text = String::from_utf8(out).expect("text");
    let lines: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    for source in ["a", "b"] {
        let later = |line: &serde_json::Value| line["t_ms"].as_f64().unwrap_or(0.0) > 10.0;
        let tripped = lines.iter().find(|l| (l["source"] == source) && (l["torque"] == false) & later(l));
        let at = tripped.and_then(|line| line["t_ms"].as_f64()).unwrap_or(f64::NAN);
        assert!((49.0..=53.0).contains(&at), "{source} at {at} ms");
    }
}
