//! What a logbook proves, and what it misses.

use std::borrow::ToOwned;
use std::format;
use std::path::{Path, PathBuf};
use std::string::String;
use std::vec::Vec;
use std::{fs, io};

use super::book::{self, Slot};
use super::record::{self, Broken, Hash, MAGIC, Record};

/// The octets of one file, judged.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Findings {
    /// Records that are whole and follow each other.
    pub records: Vec<Record>,
    /// What is damaged, missing or out of the chain, in the words a person reads.
    pub faults: Vec<String>,
    /// What a person should know and what is no damage.
    pub notes: Vec<String>,
    /// Octets of an unfinished record at the end, as a loss of power leaves them.
    pub torn_octets: usize,
    /// Octets from the start up to which everything is whole.
    pub sound_octets: usize,
    /// Number the next record must have.
    pub next_number: u64,
    /// The newest link of the chain.
    pub hash: Hash,
    /// The link the first record follows.
    pub origin: Hash,
    /// Number and link of the last record before the first fault; number 0: none.
    pub proved: (u64, Hash),
}

impl Findings {
    /// Whether nothing is damaged, missing or torn.
    pub fn is_whole(&self) -> bool {
        let sound = self.faults.is_empty();
        sound && self.torn_octets == 0
    }
}

/// Judges the octets of one file.
pub fn verify(octets: &[u8]) -> Findings {
    let mut findings = Findings { next_number: 1, ..Findings::default() };
    let Some((hash, first)) = book::parse_head(octets) else {
        let torn = octets.len() < book::HEAD;
        findings.torn_octets = if torn { octets.len() } else { 0 };
        if !torn {
            findings.faults.push("the head of the file is damaged".into());
        }
        return findings;
    };
    findings.hash = hash;
    findings.origin = hash;
    findings.next_number = first;
    findings.sound_octets = book::HEAD;
    walk(octets, &mut findings);
    findings
}

fn walk(octets: &[u8], findings: &mut Findings) {
    let mut at = book::HEAD;
    while let Some(rest) = octets.get(at..).filter(|rest| !rest.is_empty()) {
        match record::parse(rest) {
            Ok((record, length)) => {
                accept(rest.get(..length).unwrap_or(rest), record, findings);
                at += length;
                if findings.faults.is_empty() {
                    findings.sound_octets = at;
                }
            }
            Err(why) => {
                let Some(distance) = next_record(rest) else {
                    findings.torn_octets = rest.len();
                    return;
                };
                let last = at + distance - 1;
                findings.faults.push(format!("octets {at} to {last} are damaged: {}", name(why)));
                at += distance;
            }
        }
    }
}

fn accept(whole: &[u8], record: Record, findings: &mut Findings) {
    if record.number != findings.next_number {
        findings.faults.push(format!(
            "records {} to {} are missing",
            findings.next_number,
            record.number.saturating_sub(1)
        ));
    } else if !record::follows(whole, &findings.hash) {
        findings.faults.push(format!("record {} does not follow the one before it", record.number));
    }
    findings.next_number = record.number.saturating_add(1);
    findings.hash = record.hash;
    if findings.faults.is_empty() {
        findings.proved = (record.number, record.hash);
    }
    findings.records.push(record);
}

/// How far the next whole record is; `None`: there is none.
fn next_record(octets: &[u8]) -> Option<usize> {
    let starts = octets.windows(MAGIC.len()).enumerate().skip(1).filter(|(_, window)| *window == MAGIC);
    let whole = |at: &usize| octets.get(*at..).is_some_and(|rest| record::parse(rest).is_ok());
    starts.map(|(at, _)| at).find(whole)
}

fn name(why: Broken) -> &'static str {
    match why {
        Broken::Short => "an unfinished record",
        Broken::Start => "no record begins there",
        Broken::CheckSum => "wrong check sum",
    }
}

