//! The acceptance run of an axis, step by step.

use std::{fmt::Write as _, fs, path::Path};

use params::{
    AxisSet,
    acceptance::{
        Outcome,
        trial::{self, Trial},
    },
};
use sim::acceptance;

/// A step longer than this in virtual time is announced: it takes seconds, ms.
const LONG_MS: f64 = 600_000.0;

/// Runs every step of an axis.
pub fn run(axis: &AxisSet, traces: Option<&Path>) -> Result<Vec<Outcome>, String> {
    if let Some(folder) = traces {
        fs::create_dir_all(folder)
            .map_err(|error| format!("{}: {error}; expected a folder", folder.display()))?;
    }
    let trials = trial::trials(axis);
    let run = |(at, trial): (usize, Trial)| {
        if let Some(folder) = traces {
            let name = format!("axis-{}-{at:02}-{}.csv", axis.number, trial.function.replace(' ', "-"));
            let path = folder.join(name);
            fs::write(&path, trial.course.csv()).map_err(|error| {
                format!("{}: {error}; expected a file that can be created", path.display())
            })?;
        }
        if trial.course.end_ms() > LONG_MS {
            eprintln!("axis {}: {}: {}, in virtual time", axis.number, trial.function, trial.action);
        }
        acceptance::run(axis, trial)
    };
    (1..).zip(trials).map(run).collect()
}

/// A step on the terminal: one line, and what fell short below it.
pub fn line(axis: u8, step: &Outcome) -> String {
    let verdict = if step.passed() == Some(true) { "passed    " } else { "FELL SHORT" };
    let mut text = format!("{verdict} axis {axis} {:<8} {}\n", step.trial.function, step.trial.action);
    for (expectation, measured) in step.trial.expectations.iter().zip(&step.measured) {
        if !measured.right {
            let when = measured.t_ms.map_or(String::new(), |ms| format!("{ms:.0} ms, "));
            let _ = writeln!(
                text,
                "             expected {} ({}), measured {when}{}",
                expectation.what,
                expectation.when(),
                measured.text
            );
        }
    }
    text
}
