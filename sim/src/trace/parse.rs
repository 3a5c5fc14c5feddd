//! The text form of a trace.

use std::collections::{BTreeMap, HashMap};

use shm_schema::AXES_MAX;
use shm_schema::word::Word;

use super::decimal::Decimal;
use super::{AxisTrace, Course, Fault, Faults, Polyline, Step, Trace, TraceError};

/// Every column a trace may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Column {
    Time,
    Axis,
    Analog(Analog),
    Command,
    Pair(usize),
    Ais,
    Aie,
    ClearError,
    DriveN0,
    DriveEnabled,
    Fault,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Analog {
    Speed,
    Position,
    SecondSpeed,
    SecondOffset,
    Torque,
    Acceleration,
}

const COLUMNS: [(&str, Column); 18] = [
    ("t_ms", Column::Time),
    ("axis", Column::Axis),
    ("speed_rpm", Column::Analog(Analog::Speed)),
    ("pos_incr", Column::Analog(Analog::Position)),
    ("enc2_speed_rpm", Column::Analog(Analog::SecondSpeed)),
    ("enc2_pos_offset_incr", Column::Analog(Analog::SecondOffset)),
    ("torque_pct", Column::Analog(Analog::Torque)),
    ("accel_rpm_s", Column::Analog(Analog::Acceleration)),
    ("command", Column::Command),
    ("se1", Column::Pair(0)),
    ("se2", Column::Pair(1)),
    ("se3", Column::Pair(2)),
    ("se4", Column::Pair(3)),
    ("ais", Column::Ais),
    ("aie", Column::Aie),
    ("clear_error", Column::ClearError),
    ("drive_n0", Column::DriveN0),
    ("drive_enabled", Column::DriveEnabled),
];
const FAULT: (&str, Column) = ("fault", Column::Fault);

fn columns() -> impl Iterator<Item = (&'static str, Column)> {
    COLUMNS.into_iter().chain([FAULT])
}

/// Times beyond this many ms (eleven days) would leave the range of exact evaluation.
const TIME_MAX_MS: i64 = 1_000_000_000;

fn fail<T>(line: usize, message: String) -> Result<T, TraceError> {
    Err(TraceError { line, message })
}

/// Reads a whole trace.
///
/// # Errors
/// The first line that cannot be read, with what was expected there.
pub fn parse(text: &str) -> Result<Trace, TraceError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines =
        text.lines().enumerate().map(|(at, line)| (at + 1, line)).filter(|(_, line)| !ignored(line));
    let Some((line, header)) = lines.next() else {
        return fail(1, "expected a header that names the columns, with t_ms".to_owned());
    };
    let header = parse_header(line, header)?;
    let mut axes: BTreeMap<u8, AxisRows> = BTreeMap::new();
    for (line, text) in lines {
        let row = Row::parse(line, text, &header)?;
        axes.entry(row.axis).or_default().add(row)?;
    }
    if axes.is_empty() {
        return fail(line + 1, "expected at least one row".to_owned());
    }
    let end_ns = axes.values().filter_map(|rows| rows.steps.last()).map(|(at, _)| *at).max().unwrap_or(0);
    let built = axes.into_iter().map(|(axis, rows)| Ok((axis, rows.build()?)));
    Ok(Trace { axes: built.collect::<Result<_, _>>()?, end_ns })
}

/// Empty lines and comments.
fn ignored(line: &str) -> bool {
    let text = line.trim();
    text.is_empty() | text.starts_with('#')
}

fn parse_header(line: usize, text: &str) -> Result<Vec<Column>, TraceError> {
    let mut header = Vec::new();
    for name in text.split(',').map(str::trim) {
        let Some((_, column)) = columns().find(|(known, _)| *known == name) else {
            let known: Vec<_> = columns().map(|(known, _)| known).collect();
            return fail(line, format!("unknown column {name:?}, expected one of {}", known.join(", ")));
        };
        if header.contains(&column) {
            return fail(line, format!("column {name} is there twice"));
        }
        header.push(column);
    }
    let has = |column| header.contains(&column);
    if !has(Column::Time) {
        return fail(line, "expected a column t_ms".to_owned());
    }
    if has(Column::Analog(Analog::Speed)) & has(Column::Analog(Analog::Position)) {
        return fail(line, "expected either speed_rpm or pos_incr, not both".to_owned());
    }
    Ok(header)
}

/// One line, cell by cell.
struct Row {
    line: usize,
    at_ns: i64,
    axis: u8,
    analog: Vec<(Analog, Decimal)>,
    step: Vec<StepCell>,
}

/// A step column that this row sets.
enum StepCell {
    Command(Word),
    Pair(usize, (bool, bool)),
    Flag(Column, bool),
    Faults(Faults),
}

impl Row {
    fn parse(line: usize, text: &str, header: &[Column]) -> Result<Self, TraceError> {
        let cells: Vec<&str> = text.split(',').map(str::trim).collect();
        if cells.len() != header.len() {
            return fail(line, format!("{} cells, expected {} as in the header", cells.len(), header.len()));
        }
        let mut row = Self { line, at_ns: 0, axis: 1, analog: Vec::new(), step: Vec::new() };
        for (column, cell) in header.iter().zip(cells) {
            let empty = cell.is_empty();
            if empty && (*column != Column::Time) {
                continue;
            }
            row.set(*column, cell)?;
        }
        Ok(row)
    }

