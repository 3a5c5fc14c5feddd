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

/// Which requirements are met by no function of the programs, by prefix.
const CLASSES: &str = include_str!("../../trace-classes.toml");

/// Kinds that bind the machine builder or say something about a document.
const ASSUMPTIONS: [&str; 3] = ["hardware", "info", "commissioning"];

/// A rule of [`CLASSES`].
#[derive(Debug, Clone)]
pub struct Rule {
    /// Beginning of the id.
    pub prefix: String,
    kind: Option<String>,
    class: String,
}

impl Rule {
    /// Whether it is about a requirement.
    pub fn holds_for(&self, id: &str, kind: &str) -> bool {
        let is_of_kind = self.kind.as_deref().is_none_or(|wanted| wanted == kind);
        is_of_kind && id.starts_with(&self.prefix)
    }
}

/// The rules in their order.
///
/// # Panics
/// When the classes are no TOML.
pub fn rules() -> Vec<Rule> {
    let table: toml::Table = CLASSES.parse().expect("the classes are TOML");
    let classes = table.get("class").and_then(Value::as_array).into_iter().flatten();
    let rules = classes.flat_map(|class| {
        let name = text_of(class, "name").unwrap_or_default();
        let rules = class.get("rules").and_then(Value::as_array).into_iter().flatten();
        rules.map(move |rule| Rule {
            prefix: text_of(rule, "prefix").unwrap_or_default(),
            kind: text_of(rule, "kind"),
            class: name.clone(),
        })
    });
    rules.collect()
}

/// One requirement.
#[derive(Debug, Clone)]
pub struct Requirement {
    /// Id.
    pub id: String,
    /// Kind, `decision` for a DEC.
    pub kind: String,
    /// First sentence.
    pub statement: String,
    /// Why no test has to cite it, if so.
    pub exempt: Option<String>,
}

impl Requirement {
    fn new(id: String, kind: String, statement: String, rules: &[Rule]) -> Self {
        let by_kind = ASSUMPTIONS.contains(&kind.as_str()).then(|| format!("assumption of use ({kind})"));
        let rule = rules.iter().find(|rule| rule.holds_for(&id, &kind));
        let exempt = by_kind.or_else(|| rule.map(|rule| rule.class.clone()));
        Self { id, kind, statement, exempt }
    }

    /// Whether a test has to cite it.
    pub fn is_for_software(&self) -> bool {
        self.exempt.is_none()
    }
}

/// All requirements in order, and every id of any row.
///
/// # Panics
/// When a catalogue is no TOML.
pub fn read() -> (Vec<Requirement>, BTreeSet<String>) {
    let mut requirements = Vec::new();
    let mut known = BTreeSet::new();
    let rules = rules();
    for text in CATALOGUES {
        let table: toml::Table = text.parse().expect("a catalogue is TOML");
        for rows in table.values().filter_map(Value::as_array) {
            known.extend(rows.iter().filter_map(|row| text_of(row, "id")));
        }
        let rows = table.get("req").and_then(Value::as_array).into_iter().flatten();
        requirements.extend(rows.filter_map(|row| requirement(row, &rules)));
    }
    requirements.extend(DECISIONS.lines().filter_map(decision));
    known.extend(requirements.iter().map(|requirement| requirement.id.clone()));
    (requirements, known)
}

fn text_of(row: &Value, key: &str) -> Option<String> {
    row.get(key).and_then(Value::as_str).map(str::to_string)
}

fn requirement(row: &Value, rules: &[Rule]) -> Option<Requirement> {
    let statement = first_sentence(&text_of(row, "text")?);
    Some(Requirement::new(text_of(row, "id")?, text_of(row, "kind")?, statement, rules))
}

/// `- **DEC-01 Strictness.** A limit is violated when …`
fn decision(line: &str) -> Option<Requirement> {
    let rest = line.strip_prefix("- **")?;
    let (head, body) = rest.split_once("**")?;
    let (id, title) = head.split_once(' ').unwrap_or((head, ""));
    let id = id.trim_end_matches(['.', ':']);
    id.strip_prefix("DEC-")?;
    let statement = first_sentence(format!("{title} {body}").trim());
    Some(Requirement::new(id.to_string(), "decision".to_string(), statement, &[]))
}

/// Up to the first full stop that ends a sentence, on one line, without table marks.
fn first_sentence(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "/");
    let end = line.match_indices(". ").map(|(at, _)| at + 1).find(|at| *at > 12);
    line[..end.unwrap_or(line.len())].to_string()
}
