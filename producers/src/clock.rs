//! Absolute cycles on CLOCK_MONOTONIC, and the scheduling of the calling thread.

use nix::errno::Errno;
use nix::sched::{CpuSet, sched_setaffinity};
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};
use nix::unistd::Pid;

const SECOND_NS: u64 = 1_000_000_000;

/// CLOCK_MONOTONIC, ns.
pub fn now_ns() -> u64 {
    clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(0, |time| {
        (time.tv_sec() as u64).saturating_mul(SECOND_NS).saturating_add(time.tv_nsec() as u64)
    })
}

/// Sleeps until CLOCK_MONOTONIC reaches `deadline_ns`.
pub fn sleep_until(deadline_ns: u64) {
    let deadline = TimeSpec::new((deadline_ns / SECOND_NS) as i64, (deadline_ns % SECOND_NS) as i64);
    let absolute = ClockNanosleepFlags::TIMER_ABSTIME;
    while clock_nanosleep(ClockId::CLOCK_MONOTONIC, absolute, &deadline) == Err(Errno::EINTR) {}
}

/// Deadlines at `k * cycle + phase`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    cycle_ns: u64,
    next_ns: u64,
}

impl Cycle {
    /// The first boundary behind `now_ns`.
    pub const fn after(now_ns: u64, cycle_ns: u64, phase_ns: u64) -> Self {
        let passed = match now_ns.saturating_sub(phase_ns).checked_div(cycle_ns) {
            Some(passed) => passed,
            None => 0,
        };
        Self { cycle_ns, next_ns: (passed + 1) * cycle_ns + phase_ns }
    }

    /// Sleeps until the next boundary; how many have passed, and the newest of them.
    pub fn wait(&mut self) -> (u64, u64) {
        sleep_until(self.next_ns);
        self.passed(now_ns())
    }

    /// Boundaries up to `now_ns`, at least one; missed ones are counted, not made up for.
    pub fn passed(&mut self, now_ns: u64) -> (u64, u64) {
        let more = now_ns.saturating_sub(self.next_ns).checked_div(self.cycle_ns).unwrap_or(0);
        let newest = self.next_ns + more * self.cycle_ns;
        self.next_ns = newest + self.cycle_ns;
        (1 + more, newest)
    }
}

/// Core, SCHED_FIFO priority and locked memory for this thread; what it could not have.
pub fn prepare(cpu: Option<usize>, priority: Option<i32>) -> Vec<String> {
    // Memory first: it is long work, and at a real-time priority it would hold up the monitors.
    let locked = mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE).err();
    let memory = locked.map(|error| format!("locked memory: {error}; page faults are possible"));
    let affinity = cpu.and_then(|cpu| {
        let mut set = CpuSet::new();
        let result = set.set(cpu).and_then(|()| sched_setaffinity(Pid::from_raw(0), &set));
        result.err().map(|error| format!("core {cpu}: {error}; runs on any core"))
    });
    let scheduling = priority.and_then(|priority| {
        let parameter = libc::sched_param { sched_priority: priority };
        // SAFETY: the parameter lives over the call, 0 is the calling thread.
        let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) };
        let error = Errno::result(result).err();
        error.map(|error| format!("SCHED_FIFO {priority}: {error}; runs with normal scheduling"))
    });
    [affinity, scheduling, memory].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boundaries_are_multiples_of_the_cycle_plus_the_phase_and_missed_ones_are_counted() {
        let mut cycle = Cycle::after(10_400, 1_000, 200);
        assert_eq!(cycle.passed(11_210), (1, 11_200));
        assert_eq!(cycle.passed(15_300), (4, 15_200), "12, 13, 14 and 15 are one wake-up");
        assert_eq!(cycle.passed(16_000), (1, 16_200), "and the next is on time");
    }
}
