//! One axis of a file: profile, serial number, its three tables.

use std::ops::Range;

use shm_schema::{
    image::SERIAL_OCTETS,
    profile::{Profile, common},
};
use toml_edit::{Item, Table, TableLike};

use super::{
    draft::{DraftAxis, Reader},
    flat, generic,
};
use crate::{
    definition::{self, Definition},
    set,
    text::nearest,
    value,
};

const KEYS: [&str; 5] = ["profile", "serial", "parameters", "common", "words"];

/// Reads one axis; `number` is that of an `[[axis]]` table, a file without them has axis 1.
pub(super) fn read(reader: &mut Reader, table: &Table, number: Option<u8>) -> Option<DraftAxis> {
    let known: Vec<&str> = KEYS.into_iter().chain(number.map(|_| "number")).collect();
    reader.refuse_others(table, &known, &format!("one of {}", known.join(", ")));
    let profile = profile(reader, table);
    let serial = serial(reader, table);
    let profile = profile?;
    let mut axis = DraftAxis {
        number: number.unwrap_or(1),
        profile,
        serial,
        values: set::defaults(profile)
            .into_iter()
            .map(|(key, value)| (key, set::widen(profile, key, value)))
            .collect(),
        named: std::collections::BTreeMap::new(),
        outside: Vec::new(),
    };
    for (name, span, item) in entries(reader, table, "parameters") {
        parameter(reader, &mut axis, &name, span, item);
    }
    for (name, span, item) in entries(reader, table, "common") {
        common_parameter(reader, &mut axis, &name, span, item);
    }
    for (name, span, item) in entries(reader, table, "words") {
        generic::word(reader, &mut axis, &name, span, item);
    }
    fixed(reader, &mut axis);
    resolution(&mut axis);
    generic::complete(reader, &mut axis);
    Some(axis)
}

fn entries<'a>(
    reader: &mut Reader,
    table: &'a Table,
    name: &str,
) -> Vec<(String, Option<Range<usize>>, &'a Item)> {
    let Some(item) = table.get(name) else {
        return Vec::new();
    };
    let Some(inner) = item.as_table_like() else {
        reader.refuse(item.span(), format!("{name} is no table"), format!("[{name}]"));
        return Vec::new();
    };
    flat(inner as &dyn TableLike)
}

fn profile(reader: &mut Reader, table: &Table) -> Option<Profile> {
    let names = definition::PROFILES.map(Profile::name);
    let expected = format!("profile = one of \"{}\"", names.join("\", \""));
    let Some(item) = table.get("profile") else {
        reader.refuse(table.span(), "no profile is named", &expected);
        return None;
    };
    let profile = item.as_str().and_then(definition::profile_by_name);
    if profile.is_none() {
        let near = item.as_str().and_then(|name| nearest(name, names.into_iter()));
        let expected = near.map_or(expected, |near| format!("\"{near}\"?"));
        reader.refuse(item.span(), "unknown profile", expected);
    }
    profile
}

fn serial(reader: &mut Reader, table: &Table) -> String {
    let Some(item) = table.get("serial") else {
        return String::new();
    };
    let text = item.as_str().unwrap_or_default();
    let printable = text.bytes().all(|octet| octet.is_ascii_graphic());
    let right = [!text.is_empty(), text.len() <= SERIAL_OCTETS, printable];
    if right.contains(&false) {
        let expected = format!("1 to {SERIAL_OCTETS} ASCII characters without blanks");
        reader.refuse(item.span(), "this is no serial number", expected);
    }
    text.into()
}

fn parameter(reader: &mut Reader, axis: &mut DraftAxis, name: &str, span: Option<Range<usize>>, item: &Item) {
    if axis.profile == Profile::Etg61002 {
        return generic::parameter(reader, axis, name, span, item);
    }
    match definition::by_name(axis.profile, name) {
        Some(definition) => store(reader, axis, definition.number, definition, name, span, item),
        None => reader.refuse(span, format!("unknown parameter {name}"), meant(axis.profile, name)),
    }
}

