//! A movement with its commands, written as a trace.

use std::{collections::BTreeMap, fmt::Write as _};

/// Columns by time; what a row leaves empty holds, or lies on the line between its neighbours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Course {
    /// Microseconds, so that rows have an order.
    rows: BTreeMap<u64, BTreeMap<&'static str, String>>,
}

impl Course {
    /// A value of a column from `ms` on.
    pub fn set(&mut self, ms: f64, column: &'static str, value: impl ToString) -> &mut Self {
        self.rows
            .entry((ms.max(0.0) * 1_000.0).round() as u64)
            .or_default()
            .insert(column, value.to_string());
        self
    }

    /// Speed at `ms`, 1/min; straight lines in between.
    pub fn speed(&mut self, ms: f64, rpm: f64) -> &mut Self {
        self.set(ms, "speed_rpm", format!("{rpm:.6}"))
    }

    /// Control word from `ms` on.
    pub fn command(&mut self, ms: f64, word: u64) -> &mut Self {
        self.set(ms, "command", format!("0x{word:X}"))
    }

    /// Goes on until `ms`.
    pub fn end(&mut self, ms: f64) -> &mut Self {
        self.rows.entry((ms.max(0.0) * 1_000.0).round() as u64).or_default();
        self
    }

    /// As a file that `safepair replay` reads.
    pub fn csv(&self) -> String {
        let mut columns: Vec<&str> = self.rows.values().flat_map(|row| row.keys().copied()).collect();
        columns.sort_unstable();
        columns.dedup();
        let mut text = format!("t_ms,{}\n", columns.join(","));
        for (us, row) in &self.rows {
            let _ = write!(text, "{}.{:03}", us / 1_000, us % 1_000);
            for column in &columns {
                let _ = write!(text, ",{}", row.get(column).map_or("", String::as_str));
            }
            text.push('\n');
        }
        text
    }
}
