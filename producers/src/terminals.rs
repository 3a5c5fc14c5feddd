//! The lines of a GPIO chip as the terminals of one axis.
//!
//! Inputs come as edge events with the kernel's time stamps (CLOCK_MONOTONIC); outputs are
//! driven as the channels ask (`Inhibit::outputs`) and read back from the same line.

use gpiocdev::Request;
use gpiocdev::line::{EdgeDetection, EdgeEvent, EdgeKind, Offset, Value, Values};
use shm_schema::inhibit::Inhibit;
use shm_schema::io::{Io, SAMPLE_NS};

use crate::clock::{now_ns, sleep_until};
use crate::pattern::{Sampler, changes};

/// Everything an `io` cell carries: both lines of four pairs, AIS, AIE, and six readbacks.
pub const TERMINALS: usize = 16;
/// Safe outputs: the last of the terminals.
const OUTPUTS: usize = 6;
/// Events taken from the kernel with one read.
const EVENTS: usize = 16;
/// Where the outputs begin among the terminals.
const FIRST_OUTPUT: usize = TERMINALS - OUTPUTS;

/// Names of the terminals as options write them, in the order of the sampler's lines.
pub const NAMES: [&str; TERMINALS] = [
    "se1.1", "se2.1", "se3.1", "se4.1", "se1.2", "se2.2", "se3.2", "se4.2", "ais", "aie", "sa1.1", "sa1.2",
    "sa2.1", "sa2.2", "sdyn1", "sdyn2",
];

/// For each output the channel that drives it and the place in its `Inhibit::outputs`: A drives
/// SA1.1, SA2.1 and SDYN1, B the others.
const OWNERS: [(usize, usize); OUTPUTS] = [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2)];

/// A terminal and its line of the chip.
pub type Wire = (usize, Offset);

/// Reads `NAME=LINE`.
///
/// # Errors
/// One line: what was found, what is expected.
pub fn wire(text: &str) -> Result<Wire, String> {
    let wrong = || format!("{text}: expected NAME=LINE, NAME one of {}", NAMES.join(", "));
    let (name, line) = text.split_once('=').ok_or_else(wrong)?;
    let terminal = NAMES.iter().position(|known| *known == name).ok_or_else(wrong)?;
    Ok((terminal, line.parse().map_err(|_| wrong())?))
}

/// The lines of one axis, held.
#[derive(Debug)]
pub struct Terminals {
    inputs: Option<Request>,
    outputs: Option<Request>,
    /// Events as the kernel gives them out.
    events: Vec<u64>,
    wires: Vec<Wire>,
    sampler: Sampler<TERMINALS>,
    /// Newest event of each line.
    sequences: [u32; TERMINALS],
    /// Looks in a row at which a line was not what its edges say.
    disagreed: [u8; TERMINALS],
    driven: u32,
}

impl Terminals {
    /// Takes the lines of `chip`: outputs low, inputs with both edges.
    ///
    /// # Errors
    /// Which lines could not be had.
    pub fn open(chip: &str, wires: &[Wire]) -> Result<Self, String> {
        let lines = |output: bool| -> Vec<Offset> {
            let of = wires.iter().filter(|(terminal, _)| (*terminal >= FIRST_OUTPUT) == output);
            of.map(|(_, line)| *line).collect()
        };
        let failed = |error: gpiocdev::Error| format!("{chip}: {error}");
        let (ins, outs) = (lines(false), lines(true));
        let take = |lines: &[Offset], output: bool| -> Result<Option<Request>, String> {
            if lines.is_empty() {
                return Ok(None);
            }
            let mut builder = Request::builder();
            builder.on_chip(chip).with_consumer("safepair-producer").with_lines(lines);
            if output {
                builder.as_output(Value::Inactive);
            } else {
                builder.as_input().with_edge_detection(EdgeDetection::BothEdges);
            }
            builder.request().map(Some).map_err(failed)
        };
        let inputs = take(&ins, false)?;
        let event = inputs.as_ref().map_or(0, Request::edge_event_u64_size);
        let mut terminals = Self {
            inputs,
            outputs: take(&outs, true)?,
            events: vec![0; EVENTS * event],
            wires: wires.to_vec(),
            sampler: Sampler::new(now_ns()),
            sequences: [0; TERMINALS],
            disagreed: [0; TERMINALS],
            driven: 0,
        };
        // Every line is believed only after a whole pattern.
        terminals.doubt_all();
        Ok(terminals)
    }