/// What was probably meant by an unknown name.
fn meant(profile: Profile, name: &str) -> String {
    let known = definition::definitions(profile).iter().map(|definition| definition.key.as_str());
    let common = definition::common().iter().any(|definition| definition.key == name);
    match nearest(name, known) {
        _ if common => "it in the table [common]".into(),
        Some(near) => format!("{near}?"),
        None => format!("a parameter of {}", profile.name()),
    }
}

fn common_parameter(
    reader: &mut Reader,
    axis: &mut DraftAxis,
    name: &str,
    span: Option<Range<usize>>,
    item: &Item,
) {
    let known = definition::common().iter().map(|definition| definition.key.as_str());
    let Some(found) = definition::common().iter().find(|definition| definition.key == name) else {
        let expected =
            nearest(name, known).map_or("a parameter of [common]".into(), |near| format!("{near}?"));
        return reader.refuse(span, format!("unknown key {name} in [common]"), expected);
    };
    if axis.profile != Profile::AmkKw {
        return store(reader, axis, found.number, found, name, span, item);
    }
    // DEC-40: this profile has parameters of its own for the same things.
    let own = match found.number {
        common::CC_FACTOR => "Prm105",
        common::POSITION_DIFFERENCE => "Prm2",
        common::SPEED_DIFFERENCE => "Prm3",
        common::PERIODS_PER_REVOLUTION => "Prm6",
        common::ENCODER_A => "Prm4",
        _ => "Prm5",
    };
    reader.refuse(
        span,
        format!("{name} has a parameter of its own in amk-kw"),
        format!("{own} in [parameters]"),
    );
}

/// Takes a value over, with its place; notes what lies outside its range.
pub(super) fn store(
    reader: &mut Reader,
    axis: &mut DraftAxis,
    key: u32,
    definition: &Definition,
    name: &str,
    span: Option<Range<usize>>,
    item: &Item,
) {
    let position = reader.position(span.clone());
    if let Some(first) = axis.named.insert(key, position) {
        return reader.refuse(
            span,
            format!("{name} names a parameter again, first in line {}", first.line),
            "each parameter once",
        );
    }
    let raw = match value::raw(definition, item) {
        Ok(raw) => raw,
        Err(expected) => return reader.refuse(item.span(), format!("{name} cannot be this"), expected),
    };
    axis.values.insert(key, raw);
    if !inside(definition, raw) {
        let message = format!("{name} is out of range");
        axis.outside.push((key, reader.diagnostic(item.span(), message, definition.range())));
    }
}

fn inside(definition: &Definition, raw: i64) -> bool {
    let in_range = (definition.min..=definition.max).contains(&raw);
    let listed = definition.choices.iter().any(|choice| choice.raw == raw);
    match definition.kind {
        definition::Kind::Choice => in_range && listed,
        _ => in_range,
    }
}

/// A parameter that always equals another one leaves no trace of its own, but must be equal.
fn fixed(reader: &mut Reader, axis: &mut DraftAxis) {
    for definition in definition::definitions(axis.profile) {
        let Some(twin) = &definition.fixed_to else { continue };
        let Some(raw) = axis.values.remove(&definition.number) else { continue };
        let twin_raw = definition::by_name(axis.profile, twin).and_then(|twin| axis.values.get(&twin.number));
        if twin_raw != Some(&raw) {
            let expected = format!("the value of {twin}, which it always equals");
            let mut diagnostic =
                reader.diagnostic(None, format!("{} differs from {twin}", definition.key), expected);
            diagnostic.position = axis.named.get(&definition.number).copied().unwrap_or_default();
            reader.push(diagnostic);
        }
        axis.named.remove(&definition.number);
    }
}

/// Lenze states the periods of its encoder in C15420: whichever is named stands for both (DEC-50).
fn resolution(axis: &mut DraftAxis) {
    const OWN: u32 = shm_schema::profile::lenze_key(15_420, 0);
    if axis.profile != Profile::LenzeSm301 {
        return;
    }
    let named = |key| axis.named.contains_key(&key);
    let (from, to) = if named(OWN) {
        (OWN, common::PERIODS_PER_REVOLUTION)
    } else {
        (common::PERIODS_PER_REVOLUTION, OWN)
    };
    if named(from) && !named(to) {
        let periods = axis.values.get(&from).copied().unwrap_or(1);
        axis.values.insert(to, periods);
    }
}
