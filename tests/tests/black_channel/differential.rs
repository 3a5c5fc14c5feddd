//! The same events to both channels: answers, outputs and digests must be equal, octet for
//! octet. Events are valid, nearly valid, and garbage; a finding prints as a script that
//! `safepair black-channel answer` takes.

use std::{collections::BTreeSet, fmt::Write as _};

use sim::{
    master::{
        fsoe::{self, command, frame},
        profisafe::{self, control, status},
    },
    random::Random,
};

use crate::{
    bench::MS,
    device::{Device, Shape, Shown, Source},
};

/// Sequences of the short and the long form, for each shape; events of each.
const SHORT: u64 = 400;
const LONG: u64 = 4_000;
const EVENTS: usize = 250;

/// What sequences have led to: commands and Reset codes of FSoE, status octets of PROFIsafe.
type Reached = BTreeSet<(&'static str, u8)>;

/// Both devices, what they were given, and what they said.
struct Pair {
    device: Device,
    shape: Shape,
    now_ns: u64,
    script: String,
    reached: Reached,
}

impl Pair {
    fn new(shape: Shape) -> Self {
        let device = Device::new(&shape, Source::A);
        Self { device, shape, now_ns: 0, script: String::new(), reached: Reached::new() }
    }

    fn equal(&mut self, (a, b): (Shown, Shown)) -> Result<Option<Vec<u8>>, String> {
        if let Ok(Some(answer)) = &a.answer {
            self.reached.insert(match (&self.shape, answer[0]) {
                (Shape::Profisafe { inputs, .. }, _) => ("status", answer[usize::from(*inputs)]),
                (Shape::Fsoe { .. }, command::RESET) => ("reset", answer[1]),
                (Shape::Fsoe { .. }, other) => ("command", other),
            });
        }
        // Before the first answer there is no frame processed that a digest could be about.
        let same_digest = a.digest == b.digest || self.reached.is_empty();
        if same_digest && a.answer == b.answer && a.outputs == b.outputs {
            return Ok(a.answer.unwrap_or_default());
        }
        let lines: Vec<&str> = self.script.lines().collect();
        let tail = lines[lines.len().saturating_sub(14)..].join("\n");
        Err(format!("{:?}\n…\n{tail}\nA {a:02X?}\nB {b:02X?}", self.shape))
    }

    fn receive(
        &mut self,
        image: &[u8],
        inputs: Option<&[u8]>,
        what: &str,
    ) -> Result<Option<Vec<u8>>, String> {
        let hexadecimal: String = image.iter().fold(String::new(), |mut text, octet| {
            let _ = write!(text, "{octet:02X}");
            text
        });
        let _ = writeln!(self.script, "{hexadecimal}   # {what}, inputs {inputs:02X?}");
        let shown = self.device.receive_both(image, inputs, self.now_ns);
        let answer = self.equal(shown)?;
        let _ = writeln!(self.script, "    -> {answer:02X?}");
        Ok(answer)
    }

    fn advance(&mut self, by_ns: u64) -> Result<Option<Vec<u8>>, String> {
        self.now_ns += by_ns;
        let _ = writeln!(self.script, "+{by_ns} ns");
        let shown = self.device.advance_both(self.now_ns);
        self.equal(shown)
    }
}

/// Octets without meaning.
fn garbage(random: &mut Random, length: usize) -> Vec<u8> {
    (0..length).map(|_| random.next() as u8).collect()
}

fn flipped(random: &mut Random, image: &[u8]) -> Vec<u8> {
    let mut image = image.to_vec();
    let bit = random.between(0, image.len() as i64 * 8 - 1) as usize;
    image[bit / 8] ^= 1 << (bit % 8);
    image
}

/// A step of time: mostly a bus cycle, sometimes around the watchdog.
fn step_ns(random: &mut Random, watchdog_ms: u64) -> u64 {
    match random.between(0, 19) {
        0 => watchdog_ms * MS,
        1 => (watchdog_ms * MS).saturating_sub(1),
        2 => watchdog_ms * MS / 2,
        3 => 0,
        4 => random.between(0, 3 * (watchdog_ms * MS) as i64) as u64,
        _ => MS,
    }
}

/// A configuration like `config` with something a slave must refuse, or not.
fn fsoe_variant(random: &mut Random, config: &fsoe::Config) -> fsoe::Config {
    let mut variant = config.clone();
    variant.session_id = random.next() as u16;
    match random.between(0, 11) {
        0 => variant.address ^= 1,
        1 => {
            let declared = config.application_parameters.len() as u16;
            let fields = [2, 0, declared].map(u16::to_le_bytes).concat();
            variant.parameter_payload = Some([fields, config.application_parameters.clone()].concat());
        }
        2 => variant.application_parameters.push(1),
        3 => variant.application_parameters = garbage(random, config.application_parameters.len()),
        4 => variant.connection_id = 0,
        5 => {
            let length = random.between(1, 3 + config.application_parameters.len() as i64) as u16;
            let declared = config.application_parameters.len() as u16;
            let fields = [length, config.watchdog_ms, declared].map(u16::to_le_bytes).concat();
            variant.parameter_payload = Some([fields, config.application_parameters.clone()].concat());
        }
        6 => {
            let mut payload =
                [2, config.watchdog_ms, random.between(0, 9) as u16].map(u16::to_le_bytes).concat();
            payload.extend(&config.application_parameters);
            variant.parameter_payload = Some(payload);
        }
        7 => variant.connection_id = random.next() as u16,
        _ => {}
    }
    variant
}

/// One random event of FSoE. The master goes on with the answer it gets.
fn fsoe_event(
    random: &mut Random,
    pair: &mut Pair,
    master: &mut fsoe::Master,
    past: &mut Vec<Vec<u8>>,
    rarity: i64,
) -> Result<(), String> {
    let config = master.config().clone();
    let data = garbage(random, config.outputs);
    let inputs = garbage(random, config.inputs);
    let inputs = (!random.once_in(4)).then_some(&inputs[..]);
    master.set_outputs((!random.once_in(5)).then_some(&data[..]));
    let (image, what) = match random.between(0, rarity) {
        0 => (flipped(random, master.to_send()), "one bit flipped"),
        1 => {
            let other = if random.once_in(2) { random.next() as u8 } else { random.pick(&command::ALL) };
            (master.forge(other, &data, master.connection_field()), "another command, in chain")
        }
        2 => {
            let id = random.pick(&[0, config.connection_id, config.connection_id ^ 0x100]);
            let command = master.to_send()[0];
            let data = frame::Frame::parse(master.to_send(), config.outputs).expect("its own").data;
            (master.forge(command, &data, id), "another connection id, in chain")
        }
        3 => {
            let any = random.pick(&command::ALL);
            let implicit =
                frame::Implicit { inherited: random.next() as u16, number: random.between(1, 9) as u16 };
            (frame::Frame::build(any, &data, config.connection_id, implicit).octets(), "another chain")
        }
        4 => (frame::reset(random.between(0, 12) as u8, config.outputs).octets(), "a reset"),
        5 => {
            let command = random.pick(&command::ALL);
            (frame::Frame::build(command, &data, 0, frame::FRESH).octets(), "a fresh frame")
        }
        6 => (garbage(random, frame::length(config.outputs)), "garbage"),
        7 => {
            let mut octets = garbage(random, frame::length(config.outputs));
            octets[0] = random.pick(&[0, 0x2A, 0x4E, 0x64, 0x52, 0x36, 0x08]);
            (octets, "garbage with a command")
        }
        8 => (past.get(random.between(0, 30) as usize).cloned().unwrap_or_default(), "an old frame"),
        9 => {
            let length = random.between(0, 300) as usize;
            (garbage(random, length), "any length")
        }
        10 => (vec![0; frame::length(config.outputs)], "all zeros"),
        11 => {
            let mut octets = master.to_send().to_vec();
            octets[0] = random.next() as u8;
            (octets, "another command, out of chain")
        }
        _ => (master.to_send().to_vec(), "right"),
    };
    past.insert(0, image.clone());
    past.truncate(40);
    if let Some(answer) = pair.receive(&image, inputs, what)? {
        master.receive(&answer, pair.now_ns);
    }
    if random.once_in(6) {
        let by = step_ns(random, config.watchdog_ms.into());
        let late = pair.advance(by)?;
        if let Some(answer) = late {
            master.receive(&answer, pair.now_ns);
        }
    } else if random.once_in(30) {
        // Time that passes without being announced: the next frame is late.
        pair.now_ns += step_ns(random, config.watchdog_ms.into());
    }
    master.advance(pair.now_ns);
    Ok(())
}

fn fsoe_sequence(seed: u64, outputs: usize, inputs: usize, parameters: usize) -> Result<Reached, String> {
    let random = &mut Random::new(seed);
    let config = fsoe::Config {
        application_parameters: garbage(random, parameters),
        watchdog_ms: random.pick(&[1, 20, 100]),
        ..fsoe::Config::new(outputs, inputs, 3)
    };
    let mut pair = Pair::new(Shape::of_fsoe(&config));
    let mut master = fsoe::Master::new(config.clone());
    let mut past = Vec::new();
    // Some sequences go deep, some are wild.
    let rarity = random.pick(&[30, 100, 800]);
    for event in 0..EVENTS {
        if random.once_in(60) {
            master = fsoe::Master::new(fsoe_variant(random, &config));
        }
        fsoe_event(random, &mut pair, &mut master, &mut past, rarity)
            .map_err(|finding| format!("seed {seed}, event {event}: {finding}"))?;
    }
    Ok(pair.reached)
}

/// One random event of PROFIsafe. The host goes on with the answer it gets.
fn profisafe_event(
    random: &mut Random,
    pair: &mut Pair,
    host: &mut profisafe::Host,
    past: &mut Vec<Vec<u8>>,
    (outputs, inputs): (usize, usize),
    rarity: i64,
) -> Result<(), String> {
    let data = garbage(random, outputs);
    let inputs = garbage(random, inputs);
    let inputs = (!random.once_in(4)).then_some(&inputs[..]);
    host.set_outputs(&data);
    host.set_activate_fv(random.once_in(8));
    let wanted = host.wants_acknowledge() && random.once_in(2);
    host.set_acknowledge(wanted);
    let (number, octet) = (host.number(), host.control());
    let (image, what) = match random.between(0, rarity) {
        0 => (flipped(random, host.to_send()), "one bit flipped"),
        1 => (host.forge(&data, octet, number), "the same number, other data"),
        2 => (host.forge(&data, octet ^ control::TOGGLE, number), "the other toggle"),
        3 => (host.forge(&data, random.next() as u8, number), "any control octet"),
        4 => (host.forge(&data, octet ^ control::R_CONS_NR, 0), "number restart, number 0"),
        5 => (host.forge(&data, octet | control::R_CONS_NR, number), "number restart, number kept"),
        6 => (host.forge(&data, octet, number.wrapping_add(1)), "one number ahead"),
        7 => (host.forge(&data, octet, number.saturating_sub(1)), "one number behind"),
        8 => (host.forge(&data, octet ^ control::TOGGLE, number.saturating_sub(1)), "the telegram before"),
        9 => (garbage(random, outputs + 4), "garbage"),
        10 => (past.get(random.between(0, 30) as usize).cloned().unwrap_or_default(), "an old telegram"),
        11 => {
            let length = random.between(0, 24) as usize;
            (garbage(random, length), "any length")
        }
        12 => (vec![0; outputs + 4], "all zeros"),
        13 => (host.forge(&data, random.next() as u8, 0), "any control octet, number 0"),
        14 => (host.forge(&data, octet ^ control::ACTIVATE_FV, number), "the other activate_FV"),
        _ => (host.to_send().to_vec(), "right"),
    };
    past.insert(0, image.clone());
    past.truncate(40);
    if let Some(answer) = pair.receive(&image, inputs, what)? {
        host.receive(&answer, pair.now_ns);
    }
    if random.once_in(6) {
        let by = step_ns(random, 100);
        let late = pair.advance(by)?;
        if let Some(answer) = late {
            host.receive(&answer, pair.now_ns);
        }
    } else if random.once_in(30) {
        pair.now_ns += step_ns(random, 100);
    }
    host.advance(pair.now_ns);
    Ok(())
}

fn profisafe_sequence(seed: u64, outputs: usize, inputs: usize) -> Result<Reached, String> {
    let random = &mut Random::new(seed);
    let parameters = profisafe::Parameters::new(7, 100);
    let config = profisafe::Config { outputs, inputs, parameters };
    let mut pair = Pair::new(Shape::of_profisafe(&config));
    let mut host = profisafe::Host::new(config);
    let mut past = Vec::new();
    // Some sequences go deep, some are wild.
    let rarity = random.pick(&[30, 100, 800]);
    for event in 0..EVENTS {
        if random.once_in(100) {
            host = profisafe::Host::new(config);
        }
        profisafe_event(random, &mut pair, &mut host, &mut past, (outputs, inputs), rarity)
            .map_err(|finding| format!("seed {seed}, event {event}: {finding}"))?;
    }
    Ok(pair.reached)
}

/// Fails with the first findings and how many there are; returns what was reached.
fn alike(results: impl Iterator<Item = Result<Reached, String>>) -> Reached {
    let (mut reached, mut findings) = (Reached::new(), Vec::new());
    for result in results {
        match result {
            Ok(more) => reached.extend(more),
            Err(finding) => findings.push(finding),
        }
    }
    let shown = findings.iter().take(6).cloned().collect::<Vec<_>>().join("\n\n");
    assert!(findings.is_empty(), "{} sequences differ\n{shown}", findings.len());
    reached
}

/// Every answer a slave has is among those compared.
fn fsoe_shapes(sequences: u64) {
    let shapes =
        [(1, 1, 0), (2, 2, 0), (4, 12, 0), (8, 12, 4), (1, 6, 3), (12, 2, 5), (126, 126, 8), (6, 8, 0)];
    let run = |(outputs, inputs, parameters)| {
        (0..sequences).map(move |seed| fsoe_sequence(seed, outputs, inputs, parameters))
    };
    let reached = alike(shapes.into_iter().flat_map(run));
    for code in [0, 1, 2, 3, 4, 5, 6, 8, 9, 10, 11] {
        assert!(reached.contains(&("reset", code)), "no Reset({code}) was compared");
    }
    for command in command::ALL.into_iter().filter(|command| *command != command::RESET) {
        assert!(reached.contains(&("command", command)), "no answer {command:02X} was compared");
    }
}

/// Every status bit but iPar_OK and Device_Fault is among those compared.
fn profisafe_shapes(sequences: u64) {
    let run = |(outputs, inputs)| (0..sequences).map(move |seed| profisafe_sequence(seed, outputs, inputs));
    let reached = alike([(4, 4), (2, 2), (1, 12)].into_iter().flat_map(run));
    for bit in [status::CE_CRC, status::WD_TIMEOUT, status::FV_ACTIVATED, status::TOGGLE, status::CONS_NR_R] {
        assert!(reached.iter().any(|(_, octet)| octet & bit != 0), "status bit {bit:02X} was never set");
    }
    assert!(reached.contains(&("status", 0)), "no process values were compared");
}

#[test]
fn both_channels_answer_fsoe_alike() {
    fsoe_shapes(SHORT);
}

#[test]
fn both_channels_answer_profisafe_alike() {
    profisafe_shapes(SHORT);
}

#[test]
#[ignore = "takes minutes; part of the long run"]
fn both_channels_answer_millions_of_fsoe_events_alike() {
    fsoe_shapes(LONG);
}

#[test]
#[ignore = "takes minutes; part of the long run"]
fn both_channels_answer_millions_of_profisafe_events_alike() {
    profisafe_shapes(LONG);
}
