//! Where the sets of one run folder live, and the lock that allows only one at a time.

use std::{
    env,
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Read, Seek, Write},
    path::PathBuf,
};

use nix::unistd::Uid;
use shm_schema::wire::{DIGEST_START, digest};
use sim::shm::Place;

/// A run folder: the lock, the images and the shared-memory domain of one set.
#[derive(Debug, Clone)]
pub struct RunFolder(PathBuf);

/// Why a set cannot have its run folder.
#[derive(Debug)]
pub enum RunFolderError {
    /// A file or folder could not be used.
    File(PathBuf, io::Error),
    /// Another set, started by the process named, holds the lock.
    Running(PathBuf, String),
}

impl std::fmt::Display for RunFolderError {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(path, error) => write!(out, "{}: {error}", path.display()),
            Self::Running(path, who) => write!(
                out,
                "{}: a set started by process {who} is running; stop it first, or use another --run-dir",
                path.display()
            ),
        }
    }
}

impl std::error::Error for RunFolderError {}

impl RunFolder {
    /// The folder named, or the usual one: `/run/safepair` for root, else below the
    /// user's runtime folder.
    pub fn new(named: Option<PathBuf>) -> Self {
        let folder = named.unwrap_or_else(usual);
        // The prefix depends on the text: however it is written, it is one folder.
        Self(std::path::absolute(&folder).unwrap_or(folder))
    }

    /// Folder of the safety images of the running set.
    pub fn images(&self) -> PathBuf {
        self.0.join("images")
    }

    /// Root of the domain; everything below is wiped by the next start.
    pub fn domain(&self) -> PathBuf {
        self.0.join("domain")
    }

    /// Root, prefix and nonce of a run. Root and prefix depend on the folder only, so that
    /// the next start finds what a killed one left.
    pub fn place(&self, nonce: u32) -> Place {
        let prefix = format!("safepair_{:08x}_", digest(DIGEST_START, &self.0.to_string_lossy()));
        Place::new(self.domain(), prefix, nonce)
    }

    /// Takes the lock. It lives outside the domain and is inherited by every process of the
    /// set: as long as one of them lives, nobody wipes (design 5).
    ///
    /// # Errors
    /// [`RunFolderError::Running`] when any process of another set lives.
    pub fn lock(&self) -> Result<File, RunFolderError> {
        let path = self.0.join("lock");
        let failed = |error| RunFolderError::File(path.clone(), error);
        fs::create_dir_all(&self.0).map_err(failed)?;
        let options = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
        let mut file = options.map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut who = String::new();
                let _ = Read::by_ref(&mut file).take(32).read_to_string(&mut who);
                return Err(RunFolderError::Running(self.0.clone(), who.trim().to_owned()));
            }
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        file.set_len(0).map_err(failed)?;
        file.rewind().map_err(failed)?;
        writeln!(file, "{}", std::process::id()).map_err(failed)?;
        Ok(file)
    }
}

fn usual() -> PathBuf {
    if Uid::effective().is_root() {
        return PathBuf::from("/run/safepair");
    }
    env::var_os("XDG_RUNTIME_DIR").map_or_else(
        || env::temp_dir().join(format!("safepair-{}", Uid::effective())),
        |folder| PathBuf::from(folder).join("safepair"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_start_is_refused_and_told_who_runs() {
        let folder =
            RunFolder::new(Some(env::temp_dir().join(format!("safepair-lock-{}", std::process::id()))));
        let held = folder.lock().expect("free");
        let refused = folder.lock().expect_err("held");
        assert!(refused.to_string().contains(&std::process::id().to_string()), "{refused}");
        drop(held);
        folder.lock().expect("free again");
        fs::remove_dir_all(&folder.0).expect("ours");
    }
}
