//! The acceptance report: what is sealed, what it means, and what has to be proved.
//!
//! It follows the vendor's validation report (AMK-VAL-01 to AMK-VAL-04): identification and
//! signatures, single checks, every value by function, one proof for every function in use.
//! What the acceptance run measured stands beside what was expected; the rest is filled in
//! and signed by hand, and stays with the machine.

pub mod active;
mod blocks;
pub mod document;
pub mod limits;
mod proof;
pub mod trial;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::{
    check::{self, Finding},
    image::Signatures,
    response::{self, Chain, Surroundings},
    set::AxisSet,
    view::{self, Row},
};
pub use active::Unproven;
pub use document::Block;
pub use proof::Proof;
use trial::{Measured, Trial};

/// A step with what was measured; without measurements it is still to be done.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// The step.
    #[serde(flatten)]
    pub trial: Trial,
    /// One for each expectation; empty: not run.
    pub measured: Vec<Measured>,
}

impl Outcome {
    /// `None` while it was not run.
    pub fn passed(&self) -> Option<bool> {
        let run = !self.measured.is_empty();
        run.then(|| self.measured.iter().all(|measured| measured.right))
    }
}

/// The report of one axis.
#[derive(Clone, Debug, Serialize)]
pub struct Acceptance {
    /// The file it speaks of.
    pub file: String,
    /// Number of the axis.
    pub axis: u8,
    /// Profile.
    pub profile: &'static str,
    /// Serial number.
    pub serial: String,
    /// Signatures.
    pub signatures: Signatures,
    /// What an FSoE master sends as SRA CRC.
    pub sra_crc: u32,
    /// Values by function.
    pub values: BTreeMap<String, Vec<Row>>,
    /// Rules that the set breaks, and advice.
    pub findings: Vec<Finding>,
    /// Functions to be proved.
    pub proofs: Vec<Proof>,
    /// Steps of the acceptance run, with what was measured if it was run.
    pub steps: Vec<Outcome>,
    /// Active functions without a step.
    pub unproven: Vec<Unproven>,
    /// What the functions permit over time.
    pub limits: Vec<limits::Envelope>,
    /// Response times, each a sum.
    pub responses: Vec<Chain>,
}

/// The report of one axis; `steps` as they were run, or as they are still to be.
pub fn acceptance(axis: &AxisSet, file: &str, around: &Surroundings, steps: Vec<Outcome>) -> Acceptance {
    let mut values: BTreeMap<String, Vec<Row>> = BTreeMap::new();
    for row in view::show(axis) {
        values.entry(row.function.clone()).or_default().push(row);
    }
    Acceptance {
        file: file.into(),
        axis: axis.number,
        profile: axis.profile.name(),
        serial: axis.serial.clone(),
        signatures: axis.signatures(),
        sra_crc: axis.sra_crc(),
        values,
        findings: check::check_set(axis),
        proofs: proof::proofs(axis),
        unproven: active::unproven(axis, steps.iter().map(|step| &step.trial)),
        steps,
        limits: limits::envelopes(axis),
        responses: response::chains(axis, around),
    }
}

/// The steps of a set, not run yet.
pub fn steps(axis: &AxisSet) -> Vec<Outcome> {
    trial::trials(axis).into_iter().map(|trial| Outcome { trial, measured: Vec::new() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::definition;

    /// AMK-VAL-02: every value of the set stands in the report once.
    #[test]
    fn every_value_and_every_signature_is_in_the_report() {
        for profile in definition::PROFILES {
            let set = AxisSet::delivery(profile, 1, "SIM-0001");
            let report = acceptance(&set, "set.toml", &Surroundings::default(), steps(&set));
            let text = document::markdown(&report.blocks());
            assert_eq!(report.values.values().map(Vec::len).sum::<usize>(), set.values.len());
            assert!(text.contains(&format!("{:08X}", set.signatures().device)));
            assert!(!report.proofs.is_empty(), "{}", profile.name());
            assert!(!report.steps.is_empty(), "{}", profile.name());
            for row in report.values.values().flatten() {
                assert!(text.contains(&format!("| {} | {} | ", row.key, row.name)), "{}", row.key);
            }
        }
    }

    #[test]
    fn an_instance_of_the_generic_profile_is_proved_with_its_own_reaction() {
        let text = "profile = \"etg-6100-2\"\n[parameters]\nSS1_1.time_to_sto = 500\nSLS_2.velocity_limit = 5\nSLS_2.error_reaction = \"SS1_1\"";
        let set = crate::parse(text, "x").expect("right").axes.remove(0);
        let proofs = proof::proofs(&set);
        let of = |name: &str| {
            proofs.iter().find(|proof| proof.function == name).expect("a proof").expected.clone()
        };
        assert_eq!(of("SLS_2"), "error bit, then SS1_1");
        assert!(of("SS1_1").contains("STO"));
    }
}
