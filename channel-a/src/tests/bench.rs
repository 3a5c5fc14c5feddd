//! An axis on the bench: a partner that agrees, a crosscheck that permits, 1 ms cycles.

#[path = "../../benches/image.rs"]
mod sealed;

use std::vec::Vec;

use shm_schema::agreement::{Agreement, Echo, PathTest};
use shm_schema::command::{Command, CommandSource, Frame};
use shm_schema::encoder::{Encoder, Slot, SlotKind};
use shm_schema::exchange::{CellFault, Inputs, Motion, Outputs, Published, Sampled, Setup, Start};
use shm_schema::inhibit::Readback;
use shm_schema::io::Io;
use shm_schema::profile::Profile;
use shm_schema::report::Report;
use shm_schema::word::Word;

use crate::{Monitor, crc32};

const MILLISECOND: u64 = 1_000_000;

/// A sealed image of axis 1.
pub fn image(profile: Profile, entries: &[(u32, i64)]) -> Vec<u8> {
    sealed::sealed(profile, entries, crc32)
}

fn cell<T>(sequence: u64, payload: T) -> Sampled<T> {
    Sampled { sequence, timestamp_ns: (sequence - 1) * MILLISECOND, crc32: 0, payload }
}

/// One axis under test.
pub struct Bench {
    pub monitor: Monitor,
    /// Number of the cycle that runs next; its time is as many milliseconds.
    pub k: u64,
    pub word: u32,
    pub clear: bool,
    pub rpm: f64,
    pub position: i64,
    pub travel: bool,
    /// Raw signals of a sine encoder with 1,024 periods; the motion only in the first cycle.
    pub raw: bool,
    pub lines: [bool; 4],
    /// The pair whose second line stays high.
    pub split: Option<usize>,
    /// Pattern of all lines in place of a level.
    pub line_patterns: Option<u64>,
    pub partner: Option<Report>,
    pub partner_changes: fn(&mut Report),
    pub partner_alive: bool,
    pub agreement_alive: bool,
    /// Crosscheck goes on, but echoes what it had read last.
    pub echo_alive: bool,
    pub overruns: u8,
    /// What the producer returns of the own output lines, from what was driven.
    pub returned: Option<fn(usize, u64) -> u64>,
    pub encoder_alive: bool,
    /// The producer's own cycle in ours.
    pub stretch: f64,
    pub command_alive: bool,
    pub agreement: Agreement,
    pub readback: Readback,
    /// In place of the plain command.
    pub command: Option<Command>,
    pub torque_ppm: i32,
    pub drive_n0: bool,
    pub drive_enabled: bool,
    /// Speed of the drive in that of the motor.
    pub drive_ratio: f64,
    pub acceleration: Option<i64>,
    pub ais: u64,
    pub aie: u64,
    turned: f64,
    encoder_sequence: u64,
    last: Option<Outputs>,
    history: [Option<Report>; 2],
}

impl Bench {
    pub fn new(profile: Profile, entries: &[(u32, i64)], start: Start) -> Self {
        Self::with(profile, entries, &Setup::new(1, 9, start))
    }

    pub fn with(profile: Profile, entries: &[(u32, i64)], setup: &Setup) -> Self {
        Self {
            monitor: Monitor::new(&image(profile, entries), setup),
            k: 0,
            word: profile.neutral_word(),
            clear: false,
            rpm: 0.0,
            position: 0,
            travel: true,
            raw: false,
            lines: [true; 4],
            split: None,
            line_patterns: None,
            partner: None,
            partner_changes: |_| {},
            partner_alive: true,
            agreement_alive: true,
            echo_alive: true,
            overruns: 0,
            returned: None,
            encoder_alive: true,
            stretch: 1.0,
            command_alive: true,
            agreement: Agreement { permit: true, path_test: PathTest::None, ..Agreement::default() },
            readback: Readback::default(),
            command: None,
            torque_ppm: 0,
            drive_n0: false,
            drive_enabled: true,
            drive_ratio: 1.0,
            acceleration: None,
            ais: 0,
            aie: 0,
            turned: 0.0,
            encoder_sequence: 0,
            last: None,
            history: [None; 2],
        }
    }

    pub fn amk(entries: &[(u32, i64)]) -> Self {
        Self::new(Profile::AmkKw, entries, Start::Settled)
    }

