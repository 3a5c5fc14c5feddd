//! The loop: sleep, step, drive. No allocation, no lock, no log in it; the sleep and the
//! line are its only calls to the system.

use std::io::Write;
use std::os::fd::OwnedFd;

use shm_schema::inhibit::Inhibit;

use super::Trouble;
use super::cells::Axes;
use super::clock::{Deadlines, common, own, sleep_until};
use super::ending::Ending;
use super::line::Line;
use super::options::Options;

/// Runs until the ending has come; then every path is off.
pub fn run(
    options: &Options,
    axes: &mut Axes,
    mut line: Line,
    ending: &Ending,
    ready: Option<OwnedFd>,
) -> Result<(), Trouble> {
    tell(ready)?;
    let mut deadlines = Deadlines::after(common(), options.cycle_ns, options.phase_ns);
    while !ending.has_come() {
        sleep_until(deadlines.next());
        let overruns = deadlines.woken(common());
        for axis in &mut axes.axes {
            let inhibit = axis.step(overruns, own(), common());
            line.drive(&inhibit);
        }
        deadlines.done(common());
    }
    line.drive(&Inhibit::default());
    for axis in &mut axes.axes {
        axis.withdraw(common());
    }
    Ok(())
}

/// Everything is open and the cycle starts; the pipe is closed behind it.
fn tell(ready: Option<OwnedFd>) -> Result<(), Trouble> {
    let Some(ready) = ready else { return Ok(()) };
    std::fs::File::from(ready).write_all(b"R").map_err(|error| Trouble::new("--ready-fd", error))
}
