//! Garbage, damaged, truncated, repeated and foreign cells before all three readers
//! (design 3.5). A blackboard has one writer, so no saboteur can take its place: the cells
//! are shown to the guards themselves.

use channel_a::guard as a;
use channel_b::guard as b;
use crosscheck::guard as x;
use shm_schema::agreement::Agreement;
use shm_schema::cell::{Header, Kind, Writer};
use shm_schema::command::Command;
use shm_schema::encoder::Encoder;
use shm_schema::exchange::CellFault;
use shm_schema::inhibit::Readback;
use shm_schema::io::Io;
use shm_schema::report::Report;
use sim::shm::{CellValue, compose};
use system_tests::compare::random::Random;

const NONCE: u32 = 0x5AFE_0001;
const AXIS: u8 = 7;
/// Where the check sums stand that one reader does not check: A and crosscheck rest on
/// CRC-32 in octets 0 to 3, B on CRC-32C in octets 4 to 7.
const CRC32C: std::ops::Range<usize> = 4..8;
const CRC32: std::ops::Range<usize> = 0..4;

/// Spoils one field; given are a kind and a writer that are not the cell's own.
type Change = fn(&mut Header, Kind, Writer);
type Verdict = Result<u64, CellFault>;

/// The guards of all three readers for cells of one kind.
struct Guards {
    a: a::Guard,
    b: b::Guard,
    crosscheck: x::Guard,
}

impl Guards {
    fn new(kind: Kind) -> Self {
        Self {
            a: a::Guard::new(kind, AXIS, NONCE),
            b: b::Guard::new(kind, AXIS, NONCE),
            crosscheck: x::Guard::new(kind, AXIS, NONCE),
        }
    }

    /// What A, B and crosscheck say.
    fn judge<T: CellValue>(&mut self, octets: &[u8]) -> [Verdict; 3] {
        let a = self.a.check::<T>(octets, a::crc32).map(|cell| cell.sequence);
        let b = self.b.check::<T>(octets, channel_b::crc::crc32c).map(|cell| cell.sequence);
        let crosscheck = self.crosscheck.check::<T>(octets, x::crc32).map(|cell| cell.sequence);
        [a, b, crosscheck]
    }
}

fn header(kind: Kind) -> Header {
    Header { sequence: 1_000, timestamp_ns: 5_000_000_000, ..Header::of(kind, AXIS, NONCE) }
}

/// Runs `$test::<Payload>(kind)` for every kind that a monitor reads.
macro_rules! every_kind {
    ($test:ident) => {
        $test::<Encoder>(Kind::Encoder);
        $test::<Io>(Kind::Io);
        $test::<Command>(Kind::Command);
        $test::<Report>(Kind::ReportA);
        $test::<Report>(Kind::ReportB);
        $test::<Agreement>(Kind::Agreement);
        $test::<Readback>(Kind::Readback);
    };
}

fn sound<T: CellValue>(kind: Kind) -> T::Octets {
    compose(&header(kind), &T::default())
}

fn passes<T: CellValue>(kind: Kind) {
    let cell = sound::<T>(kind);
    let mut guards = Guards::new(kind);
    assert_eq!(guards.judge::<T>(cell.as_ref()), [Ok(1_000); 3], "{kind:?}");
    assert_eq!(guards.judge::<T>(cell.as_ref()), [Ok(1_000); 3], "{kind:?}: read twice is no fault");
}

#[test]
fn a_sound_cell_passes_every_reader() {
    every_kind!(passes);
}

fn damage<T: CellValue>(kind: Kind) {
    let mut random = Random::new(kind as u64);
    let cell = sound::<T>(kind);
    for octet in 0..cell.as_ref().len() {
        for _ in 0..4 {
            let mut damaged = cell;
            damaged.as_mut()[octet] ^= random.between(1, 255) as u8;
            let [a, b, crosscheck] = Guards::new(kind).judge::<T>(damaged.as_ref());
            let own = !CRC32C.contains(&octet);
            assert_eq!(a.is_err(), own, "{kind:?}, octet {octet}, A: {a:?}");
            assert_eq!(crosscheck.is_err(), own, "{kind:?}, octet {octet}, crosscheck: {crosscheck:?}");
            assert_eq!(b.is_err(), !CRC32.contains(&octet), "{kind:?}, octet {octet}, B: {b:?}");
        }
    }
}

#[test]
fn every_damaged_octet_is_refused_by_each_reader() {
    every_kind!(damage);
}

