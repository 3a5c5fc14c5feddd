//! The object dictionary of a generic set: every object with index entries, width and value.

use std::{collections::BTreeMap, sync::LazyLock};

use serde::{Deserialize, Serialize};
use shm_schema::{
    catalogue,
    profile::{Profile, common},
};

use crate::{
    definition::{self, Definition, Kind},
    key,
    set::AxisSet,
};

/// One object with the entries that a set gives it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Object {
    /// Row of the profile's tables.
    pub row: String,
    /// Name with its width.
    pub name: String,
    /// Data type.
    pub data_type: String,
    /// `VAR` or `ARRAY`.
    pub object_code: String,
    /// M, O or C.
    pub condition: String,
    /// Entries: sub-index and value. Of an array sub-index 0 is the number of entries
    /// (ETG-GEN-05); instances that the set does not name are left out.
    pub entries: Vec<Entry>,
}

/// One entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Entry {
    /// Sub-index; 0 for a variable.
    pub sub_index: u32,
    /// Value; a reference by the name of its function instance.
    pub value: String,
}

#[derive(Deserialize)]
struct Catalogue {
    param: Vec<Row>,
}

#[derive(Deserialize)]
struct Row {
    number: String,
    name: String,
    object_code: String,
    r#type: String,
    mco: String,
}

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let catalogue: Catalogue = toml::from_str(catalogue::ETG)
        .expect("the catalogues are part of the build and checked by its tests");
    catalogue.param
});

/// The objects of a set, in the order of the profile's tables.
pub fn dictionary(axis: &AxisSet) -> Vec<Object> {
    let mut objects = Vec::new();
    for definition in definition::definitions(Profile::Etg61002) {
        let values = values(axis, definition);
        let rows: Vec<&Row> = definition
            .source
            .split(", ")
            .filter_map(|number| ROWS.iter().find(|row| row.number == number))
            .collect();
        if let (Some(row), false) = (narrowest(&rows, &values), values.is_empty()) {
            objects.push(object(row, definition, &values));
        }
    }
    objects
}

/// Values of an object by instance.
fn values(axis: &AxisSet, definition: &Definition) -> BTreeMap<u32, i32> {
    let own = axis.values.iter().filter(|(key, _)| **key < common::CONTROL_WORD);
    let own = own.filter(|(key, _)| **key & 0xFFFF_00FF == definition.number);
    own.map(|(key, value)| (key >> 8 & 0xFF, *value)).collect()
}

/// DEC-40: a width is chosen from the value; one array has one width.
fn narrowest<'a>(rows: &[&'a Row], values: &BTreeMap<u32, i32>) -> Option<&'a Row> {
    let fits = |row: &&&Row| values.values().all(|value| range(&row.r#type).contains(&i64::from(*value)));
    rows.iter().find(fits).or(rows.last()).copied()
}

fn range(data_type: &str) -> std::ops::RangeInclusive<i64> {
    match data_type {
        "BOOLEAN" => 0..=1,
        "INTEGER16" => -0x8000..=0x7FFF,
        "UNSIGNED16" => 0..=0xFFFF,
        "INTEGER32" => -0x8000_0000..=0x7FFF_FFFF,
        _ => 0..=0xFFFF_FFFF,
    }
}

fn object(row: &Row, definition: &Definition, values: &BTreeMap<u32, i32>) -> Object {
    let shown = |value: i32| {
        if definition.kind == Kind::Reference { key::reference_name(value) } else { value.to_string() }
    };
    let array = row.object_code == "ARRAY";
    let last = values.keys().last().copied().unwrap_or_default();
    let count = array.then(|| Entry { sub_index: 0, value: last.to_string() });
    let entries = values.iter().map(|(instance, value)| Entry {
        sub_index: if array { *instance } else { 0 },
        value: shown(*value),
    });
    Object {
        row: row.number.clone(),
        name: row.name.clone(),
        data_type: row.r#type.clone(),
        object_code: row.object_code.clone(),
        condition: row.mco.clone(),
        entries: count.into_iter().chain(entries).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn objects(lines: &str) -> Vec<Object> {
        let text = format!("profile = \"etg-6100-2\"\n[parameters]\n{lines}");
        dictionary(&crate::parse(&text, "x").expect("right").axes[0])
    }

    /// ETG-GEN-05, DEC-40
    #[test]
    fn instances_are_sub_indices_of_one_array() {
        let all = objects("SLS_1.velocity_limit = 500\nSLS_3.velocity_limit = 700");
        let limit = all.iter().find(|object| object.row == "T23.03").expect("16 bits are enough");
        assert_eq!((limit.data_type.as_str(), limit.object_code.as_str()), ("UNSIGNED16", "ARRAY"));
        let entries: Vec<_> =
            limit.entries.iter().map(|entry| (entry.sub_index, entry.value.as_str())).collect();
        assert_eq!(entries, [(0, "3"), (1, "500"), (3, "700")]);
    }

    #[test]
    fn one_wide_value_makes_the_whole_array_wide() {
        let all = objects("SLS_1.velocity_limit = 500\nSLS_3.velocity_limit = 70000");
        assert!(all.iter().any(|object| object.row == "T23.04"));
        assert!(!all.iter().any(|object| object.row == "T23.03"));
    }

    #[test]
    fn references_are_shown_by_name_and_variables_have_one_entry() {
        let all = objects("SLS_1.velocity_limit = 500");
        let reaction = all.iter().find(|object| object.row == "T23.09").expect("defaults to STO");
        assert_eq!(reaction.entries[1].value, "STO");
        let restart = all.iter().find(|object| object.row == "T11.02").expect("always there");
        assert_eq!(restart.entries, [Entry { sub_index: 0, value: "1".into() }]);
    }
}
