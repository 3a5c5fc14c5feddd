//! Reading a parameter file: every error at once, each with its place.

mod axis;
mod draft;
mod generic;

use std::collections::BTreeSet;

use toml_edit::{Document, TableLike};

use crate::{diagnostic::Diagnostic, set::Machine};
use draft::Reader;
pub(crate) use draft::{Draft, DraftAxis};

/// Reads a file into the sets of its axes.
///
/// Refused is what the image cannot hold and what lies outside a parameter's range. A value
/// of the AMK profile that a plausibility row (code 3605) forbids is not refused here: the
/// channels refuse it with its code, and [`crate::check`] tells it beforehand.
///
/// # Errors
/// Every reason at once, in the order of the file.
pub fn parse(text: &str, file: &str) -> Result<Machine, Vec<Diagnostic>> {
    let draft = read(text, file);
    let axes: Vec<_> = draft.axes.iter().map(DraftAxis::set).collect();
    let diagnostics = draft.refusals();
    if diagnostics.is_empty() {
        return Ok(Machine { file: file.into(), axes });
    }
    Err(diagnostics)
}

/// Reads as much as can be understood.
pub(crate) fn read(text: &str, file: &str) -> Draft {
    let mut reader = Reader::new(text, file);
    let mut axes = match Document::parse(text) {
        Ok(document) => machine(&mut reader, document.as_table()),
        Err(error) => {
            let message = error.message().lines().next().unwrap_or_default().to_string();
            reader.refuse(error.span(), message, "a TOML file");
            Vec::new()
        }
    };
    axes.sort_by_key(|axis| axis.number);
    Draft { axes, diagnostics: reader.finish() }
}

fn machine(reader: &mut Reader, table: &toml_edit::Table) -> Vec<DraftAxis> {
    let Some(list) = table.get("axis") else {
        return axis::read(reader, table, None).into_iter().collect();
    };
    reader.refuse_others(table, &["axis"], "only [[axis]] tables beside an [[axis]] table");
    let Some(list) = list.as_array_of_tables() else {
        reader.refuse(list.span(), "axis is no list of tables", "[[axis]]");
        return Vec::new();
    };
    let mut seen = BTreeSet::new();
    let mut axes = Vec::new();
    for table in list {
        let number = axis_number(reader, table);
        if number.is_some_and(|number| !seen.insert(number)) {
            let span = table.get("number").and_then(toml_edit::Item::span);
            reader.refuse(span, "this axis number is used twice", "a number of its own for each axis");
        }
        axes.extend(axis::read(reader, table, Some(number.unwrap_or(1))));
    }
    axes
}

fn axis_number(reader: &mut Reader, table: &toml_edit::Table) -> Option<u8> {
    let expected = format!("number = 1 to {}", shm_schema::AXES_MAX);
    let Some(item) = table.get("number") else {
        reader.refuse(table.span(), "an [[axis]] without a number", &expected);
        return None;
    };
    let number = item.as_integer().filter(|number| (1..=shm_schema::AXES_MAX as i64).contains(number));
    if number.is_none() {
        reader.refuse(item.span(), "this is no axis number", &expected);
    }
    number.map(|number| number as u8)
}

/// Keys of a table with their spans and values, nested tables joined with a dot (DEC-51).
pub(crate) fn flat(table: &dyn TableLike) -> Vec<(String, Option<std::ops::Range<usize>>, &toml_edit::Item)> {
    let mut all = Vec::new();
    for (name, item) in table.iter() {
        let span = table.get_key_value(name).and_then(|(key, _)| key.span());
        match item.as_table_like() {
            None => all.push((name.to_string(), span, item)),
            Some(inner) => {
                let inner = flat(inner).into_iter();
                all.extend(inner.map(|(rest, span, item)| (format!("{name}.{rest}"), span, item)));
            }
        }
    }
    all
}

#[cfg(test)]
mod tests;
