//! The process itself: options, opening, agreement, end. Every wait has a condition and a deadline.
#![cfg(feature = "shell")]

use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use crosscheck::guard::{Guard, crc32, crc32c};
use crosscheck::logbook::{self, Entry};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use shm_schema::agreement::{Agreement, PathTest};
use shm_schema::cell::{Header, Kind, Payload, seal};
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::Encoder;
use shm_schema::image::{MAGIC, VERSION};
use shm_schema::inhibit::Readback;
use shm_schema::profile::Profile;
use shm_schema::report::{Phase, Report};

type Service = PortFactory<ipc::Service, u32>;

const NONCE: u32 = 4_242;
const AXIS: u8 = 1;
const CYCLE: Duration = Duration::from_millis(4);
const DEADLINE: Duration = Duration::from_secs(20);

/// A domain with one axis, its image and its services.
struct Machine {
    root: PathBuf,
    prefix: String,
    node: Option<Node<ipc::Service>>,
}

impl Machine {
    fn new(name: &str) -> Self {
        let id = std::process::id();
        let root = env::temp_dir().join(format!("safepair-crosscheck-{name}-{id}"));
        fs::create_dir_all(root.join("iox2")).expect("temporary folder");
        fs::write(root.join("axis-01.a.img"), image()).expect("temporary file");
        let prefix = format!("cc{name}{id}_");
        let mut config = Config::default();
        let path = root.join("iox2");
        config.global.set_root_path(&Path::new(path.as_os_str().as_encoded_bytes()).expect("a path"));
        config.global.prefix = FileName::new(prefix.as_bytes()).expect("a name");
        let node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
        Self { root, prefix, node: Some(node) }
    }

    fn create<const N: usize>(&self, kind: Kind) -> Service {
        let name = format!("safepair/{}/{:08x}", kind.name(), kind.layout());
        let node = self.node.as_ref().expect("alive");
        let builder = node.service_builder(&name.as_str().try_into().expect("a name"));
        let creator = builder.blackboard_creator::<u32>().add(u32::from(AXIS), [0_u8; N]);
        creator.create().expect("created once")
    }

    fn start(&self) -> Child {
        let root = self.root.display();
        let options = format!(
            "--domain {root} --prefix {} --nonce {NONCE} --cycle-us 4000 --phase-us 0 --axes {AXIS} --images {root} --logbook {root}/log",
            self.prefix
        );
        Command::new(env!("CARGO_BIN_EXE_safepair-crosscheck"))
            .args(options.split_whitespace())
            .spawn()
            .expect("the binary exists")
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        drop(self.node.take());
        let _ = fs::remove_dir_all(&self.root);
        // The library leaves the node's own memory behind, as our processes never clean up.
        let files = fs::read_dir("/dev/shm").into_iter().flatten().flatten();
        for file in files.filter(|file| file.file_name().to_string_lossy().starts_with(&self.prefix)) {
            let _ = fs::remove_file(file.path());
        }
    }
}

fn image() -> Vec<u8> {
    let mut words = vec![MAGIC, u32::from(VERSION) << 16 | (Profile::AmkKw as u32) << 8 | u32::from(AXIS)];
    words.extend([1, 0, 99, 0, 1, 0, 0, 0, 0, 0, 0, 105, 7]);
    let mut octets: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    octets.extend(crc32(&octets).to_le_bytes());
    octets
}

struct Output<const N: usize> {
    entry: EntryHandleMut<ipc::Service, u32, [u8; N]>,
    kind: Kind,
    _port: Writer<ipc::Service, u32>,
}

impl<const N: usize> Output<N> {
    fn new(service: &Service, kind: Kind) -> Self {
        let port = service.writer_builder().create().expect("the only writer");
        let entry = port.entry(&u32::from(AXIS)).expect("the axis");
        Self { entry, kind, _port: port }
    }

    fn publish<T: Payload>(&self, payload: &T, sequence: u64) {
        let header = Header {
            layout: self.kind.layout(),
            length: N as u16,
            kind: self.kind,
            writer: self.kind.writer(),
            boot_nonce: NONCE,
            axis: AXIS,
            sequence,
            timestamp_ns: now_ns(),
            ..Header::default()
        };
        let mut octets = [0; N];
        payload.write(&header, &mut octets);
        seal(&mut octets, crc32, crc32c);
        self.entry.update_with_copy(octets);
    }
}

