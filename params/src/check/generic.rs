//! Conditions of the generic profile: they follow from the objects' own M, O and C marks.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::LazyLock,
};

use serde::Deserialize;
use shm_schema::{
    catalogue,
    profile::{Profile, common},
};

use super::{Finding, Judge};
use crate::{
    definition::{self, Definition, Kind},
    key,
    rule::Severity,
};

/// Pairs of limits, lower first.
const LIMITS: [(&str, &str); 5] = [
    ("SSR.velocity_lower_limit", "SSR.velocity_upper_limit"),
    ("SAR.acceleration_lower_limit", "SAR.acceleration_upper_limit"),
    ("SLP.position_lower_limit", "SLP.position_upper_limit"),
    ("SSM.velocity_lower_limit", "SSM.velocity_upper_limit"),
    ("SCA.position_lower_limit", "SCA.position_upper_limit"),
];

/// Functions without a control bit, active while one limit is not zero.
const BY_PARAMETERS: [&str; 4] = ["SMS", "SMA", "SSM", "SCA"];

/// Functions an error may end in.
const STOPS: [&str; 3] = ["STO", "SS1", "SS2"];

#[derive(Deserialize)]
struct Words {
    control: Vec<Bit>,
}

#[derive(Deserialize)]
struct Bit {
    name: String,
}

/// Instances that have a control bit without an assignment (DEC-41).
static CONTROLLED: LazyLock<Vec<String>> = LazyLock::new(|| {
    let words: Words = toml::from_str(catalogue::WORDS_ETG_6100_2)
        .expect("the fact tables are part of the build and checked by its tests");
    words.control.into_iter().map(|bit| bit.name).collect()
});

pub(super) fn findings(judge: &Judge) -> Vec<Finding> {
    if judge.profile != Profile::Etg61002 {
        return Vec::new();
    }
    let keys = judge.values.keys().filter(|key| **key < common::CONTROL_WORD);
    let instances: BTreeSet<u32> = keys.map(|key| key >> 8).collect();
    let mut findings = Vec::new();
    for instance in &instances {
        let instance = Instance { judge, reference: *instance };
        instance.missing(&mut findings);
        instance.limits(&mut findings);
        instance.references(&mut findings);
        instance.inactive(&mut findings);
        instance.unreachable(&mut findings);
        instance.end_of_ss2(&instances, &mut findings);
    }
    words(judge, &instances, &mut findings);
    findings
}

struct Instance<'a, 'b> {
    judge: &'a Judge<'b>,
    reference: u32,
}

