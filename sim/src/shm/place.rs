//! Where a domain lives, and the removal of what an earlier run left there.

use std::path::{Path, PathBuf};
use std::{fs, io};

use iceoryx2::prelude::{Config, FileName, SemanticString};

use super::DomainError;

/// Where POSIX shared memory shows as files.
const SHARED_MEMORY: &str = "/dev/shm";

/// Private folder, prefix and boot nonce of one run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    root: PathBuf,
    prefix: String,
    nonce: u32,
}

impl Place {
    /// The domain below `root` (options `--domain`, `--prefix`, `--nonce`).
    pub fn new(root: impl Into<PathBuf>, prefix: impl Into<String>, nonce: u32) -> Self {
        Self { root: root.into(), prefix: prefix.into(), nonce }
    }

    /// The private folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The prefix of every file in shared memory.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// The boot nonce every header carries.
    pub const fn nonce(&self) -> u32 {
        self.nonce
    }

    /// The folder of the library inside the private one.
    pub fn library_root(&self) -> PathBuf {
        self.root.join("iox2")
    }

    /// The configuration every participant passes explicitly (design 5). All automatic
    /// cleaning is off: only the owner of the lock removes anything.
    ///
    /// # Errors
    /// [`DomainError::Name`] when root or prefix cannot be part of a file name.
    pub fn config(&self) -> Result<Config, DomainError> {
        let root = self.library_root().to_string_lossy().into_owned();
        let mut config = Config::default();
        let path = iceoryx2::prelude::Path::new(root.as_bytes()).map_err(|_| DomainError::Name(root))?;
        config.global.set_root_path(&path);
        let prefix = FileName::new(self.checked_prefix()?.as_bytes());
        config.global.prefix = prefix.map_err(|_| DomainError::Name(self.prefix.clone()))?;
        config.global.service.cleanup_dead_nodes_on_open = false;
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        Ok(config)
    }

    /// Makes the private folders, readable by nobody else.
    pub fn make(&self) -> Result<(), DomainError> {
        use std::os::unix::fs::DirBuilderExt;
        let path = self.library_root();
        let made = fs::DirBuilder::new().recursive(true).mode(0o700).create(&path);
        made.map_err(|error| DomainError::File(path, error))
    }

    /// Removes everything an earlier run left: the library's folder and every file in
    /// shared memory with this prefix. Nobody who lives here survives it: hold the lock.
    pub fn wipe(&self) -> Result<(), DomainError> {
        let path = self.library_root();
        absent_is_fine(fs::remove_dir_all(&path)).map_err(|error| DomainError::File(path, error))?;
        let prefix = self.checked_prefix()?;
        let folder = Path::new(SHARED_MEMORY);
        let entries = fs::read_dir(folder).map_err(|error| DomainError::File(folder.to_owned(), error))?;
        entries
            .flatten()
            .filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix))
            .try_for_each(|entry| {
                absent_is_fine(fs::remove_file(entry.path()))
                    .map_err(|error| DomainError::File(entry.path(), error))
            })
    }

    /// A short prefix would wipe what belongs to others.
    fn checked_prefix(&self) -> Result<&str, DomainError> {
        let known = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        let valid = (4..=32).contains(&self.prefix.len()) && self.prefix.chars().all(known);
        if valid { Ok(&self.prefix) } else { Err(DomainError::Name(self.prefix.clone())) }
    }
}

fn absent_is_fine(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
