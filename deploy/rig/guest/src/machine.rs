//! The machine behind the lines: motor, encoder, and the evaluator of both inhibit paths, which
//! sees nothing but the levels of two lines.
//!
//! It looks at the lines four times a cycle and publishes `inhibit-readback`, `encoder` and
//! `command` once. The command carries no word: the axis is commanded by its terminals.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use producers::clock::{Cycle, now_ns, prepare};
use shm_schema::agreement::Agreement;
use shm_schema::cell::Kind;
use shm_schema::command::Command;
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::{Encoder, SlotKind};
use shm_schema::inhibit::{MISSING_EDGES, Readback};
use shm_schema::io::Io;
use shm_schema::report::Report;
use sim::motor::{Motor, MotorData};
use sim::shm::{CellReader, CellValue, CellWriter, Domain};
use sim::signals::{Signals, SlotWiring};

use crate::chip::{Chip, PATH_A, PATH_B, Probe};

/// Cycle of the set, ns.
pub const CYCLE_NS: u64 = 1_000_000;
/// Looks at the lines in one cycle.
const LOOKS: u64 = 4;
/// When the cells are read in a cycle, ns: behind both channels.
const READ_NS: u64 = CYCLE_NS - LOOK_NS;
/// How late an edge can be seen, ns.
pub const LOOK_NS: u64 = CYCLE_NS / LOOKS;
/// Above all others: its clock is the witness.
const PRIORITY: i32 = 85;

/// What was seen so far.
#[derive(Debug, Default)]
pub struct Seen {
    /// Time of each edge on path A and on path B, ns.
    pub edges: [Vec<u64>; 2],
    /// Time of the newest edge to high, ns.
    pub risen_ns: [u64; 2],
    /// Edges seen while the channel did not say that it drives.
    pub unasked: [usize; 2],
    /// Newest reports of A and B.
    pub reports: [Option<Report>; 2],
    /// Newest agreement.
    pub agreement: Option<Agreement>,
    /// Each path permits torque, as the evaluator sees it.
    pub on: [bool; 2],
    /// Both do.
    pub torque: bool,
    /// Samples of line .1 of the first pair, oldest first.
    pub samples: Vec<bool>,
    /// Wake-up of channel A behind its phase, ns, one for each cycle it reported.
    pub wakeups_ns: Vec<u32>,
}

/// A running machine.
#[derive(Debug)]
pub struct Machine {
    seen: Arc<Mutex<Seen>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Machine {
    /// Starts on the open domain.
    pub fn start(domain: &Domain, chip: &Chip) -> Result<Self, String> {
        let seen = Arc::new(Mutex::new(Seen::default()));
        let stop = Arc::new(AtomicBool::new(false));
        let mut inside = Inside::new(domain, chip, Arc::clone(&seen))?;
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            prepare(None, Some(PRIORITY)).iter().for_each(|missing| println!("note machine: {missing}"));
            inside.run(&stopped);
        });
        Ok(Self { seen, stop, thread: Some(thread) })
    }

    /// What was seen.
    pub fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// One path as its evaluator has it.
struct Path {
    probe: Probe,
    level: bool,
    edges: u64,
    newest_ns: u64,
    on: bool,
}

impl Path {
    fn new(chip: &Chip, line: u32) -> Result<Self, String> {
        Ok(Self { probe: chip.probe(line)?, level: false, edges: 0, newest_ns: 0, on: false })
    }

    /// Looks at the line; whether there was an edge.
    fn look(&mut self, now_ns: u64) -> bool {
        let level = self.probe.high();
        let edge = level != self.level;
        self.level = level;
        if edge {
            self.edges += 1;
            self.newest_ns = now_ns;
        }
        // The dead-man counts time, as a charge pump does (design 3.4).
        let refreshed = now_ns.saturating_sub(self.newest_ns) < u64::from(MISSING_EDGES) * CYCLE_NS;
        self.on = (self.edges > 0) & refreshed;
        edge
    }
}

struct Inside {
    seen: Arc<Mutex<Seen>>,
    paths: [Path; 2],
    motor: Motor,
    signals: Signals,
    readback: CellWriter<Readback>,
    encoder: CellWriter<Encoder>,
    command: CellWriter<Command>,
    request: CellReader<DriveRequest>,
    io: CellReader<Io>,
    reports: [CellReader<Report>; 2],
    agreement: CellReader<Agreement>,
    /// Rising edges since the reports were read.
    fresh: [usize; 2],
    samples: u64,
    exchange: u64,
}

fn only<T>(cells: Result<Vec<T>, sim::shm::DomainError>) -> Result<T, String> {
    let mut cells = cells.map_err(|error| error.to_string())?;
    cells.pop().ok_or_else(|| "no axis".to_owned())
}

fn reader<T: CellValue>(domain: &Domain, kind: Kind) -> Result<CellReader<T>, String> {
    only(domain.readers(kind, &[1]))
}

