//! The shared memory: opened once, before the cycle; read and written without a system call.

use std::time::{Duration, Instant};

use crosscheck::Crosscheck;
use crosscheck::guard::{Guard, crc32, crc32c};
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use shm_schema::agreement::Agreement;
use shm_schema::cell::{Header, Kind, Payload, seal};
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::Encoder;
use shm_schema::exchange::{CrosscheckInputs, Received};
use shm_schema::inhibit::Readback;
use shm_schema::report::Report;

use super::OpenError;
use super::options::Options;

type Service = PortFactory<ipc::Service, u32>;

/// Pause between two attempts to open.
const RETRY: Duration = Duration::from_millis(10);

/// The services crosscheck uses, held open.
pub struct Domain {
    services: Vec<(Kind, Service)>,
    // Last: the node must outlive what was made with it.
    _node: Node<ipc::Service>,
}

/// What crosscheck reads and writes.
const USED: [Kind; 6] =
    [Kind::ReportA, Kind::ReportB, Kind::Readback, Kind::Encoder, Kind::Agreement, Kind::DriveRequest];

impl Domain {
    /// Opens what the supervisor created, trying again until `deadline` has passed.
    pub fn open(options: &Options, deadline: Duration) -> Result<Self, OpenError> {
        let begun = Instant::now();
        loop {
            match Self::open_once(options) {
                Err(_) if begun.elapsed() < deadline => std::thread::sleep(RETRY),
                result => return result,
            }
        }
    }

    fn open_once(options: &Options) -> Result<Self, OpenError> {
        let node = NodeBuilder::new()
            .config(&config(options)?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| OpenError::new("shared-memory domain", error))?;
        let open = |kind: Kind| open_service(&node, kind).map(|service| (kind, service));
        let services = USED.into_iter().map(open).collect::<Result<_, _>>()?;
        Ok(Self { services, _node: node })
    }

    /// The cells of every axis, each with its core. The ports live as long as the result.
    pub fn axes(&self, options: &Options, cores: Vec<Crosscheck>) -> Result<Axes, OpenError> {
        let readers =
            [Kind::ReportA, Kind::ReportB, Kind::Readback, Kind::Encoder].map(|kind| self.reader(kind));
        let [report_a, report_b, readback, encoder] = readers;
        let (report_a, report_b, readback, encoder) = (report_a?, report_b?, readback?, encoder?);
        let (agreement, drive) = (self.writer(Kind::Agreement)?, self.writer(Kind::DriveRequest)?);
        let axis = |(number, core): (&u8, Crosscheck)| -> Result<Axis, OpenError> {
            let cell = Place { axis: *number, nonce: options.nonce };
            Ok(Axis {
                number: *number,
                core,
                report_a: cell.input(&report_a, Kind::ReportA)?,
                report_b: cell.input(&report_b, Kind::ReportB)?,
                readback: cell.input(&readback, Kind::Readback)?,
                encoder: cell.input(&encoder, Kind::Encoder)?,
                agreement: cell.output(&agreement, Kind::Agreement)?,
                drive: cell.output(&drive, Kind::DriveRequest)?,
            })
        };
        let each = options.axes.iter().zip(cores).map(axis).collect::<Result<_, _>>()?;
        Ok(Axes { each, _readers: [report_a, report_b, readback, encoder], _writers: [agreement, drive] })
    }

    fn service(&self, kind: Kind) -> Result<&Service, OpenError> {
        let found = self.services.iter().find(|(known, _)| *known == kind);
        found.map(|(_, service)| service).ok_or_else(|| OpenError::new(kind.name(), "not opened"))
    }

    fn reader(&self, kind: Kind) -> Result<Reader<ipc::Service, u32>, OpenError> {
        self.service(kind)?.reader_builder().create().map_err(|error| OpenError::new(kind.name(), error))
    }

    fn writer(&self, kind: Kind) -> Result<Writer<ipc::Service, u32>, OpenError> {
        self.service(kind)?.writer_builder().create().map_err(|error| OpenError::new(kind.name(), error))
    }
}