/// Judges a logbook with all the files it was continued from, oldest first.
///
/// # Errors
/// What reading the files says.
pub fn verify_all(file: &Path) -> io::Result<Findings> {
    let mut all = Findings { next_number: 1, ..Findings::default() };
    let files = files(file)?;
    for path in &files {
        let part = verify(&fs::read(path)?);
        join(&mut all, part, path, files.len());
    }
    compare_newest(&mut all, &book::read_slots(file)?);
    Ok(all)
}

/// What `<file>.head` knows of the newest record. Its slots are written in turn, each after
/// its record, so that the older one may be one record behind and no more.
fn compare_newest(all: &mut Findings, slots: &[Slot; 2]) {
    let last = all.next_number.saturating_sub(1);
    let sound =
        |slot: &Slot| if let Slot::Sound(number, hash) = slot { Some((*number, *hash)) } else { None };
    let newest = slots.iter().filter_map(sound).max_by_key(|(number, _)| *number);
    let Some((number, hash)) = newest else {
        all.faults.push(format!(
            "the .head file is missing: whether records after {last} were cut off cannot be told"
        ));
        return;
    };
    if number > last {
        all.faults.push(format!("records {} to {number} are missing at the end", all.next_number));
    } else if number < last {
        all.faults.push(format!(
            "the .head file knows record {number} as the newest: a loss of power between the two, or another logbook's"
        ));
    } else if hash != all.hash {
        all.faults.push("the newest record is not the one that was written".into());
    }
    // The first record leaves the other slot empty.
    let other_due = number > 1;
    let damaged = slots.iter().any(|slot| matches!(slot, Slot::Damaged));
    let missing = other_due && slots.iter().any(|slot| matches!(slot, Slot::Empty));
    let older = slots.iter().filter_map(sound).map(|(number, _)| number).min();
    let apart = older.is_some_and(|older| older != number && older + 1 != number);
    if [damaged, missing, apart].contains(&true) {
        all.faults.push("one of the two notes in the .head file is damaged".into());
    }
}

fn join(all: &mut Findings, part: Findings, path: &Path, files: usize) {
    let before = all.faults.len();
    let readable = part.next_number > 1 || part.sound_octets > 0;
    let first = part.records.first().map_or(part.next_number, |record| record.number);
    if all.records.is_empty() {
        if first > 1 {
            missing_at_start(all, first, files);
        }
    } else if readable && first > all.next_number {
        all.faults.push(format!("records {} to {} are missing", all.next_number, first - 1));
    } else if readable && first == all.next_number && part.origin != all.hash {
        all.faults.push(format!("{}: does not follow the file before it", path.display()));
    } else if readable && first < all.next_number {
        all.faults.push(format!("{}: record {first} was there before", path.display()));
    }
    let sound_so_far = before == 0 && all.faults.is_empty();
    if sound_so_far && part.proved.0 > 0 {
        all.proved = part.proved;
    }
    all.faults.extend(part.faults.into_iter().map(|fault| format!("{}: {fault}", path.display())));
    all.notes.extend(part.notes);
    all.records.extend(part.records);
    all.torn_octets += part.torn_octets;
    all.sound_octets += part.sound_octets;
    if readable {
        all.next_number = part.next_number.max(all.next_number);
        all.hash = part.hash;
    }
}

/// The oldest file goes when there are too many; with fewer nothing had to go.
fn missing_at_start(all: &mut Findings, first: u64, files: usize) {
    let text = format!("records 1 to {} were removed", first - 1);
    if files >= book::Size::default().files {
        all.notes.push(format!("{text} to make room"));
    } else {
        all.faults.push(format!("{text}, though {files} files need no room"));
    }
}

/// The files of a logbook, oldest first.
pub fn files(file: &Path) -> io::Result<Vec<PathBuf>> {
    let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut older: Vec<(u64, PathBuf)> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let other = entry.file_name().to_string_lossy().into_owned();
        let number = other.strip_prefix(&name).and_then(|rest| rest.strip_prefix('.')?.parse().ok());
        if let Some(number) = number {
            older.push((number, entry.path()));
        }
    }
    older.sort();
    let mut files: Vec<PathBuf> = older.into_iter().map(|(_, path)| path).collect();
    if file.exists() {
        files.push(file.to_owned());
    }
    Ok(files)
}
