//! The vendors' plain lists: one `Name = value` a line, comments behind `#` or `;`.

use std::fmt::Write as _;

use shm_schema::profile::Profile;

use crate::{
    definition::{self, Kind},
    diagnostic::{Diagnostic, Position},
    file,
    set::{self, AxisSet},
};

/// Every parameter of a set as a plain list, without quotes; assigned words are not in it.
pub fn export(axis: &AxisSet) -> String {
    let mut text = format!("# {} axis {} serial {}\n", axis.profile.name(), axis.number, axis.serial);
    for (number, raw) in &axis.values {
        let Some(definition) = definition::by_number(axis.profile, *number) else { continue };
        let value = definition.written(set::widen(axis.profile, *number, *raw));
        let _ = writeln!(text, "{} = {}", axis.name(*number), value.trim_matches('"'));
    }
    text
}

/// Turns a plain list into a parameter file.
///
/// # Errors
/// Every line that is no parameter of the profile, with its place in the list.
pub fn import(text: &str, name: &str, profile: Profile, serial: &str) -> Result<String, Vec<Diagnostic>> {
    let mut own = String::new();
    let mut shared = String::new();
    let mut places = [Vec::new(), Vec::new()];
    let mut diagnostics = Vec::new();
    for (at, line) in text.lines().enumerate() {
        let line = line.split(['#', ';']).next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let Some((key, value)) = line.split_once('=') else {
            diagnostics.push(diagnostic(name, at + 1, format!("{line} is no assignment"), "Name = value"));
            continue;
        };
        let (key, value) = (key.trim(), value.trim().trim_matches('"'));
        let is_shared = definition::common().iter().any(|definition| definition.key == key);
        let (table, places) =
            if is_shared { (&mut shared, &mut places[1]) } else { (&mut own, &mut places[0]) };
        let _ = writeln!(table, "\"{}\" = {}", escaped(key), quoted(profile, key, value));
        places.push(at + 1);
    }
    let head =
        format!("profile = \"{}\"\nserial = \"{}\"\n\n[parameters]\n", profile.name(), escaped(serial));
    let shared_head = if shared.is_empty() { "" } else { "\n[common]\n" };
    let lines: Vec<usize> = vec![0; head.lines().count()]
        .into_iter()
        .chain(places[0].iter().copied())
        .chain(vec![0; shared_head.lines().count()])
        .chain(places[1].iter().copied())
        .collect();
    let result = format!("{head}{own}{shared_head}{shared}");
    diagnostics.extend(file::read(&result, name).refusals().into_iter().map(|mut found| {
        // The reader saw the new file; the person has the list.
        let line = lines.get(found.position.line.wrapping_sub(1)).copied().unwrap_or_default();
        found.position = Position { line, column: 1 };
        found
    }));
    diagnostics.sort_by_key(|diagnostic| diagnostic.position);
    if diagnostics.is_empty() { Ok(result) } else { Err(diagnostics) }
}

fn diagnostic(file: &str, line: usize, message: String, expected: &str) -> Diagnostic {
    Diagnostic {
        file: file.into(),
        position: Position { line, column: 1 },
        message,
        expected: expected.into(),
    }
}

fn escaped(text: &str) -> String {
    text.chars()
        .filter(|letter| !letter.is_control())
        .flat_map(|letter| match letter {
            '"' | '\\' => vec!['\\', letter],
            other => vec![other],
        })
        .collect()
}

/// A value as TOML: words and references in quotes, numbers as they are.
fn quoted(profile: Profile, key: &str, value: &str) -> String {
    let shared = definition::common().iter().find(|definition| definition.key == key);
    let etg = || crate::key::etg(key).ok().map(|parts| parts.definition);
    let own = if profile == Profile::Etg61002 { etg() } else { definition::by_name(profile, key) };
    let kind = own.or(shared).map(|definition| definition.kind);
    let number = value.parse::<f64>().is_ok() || value.starts_with("0x");
    let word = matches!(kind, Some(Kind::Word | Kind::Reference));
    if number && !word { value.into() } else { format!("\"{}\"", escaped(value)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;

    #[test]
    fn an_exported_set_comes_back_the_same() {
        for profile in definition::PROFILES {
            let set = AxisSet::delivery(profile, 1, "S-1");
            let list = export(&set);
            let text = import(&list, "list", profile, "S-1").unwrap_or_else(|errors| panic!("{errors:#?}"));
            let again = parse(&text, "x").expect("right").axes.remove(0);
            assert_eq!(again.values, set.values, "{}", profile.name());
        }
    }

    #[test]
    fn a_wrong_line_is_named_by_its_place_in_the_list() {
        let errors = import(
            "# drive 3\nPrm67 = 3000 ; rpm\n\nPrm7000 = 1\nnothing\n",
            "list.prm",
            Profile::AmkKw,
            "S",
        )
        .expect_err("wrong");
        let lines: Vec<_> = errors.iter().map(ToString::to_string).collect();
        assert!(lines[0].starts_with("list.prm:4:1: unknown parameter Prm7000"), "{lines:?}");
        assert!(lines[1].starts_with("list.prm:5:1: nothing is no assignment"), "{lines:?}");
    }
}
