//! The process `safepair-sim` on a domain of its own: the test drives the paths in place of
//! the monitors. Waits for conditions with a deadline, never for a time.

use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::{Child, Command};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use params::AxisSet;
use shm_schema::cell::Kind;
use shm_schema::command::Command as CommandCell;
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::{Encoder, SlotKind};
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::profile::Profile;
use sim::shm::{CellReader, CellWriter, Domain, Place};

const DEADLINE: Duration = Duration::from_secs(20);

struct Rig {
    folder: PathBuf,
    place: Place,
    domain: Domain,
    child: Child,
}

impl Rig {
    fn start(name: &str) -> Self {
        let id = std::process::id();
        let folder = env::temp_dir().join(format!("safepair-sim-{name}-{id}"));
        let place = Place::new(&folder, format!("sps{name}{id}_"), 5);
        let domain = Domain::create(&place, &[1]).expect("creates");
        let set = AxisSet::delivery(Profile::AmkKw, 1, "SIM-0001");
        fs::write(folder.join("axis-01.a.img"), set.image_a(true)).expect("image");
        let child = Command::new(env!("CARGO_BIN_EXE_safepair-sim"))
            .args(["--domain", &folder.display().to_string(), "--prefix", place.prefix(), "--nonce", "5"])
            .args(["--images", &folder.display().to_string(), "--axes", "1"])
            .spawn()
            .expect("starts");
        Self { folder, place, domain, child }
    }

    fn reader<T: sim::shm::CellValue>(&self, kind: Kind) -> CellReader<T> {
        self.domain.readers(kind, &[1]).expect("a reader").remove(0)
    }

    fn writer<T: sim::shm::CellValue>(&self, kind: Kind) -> CellWriter<T> {
        self.domain.writers(kind, &[1]).expect("the writer").remove(0)
    }

    fn tell(&self, instruction: &str) {
        let socket = UnixDatagram::unbound().expect("a socket");
        let path = self.folder.join("master.sock");
        until("the control socket", || socket.send_to(instruction.as_bytes(), &path).is_ok());
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = self.place.wipe();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < DEADLINE, "{what} did not come");
        thread::sleep(Duration::from_micros(300));
    }
}

#[test]
fn the_drive_turns_only_while_both_paths_are_refreshed() {
    let rig = Rig::start("turn");
    let encoder = rig.reader::<Encoder>(Kind::Encoder);
    let readback = rig.reader::<Readback>(Kind::Readback);
    let mut inhibit_a = rig.writer::<Inhibit>(Kind::InhibitA);
    let mut inhibit_b = rig.writer::<Inhibit>(Kind::InhibitB);
    let request = DriveRequest { brake_open: true, ..DriveRequest::default() };
    rig.writer::<DriveRequest>(Kind::DriveRequest).publish(&request, 1);
    let mut edges = 0;
    let mut refresh = |b: bool| {
        edges += 1;
        inhibit_a.publish(&Inhibit { permit: true, edges, ..Inhibit::default() }, 1);
        if b {
            inhibit_b.publish(&Inhibit { permit: true, edges, ..Inhibit::default() }, 1);
        }
    };
    until("movement", || {
        refresh(true);
        // A pause of this test loses the torque, and with it the set point.
        rig.tell(r#"{"axis":1,"set_point_rpm":1500}"#);
        encoder.read().is_some_and(|(_, sample)| sample.slots[0].count > 1_000)
    });
    let (header, sample) = encoder.read().expect("published");
    assert_eq!((header.boot_nonce, sample.slots[0].kind), (5, SlotKind::SineCosine));
    assert_eq!(sample.slots[1].kind, SlotKind::Resolver);
    until("path B dropped by the missing edges", || {
        refresh(false);
        readback.read().is_some_and(|(_, paths)| !paths.path_b)
    });
    until("no torque", || encoder.read().is_some_and(|(_, sample)| sample.torque_ppm == 0));
}

#[test]
fn the_master_shows_what_it_was_told() {
    let rig = Rig::start("word");
    let command = rig.reader::<CommandCell>(Kind::Command);
    until("the neutral word", || command.read().is_some_and(|(_, c)| c.word.0[0] == 0x7E7F));
    rig.tell(r#"{"clear":[9],"clear_error":true}"#);
    until("the request", || command.read().is_some_and(|(_, c)| (c.word.0[0] == 0x7C7F) & c.clear_error));
    rig.tell(r#"{"acknowledge":true}"#);
    until("the acknowledge", || command.read().is_some_and(|(_, c)| c.word.bit(7)));
    until("its end", || command.read().is_some_and(|(_, c)| !c.word.bit(7)));
}

/// DEC-26: a stall of the host is missed exchanges, not a producer whose clock runs slow.
#[test]
fn a_stall_shows_as_a_jump_of_the_sequence_that_fits_the_time_stamps() {
    let rig = Rig::start("stall");
    let encoder = rig.reader::<Encoder>(Kind::Encoder);
    until("the first sample", || encoder.read().is_some());
    let process = Pid::from_raw(rig.child.id() as i32);
    kill(process, Signal::SIGSTOP).expect("it runs");
    let stopped = Instant::now();
    until("the end of the stall", || stopped.elapsed() > Duration::from_millis(30));
    let (before, _) = encoder.read().expect("published");
    kill(process, Signal::SIGCONT).expect("it runs");
    for later in 1..20 {
        until("a sample", || {
            encoder.read().is_some_and(|(header, _)| header.sequence >= before.sequence + later)
        });
        let (header, sample) = encoder.read().expect("published");
        assert_eq!(sample.period_ns, 1_000_000);
        let counted = (header.sequence - before.sequence) as f64;
        let stamped = (header.timestamp_ns - before.timestamp_ns) as f64 / 1e6;
        // Each sample is late by less than a cycle, or it would have been skipped.
        assert!((counted - stamped).abs() < 2.0, "{counted} cycles in {stamped} ms");
    }
}

#[test]
fn sigterm_ends_it_with_success_and_a_wrong_option_with_2() {
    let mut rig = Rig::start("end");
    let encoder = rig.reader::<Encoder>(Kind::Encoder);
    until("the first sample", || encoder.read().is_some());
    kill(Pid::from_raw(rig.child.id() as i32), Signal::SIGTERM).expect("it runs");
    assert_eq!(rig.child.wait().expect("ends").code(), Some(0));
    let wrong = Command::new(env!("CARGO_BIN_EXE_safepair-sim")).args(["--cycle-us", "5"]).status();
    assert_eq!(wrong.expect("runs").code(), Some(2));
}
