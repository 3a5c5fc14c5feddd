//! Safe inputs by edge events: the pattern that reaches the channels is the one at the terminal.

use std::thread;
use std::time::Duration;

use producers::clock::{now_ns, sleep_until};
use shm_schema::io::SAMPLE_NS;

use crate::chip::{AIS, Chip, PAIR_1};
use crate::set::Set;
use crate::verdict::Verdict;

const PAUSE: Duration = Duration::from_millis(60);
/// Short enough for the filter of SD-In1 (2 ms), µs.
const TOLERATED_US: [u64; 4] = [190, 250, 500, 1_500];
/// Long enough, µs.
const SEEN_US: [u64; 2] = [3_000, 20_000];

/// Half a bounce, ns.
const BOUNCE_NS: u64 = 400_000;

/// Pulses of known length on both lines of SD-In1.
pub fn run(chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    let set = Set::start(chip)?;
    set.energise()?;
    for length_us in TOLERATED_US {
        pulse(&set, chip, verdict, length_us)?;
        let torque = set.seen(|seen| seen.torque) == Some(true);
        verdict.check(torque, format!("{length_us} µs: inside the filter, torque stays"));
    }
    bounce(&set, chip, verdict)?;
    for length_us in SEEN_US {
        pulse(&set, chip, verdict, length_us)?;
        let off = set.seen(|seen| !seen.torque) == Some(true);
        verdict.check(off, format!("{length_us} µs: emergency stop, torque off"));
        set.acknowledge(AIS)?;
        let again = set.until(Duration::from_secs(1), |seen| seen.torque);
        verdict.check(again, format!("acknowledged; {}", set.state()));
    }
    Ok(())
}

/// A low pulse; the low samples in the cell against the time it took.
fn pulse(set: &Set, chip: &Chip, verdict: &mut Verdict, length_us: u64) -> Result<(), String> {
    let before = set.seen(|seen| seen.samples.len()).unwrap_or(0);
    let [fall_from, fall_to, rise_from, rise_to] = crate::promptly(|| -> Result<_, String> {
        let (fall_from, fall_to) = edges(chip, false)?;
        sleep_until(fall_from + length_us * 1_000);
        let (rise_from, rise_to) = edges(chip, true)?;
        Ok([fall_from, fall_to, rise_from, rise_to])
    })?;
    thread::sleep(PAUSE);
    let low = set.seen(|seen| seen.samples.iter().skip(before).filter(|high| !**high).count() as u64);
    let low = low.unwrap_or(0);
    let (shortest_ns, longest_ns) = (rise_from - fall_to, rise_to - fall_from);
    let (least, most) = (shortest_ns / SAMPLE_NS, longest_ns / SAMPLE_NS + 1);
    verdict.check(
        (least..=most).contains(&low),
        format!(
            "{length_us} µs: low at the terminal for {} to {} µs, {low} low samples, expected {least} to {most}",
            shortest_ns / 1_000,
            longest_ns / 1_000
        ),
    );
    Ok(())
}

/// Both lines get a level; between which times line .1 did, ns.
fn edges(chip: &Chip, high: bool) -> Result<(u64, u64), String> {
    let [line_1, line_2] = PAIR_1;
    let from_ns = now_ns();
    chip.pull(line_1, high)?;
    let to_ns = now_ns();
    chip.pull(line_2, high)?;
    Ok((from_ns, to_ns))
}

/// A contact that bounces: each low part is short, all of them end. No edge may get lost.
fn bounce(set: &Set, chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    let before = set.seen(|seen| seen.samples.len()).unwrap_or(0);
    crate::promptly(|| {
        let mut due_ns = now_ns();
        [false, true].into_iter().cycle().take(12).try_for_each(|high| {
            due_ns += BOUNCE_NS;
            sleep_until(due_ns);
            edges(chip, high).map(|_| ())
        })
    })?;
    thread::sleep(PAUSE);
    let (torque, low) = set
        .seen(|seen| (seen.torque, seen.samples.iter().skip(before).filter(|high| !**high).count() as u64))
        .unwrap_or_default();
    let expected = 6 * BOUNCE_NS / SAMPLE_NS;
    verdict.check(
        torque & low.abs_diff(expected).le(&6),
        format!("six bounces of 400 µs: torque {torque}, {low} low samples, expected {expected} ± 6"),
    );
    Ok(())
}
