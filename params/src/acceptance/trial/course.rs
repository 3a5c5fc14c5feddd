//! A movement with its commands, written as a trace.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

use shm_schema::word::Word;

/// Columns by time; what a row leaves empty holds, or lies on the line between its neighbours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Course {
    /// Microseconds, so that rows have an order.
    rows: BTreeMap<u64, BTreeMap<&'static str, String>>,
    /// Pairs whose lines carry test pulses.
    sampled: BTreeMap<&'static str, [Pulses; 2]>,
}

/// Test pulses of one line: low for `pulse_us`, once in a period, while the line is high.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::struct_field_names, reason = "units last")]
pub struct Pulses {
    /// Period, µs.
    pub period_us: u64,
    /// Length, µs.
    pub pulse_us: u64,
    /// The first one begins here, µs.
    pub first_us: u64,
}

impl Pulses {
    fn low(self, us: u64) -> bool {
        us >= self.first_us && (us - self.first_us) % self.period_us.max(1) < self.pulse_us
    }

    fn edges(self, end_us: u64) -> impl Iterator<Item = u64> {
        let begins = (self.first_us..end_us).step_by(self.period_us.max(1) as usize);
        begins.flat_map(move |begin| [begin, begin + self.pulse_us])
    }
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
    pub fn command(&mut self, ms: f64, word: Word) -> &mut Self {
        let used = (0..32).rev().find(|at| word.octet(*at) != 0).unwrap_or(0);
        let digits: String = (0..=used).rev().map(|at| format!("{:02X}", word.octet(at))).collect();
        self.set(ms, "command", format!("0x{digits}"))
    }

    /// Goes on until `ms`.
    pub fn end(&mut self, ms: f64) -> &mut Self {
        self.rows.entry((ms.max(0.0) * 1_000.0).round() as u64).or_default();
        self
    }

    /// When the last row stands, ms.
    pub fn end_ms(&self) -> f64 {
        self.rows.keys().next_back().map_or(0.0, |us| *us as f64 / 1_000.0)
    }

    /// The lines of a pair carry test pulses, whatever level is set on them.
    pub fn sample(&mut self, column: &'static str, pulses: [Pulses; 2]) -> &mut Self {
        self.sampled.insert(column, pulses);
        self
    }

    /// The rows with every test pulse in them.
    fn pulsed(&self) -> BTreeMap<u64, BTreeMap<&'static str, String>> {
        let mut rows = self.rows.clone();
        let end_us = self.rows.keys().next_back().copied().unwrap_or_default();
        for (column, pulses) in &self.sampled {
            let edges = pulses.iter().flat_map(|pulses| pulses.edges(end_us));
            let set = self.rows.iter().filter(|(_, row)| row.contains_key(column)).map(|(us, _)| *us);
            let times: BTreeSet<u64> = edges.chain(set).filter(|us| *us <= end_us).collect();
            for us in times {
                let base = self.rows.range(..=us).rev().find_map(|(_, row)| row.get(column));
                let lines = base.map_or("11", String::as_str).chars().zip(pulses);
                let level = |(line, pulses): (char, &Pulses)| if pulses.low(us) { '0' } else { line };
                rows.entry(us).or_default().insert(column, lines.map(level).collect());
            }
        }
        rows
    }

    /// As a file that `safepair replay` reads.
    pub fn csv(&self) -> String {
        let rows = self.pulsed();
        let mut columns: Vec<&str> = rows.values().flat_map(|row| row.keys().copied()).collect();
        columns.sort_unstable();
        columns.dedup();
        let mut text = format!("t_ms,{}\n", columns.join(","));
        for (us, row) in &rows {
            let _ = write!(text, "{}.{:03}", us / 1_000, us % 1_000);
            for column in &columns {
                let _ = write!(text, ",{}", row.get(column).map_or("", String::as_str));
            }
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// AMK-DYN-01: the pattern interrupts a line that is high, once per period.
    #[test]
    fn a_sampled_pair_is_low_for_a_pulse_of_each_line() {
        let mut course = Course::default();
        let pulses = |first_us| Pulses { period_us: 2_000, pulse_us: 500, first_us };
        course.set(0.0, "se1", "11").set(3.0, "se1", "00").end(5.0);
        course.sample("se1", [pulses(1_000), pulses(2_000)]);
        let rows: Vec<_> = course.csv().lines().skip(1).map(str::to_string).collect();
        let expected = [
            "0.000,11", "1.000,01", "1.500,11", "2.000,10", "2.500,11", "3.000,00", "3.500,00", "4.000,00",
            "4.500,00", "5.000,",
        ];
        assert_eq!(rows, expected);
    }
}