impl Instance<'_, '_> {
    fn function(&self) -> &'static str {
        key::function_name(self.reference >> 8).unwrap_or_default()
    }

    fn name(&self) -> String {
        key::reference_name(self.reference as i32)
    }

    fn objects(&self) -> impl Iterator<Item = &'static Definition> {
        let function = self.reference >> 8;
        definition::definitions(Profile::Etg61002)
            .iter()
            .filter(move |definition| definition.number >> 16 == function)
    }

    fn key(&self, definition: &Definition) -> u32 {
        definition.number | (self.reference & 0xFF) << 8
    }

    fn value(&self, definition: &Definition) -> Option<i64> {
        self.judge.values.get(&self.key(definition)).copied()
    }

    /// ETG-GEN-04: M always, of each C group at least one. The groups of SS1 are optional in
    /// the description of its time variant, and so they are here.
    fn missing(&self, findings: &mut Vec<Finding>) {
        let mut groups: BTreeMap<&str, Vec<&Definition>> = BTreeMap::new();
        for definition in self.objects() {
            let optional =
                definition.condition == "O" || self.function() == "SS1" && definition.condition != "M";
            let alone = if definition.condition == "M" {
                definition.key.as_str()
            } else {
                definition.condition.as_str()
            };
            if !optional {
                groups.entry(alone).or_default().push(definition);
            }
        }
        for group in groups.into_values() {
            if group.iter().any(|definition| self.value(definition).is_some()) {
                continue;
            }
            let keys: Vec<u32> = group.iter().map(|definition| self.key(definition)).collect();
            let names: Vec<_> = keys.iter().filter_map(|key| key::etg_name(*key)).collect();
            findings.push(Finding {
                rule: "ETG-GEN-04".into(),
                position: self.place(),
                message: format!("{} needs {}", self.name(), names.join(" or ")),
                remedy: "name it: what is left out counts as 0".into(),
                ..self.judge.blank(&keys)
            });
        }
    }

    /// Where the file first names this instance.
    fn place(&self) -> crate::diagnostic::Position {
        let named = self.judge.named.iter().find(|(key, _)| **key >> 8 == self.reference);
        named.map(|(_, position)| *position).unwrap_or_default()
    }

    fn limits(&self, findings: &mut Vec<Finding>) {
        for (lower, upper) in
            LIMITS.iter().filter(|(lower, _)| lower.starts_with(&format!("{}.", self.function())))
        {
            let objects = [lower, upper].map(|name| definition::by_name(Profile::Etg61002, name));
            let [Some(lower), Some(upper)] = objects else { continue };
            if self.value(lower) > self.value(upper) && self.value(upper).is_some() {
                findings.push(Finding {
                    rule: "DEC-31".into(),
                    message: "the lower limit is above the upper limit".into(),
                    remedy: "exchange them".into(),
                    ..self.judge.blank(&[self.key(lower), self.key(upper)])
                });
            }
        }
    }

    fn references(&self, findings: &mut Vec<Finding>) {
        for definition in self.objects().filter(|definition| definition.kind == Kind::Reference) {
            let target = self.value(definition).unwrap_or_default();
            let brake = definition.key.ends_with("activate_sbc");
            let function = key::function_name((target >> 8) as u32).unwrap_or_default();
            let wanted: &[&str] = if brake { &["SBC"] } else { &STOPS };
            if target != 0 && !wanted.contains(&function) {
                findings.push(Finding {
                    rule: if brake { "ETG-SBC-08" } else { "ETG-GEN-04" }.into(),
                    message: format!("{function} cannot be this"),
                    remedy: format!("one of {}, or none", wanted.join(", ")),
                    ..self.judge.blank(&[self.key(definition)])
                });
            }
        }
    }

    /// ETG-SMS-01, ETG-SMA-01, ETG-SSM-02, ETG-SCA-02
    fn inactive(&self, findings: &mut Vec<Finding>) {
        if !BY_PARAMETERS.contains(&self.function()) {
            return;
        }
        let limits: Vec<_> =
            self.objects().filter(|definition| definition.condition.starts_with('C')).collect();
        if limits.iter().all(|definition| self.value(definition).unwrap_or_default() == 0) {
            let keys: Vec<u32> = limits.iter().map(|definition| self.key(definition)).collect();
            findings.push(Finding {
                severity: Severity::Warning,
                rule: format!(
                    "ETG-{}-0{}",
                    self.function(),
                    if self.function().starts_with("SM") { 1 } else { 2 }
                ),
                message: format!("{} is inactive: all its limits are 0", self.name()),
                remedy: "set a limit, or take the function out".into(),
                ..self.judge.blank(&keys)
            });
        }
    }

    /// DEC-41: an instance without a bit in the control word can never be requested.
    fn unreachable(&self, findings: &mut Vec<Finding>) {
        let name = self.name();
        let without_bit =
            BY_PARAMETERS.contains(&self.function()) || ["STO", "SDI"].contains(&self.function());
        let fixed = CONTROLLED.iter().any(|known| known.replace("_ACTIVE", "") == name);
        let assigned = common::CONTROL_WORD..common::STATUS_WORD;
        let assigned =
            self.judge.values.range(assigned).any(|(_, target)| *target == i64::from(self.reference));
        let referred = self.judge.values.iter().any(|(key, target)| {
            *target == i64::from(self.reference)
                && definition::by_number(Profile::Etg61002, *key)
                    .is_some_and(|found| found.kind == Kind::Reference)
        });
        if ![without_bit, fixed, assigned, referred].contains(&true) {
            findings.push(Finding {
                severity: Severity::Warning,
                rule: "DEC-41".into(),
                position: self.place(),
                message: format!("{name} has no bit in the control word: nothing can request it"),
                remedy: format!("[words] control.32 = \"{name}\""),
                ..self.judge.blank(&[])
            });
        }
    }

    /// ETG-SS2-02: SS2_k ends in SOS_k.
    fn end_of_ss2(&self, instances: &BTreeSet<u32>, findings: &mut Vec<Finding>) {
        let Some((sos, _)) = key::instance("SOS").ok() else { return };
        let end = sos << 8 | self.reference & 0xFF;
        if self.function() == "SS2" && !instances.contains(&end) {
            findings.push(Finding {
                rule: "ETG-SS2-02".into(),
                position: self.place(),
                message: format!(
                    "{} ends in {}, which no parameter names",
                    self.name(),
                    key::reference_name(end as i32)
                ),
                remedy: "name its windows".into(),
                ..self.judge.blank(&[])
            });
        }
    }
}

/// An assigned bit of an instance that nothing names is ignored, or stays 0.
fn words(judge: &Judge, instances: &BTreeSet<u32>, findings: &mut Vec<Finding>) {
    for (key, target) in judge.values.range(common::CONTROL_WORD..common::CONTROL_WORD + 0x2000) {
        if !instances.contains(&(*target as u32)) {
            findings.push(Finding {
                severity: Severity::Warning,
                rule: "DEC-40".into(),
                message: format!(
                    "{} has no parameters and is not supported",
                    key::reference_name(*target as i32)
                ),
                remedy: "name its parameters, or take the assignment out".into(),
                ..judge.blank(&[*key])
            });
        }
    }
}
