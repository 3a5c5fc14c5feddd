//! One line of output.

use std::fmt::Write as _;

use super::{Summary, Words, code_text};
use crate::machine::{Source, View};
use crate::trace::decimal::round_quotient;

/// A change of one source.
#[derive(Debug, Clone, Copy)]
pub struct Line<'a> {
    /// Time, ns.
    pub at_ns: i64,
    /// Axis.
    pub axis: u8,
    /// Who changed.
    pub source: Source,
    /// How words and codes are written.
    pub words: &'a Words,
    /// What it shows now.
    pub view: &'a View,
}

impl Line<'_> {
    /// Appends the JSON object, fields in the order of the contract.
    pub fn json(&self, out: &mut String) {
        out.push_str("{\"t_ms\":");
        tenths(out, round_quotient(self.at_ns.into(), 100_000) as i64);
        write(
            out,
            format_args!(",\"axis\":{},\"source\":\"{}\",\"status\":\"", self.axis, self.source.name()),
        );
        self.words.write_status(out, &self.view.status);
        let View { torque, path, position, speed_mrpm, .. } = self.view;
        write(out, format_args!("\",\"torque\":{torque},\"path\":{path},\"errors\":["));
        self.errors(out);
        write(out, format_args!("],\"position\":{position},\"speed\":"));
        tenths(out, round_quotient((*speed_mrpm).into(), 100) as i64);
        out.push('}');
    }

    fn errors(&self, out: &mut String) {
        for (place, code) in self.view.errors.as_slice().iter().enumerate() {
            out.push_str(if place == 0 { "\"" } else { ",\"" });
            code_text(out, self.words.profile, code);
            out.push('"');
        }
    }
}

/// Appends the last line.
pub(super) fn end_json(out: &mut String, last_cycle: u64, summary: &Summary) {
    let Summary { cycles, trips } = summary;
    write(
        out,
        format_args!("{{\"t_ms\":{last_cycle}.0,\"source\":\"end\",\"cycles\":{cycles},\"trips\":{trips}}}"),
    );
}

/// A number of tenths with one decimal; no negative zero.
fn tenths(out: &mut String, value: i64) {
    let sign = if value < 0 { "-" } else { "" };
    let magnitude = value.unsigned_abs();
    write(out, format_args!("{sign}{}.{}", magnitude / 10, magnitude % 10));
}

fn write(out: &mut String, arguments: std::fmt::Arguments<'_>) {
    let result = out.write_fmt(arguments);
    // Writing into a string does not fail.
    debug_assert!(result.is_ok());
}
