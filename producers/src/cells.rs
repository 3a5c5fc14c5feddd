//! The cells of a running set, from a producer's side.
//!
//! The supervisor created the domain; here it is only opened, before the cycle starts.
//! Publishing and reading then cost no allocation, no lock and no system call.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;

use crc::{CRC_32_ISCSI, CRC_32_ISO_HDLC, Crc, Table};
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use shm_schema::cell::{CRC_START, Header, Kind, Payload, seal};
use shm_schema::wire::{Source, Wire};
use shm_schema::{agreement, answer, command, drive, encoder, inhibit, io};

/// Thread-safe handles of the same shared memory, so that a hanging open can be left behind.
type Ipc = ipc_threadsafe::Service;

static FOR_A: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);
static FOR_B: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISCSI);

fn for_a(octets: &[u8]) -> u32 {
    FOR_A.checksum(octets)
}

fn for_b(octets: &[u8]) -> u32 {
    FOR_B.checksum(octets)
}

/// Where a set lives: options `--domain`, `--prefix`, `--nonce` of the architecture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Private root folder of the run.
    pub domain: PathBuf,
    /// Prefix of the run in shared memory.
    pub prefix: String,
    /// Boot nonce, never 0.
    pub nonce: u32,
}

/// Why a domain or a cell cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Trouble {
    /// Root or prefix cannot be part of a file name.
    Name(String),
    /// No such domain, another layout, or somebody else writes already: what, and why.
    Service(String, String),
    /// The domain did not open in time.
    Deadline(Duration),
}

impl fmt::Display for Trouble {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => write!(out, "{name:?} cannot name a domain"),
            Self::Service(what, why) => write!(out, "{what}: {why}"),
            Self::Deadline(limit) => write!(out, "domain not open after {} ms", limit.as_millis()),
        }
    }
}

impl std::error::Error for Trouble {}

fn at<E: fmt::Display>(what: &str) -> impl FnOnce(E) -> Trouble + '_ {
    move |error| Trouble::Service(what.to_owned(), error.to_string())
}

/// A payload and its cell as the array of octets the blackboards hold.
pub trait Cell: Payload + Copy + 'static {
    /// `[u8; CELL]`
    type Octets: ZeroCopySend + Copy + AsRef<[u8]> + AsMut<[u8]> + fmt::Debug + 'static;
    /// Nobody has written.
    const EMPTY: Self::Octets;
}

macro_rules! cells {
    ($($type:ty),*) => {$(
        impl Cell for $type {
            type Octets = [u8; <$type>::CELL];
            const EMPTY: Self::Octets = [0; <$type>::CELL];
        }
    )*};
}
cells!(
    agreement::Agreement,
    answer::Answer,
    command::Command,
    drive::DriveRequest,
    encoder::Encoder,
    inhibit::Inhibit,
    inhibit::Readback,
    io::Io
);

/// An open domain.
pub struct Domain {
    node: Node<Ipc>,
    nonce: u32,
}

impl fmt::Debug for Domain {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Domain").field("nonce", &self.nonce).finish_non_exhaustive()
    }
}

impl Domain {
    /// Joins the domain at `place`.
    ///
    /// # Errors
    /// [`Trouble::Name`], [`Trouble::Service`].
    pub fn open(place: &Place) -> Result<Self, Trouble> {
        let node = NodeBuilder::new()
            .config(&config(place)?)
            // The process handles its signals itself.
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Ipc>()
            .map_err(at("node"))?;
        Ok(Self { node, nonce: place.nonce })
    }

    /// The only publishers of the cells of `kind`, one for each of `axes` in that order. A service
    /// has one writer: a second call fails until the first result is dropped.
    ///
    /// # Errors
    /// [`Trouble::Service`]: not there, another layout, another writer.
    pub fn publishers<T: Cell>(&self, kind: Kind, axes: &[u8]) -> Result<Vec<Publisher<T>>, Trouble> {
        let port = Arc::new(self.service(kind)?.writer_builder().create().map_err(at(kind.name()))?);
        let publisher = |axis: &u8| {
            let entry = port.entry::<T::Octets>(&u32::from(*axis)).map_err(at(kind.name()))?;
            Ok(Publisher { entry, header: Header::of(kind, *axis, self.nonce), _port: Arc::clone(&port) })
        };
        axes.iter().map(publisher).collect()
    }

    /// The publisher of one axis.
    ///
    /// # Errors
    /// As [`Self::publishers`].
    pub fn publisher<T: Cell>(&self, kind: Kind, axis: u8) -> Result<Publisher<T>, Trouble> {
        let mut each = self.publishers(kind, &[axis])?;
        each.pop().ok_or_else(|| Trouble::Service(kind.name().to_owned(), "no axis".to_owned()))
    }

