//! Turns the fact tables in `facts/` into constants, so that no number of a
//! catalogue is typed twice (design 3.8).

use std::{env, fmt::Write as _, fs, path::Path};

use toml::{Table, Value};

const WORDS: [(&str, &str); 4] = [
    ("amk_kw", "facts/words-amk-kw.toml"),
    ("lenze_sm301", "facts/words-lenze-sm301.toml"),
    ("atv340", "facts/words-atv340.toml"),
    ("etg_6100_2", "facts/words-etg-6100-2.toml"),
];

/// Module, parameter table; in the order in which the profiles are numbered.
const PARAMETERS: [(&str, &str); 5] = [
    ("amk_kw", "facts/parameters-amk-kw.toml"),
    ("lenze_sm301", "facts/parameters-lenze-sm301.toml"),
    ("atv340", "facts/parameters-atv340.toml"),
    ("etg_6100_2", "facts/parameters-etg-6100-2.toml"),
    ("common", "facts/parameters-common.toml"),
];

const PARAMETER: &str = "
/// Range and default of one parameter, as raw values of the safety image.
///
/// A bit field takes every pattern: its range is that of the raw value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Key in the image ([`crate::profile`]).
    pub key: u32,
    /// Smallest permitted value.
    pub min: i64,
    /// Largest permitted value.
    pub max: i64,
    /// Value when a file leaves the parameter out (DEC-28).
    pub default: i32,
}
";

fn main() {
    println!("cargo:rerun-if-changed=facts");
    let mut out = String::new();
    for (module, file) in WORDS {
        let table = read(file);
        let doc = table["profile"].as_str().expect("profile is a name");
        writeln!(out, "/// Control and status bits of `{doc}`.\npub mod {module} {{").unwrap();
        writeln!(
            out,
            "/// Octets of each word as replay shows it.\npub const OCTETS: usize = {};",
            table["octets"]
        )
        .unwrap();
        for word in ["control", "status"] {
            write_bits(&mut out, word, table[word].as_array().expect("rows"));
        }
        write_parameters(&mut out, &read(parameters_of(module)));
        if module == "amk_kw" {
            write_thresholds(&mut out, &read("facts/rules-amk-kw.toml"));
        }
        out.push_str("}\n");
    }
    out.push_str(PARAMETER);
    out.push_str(
        "/// Parameters of profiles that have none of their own for it (DEC-50).\npub mod common {\n",
    );
    write_parameters(&mut out, &read(parameters_of("common")));
    out.push_str("}\n");
    write_etg(&mut out, &read("facts/etg-objects.toml"));
    let target = Path::new(&env::var("OUT_DIR").expect("set by cargo")).join("facts.rs");
    fs::write(target, out).expect("OUT_DIR is writable");
}

fn read(file: &str) -> Table {
    fs::read_to_string(file)
        .unwrap_or_else(|e| panic!("{file}: {e}"))
        .parse()
        .unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn text<'a>(row: &'a Value, key: &str) -> &'a str {
    row[key].as_str().expect("a text")
}

fn number(row: &Value, key: &str) -> i64 {
    row[key].as_integer().expect("a number")
}

fn parameters_of(module: &str) -> &'static str {
    let row = PARAMETERS.iter().find(|(name, _)| *name == module);
    row.expect("every module has a table").1
}

/// The table of one profile, sorted by key; `ETG` keys have instance 0. Parameters that always
/// equal another one are not in the image.
fn write_parameters(out: &mut String, table: &Table) {
    let rows = table["parameter"].as_array().expect("rows");
    let mut rows: Vec<&Value> = rows.iter().filter(|row| row.get("fixed_to").is_none()).collect();
    rows.sort_by_key(|row| number(row, "number"));
    writeln!(out, "/// Every parameter of the safety image, ascending by key.\npub const PARAMETERS: [super::Parameter; {}] = [", rows.len()).unwrap();
    for row in rows {
        let bits = text(row, "kind") == "bits";
        writeln!(
            out,
            "super::Parameter {{ key: {}, min: {}, max: {}, default: {} }}, // {}",
            number(row, "number"),
            if bits { i64::from(i32::MIN) } else { number(row, "min") },
            if bits { i64::from(i32::MAX) } else { number(row, "max") },
            number(row, "default"),
            text(row, "key")
        )
        .unwrap();
    }
    out.push_str("];\n");
}

/// Thresholds that the catalogue leaves open, one place each (DEC-46).
fn write_thresholds(out: &mut String, table: &Table) {
    out.push_str("/// Thresholds of plausibility rows that the catalogue leaves open (DEC-46).\npub mod thresholds {\n");
    for row in table["threshold"].as_array().expect("rows") {
        writeln!(
            out,
            "/// {}: {} ({}).\npub const {}: i64 = {};",
            text(row, "unit"),
            text(row, "reason"),
            text(row, "source"),
            text(row, "name"),
            number(row, "value")
        )
        .unwrap();
    }
    out.push_str("}\n");
}

fn write_bits(out: &mut String, word: &str, rows: &[Value]) {
    writeln!(out, "/// Bits of the {word} word.\npub mod {word} {{").unwrap();
    for row in rows {
        writeln!(
            out,
            "/// {} ({})\npub const {}: u8 = {};",
            text(row, "meaning"),
            text(row, "source"),
            text(row, "name"),
            number(row, "bit")
        )
        .unwrap();
    }
    let named = rows.iter().map(|row| format!("(\"{}\", {})", text(row, "name"), number(row, "bit")));
    let named = named.collect::<Vec<_>>().join(", ");
    writeln!(out, "/// Name and number of every bit.\npub const BITS: &[(&str, u8)] = &[{named}];").unwrap();
    out.push_str("}\n");
}

fn write_etg(out: &mut String, table: &Table) {
    out.push_str("/// Functions of the generic profile and their objects (DEC-40).\npub mod etg {\n");
    let functions = table["function"].as_array().expect("functions").iter();
    let named = functions.map(|row| format!("(\"{}\", {})", text(row, "name"), number(row, "number")));
    let named = named.collect::<Vec<_>>().join(", ");
    writeln!(
        out,
        "/// Name and number of every function.\npub const FUNCTIONS: &[(&str, u32)] = &[{named}];"
    )
    .unwrap();
    for function in table["function"].as_array().expect("functions") {
        let name = text(function, "name");
        writeln!(
            out,
            "/// Number of {name} in keys and references.\npub const {name}: u32 = {};",
            number(function, "number")
        )
        .unwrap();
        let module = name.to_lowercase();
        writeln!(out, "/// Objects of {name}.\npub mod {module} {{").unwrap();
        for object in function.get("object").and_then(Value::as_array).into_iter().flatten() {
            writeln!(
                out,
                "/// {} {} ({})\npub const {}: u32 = {};",
                text(object, "name"),
                text(object, "unit").replace(['[', ']'], ""),
                text(object, "source"),
                text(object, "name").to_uppercase(),
                number(object, "number")
            )
            .unwrap();
        }
        out.push_str("}\n");
    }
    out.push_str("}\n");
}
