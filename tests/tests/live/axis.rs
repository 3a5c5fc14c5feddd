//! Axis 1 as its cells show it, with an evaluator of the test's own behind both paths.

use std::thread;
use std::time::{Duration, Instant};

use nix::time::{ClockId, clock_gettime};
use shm_schema::agreement::Agreement;
use shm_schema::cell::Kind;
use shm_schema::error::ErrorList;
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::report::{Phase, Report};
use sim::shm::{CellReader, CellValue, Domain, Place};

use crate::set::DEADLINE;

/// Faster than the cycle, so that hardly an edge is missed.
const POLL: Duration = Duration::from_micros(300);

/// CLOCK_MONOTONIC, ns.
pub fn now_ns() -> u64 {
    let time = clock_gettime(ClockId::CLOCK_MONOTONIC).expect("a clock");
    time.tv_sec() as u64 * 1_000_000_000 + time.tv_nsec() as u64
}

/// One inhibit path, seen from the evaluator: what counts is the instant of the last edge.
#[derive(Debug)]
pub struct Path {
    cell: CellReader<Inhibit>,
    edges: u64,
    /// Time stamp of the newest edge, ns. An edge that was overwritten before it was seen
    /// counts as late as it can have been.
    pub refreshed_ns: u64,
    /// The channel wants torque.
    pub permit: bool,
}

impl Path {
    fn new(cell: CellReader<Inhibit>) -> Self {
        Self { cell, edges: 0, refreshed_ns: 0, permit: false }
    }

    fn look(&mut self) {
        let Some((header, wish)) = self.cell.read() else { return };
        if wish.edges != self.edges {
            self.refreshed_ns = header.timestamp_ns;
        }
        self.edges = wish.edges;
        self.permit = wish.permit;
    }
}

/// All cells the tests look at.
#[derive(Debug)]
pub struct Axis {
    /// Path of A, path of B.
    pub paths: [Path; 2],
    a: CellReader<Report>,
    b: CellReader<Report>,
    agreement: CellReader<Agreement>,
    readback: CellReader<Readback>,
    _domain: Domain,
}

fn cell<T: CellValue>(domain: &Domain, kind: Kind) -> CellReader<T> {
    let mut readers = domain.readers::<T>(kind, &[1]).expect("a service of the running set");
    readers.pop().expect("one axis")
}

impl Axis {
    /// Opens the cells of the set at `place`.
    pub fn open(place: &Place) -> Self {
        let domain = Domain::open(place, Duration::from_secs(2)).expect("the domain of a running set");
        Self {
            paths: [Kind::InhibitA, Kind::InhibitB].map(|kind| Path::new(cell(&domain, kind))),
            a: cell(&domain, Kind::ReportA),
            b: cell(&domain, Kind::ReportB),
            agreement: cell(&domain, Kind::Agreement),
            readback: cell(&domain, Kind::Readback),
            _domain: domain,
        }
    }

    /// Watches until `condition` holds, at most `DEADLINE`.
    pub fn expect(&mut self, what: &str, condition: impl Fn(&Self) -> bool) {
        let come = self.comes(DEADLINE, condition);
        assert!(come, "{what} did not come; last seen:\n{}", self.in_words());
    }

    /// Watches until `condition` holds, at most `deadline`; whether it did.
    pub fn comes(&mut self, deadline: Duration, condition: impl Fn(&Self) -> bool) -> bool {
        let start = Instant::now();
        while start.elapsed() < deadline {
            self.look();
            if condition(self) {
                return true;
            }
            thread::sleep(POLL);
        }
        false
    }

    /// Watches for `length` that `condition` holds all the time.
    pub fn hold(&mut self, what: &str, length: Duration, condition: impl Fn(&Self) -> bool) {
        let start = Instant::now();
        while start.elapsed() < length {
            self.look();
            assert!(condition(self), "{what} did not last; last seen:\n{}", self.in_words());
            thread::sleep(POLL);
        }
    }

    fn look(&mut self) {
        self.paths.iter_mut().for_each(Path::look);
    }

    /// Everything is ready for the first acknowledge.
    pub fn awaits_acknowledge(&self) -> bool {
        let awaits = |report: Option<(_, Report)>| {
            report.is_some_and(|(_, report)| report.phase == Phase::AwaitAcknowledge)
        };
        awaits(self.a.read()) & awaits(self.b.read())
    }

    /// Both paths are on, behind the dead-man of the simulated evaluator.
    pub fn torque(&self) -> bool {
        self.readback.read().is_some_and(|(_, readback)| readback.path_a & readback.path_b)
    }

    /// Both paths have been off for `silence` or are told to be.
    pub fn silent(&self, silence: Duration) -> bool {
        let now = now_ns();
        let quiet = |path: &Path| now.saturating_sub(path.refreshed_ns) > silence.as_nanos() as u64;
        self.paths.iter().all(quiet)
    }

    /// Edges of both paths since the start.
    pub fn edges(&self) -> [u64; 2] {
        [self.paths[0].edges, self.paths[1].edges]
    }

    /// Channel A brakes in SS1.
    pub fn brakes(&self) -> bool {
        self.a.read().is_some_and(|(_, report)| report.stop == shm_schema::report::Stop::Ss1)
    }

    /// Speed that channel A reports, 1/1000 rpm.
    pub fn speed_mrpm(&self) -> i32 {
        self.a.read().map_or(0, |(_, report)| report.speed_mrpm)
    }

    /// What each side says, a line each.
    pub fn in_words(&self) -> String {
        let [a, b] = [("A", &self.a), ("B", &self.b)].map(|(name, cell)| said(name, cell.read()));
        let agreement = self.agreement.read().map_or(String::new(), |(header, agreement)| {
            let errors = codes(&agreement.errors);
            format!("update {}, permit {}, errors [{errors}]", header.sequence, agreement.permit)
        });
        let readback = self.readback.read().map(|(_, readback)| (readback.path_a, readback.path_b));
        format!("  {a}\n  {b}\n  crosscheck: {agreement}\n  paths: {readback:?}, edges {:?}", self.edges())
    }
}

fn said<T>(name: &str, report: Option<(T, Report)>) -> String {
    let Some((_, report)) = report else { return format!("channel {name}: nothing yet") };
    format!(
        "channel {name}: exchange {}, {:?}, {:?}, ready {}, driving {}, overruns {}, {} mrpm, errors [{}]",
        report.exchange,
        report.phase,
        report.stop,
        report.ready,
        report.driving,
        report.overruns,
        report.speed_mrpm,
        codes(&report.errors)
    )
}

fn codes(errors: &ErrorList) -> String {
    let code = |error: &shm_schema::error::ErrorCode| {
        format!("{}/{}/{}/{}", error.code, error.info1, error.info2, error.info3)
    };
    errors.iter().map(code).collect::<Vec<_>>().join(", ")
}
