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

fn both(chip: &Chip, high: bool) -> Result<(), String> {
    PAIR_1.iter().try_for_each(|line| chip.pull(*line, high))
}

/// A low pulse; the low samples in the cell against the time it took.
fn pulse(set: &Set, chip: &Chip, verdict: &mut Verdict, length_us: u64) -> Result<(), String> {
    let before = set.seen(|seen| seen.samples.len()).unwrap_or(0);
    let (early_ns, late_ns) = crate::promptly(|| -> Result<_, String> {
        let start_ns = now_ns();
        both(chip, false)?;
        sleep_until(start_ns + length_us * 1_000);
        // Line .1 goes up within this call, first of the two.
        let early_ns = now_ns() - start_ns;
        both(chip, true)?;
        Ok((early_ns, now_ns() - start_ns))
    })?;
    thread::sleep(PAUSE);
    let low = set.seen(|seen| seen.samples.iter().skip(before).filter(|high| !**high).count() as u64);
    let low = low.unwrap_or(0);
    // Line .1 falls at most `late - early` after the start, and rises at most that late.
    let least = (2 * early_ns).saturating_sub(late_ns) / SAMPLE_NS;
    let most = late_ns / SAMPLE_NS + 1;
    verdict.check(
        (least..=most).contains(&low),
        format!("{length_us} µs low at the terminal: {low} low samples, expected {least} to {most}"),
    );
    Ok(())
}

/// A contact that bounces: each low part is short, all of them end.
fn bounce(set: &Set, chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    crate::promptly(|| {
        let mut due_ns = now_ns();
        [false, true].into_iter().cycle().take(12).try_for_each(|high| {
            due_ns += 400_000;
            sleep_until(due_ns);
            both(chip, high)
        })
    })?;
    thread::sleep(PAUSE);
    let torque = set.seen(|seen| seen.torque) == Some(true);
    verdict.check(torque, format!("six bounces of 400 µs: torque stays; {}", set.state()));
    Ok(())
}
