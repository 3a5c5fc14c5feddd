//! The jobs of the rig, inside the guest: `rig-guest JOB CHIP DEVICE`.
//!
//! Real processes on a real-time kernel with a real GPIO chip (gpio-sim). Everything here is
//! outside the set: it pulls the inputs, probes the outputs, and judges.

mod chip;
mod deadline;
mod inputs;
mod machine;
mod paths;
mod set;
mod verdict;
mod wakeup;
mod watchdog;

use std::process::ExitCode;

use chip::Chip;
use verdict::Verdict;

type Job = fn(&Chip, &mut Verdict) -> Result<(), String>;

const JOBS: [(&str, Job); 5] = [
    ("paths", paths::run),
    ("inputs", inputs::run),
    ("deadline", deadline::run),
    ("wakeup", wakeup::run),
    ("watchdog", watchdog::run),
];

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [job, name, device] = words.as_slice() else {
        println!("FAIL expected a job, a chip and its device, got {words:?}");
        return ExitCode::from(2);
    };
    let Some((_, run)) = JOBS.iter().find(|(known, _)| known == job) else {
        println!("FAIL {job}: no such job");
        return ExitCode::from(2);
    };
    let mut verdict = Verdict::default();
    if let Err(line) = run(&Chip::new(name, device), &mut verdict) {
        verdict.check(false, line);
    }
    if verdict.passed() { ExitCode::SUCCESS } else { ExitCode::from(1) }
}

/// Runs `act` above everything but the machine: what is measured must not be late. Everything
/// else the judge does at normal priority, like a supervisor: to fork is long work, and would
/// take the processor from the monitors.
fn promptly<T>(act: impl FnOnce() -> T) -> T {
    schedule(libc::SCHED_FIFO, 84);
    let result = act();
    schedule(libc::SCHED_OTHER, 0);
    result
}

fn schedule(policy: libc::c_int, sched_priority: libc::c_int) {
    let parameter = libc::sched_param { sched_priority };
    // SAFETY: the parameter lives over the call, 0 is the calling thread.
    if unsafe { libc::sched_setscheduler(0, policy, &raw const parameter) } != 0 {
        Verdict::note("the judge cannot change its scheduling");
    }
}
