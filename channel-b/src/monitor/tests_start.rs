//! The start-up of both sides in virtual time on a host that stalls: two monitors, each
//! the other's partner, a crosscheck that leads the self-test, an evaluator that counts.

use shm_schema::agreement::{Agreement, Echo, PathTest};
use shm_schema::command::{Command, CommandSource};
use shm_schema::encoder::Encoder;
use shm_schema::exchange::{CellFault, Inputs, Motion, Outputs, Published, Setup, Start};
use shm_schema::facts::amk_kw::control;
use shm_schema::inhibit::{MISSING_EDGES, Readback};
use shm_schema::io::Io;
use shm_schema::profile::Profile;
use shm_schema::report::Phase;
use shm_schema::word::Word;
use std::vec::Vec;

use crate::Monitor;
use crate::testing::{MS, NONCE, cell, codes, image, read_back};

const NEUTRAL: u32 = 0x0000_7E7F;

/// One path behind its evaluator.
#[derive(Clone, Copy, Default)]
struct Evaluator {
    edges: u64,
    missing: u8,
    counted: u64,
    on: bool,
}

impl Evaluator {
    fn cycle(&mut self, last: Option<&Outputs>) {
        let Some(last) = last else { return };
        let is_edge = last.inhibit.edges != self.edges;
        self.edges = last.inhibit.edges;
        self.counted += u64::from(is_edge);
        self.missing = if is_edge { 0 } else { self.missing.saturating_add(1) };
        self.on = last.inhibit.permit & (self.missing < MISSING_EDGES);
    }
}

/// Everything around the two monitors; index 0 plays A, 1 is B.
struct Bench {
    cycle: u64,
    monitors: [Monitor; 2],
    last: [Option<Outputs>; 2],
    published: [Option<(u64, Published)>; 2],
    paths: [Evaluator; 2],
    agreement: Agreement,
    agreed_at: u64,
    test: usize,
    sample: u64,
    overruns: [u8; 2],
    acknowledge: bool,
}

/// Test step: what is shown, what A and B must read.
const STEPS: [(PathTest, bool, bool); 6] = [
    (PathTest::None, false, false),
    (PathTest::RaiseA, true, false),
    (PathTest::None, false, false),
    (PathTest::RaiseB, false, true),
    (PathTest::None, false, false),
    (PathTest::Passed, true, true),
];

impl Bench {
    fn new(age_factor: u8) -> Self {
        let image = image(Profile::AmkKw, &[(67, 3000)]);
        let setup = Setup { age_factor, ..Setup::new(1, NONCE, Start::Cold) };
        let monitor = Monitor::new(&image, &setup);
        Self {
            cycle: 1,
            monitors: [monitor; 2],
            last: [None; 2],
            published: [None; 2],
            paths: [Evaluator::default(); 2],
            agreement: Agreement::default(),
            agreed_at: 0,
            test: 0,
            sample: 1,
            overruns: [0; 2],
            acknowledge: false,
        }
    }

    fn inputs(&self, place: usize) -> Inputs {
        let now = self.cycle * MS;
        let word = if self.acknowledge { NEUTRAL | 1 << control::ERROR_ACK } else { NEUTRAL };
        let command =
            Command { source: CommandSource::Plain, word: Word::from_u32(word), ..Command::default() };
        let lines = [u64::MAX; 4];
        let output_readback = read_back(self.last[place].as_ref());
        let io =
            Io { samples: self.cycle * 16, line_1: lines, line_2: lines, output_readback, ..Io::default() };
        let partner = self.last[1 - place].map(|last| last.report);
        let (own, other) = (self.paths[place], self.paths[1 - place]);
        let readback =
            Readback { path_a: other.on, path_b: own.on, edges_a: other.counted, edges_b: own.counted };
        Inputs {
            encoder: cell(self.sample, self.sample * MS, Encoder::default()),
            motion: Some(Motion { position: 0, speed_mrpm: 0, acceleration_mrpm_s: None }),
            io: cell(self.cycle, now, io),
            command: cell(self.cycle, now, command),
            partner: partner.map_or(Err(CellFault::Missing), |report| cell(report.exchange, now, report)),
            agreement: cell(self.agreed_at, now, self.seen_by(place)),
            readback: cell(self.cycle, now, readback),
            published: self.published[place].map(|(_, published)| published),
            overruns: self.overruns[place],
            image_sound: true,
        }
    }

    /// The monitor that plays A sees the world with the names of the paths exchanged.
    fn seen_by(&self, place: usize) -> Agreement {
        let path_test = match (place, self.agreement.path_test) {
            (0, PathTest::RaiseA) => PathTest::RaiseB,
            (0, PathTest::RaiseB) => PathTest::RaiseA,
            (_, same) => same,
        };
        let echo_b = if place == 0 { self.agreement.echo_a } else { self.agreement.echo_b };
        Agreement { path_test, echo_b, ..self.agreement }
    }

