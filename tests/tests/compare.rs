//! The real cores against the reference model (design 12), on the machine of the simulator.
//!
//! A failing seed is made small and written to the temporary folder as a trace and a
//! parameter file, for `safepair replay`. More seeds, in release:
//! `SAFEPAIR_SEEDS=100000 cargo test --release -p system-tests --test compare -- --ignored long_`.

use shm_schema::exchange::{Motion, Start};
use shm_schema::profile::Profile;
use sim::machine::{Axis, Cores, Lines, Options, Stimulus, View as Seen, Wiring};
use std::fmt::Write as _;

use system_tests::compare::scenario::Scenario;
use system_tests::compare::{Failure, Subject, compare_seed, generate, part};
use system_tests::model::{Model, ModelInput, ModelOutput, View};

type Machine = Axis<channel_a::Monitor, channel_b::Monitor, crosscheck::Crosscheck>;

/// Both channels and crosscheck in virtual time.
struct Cycles(Machine);

fn set_of(scenario: &Scenario, axis: u8) -> params::AxisSet {
    let mut set = params::AxisSet::delivery(scenario.profile, axis, "compare");
    set.values.extend(&scenario.parameters);
    set
}

fn cycles(scenario: &Scenario) -> Cycles {
    cycles_of(scenario, 1)
}

fn cycles_of(scenario: &Scenario, axis: u8) -> Cycles {
    let set = set_of(scenario, axis);
    let cores = Cores::of(&set, 1, Start::Settled);
    Cycles(Axis::new(cores, &Wiring::of(&set), Options::default()))
}

fn machine(scenario: &Scenario) -> Box<dyn Subject> {
    Box::new(cycles(scenario))
}

/// What crosscheck compares of both reports at the end (DEC-21), to tell who is wrong.
fn compared_items(scenario: &Scenario) -> String {
    let mut cycles = cycles(scenario);
    for input in scenario.inputs() {
        cycles.step(&input);
    }
    let items = cycles.0.reports().map(|report| {
        let levels = (report.inputs, report.acknowledgements);
        format!(
            "requested {:x?}, inputs and acknowledges {levels:x?}, stop {:?}",
            report.requested.0[0], report.stop
        )
    });
    items.join("\n")
}

fn stimulus(input: &ModelInput) -> Stimulus {
    let motion = Motion {
        position: input.position,
        speed_mrpm: input.speed_mrpm as i32,
        acceleration_mrpm_s: input.acceleration_mrpm_s,
    };
    Stimulus {
        motion_a: motion,
        motion_b: motion,
        fine: None,
        torque_ppm: input.torque_ppm as i32,
        word: input.control,
        lines: Lines { pairs: input.se, ais: input.ais, aie: input.aie },
        clear_error: input.clear_error,
        drive_n0: input.drive_n0,
        drive_enabled: input.drive_enabled,
        faults: sim::trace::Faults::default(),
    }
}

fn view(seen: &Seen) -> View {
    let errors = seen.errors.as_slice().iter();
    View {
        status: seen.status,
        torque: seen.torque,
        path: seen.path,
        errors: errors.map(|code| [code.code, code.info1, code.info2, code.info3]).collect(),
    }
}

impl Subject for Cycles {
    fn step(&mut self, input: &ModelInput) -> ModelOutput {
        self.0.step(&stimulus(input));
        let [a, b, crosscheck] = self.0.views();
        ModelOutput { a: view(a), b: view(b), crosscheck: view(crosscheck) }
    }
}

/// A number from the environment.
fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

/// What both show from shortly before the parting on, change by change.
fn around(failure: &Failure) -> String {
    let mut scenario = failure.scenario.clone();
    let at = failure.parting.at;
    scenario.last = at + 3;
    let mut cores = cycles(&scenario);
    let mut model = Model::new(scenario.profile, &scenario.parameters);
    let mut text = String::new();
    for (now, input) in scenario.inputs().iter().enumerate() {
        let (expected, seen) = (model.step(input), cores.step(input));
        if (now as i64) < at - 3 {
            continue;
        }
        let _ = writeln!(text, "{now} ms, speed {}, position {}", input.speed_mrpm, input.position);
        let rows = [
            ("a", expected.a, seen.a),
            ("b", expected.b, seen.b),
            ("crosscheck", expected.crosscheck, seen.crosscheck),
        ];
        for (source, expected, seen) in rows {
            let mark = if expected == seen { ' ' } else { '*' };
            let _ = writeln!(text, "{mark} {source:10} model {} cores {}", short(&expected), short(&seen));
        }
    }
    text
}

fn short(view: &View) -> String {
    let part = view.status.0.iter().rposition(|part| *part != 0).unwrap_or(0);
    let words: Vec<String> = view.status.0[..=part].iter().map(|word| format!("{word:08x}")).collect();
    format!("{} {}{} {:?}", words.join("."), u8::from(view.torque), u8::from(view.path), view.errors)
}

/// The set as a file `safepair replay` reads.
fn file_of(set: &params::AxisSet) -> String {
    let vendor = params::vendor::export(set);
    params::vendor::import(&vendor, "compare", set.profile, "compare").unwrap_or(vendor)
}

