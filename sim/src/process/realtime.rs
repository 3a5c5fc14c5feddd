//! Scheduling, memory and clock of the simulated producer.

use nix::errno::Errno;
use nix::sched::{CpuSet, sched_setaffinity};
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};
use nix::unistd::Pid;

use super::options::Options;

const SECOND_NS: u64 = 1_000_000_000;

/// Prepares this thread; what it could not have, a line each. It runs all the same.
pub fn prepare(options: &Options) -> Vec<String> {
    let affinity = options.cpu.and_then(|cpu| {
        let result = set_affinity(cpu).err();
        result.map(|error| format!("core {cpu}: {error}; runs on any core"))
    });
    let scheduling = options.priority.and_then(|priority| {
        let result = set_priority(priority).err();
        result.map(|error| format!("SCHED_FIFO {priority}: {error}; runs with normal scheduling"))
    });
    let locked = mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE).err();
    let memory = locked.map(|error| format!("locked memory: {error}; page faults are possible"));
    [affinity, scheduling, memory].into_iter().flatten().collect()
}

fn set_affinity(cpu: usize) -> Result<(), Errno> {
    let mut set = CpuSet::new();
    set.set(cpu)?;
    sched_setaffinity(Pid::from_raw(0), &set)
}

fn set_priority(priority: i32) -> Result<(), Errno> {
    let parameter = libc::sched_param { sched_priority: priority };
    // SAFETY: the parameter lives over the call, 0 is the calling thread.
    Errno::result(unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) }).map(drop)
}

/// CLOCK_MONOTONIC, ns.
fn now_ns() -> u64 {
    clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(0, |time| {
        (time.tv_sec() as u64).saturating_mul(SECOND_NS).saturating_add(time.tv_nsec() as u64)
    })
}

/// Absolute deadlines at `k * cycle + phase` on CLOCK_MONOTONIC.
#[derive(Debug)]
pub struct Periodic {
    cycle_ns: u64,
    next_ns: u64,
}

impl Periodic {
    /// Starts with the next boundary.
    pub fn new(cycle_ns: u64, phase_ns: u64) -> Self {
        let boundary = (now_ns() / cycle_ns + 1) * cycle_ns;
        Self { cycle_ns, next_ns: boundary + phase_ns }
    }

    /// Sleeps until the next boundary; returns how many cycles have passed, and the boundary
    /// that was reached: the instant at which real hardware would have latched its signals,
    /// however late this process is. Boundaries missed are skipped, not made up for.
    pub fn wait(&mut self) -> (u64, u64) {
        let seconds = (self.next_ns / SECOND_NS) as i64;
        let deadline = TimeSpec::new(seconds, (self.next_ns % SECOND_NS) as i64);
        let absolute = ClockNanosleepFlags::TIMER_ABSTIME;
        while clock_nanosleep(ClockId::CLOCK_MONOTONIC, absolute, &deadline) == Err(Errno::EINTR) {}
        let cycles = self.passed(now_ns());
        (cycles, self.next_ns - self.cycle_ns)
    }

    /// Boundaries up to `now_ns`, at least one; the next is the first one behind it.
    fn passed(&mut self, now_ns: u64) -> u64 {
        let cycles = 1 + now_ns.saturating_sub(self.next_ns) / self.cycle_ns;
        self.next_ns += cycles * self.cycle_ns;
        cycles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missed_boundaries_are_skipped_and_counted() {
        let mut clock = Periodic { cycle_ns: 1_000, next_ns: 10_000 };
        assert_eq!(clock.passed(10_050), 1);
        assert_eq!(clock.passed(14_300), 4, "11, 12, 13 and 14 are one wake-up");
        assert_eq!(clock.passed(15_000), 1, "and the one after is on time");
        assert_eq!(clock.next_ns, 16_000);
    }
}
