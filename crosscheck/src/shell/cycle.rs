//! The cycle: wake, read, step, publish. No allocation, lock, log or system call but the sleep.

use std::fs::File;
use std::io::Write;
use std::os::fd::FromRawFd;

use crosscheck::logbook::Moment;
use crosscheck::logbook::ring::Feeder;
use shm_schema::agreement::Agreement;

use super::cells::Axes;
use super::ending::Ending;
use super::options::Options;
use super::realtime::{now_ns, sleep_until};

/// The raster of the wake-ups: `k * cycle + phase` on CLOCK_MONOTONIC.
#[derive(Debug, Clone, Copy)]
pub struct Raster {
    cycle_ns: u64,
    next_ns: u64,
    overruns: u8,
}

impl Raster {
    /// The first wake-up lies behind `now_ns`.
    pub fn new(cycle_ns: u64, phase_ns: u64, now_ns: u64) -> Self {
        let cycle_ns = cycle_ns.max(1);
        let next_ns = (now_ns / cycle_ns + 1) * cycle_ns + phase_ns;
        Self { cycle_ns, next_ns, overruns: 0 }
    }

    /// The next wake-up, ns.
    pub fn next_ns(&self) -> u64 {
        self.next_ns
    }

    /// Awake at `now_ns`: wake-ups that were missed count, one in time ends their row.
    pub fn wake(&mut self, now_ns: u64) -> u8 {
        let late_ns = now_ns.saturating_sub(self.next_ns);
        let missed = late_ns / self.cycle_ns;
        self.overruns = if missed == 0 {
            0
        } else {
            self.overruns.saturating_add(u8::try_from(missed).unwrap_or(u8::MAX))
        };
        self.next_ns += (missed + 1) * self.cycle_ns;
        self.overruns
    }
}

/// Runs until the end has come; the last word on every axis is: no torque.
pub fn run(options: &Options, mut all: Axes, mut feeder: Option<Feeder>, ending: &Ending) {
    let mut raster = Raster::new(options.cycle_ns(), options.phase_ns(), now_ns());
    announce(options.ready_fd);
    while !ending.has_come() {
        sleep_until(raster.next_ns());
        let overruns = raster.wake(now_ns());
        for axis in &mut all.each {
            let inputs = axis.read(overruns);
            let step_ns = now_ns();
            let outputs = axis.core.step(&inputs, step_ns);
            axis.write(&outputs.agreement, &outputs.drive, now_ns());
            if let Some(feeder) = &mut feeder {
                feeder.push(&Moment::new(axis.number, step_ns, axis.core.compared_reports(), &outputs));
            }
        }
    }
    for axis in &mut all.each {
        axis.write(&Agreement::default(), &crosscheck::DRIVE_SAFE, now_ns());
    }
}

/// Tells the supervisor that the cycle starts.
fn announce(ready_fd: Option<i32>) {
    let Some(descriptor) = ready_fd else { return };
    // SAFETY: the descriptor was handed over for this one message; nobody else here owns it.
    let mut pipe = unsafe { File::from_raw_fd(descriptor) };
    if pipe.write_all(b"R").is_err() {
        tracing::warn!("nobody listens at --ready-fd");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wake_ups_lie_on_the_raster_of_the_cycle() {
        let mut raster = Raster::new(1_000, 300, 5_500);
        assert_eq!(raster.next_ns(), 6_300);
        assert_eq!(raster.wake(6_310), 0);
        assert_eq!(raster.next_ns(), 7_300);
    }

    /// Design 3.6: every overrun counts, and only a wake-up in time ends the row.
    #[test]
    fn missed_wake_ups_count_in_a_row() {
        let mut raster = Raster::new(1_000, 0, 0);
        assert_eq!(raster.wake(1_999), 0);
        assert_eq!(raster.wake(3_000), 1);
        assert_eq!(raster.next_ns(), 4_000);
        assert_eq!(raster.wake(6_500), 3);
        assert_eq!(raster.wake(7_001), 0);
        assert_eq!(raster.wake(u64::MAX / 2), u8::MAX);
    }
}
