//! The process of channel A against shared memory made by hand: it opens, runs, reports,
//! and ends with its path off.
#![cfg(feature = "shell")]

use std::path::PathBuf;
use std::process::{Child, Command as Process};
use std::time::{Duration, Instant};

use channel_a::crc32;
use iceoryx2::port::reader::Reader;
use iceoryx2::port::writer::Writer;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use shm_schema::cell::{Header, Kind, Payload, seal};
use shm_schema::encoder::{Encoder, Slot, SlotKind};
use shm_schema::image::{MAGIC, VERSION};
use shm_schema::inhibit::Inhibit;
use shm_schema::profile::Profile;
use shm_schema::report::{Phase, Report};
use shm_schema::wire::{Source, Wire};

type Service = PortFactory<ipc::Service, u32>;
const NONCE: u32 = 77;
const DEADLINE: Duration = Duration::from_secs(20);

struct Domain {
    folder: PathBuf,
    prefix: String,
    services: Vec<(Kind, Service)>,
    _node: Node<ipc::Service>,
}

impl Drop for Domain {
    fn drop(&mut self) {
        self.services.clear();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Domain {
    fn new(name: &str) -> Self {
        let prefix = format!("spa{name}{}_", std::process::id());
        let folder = std::env::temp_dir().join(&prefix);
        std::fs::create_dir_all(folder.join("iox2")).unwrap();
        let mut config = Config::default();
        let root = folder.join("iox2");
        config.global.set_root_path(&Path::new(root.as_os_str().as_encoded_bytes()).unwrap());
        config.global.prefix = FileName::new(prefix.as_bytes()).unwrap();
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .unwrap();
        macro_rules! create {
            ($($kind:ident: $payload:ty),*) => { vec![$({
                let kind = Kind::$kind;
                let name = format!("safepair/{}/{:08x}", kind.name(), kind.layout());
                let name = ServiceName::new(&name).unwrap();
                let builder = node.service_builder(&name).blackboard_creator::<u32>();
                let service = builder.add::<[u8; <$payload>::CELL]>(1, [0; <$payload>::CELL]).create().unwrap();
                (kind, service)
            }),*] };
        }
        let services = create!(
            Encoder: Encoder, Io: shm_schema::io::Io, Command: shm_schema::command::Command,
            ReportA: Report, ReportB: Report, Agreement: shm_schema::agreement::Agreement,
            Readback: shm_schema::inhibit::Readback, InhibitA: Inhibit, AnswerA: shm_schema::answer::Answer
        );
        Self { folder, prefix, services, _node: node }
    }

    fn service(&self, kind: Kind) -> &Service {
        &self.services.iter().find(|(known, _)| *known == kind).unwrap().1
    }

    fn reader(&self, kind: Kind) -> Reader<ipc::Service, u32> {
        self.service(kind).reader_builder().create().unwrap()
    }

    fn writer(&self, kind: Kind) -> Writer<ipc::Service, u32> {
        self.service(kind).writer_builder().create().unwrap()
    }

    fn start(&self) -> Child {
        self.start_with(&self.prefix)
    }

    fn start_with(&self, prefix: &str) -> Child {
        Process::new(env!("CARGO_BIN_EXE_safepair-channel-a"))
            .args(["--domain", self.folder.to_str().unwrap(), "--prefix", prefix])
            .args(["--nonce", &NONCE.to_string(), "--axes", "1", "--cycle-us", "1000"])
            .args(["--images", self.folder.to_str().unwrap(), "--inhibit", "sim"])
            .spawn()
            .unwrap()
    }
}

/// The delivery state of AMK, sealed for axis 1.
fn image() -> Vec<u8> {
    let octets = |words: &[u32]| -> Vec<u8> { words.iter().flat_map(|word| word.to_le_bytes()).collect() };
    let profile = Profile::AmkKw as u32;
    let content = crc32(&octets(&[profile]));
    let mut device = Vec::from(content.to_le_bytes());
    device.extend_from_slice(&[0; 24]);
    let template = crc32(&octets(&[u32::from(VERSION), profile]));
    let kind = u32::from(VERSION) << 16 | profile << 8 | 1;
    let mut all = octets(&[MAGIC, kind, 0, template, content, crc32(&device), 1, 0, 0, 0, 0, 0, 0]);
    let sum = crc32(&all).to_le_bytes();
    all.extend_from_slice(&sum);
    all
}

fn now_ns() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the structure lives over the call.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time) };
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

fn sample(sequence: u64) -> [u8; Encoder::CELL] {
    let slot = Slot { kind: SlotKind::SineCosine, sine: 0, cosine: 16_384, ..Slot::default() };
    let header = Header {
        layout: Kind::Encoder.layout(),
        length: Encoder::CELL as u16,
        kind: Kind::Encoder,
        writer: Kind::Encoder.writer(),
        boot_nonce: NONCE,
        axis: 1,
        sequence,
        timestamp_ns: now_ns(),
        ..Header::default()
    };
    let mut octets = [0; Encoder::CELL];
    let payload = Encoder { slots: [slot, Slot::default()], period_ns: 1_000_000, ..Encoder::default() };
    payload.write(&header, &mut octets);
    seal(&mut octets, crc32, |_| 0);
    octets
}

#[test]
fn the_process_opens_runs_reports_and_ends_with_its_path_off() {
    let domain = Domain::new("run");
    std::fs::write(domain.folder.join("axis-01.a.img"), image()).unwrap();
    let encoder = domain.writer(Kind::Encoder);
    let encoder = encoder.entry::<[u8; Encoder::CELL]>(&1).unwrap();
    let reports = domain.reader(Kind::ReportA);
    let reports = reports.entry::<[u8; Report::CELL]>(&1).unwrap();
    let paths = domain.reader(Kind::InhibitA);
    let paths = paths.entry::<[u8; Inhibit::CELL]>(&1).unwrap();
    let mut child = domain.start();
    let begun = Instant::now();
    let mut sequence = 0;
    let report = loop {
        sequence += 1;
        encoder.update_with_copy(sample(sequence));
        std::thread::sleep(Duration::from_millis(1));
        let octets = *reports.get();
        let report = Report::read(&octets).filter(|report| report.phase == Phase::Pairing);
        if let Some(report) = report {
            break report;
        }
        assert!(begun.elapsed() < DEADLINE, "no report came in time");
        assert!(child.try_wait().unwrap().is_none(), "the process ended");
    };
    assert_eq!((report.ready, report.driving, report.status.bit(0)), (false, false, true));
    let before = Header::take(&mut Source::new(&*paths.get())).unwrap().sequence;
    Process::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let octets = *paths.get();
    let after = Header::take(&mut Source::new(&octets)).unwrap();
    assert!(after.sequence > before);
    assert!(!Inhibit::read(&octets).unwrap().permit);
}

#[test]
fn a_domain_that_is_not_there_ends_the_process_within_its_deadline() {
    let domain = Domain::new("none");
    std::fs::write(domain.folder.join("axis-01.a.img"), image()).unwrap();
    let begun = Instant::now();
    assert_eq!(domain.start_with("spa_nobody_").wait().unwrap().code(), Some(3));
    assert!(begun.elapsed() < Duration::from_secs(10));
}

#[test]
fn a_wrong_option_is_exit_2() {
    let status =
        Process::new(env!("CARGO_BIN_EXE_safepair-channel-a")).args(["--cycle-us", "5"]).status().unwrap();
    assert_eq!(status.code(), Some(2));
}
