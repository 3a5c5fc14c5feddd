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
}

impl Deadlines {
    /// The first one after `now_ns`.
    pub fn after(now_ns: u64, cycle_ns: u64, phase_ns: u64) -> Self {
        let start = now_ns - now_ns % cycle_ns;
        Self { cycle_ns, next_ns: start + cycle_ns + phase_ns, overruns: 0 }
    }

    /// The deadline to sleep for.
    pub const fn next(&self) -> u64 {
        self.next_ns
    }

    /// Overruns in a row.
    pub const fn overruns(&self) -> u8 {
        self.overruns
    }

    /// The cycle's work ended at `now_ns`: sets the next deadline, counts an overrun when it
    /// has passed already and skips what is lost.
    pub fn done(&mut self, now_ns: u64) {
        self.next_ns += self.cycle_ns;
        if now_ns <= self.next_ns {
            self.overruns = 0;
            return;
        }
        self.overruns = self.overruns.saturating_add(1);
        let lost = (now_ns - self.next_ns).div_ceil(self.cycle_ns);
        self.next_ns += lost * self.cycle_ns;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_lie_on_multiples_of_the_cycle_plus_the_phase() {
        let mut deadlines = Deadlines::after(10_400_000, 1_000_000, 200_000);
        assert_eq!(deadlines.next(), 11_200_000);
        deadlines.done(11_300_000);
        assert_eq!((deadlines.next(), deadlines.overruns()), (12_200_000, 0));
    }

    #[test]
    fn an_overrun_is_counted_and_the_lost_cycles_are_skipped() {
        let mut deadlines = Deadlines::after(0, 1_000_000, 0);
        deadlines.done(4_500_000);
        assert_eq!((deadlines.next(), deadlines.overruns()), (5_000_000, 1));
        deadlines.done(6_100_000);
        assert_eq!((deadlines.next(), deadlines.overruns()), (7_000_000, 2));
        deadlines.done(7_100_000);
        assert_eq!(deadlines.overruns(), 0);
    }
}
