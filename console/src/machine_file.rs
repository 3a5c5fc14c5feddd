//! Reading a parameter file: one way for every command, every reason at once.

use std::{fs, path::Path};

use params::Machine;

/// Reads the file of a machine.
///
/// # Errors
/// Every reason why it cannot be used, one a line, each with file, line and what was expected.
pub fn read(path: &Path) -> Result<Machine, String> {
    parse(&text(path)?, path)
}

/// The text of a file.
///
/// # Errors
/// One line: the file and why it cannot be read.
pub fn text(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{}: {error}; expected a readable file", path.display()))
}

/// What a text of a machine says.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: &Path) -> Result<Machine, String> {
    params::parse(text, &path.display().to_string())
        .map_err(|all| all.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}
