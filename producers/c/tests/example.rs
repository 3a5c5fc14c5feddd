//! The example in C, built by the system's compiler, against a domain as `safepair run` makes it.

use std::path::{Path, PathBuf};
use std::process::Command;

use shm_schema::cell::{Header, Kind};
use shm_schema::encoder::{Encoder, SlotKind};
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::io::Io;
use sim::shm::{CellValue, Domain, Place};

const AXIS: u8 = 3;
const NONCE: u32 = 77;

/// A domain of its own, removed at the end.
struct Run(Place);

impl Run {
    fn new(name: &str) -> (Self, Domain) {
        let root = std::env::temp_dir().join(format!("safepair-c-{name}-{}", std::process::id()));
        let place = Place::new(root, format!("c_{name}_{}_", std::process::id()), NONCE);
        let domain = Domain::create(&place, &[AXIS]).expect("a domain");
        (Self(place), domain)
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        let _ = self.0.wipe();
        let _ = std::fs::remove_dir_all(self.0.root());
    }
}

/// The folder of this test's program, beside which cargo puts the library.
fn built() -> PathBuf {
    let own = std::env::current_exe().expect("this test has a file");
    own.parent().expect("a folder").to_path_buf()
}

/// `libsafepair.a` of this profile: cargo builds it with this test.
fn library() -> PathBuf {
    let folder = built();
    let up = folder.parent().expect("target/<profile>").join("libsafepair.a");
    let candidates = std::fs::read_dir(&folder).expect("a folder").flatten().map(|entry| entry.path());
    let mut hashed: Vec<PathBuf> = candidates
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let archive = path.extension().is_some_and(|ending| ending == "a");
            name.starts_with("libsafepair") & archive
        })
        .chain(up.is_file().then_some(up))
        .collect();
    let age = |path: &PathBuf| std::fs::metadata(path).and_then(|data| data.modified()).ok();
    hashed.sort_by_key(age);
    hashed.pop().expect("libsafepair.a: cargo builds it with the tests of this package")
}

/// Builds the example as its first comment says; as strictly as a compiler can.
fn example(name: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let out = built().join(format!("safepair-example-{name}"));
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let mut command = Command::new(compiler);
    command.args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"]).arg(here.join("include"));
    command
        .arg(here.join("example/drive.c"))
        .arg(library())
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&out);
    let output = command.output().expect("a C compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    out
}

fn drive(program: &Path, place: &Place, axis: u8) -> (Option<i32>, String) {
    let root = place.root();
    let mut command = Command::new(program);
    command.arg(root).args([place.prefix(), &NONCE.to_string(), &axis.to_string()]);
    let output = command.output().expect("the example starts");
    let said = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8_lossy(&said).into_owned())
}

fn newest<T: CellValue>(domain: &Domain, kind: Kind) -> (Header, T) {
    let mut readers = domain.readers::<T>(kind, &[AXIS]).expect("a reader");
    readers.pop().and_then(|reader| reader.read()).expect("a sound cell")
}

#[test]
fn a_drive_in_c_publishes_cells_that_a_reader_accepts_and_sees_the_paths() {
    let (run, domain) = Run::new("drive");
    let program = example("drive");
    let mut path = domain.writers::<Inhibit>(Kind::InhibitA, &[AXIS]).expect("channel A's path");
    path[0].publish(&Inhibit { permit: true, edges: 41, ..Inhibit::default() }, 1);

    let (code, said) = drive(&program, &run.0, AXIS);
    // One edge and no more: the evaluator has dropped the path again.
    assert_eq!((code, said.as_str()), (Some(0), "paths 0 0 edges 41 0\n"));

    let (header, encoder) = newest::<Encoder>(&domain, Kind::Encoder);
    assert_eq!((header.sequence, header.boot_nonce, header.axis), (100, NONCE, AXIS));
    assert_eq!((encoder.slots[1].kind, encoder.slots[1].cosine), (SlotKind::SineCosine, 16_384));
    assert_eq!(encoder.period_ns, 1_000_000);
    let (_, io) = newest::<Io>(&domain, Kind::Io);
    assert_eq!((io.samples, io.line_2), (1_600, [u64::MAX; 4]));
    let (_, readback) = newest::<Readback>(&domain, Kind::Readback);
    assert_eq!((readback.path_a, readback.edges_a, readback.edges_b), (false, 41, 0));
    let mut encoder = domain.readers::<Encoder>(Kind::Encoder, &[AXIS]).expect("a reader");
    let octets = encoder.pop().expect("one").octets();
    assert!(checked_by_b(&octets), "CRC-32C as channel B computes it");
}

/// The second check sum is channel B's: computed here bit by bit.
fn checked_by_b(octets: &[u8]) -> bool {
    let crc = octets[8..].iter().fold(u32::MAX, |crc, octet| {
        let step = |crc: u32, _| crc >> 1 ^ if crc & 1 == 1 { 0x82F6_3B78 } else { 0 };
        (0..8).fold(crc ^ u32::from(*octet), step)
    });
    u32::from_le_bytes([octets[4], octets[5], octets[6], octets[7]]) == !crc
}

#[test]
fn a_domain_or_an_axis_that_is_not_there_is_an_error_and_no_crash() {
    let (run, domain) = Run::new("absent");
    let program = example("absent");
    assert_eq!(drive(&program, &run.0, AXIS + 1).0, Some(3), "another axis");
    assert_eq!(drive(&program, &run.0, 0).0, Some(3), "no axis at all");
    drop(domain);
    let elsewhere = Place::new(run.0.root().join("elsewhere"), "c_elsewhere_", NONCE);
    let (code, said) = drive(&program, &elsewhere, AXIS);
    assert_eq!(code, Some(3), "{said}");
}
