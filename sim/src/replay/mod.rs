//! `safepair replay`: a trace through the cores in virtual time (design 10).

mod line;
mod words;

pub use line::Line;
pub use words::{Bits, Words, code_text, control_bits, status_bits};

use std::{fmt, io};

use params::{AxisSet, Machine};
use shm_schema::exchange::{Motion, Start};

use crate::machine::{Axis, Cores, Lines, Options, Source, Stimulus, View, Wiring};
use crate::signals::FINE;
use crate::trace::{AxisTrace, CYCLE_NS, Cursor, Faults, Instant, Step, Trace};

/// Boot nonce of a replayed run: nothing may depend on it.
const BOOT_NONCE: u32 = 1;

/// The cores that replay drives.
type RealAxis = Axis<channel_a::Monitor, channel_b::Monitor, crosscheck::Crosscheck>;

/// What the command line adds to parameters and trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReplayOptions {
    /// Make raw encoder signals from the line and have them evaluated.
    pub encoder: bool,
    /// Begin at power-up.
    pub cold: bool,
    /// Call `write` for a change of the outputs as well, which the contract of the lines has not.
    pub outputs: bool,
}

/// Why a replay ended early.
#[derive(Debug)]
pub enum ReplayError {
    /// The trace names an axis that the parameter file does not have.
    Axis(u8),
    /// A line could not be written.
    Write(io::Error),
}

impl fmt::Display for ReplayError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axis(axis) => {
                write!(out, "the trace has rows of axis {axis}, expected axes of the parameter file")
            }
            Self::Write(error) => write!(out, "output: {error}"),
        }
    }
}

impl std::error::Error for ReplayError {}

/// How a replay went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    /// Cycles of the trace, the one at 0 included.
    pub cycles: u64,
    /// Falling edges of crosscheck's torque, all axes.
    pub trips: u64,
}

/// One axis of the replay.
struct Lane<'a> {
    number: u8,
    words: Words,
    cursor: Cursor<'a>,
    axis: RealAxis,
    seen: [Option<View>; 3],
    raw: bool,
    outputs: bool,
}

impl<'a> Lane<'a> {
    fn new(set: &AxisSet, trace: &'a AxisTrace, options: Options, outputs: bool) -> Self {
        let cores = Cores::of(set, BOOT_NONCE, options.start);
        Self {
            number: set.number,
            words: Words::of(set),
            cursor: Cursor::new(trace),
            axis: Axis::new(cores, &Wiring::of(set), options),
            seen: [None; 3],
            raw: options.raw_encoder,
            outputs,
        }
    }

    fn step(&mut self, at_ns: i64) {
        let instant = self.cursor.at(at_ns);
        let fine = if self.raw { Some(self.cursor.fine(at_ns, FINE)) } else { None };
        let stimulus = stimulus(&instant, fine, &self.words);
        let rows = self.cursor.between().rows();
        // A row at the time of the cycle is the newest sample's own; the first row stood for ever.
        if (at_ns == 0) | rows.iter().all(|(from_ns, _)| *from_ns == at_ns) {
            self.axis.step(&stimulus);
            return;
        }
        let level = |(from_ns, step): &(i64, Step)| ((at_ns - from_ns) as u64, lines(step));
        let between: Vec<_> = rows.iter().map(level).collect();
        self.axis.step_between(&stimulus, &between);
    }