    /// One cycle; what is asleep does nothing, and a producer asleep gives no new sample.
    fn step(&mut self, asleep: [bool; 4]) {
        if !asleep[3] {
            self.sample = self.cycle;
        }
        for (path, last) in self.paths.iter_mut().zip(&self.last) {
            path.cycle(last.as_ref());
        }
        for (place, is_asleep) in (0..2).zip(asleep) {
            if is_asleep {
                self.overruns[place] = self.overruns[place].saturating_add(1);
                continue;
            }
            let inputs = self.inputs(place);
            let outputs = self.monitors[place].step(&inputs, self.cycle * MS);
            let published = Published { exchange: outputs.report.exchange, crc32: self.cycle as u32 };
            self.published[place] = Some((self.cycle, published));
            self.last[place] = Some(outputs);
            self.overruns[place] = 0;
        }
        if !asleep[2] {
            self.agree();
        }
        self.cycle += 1;
    }

    fn agree(&mut self) {
        let [Some(a), Some(b)] = self.last else { return };
        let phases = [a.report.phase, b.report.phase];
        if phases.contains(&Phase::Boot) {
            self.test = 0;
        }
        let (_, wants_a, wants_b) = STEPS[self.test];
        let has_begun = (self.test > 0) | (phases == [Phase::SelfTest; 2]);
        let reads = (self.paths[0].on, self.paths[1].on) == (wants_a, wants_b);
        if has_begun & reads & (self.test < 5) {
            self.test += 1;
        }
        let present = self.published.iter().flatten().all(|(at, _)| self.cycle - at < 3);
        let echo = |place: usize| {
            self.published[place].map_or(Echo::default(), |(_, own)| Echo {
                exchange: own.exchange,
                boot_nonce: NONCE,
                crc32: own.crc32,
            })
        };
        self.agreement = Agreement {
            permit: a.report.ready & b.report.ready & present & (self.test == 5),
            path_test: STEPS[self.test].0,
            echo_a: echo(0),
            echo_b: echo(1),
            ..Agreement::default()
        };
        self.agreed_at = self.cycle;
    }

    fn run(&mut self, cycles: u64) {
        for _ in 0..cycles {
            self.step([false; 4]);
        }
    }

    /// An acknowledge button pressed for 20 ms.
    fn press(&mut self) {
        self.acknowledge = true;
        self.run(20);
        self.acknowledge = false;
        self.run(20);
    }

    fn phases(&self) -> [Phase; 2] {
        self.last.map(|last| last.map_or(Phase::Boot, |last| last.report.phase))
    }

    fn drives(&self) -> bool {
        self.last.iter().flatten().filter(|last| last.inhibit.permit).count() == 2
    }
}

/// DEC-19, to the first torque.
#[test]
fn an_undisturbed_start_ends_with_torque_at_the_first_edge() {
    let mut bench = Bench::new(1);
    bench.run(180);
    assert_eq!(bench.phases(), [Phase::AwaitAcknowledge; 2]);
    assert!(!bench.drives());
    bench.press();
    assert!(bench.drives());
}

struct Random(u64);

impl Random {
    fn below(&mut self, most: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % most
    }
}

/// A host that lets each process sleep for 1 to 8 cycles at random instants for `cycles`.
fn stall(bench: &mut Bench, random: &mut Random, cycles: u64) {
    let mut until = [0_u64; 4];
    for _ in 0..cycles {
        for end in &mut until {
            let starts = random.below(40) == 0;
            *end = if starts { bench.cycle + 1 + random.below(8) } else { *end };
        }
        let asleep = until.map(|end| bench.cycle < end);
        bench.step(asleep);
        assert!(!bench.drives(), "no torque before the first edge");
    }
}

/// DEC-19, DEC-23, design 3.7: whatever slept in the start-up, the first edge after it gives
/// torque, and nothing needs a restart.
#[test]
fn stalls_of_some_cycles_in_the_start_up_need_no_restart() {
    for seed in 1..=300_u64 {
        let (mut bench, mut random) = (Bench::new(1), Random(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(seed)));
        let length = 1 + random.below(700);
        stall(&mut bench, &mut random, length);
        bench.run(600);
        assert_eq!(bench.phases(), [Phase::AwaitAcknowledge; 2], "seed {seed}");
        for last in bench.last.iter().flatten() {
            assert_eq!(codes(last), Vec::<[u32; 4]>::new(), "seed {seed}");
        }
        bench.press();
        assert!(bench.drives(), "seed {seed}");
    }
}

/// An edge that falls into a stall is seen by one side alone: the next one counts for both.
#[test]
fn an_edge_in_a_stall_costs_another_edge_and_no_restart() {
    for asleep in 0..2 {
        let mut bench = Bench::new(1);
        bench.run(200);
        bench.acknowledge = true;
        for cycle in 0..60 {
            bench.acknowledge = cycle < 2;
            let sleeps = core::array::from_fn(|place| (place == asleep) & (cycle < 4));
            bench.step(sleeps);
        }
        assert!(!bench.drives());
        bench.run(200);
        for _ in 0..3 {
            bench.press();
        }
        assert!(bench.drives(), "{asleep} {:?}", bench.phases());
    }
}

/// Architecture, "Timing": what stops the strict timing does not stop the relaxed one.
#[test]
fn a_stall_of_eight_cycles_under_torque_trips_the_strict_timing_only() {
    for (factor, trips) in [(1, true), (10, false)] {
        let mut bench = Bench::new(factor);
        bench.run(200);
        bench.press();
        assert!(bench.drives());
        for _ in 0..8 {
            bench.step([false, true, false, false]);
        }
        bench.run(20);
        assert_eq!(!bench.drives(), trips, "factor {factor}");
    }
}
