//! A machine, traces and what was seen of them.

use params::{AxisSet, Machine};
use shm_schema::profile::Profile;
use sim::replay::{ReplayOptions, Summary, replay_to};

/// Control word with nothing requested.
pub const NEUTRAL: u32 = 0x7E7F;
/// Control bits (0 requests), status bits.
pub mod bit {
    pub const STO: u32 = 0;
    pub const SS1: u32 = 1;
    pub const SS2: u32 = 2;
    pub const SOS: u32 = 3;
    pub const SSR1: u32 = 4;
    pub const SDIP: u32 = 5;
    pub const SDIN: u32 = 6;
    pub const ERROR: u32 = 7;
    pub const SMS: u32 = 8;
    pub const SLS1: u32 = 12;
    pub const SLI: u32 = 14;
    pub const SS1_ACTIVE: u32 = 26;
    pub const SE1: u32 = 29;
}

/// The control word that requests one function.
pub fn request(bit: u32) -> String {
    format!("{:#06X}", NEUTRAL & !(1 << bit))
}

/// An AMK axis with SMS at 3,000 rpm, ramps of 6,000 rpm/s, and `more`.
pub fn machine(more: &[(u32, i32)]) -> Machine {
    let mut set = AxisSet::delivery(Profile::AmkKw, 1, "SIM-0001");
    // 500 ms from 3,000 rpm to 0 for SS1, SS2, SSR1 and SLS1.
    let ramps = [(20, 500), (25, 500), (32, 500), (56, 500)];
    let windows = [(21, 30), (26, 30), (27, 200), (28, 30), (29, 200), (67, 3_000)];
    for (key, value) in ramps.iter().chain(&windows).chain(more) {
        set.values.insert(*key, *value);
    }
    Machine { file: "set.toml".to_owned(), axes: vec![set] }
}

/// The output of a replay.
pub struct Seen {
    /// Every line.
    pub lines: Vec<serde_json::Value>,
    /// Cycles and trips.
    pub summary: Summary,
}

impl Seen {
    fn of<'a>(&'a self, source: &'a str) -> impl DoubleEndedIterator<Item = &'a serde_json::Value> {
        self.lines.iter().filter(move |line| line["source"] == source)
    }

    /// Time in ms of the first line of `source` behind cycle 0 with `field` as given.
    pub fn first(&self, source: &str, field: &str, value: bool) -> Option<f64> {
        let line = self.of(source).find(|line| (line[field] == value) && (line["t_ms"] != 0.0));
        line.and_then(|line| line["t_ms"].as_f64())
    }

    /// Time in ms at which a status bit of `source` first is `value`.
    pub fn first_bit(&self, source: &str, bit: u32, value: bool) -> Option<f64> {
        let line = self.of(source).find(|line| (status(line) >> bit & 1 == 1) == value);
        line.and_then(|line| line["t_ms"].as_f64())
    }

    /// Errors of the last line of `source`.
    pub fn errors(&self, source: &str) -> String {
        self.of(source).next_back().map(|line| line["errors"].to_string()).unwrap_or_default()
    }

    /// When torque first fell, the same for A, B and crosscheck.
    pub fn tripped(&self) -> Option<f64> {
        let all = ["a", "b", "crosscheck"].map(|source| self.first(source, "torque", false));
        assert!(all.iter().all(|at| *at == all[0]), "a, b, crosscheck at {all:?}\n{self}");
        all[0]
    }

    /// When a status bit first is `value`, the same for A, B and crosscheck.
    pub fn shown(&self, bit: u32, value: bool) -> Option<f64> {
        let all = ["a", "b", "crosscheck"].map(|source| self.first_bit(source, bit, value));
        assert!(all.iter().all(|at| *at == all[0]), "a, b, crosscheck at {all:?}\n{self}");
        all[0]
    }

    /// Nothing ever fell, no error ever stood.
    pub fn quiet(&self) -> bool {
        let calm =
            |line: &serde_json::Value| (line["torque"] == true) && (line["errors"] == serde_json::json!([]));
        ["a", "b", "crosscheck"].iter().all(|source| self.of(source).all(calm))
    }
}

impl std::fmt::Display for Seen {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.lines.iter().try_for_each(|line| writeln!(out, "{line}"))
    }
}

fn status(line: &serde_json::Value) -> u32 {
    let text = line["status"].as_str().unwrap_or("0x0");
    u32::from_str_radix(text.trim_start_matches("0x"), 16).unwrap_or(0)
}

/// Replays a trace on a machine with `more` parameters.
pub fn replay_with(more: &[(u32, i32)], trace: &str, encoder: bool) -> Seen {
    replay_on(&machine(more), trace, encoder)
}

/// Replays a trace on a machine.
pub fn replay_on(machine: &Machine, trace: &str, encoder: bool) -> Seen {
    let trace = sim::trace::parse(trace).expect("a sound trace");
    let mut out = Vec::new();
    let options = ReplayOptions { encoder, ..ReplayOptions::default() };
    let summary = replay_to(machine, &trace, options, &mut out).expect("replays");
    let text = String::from_utf8(out).expect("text");
    let lines =
        text.lines().map(|line| serde_json::from_str(line).expect("one JSON object a line")).collect();
    Seen { lines, summary }
}

/// Replays a trace on the plain machine.
pub fn replayed(trace: &str) -> Seen {
    replay_with(&[], trace, false)
}
