//! Two clocks and the sleep.
//!
//! Cells are stamped with CLOCK_MONOTONIC, as everybody's. The core judges time by
//! CLOCK_MONOTONIC_RAW, which nobody slews: that is the second clock of DEC-26.

use std::mem::MaybeUninit;

fn read(clock: libc::clockid_t) -> u64 {
    let mut time = MaybeUninit::<libc::timespec>::uninit();
    // SAFETY: the pointer is valid for one timespec; both clocks exist on every Linux we
    // support, and the call cannot fail for them.
    let time = unsafe {
        libc::clock_gettime(clock, time.as_mut_ptr());
        time.assume_init()
    };
    (time.tv_sec as u64).wrapping_mul(1_000_000_000).wrapping_add(time.tv_nsec as u64)
}

/// CLOCK_MONOTONIC, ns: the stamp of cells and the base of the deadlines.
pub fn common() -> u64 {
    read(libc::CLOCK_MONOTONIC)
}

/// CLOCK_MONOTONIC_RAW, ns: channel B's own clock.
pub fn own() -> u64 {
    read(libc::CLOCK_MONOTONIC_RAW)
}

/// Sleeps until CLOCK_MONOTONIC reaches `deadline_ns`. A signal ends it early; the caller
/// looks at the clock anyway.
pub fn sleep_until(deadline_ns: u64) {
    let deadline = libc::timespec {
        tv_sec: (deadline_ns / 1_000_000_000) as libc::time_t,
        tv_nsec: (deadline_ns % 1_000_000_000) as libc::c_long,
    };
    // SAFETY: the pointer is valid, no remainder is asked for.
    unsafe {
        libc::clock_nanosleep(
            libc::CLOCK_MONOTONIC,
            libc::TIMER_ABSTIME,
            &raw const deadline,
            std::ptr::null_mut(),
        );
    }
}

/// Absolute deadlines: multiples of the cycle plus a phase.
#[derive(Debug, Clone, Copy)]
pub struct Deadlines {
    cycle_ns: u64,
    next_ns: u64,
    overruns: u8,
    late: bool,
}

impl Deadlines {
    /// The first one after `now_ns`.
    pub fn after(now_ns: u64, cycle_ns: u64, phase_ns: u64) -> Self {
        let start = now_ns - now_ns % cycle_ns;
        Self { cycle_ns, next_ns: start + cycle_ns + phase_ns, overruns: 0, late: false }
    }

    /// The deadline to sleep for.
    pub const fn next(&self) -> u64 {
        self.next_ns
    }

    /// The sleep ended at `now_ns`: the overruns in a row, those of the stall it comes out of
    /// among them, before anything is driven.
    pub fn woken(&mut self, now_ns: u64) -> u8 {
        let lost = now_ns.saturating_sub(self.next_ns) / self.cycle_ns;
        self.lose(lost);
        self.overruns
    }

    /// The cycle's work ended at `now_ns`: sets the next deadline, counts and skips those that have
    /// passed already. Only a cycle in time ends the row.
    pub fn done(&mut self, now_ns: u64) {
        self.next_ns += self.cycle_ns;
        self.lose(now_ns.saturating_sub(self.next_ns).div_ceil(self.cycle_ns));
        if !self.late {
            self.overruns = 0;
        }
        self.late = false;
    }

    fn lose(&mut self, cycles: u64) {
        self.next_ns += cycles * self.cycle_ns;
        self.overruns = self.overruns.saturating_add(cycles.try_into().unwrap_or(u8::MAX));
        self.late |= cycles > 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_lie_on_multiples_of_the_cycle_plus_the_phase() {
        let mut deadlines = Deadlines::after(10_400_000, 1_000_000, 200_000);
        assert_eq!(deadlines.next(), 11_200_000);
        assert_eq!(deadlines.woken(11_250_000), 0);
        deadlines.done(11_300_000);
        assert_eq!(deadlines.next(), 12_200_000);
    }

    #[test]
    fn every_deadline_that_work_outlasts_is_an_overrun_and_skipped() {
        let mut deadlines = Deadlines::after(0, 1_000_000, 0);
        assert_eq!(deadlines.woken(1_000_100), 0);
        deadlines.done(4_500_000);
        assert_eq!((deadlines.next(), deadlines.woken(5_000_100)), (5_000_000, 3));
        deadlines.done(5_100_000);
        assert_eq!(deadlines.woken(6_000_100), 0);
    }

    #[test]
    fn a_step_knows_of_the_stall_it_comes_out_of() {
        // Design 3.6: nothing is driven before the overruns count.
        let mut deadlines = Deadlines::after(0, 1_000_000, 0);
        assert_eq!(deadlines.woken(7_300_000), 6);
        deadlines.done(7_400_000);
        assert_eq!((deadlines.next(), deadlines.woken(8_000_100)), (8_000_000, 6));
        deadlines.done(8_100_000);
        assert_eq!(deadlines.woken(9_000_100), 0, "a cycle in time has ended the row");
    }
}
