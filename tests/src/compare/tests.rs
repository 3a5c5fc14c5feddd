//! The harness judged by subjects that are right, and by one that is not.

use super::*;
use crate::model::ModelOutput;

const MODELLED: [Profile; 3] = [Profile::AmkKw, Profile::Etg61002, Profile::Atv340];

fn model_of(scenario: &Scenario) -> Box<dyn Subject> {
    Box::new(Model::new(scenario.profile, &scenario.parameters))
}

#[test]
fn the_model_agrees_with_itself() {
    for profile in MODELLED {
        assert!(compare(profile, 0..20, &model_of).is_ok());
    }
}

#[test]
fn scenarios_repeat_from_their_seed_and_reach_stops_errors_and_their_end() {
    for profile in MODELLED {
        let mut seen = [0; 3];
        for seed in 0..40 {
            let scenario = generate::scenario(profile, seed);
            assert_eq!(scenario, generate::scenario(profile, seed));
            let mut model = Model::new(profile, &scenario.parameters);
            let outputs: Vec<ModelOutput> = scenario.inputs().iter().map(|input| model.step(input)).collect();
            let any = |condition: &dyn Fn(&View) -> bool| {
                outputs.iter().any(|output| condition(&output.crosscheck))
            };
            seen[0] += usize::from(any(&|view| !view.torque));
            seen[1] += usize::from(any(&|view| !view.errors.is_empty()));
            let ends_well =
                outputs.windows(2).any(|pair| !pair[0].crosscheck.torque && pair[1].crosscheck.torque);
            seen[2] += usize::from(ends_well);
        }
        assert!(seen.iter().all(|count| *count >= 4), "{}: {seen:?}", profile.name());
    }
}

/// A subject that takes back torque one cycle late.
struct Late(Model, Option<ModelOutput>);

impl Subject for Late {
    fn step(&mut self, input: &ModelInput) -> ModelOutput {
        let now = self.0.step(input);
        self.1.replace(now.clone()).unwrap_or(now)
    }
}

#[test]
fn a_cycle_too_late_is_found_and_made_small() {
    let late = |scenario: &Scenario| -> Box<dyn Subject> {
        Box::new(Late(Model::new(scenario.profile, &scenario.parameters), None))
    };
    let failure = compare(Profile::AmkKw, 0..10, &late).expect_err("is late");
    assert!(failure.scenario.rows.len() <= 3, "{}", failure.scenario.csv());
    assert_eq!(failure.parting.at, failure.scenario.last);
    assert!(failure.scenario.csv().starts_with("t_ms,speed_rpm,command"));
}

#[test]
fn the_position_is_the_exact_integral() {
    let row = |at, speed: i64| scenario::Row { at, speed_mrpm: Some(speed), ..scenario::Row::default() };
    let scenario = Scenario {
        profile: Profile::AmkKw,
        parameters: std::collections::BTreeMap::new(),
        rows: vec![row(0, 0), row(1000, 60_000), row(2000, 60_000)],
        last: 3000,
        origin: 0,
    };
    let inputs = scenario.inputs();
    // 60 rpm are one revolution per second; the run-up covers half of one.
    assert_eq!(inputs[1000].position, 32_768);
    assert_eq!(inputs[3000].position, 32_768 + 2 * 65_536);
    assert_eq!(inputs[500].position, 8_192);
    assert_eq!(inputs[500].speed_mrpm, 30_000);
}
