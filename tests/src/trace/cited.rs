//! Where ids are cited: in code, in tests, in documents.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::{DOCUMENT, ids};

/// What kind of text cites an id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Code of the product.
    Code,
    /// A test or what tests compare with.
    Test,
    /// A document.
    Document,
}

/// A file that cites an id.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// How.
    pub role: Role,
    /// Path inside the project.
    pub file: String,
}

/// Folders that are no source: built, or the catalogues themselves.
const SKIPPED: [&str; 3] = ["target", ".git", "catalogue"];

/// Every citation under `root`.
pub fn read(root: &Path) -> BTreeMap<String, BTreeSet<Place>> {
    let mut cited: BTreeMap<String, BTreeSet<Place>> = BTreeMap::new();
    for path in files(root) {
        let file = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        if file == DOCUMENT {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        for (id, role) in in_file(&file, &text) {
            cited.entry(id).or_default().insert(Place { role, file: file.clone() });
        }
    }
    cited
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_string();
        if path.is_dir() {
            if !SKIPPED.contains(&name.as_str()) {
                found.extend(files(&path));
            }
        } else if path.extension().is_some_and(|ending| ending == "rs" || ending == "md") {
            found.push(path);
        }
    }
    found
}

/// Ids of one file with their roles; what follows `#[cfg(test)]` is a test.
pub fn in_file(file: &str, text: &str) -> BTreeSet<(String, Role)> {
    let is_document = Path::new(file).extension().is_some_and(|ending| ending == "md");
    let is_test_file = file.split('/').any(|part| part == "tests" || part == "tests.rs");
    let mut role = if is_document {
        Role::Document
    } else if is_test_file {
        Role::Test
    } else {
        Role::Code
    };
    let mut found = BTreeSet::new();
    for line in text.lines() {
        let begins_tests = line.trim() == "#[cfg(test)]";
        if begins_tests && role == Role::Code {
            role = Role::Test;
        }
        found.extend(ids::in_line(line).into_iter().map(|id| (id, role)));
    }
    found
}
