//! Everything a loss of power, a full disk or a careless hand can do to a logbook.

use std::path::PathBuf;
use std::vec::Vec;
use std::{env, format, fs, process, thread};

use shm_schema::error::ErrorCode;

use super::book::{Book, HEAD, Size};
use super::lenze::{LogFunction, log_state, ten_entries};
use super::moment::Moment;
use super::record::{Entry, Record};
use super::recorder::Recorder;
use super::ring::ring;
use super::verify::{verify, verify_all};
use super::{export, record};

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        // In memory where there is such a place: these tests flush thousands of times.
        let memory = PathBuf::from("/dev/shm");
        let place = if memory.is_dir() { memory } else { env::temp_dir() };
        let path = place.join(format!("safepair-logbook-{name}-{}", process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("temporary folder");
        Self(path)
    }

    fn file(&self) -> PathBuf {
        self.0.join("log")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn moment(now_ms: u64) -> Moment {
    Moment {
        axis: 1,
        torque: true,
        now_ns: now_ms * 1_000_000,
        exchange: now_ms,
        positions: [now_ms as i64, -5],
        speeds_mrpm: [-1, i32::MIN],
        phases: [5, 4],
        stops: [4, 1],
        inputs: [0x3F, 1],
        status: [u64::MAX, 1, 2],
        requested: [3, u32::MAX],
        signatures: [7, u32::MAX],
        ..Moment::default()
    }
}

fn with_code(mut moment: Moment) -> Moment {
    moment.errors[2][0] = ErrorCode::amk(3606, 13, 6, 0);
    moment.torque = false;
    moment
}

fn entries() -> Vec<Entry> {
    std::vec![
        Entry::Start { version: "1.2 µ".into(), nonce: 9, axes: std::vec![(1, 1, 0xC0FF_EE00)] },
        Entry::Change(moment(5)),
        Entry::Trip { moment: with_code(moment(8)), second: (0..20).map(moment).collect() },
        Entry::Intervention("acknowledge".into()),
        Entry::Lost { moments: 3, changes: 4 },
        Entry::End,
    ]
}

fn written(folder: &Folder) -> Vec<u8> {
    let mut book = Book::open(&folder.file(), Size::default()).expect("opens");
    for entry in entries() {
        book.append(&entry).expect("appends");
    }
    fs::read(folder.file()).expect("there")
}

#[test]
fn what_is_written_is_read_and_proved() {
    let folder = Folder::new("whole");
    let findings = verify(&written(&folder));
    assert!(findings.is_whole());
    let read: Vec<Entry> = findings.records.into_iter().filter_map(|record| record.entry).collect();
    assert_eq!(read, entries());
    assert!(verify_all(&folder.file()).expect("reads").is_whole());
}

/// Power may go at any octet: the book opens, says what is missing, proves the rest, goes on.
#[test]
fn a_book_cut_at_every_octet_opens_and_says_what_is_missing() {
    let source = Folder::new("cut-source");
    let whole = written(&source);
    let full = verify(&whole);
    let folder = Folder::new("cut");
    for cut in 0..whole.len() {
        let _ = fs::remove_dir_all(&folder.0);
        fs::create_dir_all(&folder.0).expect("temporary folder");
        fs::write(folder.file(), &whole[..cut]).expect("writes");
        let findings = verify(&whole[..cut]);
        assert!(findings.faults.is_empty(), "{cut}: a cut is no damage");
        assert_eq!(findings.records[..], full.records[..findings.records.len()], "{cut}");
        assert_eq!(findings.sound_octets + findings.torn_octets, cut, "{cut}");
        // With the note of the newest record nothing that was written can vanish unnoticed.
        fs::copy(source.0.join("log.head"), folder.0.join("log.head")).expect("copies");
        let judged = verify_all(&folder.file()).expect("reads");
        assert!(judged.faults.iter().any(|fault| fault.contains("missing")), "{cut}");

        let kept = findings.records.len();
        let mut book = Book::open(&folder.file(), Size::default()).expect("opens");
        book.append(&Entry::End).expect("appends");
        drop(book);
        let after = verify_all(&folder.file()).expect("reads");
        assert_eq!(after.records[..kept], full.records[..kept], "{cut}");
        assert_eq!(after.records.last().and_then(|last| last.entry.clone()), Some(Entry::End), "{cut}");
        let note = &after.records[kept].entry;
        assert!(
            matches!(note, Some(Entry::Intervention(text)) if text.contains("missing")),
            "{cut}: {note:?}"
        );
    }
}

/// A loss of power between record and note leaves a torn record and an older note.
#[test]
fn a_torn_record_is_cut_off_and_recorded() {
    let folder = Folder::new("torn");
    let whole = written(&folder);
    let torn = {
        let (extra, _) = record::compose(7, 0, &Entry::End, &verify(&whole).hash);
        [&whole[..], &extra[..extra.len() - 1]].concat()
    };
    fs::write(folder.file(), torn).expect("writes");
    drop(Book::open(&folder.file(), Size::default()).expect("opens"));
    let after = verify_all(&folder.file()).expect("reads");
    assert!(after.is_whole(), "{:?}", after.faults);
    let last = after.records.last().and_then(|last| last.entry.clone());
    assert!(matches!(last, Some(Entry::Intervention(text)) if text.contains("cut off")));
}

#[test]
fn every_flipped_bit_is_noticed() {
    let folder = Folder::new("flip");
    let whole = written(&folder);
    for bit in 0..whole.len() * 8 {
        let mut damaged = whole.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let findings = verify(&damaged);
        assert!(!findings.is_whole(), "bit {bit}");
        let first_record = (bit / 8).checked_sub(HEAD).map_or(0, |_| findings.proved.0);
        let proved = findings.records.iter().take_while(|record| record.number <= first_record);
        assert!(proved.zip(verify(&whole).records).all(|(kept, right)| *kept == right), "bit {bit}");
    }
}

/// The note of the newest record is watched like the book itself.
#[test]
fn every_flipped_bit_of_the_note_is_noticed() {
    let folder = Folder::new("flip-note");
    written(&folder);
    let note = folder.0.join("log.head");
    let whole = fs::read(&note).expect("there");
    for bit in 0..whole.len() * 8 {
        let mut damaged = whole.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        fs::write(&note, &damaged).expect("writes");
        let findings = verify_all(&folder.file()).expect("reads");
        assert!(!findings.is_whole(), "bit {bit}");
        assert_eq!(findings.records.len(), 6, "bit {bit}");
    }
    fs::remove_file(&note).expect("there");
    let findings = verify_all(&folder.file()).expect("reads");
    assert!(findings.faults[0].contains(".head file is missing"), "{:?}", findings.faults);
    assert_eq!(findings.proved.0, 6);
}

/// A chain of files: none can be taken out, exchanged or cut without being named.
#[test]
fn a_file_that_was_taken_out_or_exchanged_is_noticed() {
    let fill = |folder: &Folder, text: &str| {
        let mut book = Book::open(&folder.file(), Size { file_octets: 400, files: 9 }).expect("opens");
        (0..20).for_each(|_| book.append(&Entry::Intervention(text.into())).expect("appends"));
        super::verify::files(&folder.file()).expect("reads")
    };
    let (folder, other) = (Folder::new("chain"), Folder::new("chain-other"));
    let (files, others) = (fill(&folder, "one"), fill(&other, "two"));
    assert!(files.len() > 3);
    assert!(verify_all(&folder.file()).expect("reads").is_whole());
    for (file, foreign) in files.iter().zip(&others) {
        let whole = fs::read(file).expect("there");
        fs::copy(foreign, file).expect("copies");
        assert!(!verify_all(&folder.file()).expect("reads").is_whole(), "{}: exchanged", file.display());
        fs::remove_file(file).expect("there");
        assert!(!verify_all(&folder.file()).expect("reads").is_whole(), "{}: taken out", file.display());
        fs::write(file, &whole).expect("writes");
    }
    assert!(verify_all(&folder.file()).expect("reads").is_whole());
}

/// A record changed together with its check sum is still out of the chain.
#[test]
fn a_record_that_was_exchanged_does_not_follow_the_one_before() {
    let folder = Folder::new("edit");
    let whole = written(&folder);
    let (_, length) = record::parse(&whole[HEAD..]).expect("the first record");
    let (forged, _) = record::compose(1, 0, &Entry::Intervention("nothing happened".into()), &[0; 32]);
    let findings = verify(&[&whole[..HEAD], &forged, &whole[HEAD + length..]].concat());
    assert!(
        findings.faults.iter().any(|fault| fault.contains("record 2 does not follow")),
        "{:?}",
        findings.faults
    );
}

#[test]
fn a_record_that_was_taken_out_is_missed() {
    let folder = Folder::new("remove");
    let whole = written(&folder);
    let (_, length) = record::parse(&whole[HEAD..]).expect("the first record");
    let findings = verify(&[&whole[..HEAD], &whole[HEAD + length..]].concat());
    assert_eq!(findings.faults, ["records 1 to 1 are missing"]);
}

#[test]
fn a_damaged_file_is_kept_and_continued_in_a_new_one() {
    let folder = Folder::new("damage");
    let mut whole = written(&folder);
    whole[HEAD + 30] ^= 4;
    fs::write(folder.file(), &whole).expect("writes");
    let mut book = Book::open(&folder.file(), Size::default()).expect("opens");
    book.append(&Entry::End).expect("appends");
    assert_eq!(fs::read(folder.0.join("log.000000000001")).expect("kept"), whole);
    let after = verify_all(&folder.file()).expect("reads");
    assert_eq!(after.records.last().map(|last| last.number), Some(8));
}

#[test]
fn the_size_is_bounded_and_what_was_removed_is_named() {
    let folder = Folder::new("size");
    let size = Size { file_octets: 2_000, files: 3 };
    let mut book = Book::open(&folder.file(), size).expect("opens");
    for _ in 0..200 {
        book.append(&Entry::Change(moment(1))).expect("appends");
    }
    let files = super::verify::files(&folder.file()).expect("reads");
    let octets: u64 = files.iter().map(|file| fs::metadata(file).expect("there").len()).sum();
    assert_eq!(files.len(), 3);
    assert!(octets < 3 * 2_500, "{octets}");
    let findings = verify_all(&folder.file()).expect("reads");
    assert_eq!(findings.faults.len(), 1, "{:?}", findings.faults);
    assert!(findings.faults[0].contains("were removed"), "{:?}", findings.faults);
    assert_eq!(findings.records.last().map(|last| last.number), Some(200));
}

#[test]
fn a_full_ring_drops_and_counts_and_never_waits() {
    let (mut feeder, mut drain) = ring(4);
    (0..7).for_each(|at| feeder.push(&moment(at)));
    assert_eq!(drain.lost(), 3);
    assert_eq!(drain.lost(), 0);
    let kept: Vec<Moment> = std::iter::from_fn(|| drain.pop()).collect();
    assert_eq!(kept, (0..4).map(moment).collect::<Vec<_>>());
}

#[test]
fn moments_pass_the_ring_whole_and_in_order() {
    let (mut feeder, mut drain) = ring(64);
    let writer = thread::spawn(move || (0..100_000).for_each(|at| feeder.push(&moment(at))));
    let mut seen = Vec::new();
    while !writer.is_finished() {
        seen.extend(std::iter::from_fn(|| drain.pop()));
    }
    writer.join().expect("no panic");
    seen.extend(std::iter::from_fn(|| drain.pop()));
    assert!(seen.iter().all(|taken| *taken == moment(taken.exchange)));
    assert!(seen.is_sorted_by(|a, b| a.exchange < b.exchange));
    assert_eq!(seen.len() as u64 + drain.lost(), 100_000);
}

#[test]
fn a_trip_carries_the_second_before_it() {
    let mut recorder = Recorder::new(1_000_000);
    assert!(matches!(recorder.take(moment(0)), Some(Entry::Change(_))));
    assert!((1..5_000).all(|at| recorder.take(moment(at)).is_none()));
    let Some(Entry::Trip { moment: trip, second }) = recorder.take(with_code(moment(5_000))) else {
        panic!("a trip");
    };
    assert_eq!(trip.now_ns, 5_000_000_000);
    assert_eq!(second.len(), 1_000);
    assert_eq!(second.first().map(|first| first.exchange), Some(4_001));
    assert_eq!(second.last(), Some(&trip));
}

#[test]
fn a_chattering_bit_does_not_fill_the_book() {
    let mut recorder = Recorder::new(1_000_000);
    let entries = (0..1_000).filter_map(|at| {
        let mut moment = moment(at);
        moment.status[2] = at % 2;
        recorder.take(moment)
    });
    assert_eq!(entries.count(), 20);
    assert_eq!(recorder.suppressed(), 980);
}

fn changed(number: u64, moment: Moment) -> Record {
    Record { number, unix_ns: 0, entry: Some(Entry::Change(moment)), hash: [0; 32] }
}

/// LNZ-LOG-01, LNZ-LOG-03: ten entries, newest first, one for every change of the state.
#[test]
fn the_lenze_view_shows_the_ten_newest_changes() {
    let with_status = |at: u64| Moment { status: [0, 0, at % 2], inputs: [0xF; 2], ..moment(at) };
    let records: Vec<Record> = (0..30).map(|at| changed(at + 1, with_status(at))).collect();
    let entries = ten_entries(&records, 1, LogFunction::Active);
    assert_eq!(entries.len(), 10);
    assert_eq!(
        entries.iter().map(|entry| entry.time_ms).collect::<Vec<_>>(),
        (20..30).rev().collect::<Vec<_>>()
    );
    assert_eq!(entries[0].state & 0xF, 0b0010, "STO via S-bus");
    assert_eq!(ten_entries(&records, 1, LogFunction::StopOnSto)[0].time_ms, 1);
    assert!(ten_entries(&records, 2, LogFunction::Active).is_empty());
}

/// LNZ-LOG-02: an error makes a stop "through error", a low input "via SD-In".
#[test]
fn the_lenze_state_names_the_source_of_a_stop() {
    let stopped = Moment { status: [0, 0, 1], inputs: [0xF; 2], ..moment(1) };
    assert_eq!(log_state(&with_code(stopped)) & 0xF, 0b0100);
    assert_eq!(log_state(&Moment { inputs: [0xE; 2], ..stopped }) & 0xF, 0b0001);
}

#[test]
fn exports_name_every_record_and_the_newest_hash() {
    let folder = Folder::new("export");
    let findings = verify(&written(&folder));
    let csv = export::to_csv(&findings);
    let columns = export::CSV_HEADER.split(',').count();
    assert_eq!(csv.lines().count(), 1 + 6 + 20);
    assert!(csv.lines().filter(|line| !line.contains('"')).all(|line| line.split(',').count() == columns));
    let json = export::to_json_lines(&findings);
    assert_eq!(json.lines().count(), 7);
    assert!(json.contains("\"3606/13/6/0\""));
    assert!(json.ends_with(&format!("\"hash\":\"{}\"}}\n", export::hexadecimal(&findings.hash))));
}