fn now_ns() -> u64 {
    let time = nix::time::clock_gettime(nix::time::ClockId::CLOCK_MONOTONIC).expect("a clock");
    time.tv_sec() as u64 * 1_000_000_000 + time.tv_nsec() as u64
}

fn wait(child: &mut Child) -> ExitStatus {
    let begun = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("a child") {
            return status;
        }
        if begun.elapsed() > DEADLINE {
            let _ = child.kill();
            panic!("did not end within {DEADLINE:?}");
        }
        thread::sleep(Duration::from_millis(5));
    }
}

fn terminate(child: &Child) {
    let id = nix::unistd::Pid::from_raw(child.id() as i32);
    nix::sys::signal::kill(id, nix::sys::signal::Signal::SIGTERM).expect("our own child");
}

/// Architecture, processes: pairing, echo, self-test, end by SIGTERM with a last word.
#[test]
fn the_process_answers_two_reports_with_an_agreement_and_ends_without_a_permit() {
    let machine = Machine::new("agree");
    let report_a = machine.create::<{ Report::CELL }>(Kind::ReportA);
    let report_b = machine.create::<{ Report::CELL }>(Kind::ReportB);
    let readback = machine.create::<{ Readback::CELL }>(Kind::Readback);
    let encoder = machine.create::<{ Encoder::CELL }>(Kind::Encoder);
    let agreement = machine.create::<{ Agreement::CELL }>(Kind::Agreement);
    let _drive = machine.create::<{ DriveRequest::CELL }>(Kind::DriveRequest);
    let a = Output::<{ Report::CELL }>::new(&report_a, Kind::ReportA);
    let b = Output::<{ Report::CELL }>::new(&report_b, Kind::ReportB);
    let readback = Output::<{ Readback::CELL }>::new(&readback, Kind::Readback);
    let encoder = Output::<{ Encoder::CELL }>::new(&encoder, Kind::Encoder);
    let port = agreement.reader_builder().create().expect("a reader");
    let entry = port.entry::<[u8; Agreement::CELL]>(&u32::from(AXIS)).expect("the axis");
    let mut guard = Guard::new(Kind::Agreement, AXIS, NONCE);

    let mut child = machine.start();
    let begun = Instant::now();
    let (mut sequence, mut raised) = (0, false);
    while !raised {
        assert!(begun.elapsed() < DEADLINE, "no self-test began");
        sequence += 1;
        encoder.publish(&Encoder::default(), sequence);
        readback.publish(&Readback::default(), sequence);
        let report = Report {
            exchange: sequence,
            time_ns: now_ns(),
            parameter_signature: 99,
            phase: Phase::SelfTest,
            ..Report::default()
        };
        a.publish(&report, sequence);
        b.publish(&report, sequence);
        thread::sleep(CYCLE);
        if let Ok(answer) = guard.check::<Agreement>(&*entry.get(), crc32) {
            let answer = answer.payload;
            assert!(!answer.permit);
            assert!(answer.exchange <= sequence);
            raised = answer.path_test == PathTest::RaiseA;
            // On a busy machine this test is late itself; then the error is acknowledged no more.
            if answer.error {
                break;
            }
        }
    }
    terminate(&child);
    assert!(wait(&mut child).success());
    let last = guard.check::<Agreement>(&*entry.get(), crc32).expect("a last word").payload;
    assert_eq!(last, Agreement::default());

    let log = logbook::verify::verify_all(&machine.root.join("log")).expect("a logbook");
    assert!(log.is_whole(), "{:?}", log.faults);
    let entries: Vec<&Entry> = log.records.iter().filter_map(|record| record.entry.as_ref()).collect();
    assert!(
        matches!(entries.first(), Some(Entry::Start { nonce: NONCE, axes, .. }) if axes == &[(AXIS, 1, 99)])
    );
    assert!(entries.iter().any(|entry| matches!(entry, Entry::Change(moment) if moment.phases == [3, 3])));
    assert_eq!(entries.last(), Some(&&Entry::End));
}

#[test]
fn without_a_domain_it_ends_with_three() {
    let machine = Machine::new("none");
    let mut child = machine.start();
    assert_eq!(wait(&mut child).code(), Some(3));
}

#[test]
fn a_wrong_option_ends_it_with_two() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_safepair-crosscheck"))
        .args(["--nonce", "0"])
        .spawn()
        .expect("the binary exists");
    assert_eq!(wait(&mut child).code(), Some(2));
}
