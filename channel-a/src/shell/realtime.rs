//! Scheduling, memory and clock. What the process may not have is said once; it runs all
//! the same, and `doctor` judges the machine.

use thread_priority::unix::{
    RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};
use thread_priority::{ThreadPriority, ThreadPriorityValue};

use super::options::Options;

/// Stack touched in advance, octets.
const STACK: usize = 256 * 1_024;
const SECOND_NS: u64 = 1_000_000_000;

/// Prepares this thread; what it could not have.
pub fn prepare(options: &Options) -> Vec<String> {
    let core = affinity(options.cpu);
    // Locking and touching take milliseconds: with the priority already raised they would
    // keep the partner from a core that both share.
    let memory = lock_memory();
    prefault();
    let steps = [core, memory, scheduling(options.priority)];
    steps.into_iter().flatten().collect()
}

fn affinity(cpu: Option<usize>) -> Option<String> {
    let cpu = cpu?;
    // SAFETY: an all-zero cpu_set_t is an empty set; the calls only touch it.
    let result = unsafe {
        let mut set: libc::cpu_set_t = core::mem::zeroed();
        libc::CPU_SET(cpu, &mut set);
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set)
    };
    let error = std::io::Error::last_os_error();
    (result != 0).then(|| format!("core {cpu}: {error}; runs on any core"))
}

fn scheduling(priority: Option<u8>) -> Option<String> {
    let priority = priority?;
    let value = ThreadPriorityValue::try_from(priority).ok()?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy)
        .err()
        .map(|error| format!("SCHED_FIFO {priority}: {error}; runs with normal scheduling"))
}

fn lock_memory() -> Option<String> {
    // SAFETY: changes how pages of this process are kept, nothing else.
    let result = unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) };
    let error = std::io::Error::last_os_error();
    (result != 0).then(|| format!("locked memory: {error}; page faults are possible"))
}

// The stack is what is to be touched.
#[allow(clippy::large_stack_arrays)]
#[inline(never)]
fn prefault() {
    let mut stack = [0_u8; STACK];
    for octet in stack.iter_mut().step_by(4_096) {
        *octet = 1;
    }
    core::hint::black_box(&stack);
}

/// CLOCK_MONOTONIC, ns.
pub fn now_ns() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the structure lives over the call; this clock always exists.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time) };
    time.tv_sec as u64 * SECOND_NS + time.tv_nsec as u64
}

/// Sleeps until an absolute time of CLOCK_MONOTONIC.
pub fn sleep_until(deadline_ns: u64) {
    let time = libc::timespec {
        tv_sec: (deadline_ns / SECOND_NS) as libc::time_t,
        tv_nsec: (deadline_ns % SECOND_NS) as libc::c_long,
    };
    // SAFETY: the structure lives over the call; no remainder is asked for.
    while unsafe {
        libc::clock_nanosleep(
            libc::CLOCK_MONOTONIC,
            libc::TIMER_ABSTIME,
            &raw const time,
            core::ptr::null_mut(),
        )
    } == libc::EINTR
    {}
}
