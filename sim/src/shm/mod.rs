//! The shared-memory domain of one run: a private root and prefix, wiped before it is
//! created, every service made before anybody opens one (design 5).
//!
//! The supervisor calls [`Domain::create`], everybody else [`Domain::open`]. Never from a
//! real-time thread: creating and opening allocate, lock and call the system.

mod access;
mod place;

pub use access::{CellReader, CellValue, CellWriter, compose};
pub use place::Place;

use std::{fmt, io, path::PathBuf, sync::mpsc, thread, time::Duration};

use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::blackboard::PortFactory as Blackboard;
use shm_schema::AXES_MAX;
use shm_schema::cell::Kind;

/// Thread-safe handles, so that opening can be left behind at its deadline; on the shared
/// memory itself it is the same service type as `ipc`.
type Ipc = ipc_threadsafe::Service;

/// Readers one service admits: two channels, crosscheck, gateway, drive, console, tests.
const READERS_MAX: usize = 32;

/// Why a domain cannot be used.
#[derive(Debug)]
pub enum DomainError {
    /// A file of an earlier run could not be removed, or a folder not be made.
    File(PathBuf, io::Error),
    /// A root or prefix that is no file name of at most 200 octets without blanks.
    Name(String),
    /// An axis outside 1 to 64, or none at all.
    Axes,
    /// Creating or opening failed: what, and what the library says.
    Service(String, String),
    /// Opening did not end within its deadline.
    Deadline(Duration),
}

impl fmt::Display for DomainError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path, error) => write!(out, "{}: {error}", path.display()),
            Self::Name(name) => write!(out, "{name:?} cannot name a shared-memory domain"),
            Self::Axes => write!(out, "expected one to 64 axes, numbered 1 to 64"),
            Self::Service(what, why) => write!(out, "{what}: {why}"),
            Self::Deadline(limit) => write!(out, "domain not open after {} ms", limit.as_millis()),
        }
    }
}

impl std::error::Error for DomainError {}

fn service_error<E: fmt::Display>(what: &str) -> impl FnOnce(E) -> DomainError + '_ {
    move |error| DomainError::Service(what.to_owned(), error.to_string())
}

/// All twelve services of one run, held open.
pub struct Domain {
    services: Vec<Blackboard<Ipc, u32>>,
    place: Place,
    // Last: the node must outlive what was made with it.
    _node: Node<Ipc>,
}

impl fmt::Debug for Domain {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Domain").field("place", &self.place).finish_non_exhaustive()
    }
}

impl Domain {
    /// Wipes what an earlier run left at `place` and creates every service with one entry
    /// for each of `axes`. The caller holds the lock of the set (design 5): this does not
    /// ask whether somebody else lives there.
    pub fn create(place: &Place, axes: &[u8]) -> Result<Self, DomainError> {
        let valid = |axis: &u8| (1..=AXES_MAX as u8).contains(axis);
        if axes.is_empty() || !axes.iter().all(valid) {
            return Err(DomainError::Axes);
        }
        place.wipe()?;
        place.make()?;
        let node = node(place)?;
        let create = |kind: Kind| create_kind(&node, kind, axes);
        let services = Kind::ALL.into_iter().map(create).collect::<Result<_, _>>()?;
        Ok(Self { services, place: place.clone(), _node: node })
    }

    /// Opens what a supervisor created, within `deadline`. A half-created domain can hang
    /// the library for ever, so the work is done on a thread that is left behind then.
    pub fn open(place: &Place, deadline: Duration) -> Result<Self, DomainError> {
        let (done, result) = mpsc::channel();
        let target = place.clone();
        thread::Builder::new()
            .name("domain-open".to_owned())
            .spawn(move || done.send(open_all(&target)))
            .map_err(|error| DomainError::File(place.root().to_owned(), error))?;
        result.recv_timeout(deadline).unwrap_or(Err(DomainError::Deadline(deadline)))
    }

