//! Every plausibility row of the catalogue violated, one after the other, as a file would.

use std::{collections::BTreeMap, fmt::Write as _};

use shm_schema::catalogue;

use super::*;
use crate::{definition::Definition, rule};

/// A row of the catalogue: what the channels have to report.
struct Row {
    id: String,
    code: String,
    channel: String,
}

fn rows() -> Vec<Row> {
    let catalogue: toml::Table = catalogue::AMK_DIAGNOSIS.parse().expect("the catalogue");
    let rows = catalogue["plausibility"].as_array().expect("rows").iter();
    rows.map(|row| {
        let number = |field: &str| row.get(field).and_then(toml::Value::as_integer).unwrap_or(0);
        let fields = [number("code"), number("info1"), number("info2"), number("info3")];
        let channel = match row["channel"].as_str().expect("a channel") {
            "1" => "a",
            "2" => "b",
            other => other,
        };
        Row {
            id: row["id"].as_str().expect("an id").into(),
            code: fields.map(|field| field.to_string()).join("/"),
            channel: channel.into(),
        }
    })
    .collect()
}

/// The numbers worth trying for a parameter: its limits and what lies beyond, and everything
/// its rule compares with.
fn candidates(definition: &Definition, text: &str) -> Vec<i64> {
    let mut numbers = vec![0, 1, 2, 3, 16, definition.min, definition.max];
    let digits = |letter: char| !letter.is_ascii_digit();
    numbers.extend(text.split(digits).filter_map(|number| number.parse::<i64>().ok()));
    numbers.extend([5, 10, 20, 50, 120, 600, 1_000, 10_000, 65_000]);
    let around =
        numbers.into_iter().flat_map(|number| [number - 1, number, number + 1, -number, -number - 1]);
    let mut all: Vec<i64> = around.collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Values that break a rule, as few as possible changed from the delivery state.
fn violation(profile: Profile, rule: &Rule) -> Option<BTreeMap<String, i64>> {
    let condition = rule.condition.as_ref()?;
    let delivery = set::defaults(profile);
    let definitions: Vec<&Definition> =
        condition.names().into_iter().filter_map(|name| definition::by_name(profile, name)).collect();
    let tried: Vec<Vec<i64>> = definitions.iter().map(|found| candidates(found, &rule.text)).collect();
    let broken = |changed: &BTreeMap<String, i64>| {
        let value = |name: &str| {
            let threshold = rule::thresholds(profile).iter().find(|threshold| threshold.name == name);
            let own = definition::by_name(profile, name)
                .and_then(|found| delivery.get(&found.number))
                .map(|value| i64::from(*value));
            let named = changed.get(name).copied();
            threshold.map(|threshold| threshold.value).or(named).or(own).map(i128::from)
        };
        condition.holds(&value) == Some(true)
    };
    let mut random = 1_u64;
    let mut pick = |below: usize| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as usize % below.max(1)
    };
    // One value, then two, and so on.
    for count in 1..=definitions.len() {
        let rounds = if count == 1 { 2_000 } else { 60_000 };
        for _ in 0..rounds {
            let changed: BTreeMap<String, i64> = (0..count)
                .map(|_| {
                    let at = pick(definitions.len());
                    (definitions[at].key.clone(), tried[at][pick(tried[at].len())])
                })
                .collect();
            if broken(&changed) {
                return Some(changed);
            }
        }
    }
    None
}

fn file(profile: Profile, changed: &BTreeMap<String, i64>) -> String {
    let mut text = format!("profile = \"{}\"\n[parameters]\n", profile.name());
    for (name, value) in changed {
        let _ = writeln!(text, "\"{name}\" = {value}");
    }
    text
}

