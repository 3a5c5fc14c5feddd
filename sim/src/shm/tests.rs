//! A domain in a temporary folder: created, opened, written, read, wiped.

use std::time::Duration;
use std::{env, fs, process};

use shm_schema::cell::Kind;
use shm_schema::encoder::Encoder;
use shm_schema::inhibit::Inhibit;

use super::{Domain, DomainError, Place};

fn place(name: &str) -> Place {
    let id = process::id();
    Place::new(env::temp_dir().join(format!("safepair-shm-{name}-{id}")), format!("sp{name}{id}_"), 77)
}

fn leftovers(place: &Place) -> usize {
    let files = fs::read_dir("/dev/shm").expect("shared memory is mounted");
    let ours = |name: &std::ffi::OsStr| name.to_string_lossy().starts_with(place.prefix());
    files.flatten().filter(|entry| ours(&entry.file_name())).count()
}

#[test]
fn what_the_producer_writes_is_what_a_second_participant_reads() {
    let place = place("pair");
    let axes = [1, 7, 64];
    let owner = Domain::create(&place, &axes).expect("creates");
    let other = Domain::open(&place, Duration::from_secs(2)).expect("opens");
    let mut writers = owner.writers::<Encoder>(Kind::Encoder, &axes).expect("one writer");
    let readers = other.readers::<Encoder>(Kind::Encoder, &axes).expect("a reader");
    assert!(readers[1].read().is_none(), "nobody has written yet");
    let payload = Encoder { drive_position: -5, ..Encoder::default() };
    writers[1].publish(&payload, 123);
    let (header, read) = readers[1].read().expect("sealed and sound");
    assert_eq!((header.axis, header.sequence, header.timestamp_ns, header.boot_nonce), (7, 1, 123, 77));
    assert_eq!(read, payload);
    assert!(readers[0].read().is_none());
    drop((owner, other, writers, readers));
    place.wipe().expect("wipes");
    assert_eq!(leftovers(&place), 0);
    fs::remove_dir_all(place.root()).expect("temporary folder");
}

#[test]
fn a_second_writer_of_a_kind_is_refused() {
    let place = place("twice");
    let domain = Domain::create(&place, &[1]).expect("creates");
    let first = domain.writers::<Inhibit>(Kind::InhibitA, &[1]).expect("the writer");
    assert!(matches!(domain.writers::<Inhibit>(Kind::InhibitA, &[1]), Err(DomainError::Service(..))));
    drop(first);
    domain.writers::<Inhibit>(Kind::InhibitA, &[1]).expect("free again");
    drop(domain);
    place.wipe().expect("wipes");
    fs::remove_dir_all(place.root()).expect("temporary folder");
}

#[test]
fn remains_of_a_killed_run_do_not_hinder_the_next() {
    let place = place("stale");
    let first = Domain::create(&place, &[1]).expect("creates");
    // A killed process runs no destructor.
    std::mem::forget(first);
    assert!(leftovers(&place) > 0);
    let second = Domain::create(&place, &[1, 2]).expect("creates over the remains");
    second.readers::<Inhibit>(Kind::InhibitB, &[2]).expect("the new one");
    drop(second);
    place.wipe().expect("wipes");
    fs::remove_dir_all(place.root()).expect("temporary folder");
}

#[test]
fn a_domain_that_is_not_there_is_an_error_within_the_deadline() {
    let place = place("absent");
    assert!(Domain::open(&place, Duration::from_secs(2)).is_err());
    let short = Place::new(env::temp_dir(), "x", 1);
    assert!(matches!(short.wipe(), Err(DomainError::Name(_))), "too short a prefix would hit others");
    let _ = fs::remove_dir_all(place.root());
}
