//! The shared memory: opened once before the cycle, read and written without system call.

use std::time::{Duration, Instant};

use channel_a::Monitor;
use channel_a::guard::Guard;
use crc32fast::hash as crc32;
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::{
    Config, FileName, Node, NodeBuilder, Path, SemanticString, ServiceName, SignalHandlingMode, ZeroCopySend,
    ipc,
};
use iceoryx2::service::port_factory::blackboard::PortFactory;
use shm_schema::agreement::Agreement;
use shm_schema::answer::Answer;
use shm_schema::cell::{Header, Kind, Payload, seal};
use shm_schema::command::Command;
use shm_schema::encoder::Encoder;
use shm_schema::exchange::Received;
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::io::Io;
use shm_schema::report::Report;

use super::checks::crc32c;
use super::inhibit::Line;
use super::options::Options;

type Ipc = ipc::Service;
const RETRY: Duration = Duration::from_millis(5);
const READ: [Kind; 6] =
    [Kind::Encoder, Kind::Io, Kind::Command, Kind::ReportB, Kind::Agreement, Kind::Readback];
const WRITTEN: [Kind; 3] = [Kind::ReportA, Kind::InhibitA, Kind::AnswerA];

/// A payload whose cell is an array of octets.
pub trait Cell: Payload {
    /// `[u8; CELL]`
    type Octets: ZeroCopySend + Copy + AsRef<[u8]> + AsMut<[u8]> + core::fmt::Debug + 'static;
    /// Zeros.
    const EMPTY: Self::Octets;
}

macro_rules! cells {
    ($($payload:ty),*) => {$(
        impl Cell for $payload {
            type Octets = [u8; <$payload>::CELL];
            const EMPTY: Self::Octets = [0; <$payload>::CELL];
        }
    )*};
}
cells!(Encoder, Io, Command, Report, Agreement, Readback, Inhibit, Answer);

/// A cell that is read.
pub struct Input<T: Cell> {
    entry: EntryHandle<Ipc, u32, T::Octets>,
    guard: Guard,
}

impl<T: Cell> Input<T> {
    /// What the cell says now.
    pub fn read(&mut self) -> Received<T> {
        let octets = *self.entry.get();
        self.guard.check(octets.as_ref(), crc32)
    }
}

/// A cell that is written.
pub struct Output<T: Cell> {
    entry: EntryHandleMut<Ipc, u32, T::Octets>,
    header: Header,
}

impl<T: Cell> Output<T> {
    /// Publishes `payload`; the CRC-32 of the cell.
    pub fn publish(&mut self, payload: &T, now_ns: u64) -> u32 {
        self.header.sequence = self.header.sequence.wrapping_add(1);
        self.header.timestamp_ns = now_ns;
        let mut octets = T::EMPTY;
        payload.write(&self.header, octets.as_mut());
        seal(octets.as_mut(), crc32, crc32c);
        let sum = octets.as_ref().first_chunk().map_or(0, |sum| u32::from_le_bytes(*sum));
        self.entry.update_with_copy(octets);
        sum
    }
}

/// Everything of one axis.
pub struct Axis {
    /// The core.
    pub monitor: Monitor,
    /// Encoder sample.
    pub encoder: Input<Encoder>,
    /// Safe inputs.
    pub io: Input<Io>,
    /// Command.
    pub command: Input<Command>,
    /// The partner.
    pub partner: Input<Report>,
    /// Crosscheck.
    pub agreement: Input<Agreement>,
    /// Both paths.
    pub readback: Input<Readback>,
    /// Own report.
    pub report: Output<Report>,
    /// Own path, as a cell.
    pub inhibit: Output<Inhibit>,
    /// Answer on the black channel.
    pub answer: Output<Answer>,
    /// Own path, as a line.
    pub line: Line,
}

/// The axes, and the ports that keep their cells alive.
pub struct Axes {
    /// One for each axis in use.
    pub each: Vec<Axis>,
    _readers: Vec<Reader<Ipc, u32>>,
    _writers: Vec<Writer<Ipc, u32>>,
    _domain: Domain,
}

/// The services, held open.
pub struct Domain {
    services: Vec<(Kind, PortFactory<Ipc, u32>)>,
    // Last: the node outlives what was made with it.
    _node: Node<Ipc>,
}

fn named<E: core::fmt::Debug>(what: &str) -> impl Fn(E) -> String + '_ {
    move |error| format!("{what}: {error:?}")
}