    fn inputs(&mut self) -> Inputs {
        if self.encoder_alive {
            self.encoder_sequence = (self.k as f64 / self.stretch) as u64 + 1;
        }
        let encoder = Encoder {
            slots: if self.raw { [self.sine_slot(); 2] } else { [Slot::default(); 2] },
            torque_ppm: self.torque_ppm,
            drive_position: (self.turned * self.drive_ratio) as i64,
            frequency_mhz: (self.rpm * 1_000.0 / 60.0) as i32,
            period_ns: MILLISECOND as u32,
        };
        let exact = Motion {
            position: self.position,
            speed_mrpm: (self.rpm * 1_000.0).round() as i32,
            acceleration_mrpm_s: self.acceleration,
        };
        let only_raw = self.raw && self.k > 0;
        let pattern = |high: bool| if high { u64::MAX } else { 0 };
        let lines = self.line_patterns.map_or(self.lines.map(pattern), |pattern| [pattern; 4]);
        let mut other = lines;
        if let Some(pattern) = self.split.and_then(|pair| other.get_mut(pair)) {
            *pattern = u64::MAX;
        }
        let io = Io {
            samples: 16 * (self.k + 1),
            line_1: lines,
            line_2: other,
            ais: self.ais,
            aie: self.aie,
            ..Io::default()
        };
        let io = self.with_readback(io);
        let command = Command {
            source: CommandSource::Plain,
            clear_error: self.clear,
            drive_n0: self.drive_n0,
            drive_enabled: self.drive_enabled,
            word: Word::from_u32(self.word),
            ..Command::default()
        };
        let command = self.command.unwrap_or(command);
        let own = self.last.map(|outputs| outputs.report);
        let partner = own.map(|mut report| {
            (self.partner_changes)(&mut report);
            report
        });
        if self.partner_alive {
            self.partner = partner;
        }
        let published =
            own.map(|report| Published { exchange: report.exchange, crc32: report.exchange as u32 ^ 5 });
        let agreed = published.filter(|_| self.agreement_alive);
        {
            if let Some(published) = agreed {
                if self.echo_alive {
                    self.agreement.echo_a =
                        Echo { exchange: published.exchange, boot_nonce: 9, crc32: published.crc32 };
                }
                self.agreement.exchange = published.exchange;
            }
        }
        Inputs {
            encoder: Ok(Sampled {
                timestamp_ns: self.stamp(),
                ..cell(self.encoder_sequence.max(1), encoder)
            }),
            motion: if only_raw { None } else { Some(exact) },
            io: Ok(cell(self.k + 1, io)),
            command: if self.command_alive { Ok(cell(self.k + 1, command)) } else { Err(CellFault::Missing) },
            partner: self.partner.map(|report| cell(report.exchange + 1, report)).ok_or(CellFault::Missing),
            agreement: Ok(cell(self.agreement.exchange + 1, self.agreement)),
            readback: Ok(cell(self.k + 1, self.readback)),
            published,
            overruns: self.overruns,
            image_sound: true,
        }
    }

    /// Driven in the step before, the newest sample in bit 0.
    fn with_readback(&self, mut io: Io) -> Io {
        if let Some((returned, outputs)) = self.returned.zip(self.last) {
            let [first, second, supply] = outputs.inhibit.outputs.map(|line| line.reverse_bits() >> 48);
            io.output_readback = [returned(0, first), 0, returned(1, second), 0];
            io.dynamic_readback = [returned(2, supply), 0];
        }
        io
    }

    /// A frame for the step `ahead` exchanges behind the next one.
    pub fn send(&mut self, source: CommandSource, octets: &[u8], ahead: u64) {
        let mut frame = Frame::default();
        frame.0[..octets.len()].copy_from_slice(octets);
        self.command = Some(Command {
            source,
            drive_enabled: true,
            frame_number: self.command.map_or(0, |command| command.frame_number) + 1,
            frame_exchange: self.k + 1 + ahead,
            frame_length: octets.len() as u16,
            frame,
            ..Command::default()
        });
    }

    fn sine_slot(&self) -> Slot {
        let periods = self.turned / 65_536.0 * 1_024.0;
        let (sine, cosine) = (periods * core::f64::consts::TAU).sin_cos();
        Slot {
            kind: SlotKind::SineCosine,
            sine: (sine * 16_384.0).round() as i16,
            cosine: (cosine * 16_384.0).round() as i16,
            count: (periods * 4.0).floor() as i32,
            ..Slot::default()
        }
    }

    /// The host sleeps for so many cycles; the world goes on.
    pub fn stall(&mut self, cycles: u64) {
        self.turned += self.rpm / 60_000.0 * 65_536.0 * cycles as f64;
        self.k += cycles;
    }

    /// When the newest sample was taken.
    fn stamp(&self) -> u64 {
        ((self.encoder_sequence.max(1) - 1) as f64 * self.stretch * MILLISECOND as f64) as u64
    }

    /// One cycle.
    pub fn step(&mut self) -> Outputs {
        if self.travel && self.k > 0 {
            self.turned += self.rpm / 60_000.0 * 65_536.0;
            self.position = self.turned.round() as i64;
        }
        let inputs = self.inputs();
        let outputs = self.monitor.step(&inputs, self.k * MILLISECOND);
        self.k += 1;
        let paths = outputs.inhibit.permit;
        self.readback = Readback { path_a: paths, path_b: paths, edges_a: outputs.inhibit.edges, edges_b: 0 };
        self.history = [Some(outputs.report), self.history[0]];
        self.last = Some(outputs);
        outputs
    }

    /// Cycles up to and including the one at `t_ms`; its result.
    pub fn until(&mut self, t_ms: u64) -> Report {
        let mut report = None;
        while self.k <= t_ms {
            report = Some(self.step().report);
        }
        report.expect("time only goes forward")
    }

    /// Runs with a speed for each cycle up to `t_ms`.
    pub fn ride(&mut self, t_ms: u64, rpm: impl Fn(f64) -> f64) -> Report {
        let mut report = None;
        while self.k <= t_ms {
            self.rpm = rpm(self.k as f64);
            report = Some(self.step().report);
        }
        report.expect("time only goes forward")
    }

    /// First cycle up to `t_ms` in which `found` holds.
    pub fn first(
        &mut self,
        t_ms: u64,
        rpm: impl Fn(f64) -> f64,
        found: impl Fn(&Report) -> bool,
    ) -> Option<u64> {
        while self.k <= t_ms {
            self.rpm = rpm(self.k as f64);
            let at = self.k;
            if found(&self.step().report) {
                return Some(at);
            }
        }
        None
    }
}

pub fn codes(report: &Report) -> Vec<(u32, u32, u32, u32)> {
    report.errors.iter().map(|code| (code.code, code.info1, code.info2, code.info3)).collect()
}
