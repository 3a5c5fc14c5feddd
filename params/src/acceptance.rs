//! The acceptance report: what is sealed, what it means, and what has to be proved by hand.
//!
//! It follows the vendor's validation report (AMK-VAL-01 to AMK-VAL-04): identification and
//! signatures, single checks, every value by function, one proof for every function in use.
//! It is filled in and signed by hand, and stays with the machine.

use std::{collections::BTreeMap, fmt::Write as _};

use serde::Serialize;
use shm_schema::{
    catalogue,
    profile::{Profile, common},
};

use crate::{
    check::{self, Finding},
    image::Signatures,
    key,
    set::AxisSet,
    view::{self, Row},
};

/// One function to be proved at the machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Proof {
    /// Function.
    pub function: String,
    /// What to do.
    pub test: String,
    /// What has to happen.
    pub expected: String,
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
    /// Values by function.
    pub values: BTreeMap<String, Vec<Row>>,
    /// Rules that the set breaks, and advice.
    pub findings: Vec<Finding>,
    /// Functions to be proved.
    pub proofs: Vec<Proof>,
}

/// What every installation assumes (design 3.4, 5; DEC-26).
const ASSUMPTIONS: [&str; 4] = [
    "The evaluator of the inhibit paths drops a path after three missing edges.",
    "One producer for both channels: freedom from interference between encoder signals is the builder's to show.",
    "All clocks of one PC hang on one crystal; the fieldbus master's watchdog is the independent witness.",
    "Nothing here is certified; the assessment of the machine is its builder's.",
];

const SINGLE_CHECKS: [&str; 6] = [
    "Visual inspection of wiring and shielding",
    "Device type and serial number agree with the label",
    "Signatures agree with those that the running set reports",
    "Every value below agrees with the safety requirement it serves",
    "The axis was in STO and the danger zone clear while the set was loaded",
    "Behaviour was tested in every operating mode",
];

/// The report of one axis.
pub fn acceptance(axis: &AxisSet, file: &str) -> Acceptance {
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
        values,
        findings: check::check_set(axis),
        proofs: proofs(axis),
    }
}

/// One proof for every function in use.
fn proofs(axis: &AxisSet) -> Vec<Proof> {
    match axis.profile {
        Profile::Etg61002 => generic(axis),
        profile => tabled(profile),
    }
}

#[derive(serde::Deserialize)]
struct Proofs {
    proof: Vec<Tabled>,
}

#[derive(serde::Deserialize)]
struct Tabled {
    profile: String,
    function: String,
    test: String,
    expected: String,
}

/// Functions of a vendor's profile: the vendor's list is fixed, and a function that is not
/// in use is proved to be out of use.
fn tabled(profile: Profile) -> Vec<Proof> {
    let table: Proofs = toml::from_str(catalogue::PROOFS)
        .expect("the fact tables are part of the build and checked by its tests");
    let own = table.proof.into_iter().filter(|proof| proof.profile == profile.name());
    own.map(|proof| Proof { function: proof.function, test: proof.test, expected: proof.expected }).collect()
}

/// Every named instance, with the reaction that its set gives it.
fn generic(axis: &AxisSet) -> Vec<Proof> {
    let keys = axis.values.keys().filter(|key| **key < common::CONTROL_WORD);
    let mut instances: Vec<u32> = keys.map(|key| key >> 8).collect();
    instances.dedup();
    instances.into_iter().map(|instance| proof_of(axis, instance)).collect()
}

fn proof_of(axis: &AxisSet, instance: u32) -> Proof {
    let name = key::reference_name(instance as i32);
    let own = axis.values.iter().filter(|(key, _)| **key >> 8 == instance && **key < common::CONTROL_WORD);
    let reaction = own
        .filter(|(key, _)| axis.name(**key).ends_with("error_reaction"))
        .map(|(_, value)| key::reference_name(*value))
        .next();
    let stop = matches!(name.split('_').next(), Some("STO" | "SS1" | "SS2" | "SBC"));
    Proof {
        test: if stop {
            format!("request {name} in motion")
        } else {
            format!("request {name} where it has a request, then leave its limits")
        },
        expected: match reaction {
            None => format!("{name} as parameterised; a violation ends in STO with the error bit"),
            Some(reaction) => format!("error bit, then {reaction}"),
        },
        function: name,
    }
}

