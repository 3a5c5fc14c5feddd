//! The rule tables: conditions that make a set implausible, or unwise.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};
use shm_schema::{catalogue, profile::Profile};

use crate::expression::Expression;

/// How much a finding weighs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The channels refuse the set.
    #[default]
    Error,
    /// The source advises against it.
    Warning,
}

/// A field of a code: a number, or the value of a parameter.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(crate) enum Field {
    Number(i64),
    ValueOf(String),
}

/// One rule as its table gives it.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Rule {
    pub id: String,
    #[serde(default)]
    pub severity: Severity,
    #[serde(default)]
    pub channel: String,
    #[serde(default)]
    pub code: Option<i64>,
    #[serde(default)]
    pub info1: Option<Field>,
    #[serde(default)]
    pub info2: Option<Field>,
    #[serde(default)]
    pub info3: Option<Field>,
    pub params: Vec<String>,
    /// Absent: the row concerns measured values and counts at run time (DEC-46).
    #[serde(default)]
    violated: Option<String>,
    pub text: String,
    #[serde(default)]
    pub remedy: String,
    #[serde(skip)]
    pub condition: Option<Expression>,
}

/// A number that several rules compare with.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Threshold {
    /// Name in conditions.
    pub name: String,
    /// Value.
    pub value: i64,
    /// Unit.
    pub unit: String,
    /// Why this value.
    pub reason: String,
    /// Where it was decided.
    pub source: String,
}

#[derive(Default, Deserialize)]
pub(crate) struct Rules {
    #[serde(default)]
    pub threshold: Vec<Threshold>,
    pub rule: Vec<Rule>,
}

fn read(text: &str) -> Rules {
    let mut rules: Rules =
        toml::from_str(text).expect("the rule tables are part of the build and checked by its tests");
    for rule in &mut rules.rule {
        let condition = rule.violated.as_deref().map(Expression::parse);
        rule.condition = condition
            .map(|parsed| parsed.expect("the rule tables are part of the build and checked by its tests"));
    }
    rules
}

static AMK: LazyLock<Rules> = LazyLock::new(|| read(catalogue::RULES_AMK_KW));
static LENZE: LazyLock<Rules> = LazyLock::new(|| read(catalogue::RULES_LENZE_SM301));
static ATV: LazyLock<Rules> = LazyLock::new(|| read(catalogue::RULES_ATV340));
static NONE: LazyLock<Rules> = LazyLock::new(Rules::default);

/// The rules of a profile.
pub(crate) fn rules(profile: Profile) -> &'static Rules {
    match profile {
        Profile::AmkKw => &AMK,
        Profile::LenzeSm301 => &LENZE,
        Profile::Atv340 => &ATV,
        // Its conditions follow from the objects' own: see `check::generic`.
        Profile::Etg61002 | Profile::None => &NONE,
    }
}

/// The thresholds that the catalogues leave open and this project decided (DEC-46).
pub fn thresholds(profile: Profile) -> &'static [Threshold] {
    &rules(profile).threshold
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::definition;

    /// AMKP-PLAUS-001 to 228: none is missing, none appears twice.
    #[test]
    fn every_plausibility_row_of_the_catalogue_is_a_rule() {
        let catalogue: toml::Table = catalogue::AMK_DIAGNOSIS.parse().expect("the catalogue");
        let rows = catalogue["plausibility"].as_array().expect("rows");
        let mut ids: Vec<_> = rows.iter().map(|row| row["id"].as_str().expect("an id")).collect();
        assert_eq!(ids.len(), 228);
        for rule in AMK.rule.iter().filter(|rule| rule.code.is_some()) {
            let at = ids.iter().position(|id| *id == rule.id);
            ids.remove(at.unwrap_or_else(|| panic!("{} twice or unknown", rule.id)));
        }
        assert!(ids.is_empty(), "{ids:?}");
    }

    #[test]
    fn every_name_in_a_condition_is_a_parameter_or_a_threshold() {
        for profile in definition::PROFILES {
            for rule in &rules(profile).rule {
                let names = rule
                    .condition
                    .iter()
                    .flat_map(Expression::names)
                    .chain(rule.params.iter().map(String::as_str));
                for name in names {
                    let known = definition::by_name(profile, name).is_some()
                        || thresholds(profile).iter().any(|threshold| threshold.name == name);
                    assert!(known, "{}: {name}", rule.id);
                }
            }
        }
    }

    /// DEC-46: only rows about measured values have no condition.
    #[test]
    fn rows_without_a_condition_speak_of_the_actual_speed() {
        let without: Vec<_> = AMK.rule.iter().filter(|rule| rule.condition.is_none()).collect();
        assert_eq!(without.len(), 8);
        assert!(without.iter().all(|rule| rule.text.starts_with("actual speed")));
    }

    const TRIED: [i128; 31] = [
        0,
        1,
        2,
        3,
        4,
        5,
        6,
        10,
        16,
        17,
        20,
        49,
        200,
        249,
        499,
        501,
        600,
        1_000,
        10_000,
        60_001,
        64_001,
        65_501,
        65_537,
        16_777_216,
        0xFFFF_FFFF,
        -1,
        -60_001,
        100,
        250,
        8,
        2_048,
    ];

    /// Every row refuses something: a row that nothing breaks would be a mistake in its table.
    #[test]
    fn every_rule_can_be_broken() {
        for profile in definition::PROFILES {
            for rule in rules(profile).rule.iter().filter(|rule| rule.condition.is_some()) {
                assert!(breakable(profile, rule), "{}: {}", rule.id, rule.text);
            }
        }
    }

    /// By values tried at random.
    fn breakable(profile: Profile, rule: &Rule) -> bool {
        let condition = rule.condition.as_ref().expect("a condition");
        let names: Vec<_> = condition
            .names()
            .into_iter()
            .filter(|name| definition::by_name(profile, name).is_some())
            .collect();
        let mut random = 1_u64;
        (0..200_000).any(|_| {
            let picks: Vec<_> = names.iter().map(|name| (*name, pick(&mut random))).collect();
            let value = |name: &str| {
                let picked = picks.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
                picked.or_else(|| {
                    thresholds(profile)
                        .iter()
                        .find(|threshold| threshold.name == name)
                        .map(|threshold| i128::from(threshold.value))
                })
            };
            condition.holds(&value) == Some(true)
        })
    }

    /// A linear congruence is random enough, and the same in every run.
    fn pick(state: &mut u64) -> i128 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        TRIED[(*state >> 33) as usize % TRIED.len()]
    }
}
