//! Reads the stamps of a running set: when each process woke up, how long an exchange took.

use std::{
    collections::VecDeque,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use shm_schema::{agreement::Agreement, cell::Kind, encoder::Encoder, report::Report};
use sim::shm::{CellReader, Domain, DomainError};

use super::histogram::Times;
use crate::watch::one;

/// Samples remembered for the exchange time.
const REMEMBERED: usize = 64;

/// What the stamps of one axis say.
#[derive(Debug, Clone, Default)]
pub struct Stamps {
    /// Wake-up of A, B, crosscheck behind its phase in the cycle.
    pub woken: [Times; 3],
    /// From the instant of a sample to the agreement on it.
    pub exchange: Times,
    /// Exchanges whose sample was skipped by A, by B.
    pub skipped: [u64; 2],
}

/// A thread that reads until it is told to stop.
#[derive(Debug)]
pub struct Sampler {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Stamps>,
}

struct Eyes {
    encoder: CellReader<Encoder>,
    a: CellReader<Report>,
    b: CellReader<Report>,
    agreement: CellReader<Agreement>,
    cycle_ns: u64,
    seen: [u64; 3],
    exchanges: [u64; 2],
    agreed: u64,
    samples: VecDeque<(u64, u64)>,
}

impl Sampler {
    /// Starts to read `axis` of a set with this cycle.
    ///
    /// # Errors
    /// When the cells cannot be read.
    pub fn start(domain: &Domain, axis: u8, cycle_ns: u64) -> Result<Self, DomainError> {
        let mut eyes = Eyes {
            encoder: one(domain, Kind::Encoder, axis)?,
            a: one(domain, Kind::ReportA, axis)?,
            b: one(domain, Kind::ReportB, axis)?,
            agreement: one(domain, Kind::Agreement, axis)?,
            cycle_ns,
            seen: [0; 3],
            exchanges: [0; 2],
            agreed: 0,
            samples: VecDeque::new(),
        };
        let stop = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&stop);
        // Four looks a cycle: hardly a stamp is overwritten before it is seen.
        let pause = Duration::from_nanos(cycle_ns / 4);
        let thread = thread::spawn(move || {
            let mut stamps = Stamps::default();
            while !told.load(Ordering::Relaxed) {
                eyes.look(&mut stamps);
                thread::sleep(pause);
            }
            stamps
        });
        Ok(Self { stop, thread })
    }

    /// Ends and hands over what was read.
    pub fn finish(self) -> Stamps {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap_or_default()
    }
}

impl Eyes {
    fn look(&mut self, stamps: &mut Stamps) {
        if let Some((header, _)) = self.encoder.read() {
            let news = self.samples.back().is_none_or(|(sequence, _)| *sequence != header.sequence);
            if news {
                self.samples.push_back((header.sequence, header.timestamp_ns));
                if self.samples.len() > REMEMBERED {
                    self.samples.pop_front();
                }
            }
        }
        let reports = [self.a.read(), self.b.read()];
        for (at, report) in reports.into_iter().enumerate() {
            let Some((header, report)) = report else { continue };
            if header.sequence != self.seen[at] {
                let follows = self.seen[at] + 1 == header.sequence;
                let step = report.exchange.saturating_sub(self.exchanges[at]);
                stamps.skipped[at] += if follows { step.saturating_sub(1) } else { 0 };
                self.seen[at] = header.sequence;
                self.exchanges[at] = report.exchange;
                stamps.woken[at].add(self.behind_phase(header.timestamp_ns, at as u64 + 1));
            }
        }
        let Some((header, agreement)) = self.agreement.read() else { return };
        if header.sequence != self.seen[2] {
            self.seen[2] = header.sequence;
            stamps.woken[2].add(self.behind_phase(header.timestamp_ns, 3));
            if agreement.exchange != self.agreed {
                self.agreed = agreement.exchange;
                let sample = self.samples.iter().find(|(sequence, _)| *sequence == agreement.exchange);
                if let Some((_, taken_ns)) = sample {
                    stamps.exchange.add(header.timestamp_ns.saturating_sub(*taken_ns));
                }
            }
        }
    }

    /// A stamp within the cycle, behind the quarter at which the process is due; more than a
    /// cycle late shows as the rest only, and as a skipped exchange.
    const fn behind_phase(&self, stamp_ns: u64, quarter: u64) -> u64 {
        (stamp_ns + self.cycle_ns - quarter * (self.cycle_ns / 4)) % self.cycle_ns
    }
}
