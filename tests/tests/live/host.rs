//! What the host takes away from everybody, and what then cannot be judged.
//!
//! A shared host stands still for milliseconds, at bad times for a tenth of a second. The relaxed
//! timing bears the first; the second is torque off, rightly, and says nothing about the set. A
//! witness on each core, above every process of a set, sees both. A round is repeated only when the
//! witness saw such a stall in it: any other failure is the set's.

use std::collections::VecDeque;
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;
use thread_priority::unix::{RealtimeThreadSchedulePolicy, ThreadSchedulePolicy};
use thread_priority::{
    ThreadPriority, ThreadPriorityValue, set_thread_priority_and_policy, thread_native_id,
};

/// The witness looks at the clock so often.
const LOOK: Duration = Duration::from_millis(1);
/// A shorter stall is not worth a note.
const NOTED: Duration = Duration::from_millis(4);
/// Stalls up to this one are no excuse: the relaxed timing bears several in a row.
const BORNE: Duration = Duration::from_millis(15);
/// A disturbed round is tried so often.
const ATTEMPTS: u32 = 12;
/// Before another try the host must have been calm for so long …
const CALM: Duration = Duration::from_millis(500);
/// … which is waited for at most so long.
const PATIENCE: Duration = Duration::from_secs(20);
/// Above the processes of a set (priority 80).
const PRIORITY: u8 = 98;
/// Stalls kept.
const KEPT: usize = 4_096;

#[derive(Debug, Clone, Copy)]
struct Stall {
    end: Instant,
    length: Duration,
}

static STALLS: Mutex<VecDeque<Stall>> = Mutex::new(VecDeque::new());
static WITNESSES: OnceLock<()> = OnceLock::new();

/// Runs `round`; again when it failed and the host stood still in it. `None`, said aloud, when the
/// host never left it alone: such a host cannot judge.
pub fn judged<T>(what: &str, mut round: impl FnMut() -> T) -> Option<T> {
    WITNESSES.get_or_init(watch_every_core);
    for attempt in 1..=ATTEMPTS {
        let start = Instant::now();
        let failure = match panic::catch_unwind(AssertUnwindSafe(&mut round)) {
            Ok(value) => return Some(value),
            Err(failure) => failure,
        };
        let stall = longest_since(start);
        if stall <= BORNE {
            panic::resume_unwind(failure);
        }
        println!("{what}, try {attempt}: not judged, the host stood still for {stall:?}");
        wait_for_calm();
    }
    println!("SKIPPED {what}: the host stood still in each of {ATTEMPTS} tries");
    None
}

fn wait_for_calm() {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        let since = Instant::now();
        thread::sleep(CALM);
        if longest_since(since) == Duration::ZERO {
            break;
        }
    }
}

fn longest_since(start: Instant) -> Duration {
    let stalls = stalls();
    let since = stalls.iter().filter(|stall| stall.end >= start);
    since.map(|stall| stall.length).max().unwrap_or_default()
}

fn stalls() -> MutexGuard<'static, VecDeque<Stall>> {
    STALLS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a witness on each core this process may use.
fn watch_every_core() {
    let usable = sched_getaffinity(Pid::from_raw(0)).unwrap_or_else(|_| CpuSet::new());
    let cores = (0..CpuSet::count()).filter(|core| usable.is_set(*core).unwrap_or(false));
    cores.for_each(|core| drop(thread::spawn(move || watch(core))));
}

fn watch(core: usize) {
    let mut own = CpuSet::new();
    let _ = own.set(core).and_then(|()| sched_setaffinity(Pid::from_raw(0), &own));
    // Without the privilege it notes its own waiting as well: then more is excused, nothing less.
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    if let Ok(value) = ThreadPriorityValue::try_from(PRIORITY) {
        let _ =
            set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), fifo);
    }
    let mut last = Instant::now();
    loop {
        thread::sleep(LOOK);
        let end = Instant::now();
        let length = end.duration_since(last).saturating_sub(LOOK);
        if length >= NOTED {
            let mut stalls = stalls();
            stalls.push_back(Stall { end, length });
            if stalls.len() > KEPT {
                stalls.pop_front();
            }
        }
        last = end;
    }
}

#[test]
fn a_failure_on_a_calm_host_is_not_excused() {
    let mut tries = 0;
    let start = Instant::now();
    let outcome = panic::catch_unwind(AssertUnwindSafe(|| {
        judged("a calm round", || {
            tries += 1;
            // Nothing is waited for: the host has hardly the time to stand still.
            assert!(tries > 1, "as it should");
        })
    }));
    let excused = longest_since(start) > BORNE;
    assert!(outcome.is_err() | excused, "a failure was tried again without a stall");
}
