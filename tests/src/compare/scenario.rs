//! A scenario: parameters and rows, each a change at a whole millisecond.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use shm_schema::profile::Profile;
use shm_schema::word::Word;

use crate::model::ModelInput;
use crate::model::exact::Ratio;

/// Raw lines of the four pairs.
pub type Lines = [(bool, bool); 4];

/// One row of a trace; what is `None` stays as it was or lies on the line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Row {
    /// Time, ms.
    pub at: i64,
    /// A corner of the speed polyline, 1/1000 rpm.
    pub speed_mrpm: Option<i64>,
    /// Control word.
    pub control: Option<u64>,
    /// Safe input lines.
    pub lines: Option<Lines>,
    /// Acknowledge in, restart.
    pub ais: Option<bool>,
    /// Acknowledge in, error.
    pub aie: Option<bool>,
    /// Non-safe clear command.
    pub clear_error: Option<bool>,
    /// A corner of the torque polyline, per cent.
    pub torque_percent: Option<i64>,
    /// A corner of the acceleration polyline, rpm/s.
    pub acceleration_rpm_s: Option<i64>,
}

/// Parameters and a trace.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Profile.
    pub profile: Profile,
    /// Parameters by key of the image.
    pub parameters: BTreeMap<u32, i32>,
    /// Rows in ascending order of time, the first at 0.
    pub rows: Vec<Row>,
    /// Last cycle.
    pub last: i64,
    /// Position in cycle 0, increments; a trace begins at 0.
    pub origin: i64,
}

/// Time in ms and value.
type Corner = (i64, i64);

/// Corners of one analog column.
type Corners = Vec<Corner>;

impl Scenario {
    fn corners(&self, of: impl Fn(&Row) -> Option<i64>) -> Corners {
        self.rows.iter().filter_map(|row| of(row).map(|value| (row.at, value))).collect()
    }

    /// The inputs of every cycle, as design 10 reads a trace: analog columns joined by
    /// straight lines, position the exact integral of the speed, rounded to nearest.
    pub fn inputs(&self) -> Vec<ModelInput> {
        let speed = self.corners(|row| row.speed_mrpm);
        let torque = self.corners(|row| row.torque_percent.map(|percent| percent * 10_000));
        let acceleration = self.corners(|row| row.acceleration_rpm_s.map(|value| value * 1000));
        let mut input = ModelInput::neutral(self.profile);
        let mut rows = self.rows.iter().peekable();
        (0..=self.last)
            .map(|now| {
                while let Some(row) = rows.next_if(|row| row.at <= now) {
                    take_steps(&mut input, row);
                }
                input.speed_mrpm = rounded(value_at(&speed, now));
                input.position = self.origin + position_at(&speed, now);
                input.torque_ppm = rounded(value_at(&torque, now));
                let given = (!acceleration.is_empty()).then(|| rounded(value_at(&acceleration, now)));
                input.acceleration_mrpm_s = given;
                input.clone()
            })
            .collect()
    }

    /// The trace as `safepair replay` reads it.
    pub fn csv(&self) -> String {
        let accelerated = self.rows.iter().any(|row| row.acceleration_rpm_s.is_some());
        let mut text = String::from("t_ms,speed_rpm,command,se1,se2,se3,se4,ais,aie,clear_error,torque_pct");
        text.push_str(if accelerated { ",accel_rpm_s\n" } else { "\n" });
        for row in &self.rows {
            let _ = write!(text, "{},{},{}", row.at, thousandths(row.speed_mrpm), control(row.control));
            for pair in 0..4 {
                let _ = write!(text, ",{}", row.lines.map(|lines| levels(lines[pair])).unwrap_or_default());
            }
            for level in [row.ais, row.aie, row.clear_error] {
                let _ =
                    write!(text, ",{}", level.map(|level| u8::from(level).to_string()).unwrap_or_default());
            }
            let _ =
                write!(text, ",{}", row.torque_percent.map(|value| value.to_string()).unwrap_or_default());
            if accelerated {
                let _ = write!(
                    text,
                    ",{}",
                    row.acceleration_rpm_s.map(|value| value.to_string()).unwrap_or_default()
                );
            }
            text.push('\n');
        }
        if self.rows.last().is_some_and(|row| row.at < self.last) {
            let _ = writeln!(text, "{}{}", self.last, ",".repeat(if accelerated { 11 } else { 10 }));
        }
        text
    }
}

fn take_steps(input: &mut ModelInput, row: &Row) {
    input.control = row.control.map_or(input.control, word);
    input.se = row.lines.unwrap_or(input.se);
    input.ais = row.ais.unwrap_or(input.ais);
    input.aie = row.aie.unwrap_or(input.aie);
    input.clear_error = row.clear_error.unwrap_or(input.clear_error);
}

/// A word of the first 64 bits.
fn word(value: u64) -> Word {
    let mut word = Word::from_u32(value as u32);
    word.0[1] = (value >> 32) as u32;
    word
}

fn thousandths(value: Option<i64>) -> String {
    let Some(value) = value else { return String::new() };
    let sign = if value < 0 { "-" } else { "" };
    format!("{sign}{}.{:03}", value.abs() / 1000, value.abs() % 1000)
}

fn control(value: Option<u64>) -> String {
    value.map(|word| format!("0x{word:08X}")).unwrap_or_default()
}

fn levels(pair: (bool, bool)) -> String {
    format!("{}{}", u8::from(pair.0), u8::from(pair.1))
}

/// The segment `now` lies in: its start, and its end if there is one.
fn segment(corners: &[Corner], now: i64) -> Option<(Corner, Option<Corner>)> {
    let before = corners.iter().rev().find(|corner| corner.0 <= now).copied();
    let after = corners.iter().find(|corner| corner.0 > now).copied();
    match (before, after) {
        (Some(before), after) => Some((before, after)),
        // Before its first corner a column has the value of that corner.
        (None, Some(after)) => Some(((now, after.1), None)),
        (None, None) => None,
    }
}

fn value_at(corners: &[Corner], now: i64) -> Ratio {
    let Some((before, after)) = segment(corners, now) else { return Ratio::whole(0) };
    let Some(after) = after else { return Ratio::whole(before.1) };
    let rise = Ratio::new(i128::from(after.1 - before.1), i128::from(after.0 - before.0));
    Ratio::whole(before.1).plus(rise.times(now - before.0))
}

fn rounded(value: Ratio) -> i64 {
    value.to_nearest()
}

/// Twice the area of whole segments and of the begun one, in increments.
fn position_at(corners: &[Corner], now: i64) -> i64 {
    let first = corners.first().map_or(now, |corner| corner.0.min(now));
    let lead = corners.first().map_or(0, |corner| corner.1) * 2 * first.max(0);
    let whole: i128 = corners
        .windows(2)
        .filter(|pair| pair[1].0 <= now)
        .map(|pair| i128::from(pair[0].1 + pair[1].1) * i128::from(pair[1].0 - pair[0].0))
        .sum();
    let begun = match segment(corners, now) {
        Some((before, _)) if before.0 < now => {
            value_at(corners, now).plus(Ratio::whole(before.1)).times(now - before.0)
        }
        _ => Ratio::whole(0),
    };
    // 65,536 increments per 60,000 ms rpm, of which there are 1,000 to one.
    let twice = begun.plus(Ratio::new(whole + i128::from(lead), 1));
    twice.times(65_536).over(120_000_000).to_nearest()
}
