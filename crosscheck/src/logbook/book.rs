//! The file: appended to, flushed, continued in a new one when full, never rewritten.

use std::borrow::ToOwned;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::string::String;
use std::time::{SystemTime, UNIX_EPOCH};
use std::vec::Vec;
use std::{format, os::unix::fs::FileExt};

use super::record::{Entry, Hash, compose};
use super::verify::{self, Findings};
use crate::guard::crc32;

/// Octets of the head of a file.
pub const HEAD: usize = 52;
const TITLE: [u8; 8] = *b"SPLOG1\0\0";
/// Octets of one of the two slots of `<file>.head`: number, hash, check sum.
const SLOT: usize = 44;

/// How large a logbook may become.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Octets at which a file is continued in a new one.
    pub file_octets: u64,
    /// Files kept, the newest included.
    pub files: usize,
}

impl Default for Size {
    /// 16 files of 64 MiB: five years, see the module's page.
    fn default() -> Self {
        Self { file_octets: 64 * 1024 * 1024, files: 16 }
    }
}

/// A logbook, open for appending.
#[derive(Debug)]
pub struct Book {
    path: PathBuf,
    size: Size,
    file: File,
    newest: File,
    octets: u64,
    number: u64,
    hash: Hash,
}

impl Book {
    /// Opens or begins the logbook at `path`. An unfinished record at its end is cut off and
    /// that is recorded; a damaged file is left as it is and continued in a new one.
    ///
    /// # Errors
    /// What the file system says.
    pub fn open(path: &Path, size: Size) -> io::Result<Self> {
        let octets = match fs::read(path) {
            Ok(octets) => octets,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(error),
        };
        let mut findings = verify::verify(&octets);
        let mut note = note(&findings);
        if findings.sound_octets == 0 {
            continue_older(path, &mut findings)?;
        }
        let aside = !findings.faults.is_empty();
        if aside {
            set_aside(path, &octets)?;
        }
        let fresh = aside || findings.sound_octets < HEAD;
        if let Some((number, hash)) = read_newest(path)
            && number >= findings.next_number
        {
            // Numbers are never used twice, even for records that are gone.
            note = Some(format!("records {} to {number} are missing", findings.next_number));
            (findings.next_number, findings.hash) = (number + 1, hash);
            if !fresh {
                set_aside(path, &octets)?;
            }
            return Self::begin(path, size, &findings, note);
        }
        if fresh {
            Self::begin(path, size, &findings, note)
        } else {
            Self::go_on(path, size, &findings, note)
        }
    }

    fn begin(path: &Path, size: Size, findings: &Findings, note: Option<String>) -> io::Result<Self> {
        let file = start_file(path, &findings.hash, findings.next_number)?;
        Self::ready(path, size, file, HEAD as u64, findings, note)
    }

    fn go_on(path: &Path, size: Size, findings: &Findings, note: Option<String>) -> io::Result<Self> {
        let mut file = OpenOptions::new().read(true).write(true).open(path)?;
        let sound = findings.sound_octets as u64;
        file.set_len(sound)?;
        file.seek(SeekFrom::Start(sound))?;
        Self::ready(path, size, file, sound, findings, note)
    }

    fn ready(
        path: &Path,
        size: Size,
        file: File,
        octets: u64,
        findings: &Findings,
        note: Option<String>,
    ) -> io::Result<Self> {
        let newest = OpenOptions::new().write(true).create(true).truncate(false).open(beside(path))?;
        let (number, hash) = (findings.next_number, findings.hash);
        let mut book = Self { path: path.to_owned(), size, file, newest, octets, number, hash };
        if let Some(note) = note {
            book.append(&Entry::Intervention(note))?;
        }
        Ok(book)
    }

    /// Appends a record; when this returns it survives a loss of power.
    ///
    /// # Errors
    /// What the file system says; the record is then not there, or torn at the end.
    pub fn append(&mut self, entry: &Entry) -> io::Result<()> {
        if self.octets >= self.size.file_octets {
            self.turn_over()?;
        }
        let (octets, hash) = compose(self.number, unix_ns(), entry, &self.hash);
        if let Err(error) = self.file.write_all(&octets).and_then(|()| self.file.sync_data()) {
            // A half-written record must not stand in front of the next one.
            self.file.set_len(self.octets)?;
            self.file.seek(SeekFrom::Start(self.octets))?;
            return Err(error);
        }
        // After the record, so that the two slots never know more than the file.
        let slot = slot(self.number, &hash);
        self.newest.write_all_at(&slot, (self.number & 1) * SLOT as u64)?;
        self.newest.sync_data()?;
        self.octets += octets.len() as u64;
        self.number += 1;
        self.hash = hash;
        Ok(())
    }

    /// Number and hash of the newest record; (0, zeros) when there is none.
    pub fn newest(&self) -> (u64, Hash) {
        (self.number - 1, self.hash)
    }

