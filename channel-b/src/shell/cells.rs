//! The shared memory: opened once before the cycle, then read and written without a call
//! to the system.

use std::sync::mpsc;
use std::time::Duration;

use channel_b::Monitor;
use channel_b::crc::{Walk, crc32};
use channel_b::guard::Guard;
use channel_b::image;
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use shm_schema::agreement::Agreement;
use shm_schema::answer::Answer;
use shm_schema::cell::{Header, Kind, Payload, seal};
use shm_schema::command::{Command, CommandSource};
use shm_schema::encoder::Encoder;
use shm_schema::exchange::{Bus, Inputs, Outputs, Published, Received, Setup, Start};
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::io::Io;
use shm_schema::report::Report;

use super::Trouble;
use super::checksum::{CheckSum, fastest};
use super::options::Options;

/// Thread-safe handles, because opening happens on a thread that can be left behind.
type Ipc = ipc_threadsafe::Service;
type Blackboard = PortFactory<Ipc, u32>;

/// Octets of the image checked in each cycle: 12 KiB in well under 10 s at any cycle.
const WALK: usize = 64;

const READ: [Kind; 6] =
    [Kind::Encoder, Kind::Io, Kind::Command, Kind::ReportA, Kind::Agreement, Kind::Readback];
const WRITTEN: [Kind; 3] = [Kind::ReportB, Kind::InhibitB, Kind::AnswerB];

/// All axes, and what their cells live in.
#[allow(clippy::struct_field_names, reason = "the axes are what it is about")]
pub struct Axes {
    /// The axes in use.
    pub axes: Vec<Axis>,
    // Behind the entries: ports, services and node outlive them, in this order.
    _readers: Vec<Reader<Ipc, u32>>,
    _writers: Vec<Writer<Ipc, u32>>,
    _services: Vec<Blackboard>,
    _node: Node<Ipc>,
}

/// One axis: its core, image and cells.
pub struct Axis {
    monitor: Box<Monitor>,
    image: Vec<u8>,
    walk: Walk,
    image_sound: bool,
    plain_command: bool,
    published: Option<Published>,
    encoder: Input<{ Encoder::CELL }>,
    io: Input<{ Io::CELL }>,
    command: Input<{ Command::CELL }>,
    partner: Input<{ Report::CELL }>,
    agreement: Input<{ Agreement::CELL }>,
    readback: Input<{ Readback::CELL }>,
    report: Output<{ Report::CELL }>,
    inhibit: Output<{ Inhibit::CELL }>,
    answer: Output<{ Answer::CELL }>,
}

/// Opens what the supervisor created. A half-created domain can hang the library for ever,
/// so this is done on a thread that is left behind at the deadline.
pub fn open(options: &Options, deadline: Duration) -> Result<Axes, Trouble> {
    let plan = Opening {
        root: options.domain.join("iox2"),
        prefix: options.prefix.clone(),
        nonce: options.nonce,
        cycle_ns: options.cycle_ns,
        axes: options.axes.clone(),
        images: options.images.clone(),
        plain_command: options.plain_command,
        age_factor: options.age_factor,
        buses: options.buses.clone(),
        partner_build: options.partner_build,
    };
    let (done, result) = mpsc::channel();
    std::thread::Builder::new()
        .name("open".into())
        .spawn(move || done.send(plan.open()))
        .map_err(|error| Trouble::new("thread", error))?;
    let late = || Trouble::new("shared-memory domain", format!("not open after {} ms", deadline.as_millis()));
    result.recv_timeout(deadline).map_err(|_| late())?
}

struct Opening {
    root: std::path::PathBuf,
    prefix: String,
    nonce: u32,
    cycle_ns: u64,
    axes: Vec<u8>,
    images: std::path::PathBuf,
    plain_command: bool,
    age_factor: u8,
    buses: Vec<(u8, Bus)>,
    partner_build: u32,
}

