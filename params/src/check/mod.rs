//! Judging a set: every rule of its profile, all findings at once (DEC-46).

mod generic;

use std::collections::BTreeMap;

use serde::Serialize;
use shm_schema::profile::Profile;

use crate::{
    definition, diagnosis,
    diagnostic::{Diagnostic, Position},
    file::{self, DraftAxis},
    rule::{self, Field, Rule, Severity},
    set::{self, AxisSet},
};

/// A parameter with its value, both as files write them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Named {
    /// Name.
    pub name: String,
    /// Value.
    pub value: String,
}

/// One rule that a set breaks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Weight.
    pub severity: Severity,
    /// Axis.
    pub axis: u8,
    /// Catalogue id of the rule.
    pub rule: String,
    /// Code that the channels raise, as replay writes it; empty if they raise none.
    pub code: String,
    /// Channel that raises it: `a`, `b`, `both`, or empty.
    pub channel: String,
    /// File.
    pub file: String,
    /// Where the first of the parameters is named; line 0 if the file names none of them.
    #[serde(flatten)]
    pub position: Position,
    /// The parameters and their values.
    pub params: Vec<Named>,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub remedy: String,
}

/// Everything there is to say about a file.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// File.
    pub file: String,
    /// What could not be understood, or cannot be held by an image.
    pub diagnostics: Vec<Diagnostic>,
    /// Broken rules, errors first, then by axis and rule.
    pub findings: Vec<Finding>,
    /// Axes that were judged.
    pub axes: usize,
}

impl Report {
    /// No diagnostic and no error; warnings do not count.
    pub fn passed(&self) -> bool {
        let errors = self.findings.iter().any(|finding| finding.severity == Severity::Error);
        self.diagnostics.is_empty() && !errors
    }
}

/// Judges a file: everything that [`crate::parse`] refuses, and every rule of its profiles.
pub fn check(text: &str, file: &str) -> Report {
    let draft = file::read(text, file);
    let mut findings: Vec<_> = draft.axes.iter().flat_map(|axis| Judge::of(axis, file).findings()).collect();
    findings.sort_by(|left, right| {
        (left.severity, left.axis, &left.rule).cmp(&(right.severity, right.axis, &right.rule))
    });
    Report { file: file.into(), diagnostics: draft.refusals(), findings, axes: draft.axes.len() }
}

/// Judges a set that is not a file any more.
pub fn check_set(set: &AxisSet) -> Vec<Finding> {
    let judge = Judge {
        number: set.number,
        profile: set.profile,
        file: "",
        values: set.values.iter().map(|(key, value)| (*key, set::widen(set.profile, *key, *value))).collect(),
        named: &set.named,
    };
    judge.findings()
}

/// Whether a plausibility row refuses the value of this key with a code of its own.
pub(crate) fn ruled(axis: &DraftAxis, key: u32) -> bool {
    let judge = Judge::of(axis, "");
    let rules = rule::rules(axis.profile).rule.iter().filter(|rule| rule.severity == Severity::Error);
    let mut rules = rules.filter(|rule| {
        rule.params
            .iter()
            .any(|name| definition::by_name(axis.profile, name).is_some_and(|found| found.number == key))
    });
    rules.any(|rule| judge.breaks(rule))
}

/// One axis under judgement.
struct Judge<'a> {
    number: u8,
    profile: Profile,
    file: &'a str,
    values: BTreeMap<u32, i64>,
    named: &'a BTreeMap<u32, Position>,
}

impl<'a> Judge<'a> {
    fn of(axis: &'a DraftAxis, file: &'a str) -> Self {
        Self {
            number: axis.number,
            profile: axis.profile,
            file,
            values: axis.values.clone(),
            named: &axis.named,
        }
    }

    fn findings(&self) -> Vec<Finding> {
        let broken = rule::rules(self.profile).rule.iter().filter(|rule| self.breaks(rule));
        let findings = broken.map(|rule| self.finding(rule));
        findings.chain(generic::findings(self)).collect()
    }

    fn breaks(&self, rule: &Rule) -> bool {
        let value = |name: &str| self.operand(name);
        let condition = rule.condition.as_ref();
        // Without a truth value it compares with an optional parameter that the file leaves out.
        condition.and_then(|condition| condition.holds(&value)).unwrap_or(false)
    }

    fn operand(&self, name: &str) -> Option<i128> {
        let thresholds = &rule::rules(self.profile).threshold;
        let threshold = thresholds.iter().find(|threshold| threshold.name == name);
        let value = threshold.map(|threshold| threshold.value).or_else(|| self.value(name));
        value.map(i128::from)
    }

    fn value(&self, name: &str) -> Option<i64> {
        let definition = definition::by_name(self.profile, name)?;
        self.values.get(&definition.number).copied()
    }

    fn finding(&self, rule: &Rule) -> Finding {
        let keys: Vec<u32> = rule
            .params
            .iter()
            .filter_map(|name| definition::by_name(self.profile, name))
            .map(|found| found.number)
            .collect();
        let code = self.code(rule);
        let known = diagnosis::explain(&code).into_iter().next().map(|explanation| explanation.remedy);
        let remedy = if rule.remedy.is_empty() { known.unwrap_or_default() } else { rule.remedy.clone() };
        Finding {
            severity: rule.severity,
            rule: rule.id.clone(),
            code,
            channel: rule.channel.clone(),
            message: rule.text.clone(),
            remedy,
            ..self.blank(&keys)
        }
    }

    /// A finding about these keys, still without words.
    fn blank(&self, keys: &[u32]) -> Finding {
        let place = keys.iter().find_map(|key| self.named.get(key)).copied().unwrap_or_default();
        Finding {
            severity: Severity::Error,
            axis: self.number,
            rule: String::new(),
            code: String::new(),
            channel: String::new(),
            file: self.file.into(),
            position: place,
            params: keys.iter().map(|key| self.shown(*key)).collect(),
            message: String::new(),
            remedy: String::new(),
        }
    }

    fn shown(&self, key: u32) -> Named {
        let raw = self.values.get(&key).copied();
        let definition = definition::by_number(self.profile, key);
        let value = raw.map(|raw| definition.map_or(raw.to_string(), |definition| definition.written(raw)));
        Named { name: set::name(self.profile, key), value: value.unwrap_or_else(|| "absent".into()) }
    }

    /// AMK: all four fields, 0 for an empty one; other profiles: their single code.
    fn code(&self, rule: &Rule) -> String {
        let Some(code) = rule.code else {
            return String::new();
        };
        if self.profile != Profile::AmkKw {
            return code.to_string();
        }
        let fields = [&rule.info1, &rule.info2, &rule.info3].map(|field| match field {
            None => 0,
            Some(Field::Number(number)) => *number,
            Some(Field::ValueOf(name)) => self.value(name).unwrap_or_default(),
        });
        format!("{code}/{}/{}/{}", fields[0], fields[1], fields[2])
    }
}

#[cfg(test)]
mod catalogue_tests;
#[cfg(test)]
mod tests;
