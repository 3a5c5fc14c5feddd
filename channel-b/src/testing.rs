//! Images and a rig for tests: two monitors that are each other's partner, and an agreement
//! that permits when both are ready.

use std::collections::BTreeMap;
use std::vec::Vec;

use shm_schema::INCREMENTS_PER_REVOLUTION;
use shm_schema::agreement::{Agreement, Echo, PathTest};
use shm_schema::command::{Command, CommandSource};
use shm_schema::encoder::{Encoder, Slot, SlotKind};
use shm_schema::error::ErrorCode;
use shm_schema::exchange::{Inputs, Motion, Outputs, Published, Received, Sampled, Setup, Start};
use shm_schema::facts;
use shm_schema::image::{MAGIC, VERSION};
use shm_schema::inhibit::Readback;
use shm_schema::io::Io;
use shm_schema::profile::Profile;
use shm_schema::report::Report;
use shm_schema::word::Word;

use crate::Monitor;
use crate::crc::{Signature, crc32c};

pub const NONCE: u32 = 4711;
pub const MS: u64 = 1_000_000;

/// An image of encoding B with the profile's defaults and `changes`.
pub fn image(profile: Profile, changes: &[(u32, i32)]) -> Vec<u8> {
    let mut values: BTreeMap<u32, i32> = match profile {
        Profile::AmkKw => facts::amk_kw::PARAMETERS.iter().map(|row| (row.key, row.default)).collect(),
        Profile::LenzeSm301 => {
            facts::lenze_sm301::PARAMETERS.iter().map(|row| (row.key, row.default)).collect()
        }
        Profile::Atv340 => facts::atv340::PARAMETERS.iter().map(|row| (row.key, row.default)).collect(),
        _ => BTreeMap::new(),
    };
    values.extend(changes.iter().copied());
    of_values(profile, &values)
}

pub fn of_values(profile: Profile, values: &BTreeMap<u32, i32>) -> Vec<u8> {
    let start = Signature::new().word(profile as u32);
    let content = values.iter().fold(start, |sum, (key, value)| sum.word(*key).word(*value as u32)).finish();
    let device = (0..6).fold(Signature::new().word(content), |sum, _| sum.word(0)).finish();
    let head = [
        MAGIC,
        u32::from(VERSION) << 16 | (profile as u32) << 8 | 1,
        values.len() as u32,
        0,
        content,
        device,
        1,
    ];
    let mut words = Vec::from(head);
    words.extend([0; 6]);
    words.extend(values.iter().flat_map(|(key, value)| [*key, *value as u32]));
    let mut octets: Vec<u8> = words.iter().flat_map(|word| (!word).to_be_bytes()).collect();
    octets.extend((!crc32c(&octets)).to_be_bytes());
    octets
}

#[allow(clippy::unnecessary_wraps, reason = "the type the inputs have")]
pub fn cell<T>(sequence: u64, timestamp_ns: u64, payload: T) -> Received<T> {
    Ok(Sampled { sequence, timestamp_ns, crc32: sequence as u32, payload })
}

/// A sine encoder of 1,024 periods at `position`, increments.
pub fn sine(position: f64, amplitude: f64) -> Encoder {
    let periods = position * 1024.0 / f64::from(INCREMENTS_PER_REVOLUTION as i32);
    let count = libm::floor(periods * 4.0);
    let (sin, cos) = libm::sincos((periods - libm::floor(periods)) * core::f64::consts::TAU);
    let slot = Slot {
        kind: SlotKind::SineCosine,
        sine: libm::rint(sin * amplitude) as i16,
        cosine: libm::rint(cos * amplitude) as i16,
        count: count as i32,
        ..Slot::default()
    };
    let drive_position = libm::rint(position) as i64;
    Encoder { slots: [slot, Slot::default()], drive_position, ..Encoder::default() }
}

/// The outputs of the cycle before as a producer reads them back, newest sample first; in
/// the cycles before it drove the same, for a monitor that sleeps.
pub fn read_back(last: Option<&Outputs>) -> [u64; 4] {
    let [sa1, sa2, _] = last.map_or([0; 3], |last| last.inhibit.outputs);
    let repeated = |driven: u64| (driven.reverse_bits() >> 48).wrapping_mul(0x0001_0001_0001_0001);
    [0, repeated(sa1), 0, repeated(sa2)]
}

/// What the world looks like in one cycle.
#[derive(Debug, Clone, Copy)]
pub struct World {
    /// 1/1000 rpm.
    pub speed: i64,
    pub position: i64,
    pub word: u32,
    pub pairs: u32,
    pub clear: bool,
    /// The drive's power stage is enabled.
    pub enabled: bool,
    pub permit: bool,
}

