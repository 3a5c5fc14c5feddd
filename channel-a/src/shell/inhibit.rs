//! The own inhibit path as a line: nothing for the simulated one, a toggled output of a
//! GPIO chip otherwise. The evaluator behind it drops the path after three missing edges
//! (design 3.4); that is an assumption of use, stated with `--evaluator`.

use gpiocdev::Request;
use gpiocdev::line::Value;
use shm_schema::inhibit::Inhibit;

use super::options::{InhibitOption, Options};

/// A path.
pub enum Line {
    /// The cell alone is the path.
    Sim,
    /// A toggled line.
    Gpio {
        /// The line, held as output.
        request: Request,
        /// Offset of the line.
        offset: u32,
        /// Level and edges last driven.
        level: bool,
        /// Edges last driven.
        edges: u64,
    },
}

/// One path for each axis, off.
///
/// # Errors
/// Which line could not be had.
pub fn open(options: &Options) -> Result<Vec<Line>, String> {
    match &options.inhibit {
        InhibitOption::Sim => Ok(options.axes.iter().map(|_| Line::Sim).collect()),
        InhibitOption::Gpio { chip, line } => {
            let request = Request::builder()
                .on_chip(chip)
                .with_consumer("safepair-channel-a")
                .with_line(*line)
                .as_output(Value::Inactive)
                .request()
                .map_err(|error| format!("{} line {line}: {error}", chip.display()))?;
            Ok(vec![Line::Gpio { request, offset: *line, level: false, edges: 0 }])
        }
    }
}

impl Line {
    /// Drives what the core decided; one edge for each refresh.
    pub fn drive(&mut self, wish: &Inhibit) {
        let Self::Gpio { request, offset, level, edges } = self else { return };
        let refreshed = wish.edges != *edges;
        let toggled = if refreshed { !*level } else { *level };
        let next = wish.permit && toggled;
        *edges = wish.edges;
        if next != *level {
            *level = next;
            // A line that cannot be set has no edges: the evaluator drops the path.
            let _ = request.set_value(*offset, if next { Value::Active } else { Value::Inactive });
        }
    }

    /// Off, whatever was before.
    pub fn off(&mut self) {
        if let Self::Gpio { request, offset, level, .. } = self {
            *level = false;
            let _ = request.set_value(*offset, Value::Inactive);
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.off();
    }
}