impl Acceptance {
    /// The report as Markdown, with room for hand-written entries.
    pub fn markdown(&self) -> String {
        let mut text = format!("# Acceptance report, axis {}\n\n", self.axis);
        let _ = writeln!(
            text,
            "| | |\n|---|---|\n| File | {} |\n| Profile | {} |\n| Serial number | {} |",
            self.file, self.profile, self.serial
        );
        let Signatures { template, content, device } = self.signatures;
        let _ = writeln!(
            text,
            "| Template signature | `{template:08X}` |\n| Content signature | `{content:08X}` |\n| Device signature | `{device:08X}` |"
        );
        text.push_str("| Machine, customer, place | |\n| Parameterised by, date, signature | |\n| Tested by, date, signature | |\n");
        section(&mut text, "Assumptions of use", &ASSUMPTIONS);
        section(&mut text, "Single checks", &SINGLE_CHECKS);
        self.findings(&mut text);
        self.values(&mut text);
        self.proofs(&mut text);
        text
    }

    fn findings(&self, text: &mut String) {
        text.push_str("\n## Findings of the plausibility check\n\n");
        if self.findings.is_empty() {
            text.push_str("None.\n");
        }
        for finding in &self.findings {
            let _ = writeln!(
                text,
                "- {:?} {} {}: {}",
                finding.severity, finding.rule, finding.code, finding.message
            );
        }
    }

    fn values(&self, text: &mut String) {
        text.push_str("\n## Values\n");
        for (function, rows) in &self.values {
            let title = if function.is_empty() { "other" } else { function };
            let _ = writeln!(
                text,
                "\n### {title}\n\n| parameter | name | value | unit | meaning | checked |\n|---|---|---|---|---|---|"
            );
            for row in rows {
                let _ = writeln!(
                    text,
                    "| {} | {} | {} | {} | {} | [ ] |",
                    row.key,
                    row.name,
                    row.value,
                    row.unit,
                    row.meaning.replace('|', "/")
                );
            }
        }
    }

    fn proofs(&self, text: &mut String) {
        text.push_str(
            "\n## Proofs at the machine\n\n| function | test | expected | result |\n|---|---|---|---|\n",
        );
        for Proof { function, test, expected } in &self.proofs {
            let _ = writeln!(text, "| {function} | {test} | {expected} | [ ] |");
        }
    }
}

fn section(text: &mut String, title: &str, lines: &[&str]) {
    let _ = writeln!(text, "\n## {title}\n");
    for line in lines {
        let _ = writeln!(text, "- [ ] {line}");
    }
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
            let report = acceptance(&set, "set.toml");
            let text = report.markdown();
            assert_eq!(report.values.values().map(Vec::len).sum::<usize>(), set.values.len());
            assert!(text.contains(&format!("{:08X}", set.signatures().device)));
            assert!(!report.proofs.is_empty(), "{}", profile.name());
        }
    }

    #[test]
    fn an_instance_of_the_generic_profile_is_proved_with_its_own_reaction() {
        let text = "profile = \"etg-6100-2\"\n[parameters]\nSS1_1.time_to_sto = 500\nSLS_2.velocity_limit = 5\nSLS_2.error_reaction = \"SS1_1\"";
        let set = crate::parse(text, "x").expect("right").axes.remove(0);
        let proofs = acceptance(&set, "x").proofs;
        let of = |name: &str| {
            proofs.iter().find(|proof| proof.function == name).expect("a proof").expected.clone()
        };
        assert_eq!(of("SLS_2"), "error bit, then SS1_1");
        assert!(of("SS1_1").contains("STO"));
    }
}
