//! Core, priority and memory of the thread that runs the cycle. What is not permitted is
//! said once and done without: the monitoring does not depend on it, its punctuality does.

use nix::sched::{CpuSet, sched_setaffinity};
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::unistd::Pid;

use super::options::Options;

/// Stack touched before the cycle, octets.
const PREFAULT: usize = 256 * 1024;

/// Prepares the calling thread.
pub fn prepare(options: &Options) {
    let missing: Vec<&str> =
        [lock_memory(), pin(options.cpu), raise(options.priority)].into_iter().flatten().collect();
    prefault();
    if !missing.is_empty() {
        tracing::warn!("channel B runs without real-time guarantees, missing: {}", missing.join(", "));
    }
}

fn lock_memory() -> Option<&'static str> {
    let flags = MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE;
    mlockall(flags).err().map(|_| "locked memory (CAP_IPC_LOCK)")
}

fn pin(cpu: Option<usize>) -> Option<&'static str> {
    let mut set = CpuSet::new();
    set.set(cpu?).err().map_or_else(
        || sched_setaffinity(Pid::from_raw(0), &set).err().map(|_| "the core asked for"),
        |_| Some("the core asked for"),
    )
}

fn raise(priority: Option<i32>) -> Option<&'static str> {
    let parameter = libc::sched_param { sched_priority: priority? };
    // SAFETY: the pointer is valid for the call; 0 is the calling thread.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) };
    (result != 0).then_some("the priority asked for (CAP_SYS_NICE)")
}

/// Touches the stack the cycle will use, so that no page fault happens in it.
#[inline(never)]
#[allow(clippy::large_stack_arrays, reason = "a large one is the purpose")]
fn prefault() {
    let mut stack = [0_u8; PREFAULT];
    for page in stack.chunks_mut(4_096) {
        if let Some(octet) = page.first_mut() {
            *octet = 1;
        }
    }
    std::hint::black_box(&stack);
}