impl Opening {
    fn open(&self) -> Result<Axes, Trouble> {
        let node = NodeBuilder::new()
            .config(&self.config()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Ipc>()
            .map_err(|error| Trouble::new("shared-memory node", error))?;
        let kinds = READ.iter().chain(&WRITTEN);
        let services = kinds.map(|kind| service(&node, *kind)).collect::<Result<Vec<_>, _>>()?;
        let (read, written) = services.split_at(READ.len());
        let reader = |service: &Blackboard| service.reader_builder().create();
        let readers =
            read.iter().map(reader).collect::<Result<Vec<_>, _>>().map_err(|e| Trouble::new("reader", e))?;
        let writer = |service: &Blackboard| service.writer_builder().create();
        let writers = written
            .iter()
            .map(writer)
            .collect::<Result<Vec<_>, _>>()
            .map_err(|e| Trouble::new("writer", e))?;
        let axes = self.axes.iter().map(|axis| self.axis(*axis, &readers, &writers));
        let axes = axes.collect::<Result<Vec<_>, _>>()?;
        Ok(Axes { axes, _readers: readers, _writers: writers, _services: services, _node: node })
    }

    /// Everything explicit, nothing of the library's own cleaning (design 5).
    fn config(&self) -> Result<Config, Trouble> {
        let wrong = |error| Trouble::new("shared-memory domain", format!("{error:?}"));
        let root = Path::new(self.root.as_os_str().as_encoded_bytes()).map_err(wrong)?;
        let mut config = Config::default();
        config.global.set_root_path(&root);
        config.global.prefix = FileName::new(self.prefix.as_bytes()).map_err(wrong)?;
        config.global.service.cleanup_dead_nodes_on_open = false;
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        Ok(config)
    }

    fn axis(
        &self,
        axis: u8,
        readers: &[Reader<Ipc, u32>],
        writers: &[Writer<Ipc, u32>],
    ) -> Result<Axis, Trouble> {
        let path = self.images.join(format!("axis-{axis:02}.b.img"));
        let image = std::fs::read(&path).map_err(|error| Trouble::new(path.display(), error))?;
        let bus = self.buses.iter().find(|(named, _)| *named == axis).map_or(Bus::None, |(_, bus)| *bus);
        let setup = Setup {
            cycle_ns: self.cycle_ns,
            age_factor: self.age_factor,
            partner_build: self.partner_build,
            bus,
            ..Setup::new(axis, self.nonce, Start::Cold)
        };
        let [encoder, io, command, partner, agreement, readback] = readers else {
            return Err(Trouble::new("readers", "one for each kind"));
        };
        let [report, inhibit, answer] = writers else {
            return Err(Trouble::new("writers", "one for each kind"));
        };
        let place = Place { axis, nonce: self.nonce, crc: fastest() };
        Ok(Axis {
            monitor: Box::new(Monitor::new(&image, &setup)),
            image,
            walk: Walk::new(),
            image_sound: true,
            plain_command: self.plain_command,
            published: None,
            encoder: place.input(encoder, Kind::Encoder)?,
            io: place.input(io, Kind::Io)?,
            command: place.input(command, Kind::Command)?,
            partner: place.input(partner, Kind::ReportA)?,
            agreement: place.input(agreement, Kind::Agreement)?,
            readback: place.input(readback, Kind::Readback)?,
            report: place.output(report, Kind::ReportB)?,
            inhibit: place.output(inhibit, Kind::InhibitB)?,
            answer: place.output(answer, Kind::AnswerB)?,
        })
    }
}

fn service(node: &Node<Ipc>, kind: Kind) -> Result<Blackboard, Trouble> {
    let name = format!("safepair/{}/{:08x}", kind.name(), kind.layout());
    let parsed: ServiceName =
        name.as_str().try_into().map_err(|error| Trouble::new(&name, format!("{error:?}")))?;
    let opener = node.service_builder(&parsed).blackboard_opener::<u32>();
    opener.open().map_err(|error| Trouble::new(&name, error))
}

impl Axis {
    /// One cycle: reads, steps, publishes. What goes to the line.
    pub fn step(&mut self, overruns: u8, own_ns: u64, common_ns: u64) -> Inhibit {
        let inputs = self.read(overruns);
        let outputs = self.monitor.step(&inputs, own_ns);
        self.publish(&outputs, common_ns);
        outputs.inhibit
    }