pub struct Rig {
    pub cycle: u64,
    pub world: World,
    pub monitors: [Monitor; 2],
    pub last: [Option<Outputs>; 2],
}

impl Rig {
    pub fn new(profile: Profile, changes: &[(u32, i32)]) -> Self {
        Self::start(profile, changes, Start::Settled)
    }

    pub fn start(profile: Profile, changes: &[(u32, i32)], start: Start) -> Self {
        Self::with(&image(profile, changes), &Setup::new(1, NONCE, start), profile)
    }

    /// A rig of two monitors of `image`, told the same.
    pub fn with(image: &[u8], setup: &Setup, profile: Profile) -> Self {
        let monitor = Monitor::new(image, setup);
        let world = World {
            speed: 0,
            position: 0,
            word: profile.neutral_word(),
            pairs: 0xF,
            clear: false,
            enabled: true,
            permit: true,
        };
        Self { cycle: 0, world, monitors: [monitor; 2], last: [None; 2] }
    }

    fn agreement(&self) -> Received<Agreement> {
        let permits = self.last.iter().all(|out| out.is_some_and(|out| out.report.ready));
        let echo =
            Echo { exchange: self.cycle.saturating_sub(1) + 1, boot_nonce: NONCE, crc32: self.cycle as u32 };
        let payload = Agreement {
            permit: permits & self.world.permit,
            echo_a: echo,
            echo_b: echo,
            path_test: PathTest::None,
            ..Agreement::default()
        };
        cell(self.cycle, self.cycle * MS, payload)
    }

    fn inputs(&self, place: usize) -> Inputs {
        let sequence = self.cycle + 1;
        let now = self.cycle * MS;
        let lines = core::array::from_fn(|pair| if self.world.pairs >> pair & 1 == 1 { u64::MAX } else { 0 });
        let output_readback = read_back(self.last[place].as_ref());
        let io =
            Io { samples: sequence * 16, line_1: lines, line_2: lines, output_readback, ..Io::default() };
        let command = Command {
            source: CommandSource::Plain,
            drive_enabled: self.world.enabled,
            clear_error: self.world.clear,
            word: Word::from_u32(self.world.word),
            ..Command::default()
        };
        let partner: Option<Report> = self.last[1 - place].map(|out| out.report);
        let drives = self.last.map(|out| out.is_some_and(|out| out.inhibit.permit));
        let edges = |place: usize| self.last[place].map_or(0, |out| out.inhibit.edges);
        let readback = Readback {
            path_a: drives[0],
            path_b: drives[1],
            edges_a: edges(1 - place),
            edges_b: edges(place),
        };
        Inputs {
            encoder: cell(sequence, now, Encoder::default()),
            motion: Some(Motion {
                position: self.world.position,
                speed_mrpm: self.world.speed as i32,
                acceleration_mrpm_s: None,
            }),
            io: cell(sequence, now, io),
            command: cell(sequence, now, command),
            partner: partner.map_or(Err(shm_schema::exchange::CellFault::Missing), |report| {
                cell(report.exchange, now, report)
            }),
            agreement: self.agreement(),
            readback: cell(sequence, now, readback),
            published: (self.cycle > 0)
                .then_some(Published { exchange: self.cycle, crc32: self.cycle as u32 }),
            overruns: 0,
            image_sound: true,
        }
    }

    /// One cycle; the second monitor's outputs (its partner has just reported).
    pub fn step(&mut self) -> Outputs {
        self.step_with(|_| ())
    }

    pub fn step_with(&mut self, change: impl Fn(&mut Inputs)) -> Outputs {
        for place in 0..2 {
            let mut inputs = self.inputs(place);
            change(&mut inputs);
            self.last[place] = Some(self.monitors[place].step(&inputs, self.cycle * MS));
        }
        self.cycle += 1;
        self.last[1].expect("stepped")
    }

    /// Steps with `drive` changing the world until `found` or 100,000 cycles; the cycle.
    pub fn until(
        &mut self,
        drive: impl Fn(u64, &mut World),
        found: impl Fn(&Outputs) -> bool,
    ) -> Option<u64> {
        for _ in 0..100_000 {
            let cycle = self.cycle;
            drive(cycle, &mut self.world);
            let outputs = self.step();
            if found(&outputs) {
                return Some(cycle);
            }
        }
        None
    }
}

pub fn codes(outputs: &Outputs) -> Vec<[u32; 4]> {
    outputs.report.errors.iter().map(|c: &ErrorCode| [c.code, c.info1, c.info2, c.info3]).collect()
}

pub fn status(outputs: &Outputs) -> u32 {
    outputs.report.status.0[0]
}
