//! Wake-up of channel A against cyclictest, in virtual time: the same kernel, priority, period
//! and minute. Instruction counts, no statement about hardware.

use std::fs;
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::chip::Chip;
use crate::set::{PRIORITY, Set};
use crate::verdict::Verdict;

const CYCLES: usize = 4_000;
/// What the channel adds to the wake-up before it takes its time stamp, µs: the reading of the
/// clock, and the processes of the set that run before it.
const ADDED_US: u32 = 25;

/// Both distributions, and the channel's tail against the floor.
pub fn run(chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    let set = Set::start(chip)?;
    set.energise()?;
    let floor = cyclictest()?;
    set.seen(|seen| seen.wakeups_ns.clear());
    thread::sleep(Duration::from_millis(CYCLES as u64));
    let mut found: Vec<u32> =
        set.seen(|seen| seen.wakeups_ns.iter().map(|ns| ns / 1_000).collect()).unwrap_or_default();
    found.sort_unstable();
    let at = |share: f64| found.get((found.len() as f64 * share) as usize).or(found.last()).copied();
    let (median, tail, most) = (at(0.5), at(0.999), found.last().copied());
    println!("note channel A: n {} p50 {median:?} p99.9 {tail:?} max {most:?} µs", found.len());
    println!("note cyclictest beside the running set: min {} avg {} max {} µs", floor[0], floor[1], floor[2]);
    verdict.check(found.len() > CYCLES * 9 / 10, "the channel reported every cycle");
    let bound = floor[2] * 11 / 10 + ADDED_US;
    verdict.check(tail.is_some_and(|tail| tail <= bound), format!("p99.9 within {bound} µs"));
    Ok(())
}

/// Min, average and maximum, µs.
fn cyclictest() -> Result<[u32; 3], String> {
    let file = "/tmp/cyclictest";
    let loops = CYCLES.to_string();
    let priority = PRIORITY.to_string();
    let arguments = ["-q", "-m", "-p", &priority, "-i", "1000", "-l", &loops, "-t", "1"];
    let output = fs::File::create(file).map_err(|error| error.to_string())?;
    let ran = Command::new("/safepair/cyclictest").args(arguments).stdout(output).status();
    let ran = ran.map_err(|error| format!("cyclictest: {error}"))?;
    let text = fs::read_to_string(file).map_err(|error| error.to_string())?;
    let value = |name: &str| {
        let rest = text.split(name).nth(1)?.trim_start();
        rest.split_whitespace().next()?.parse().ok()
    };
    let found = ["Min:", "Avg:", "Max:"].map(value);
    let all = found.iter().flatten().count() == 3 && ran.success();
    if all { Ok(found.map(Option::unwrap_or_default)) } else { Err(format!("cyclictest {ran}: {text}")) }
}
