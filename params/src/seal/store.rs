//! Files of sealed sets: everything is written and synchronised aside, then one rename.

use std::{
    fs::{self, File},
    io::{self, Write as _},
    os::unix::fs::symlink,
    path::{Path, PathBuf},
};

use super::Prepared;

/// Folder below a set's folder that the channels read: the switch itself.
pub const IMAGE_FOLDER: &str = "current";
const SETS: &str = "sets";
const CONFIRMED: &str = "confirmed";
const UNVALIDATED: &str = "-unvalidated";
const SOURCE: &str = "set.toml";
/// Stands as long as a transfer runs.
const TRANSFER: &str = "transfer";

/// An instant at which power may go: tests stop the writer here.
#[cfg(not(test))]
#[allow(clippy::unnecessary_wraps, reason = "the tests' own fails")]
fn instant() -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
use super::faults::instant;

/// Writes a set and makes it the current one. `typed` is what a person confirmed; without it
/// the images are not validated.
pub(super) fn write(prepared: &Prepared, folder: &Path, typed: Option<&str>) -> io::Result<()> {
    let name = prepared.device_signature();
    let suffix = if typed.is_some() { "" } else { UNVALIDATED };
    let target = format!("{SETS}/{name}{suffix}");
    instant()?;
    fs::create_dir_all(folder.join(SETS))?;
    write_synced(&folder.join(TRANSFER), name.as_bytes())?;
    instant()?;
    fs::create_dir_all(folder.join(CONFIRMED))?;
    if folder.join(&target).exists()
        && fs::read_link(folder.join(IMAGE_FOLDER)).ok() == Some(PathBuf::from(&target))
    {
        // The current set is never written in place: sealed again, it gets a new folder.
        write_as(prepared, folder, &format!("{target}-again"), typed)?;
    } else {
        write_as(prepared, folder, &target, typed)?;
    }
    end_transfer(folder)
}

/// A transfer began and did not end.
pub(super) fn is_interrupted(folder: &Path) -> bool {
    folder.join(TRANSFER).exists()
}

pub(super) fn end_transfer(folder: &Path) -> io::Result<()> {
    instant()?;
    match fs::remove_file(folder.join(TRANSFER)) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => sync_folder(folder),
    }
}

fn write_as(prepared: &Prepared, folder: &Path, target: &str, typed: Option<&str>) -> io::Result<()> {
    let path = folder.join(target);
    if path.exists() {
        // A leftover of a writer that was killed; nothing points to it.
        instant()?;
        fs::remove_dir_all(&path)?;
    }
    instant()?;
    fs::create_dir(&path)?;
    write_synced(&path.join(SOURCE), prepared.text.as_bytes())?;
    for axis in &prepared.machine.axes {
        let validated = typed.is_some();
        write_synced(&path.join(image_name(axis.number, "a")), &axis.image_a(validated))?;
        write_synced(&path.join(image_name(axis.number, "b")), &axis.image_b(validated))?;
    }
    sync_folder(&path)?;
    sync_folder(&folder.join(SETS))?;
    if let Some(typed) = typed {
        let confirmed = folder.join(CONFIRMED).join(format!("{}.toml", prepared.device_signature()));
        replace(&confirmed, format!("typed_back = \"{typed}\"\n").as_bytes())?;
    }
    switch(folder, target)
}

/// What `current` points to.
pub(super) fn target(folder: &Path) -> Option<PathBuf> {
    let target = fs::read_link(folder.join(IMAGE_FOLDER)).ok()?;
    folder.join(&target).is_dir().then_some(target)
}

pub(super) fn is_unvalidated(target: &Path) -> bool {
    target.to_string_lossy().contains(UNVALIDATED)
}

/// Erases the current set if its name says that nobody validated it.
pub(super) fn erase_unvalidated(folder: &Path) -> io::Result<bool> {
    let current = folder.join(IMAGE_FOLDER);
    let target = match fs::read_link(&current) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        other => other?,
    };
    if !is_unvalidated(&target) {
        return Ok(false);
    }
    instant()?;
    fs::remove_file(&current)?;
    sync_folder(folder)?;
    instant()?;
    fs::remove_dir_all(folder.join(target))?;
    Ok(true)
}

/// Points `current` to another set: the one instant at which everything changes.
fn switch(folder: &Path, target: &str) -> io::Result<()> {
    let next = folder.join(".next");
    instant()?;
    match fs::remove_file(&next) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    instant()?;
    symlink(target, &next)?;
    instant()?;
    fs::rename(&next, folder.join(IMAGE_FOLDER))?;
    instant()?;
    sync_folder(folder)
}

/// Replaces a file by another content, whole or not at all.
pub(super) fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("file");
    let aside = folder.join(format!(".{name}.new"));
    write_synced(&aside, content)?;
    instant()?;
    fs::rename(&aside, path)?;
    instant()?;
    sync_folder(folder)
}

fn write_synced(path: &Path, content: &[u8]) -> io::Result<()> {
    instant()?;
    let mut file = File::create(path)?;
    let (first, second) = content.split_at(content.len() / 2);
    instant()?;
    file.write_all(first)?;
    // Half of a file is what a loss of power may leave.
    instant()?;
    file.write_all(second)?;
    instant()?;
    file.sync_all()
}

fn sync_folder(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

/// Name of an image as the processes look for it.
fn image_name(axis: u8, channel: &str) -> String {
    format!("axis-{axis:02}.{channel}.img")
}

/// The file of the current set, for looking at it, and for sealing it to another device.
///
/// # Errors
/// There is no current set, or it cannot be read.
pub fn source(folder: &Path) -> io::Result<String> {
    fs::read_to_string(folder.join(IMAGE_FOLDER).join(SOURCE))
}

pub(super) fn image(folder: &Path, axis: u8, channel: &str) -> io::Result<Vec<u8>> {
    fs::read(folder.join(IMAGE_FOLDER).join(image_name(axis, channel)))
}

/// What was typed back for the set of that name.
pub(super) fn confirmation(folder: &Path, name: &str) -> Option<String> {
    let text = fs::read_to_string(folder.join(CONFIRMED).join(format!("{name}.toml"))).ok()?;
    let table: toml::Table = text.parse().ok()?;
    table.get("typed_back")?.as_str().map(str::to_string)
}