    /// Readers of the cells of `kind`, one for each of `axes` in that order.
    ///
    /// # Errors
    /// [`Trouble::Service`]: not there, another layout.
    pub fn subscribers<T: Cell>(&self, kind: Kind, axes: &[u8]) -> Result<Vec<Subscriber<T>>, Trouble> {
        let port = Arc::new(self.service(kind)?.reader_builder().create().map_err(at(kind.name()))?);
        let subscriber = |axis: &u8| {
            let entry = port.entry::<T::Octets>(&u32::from(*axis)).map_err(at(kind.name()))?;
            Ok(Subscriber { entry, own: Header::of(kind, *axis, self.nonce), _port: Arc::clone(&port) })
        };
        axes.iter().map(subscriber).collect()
    }

    /// The reader of one axis.
    ///
    /// # Errors
    /// As [`Self::subscribers`].
    pub fn subscriber<T: Cell>(&self, kind: Kind, axis: u8) -> Result<Subscriber<T>, Trouble> {
        let mut each = self.subscribers(kind, &[axis])?;
        each.pop().ok_or_else(|| Trouble::Service(kind.name().to_owned(), "no axis".to_owned()))
    }

    fn service(&self, kind: Kind) -> Result<PortFactory<Ipc, u32>, Trouble> {
        let name = format!("safepair/{}/{:08x}", kind.name(), kind.layout());
        let parsed = ServiceName::new(&name).map_err(at(&name))?;
        self.node.service_builder(&parsed).blackboard_opener::<u32>().open().map_err(at(&name))
    }
}

/// Runs `open` with a deadline: a half-created domain can hang the library for ever.
///
/// # Errors
/// What `open` says, or [`Trouble::Deadline`].
pub fn within<T: Send + 'static>(
    deadline: Duration,
    open: impl FnOnce() -> Result<T, Trouble> + Send + 'static,
) -> Result<T, Trouble> {
    let (done, result) = mpsc::channel();
    thread::spawn(move || done.send(open()));
    result.recv_timeout(deadline).unwrap_or(Err(Trouble::Deadline(deadline)))
}

/// Everything explicit, nothing cleaned up by itself: the supervisor alone wipes (design 5).
fn config(place: &Place) -> Result<Config, Trouble> {
    let root = place.domain.join("iox2").to_string_lossy().into_owned();
    let mut config = Config::default();
    let path = Path::new(root.as_bytes()).map_err(|_| Trouble::Name(root))?;
    config.global.set_root_path(&path);
    config.global.prefix =
        FileName::new(place.prefix.as_bytes()).map_err(|_| Trouble::Name(place.prefix.clone()))?;
    config.global.service.cleanup_dead_nodes_on_open = false;
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    Ok(config)
}

/// The only writer of one cell.
pub struct Publisher<T: Cell> {
    entry: EntryHandleMut<Ipc, u32, T::Octets>,
    header: Header,
    // Keeps the port alive as long as its entry is in use.
    _port: Arc<Writer<Ipc, u32>>,
}

impl<T: Cell> fmt::Debug for Publisher<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Publisher").field("header", &self.header).finish_non_exhaustive()
    }
}

impl<T: Cell> Publisher<T> {
    /// Publishes `payload` as the update after `cycles` cycles, 1 when none was missed: the
    /// sequence counts elapsed cycles, so that a stall shows as missed exchanges. `latched_ns` is
    /// the instant the signals were latched, CLOCK_MONOTONIC.
    pub fn publish(&mut self, payload: &T, latched_ns: u64, cycles: u64) {
        self.header.sequence = self.header.sequence.saturating_add(cycles.max(1));
        self.header.timestamp_ns = latched_ns;
        let mut octets = T::EMPTY;
        payload.write(&self.header, octets.as_mut());
        seal(octets.as_mut(), for_a, for_b);
        self.entry.update_with_copy(octets);
    }
}

/// A reader of one cell.
pub struct Subscriber<T: Cell> {
    entry: EntryHandle<Ipc, u32, T::Octets>,
    own: Header,
    // Keeps the port alive as long as its entry is in use.
    _port: Arc<Reader<Ipc, u32>>,
}

impl<T: Cell> fmt::Debug for Subscriber<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Subscriber").field("own", &self.own).finish_non_exhaustive()
    }
}

impl<T: Cell> Subscriber<T> {
    /// Header and payload of a sound cell of this run; `None` before the first update, and for
    /// anything damaged or foreign.
    pub fn read(&self) -> Option<(Header, T)> {
        let octets = *self.entry.get();
        let octets = octets.as_ref();
        let header = Header::take(&mut Source::new(octets))?;
        let sound = header.crc32 == for_a(octets.get(CRC_START..)?);
        let of = |header: &Header| {
            (header.kind, header.layout, header.writer, header.axis, header.boot_nonce, header.length)
        };
        let ours = of(&header) == of(&self.own);
        if sound & ours { Some((header, T::read(octets)?)) } else { None }
    }
}