    fn turn_over(&mut self) -> io::Result<()> {
        let octets = fs::read(&self.path)?;
        set_aside(&self.path, &octets)?;
        self.file = start_file(&self.path, &self.hash, self.number)?;
        self.octets = HEAD as u64;
        let files = verify::files(&self.path)?;
        let surplus = files.len().saturating_sub(self.size.files.max(1));
        files.iter().take(surplus).try_for_each(fs::remove_file)
    }
}

/// A chain whose newest file is missing goes on from the newest that is there.
fn continue_older(path: &Path, findings: &mut Findings) -> io::Result<()> {
    let older = verify::files(path).unwrap_or_default();
    let Some(last) = older.iter().rev().find(|file| *file != path) else { return Ok(()) };
    let before = verify::verify(&fs::read(last)?);
    (findings.next_number, findings.hash) = (before.next_number, before.hash);
    Ok(())
}

fn note(findings: &Findings) -> Option<String> {
    if !findings.faults.is_empty() {
        return Some(format!("continued after damage: {}", findings.faults.join("; ")));
    }
    let torn = findings.torn_octets;
    (torn > 0).then(|| format!("an unfinished record of {torn} octets was cut off"))
}

/// Renames a file to its first record's number, which no other has.
fn set_aside(path: &Path, octets: &[u8]) -> io::Result<()> {
    let mut number = parse_head(octets).map_or(0, |(_, first)| first);
    loop {
        let target = with_suffix(path, &format!("{number:012}"));
        if !target.exists() {
            fs::rename(path, target)?;
            return sync_folder(path);
        }
        number += 1;
    }
}

fn start_file(path: &Path, hash: &Hash, first: u64) -> io::Result<File> {
    let mut head = Vec::with_capacity(HEAD);
    head.extend(TITLE);
    head.extend(hash);
    head.extend(first.to_le_bytes());
    head.extend(crc32(&head).to_le_bytes());
    let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path)?;
    file.write_all(&head)?;
    file.sync_all()?;
    sync_folder(path)?;
    Ok(file)
}

/// Hash before and number of the first record.
pub(super) fn parse_head(octets: &[u8]) -> Option<(Hash, u64)> {
    let head = octets.first_chunk::<HEAD>()?;
    let (covered, sum) = head.split_last_chunk::<4>()?;
    let (rest, first) = covered.split_last_chunk::<8>()?;
    let (title, hash) = rest.split_last_chunk::<32>()?;
    let sound = crc32(covered) == u32::from_le_bytes(*sum);
    let ours = title == TITLE;
    (sound && ours).then_some((*hash, u64::from_le_bytes(*first)))
}

fn slot(number: u64, hash: &Hash) -> Vec<u8> {
    let mut slot = Vec::with_capacity(SLOT);
    slot.extend(number.to_le_bytes());
    slot.extend(hash);
    slot.extend(crc32(&slot).to_le_bytes());
    slot
}

/// One of the two notes of `<file>.head`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Slot {
    /// Never written, or the file is not there.
    Empty,
    /// Written in part, or changed.
    Damaged,
    /// Number and hash of the record that was the newest then.
    Sound(u64, Hash),
}

/// Both notes of `<file>.head`.
pub(super) fn read_slots(path: &Path) -> io::Result<[Slot; 2]> {
    let octets = match fs::read(beside(path)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok([Slot::Empty; 2]),
        other => other?,
    };
    Ok([0, 1].map(|at| parse_slot(octets.get(at * SLOT..).unwrap_or_default())))
}

fn parse_slot(octets: &[u8]) -> Slot {
    let octets = octets.get(..SLOT).unwrap_or(octets);
    if octets.iter().all(|octet| *octet == 0) {
        return Slot::Empty;
    }
    let parse = || {
        let slot = octets.first_chunk::<SLOT>()?;
        let (covered, sum) = slot.split_last_chunk::<4>()?;
        let (number, hash) = covered.split_first_chunk::<8>()?;
        let sound = crc32(covered) == u32::from_le_bytes(*sum);
        sound.then_some(Slot::Sound(u64::from_le_bytes(*number), *hash.first_chunk::<32>()?))
    };
    parse().unwrap_or(Slot::Damaged)
}

/// Number and hash of the newest record as `<file>.head` knows them.
fn read_newest(path: &Path) -> Option<(u64, Hash)> {
    let slots = read_slots(path).ok()?;
    let sound = |slot: Slot| if let Slot::Sound(number, hash) = slot { Some((number, hash)) } else { None };
    slots.into_iter().filter_map(sound).max_by_key(|(number, _)| *number)
}

fn beside(path: &Path) -> PathBuf {
    with_suffix(path, "head")
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(suffix);
    name.into()
}

fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    File::open(folder)?.sync_all()
}

fn unix_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos() as u64)
}