    /// Where this run lives.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// The writers of the cells of `kind`, one for each of `axes` in that order. A service
    /// has one writer at a time: a second call fails until the first result is dropped.
    pub fn writers<T: CellValue>(&self, kind: Kind, axes: &[u8]) -> Result<Vec<CellWriter<T>>, DomainError> {
        let writer = self.service(kind)?.writer_builder().create().map_err(service_error(kind.name()))?;
        let writer = std::sync::Arc::new(writer);
        axes.iter().map(|axis| CellWriter::new(&writer, kind, *axis, self.place.nonce())).collect()
    }

    /// The readers of the cells of `kind`, one for each of `axes` in that order.
    pub fn readers<T: CellValue>(&self, kind: Kind, axes: &[u8]) -> Result<Vec<CellReader<T>>, DomainError> {
        let reader = self.service(kind)?.reader_builder().create().map_err(service_error(kind.name()))?;
        let reader = std::sync::Arc::new(reader);
        axes.iter().map(|axis| CellReader::new(&reader, kind, *axis)).collect()
    }

    fn service(&self, kind: Kind) -> Result<&Blackboard<Ipc, u32>, DomainError> {
        let at = Kind::ALL.iter().position(|known| *known == kind);
        at.and_then(|at| self.services.get(at))
            .ok_or_else(|| DomainError::Service(kind.name().to_owned(), "no such service".to_owned()))
    }
}

/// Name of the service that carries cells of `kind`: `safepair/<name>/<layout hash>`.
pub fn service_name(kind: Kind) -> String {
    format!("safepair/{}/{:08x}", kind.name(), kind.layout())
}

fn node(place: &Place) -> Result<Node<Ipc>, DomainError> {
    NodeBuilder::new()
        .config(&place.config()?)
        // The processes of a set handle their signals themselves.
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Ipc>()
        .map_err(service_error("node"))
}

fn open_all(place: &Place) -> Result<Domain, DomainError> {
    let node = node(place)?;
    let open = |kind: Kind| {
        let name = service_name(kind);
        let builder = node.service_builder(&parsed(&name)?);
        builder.blackboard_opener::<u32>().open().map_err(service_error(&name))
    };
    let services = Kind::ALL.into_iter().map(open).collect::<Result<_, _>>()?;
    Ok(Domain { services, place: place.clone(), _node: node })
}

fn parsed(name: &str) -> Result<ServiceName, DomainError> {
    name.try_into().map_err(|_| DomainError::Name(name.to_owned()))
}

fn create_kind(node: &Node<Ipc>, kind: Kind, axes: &[u8]) -> Result<Blackboard<Ipc, u32>, DomainError> {
    use shm_schema::{agreement, answer, command, drive, encoder, inhibit, io, report};
    match kind {
        Kind::Encoder => create_service::<encoder::Encoder>(node, kind, axes),
        Kind::Io => create_service::<io::Io>(node, kind, axes),
        Kind::Command => create_service::<command::Command>(node, kind, axes),
        Kind::ReportA | Kind::ReportB => create_service::<report::Report>(node, kind, axes),
        Kind::Agreement => create_service::<agreement::Agreement>(node, kind, axes),
        Kind::DriveRequest => create_service::<drive::DriveRequest>(node, kind, axes),
        Kind::InhibitA | Kind::InhibitB => create_service::<inhibit::Inhibit>(node, kind, axes),
        Kind::Readback => create_service::<inhibit::Readback>(node, kind, axes),
        Kind::AnswerA | Kind::AnswerB => create_service::<answer::Answer>(node, kind, axes),
        Kind::None => Err(DomainError::Name(kind.name().to_owned())),
    }
}

fn create_service<T: CellValue>(
    node: &Node<Ipc>,
    kind: Kind,
    axes: &[u8],
) -> Result<Blackboard<Ipc, u32>, DomainError> {
    let name = service_name(kind);
    let creator = node.service_builder(&parsed(&name)?).blackboard_creator::<u32>();
    let creator = creator.max_readers(READERS_MAX).max_nodes(READERS_MAX);
    // All zeros fail every check of a reader: nobody has written yet.
    let add = |creator: iceoryx2::service::builder::blackboard::Creator<u32, Ipc>, axis: &u8| {
        creator.add(u32::from(*axis), T::EMPTY)
    };
    axes.iter().fold(creator, add).create().map_err(service_error(&name))
}

#[cfg(test)]
mod tests;
