//! A crosscheck between two healthy channels whose reports a test bends.

use shm_schema::agreement::{Agreement, PathTest};
use shm_schema::error::ErrorCode;
use shm_schema::exchange::{CellFault, CrosscheckInputs, CrosscheckOutputs, Received, Sampled, Setup, Start};
use shm_schema::image::{MAGIC, VERSION};
use shm_schema::inhibit::Readback;
use shm_schema::profile::Profile;
use shm_schema::report::{Phase, Report, Stop};
use shm_schema::word::Word;
use std::vec::Vec;

use crate::guard::crc32;
use crate::{Crosscheck, Limits};

pub const CYCLE_NS: u64 = 1_000_000;
/// cc_factor 7: 120 ms (DEC-20).
pub const TCC_CYCLES: u64 = 120;
pub const NONCE: u32 = 77;

/// Encoding A of an image with these entries.
pub fn image(profile: Profile, axis: u8, entries: &[(u32, i32)]) -> Vec<u8> {
    let mut words = std::vec![MAGIC, u32::from(VERSION) << 16 | (profile as u32) << 8 | u32::from(axis)];
    words.extend([entries.len() as u32, 0, 0x00C0_FFEE, 0, 1]);
    words.extend([0; 6]);
    for (key, value) in entries {
        words.extend([*key, *value as u32]);
    }
    let mut octets: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    octets.extend(crc32(&octets).to_le_bytes());
    octets
}

/// AMK limits: Prm2 = 50 increments, Prm3 = 16 rpm, Prm105 = 7.
pub fn amk_image() -> Vec<u8> {
    image(Profile::AmkKw, 1, &[(2, 50), (3, 16), (105, 7)])
}

pub struct Bench {
    pub core: Crosscheck,
    pub now_ns: u64,
    pub exchange: u64,
    pub a: Report,
    pub b: Report,
    pub path_a: bool,
    pub path_b: bool,
    /// The report of A does not advance.
    pub frozen_a: bool,
    /// The report of B is unreadable.
    pub broken_b: bool,
    /// The producer stands still.
    pub frozen_encoder: bool,
    pub overruns: u8,
    /// The evaluator's cell does not advance.
    pub frozen_readback: bool,
    /// Edges of path A that the evaluator did not see.
    pub paused_a: u64,
    /// Exchanges by which A's number is wrong.
    pub lie_a: u64,
    sequence: u64,
    last_a: Option<Sampled<Report>>,
}

fn healthy() -> Report {
    Report {
        phase: Phase::Operational,
        ready: true,
        driving: true,
        parameter_signature: 0x00C0_FFEE,
        status: Word::from_u32(0x1000_0100),
        ..Report::default()
    }
}

impl Bench {
    pub fn settled() -> Self {
        Self::with(&amk_image(), Start::Settled)
    }

    pub fn with(image: &[u8], start: Start) -> Self {
        Self {
            core: Crosscheck::new(&Setup::new(1, NONCE, start), &Limits::from_image(image)),
            now_ns: 5_000_000_000,
            exchange: 100,
            a: healthy(),
            b: healthy(),
            path_a: true,
            path_b: true,
            frozen_a: false,
            broken_b: false,
            frozen_encoder: false,
            overruns: 0,
            frozen_readback: false,
            paused_a: 0,
            lie_a: 0,
            sequence: 0,
            last_a: None,
        }
    }

    /// One cycle.
    pub fn step(&mut self) -> CrosscheckOutputs {
        self.now_ns += CYCLE_NS;
        self.sequence += 1;
        if !self.frozen_encoder {
            self.exchange += 1;
        }
        let fresh = self.sampled(&self.a, self.exchange + self.lie_a);
        let report_a = if self.frozen_a { self.last_a.unwrap_or(fresh) } else { fresh };
        self.last_a = Some(report_a);
        let report_b = self.sampled(&self.b, self.exchange);
        self.raw(Ok(report_a), if self.broken_b { Err(CellFault::CheckSum) } else { Ok(report_b) })
    }

    /// One step with these reports, time and sample as they are.
    pub fn raw(&mut self, report_a: Received<Report>, report_b: Received<Report>) -> CrosscheckOutputs {
        let readback = Readback {
            path_a: self.path_a,
            path_b: self.path_b,
            edges_a: self.sequence - self.paused_a,
            edges_b: self.sequence,
        };
        let inputs = CrosscheckInputs {
            report_a,
            report_b,
            readback: Ok(Sampled {
                sequence: if self.frozen_readback { 1 } else { self.sequence },
                timestamp_ns: self.now_ns,
                crc32: 0,
                payload: readback,
            }),
            encoder_sequence: Some(self.exchange),
            overruns: self.overruns,
        };
        self.core.step(&inputs, self.now_ns)
    }

    pub fn sampled(&self, report: &Report, exchange: u64) -> Sampled<Report> {
        Sampled {
            sequence: self.sequence,
            timestamp_ns: self.now_ns,
            crc32: (exchange as u32).wrapping_mul(3),
            payload: Report { exchange, time_ns: self.now_ns, ..*report },
        }
    }

    pub fn run(&mut self, cycles: u64) -> CrosscheckOutputs {
        let mut last = self.step();
        for _ in 1..cycles {
            last = self.step();
        }
        last
    }

    /// Cycles until an error stands, the present one counted as 0; at most `most`.
    pub fn cycles_to_error(&mut self, most: u64) -> Option<u64> {
        (0..=most).find(|_| self.step().agreement.error)
    }

    /// Both channels in STO, paths off.
    pub fn stop_both(&mut self) {
        for report in [&mut self.a, &mut self.b] {
            report.ready = false;
            report.driving = false;
            report.stop = Stop::Sto;
            report.status = Word::from_u32(0x1000_0001);
        }
        (self.path_a, self.path_b) = (false, false);
    }

    /// One acknowledge pulse; the outputs of the cycle of its edge.
    pub fn acknowledge(&mut self) -> CrosscheckOutputs {
        (self.a.acknowledgements, self.b.acknowledgements) = (0, 0);
        self.step();
        (self.a.acknowledgements, self.b.acknowledgements) = (1, 1);
        let outputs = self.step();
        (self.a.acknowledgements, self.b.acknowledgements) = (0, 0);
        outputs
    }
}

pub fn codes(agreement: &Agreement) -> Vec<ErrorCode> {
    agreement.errors.iter().copied().collect()
}

pub const fn amk(code: u32, info1: u32, info2: u32) -> ErrorCode {
    ErrorCode::amk(code, info1, info2, 0)
}

pub const PASSED: PathTest = PathTest::Passed;

impl Bench {
    /// Time and sample of the next cycle; the reports come by [`Bench::raw`].
    pub fn step_without_reports(&mut self) {
        self.now_ns += CYCLE_NS;
        self.sequence += 1;
        self.exchange += 1;
    }
}
