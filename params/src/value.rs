//! One value of a file becomes one raw value of the image.

use toml_edit::Item;

use crate::{
    definition::{Definition, Kind},
    key,
    text::nearest,
};

/// The raw value, or what was expected. Ranges are judged elsewhere; what cannot be
/// written in the image at all is refused here.
pub fn raw(definition: &Definition, item: &Item) -> Result<i64, String> {
    let word = item.as_str().map(|text| word(definition, text));
    match (definition.kind, word) {
        (Kind::Reference, _) => match item.as_str() {
            Some(name) => key::reference(name),
            None => Err(definition.range()),
        },
        (_, Some(raw)) => raw,
        (Kind::Decimal, None) => tenths(item)
            .ok_or_else(|| format!("a number with at most one decimal place, {}", definition.range())),
        (Kind::Word, None) => Err(format!("one of {}", definition.range())),
        (Kind::Integer | Kind::Bits, None) => {
            integer(item).ok_or_else(|| format!("a whole number, {}", definition.range()))
        }
        (Kind::Choice, None) => {
            let number = integer(item).or_else(|| item.as_bool().map(i64::from));
            number.ok_or_else(|| format!("one of {}", definition.range()))
        }
    }
}

fn integer(item: &Item) -> Option<i64> {
    item.as_integer()
}

/// A decimal number in tenths, exactly.
fn tenths(item: &Item) -> Option<i64> {
    if let Some(whole) = item.as_integer() {
        return whole.checked_mul(10);
    }
    let tenths = item.as_float()? * 10.0;
    let rounded = tenths.round();
    let exact = (tenths - rounded).abs() < 1e-6;
    (exact && rounded.abs() < 1e15).then_some(rounded as i64)
}

/// A word of the parameter; numbers in quotes are none.
fn word(definition: &Definition, text: &str) -> Result<i64, String> {
    let numeric = matches!(definition.kind, Kind::Choice | Kind::Bits);
    let choices = if numeric { &[] } else { definition.choices.as_slice() };
    if let Some(choice) = choices.iter().find(|choice| choice.word == text) {
        return Ok(choice.raw);
    }
    let near = nearest(text, choices.iter().map(|choice| choice.word.as_str()));
    Err(match near {
        Some(near) => format!("\"{near}\"?"),
        None if choices.is_empty() => format!("a number, {}", definition.range()),
        None => definition.range(),
    })
}
