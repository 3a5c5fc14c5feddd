//! The requirement trace (design 12): which requirement is implemented where, tested where,
//! or why not. Generated from the catalogues and from every id that code, tests and
//! documents cite.
//!
//! `cargo run -p system-tests --bin trace` writes `docs/trace.md`; with `--accept` also the
//! baseline of known gaps, so that only a new gap fails the build.

pub mod catalogue;
pub mod cited;
pub mod ids;
pub mod render;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use catalogue::Requirement;
use cited::{Place, Role};

/// Known gaps, one `id what` a line.
pub const BASELINE: &str = "tests/trace-gaps.txt";
/// The generated document.
pub const DOCUMENT: &str = "docs/trace.md";

/// The project's folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_path_buf).unwrap_or_default()
}

/// Requirements and where they are cited.
#[derive(Debug)]
pub struct Trace {
    /// Every requirement and decision.
    pub requirements: Vec<Requirement>,
    /// Every id the catalogues know, requirements and all other rows.
    pub known: BTreeSet<String>,
    /// Places by id.
    pub cited: BTreeMap<String, BTreeSet<Place>>,
}

/// What a requirement lacks.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Gap {
    /// The requirement.
    pub id: String,
    /// `not tested` or `not in the catalogue`.
    pub what: &'static str,
}

impl std::fmt::Display for Gap {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{} {}", self.id, self.what)
    }
}

impl Trace {
    /// Reads catalogues and sources under `root`.
    pub fn read(root: &Path) -> Self {
        let (requirements, known) = catalogue::read();
        Self { requirements, known, cited: cited::read(root) }
    }

    /// Files that cite `id` in a role.
    pub fn files(&self, id: &str, role: Role) -> BTreeSet<&str> {
        let places = self.cited.get(id).into_iter().flatten();
        places.filter(|place| place.role == role).map(|place| place.file.as_str()).collect()
    }

    /// What is missing, in order.
    pub fn gaps(&self) -> BTreeSet<Gap> {
        let mut gaps = BTreeSet::new();
        for requirement in self.requirements.iter().filter(|one| one.is_for_software()) {
            // Design 12: a test that names the id. What a test shows is there, whether or not
            // the code beside it names the id too.
            let id = &requirement.id;
            if self.files(id, Role::Test).is_empty() {
                gaps.insert(Gap { id: id.clone(), what: "not tested" });
            }
        }
        for id in self.cited.keys().filter(|id| !self.known.contains(*id)) {
            gaps.insert(Gap { id: id.clone(), what: "not in the catalogue" });
        }
        gaps
    }
}

/// The gaps accepted so far, as lines.
pub fn baseline(root: &Path) -> BTreeSet<String> {
    let text = std::fs::read_to_string(root.join(BASELINE)).unwrap_or_default();
    text.lines().filter(|line| !line.starts_with('#') && !line.is_empty()).map(str::to_string).collect()
}

#[cfg(test)]
mod tests;
