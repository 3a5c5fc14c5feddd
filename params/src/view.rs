//! Looking at sets: every parameter in words, and what differs between two.

use std::{collections::BTreeSet, fmt};

use serde::Serialize;
use shm_schema::profile::Profile;

use crate::{
    definition::{self, Definition},
    set::{self, AxisSet},
};

/// One parameter of a set in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Row {
    /// Key in the image.
    pub number: u32,
    /// Name as files write it.
    pub key: String,
    /// The vendor's name.
    pub name: String,
    /// Value as files write it.
    pub value: String,
    /// What the value stands for, where it is one of an enumeration.
    pub meaning: String,
    /// Unit.
    pub unit: String,
    /// Function.
    pub function: String,
    /// The file names it; else it is the default.
    pub named: bool,
}

/// Every parameter of a set.
pub fn show(axis: &AxisSet) -> Vec<Row> {
    axis.values.iter().map(|(number, raw)| row(axis, *number, *raw)).collect()
}

fn row(axis: &AxisSet, number: u32, raw: i32) -> Row {
    let definition = definition::by_number(axis.profile, number);
    let wide = set::widen(axis.profile, number, raw);
    let choice =
        definition.and_then(|definition| definition.choices.iter().find(|choice| choice.raw == wide));
    let text = |pick: fn(&Definition) -> &String| {
        definition.map_or(String::new(), |definition| pick(definition).clone())
    };
    // An assigned word has no definition; its value is a function instance.
    let reference = || format!("\"{}\"", crate::key::reference_name(raw));
    Row {
        number,
        key: axis.name(number),
        name: text(|definition| &definition.name),
        value: definition.map_or_else(reference, |definition| definition.written(wide)),
        meaning: choice.map_or(String::new(), |choice| choice.word.clone()),
        unit: text(|definition| &definition.unit),
        function: text(|definition| &definition.function),
        named: axis.named.contains_key(&number),
    }
}

/// Everything about one parameter of a profile, found by its name.
#[derive(Clone, Debug, Serialize)]
pub struct Parameter {
    /// Profile.
    pub profile: &'static str,
    /// Its definition.
    #[serde(flatten)]
    pub definition: Definition,
    /// The range in words.
    pub range: String,
    /// The default as files write it.
    pub written_default: String,
}

/// The parameters of that name in all profiles; instances and widths may be given.
pub fn parameter(name: &str) -> Vec<Parameter> {
    let profiles = definition::PROFILES.into_iter();
    profiles.filter_map(|profile| find(profile, name).map(|definition| view(profile, definition))).collect()
}

/// The name of a parameter that was probably meant.
pub fn nearest(name: &str) -> Option<&'static str> {
    let all = definition::PROFILES.into_iter().flat_map(|profile| definition::definitions(profile).iter());
    let known = all.chain(definition::common().iter()).map(|definition| definition.key.as_str());
    crate::text::nearest(name, known)
}

fn find(profile: Profile, name: &str) -> Option<&'static Definition> {
    if profile == Profile::Etg61002 {
        return crate::key::etg(name).ok().map(|parts| parts.definition);
    }
    let common = || definition::common().iter().find(|definition| definition.key == name);
    let all = definition::definitions(profile).iter();
    let own = all.into_iter().find(|definition| definition.key.eq_ignore_ascii_case(name));
    own.or_else(|| common().filter(|_| profile == Profile::LenzeSm301))
}

fn view(profile: Profile, definition: &Definition) -> Parameter {
    Parameter {
        profile: profile.name(),
        definition: definition.clone(),
        range: definition.range(),
        written_default: definition.written(definition.default),
    }
}

/// One parameter that two sets see differently.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Name as files write it.
    pub key: String,
    /// The vendor's name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value in the first set; `absent` if it has none.
    pub left: String,
    /// Value in the second set.
    pub right: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}): {} -> {} {}", self.key, self.name, self.left, self.right, self.unit)
    }
}

/// What differs between two sets of one profile, ascending by key.
pub fn diff(left: &AxisSet, right: &AxisSet) -> Vec<Difference> {
    let keys: BTreeSet<u32> = left.values.keys().chain(right.values.keys()).copied().collect();
    let differ = keys.into_iter().filter(|key| left.values.get(key) != right.values.get(key));
    differ.map(|key| difference(left, right, key)).collect()
}

fn difference(left: &AxisSet, right: &AxisSet, key: u32) -> Difference {
    let [first, second] = [left, right].map(|axis| axis.values.get(&key).map(|raw| row(axis, key, *raw)));
    let shown = |row: &Option<Row>| row.as_ref().map_or("absent".to_string(), |row| row.value.clone());
    let (left, right) = (shown(&first), shown(&second));
    let known = first.or(second);
    let text = |pick: fn(&Row) -> &String| known.as_ref().map_or(String::new(), |row| pick(row).clone());
    Difference {
        key: text(|row| &row.key),
        name: text(|row| &row.name),
        unit: text(|row| &row.unit),
        left,
        right,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;

    fn set(text: &str) -> AxisSet {
        parse(text, "x").expect("right").axes.remove(0)
    }

    #[test]
    fn a_set_is_shown_in_the_words_of_its_file() {
        let rows = show(&set("profile = \"atv340\"\n[parameters]\nSC57 = 50\nSC39 = \"SLS Type 2\""));
        let of = |key: &str| rows.iter().find(|row| row.key == key).expect("shown");
        assert_eq!(
            (of("SC57").value.as_str(), of("SC57").unit.as_str(), of("SC57").named),
            ("50.0", "Hz", true)
        );
        assert_eq!(of("SC39").value, "\"SLS Type 2\"");
        assert_eq!(of("cc_factor").value, "7");
        assert!(!of("SC58").named);
    }

    #[test]
    fn a_difference_names_both_values() {
        let left = set("profile = \"etg-6100-2\"\n[parameters]\nSLS_2.velocity_limit = 5");
        let right = set(
            "profile = \"etg-6100-2\"\n[parameters]\nSLS_2.velocity_limit = 6\nSDI.position_zero_window = 3",
        );
        let all: Vec<_> = diff(&left, &right).iter().map(Difference::to_string).collect();
        assert_eq!(all.len(), 2);
        assert!(
            all[0].starts_with("SLS_2.velocity_limit (") && all[0].ends_with(": 5 -> 6 rpm"),
            "{}",
            all[0]
        );
        assert!(all[1].contains("absent -> 3"), "{}", all[1]);
        assert!(diff(&left, &left).is_empty());
    }

    #[test]
    fn a_parameter_is_explained_by_any_of_its_spellings() {
        assert_eq!(parameter("prm67")[0].range, "0 to 60000 rpm");
        assert_eq!(parameter("SLS_2.velocity_limit_u16")[0].definition.source, "T23.03, T23.04");
        assert_eq!(parameter("cc_factor")[0].written_default, "7");
        assert!(parameter("Prm999").is_empty());
        assert_eq!(nearest("Prm067"), Some("Prm67"));
    }
}
