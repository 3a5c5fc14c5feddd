//! A new parameter file: every parameter of a profile with unit, range and meaning.

use std::fmt::Write as _;

use shm_schema::profile::Profile;

use crate::{
    definition::{self, Definition, Kind},
    set,
};

/// The text of a new file in delivery state. Every parameter is there; it permits nothing but
/// standstill (DEC-28), so that what a machine may do is always somebody's deliberate line.
pub fn new_file(profile: Profile, serial: &str) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "# Safety parameters, profile {}.", profile.name());
    text.push_str("# Delivery state: permits nothing but standstill. Change what the machine needs, then\n");
    text.push_str("# `safepair params check` this file and `safepair params seal` it to one device.\n\n");
    let _ = writeln!(text, "profile = \"{}\"\nserial = \"{serial}\"\n\n[parameters]", profile.name());
    let mut function = "";
    for definition in
        definition::definitions(profile).iter().filter(|definition| definition.fixed_to.is_none())
    {
        if definition.function != function {
            function = &definition.function;
            let _ = writeln!(text, "\n# ---- {function} ----");
        }
        parameter(&mut text, profile, definition);
    }
    if profile != Profile::AmkKw {
        text.push_str("\n[common]\n");
        for definition in definition::common() {
            parameter(&mut text, profile, definition);
        }
    }
    text
}

/// One parameter with its comment. Objects of the generic profile stay commented out: a
/// function that no key names is not supported (DEC-40).
fn parameter(text: &mut String, profile: Profile, definition: &Definition) {
    let _ = writeln!(text, "\n# {}: {}", definition.name, definition.text);
    let _ = writeln!(text, "# Range: {}", definition.range());
    for choice in &definition.choices {
        let meaning = if choice.text.is_empty() { String::new() } else { format!(": {}", choice.text) };
        let _ = writeln!(text, "#   {} {}{meaning}", choice.raw, choice.word);
    }
    let common = definition::common().iter().any(|common| common.number == definition.number);
    let object =
        profile == Profile::Etg61002 && !common && definition.key != "STO.restart_acknowledge_behavior";
    let optional = object || definition.optional;
    let mark = if optional { "# " } else { "" };
    let key = spelling(profile, definition, common);
    let _ = writeln!(text, "{mark}{key} = {}", written(profile, definition));
}

fn spelling(profile: Profile, definition: &Definition, common: bool) -> String {
    if profile == Profile::Etg61002 && !common {
        return set::name(profile, definition.number | 0x100);
    }
    let plain = definition.key.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_');
    if plain { definition.key.clone() } else { format!("\"{}\"", definition.key) }
}

/// The default as a file writes it; a missing object of the generic profile as 0.
fn written(profile: Profile, definition: &Definition) -> String {
    let bits = definition.kind == Kind::Bits;
    let raw = if bits { i64::from(definition.default as u32) } else { definition.default };
    let reference = profile == Profile::Etg61002 && definition.kind == Kind::Reference;
    if reference && raw == 0 { "\"none\"".into() } else { definition.written(raw) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AxisSet, check, parse};

    #[test]
    fn a_new_file_is_the_delivery_state_and_names_everything() {
        for profile in definition::PROFILES {
            let text = new_file(profile, "SIM-0001");
            let machine = parse(&text, "new.toml").unwrap_or_else(|errors| panic!("{errors:#?}"));
            assert_eq!(machine.axes[0].values, AxisSet::delivery(profile, 1, "SIM-0001").values);
            assert!(check(&text, "new.toml").passed(), "{}", profile.name());
            for definition in
                definition::definitions(profile).iter().filter(|definition| definition.fixed_to.is_none())
            {
                let object = definition.key.split('.').next_back().expect("a name");
                assert!(text.contains(object), "{}", definition.key);
            }
        }
    }

    #[test]
    fn the_commented_lines_of_the_generic_profile_are_right_too() {
        let text = new_file(Profile::Etg61002, "S");
        let all: String = text
            .lines()
            .map(|line| {
                line.strip_prefix("# ")
                    .filter(|rest| rest.contains('.') && rest.contains(" = ") && !rest.contains(':'))
                    .unwrap_or(line)
                    .to_string()
                    + "\n"
            })
            .collect();
        let machine = parse(&all, "all.toml").unwrap_or_else(|errors| panic!("{errors:#?}"));
        assert!(machine.axes[0].values.len() >= definition::definitions(Profile::Etg61002).len());
    }
}
