//! What happens in a life, and when: made from a seed, so that it can be made again.

use params::AxisSet;
use shm_schema::word::Word;

use crate::control::Instruction;
use crate::random::Random;
use crate::replay::Words;
use crate::trace::{Fault, Faults};

/// Something that is done to the axis.
// A plan has some thousand of them, and lives as long as the run: nothing is gained by a box.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Act {
    /// The master or an input changes.
    Tell(Instruction),
    /// These faults act from now on.
    Inject(Faults),
}

/// An act and its time.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Cycle before which it is done.
    pub cycle: u64,
    /// What is done.
    pub act: Act,
}

/// A whole life.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Seed of everything random in it.
    pub seed: u64,
    /// Length in cycles.
    pub cycles: u64,
    /// Events in order of time.
    pub events: Vec<Event>,
}

/// Cycles between two events, at most.
const PAUSE_MAX: i64 = 800;
/// Cycles a fault acts, at most.
const FAULT_MAX: i64 = 40;
/// Highest set point, rpm.
const SPEED_MAX: i64 = 4_000;

impl Plan {
    /// A life of `cycles` from `seed`; one event in `faults` is a fault, 0 is none.
    pub fn random(set: &AxisSet, seed: u64, cycles: u64, faults: i64) -> Self {
        let mut random = Random::new(seed);
        let requests = requests(&Words::of(set).neutral);
        let mut plan = Self { seed, cycles, events: Vec::new() };
        let mut cycle = 0;
        while cycle < cycles {
            cycle += random.between(1, PAUSE_MAX) as u64;
            let faulty = (faults > 0) && random.once_in(faults);
            if faulty {
                cycle = plan.fault(&mut random, cycle);
            } else {
                plan.events.push(Event { cycle, act: Act::Tell(instruction(&mut random, &requests)) });
            }
        }
        plan
    }

    fn fault(&mut self, random: &mut Random, cycle: u64) -> u64 {
        // Raw signals take part from the first cycle or not at all.
        let raw = [Fault::FreezeEncoder1, Fault::FreezeEncoder2];
        let choices: Vec<_> = Fault::ALL.into_iter().filter(|fault| !raw.contains(fault)).collect();
        let faults = Faults::NONE.with(random.pick(&choices));
        self.events.push(Event { cycle, act: Act::Inject(faults) });
        let end = cycle + random.between(1, FAULT_MAX) as u64;
        self.events.push(Event { cycle: end, act: Act::Inject(Faults::NONE) });
        end
    }
}

/// Bits that are 1 while nothing is requested.
fn requests(neutral: &Word) -> Vec<u8> {
    (0..=u8::MAX).filter(|bit| neutral.bit(*bit)).collect()
}

fn instruction(random: &mut Random, requests: &[u8]) -> Instruction {
    let blank = Instruction::default();
    match random.between(0, 9) {
        0..=2 => Instruction { set_point_rpm: Some(random.between(-SPEED_MAX, SPEED_MAX) as f64), ..blank },
        3 => Instruction { ramp_rpm_s: Some(random.between(100, 20_000) as f64), ..blank },
        4 => Instruction { clear: bit(random, requests), ..blank },
        5 | 6 => Instruction { set: requests.to_vec(), ..blank },
        7 => Instruction {
            acknowledge: true,
            set_point_rpm: Some(random.between(0, SPEED_MAX) as f64),
            ..blank
        },
        8 => Instruction { set: bit(random, requests), clear: bit(random, requests), ..blank },
        _ => input(random),
    }
}

fn bit(random: &mut Random, requests: &[u8]) -> Vec<u8> {
    if requests.is_empty() { Vec::new() } else { vec![random.pick(requests)] }
}

fn input(random: &mut Random) -> Instruction {
    let (name, level) = random.pick(&[
        ("se1", "00"),
        ("se1", "11"),
        ("se2", "00"),
        ("se2", "11"),
        ("ais", "1"),
        ("ais", "0"),
    ]);
    let inputs = [(name.to_owned(), level.to_owned())].into_iter().collect();
    Instruction { inputs, ..Instruction::default() }
}
