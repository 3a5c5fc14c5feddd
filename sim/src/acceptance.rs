//! The acceptance run of `safepair params accept`: the real cores of A, B and crosscheck, a
//! simulated axis, virtual time.

use params::{
    AxisSet, Machine,
    acceptance::{
        Outcome,
        trial::{self, Seen, Trial},
    },
};

use crate::replay::{Line, ReplayOptions, code_text, replay};

/// Goes through one step and judges it.
///
/// # Errors
/// The step cannot be run at all.
pub fn run(axis: &AxisSet, trial: Trial) -> Result<Outcome, String> {
    let seen = drive(axis, &trial)?;
    let measured = trial.expectations.iter().map(|expectation| trial::judge(expectation, &seen)).collect();
    Ok(Outcome { trial, measured })
}

/// Everything that changed while the axis went through a step.
///
/// # Errors
/// The step cannot be run at all.
pub fn drive(axis: &AxisSet, trial: &Trial) -> Result<Vec<Seen>, String> {
    // A trace without a column `axis` is about axis 1.
    let alone = Machine { file: String::new(), axes: vec![AxisSet { number: 1, ..axis.clone() }] };
    let trace = crate::trace::parse(&trial.course.csv())
        .map_err(|error| format!("step {} made a wrong trace: {error}", trial.function))?;
    let mut seen = Vec::new();
    let options = ReplayOptions { outputs: true, ..ReplayOptions::default() };
    replay(&alone, &trace, options, |line| {
        seen.push(of(line));
        Ok(())
    })
    .map_err(|error| format!("step {}: {error}", trial.function))?;
    Ok(seen)
}

fn of(line: &Line<'_>) -> Seen {
    let view = line.view;
    let errors = view.errors.as_slice().iter().map(|code| {
        let mut text = String::new();
        code_text(&mut text, line.words.profile, code);
        text
    });
    Seen {
        t_ms: line.at_ns as f64 / 1e6,
        source: line.source.name(),
        status: view.status,
        outputs: view.outputs,
        torque: view.torque,
        errors: errors.collect(),
        rpm: f64::from(view.speed_mrpm) / 1_000.0,
        position: view.position,
    }
}