fn cut<T: CellValue>(kind: Kind) {
    let cell = sound::<T>(kind);
    let octets = cell.as_ref();
    for length in 0..octets.len() {
        let verdicts = Guards::new(kind).judge::<T>(&octets[..length]);
        assert_eq!(verdicts, [Err(CellFault::Length); 3], "{kind:?}, {length} octets");
    }
    let longer = [octets, &[0]].concat();
    assert_eq!(Guards::new(kind).judge::<T>(&longer), [Err(CellFault::Length); 3], "{kind:?}");
    // Torn: the beginning of a new cell before the rest of the old one.
    let mut newer = header(kind);
    newer.sequence += 1;
    newer.timestamp_ns += 4_000_000;
    let new = compose(&newer, &T::default());
    let torn = [&new.as_ref()[..40], &octets[40..]].concat();
    let verdicts = Guards::new(kind).judge::<T>(&torn);
    let mixed = torn != new.as_ref();
    assert_eq!(verdicts.iter().all(Result::is_err), mixed, "{kind:?}: {verdicts:?}");
}

#[test]
fn a_truncated_or_too_long_cell_is_refused_by_each_reader() {
    every_kind!(cut);
}

fn noise<T: CellValue>(kind: Kind) {
    let mut random = Random::new(77 + kind as u64);
    let mut guards = Guards::new(kind);
    for _ in 0..2_000 {
        let mut octets = T::EMPTY;
        octets.as_mut().fill_with(|| random.bits() as u8);
        let verdicts = guards.judge::<T>(octets.as_ref());
        assert!(verdicts.iter().all(Result::is_err), "{kind:?}: {verdicts:?}");
    }
    let empty = guards.judge::<T>(T::EMPTY.as_ref());
    assert!(empty.iter().all(Result::is_err), "{kind:?}, never written: {empty:?}");
    // Garbage changes no guard's mind about what comes after it.
    assert_eq!(guards.judge::<T>(sound::<T>(kind).as_ref()), [Ok(1_000); 3], "{kind:?}");
}

#[test]
fn garbage_is_refused_by_each_reader_and_spoils_nothing() {
    every_kind!(noise);
}

fn foreign<T: CellValue>(kind: Kind) {
    let other = if kind == Kind::Encoder { Kind::Io } else { Kind::Encoder };
    let writer = if kind.writer() == Writer::Gateway { Writer::Producer } else { Writer::Gateway };
    let changes: [(&str, Change); 8] = [
        ("boot nonce", |header, _, _| header.boot_nonce ^= 1),
        ("boot nonce 0", |header, _, _| header.boot_nonce = 0),
        ("axis", |header, _, _| header.axis += 1),
        ("kind", |header, kind, _| header.kind = kind),
        ("writer", |header, _, writer| header.writer = writer),
        ("layout", |header, _, _| header.layout ^= 0x8000_0000),
        ("length", |header, _, _| header.length -= 1),
        ("sequence 0", |header, _, _| header.sequence = 0),
    ];
    for (what, change) in changes {
        let mut changed = header(kind);
        change(&mut changed, other, writer);
        // Both check sums are right: only the field itself is wrong.
        let cell = compose(&changed, &T::default());
        let verdicts = Guards::new(kind).judge::<T>(cell.as_ref());
        assert!(verdicts.iter().all(Result::is_err), "{kind:?}, {what}: {verdicts:?}");
    }
}

#[test]
fn a_cell_from_elsewhere_is_refused_by_each_reader() {
    every_kind!(foreign);
}

fn replayed<T: CellValue>(kind: Kind) {
    let mut guards = Guards::new(kind);
    let of = |sequence: u64, timestamp_ns: u64| {
        compose(&Header { sequence, timestamp_ns, ..header(kind) }, &T::default())
    };
    assert_eq!(guards.judge::<T>(of(1_000, 5_000_000_000).as_ref()), [Ok(1_000); 3]);
    for (sequence, timestamp_ns) in [(999, 5_000_000_000), (1, 6_000_000_000), (1_001, 4_999_999_999)] {
        let verdicts = guards.judge::<T>(of(sequence, timestamp_ns).as_ref());
        let told = format!("{kind:?}, {sequence} at {timestamp_ns}: {verdicts:?}");
        assert_eq!(verdicts, [Err(CellFault::Order); 3], "{told}");
    }
    assert_eq!(guards.judge::<T>(of(1_001, 5_004_000_000).as_ref()), [Ok(1_001); 3], "{kind:?}");
}

#[test]
fn a_cell_that_was_there_before_is_refused_by_each_reader() {
    every_kind!(replayed);
}
