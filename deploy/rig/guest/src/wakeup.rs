//! Wake-up of channel A against cyclictest, in virtual time: the same kernel, priority, period
//! and minute. Instruction counts, no statement about hardware.

use std::fmt::{self, Display};
use std::fs;
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::chip::Chip;
use crate::set::{PRIORITY, Set};
use crate::verdict::Verdict;

const CYCLES: usize = 4_000;
/// Length of cyclictest's histogram, µs.
const HISTOGRAM_US: u32 = 2_000;
/// What the channel adds to the wake-up before it takes its time stamp, µs: the reading of the
/// clock, and the processes of the set that run before it.
const ADDED_US: u32 = 25;

/// Both distributions, and the channel's tail against the floor.
pub fn run(chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    let set = Set::start(chip)?;
    set.energise()?;
    let floor = Spread::of(cyclictest()?);
    set.seen(|seen| seen.wakeups_ns.clear());
    thread::sleep(Duration::from_millis(CYCLES as u64));
    let found = set.seen(|seen| seen.wakeups_ns.iter().map(|ns| ns / 1_000).collect()).unwrap_or_default();
    let found = Spread::of(found);
    Verdict::note(format!("cyclictest beside the running set: {floor}"));
    Verdict::note(format!("channel A: {found}"));
    verdict.check(found.count > CYCLES * 9 / 10, "the channel reported every cycle");
    let bound = floor.tail * 11 / 10 + ADDED_US;
    verdict.check(found.tail <= bound, format!("p99.9 {} µs within {bound} µs", found.tail));
    Ok(())
}

/// A distribution, µs.
struct Spread {
    count: usize,
    median: u32,
    /// 99.9 %: the few largest of a run are those of its start.
    tail: u32,
    most: u32,
}

impl Spread {
    fn of(mut values: Vec<u32>) -> Self {
        values.sort_unstable();
        let at = |per_mille: usize| {
            let place = values.len() * per_mille / 1_000;
            values.get(place).or(values.last()).copied().unwrap_or(u32::MAX)
        };
        Self { count: values.len(), median: at(500), tail: at(999), most: at(1_000) }
    }
}

impl Display for Spread {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, median, tail, most } = self;
        write!(out, "n {count}, p50 {median}, p99.9 {tail}, max {most} µs")
    }
}

/// Every wake-up, µs, from the histogram; what lies above it counts as its end.
fn cyclictest() -> Result<Vec<u32>, String> {
    let file = "/tmp/cyclictest";
    let (loops, priority, end) = (CYCLES.to_string(), PRIORITY.to_string(), HISTOGRAM_US.to_string());
    let arguments = ["-q", "-m", "-p", &priority, "-i", "1000", "-l", &loops, "-t", "1", "-h", &end];
    let output = fs::File::create(file).map_err(|error| error.to_string())?;
    let ran = Command::new("/safepair/cyclictest").args(arguments).stdout(output).status();
    let ran = ran.map_err(|error| format!("cyclictest: {error}"))?;
    let text = fs::read_to_string(file).map_err(|error| error.to_string())?;
    let row = |line: &str| {
        let (bucket, count) = line.split_once(' ')?;
        Some((bucket.parse::<u32>().ok()?, count.trim().parse::<usize>().ok()?))
    };
    let mut found: Vec<u32> =
        text.lines().filter_map(row).flat_map(|(bucket, count)| std::iter::repeat_n(bucket, count)).collect();
    let whole = ran.success() & (found.len() <= CYCLES) & !found.is_empty();
    found.resize(CYCLES, HISTOGRAM_US);
    if whole { Ok(found) } else { Err(format!("cyclictest {ran}: {text}")) }
}