    /// Calls `write` for each source that changed; returns whether torque fell.
    fn report(
        &mut self,
        at_ns: i64,
        write: &mut impl FnMut(&Line<'_>) -> io::Result<()>,
    ) -> io::Result<bool> {
        let mut fell = false;
        for ((source, view), seen) in Source::ALL.into_iter().zip(self.axis.views()).zip(&mut self.seen) {
            let same =
                |before: View| !(view.differs(&before) | self.outputs & (view.outputs != before.outputs));
            if seen.is_some_and(same) {
                continue;
            }
            let torque_fell = seen.is_some_and(|before| before.torque && !view.torque);
            fell |= torque_fell && (source == Source::Crosscheck);
            *seen = Some(*view);
            write(&Line { at_ns, axis: self.number, source, words: &self.words, view })?;
        }
        Ok(fell)
    }
}

fn lines(step: &Step) -> Lines {
    Lines { pairs: step.pairs, ais: step.ais, aie: step.aie }
}

fn stimulus(instant: &Instant, fine: Option<[i64; 2]>, words: &Words) -> Stimulus {
    let step = &instant.step;
    Stimulus {
        motion_a: instant.motion_a,
        motion_b: instant.motion_b,
        fine,
        torque_ppm: instant.torque_ppm,
        word: step.command.unwrap_or(words.neutral),
        lines: lines(step),
        clear_error: step.clear_error,
        drive_n0: step.drive_n0,
        drive_enabled: step.drive_enabled,
        faults: step.faults,
    }
}

/// Standstill with nothing requested: what an axis without a row of the trace does.
pub fn idle_stimulus(words: &Words) -> Stimulus {
    let still = Motion { position: 0, speed_mrpm: 0, acceleration_mrpm_s: None };
    Stimulus {
        motion_a: still,
        motion_b: still,
        fine: None,
        torque_ppm: 0,
        word: words.neutral,
        lines: Lines::default(),
        clear_error: false,
        drive_n0: false,
        drive_enabled: true,
        faults: Faults::NONE,
    }
}

/// Drives the cores of every axis of `machine` over `trace` and hands every line of output
/// to `write`; [`Line`] and [`Summary`] say how they look as JSON.
///
/// # Errors
/// [`ReplayError::Axis`] before anything is written; [`ReplayError::Write`] what `write` says.
pub fn replay(
    machine: &Machine,
    trace: &Trace,
    options: ReplayOptions,
    mut write: impl FnMut(&Line<'_>) -> io::Result<()>,
) -> Result<Summary, ReplayError> {
    let known = |number: &u8| machine.axes.iter().any(|set| set.number == *number);
    if let Some(axis) = trace.axes.keys().find(|number| !known(number)) {
        return Err(ReplayError::Axis(*axis));
    }
    let outputs = options.outputs;
    let options = Options {
        start: if options.cold { Start::Cold } else { Start::Settled },
        raw_encoder: options.encoder | trace.needs_raw_encoder(),
        ..Options::default()
    };
    let idle = AxisTrace::default();
    let lane = |set: &AxisSet| (set.number, trace.axes.get(&set.number));
    let mut lanes: Vec<_> = machine
        .axes
        .iter()
        .map(|set| Lane::new(set, lane(set).1.unwrap_or(&idle), options, outputs))
        .collect();
    let mut summary = Summary::default();
    for cycle in 0..=trace.last_cycle() {
        let at_ns = cycle as i64 * CYCLE_NS;
        for lane in &mut lanes {
            lane.step(at_ns);
            summary.trips += u64::from(lane.report(at_ns, &mut write).map_err(ReplayError::Write)?);
        }
        summary.cycles += 1;
    }
    Ok(summary)
}

/// The whole output of a replay as text, one JSON object a line, the last one the summary.
///
/// # Errors
/// As [`replay()`].
pub fn replay_to(
    machine: &Machine,
    trace: &Trace,
    options: ReplayOptions,
    out: &mut impl io::Write,
) -> Result<Summary, ReplayError> {
    let mut text = String::with_capacity(512);
    let summary = replay(machine, trace, options, |line| {
        text.clear();
        line.json(&mut text);
        text.push('\n');
        out.write_all(text.as_bytes())
    })?;
    text.clear();
    line::end_json(&mut text, trace.last_cycle(), &summary);
    text.push('\n');
    out.write_all(text.as_bytes()).map_err(ReplayError::Write)?;
    Ok(summary)
}

#[cfg(test)]
mod tests;