    fn set(&mut self, column: Column, cell: &str) -> Result<(), TraceError> {
        let line = self.line;
        match column {
            Column::Time => self.at_ns = time(line, cell)?,
            Column::Axis => self.axis = axis(line, cell)?,
            Column::Analog(analog) => self.analog.push((analog, number(line, cell)?)),
            Column::Command => self.step.push(StepCell::Command(command(line, cell)?)),
            Column::Pair(pair) => self.step.push(StepCell::Pair(pair, levels(line, cell)?)),
            Column::Fault => self.step.push(StepCell::Faults(faults(line, cell)?)),
            flag => self.step.push(StepCell::Flag(flag, level(line, cell)?)),
        }
        Ok(())
    }
}

fn number(line: usize, cell: &str) -> Result<Decimal, TraceError> {
    let parsed = Decimal::parse(cell);
    parsed.ok_or_else(|| TraceError { line, message: format!("{cell:?}, expected a decimal number") })
}

fn time(line: usize, cell: &str) -> Result<i64, TraceError> {
    let ns = Decimal::parse(cell).and_then(|value| value.scaled(6)).and_then(|ns| i64::try_from(ns).ok());
    match ns {
        Some(ns) if (0..=TIME_MAX_MS * 1_000_000).contains(&ns) => Ok(ns),
        _ => fail(line, format!("t_ms {cell:?}, expected a decimal number from 0 to {TIME_MAX_MS}")),
    }
}

fn axis(line: usize, cell: &str) -> Result<u8, TraceError> {
    match cell.parse::<u8>() {
        Ok(axis) if (1..=AXES_MAX as u8).contains(&axis) => Ok(axis),
        _ => fail(line, format!("axis {cell:?}, expected a number from 1 to {AXES_MAX}")),
    }
}

fn level(line: usize, cell: &str) -> Result<bool, TraceError> {
    match cell {
        "0" => Ok(false),
        "1" => Ok(true),
        _ => fail(line, format!("{cell:?}, expected 0 or 1")),
    }
}

fn levels(line: usize, cell: &str) -> Result<(bool, bool), TraceError> {
    match cell {
        "00" => Ok((false, false)),
        "01" => Ok((false, true)),
        "10" => Ok((true, false)),
        "11" => Ok((true, true)),
        _ => fail(line, format!("{cell:?}, expected 11, 00, 10 or 01")),
    }
}

fn faults(line: usize, cell: &str) -> Result<Faults, TraceError> {
    let names: Vec<_> = Fault::ALL.into_iter().map(Fault::name).collect();
    let message = || format!("unknown fault {cell:?}, expected none, {}", names.join(", "));
    Faults::named(cell).ok_or_else(|| TraceError { line, message: message() })
}

fn command(line: usize, cell: &str) -> Result<Word, TraceError> {
    let message = || format!("command {cell:?}, expected one hexadecimal number such as 0x00007E7F");
    word(cell).ok_or_else(|| TraceError { line, message: message() })
}

/// One hexadecimal number of up to 64 digits, with or without `0x`.
pub fn word(text: &str) -> Option<Word> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).unwrap_or(text);
    let sound = digits.bytes().all(|octet| octet.is_ascii_hexdigit());
    let bounded = (1..=64).contains(&digits.len());
    if !(sound & bounded) {
        return None;
    }
    let mut word = Word::ZERO;
    for (place, digit) in digits.bytes().rev().enumerate() {
        let value = char::from(digit).to_digit(16).unwrap_or(0);
        word.0[place / 8] |= value << (4 * (place % 8));
    }
    Some(word)
}

/// The rows of one axis.
#[derive(Default)]
struct AxisRows {
    last_line: usize,
    analog: HashMap<Analog, Vec<(i64, Decimal)>>,
    steps: Vec<(i64, Step)>,
}

impl AxisRows {
    fn add(&mut self, row: Row) -> Result<(), TraceError> {
        let before = self.steps.last().copied();
        if before.is_some_and(|(at, _)| at >= row.at_ns) {
            return fail(row.line, "t_ms does not grow, expected strictly increasing times".to_owned());
        }
        self.last_line = row.line;
        for (column, value) in row.analog {
            self.analog.entry(column).or_default().push((row.at_ns, value));
        }
        let step = before.map_or_else(Step::default, |(_, step)| step);
        self.steps.push((row.at_ns, row.step.iter().fold(step, changed)));
        Ok(())
    }

    fn build(mut self) -> Result<AxisTrace, TraceError> {
        let speed = self.line(Analog::Speed)?;
        let course = match self.line(Analog::Position)? {
            Some(position) => Course::Position(position),
            None => Course::Speed(speed.unwrap_or_else(Polyline::constant)),
        };
        Ok(AxisTrace {
            course,
            second_speed: self.line(Analog::SecondSpeed)?,
            second_offset: self.line(Analog::SecondOffset)?,
            torque: self.line(Analog::Torque)?,
            acceleration: self.line(Analog::Acceleration)?,
            steps: self.steps,
        })
    }

    fn line(&mut self, column: Analog) -> Result<Option<Polyline>, TraceError> {
        let Some(points) = self.analog.remove(&column) else {
            return Ok(None);
        };
        let too_large = || TraceError {
            line: self.last_line,
            message: "numbers too large, expected values that can be evaluated exactly".to_owned(),
        };
        Polyline::new(&points).map(Some).ok_or_else(too_large)
    }
}

fn changed(mut step: Step, cell: &StepCell) -> Step {
    match cell {
        StepCell::Command(word) => step.command = Some(*word),
        StepCell::Pair(pair, levels) => step.pairs[*pair] = *levels,
        StepCell::Faults(faults) => step.faults = *faults,
        StepCell::Flag(Column::Ais, level) => step.ais = *level,
        StepCell::Flag(Column::Aie, level) => step.aie = *level,
        StepCell::Flag(Column::ClearError, level) => step.clear_error = *level,
        StepCell::Flag(Column::DriveN0, level) => step.drive_n0 = *level,
        StepCell::Flag(_, level) => step.drive_enabled = *level,
    }
    step
}