/// AMKP-PLAUS-001 to 228: whoever breaks a row is told the row's own code, and by the channel
/// that the row names. The rows of the actual speed cannot be broken by a file: they count at
/// run time.
#[test]
fn every_row_of_the_catalogue_answers_with_its_own_code() {
    let mut at_run_time = Vec::new();
    for row in rows() {
        let rules = rule::rules(Profile::AmkKw);
        let rule = rules.rule.iter().find(|rule| rule.id == row.id).expect("a rule");
        if rule.condition.is_none() {
            at_run_time.push(row.id);
            continue;
        }
        let changed = violation(Profile::AmkKw, rule).unwrap_or_else(|| panic!("{}: {}", row.id, rule.text));
        let report = check(&file(Profile::AmkKw, &changed), "set.toml");
        let found = report.findings.iter().find(|finding| finding.rule == row.id);
        let found = found.unwrap_or_else(|| panic!("{} with {changed:?}: {:?}", row.id, report.diagnostics));
        if row.id == "AMKP-PLAUS-003" {
            assert!(found.code.starts_with("3605/200/"), "{}", found.code);
        } else {
            assert_eq!(found.code, row.code, "{} with {changed:?}", row.id);
        }
        assert_eq!(found.channel, row.channel, "{}", row.id);
        assert_eq!(found.severity, Severity::Error, "{}", row.id);
        assert!(!found.remedy.is_empty(), "{}", row.id);
        assert!(found.position.line > 2, "{}: no line", row.id);
        assert!(!report.passed(), "{}", row.id);
        // The image can hold it, so that the channels can refuse it with the same code.
        assert!(report.diagnostics.is_empty(), "{} with {changed:?}: {:?}", row.id, report.diagnostics);
    }
    assert_eq!(at_run_time.len(), 8, "{at_run_time:?}");
}

/// The rules of the other profiles: each can be broken by a file and is then reported.
#[test]
fn every_rule_of_lenze_and_atv_is_reported_when_it_is_broken() {
    for profile in [Profile::LenzeSm301, Profile::Atv340] {
        for rule in &rule::rules(profile).rule {
            let changed = violation(profile, rule).unwrap_or_else(|| panic!("{}: {}", rule.id, rule.text));
            let report = raw(profile, &changed);
            let found = report.iter().find(|found| (&found.rule, &found.message) == (&rule.id, &rule.text));
            let found = found.unwrap_or_else(|| panic!("{} with {changed:?}", rule.id));
            assert_eq!(found.severity, rule.severity, "{}", rule.id);
            assert!(!found.remedy.is_empty(), "{}: {}", rule.id, rule.text);
        }
    }
}

/// A set with raw values, as an image would hold them.
fn raw(profile: Profile, changed: &BTreeMap<String, i64>) -> Vec<Finding> {
    let mut set = AxisSet::delivery(profile, 1, "S");
    for (name, value) in changed {
        let number = definition::by_name(profile, name).expect("known").number;
        set.values.insert(number, *value as i32);
    }
    check_set(&set)
}

/// ETG-GEN-04: of every function the objects its table marks M, and of each C group one.
#[test]
fn a_generic_function_without_its_mandatory_objects_is_reported() {
    let mut tried = 0;
    for definition in definition::definitions(Profile::Etg61002) {
        let (function, _) = definition.key.split_once('.').expect("function.object");
        let conditional = definition.condition.starts_with('C') && function != "SS1";
        if ![definition.condition == "M", conditional].contains(&true) {
            continue;
        }
        let same_group = |other: &Definition| {
            other.key == definition.key || conditional && other.condition == definition.condition
        };
        let others = definition::definitions(Profile::Etg61002).iter().filter(|other| {
            other.key.starts_with(&format!("{function}.")) && other.default == 0 && !same_group(other)
        });
        // A function is there as soon as one of its objects is named.
        let Some(other) = others.clone().find(|other| other.kind != definition::Kind::Reference) else {
            continue;
        };
        let object = other.key.split_once('.').expect("an object").1;
        let text = format!("profile = \"etg-6100-2\"\n[parameters]\n{function}_1.{object} = 1\n");
        let report = check(&text, "set.toml");
        let missing = definition.key.split_once('.').expect("an object").1;
        let named = report.findings.iter().any(|found| {
            found.rule == "ETG-GEN-04" && found.message.contains(missing) && found.severity == Severity::Error
        });
        if definition.default == 0 {
            assert!(named, "{} is not missed in\n{text}{:#?}", definition.key, report);
            tried += 1;
        }
    }
    assert!(tried >= 10, "{tried}");
}
