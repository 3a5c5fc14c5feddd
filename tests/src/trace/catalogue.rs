//! The requirements of the catalogues and the decisions.

use std::collections::BTreeSet;

use toml::Value;

/// The catalogues as the schema carries them.
const CATALOGUES: [&str; 5] = [
    include_str!("../../../shm-schema/catalogue/amk-functions.toml"),
    include_str!("../../../shm-schema/catalogue/amk-parameters-diagnosis.toml"),
    include_str!("../../../shm-schema/catalogue/lenze-sm301.toml"),
    include_str!("../../../shm-schema/catalogue/schneider-atv340.toml"),
    include_str!("../../../shm-schema/catalogue/etg-6100-2.toml"),
];

const DECISIONS: &str = include_str!("../../../shm-schema/catalogue/decisions.md");

/// Kinds that bind the machine builder or say something about a document.
const ASSUMPTIONS: [&str; 3] = ["hardware", "info", "commissioning"];

/// One requirement.
#[derive(Debug, Clone)]
pub struct Requirement {
    /// Id.
    pub id: String,
    /// Kind, `decision` for a DEC.
    pub kind: String,
    /// First sentence.
    pub statement: String,
}

impl Requirement {
    /// Whether code and a test have to cite it.
    pub fn is_for_software(&self) -> bool {
        !ASSUMPTIONS.contains(&self.kind.as_str())
    }
}

/// All requirements in order, and every id of any row.
///
/// # Panics
/// When a catalogue is no TOML.
pub fn read() -> (Vec<Requirement>, BTreeSet<String>) {
    let mut requirements = Vec::new();
    let mut known = BTreeSet::new();
    for text in CATALOGUES {
        let table: toml::Table = text.parse().expect("a catalogue is TOML");
        for rows in table.values().filter_map(Value::as_array) {
            known.extend(rows.iter().filter_map(|row| text_of(row, "id")));
        }
        let rows = table.get("req").and_then(Value::as_array).into_iter().flatten();
        requirements.extend(rows.filter_map(requirement));
    }
    requirements.extend(DECISIONS.lines().filter_map(decision));
    known.extend(requirements.iter().map(|requirement| requirement.id.clone()));
    (requirements, known)
}

fn text_of(row: &Value, key: &str) -> Option<String> {
    row.get(key).and_then(Value::as_str).map(str::to_string)
}

fn requirement(row: &Value) -> Option<Requirement> {
    let statement = first_sentence(&text_of(row, "text")?);
    Some(Requirement { id: text_of(row, "id")?, kind: text_of(row, "kind")?, statement })
}

/// `- **DEC-01 Strictness.** A limit is violated when …`
fn decision(line: &str) -> Option<Requirement> {
    let rest = line.strip_prefix("- **")?;
    let (head, body) = rest.split_once("**")?;
    let (id, title) = head.split_once(' ').unwrap_or((head, ""));
    let id = id.trim_end_matches(['.', ':']);
    id.strip_prefix("DEC-")?;
    let statement = first_sentence(format!("{title} {body}").trim());
    Some(Requirement { id: id.to_string(), kind: "decision".to_string(), statement })
}

/// Up to the first full stop that ends a sentence, on one line, without table marks.
fn first_sentence(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "/");
    let end = line.match_indices(". ").map(|(at, _)| at + 1).find(|at| *at > 12);
    line[..end.unwrap_or(line.len())].to_string()
}