fn writer<T: CellValue>(domain: &Domain, kind: Kind) -> Result<CellWriter<T>, String> {
    only(domain.writers(kind, &[1]))
}

impl Inside {
    fn new(domain: &Domain, chip: &Chip, seen: Arc<Mutex<Seen>>) -> Result<Self, String> {
        Ok(Self {
            seen,
            paths: [Path::new(chip, PATH_A)?, Path::new(chip, PATH_B)?],
            motor: Motor::new(MotorData::default()),
            signals: Signals::new(SlotWiring::new(SlotKind::SineCosine, 1_024), 6, 1),
            readback: writer(domain, Kind::Readback)?,
            encoder: writer(domain, Kind::Encoder)?,
            command: writer(domain, Kind::Command)?,
            request: reader(domain, Kind::DriveRequest)?,
            io: reader(domain, Kind::Io)?,
            reports: [reader(domain, Kind::ReportA)?, reader(domain, Kind::ReportB)?],
            agreement: reader(domain, Kind::Agreement)?,
            fresh: [0; 2],
            samples: 0,
            exchange: 0,
        })
    }

    fn run(&mut self, stop: &AtomicBool) {
        let mut looks = Cycle::after(now_ns(), LOOK_NS, 0);
        let mut published_ns = 0;
        while !stop.load(Ordering::Relaxed) {
            let (_, instant_ns) = looks.wait();
            self.look(now_ns());
            if instant_ns % CYCLE_NS == READ_NS {
                self.read();
            }
            let boundary_ns = instant_ns - instant_ns % CYCLE_NS;
            if boundary_ns > published_ns {
                let cycles = if published_ns == 0 { 1 } else { (boundary_ns - published_ns) / CYCLE_NS };
                published_ns = boundary_ns;
                self.publish(cycles, boundary_ns);
            }
        }
    }

    fn look(&mut self, now_ns: u64) {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        for (place, path) in self.paths.iter_mut().enumerate() {
            if path.look(now_ns) {
                seen.edges[place].push(now_ns);
                if path.level {
                    // Back to low may be the release, up to high never is.
                    seen.risen_ns[place] = now_ns;
                    self.fresh[place] += 1;
                }
            }
        }
        seen.on = self.paths.each_ref().map(|path| path.on);
        seen.torque = seen.on == [true; 2];
    }

    /// Once a cycle, behind both channels: what they say, against what their lines did.
    fn read(&mut self) {
        let seen = Arc::clone(&self.seen);
        let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
        let seen = &mut *seen;
        for (place, cell) in self.reports.iter().enumerate() {
            let driving = |report: &Option<Report>| report.is_some_and(|report| report.driving);
            let read = cell.read().map(|(_, report)| report);
            let drove = driving(&seen.reports[place]) | driving(&read);
            seen.reports[place] = read;
            seen.unasked[place] += if drove { 0 } else { self.fresh[place] };
        }
        self.fresh = [0; 2];
        seen.agreement = self.agreement.read().map(|(_, agreement)| agreement);
        self.record(seen);
    }

    fn record(&mut self, seen: &mut Seen) {
        if let Some((_, io)) = self.io.read() {
            let new = if self.samples == 0 { 0 } else { io.samples.saturating_sub(self.samples).min(64) };
            self.samples = io.samples;
            seen.samples.extend((0..new).rev().map(|bit| io.line_1[0] >> bit & 1 == 1));
        }
        if let Some(report) = seen.reports[0].filter(|report| report.exchange != self.exchange) {
            self.exchange = report.exchange;
            let late_ns = (report.time_ns + CYCLE_NS - crate::set::PHASE_A_NS) % CYCLE_NS;
            seen.wakeups_ns.push(late_ns as u32);
        }
    }

    fn publish(&mut self, cycles: u64, boundary_ns: u64) {
        let energised = self.paths.iter().all(|path| path.on);
        let request = self.request.read().map_or_else(DriveRequest::default, |(_, request)| request);
        (0..cycles.min(100)).for_each(|_| self.motor.step(CYCLE_NS as f64 / 1e9, energised, &request));
        let readback = Readback {
            path_a: self.paths[0].on,
            path_b: self.paths[1].on,
            edges_a: self.paths[0].edges,
            edges_b: self.paths[1].edges,
        };
        self.readback.publish(&readback, boundary_ns);
        let slot = self.signals.slot(self.motor.fine());
        let encoder = Encoder {
            slots: [slot, slot],
            drive_position: self.motor.position(),
            torque_ppm: self.motor.torque_ppm(),
            period_ns: CYCLE_NS as u32,
            ..Encoder::default()
        };
        self.encoder.skip(cycles.saturating_sub(1));
        self.encoder.publish(&encoder, boundary_ns);
        let command = Command { drive_n0: true, drive_enabled: true, ..Command::default() };
        self.command.publish(&command, boundary_ns);
    }
}
