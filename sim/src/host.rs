//! What the host takes away from everybody.
//!
//! A shared host stands still for milliseconds, at bad times for a tenth of a second. The relaxed
//! timing bears the first; the second is torque off, rightly, and says nothing about the set. A
//! witness on each core, above every process of a set, sees both: what a demonstration, a soak or a
//! test on such a host then tells is known to be the host's doing, or not.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;
use thread_priority::unix::{RealtimeThreadSchedulePolicy, ThreadSchedulePolicy};
use thread_priority::{
    ThreadPriority, ThreadPriorityValue, set_thread_priority_and_policy, thread_native_id,
};

/// A stall up to this long is no excuse: the relaxed timing bears several in a row.
pub const BORNE: Duration = Duration::from_millis(15);

/// Before another try the host must have been calm for so long …
const CALM: Duration = Duration::from_millis(500);
/// … which is waited for at most so long.
const PATIENCE: Duration = Duration::from_secs(20);
/// The witness looks at the clock so often.
const LOOK: Duration = Duration::from_millis(1);
/// A shorter stall is not worth a note.
const NOTED: Duration = Duration::from_millis(4);
/// Above the processes of a set (priority 80).
const PRIORITY: u8 = 98;
/// Stalls kept, the newest.
const KEPT: usize = 4_096;

#[derive(Debug, Clone, Copy)]
struct Stall {
    end: Instant,
    length: Duration,
}

#[derive(Debug, Default)]
struct Notes {
    stalls: Mutex<VecDeque<Stall>>,
    ended: AtomicBool,
}

/// What failed, and whose doing it was.
#[derive(Debug)]
pub enum Failure<E> {
    /// The host left it alone: its own.
    Own(E),
    /// The host stood still in every try; the last one.
    Host(E),
}

/// A thread on each usable core that notes when it was not let run; ends when dropped.
#[derive(Debug)]
pub struct Witness {
    notes: Arc<Notes>,
}

impl Witness {
    /// Starts to watch. Without the right to a real-time priority it notes its own waiting as well:
    /// then more is the host's doing, never less.
    pub fn start() -> Self {
        let notes = Arc::new(Notes::default());
        let usable = sched_getaffinity(Pid::from_raw(0)).unwrap_or_else(|_| CpuSet::new());
        for core in (0..CpuSet::count()).filter(|core| usable.is_set(*core).unwrap_or(false)) {
            let notes = Arc::clone(&notes);
            thread::spawn(move || watch(core, &notes));
        }
        Self { notes }
    }

    /// The longest stall that ended after `start`; zero when there was none worth a note.
    pub fn longest_since(&self, start: Instant) -> Duration {
        let stalls = self.notes.stalls.lock().unwrap_or_else(PoisonError::into_inner);
        let since = stalls.iter().filter(|stall| stall.end >= start);
        since.map(|stall| stall.length).max().unwrap_or_default()
    }

    /// Runs `run`; again, `tries` times at most, when it failed and the host stood still in it for
    /// longer than [`BORNE`]. `again` hears of each disturbed try and its longest stall.
    ///
    /// # Errors
    /// Its own failure at once; the last disturbed one when no try was left alone.
    pub fn undisturbed<T, E>(
        &self,
        tries: u32,
        mut run: impl FnMut() -> Result<T, E>,
        mut again: impl FnMut(u32, Duration),
    ) -> Result<T, Failure<E>> {
        let mut attempt = 1;
        loop {
            let start = Instant::now();
            let failure = match run() {
                Ok(value) => return Ok(value),
                Err(failure) => failure,
            };
            let stall = self.longest_since(start);
            if stall <= BORNE {
                return Err(Failure::Own(failure));
            }
            if attempt >= tries {
                return Err(Failure::Host(failure));
            }
            again(attempt, stall);
            self.wait_for_calm();
            attempt += 1;
        }
    }

    fn wait_for_calm(&self) {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            let since = Instant::now();
            thread::sleep(CALM);
            if self.longest_since(since) == Duration::ZERO {
                break;
            }
        }
    }
}

impl Drop for Witness {
    fn drop(&mut self) {
        self.notes.ended.store(true, Ordering::Relaxed);
    }
}

fn watch(core: usize, notes: &Notes) {
    let mut own = CpuSet::new();
    let _ = own.set(core).and_then(|()| sched_setaffinity(Pid::from_raw(0), &own));
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    if let Ok(value) = ThreadPriorityValue::try_from(PRIORITY) {
        let _ =
            set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), fifo);
    }
    let mut last = Instant::now();
    while !notes.ended.load(Ordering::Relaxed) {
        thread::sleep(LOOK);
        let end = Instant::now();
        let length = end.duration_since(last).saturating_sub(LOOK);
        if length >= NOTED {
            note(notes, Stall { end, length });
        }
        last = end;
    }
}

fn note(notes: &Notes, stall: Stall) {
    let mut stalls = notes.stalls.lock().unwrap_or_else(PoisonError::into_inner);
    stalls.push_back(stall);
    if stalls.len() > KEPT {
        stalls.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_stall_since_an_instant_is_told_and_older_ones_are_forgotten() {
        let witness = Witness { notes: Arc::default() };
        let start = Instant::now();
        for (after, length) in [(10, 90), (20, 30), (30, 50)] {
            let [end, length] = [after, length].map(Duration::from_millis);
            note(&witness.notes, Stall { end: start + end, length });
        }
        assert_eq!(witness.longest_since(start), Duration::from_millis(90));
        assert_eq!(witness.longest_since(start + Duration::from_millis(15)), Duration::from_millis(50));
        assert_eq!(witness.longest_since(start + Duration::from_millis(31)), Duration::ZERO);
    }

    #[test]
    fn only_a_stall_that_need_not_be_borne_excuses_a_failure() {
        let witness = Witness { notes: Arc::default() };
        let failing = |length: Duration| {
            let run = || {
                note(&witness.notes, Stall { end: Instant::now(), length });
                Err::<(), _>("as it should")
            };
            witness.undisturbed(1, run, |_, _| panic!("there is only one try"))
        };
        assert!(matches!(failing(BORNE), Err(Failure::Own("as it should"))));
        assert!(matches!(failing(BORNE + LOOK), Err(Failure::Host("as it should"))));
    }

    #[test]
    fn no_more_stalls_are_kept_than_there_is_room_for() {
        let notes = Notes::default();
        let stall = Stall { end: Instant::now(), length: NOTED };
        (0..2 * KEPT).for_each(|_| note(&notes, stall));
        assert_eq!(notes.stalls.lock().expect("nobody panicked").len(), KEPT);
    }
}
