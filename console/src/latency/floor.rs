//! The floors: a bare timer loop, a bare seqlock, and cyclictest where it is installed.

use std::{
    process::Command,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering, fence},
    },
    thread::{self, JoinHandle},
};

use nix::time::{ClockId, ClockNanosleepFlags, clock_nanosleep};
use sim::shm::{CellReader, CellValue, CellWriter};

use super::histogram::Times;
use super::place::{Seat, take};
use crate::watch::now_ns;

/// A thread that does nothing but wake up on time.
#[derive(Debug)]
pub struct BareTimer {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Times>,
}

impl BareTimer {
    /// Starts it at `seat`, every `period_ns`, `phase_ns` behind the boundary.
    pub fn start(seat: Seat, period_ns: u64, phase_ns: u64) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&stop);
        let thread = thread::spawn(move || {
            take(seat);
            let mut times = Times::default();
            let mut due_ns = (now_ns() / period_ns + 1) * period_ns + phase_ns;
            while !told.load(Ordering::Relaxed) {
                let due = std::time::Duration::from_nanos(due_ns).into();
                // An early return would show as no lateness at all.
                let _ = clock_nanosleep(ClockId::CLOCK_MONOTONIC, ClockNanosleepFlags::TIMER_ABSTIME, &due);
                let woken_ns = now_ns();
                times.add(woken_ns.saturating_sub(due_ns));
                due_ns += period_ns * (1 + woken_ns.saturating_sub(due_ns) / period_ns);
            }
            times
        });
        Self { stop, thread }
    }

    /// Ends it and hands over the lateness of every wake-up.
    pub fn finish(self) -> Times {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap_or_default()
    }
}

/// A sequence lock around as many words as a cell has: what anything in shared memory costs.
#[derive(Debug)]
pub struct SeqLock {
    sequence: AtomicU64,
    words: Vec<AtomicU64>,
}

impl SeqLock {
    /// Room for `octets`.
    pub fn new(octets: usize) -> Self {
        let words = (0..octets.div_ceil(8)).map(|_| AtomicU64::new(0)).collect();
        Self { sequence: AtomicU64::new(0), words }
    }

    fn write(&self, octets: &[u8]) {
        let sequence = self.sequence.load(Ordering::Relaxed);
        // Odd: a reader that began before the words change must not accept them.
        self.sequence.store(sequence + 1, Ordering::Relaxed);
        fence(Ordering::Release);
        for (word, octets) in self.words.iter().zip(octets.chunks(8)) {
            let mut whole = [0; 8];
            whole[..octets.len()].copy_from_slice(octets);
            word.store(u64::from_le_bytes(whole), Ordering::Relaxed);
        }
        self.sequence.store(sequence + 2, Ordering::Release);
    }

    fn read(&self, into: &mut [u8]) -> bool {
        let before = self.sequence.load(Ordering::Acquire);
        for (word, octets) in self.words.iter().zip(into.chunks_mut(8)) {
            let whole = word.load(Ordering::Relaxed).to_le_bytes();
            let length = octets.len();
            octets.copy_from_slice(&whole[..length]);
        }
        fence(Ordering::Acquire);
        before & 1 == 0 && self.sequence.load(Ordering::Relaxed) == before
    }
}

/// Time from the write on one core to the read on another, of a cell and of a seqlock of the
/// same size, in blocks by turns; (cell, seqlock).
pub fn cell_against_seqlock<T: CellValue + Send>(
    mut writer: CellWriter<T>,
    reader: CellReader<T>,
    seats: [Seat; 2],
    blocks: u64,
) -> (Times, Times)
where
    T::Octets: Send,
{
    let lock = Arc::new(SeqLock::new(T::EMPTY.as_ref().len()));
    // The number of the reading that is wanted next; odd blocks are the seqlock's.
    let turn = Arc::new(AtomicU64::new(0));
    let (their_lock, their_turn) = (Arc::clone(&lock), Arc::clone(&turn));
    let total = blocks * 2 * BLOCK;
    let writing = thread::spawn(move || {
        take(seats[0]);
        let mut octets = T::EMPTY;
        for number in 1..=total {
            // The reader has taken the one before.
            while their_turn.load(Ordering::Acquire) + 1 < number {
                std::hint::spin_loop();
            }
            // Apart, so that the reader spins again when the value comes.
            let apart = now_ns() + 2_000;
            while now_ns() < apart {
                std::hint::spin_loop();
            }
            stamp(octets.as_mut(), number, now_ns());
            if is_cell(number) { writer.publish_octets(octets) } else { their_lock.write(octets.as_ref()) }
        }
    });
    let reading = thread::spawn(move || {
        take(seats[1]);
        let (mut cell, mut bare) = (Times::default(), Times::default());
        let mut octets = T::EMPTY;
        for number in 1..=total {
            let written_ns = loop {
                if is_cell(number) {
                    octets = reader.octets();
                } else if !lock.read(octets.as_mut()) {
                    continue;
                }
                let (seen, written_ns) = stamped(octets.as_ref());
                if seen == number {
                    break written_ns;
                }
                std::hint::spin_loop();
            };
            let took_ns = now_ns().saturating_sub(written_ns);
            if is_cell(number) {
                cell.add(took_ns);
            } else {
                bare.add(took_ns);
            }
            turn.store(number, Ordering::Release);
        }
        (cell, bare)
    });
    // A thread that ended early has nothing to show.
    let _ = writing.join();
    reading.join().unwrap_or_default()
}

/// Readings in a row of one kind.
const BLOCK: u64 = 500;

const fn is_cell(number: u64) -> bool {
    (number / BLOCK).is_multiple_of(2)
}

fn stamp(octets: &mut [u8], number: u64, time_ns: u64) {
    octets[..8].copy_from_slice(&number.to_le_bytes());
    octets[8..16].copy_from_slice(&time_ns.to_le_bytes());
}

fn stamped(octets: &[u8]) -> (u64, u64) {
    let word = |at: usize| octets[at..].first_chunk().map_or(0, |word| u64::from_le_bytes(*word));
    (word(0), word(8))
}

/// cyclictest at the same period, priority and core; `None` where it is not installed.
pub fn cyclictest(seat: Seat, period_us: u64, loops: u64) -> Option<Times> {
    let mut command = Command::new("cyclictest");
    command.args(["-q", "-m", "-h", "20000"]).args(["-i", &period_us.to_string(), "-l", &loops.to_string()]);
    if seat.priority > 0 {
        command.args(["-p", &seat.priority.to_string()]);
    }
    if let Some(core) = seat.core {
        command.args(["-a", &core.to_string(), "-t", "1"]);
    }
    let output = command.output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let mut times = Times::default();
    for line in text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())) {
        let mut fields = line.split_whitespace();
        let (us, count) = (fields.next()?.parse::<u64>().ok()?, fields.next()?.parse::<u64>().ok()?);
        (0..count).for_each(|_| times.add(us * 1_000));
    }
    (times.count() > 0).then_some(times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seqlock_reads_what_was_written_last() {
        let lock = SeqLock::new(20);
        let mut octets = [0; 20];
        stamp(&mut octets, 7, 9);
        octets[19] = 5;
        lock.write(&octets);
        let mut seen = [0; 20];
        assert!(lock.read(&mut seen));
        assert_eq!((seen, stamped(&seen)), (octets, (7, 9)));
    }
}
