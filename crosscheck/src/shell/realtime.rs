//! Scheduling, memory and time of the cycle.

use nix::sched::{CpuSet, sched_setaffinity};
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};
use nix::unistd::Pid;

use super::options::Options;

/// Stack touched in advance, octets: more than the deepest call of the cycle.
const STACK: usize = 256 * 1024;

/// Makes the calling thread as predictable as the machine permits. What is missing is said
/// once, together; the process runs all the same.
pub fn prepare(options: &Options) {
    let mut missing = Vec::new();
    if let Err(error) = mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE) {
        missing.push(format!("locked memory ({error})"));
    }
    prefault_stack();
    if let Some(cpu) = options.cpu {
        let pinned = CpuSet::new().and_then_set(cpu);
        if let Err(error) = pinned {
            missing.push(format!("core {cpu} ({error})"));
        }
    }
    if let Some(priority) = options.priority
        && let Err(error) = set_fifo(priority)
    {
        missing.push(format!("SCHED_FIFO priority {priority} ({error})"));
    }
    if !missing.is_empty() {
        tracing::warn!("running without {}", missing.join(", "));
    }
}

/// Pinning, as one step that can fail.
trait Pin {
    fn and_then_set(self, cpu: usize) -> nix::Result<()>;
}

impl Pin for CpuSet {
    fn and_then_set(mut self, cpu: usize) -> nix::Result<()> {
        self.set(cpu)?;
        sched_setaffinity(Pid::from_raw(0), &self)
    }
}

fn set_fifo(priority: i32) -> std::io::Result<()> {
    let parameter = libc::sched_param { sched_priority: priority };
    // SAFETY: 0 is the calling thread; the parameter lives for the call.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) };
    if result == 0 { Ok(()) } else { Err(std::io::Error::last_os_error()) }
}

#[inline(never)]
#[allow(clippy::large_stack_arrays, reason = "the stack is what it is about")]
fn prefault_stack() {
    let mut stack = [0_u8; STACK];
    for page in stack.chunks_mut(4096) {
        if let Some(octet) = page.first_mut() {
            *octet = 1;
        }
    }
    std::hint::black_box(&stack);
}

/// CLOCK_MONOTONIC, ns. No system call: the kernel maps the clock into the process.
pub fn now_ns() -> u64 {
    // Cannot fail for this clock; 0 would be a clock that goes backwards, which the core sees.
    clock_gettime(ClockId::CLOCK_MONOTONIC)
        .map_or(0, |time| time.tv_sec() as u64 * 1_000_000_000 + time.tv_nsec() as u64)
}

/// Sleeps until `deadline_ns` of CLOCK_MONOTONIC.
pub fn sleep_until(deadline_ns: u64) {
    let (seconds, rest) = (deadline_ns / 1_000_000_000, deadline_ns % 1_000_000_000);
    let deadline = TimeSpec::new(seconds as i64, rest as i64);
    // Interrupted or refused: the cycle simply begins earlier, and its overrun count is judged.
    let _ = clock_nanosleep(ClockId::CLOCK_MONOTONIC, ClockNanosleepFlags::TIMER_ABSTIME, &deadline);
}
