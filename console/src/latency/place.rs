//! Core and priority of a measuring thread.

use nix::sched::{CpuSet, sched_setaffinity};
use nix::unistd::Pid;
use thread_priority::unix::{RealtimeThreadSchedulePolicy, ThreadSchedulePolicy};
use thread_priority::{
    ThreadPriority, ThreadPriorityValue, set_thread_priority_and_policy, thread_native_id,
};

/// Where a thread runs.
#[derive(Debug, Clone, Copy)]
pub struct Seat {
    /// Core; `None`: any.
    pub core: Option<u32>,
    /// SCHED_FIFO priority; 0: none.
    pub priority: u8,
}

/// Gives the calling thread its seat, as far as it may have it: as the monitors do.
pub fn take(seat: Seat) {
    if let Some(core) = seat.core {
        let mut cores = CpuSet::new();
        if cores.set(core as usize).is_ok() {
            let _ = sched_setaffinity(Pid::from_raw(0), &cores);
        }
    }
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    if let (true, Ok(priority)) = (seat.priority > 0, ThreadPriorityValue::try_from(seat.priority)) {
        let _ =
            set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), fifo);
    }
}