/// Everything explicit, nothing cleaned up by itself (design 5).
fn config(options: &Options) -> Result<Config, OpenError> {
    let root = options.domain.join("iox2");
    let wrong = |error| OpenError::new("shared-memory domain", format!("{error:?}"));
    let mut config = Config::default();
    let path = iceoryx2::prelude::Path::new(root.as_os_str().as_encoded_bytes()).map_err(wrong)?;
    config.global.set_root_path(&path);
    config.global.prefix = FileName::new(options.prefix.as_bytes()).map_err(wrong)?;
    config.global.service.cleanup_dead_nodes_on_open = false;
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    Ok(config)
}

fn open_service(node: &Node<ipc::Service>, kind: Kind) -> Result<Service, OpenError> {
    let name = format!("safepair/{}/{:08x}", kind.name(), kind.layout());
    let parsed: ServiceName =
        name.as_str().try_into().map_err(|error| OpenError::new(&name, format!("{error:?}")))?;
    node.service_builder(&parsed)
        .blackboard_opener::<u32>()
        .open()
        .map_err(|error| OpenError::new(&name, error))
}

/// All axes and the ports their cells belong to.
pub struct Axes {
    /// The axes in use.
    pub each: Vec<Axis>,
    // Behind the entries: a port must outlive them.
    _readers: [Reader<ipc::Service, u32>; 4],
    _writers: [Writer<ipc::Service, u32>; 2],
}

/// One axis: its core and its cells.
pub struct Axis {
    /// Number of the axis.
    pub number: u8,
    /// The core.
    pub core: Crosscheck,
    report_a: Input<{ Report::CELL }>,
    report_b: Input<{ Report::CELL }>,
    readback: Input<{ Readback::CELL }>,
    encoder: Input<{ Encoder::CELL }>,
    agreement: Output<{ Agreement::CELL }>,
    drive: Output<{ DriveRequest::CELL }>,
}

impl Axis {
    /// Reads and checks every cell. The encoder last: no report can be ahead of it then.
    pub fn read(&mut self, overruns: u8) -> CrosscheckInputs {
        let report_a = self.report_a.check::<Report>();
        let report_b = self.report_b.check::<Report>();
        let readback = self.readback.check::<Readback>();
        let encoder = self.encoder.check::<Encoder>();
        let encoder_sequence = encoder.ok().map(|sample| sample.sequence);
        CrosscheckInputs { report_a, report_b, readback, encoder_sequence, overruns }
    }

    /// Publishes what the core decided.
    pub fn write(&mut self, agreement: &Agreement, drive: &DriveRequest, now_ns: u64) {
        self.agreement.publish(agreement, now_ns);
        self.drive.publish(drive, now_ns);
    }
}

struct Input<const N: usize> {
    entry: EntryHandle<ipc::Service, u32, [u8; N]>,
    guard: Guard,
}

impl<const N: usize> Input<N> {
    fn check<T: Payload>(&mut self) -> Received<T> {
        let octets: [u8; N] = *self.entry.get();
        self.guard.check(&octets, crc32)
    }
}

struct Output<const N: usize> {
    entry: EntryHandleMut<ipc::Service, u32, [u8; N]>,
    header: Header,
}

impl<const N: usize> Output<N> {
    fn publish<T: Payload>(&mut self, payload: &T, now_ns: u64) {
        self.header.sequence = self.header.sequence.saturating_add(1);
        self.header.timestamp_ns = now_ns;
        let mut octets = [0; N];
        payload.write(&self.header, &mut octets);
        seal(&mut octets, crc32, crc32c);
        self.entry.update_with_copy(octets);
    }
}

/// Which cell of a kind.
struct Place {
    axis: u8,
    nonce: u32,
}

impl Place {
    fn input<const N: usize>(
        &self,
        port: &Reader<ipc::Service, u32>,
        kind: Kind,
    ) -> Result<Input<N>, OpenError> {
        let entry = port.entry(&u32::from(self.axis)).map_err(|error| OpenError::new(kind.name(), error))?;
        Ok(Input { entry, guard: Guard::new(kind, self.axis, self.nonce) })
    }

    fn output<const N: usize>(
        &self,
        port: &Writer<ipc::Service, u32>,
        kind: Kind,
    ) -> Result<Output<N>, OpenError> {
        let entry = port.entry(&u32::from(self.axis)).map_err(|error| OpenError::new(kind.name(), error))?;
        let header = Header::of(kind, self.axis, self.nonce);
        Ok(Output { entry, header })
    }
}