    /// Everything that happened up to now, as a payload.
    pub fn look(&mut self) -> Io {
        // The clock first: an edge that comes while the queue is read belongs to the next look.
        let now_ns = now_ns();
        self.drain();
        self.compare();
        self.sampler.advance(now_ns);
        payload(&self.sampler)
    }

    /// Drives the outputs of the cycle that begins at `start_ns`, from what both channels ask
    /// (`None`: unreadable or stale, so low), and reads them back.
    pub fn drive(&mut self, start_ns: u64, samples: u32, asked: [Option<Inhibit>; 2]) {
        if self.outputs.is_none() {
            return;
        }
        for (sample, levels) in changes(patterns(asked), samples) {
            sleep_until(start_ns.saturating_add(u64::from(sample) * SAMPLE_NS));
            self.set(levels);
        }
    }

    /// Everything the kernel has queued. Not with `read_edge_event`: where gpiocdev is built for one
    /// version of the ABI, that call takes up to eight events from the kernel and returns the first.
    fn drain(&mut self) {
        let Some(request) = &self.inputs else { return };
        while let Ok(true) = request.has_edge_event() {
            let Ok(length) = request.read_edge_events_into_slice(&mut self.events) else {
                self.doubt_all();
                return;
            };
            let events = self.events.get(..length).unwrap_or_default();
            for event in events.chunks_exact(request.edge_event_u64_size()) {
                // One that cannot be read leaves a gap in the numbers of its line.
                let Ok(event) = request.edge_event_from_slice(event) else { continue };
                follow(&event, &self.wires, &mut self.sampler, &mut self.sequences);
            }
        }
    }

    /// A line that is twice in a row not what its edges say has lost one.
    fn compare(&mut self) {
        let Some(levels) = self.levels() else {
            self.doubt_all();
            return;
        };
        for (terminal, level) in levels {
            let rows = self.sampler.lines.get_mut(terminal).zip(self.disagreed.get_mut(terminal));
            let Some((line, disagreed)) = rows else { continue };
            *disagreed = if line.newest() == level { 0 } else { disagreed.saturating_add(1) };
            if *disagreed > 1 {
                line.doubt(level);
                *disagreed = 0;
            }
        }
    }

    fn doubt_all(&mut self) {
        let levels = self.levels().unwrap_or_default();
        for (place, line) in self.sampler.lines.iter_mut().enumerate().take(FIRST_OUTPUT) {
            let level = levels.iter().any(|(terminal, level)| (*terminal == place) & *level);
            line.doubt(level);
        }
    }

    /// Levels of the wired inputs as they are now.
    fn levels(&self) -> Option<Vec<(usize, bool)>> {
        let Some(request) = &self.inputs else { return Some(Vec::new()) };
        let inputs = self.wires.iter().filter(|(terminal, _)| *terminal < FIRST_OUTPUT);
        let mut values = Values::from_offsets(&inputs.clone().map(|(_, line)| *line).collect::<Vec<_>>());
        request.values(&mut values).ok()?;
        Some(inputs.map(|(terminal, line)| (*terminal, values.get(*line) == Some(Value::Active))).collect())
    }

    fn set(&mut self, levels: u32) {
        let Some(request) = &self.outputs else { return };
        let outputs = self.wires.iter().filter(|(terminal, _)| *terminal >= FIRST_OUTPUT);
        let mut values = Values::default();
        for (terminal, line) in outputs.clone() {
            let high = levels >> (terminal - FIRST_OUTPUT) & 1 == 1;
            values.set(*line, if high { Value::Active } else { Value::Inactive });
        }
        if levels != self.driven {
            // A line that cannot be set is seen in its readback.
            let _ = request.set_values(&values);
            self.driven = levels;
        }
        let read = request.values(&mut values).is_ok();
        let at_ns = now_ns();
        for (terminal, line) in outputs {
            let high = read & (values.get(*line) == Some(Value::Active));
            if let Some(line) = self.sampler.lines.get_mut(*terminal).filter(|line| line.newest() != high) {
                line.change(at_ns, high);
            }
        }
    }
}

