//! What only the generic profile has: instances, references, assigned words (DEC-40, DEC-41).

use std::{collections::BTreeSet, ops::Range};

use shm_schema::profile::{Profile, common};
use toml_edit::Item;

use super::{
    axis::store,
    draft::{DraftAxis, Reader},
};
use crate::{
    definition::{self, Kind},
    key,
};

/// Bits of the words that a file may assign: those of octets 5 to 32.
const ASSIGNABLE: std::ops::RangeInclusive<u32> = 32..=255;

pub(super) fn parameter(
    reader: &mut Reader,
    axis: &mut DraftAxis,
    name: &str,
    span: Option<Range<usize>>,
    item: &Item,
) {
    let parts = match key::etg(name) {
        Ok(parts) => parts,
        Err(expected) => return reader.refuse(span, format!("unknown parameter {name}"), expected),
    };
    store(reader, axis, parts.number, parts.definition, name, span, item);
    let raw = axis.values.get(&parts.number).copied();
    if let (Some((signed, bits)), Some(raw)) = (parts.width, raw)
        && !fits(signed, bits, raw)
    {
        let kind = if signed { "signed" } else { "unsigned" };
        reader.refuse(item.span(), format!("{raw} does not fit"), format!("a {kind} number of {bits} bits"));
    }
}

fn fits(signed: bool, bits: u32, raw: i64) -> bool {
    let all = 1_i64 << bits.min(32);
    if signed { (-all / 2..all / 2).contains(&raw) } else { (0..all).contains(&raw) }
}

/// An assignment such as `control.32 = "SLS_5"`.
pub(super) fn word(
    reader: &mut Reader,
    axis: &mut DraftAxis,
    name: &str,
    span: Option<Range<usize>>,
    item: &Item,
) {
    const EXPECTED: &str = "control.32 to control.255 or status.32 to status.255";
    if axis.profile != Profile::Etg61002 {
        return reader.refuse(span, "only the words of etg-6100-2 can be assigned", "no [words] here");
    }
    let parts = name.split_once('.').and_then(|(word, bit)| Some((word, bit.parse::<u32>().ok()?)));
    let base = match parts {
        Some(("control", bit)) if ASSIGNABLE.contains(&bit) => Some(common::CONTROL_WORD + bit),
        Some(("status", bit)) if ASSIGNABLE.contains(&bit) => Some(common::STATUS_WORD + bit),
        _ => None,
    };
    let Some(number) = base else {
        return reader.refuse(span, format!("{name} cannot be assigned"), EXPECTED);
    };
    let reference =
        item.as_str().ok_or("a function instance such as \"SLS_5\"".into()).and_then(key::reference);
    match reference {
        Ok(reference) => {
            axis.named.insert(number, reader.position(span));
            axis.values.insert(number, reference);
        }
        Err(expected) => reader.refuse(item.span(), "this is no function instance", expected),
    }
}

/// Instances that a key names, as references.
pub(crate) fn instances(axis: &DraftAxis) -> BTreeSet<u32> {
    let keys = axis.values.keys().filter(|key| **key < common::CONTROL_WORD);
    keys.map(|key| key >> 8).collect()
}

/// Adds what a named instance has even if no key says so, and refuses references to
/// instances that nothing names: a reaction that is not there would be none.
pub(super) fn complete(reader: &mut Reader, axis: &mut DraftAxis) {
    if axis.profile != Profile::Etg61002 {
        return;
    }
    let instances = instances(axis);
    for instance in &instances {
        let own = definition::definitions(axis.profile)
            .iter()
            .filter(|definition| definition.number >> 16 == instance >> 8);
        for definition in own.filter(|definition| definition.default != 0) {
            let key = definition.number | (instance & 0xFF) << 8;
            axis.values.entry(key).or_insert(definition.default);
        }
    }
    let references: Vec<_> = axis
        .values
        .iter()
        .filter(|(key, _)| is_reference(**key))
        .map(|(key, raw)| (*key, *raw as u32))
        .collect();
    for (key, target) in references {
        if target != 0 && !instances.contains(&target) {
            let name = key::reference_name(target as i32);
            let at = axis.named.get(&key).copied().unwrap_or_default();
            let mut diagnostic = reader.diagnostic(
                None,
                format!(
                    "{} refers to {name}, which no parameter names",
                    key::etg_name(key).unwrap_or_default()
                ),
                format!("parameters of {name}"),
            );
            diagnostic.position = at;
            reader.push(diagnostic);
        }
    }
}

fn is_reference(key: u32) -> bool {
    let definition = (key < common::CONTROL_WORD).then(|| definition::by_number(Profile::Etg61002, key));
    definition.flatten().is_some_and(|definition| definition.kind == Kind::Reference)
}
