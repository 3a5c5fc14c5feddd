//! Random comparison: the reference model against the real cores, cycle by cycle, over the
//! same inputs; a failing seed is made small and written as a trace `safepair replay` runs.
//!
//! - [`scenario`]: parameters and a trace of rows, what design 10 calls a trace
//! - [`generate`]: meaningful random scenarios from a seed
//! - [`hints`], [`lenze`], [`etg`], [`edges`]: meaningful parameters, and numbers at the edge
//! - [`shrink`]: the smallest scenario that still fails
//! - [`Subject`]: whatever answers inputs cycle by cycle; the model is one

pub mod edges;
pub mod etg;
pub mod generate;
pub mod hints;
pub mod lenze;
pub mod random;
pub mod scenario;
pub mod shrink;

use shm_schema::profile::Profile;
use shm_schema::word::Word;

use crate::model::{Model, ModelInput, ModelOutput, View};
use scenario::Scenario;

/// Something that shows a, b and crosscheck after each cycle.
pub trait Subject {
    /// One cycle of 1 ms.
    fn step(&mut self, input: &ModelInput) -> ModelOutput;
}

impl Subject for Model {
    fn step(&mut self, input: &ModelInput) -> ModelOutput {
        Self::step(self, input)
    }
}

/// Where two subjects part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parting {
    /// Cycle, ms.
    pub at: i64,
    /// `a`, `b` or `crosscheck`.
    pub source: &'static str,
    /// `status`, `torque`, `path` or `errors`.
    pub what: &'static str,
    /// What the model shows.
    pub expected: View,
    /// What the subject shows.
    pub seen: View,
}

/// Status bits that mean nothing safe and are not compared: ATV-PSF-09, "informative only".
fn compared_bits(profile: Profile) -> Word {
    match profile {
        Profile::Atv340 => Word::from_u32(0xFF7F),
        _ => Word([u32::MAX; 8]),
    }
}

/// ETG names no codes (ETG-ERR-03): there the error bit of the status says it all.
fn same_errors(profile: Profile, expected: &View, seen: &View) -> bool {
    profile == Profile::Etg61002 || expected.errors == seen.errors
}

/// What of two views differs: `status`, `torque`, `path` or `errors`.
pub fn part(profile: Profile, expected: &View, seen: &View) -> Option<&'static str> {
    let mask = compared_bits(profile);
    let differs = |part: usize| (expected.status.0[part] ^ seen.status.0[part]) & mask.0[part] != 0;
    if (0..8).any(differs) {
        Some("status")
    } else if expected.torque != seen.torque {
        Some("torque")
    } else if expected.path != seen.path {
        Some("path")
    } else if !same_errors(profile, expected, seen) {
        Some("errors")
    } else {
        None
    }
}

/// Runs both over the scenario; where they first part.
pub fn first_parting(scenario: &Scenario, subject: &mut dyn Subject) -> Option<Parting> {
    let mut model = Model::new(scenario.profile, &scenario.parameters);
    for (at, input) in scenario.inputs().iter().enumerate() {
        let (expected, seen) = (model.step(input), subject.step(input));
        let sources = [
            ("a", expected.a, seen.a),
            ("b", expected.b, seen.b),
            ("crosscheck", expected.crosscheck, seen.crosscheck),
        ];
        for (source, expected, seen) in sources {
            if let Some(what) = part(scenario.profile, &expected, &seen) {
                return Some(Parting { at: at as i64, source, what, expected, seen });
            }
        }
    }
    None
}

/// A failing seed, made small.
#[derive(Debug)]
pub struct Failure {
    /// The seed.
    pub seed: u64,
    /// The smallest scenario found that still fails.
    pub scenario: Scenario,
    /// Where it fails.
    pub parting: Parting,
}

/// Compares over seeds; stops at the first failure and shrinks it. Answers with the number
/// of cycles compared.
pub fn compare(
    profile: Profile,
    seeds: std::ops::Range<u64>,
    make: &dyn Fn(&Scenario) -> Box<dyn Subject>,
) -> Result<u64, Box<Failure>> {
    let mut cycles = 0;
    for seed in seeds {
        cycles += compare_seed(profile, seed, make)?;
    }
    Ok(cycles)
}

/// Compares the scenario of one seed; a failing one is made small.
pub fn compare_seed(
    profile: Profile,
    seed: u64,
    make: &dyn Fn(&Scenario) -> Box<dyn Subject>,
) -> Result<u64, Box<Failure>> {
    let parts = |scenario: &Scenario| first_parting(scenario, make(scenario).as_mut());
    let scenario = generate::scenario(profile, seed);
    let cycles = scenario.last as u64 + 1;
    let Some(found) = parts(&scenario) else { return Ok(cycles) };
    let is_the_same = |parting: &Parting| (parting.source, parting.what) == (found.source, found.what);
    let fails = |candidate: &Scenario| parts(candidate).is_some_and(|parting| is_the_same(&parting));
    let scenario = shrink::smallest(scenario, &fails);
    let parting = parts(&scenario).unwrap_or(found);
    Err(Box::new(Failure { seed, scenario, parting }))
}

#[cfg(test)]
mod tests;