/// Tells the sampler of one event.
fn follow(
    event: &EdgeEvent,
    wires: &[Wire],
    sampler: &mut Sampler<TERMINALS>,
    sequences: &mut [u32; TERMINALS],
) {
    let wired = |(terminal, line): &&Wire| {
        let input = *terminal < FIRST_OUTPUT;
        input & (*line == event.offset)
    };
    let Some((terminal, _)) = wires.iter().find(wired) else { return };
    let rows = sampler.lines.get_mut(*terminal).zip(sequences.get_mut(*terminal));
    let Some((line, sequence)) = rows else { return };
    let rising = event.kind == EdgeKind::Rising;
    // The kernel numbers the events of a line from 1: a gap is an edge lost. (The number
    // over all lines is no help: threaded interrupts overtake each other.)
    let lost = event.line_seqno != sequence.wrapping_add(1);
    *sequence = event.line_seqno;
    if lost {
        line.doubt(rising);
    } else {
        line.change(event.timestamp_ns, rising);
    }
}

/// The outputs that both channels ask for, in the order of the terminals.
fn patterns(asked: [Option<Inhibit>; 2]) -> [u64; OUTPUTS] {
    OWNERS.map(|(channel, place)| {
        let inhibit = asked.get(channel).and_then(Option::as_ref);
        inhibit.and_then(|inhibit| inhibit.outputs.get(place)).copied().unwrap_or(0)
    })
}

fn payload(sampler: &Sampler<TERMINALS>) -> Io {
    let mut patterns = sampler.lines.iter().map(crate::pattern::Line::pattern);
    let mut next = || patterns.next().unwrap_or(0);
    Io {
        samples: sampler.samples(),
        line_1: std::array::from_fn(|_| next()),
        line_2: std::array::from_fn(|_| next()),
        ais: next(),
        aie: next(),
        output_readback: std::array::from_fn(|_| next()),
        dynamic_readback: std::array::from_fn(|_| next()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_are_named_as_the_documents_name_them() {
        assert_eq!(wire("se1.2=5"), Ok((4, 5)));
        assert_eq!(wire("aie=0"), Ok((9, 0)));
        for wrong in ["se5.1=1", "se1.1", "ais=x"] {
            assert!(wire(wrong).expect_err("refused").starts_with(wrong), "{wrong}");
        }
    }

    #[test]
    fn every_terminal_reaches_its_place_in_the_cell() {
        let mut sampler = Sampler::<TERMINALS>::new(1_000_000_000);
        // Terminal n is high from sample n on, so that each pattern is another one.
        for (terminal, line) in sampler.lines.iter_mut().enumerate() {
            line.change(1_000_000_000 + terminal as u64 * SAMPLE_NS, true);
        }
        sampler.advance(1_000_000_000 + 40 * SAMPLE_NS);
        let io = payload(&sampler);
        let all = io.line_1.iter().chain(&io.line_2).chain([&io.ais, &io.aie]);
        let all = all.chain(&io.output_readback).chain(&io.dynamic_readback);
        let highs: Vec<u32> = all.map(|pattern| pattern.count_ones()).collect();
        assert_eq!(highs, (0..16).map(|terminal| 37 - terminal).collect::<Vec<_>>());
    }

    /// DEC-18: what the kernel counted and nobody saw may have been a request.
    #[test]
    fn a_gap_in_the_numbers_of_a_line_makes_it_read_low_for_a_whole_pattern() {
        let mut sampler = Sampler::<TERMINALS>::new(1_000_000_000);
        let mut sequences = [0; TERMINALS];
        let mut edge = |line_seqno: u32, sampler: &mut Sampler<TERMINALS>| {
            let event = EdgeEvent {
                timestamp_ns: 1_000_000_000,
                kind: EdgeKind::Rising,
                offset: 7,
                seqno: 0,
                line_seqno,
            };
            follow(&event, &[(4, 7)], sampler, &mut sequences);
        };
        edge(1, &mut sampler);
        sampler.advance(1_000_000_000 + 64 * SAMPLE_NS);
        let known = payload(&sampler).line_2[0].count_ones();
        edge(3, &mut sampler);
        sampler.advance(1_000_000_000 + 128 * SAMPLE_NS);
        assert_eq!((known, payload(&sampler).line_2[0]), (61, 0));
    }

    /// DEC-36, AMK-DYN-09: A drives the lines .1 and SDYN1, B the lines .2 and SDYN2.
    #[test]
    fn each_channel_drives_its_own_outputs_and_a_missing_one_is_low() {
        let asks = |outputs| Some(Inhibit { outputs, ..Inhibit::default() });
        assert_eq!(patterns([asks([1, 2, 3]), asks([4, 5, 6])]), [1, 4, 2, 5, 3, 6]);
        assert_eq!(patterns([None, asks([4, 5, 6])]), [0, 4, 0, 5, 0, 6]);
    }
}
