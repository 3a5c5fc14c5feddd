//! The acceptance run: the real cores of A, B and crosscheck, a simulated axis, virtual time.

use std::{fmt::Write as _, fs, path::Path};

use params::{
    AxisSet, Machine,
    acceptance::{
        Outcome,
        trial::{self, Seen, Trial},
    },
};
use sim::replay::{Line, ReplayOptions, code_text, replay};

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
        let seen = drive(axis, &trial)?;
        let measured =
            trial.expectations.iter().map(|expectation| trial::judge(expectation, &seen)).collect();
        Ok(Outcome { trial, measured })
    };
    (1..).zip(trials).map(run).collect()
}

/// Everything that changed while the axis went through a step.
fn drive(axis: &AxisSet, trial: &Trial) -> Result<Vec<Seen>, String> {
    // A trace without a column `axis` is about axis 1.
    let alone = Machine { file: String::new(), axes: vec![AxisSet { number: 1, ..axis.clone() }] };
    let trace = sim::trace::parse(&trial.course.csv())
        .map_err(|error| format!("step {} made a wrong trace: {error}", trial.function))?;
    let mut seen = Vec::new();
    replay(&alone, &trace, ReplayOptions::default(), |line| {
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
    let octet = |at: u8| u64::from(view.status.octet(at)) << (8 * u32::from(at));
    Seen {
        t_ms: line.at_ns as f64 / 1e6,
        source: line.source.name(),
        status: (0..8).map(octet).sum(),
        torque: view.torque,
        errors: errors.collect(),
        rpm: f64::from(view.speed_mrpm) / 1_000.0,
        position: view.position,
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn fallen(text: &str) -> (usize, Vec<String>) {
        let machine = params::parse(text, "set.toml").unwrap_or_else(|all| panic!("{all:#?}"));
        let report = params::check(text, "set.toml");
        assert!(report.passed(), "{:#?}", report.findings);
        let steps: Vec<_> = machine.axes.iter().flat_map(|axis| run(axis, None).expect("runs")).collect();
        let short = steps.iter().filter(|step| step.passed() != Some(true)).map(|step| line(1, step));
        (steps.len(), short.collect())
    }

    /// AMK-VAL-03: every function of the set is proved on its own limits.
    #[test]
    fn every_step_of_an_amk_set_passes() {
        let (steps, short) = fallen(
            "profile = \"amk-kw\"\n[parameters]\nPrm67 = 3000\nPrm2 = 400\nPrm3 = 320\nPrm18 = 50\nPrm20 = 800\nPrm21 = 20\nPrm25 = 900\nPrm26 = 10\nPrm28 = 5\nPrm33 = 900\nPrm34 = 300\nPrm57 = 500\nPrm58 = 1\nPrm62 = 1200\nPrm64 = 10\nPrm65 = 30000\nPrm66 = -30000\n",
        );
        assert!(steps >= 20, "{steps}");
        assert!(short.is_empty(), "{}", short.concat());
    }

    #[test]
    fn every_step_of_a_lenze_set_passes() {
        let (steps, short) = fallen(
            "profile = \"lenze-sm301\"\n[parameters]\nC15111 = 5\nC15205 = 1\nC15305 = 600\nC15310 = 20\nC15311 = 400\nC15320 = 3000\n\"C15330/1\" = 500\n\"C15331/1\" = 400\n\"C15330/2\" = 1500\n\"C15332/2\" = 1\n",
        );
        assert!(steps >= 10, "{steps}");
        assert!(short.is_empty(), "{}", short.concat());
    }

    #[test]
    fn every_step_of_an_atv_set_passes() {
        let (steps, short) = fallen(
            "profile = \"atv340\"\n[parameters]\nSC01 = \"Asynchronous Motor\"\nSC02 = 2\nSC05 = \"SinCos embedded\"\nSC06 = 1024\nSC68 = 7\nSC65 = \"Safety function used via fieldbus\"\nSC31 = 50.0\nSC32 = 3.0\nSC33 = 1.0\nSC34 = 100\nSC66 = \"Safety function used via fieldbus\"\nSC39 = \"SLS Type 4\"\nSC40 = 60.0\nSC50 = 10.0\nSC48 = 12.0\nSC56 = \"1 threshold\"\nSC57 = 40.0\nSC58 = 40.0\n",
        );
        assert!(steps >= 7, "{steps}");
        assert!(short.is_empty(), "{}", short.concat());
    }

    #[test]
    fn every_step_of_a_generic_set_passes() {
        let (steps, short) = fallen(
            "profile = \"etg-6100-2\"\n[parameters]\nSS1_1.time_to_sto = 500\nSLS_1.velocity_limit = 400\nSLS_2.velocity_limit = 700\nSLS_2.time_to_velocity_monitoring = 200\nSLS_2.error_reaction = \"SS1_1\"\nSSR_1.velocity_upper_limit = 600\nSSR_1.velocity_lower_limit = 200\nSOS_1.position_zero_window = 500\nSMS.velocity_maximum_positive = 1500\nSMS.velocity_maximum_negative = 1500\nSDI.position_zero_window = 300\nSLI_1.position_relative_upper_limit = 5000\nSLI_1.position_relative_lower_limit = 5000\n",
        );
        assert!(steps >= 10, "{steps}");
        assert!(short.is_empty(), "{}", short.concat());
    }

    /// A new file is safe on purpose, and its steps pass as they are.
    #[test]
    fn the_delivery_state_passes_its_own_steps() {
        for profile in ["amk-kw", "atv340", "etg-6100-2"] {
            let (steps, short) = fallen(&format!("profile = \"{profile}\"\n"));
            assert!(steps >= 1, "{profile}");
            assert!(short.is_empty(), "{profile}: {}", short.concat());
        }
        let (_, short) = fallen("profile = \"lenze-sm301\"\n[parameters]\nC15205 = 1\n");
        assert!(short.is_empty(), "{}", short.concat());
    }

    /// A run that cannot fall short would prove nothing.
    #[test]
    fn a_limit_that_is_not_the_one_expected_falls_short() {
        let text = |limit: u32| {
            format!(
                "profile = \"amk-kw\"\n[parameters]\nPrm67 = 3000\nPrm2 = 400\nPrm3 = 320\nPrm57 = {limit}\n"
            )
        };
        let set = |limit| params::parse(&text(limit), "x").expect("right").axes.remove(0);
        let expected =
            trial::trials(&set(500)).into_iter().find(|trial| trial.function == "SLS1").expect("a step");
        let judged = |axis: &AxisSet| {
            let seen = drive(axis, &expected).expect("runs");
            expected.expectations.iter().all(|expectation| trial::judge(expectation, &seen).right)
        };
        assert!(judged(&set(500)));
        assert!(!judged(&set(501)));
        assert!(!judged(&set(499)));
    }
}