impl Domain {
    /// Opens what the supervisor created, again and again until `deadline`.
    ///
    /// # Errors
    /// What could not be opened, after the deadline.
    pub fn open(options: &Options, deadline: Duration) -> Result<Self, String> {
        let begun = Instant::now();
        loop {
            match Self::attempt(options) {
                Err(_) if begun.elapsed() < deadline => std::thread::sleep(RETRY),
                result => return result,
            }
        }
    }

    fn attempt(options: &Options) -> Result<Self, String> {
        let node = NodeBuilder::new()
            .config(&config(options)?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Ipc>()
            .map_err(named("shared-memory domain"))?;
        let open = |kind: Kind| {
            let name = format!("safepair/{}/{:08x}", kind.name(), kind.layout());
            let parsed = ServiceName::new(&name).map_err(named(&name))?;
            let service = node.service_builder(&parsed).blackboard_opener::<u32>().open();
            service.map(|service| (kind, service)).map_err(named(&name))
        };
        let services = READ.into_iter().chain(WRITTEN).map(open).collect::<Result<_, String>>()?;
        Ok(Self { services, _node: node })
    }

    /// Ports and entries of every axis.
    ///
    /// # Errors
    /// What could not be opened.
    pub fn axes(self, options: &Options, monitors: Vec<Monitor>, lines: Vec<Line>) -> Result<Axes, String> {
        let [encoder, io, command, partner, agreement, readback] = READ.map(|kind| self.reader(kind));
        let [report, inhibit, answer] = WRITTEN.map(|kind| self.writer(kind));
        let (encoder, io, command) = (encoder?, io?, command?);
        let (partner, agreement, readback) = (partner?, agreement?, readback?);
        let (report, inhibit, answer) = (report?, inhibit?, answer?);
        let mut each = Vec::with_capacity(monitors.len());
        for ((number, monitor), line) in options.axes.iter().zip(monitors).zip(lines) {
            let place = Place { axis: *number, nonce: options.nonce };
            each.push(Axis {
                monitor,
                encoder: place.input(&encoder, Kind::Encoder)?,
                io: place.input(&io, Kind::Io)?,
                command: place.input(&command, Kind::Command)?,
                partner: place.input(&partner, Kind::ReportB)?,
                agreement: place.input(&agreement, Kind::Agreement)?,
                readback: place.input(&readback, Kind::Readback)?,
                report: place.output(&report, Kind::ReportA)?,
                inhibit: place.output(&inhibit, Kind::InhibitA)?,
                answer: place.output(&answer, Kind::AnswerA)?,
                line,
            });
        }
        Ok(Axes {
            each,
            _readers: vec![encoder, io, command, partner, agreement, readback],
            _writers: vec![report, inhibit, answer],
            _domain: self,
        })
    }

    fn service(&self, kind: Kind) -> Result<&PortFactory<Ipc, u32>, String> {
        let found = self.services.iter().find(|(known, _)| *known == kind);
        found.map(|(_, service)| service).ok_or_else(|| format!("{}: not opened", kind.name()))
    }

    fn reader(&self, kind: Kind) -> Result<Reader<Ipc, u32>, String> {
        self.service(kind)?.reader_builder().create().map_err(named(kind.name()))
    }

    fn writer(&self, kind: Kind) -> Result<Writer<Ipc, u32>, String> {
        self.service(kind)?.writer_builder().create().map_err(named(kind.name()))
    }
}

/// Everything explicit, nothing cleaned up by itself: the supervisor alone wipes (design 5).
fn config(options: &Options) -> Result<Config, String> {
    let root = options.domain.join("iox2");
    let mut config = Config::default();
    let root = Path::new(root.as_os_str().as_encoded_bytes()).map_err(named("--domain"))?;
    config.global.set_root_path(&root);
    config.global.prefix = FileName::new(options.prefix.as_bytes()).map_err(named("--prefix"))?;
    config.global.service.cleanup_dead_nodes_on_open = false;
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    Ok(config)
}

/// Which entry of every service.
struct Place {
    axis: u8,
    nonce: u32,
}

impl Place {
    fn input<T: Cell>(&self, port: &Reader<Ipc, u32>, kind: Kind) -> Result<Input<T>, String> {
        let entry = port.entry::<T::Octets>(&u32::from(self.axis)).map_err(named(kind.name()))?;
        Ok(Input { entry, guard: Guard::new(kind, self.axis, self.nonce) })
    }

    fn output<T: Cell>(&self, port: &Writer<Ipc, u32>, kind: Kind) -> Result<Output<T>, String> {
        let entry = port.entry::<T::Octets>(&u32::from(self.axis)).map_err(named(kind.name()))?;
        let header = Header::of(kind, self.axis, self.nonce);
        Ok(Output { entry, header })
    }
}