fn report(profile: Profile, failure: &Failure) -> String {
    let name = format!("safepair-{}-{}", profile.name(), failure.seed);
    let folder = std::env::temp_dir();
    let trace = folder.join(format!("{name}.csv"));
    let _ = std::fs::write(&trace, failure.scenario.csv());
    let _ = std::fs::write(folder.join(format!("{name}.toml")), file_of(&set_of(&failure.scenario, 1)));
    let parting = &failure.parting;
    format!(
        "seed {} from {} at {} ms: {} differs in {}\n{}{}\n{}\n{}",
        failure.seed,
        failure.scenario.origin,
        parting.at,
        parting.source,
        parting.what,
        around(failure),
        compared_items(&failure.scenario),
        trace.display(),
        failure.scenario.csv()
    )
}

/// Compares the seeds `range`; stops after `SAFEPAIR_FAILURES` that fail.
fn compare_seeds(profile: Profile, range: std::ops::Range<u64>) {
    let (mut cycles, mut reports) = (0, Vec::new());
    for seed in range {
        match compare_seed(profile, seed, &machine) {
            Ok(compared) => cycles += compared,
            Err(failure) => reports.push(report(profile, &failure)),
        }
        if reports.len() as u64 >= number("SAFEPAIR_FAILURES", 1) {
            break;
        }
    }
    println!("{}: {cycles} cycles agree", profile.name());
    assert!(reports.is_empty(), "{}", reports.join("\n\n"));
}

/// The long form: `SAFEPAIR_SEEDS` seeds from `SAFEPAIR_FIRST_SEED` on.
fn compare_long(profile: Profile) {
    let first = number("SAFEPAIR_FIRST_SEED", 0);
    compare_seeds(profile, first..first + number("SAFEPAIR_SEEDS", 1000));
}

/// Design 12: everything random compares A, B and the model.
#[test]
fn amk_cores_agree_with_the_model() {
    compare_seeds(Profile::AmkKw, 0..250);
}

/// Design 12
#[test]
fn atv_cores_agree_with_the_model() {
    compare_seeds(Profile::Atv340, 0..160);
}

/// Design 12
#[test]
fn etg_cores_agree_with_the_model() {
    compare_seeds(Profile::Etg61002, 0..100);
}

/// Design 12
#[test]
fn lenze_cores_agree_with_the_model() {
    compare_seeds(Profile::LenzeSm301, 0..150);
}

/// One axis with its model.
struct Pairing {
    profile: Profile,
    inputs: std::vec::IntoIter<ModelInput>,
    model: Model,
    cores: Cycles,
}

impl Pairing {
    fn new(profile: Profile, seed: u64, axis: u8) -> Self {
        let scenario = generate::scenario(profile, seed);
        let model = Model::new(profile, &scenario.parameters);
        Self { profile, inputs: scenario.inputs().into_iter(), model, cores: cycles_of(&scenario, axis) }
    }

    /// One cycle, if the scenario has one more; what differs.
    fn step(&mut self) -> Option<&'static str> {
        let input = self.inputs.next()?;
        let (expected, seen) = (self.model.step(&input), self.cores.step(&input));
        let views = [(expected.a, seen.a), (expected.b, seen.b), (expected.crosscheck, seen.crosscheck)];
        views.iter().find_map(|(expected, seen)| part(self.profile, expected, seen))
    }
}

/// Design 6 and 11: axes of one set do not know of each other, whatever their profiles are.
#[test]
fn axes_of_four_profiles_agree_with_their_models_side_by_side() {
    const PROFILES: [Profile; 4] = [Profile::AmkKw, Profile::LenzeSm301, Profile::Atv340, Profile::Etg61002];
    for seed in 0..10 {
        let numbered = PROFILES.into_iter().zip([1, 2, 33, 64]);
        let mut axes: Vec<Pairing> =
            numbered.map(|(profile, axis)| Pairing::new(profile, seed, axis)).collect();
        for cycle in 0..8000 {
            for axis in &mut axes {
                assert_eq!(axis.step(), None, "seed {seed}, {} in cycle {cycle}", axis.profile.name());
            }
        }
    }
}

/// Design 12
#[test]
#[ignore = "long: SAFEPAIR_SEEDS=n, 1000 by default"]
fn long_amk_cores_agree_with_the_model() {
    compare_long(Profile::AmkKw);
}

/// Design 12
#[test]
#[ignore = "long: SAFEPAIR_SEEDS=n, 1000 by default"]
fn long_etg_cores_agree_with_the_model() {
    compare_long(Profile::Etg61002);
}

/// Design 12
#[test]
#[ignore = "long: SAFEPAIR_SEEDS=n, 1000 by default"]
fn long_atv_cores_agree_with_the_model() {
    compare_long(Profile::Atv340);
}

/// Design 12
#[test]
#[ignore = "long: SAFEPAIR_SEEDS=n, 1000 by default"]
fn long_lenze_cores_agree_with_the_model() {
    compare_long(Profile::LenzeSm301);
}
