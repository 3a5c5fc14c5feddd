//! Watches a running set from outside: reads its cells, never writes, delays nobody.

use std::{
    collections::HashMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use shm_schema::error::{ErrorCode, ErrorList};
use shm_schema::{agreement::Agreement, cell::Kind, encoder::Encoder, inhibit::Readback, report::Report};
use sim::shm::{CellReader, Domain, DomainError};

use crate::run::RunFolder;

/// Longest wait for the shared memory of a set.
const OPEN_DEADLINE: Duration = Duration::from_secs(2);
/// Faster than the cycle, so that no report is missed for long.
const POLL: Duration = Duration::from_micros(200);
/// Most frames kept: ten minutes at 1 kHz.
const FRAMES_MAX: usize = 600_000;

/// One observed instant of one axis.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// CLOCK_MONOTONIC, ns.
    pub time_ns: u64,
    /// Newest report of A.
    pub a: Report,
    /// Newest report of B.
    pub b: Report,
    /// Newest agreement.
    pub agreement: Agreement,
    /// Newest readback and its time stamp, ns.
    pub readback: (u64, Readback),
}

/// Everything recorded of one axis.
#[derive(Debug, Default)]
pub struct Recording {
    /// In order of time.
    pub frames: Vec<Frame>,
    /// Time stamp of each encoder sample by its exchange number, ns.
    pub samples: HashMap<u64, u64>,
}

struct Readers {
    encoder: CellReader<Encoder>,
    a: CellReader<Report>,
    b: CellReader<Report>,
    agreement: CellReader<Agreement>,
    readback: CellReader<Readback>,
}

/// A thread that records until it is told to stop.
pub struct Recorder {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Recording>,
}

impl Recorder {
    /// Starts to record `axis`.
    ///
    /// # Errors
    /// When the cells cannot be read.
    pub fn start(domain: &Domain, axis: u8) -> Result<Self, DomainError> {
        let readers = Readers::open(domain, axis)?;
        let stop = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&stop);
        let thread = thread::spawn(move || {
            let mut recording = Recording::default();
            while !told.load(Ordering::Relaxed) {
                readers.observe(&mut recording);
                thread::sleep(POLL);
            }
            recording
        });
        Ok(Self { stop, thread })
    }

    /// Ends and hands over what was recorded.
    pub fn finish(self) -> Recording {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap_or_default()
    }
}

/// The newest state of one axis, for whoever waits for something.
pub struct Watch(Readers);

impl Watch {
    /// Opens the cells of `axis`.
    ///
    /// # Errors
    /// When the cells cannot be read.
    pub fn open(domain: &Domain, axis: u8) -> Result<Self, DomainError> {
        Readers::open(domain, axis).map(Self)
    }

    /// What stands in the cells now; `None` until every cell has been written once.
    pub fn now(&self) -> Option<Frame> {
        self.0.frame()
    }
}

impl Readers {
    fn open(domain: &Domain, axis: u8) -> Result<Self, DomainError> {
        Ok(Self {
            encoder: one(domain, Kind::Encoder, axis)?,
            a: one(domain, Kind::ReportA, axis)?,
            b: one(domain, Kind::ReportB, axis)?,
            agreement: one(domain, Kind::Agreement, axis)?,
            readback: one(domain, Kind::Readback, axis)?,
        })
    }

    fn frame(&self) -> Option<Frame> {
        let (readback, content) = self.readback.read()?;
        Some(Frame {
            time_ns: now_ns(),
            a: self.a.read()?.1,
            b: self.b.read()?.1,
            agreement: self.agreement.read()?.1,
            readback: (readback.timestamp_ns, content),
        })
    }

    fn observe(&self, recording: &mut Recording) {
        if let Some((header, _)) = self.encoder.read() {
            recording.samples.insert(header.sequence, header.timestamp_ns);
        }
        let Some(frame) = self.frame() else { return };
        let news = recording.frames.last().is_none_or(|last| last.differs(&frame));
        if news && recording.frames.len() < FRAMES_MAX {
            recording.frames.push(frame);
        }
    }
}

/// Standing codes as a person reads them.
pub fn codes(errors: &ErrorList) -> String {
    let code = |error: &ErrorCode| format!("{}/{}/{}/{}", error.code, error.info1, error.info2, error.info3);
    errors.iter().map(code).collect::<Vec<_>>().join(", ")
}

impl Frame {
    /// What each side says, a line each.
    pub fn in_words(&self) -> String {
        let side = |name: &str, report: &Report| {
            format!(
                "  {name}: exchange {}, {:?}, stop {:?}, ready {}, driving {}, status {:08X}, requested {:08X}, {:.1} rpm, errors [{}]",
                report.exchange,
                report.phase,
                report.stop,
                report.ready,
                report.driving,
                report.status.0[0],
                report.requested.0[0],
                f64::from(report.speed_mrpm) / 1_000.0,
                codes(&report.errors)
            )
        };
        format!(
            "{}\n{}\n  crosscheck: exchange {}, permit {}, errors [{}]; paths {} {}",
            side("channel A", &self.a),
            side("channel B", &self.b),
            self.agreement.exchange,
            self.agreement.permit,
            codes(&self.agreement.errors),
            self.readback.1.path_a,
            self.readback.1.path_b
        )
    }

    fn differs(&self, other: &Self) -> bool {
        let reports = (self.a.exchange, self.b.exchange) != (other.a.exchange, other.b.exchange);
        let paths = self.readback.1 != other.readback.1;
        reports || paths || self.agreement.permit != other.agreement.permit
    }
}

/// The reader of one cell.
///
/// # Errors
/// When the service cannot be read.
pub fn one<T: sim::shm::CellValue>(
    domain: &Domain,
    kind: Kind,
    axis: u8,
) -> Result<CellReader<T>, DomainError> {
    let mut all = domain.readers::<T>(kind, &[axis])?;
    all.pop().ok_or(DomainError::Axes)
}

/// The shared memory of the set that runs in `folder`, for reading.
///
/// # Errors
/// One line: none runs there.
pub fn domain_of(folder: &RunFolder) -> Result<Domain, String> {
    // The nonce concerns writers only.
    let domain = Domain::open(&folder.place(1), OPEN_DEADLINE);
    domain.map_err(|error| format!("no set runs in this folder: {error}"))
}

/// CLOCK_MONOTONIC, ns.
pub fn now_ns() -> u64 {
    let time = nix::time::clock_gettime(nix::time::ClockId::CLOCK_MONOTONIC);
    time.map_or(0, |time| time.tv_sec() as u64 * 1_000_000_000 + time.tv_nsec() as u64)
}