    fn read(&mut self, overruns: u8) -> Inputs {
        self.walk_image();
        let mut command = self.command.check::<Command>();
        if let Ok(cell) = &mut command {
            let is_plain = cell.payload.source == CommandSource::Plain;
            if is_plain & !self.plain_command {
                cell.payload.source = CommandSource::None;
            }
        }
        Inputs {
            encoder: self.encoder.check(),
            motion: None,
            io: self.io.check(),
            command,
            partner: self.partner.check(),
            agreement: self.agreement.check(),
            readback: self.readback.check(),
            published: self.published,
            overruns,
            image_sound: self.image_sound,
        }
    }

    /// Latched: an image that was wrong once is wrong until the restart.
    fn walk_image(&mut self) {
        let Some((body, named)) = image::named_sum(&self.image) else { return };
        if let Some(sum) = self.walk.advance(body, WALK) {
            self.image_sound &= sum == named;
        }
    }

    fn publish(&mut self, outputs: &Outputs, now_ns: u64) {
        // The path first: nothing may delay it.
        self.inhibit.publish(&outputs.inhibit, now_ns);
        let crc32 = self.report.publish(&outputs.report, now_ns);
        if let Some(answer) = &outputs.answer {
            self.answer.publish(answer, now_ns);
        }
        self.published = Some(Published { exchange: outputs.report.exchange, crc32 });
    }

    /// The last word: no torque.
    pub fn withdraw(&mut self, now_ns: u64) {
        self.inhibit.publish(&Inhibit::default(), now_ns);
    }
}

/// Which cell of a kind.
struct Place {
    axis: u8,
    nonce: u32,
    crc: CheckSum,
}

impl Place {
    fn input<const N: usize>(&self, port: &Reader<Ipc, u32>, kind: Kind) -> Result<Input<N>, Trouble> {
        let entry = port.entry(&u32::from(self.axis)).map_err(|error| Trouble::new(kind.name(), error))?;
        Ok(Input { entry, guard: Guard::new(kind, self.axis, self.nonce), crc: self.crc })
    }

    fn output<const N: usize>(&self, port: &Writer<Ipc, u32>, kind: Kind) -> Result<Output<N>, Trouble> {
        let entry = port.entry(&u32::from(self.axis)).map_err(|error| Trouble::new(kind.name(), error))?;
        let header = Header::of(kind, self.axis, self.nonce);
        Ok(Output { entry, header, crc: self.crc })
    }
}

struct Input<const N: usize> {
    entry: EntryHandle<Ipc, u32, [u8; N]>,
    guard: Guard,
    crc: CheckSum,
}

impl<const N: usize> Input<N> {
    fn check<T: Payload>(&mut self) -> Received<T> {
        let octets: [u8; N] = *self.entry.get();
        self.guard.check(&octets, self.crc)
    }
}

struct Output<const N: usize> {
    entry: EntryHandleMut<Ipc, u32, [u8; N]>,
    header: Header,
    crc: CheckSum,
}

impl<const N: usize> Output<N> {
    /// Publishes with the next sequence; the CRC-32 of the cell.
    fn publish<T: Payload>(&mut self, payload: &T, now_ns: u64) -> u32 {
        self.header.sequence = self.header.sequence.wrapping_add(1);
        self.header.timestamp_ns = now_ns;
        let mut octets = [0; N];
        payload.write(&self.header, &mut octets);
        seal(&mut octets, crc32, self.crc);
        self.entry.update_with_copy(octets);
        octets.first_chunk().map_or(0, |sum| u32::from_le_bytes(*sum))
    }
}
