//! From raw encoder signals to position and speed: angle by rotation ([`cordic`]), whole
//! periods by the count of quarter periods, speed by differences over a short window. Every
//! sample is judged before it counts, against the sample time since the one before.

mod cordic;
mod seed;
pub mod twin;

use shm_schema::encoder::{Encoder, NOMINAL_AMPLITUDE, Slot, SlotKind};
use shm_schema::exchange::Sampled;

/// Samples the speed is averaged over, per kind of encoder: a sine encoder resolves the way of
/// one, an angle of 16 bits needs some to stay within 1 rpm, quarter periods need more.
const WINDOW_SINE: u8 = 2;
const WINDOW_ANGLE: u8 = 3;
const WINDOW_COUNTER: u8 = 8;
const HISTORY: usize = 8;
/// Permitted circle radius in parts of the nominal one, squared: 0.5² and 1.3² (DEC-46).
const RADIUS_LOW: i64 = (NOMINAL_AMPLITUDE as i64 * NOMINAL_AMPLITUDE as i64) / 4;
const RADIUS_HIGH: i64 = (NOMINAL_AMPLITUDE as i64 * NOMINAL_AMPLITUDE as i64) * 169 / 100;
/// Highest believable speed, 1/1000 rpm: 60,000 rpm and a quarter (DEC-46).
const SPEED_MAX: i64 = 75_000_000;
/// Speed from which identical raw samples are a fault, 1/1000 rpm (DEC-46).
const MOVING: i64 = 20_000;
/// Movement of the drive's own position from which identical raw samples are a fault, increments.
const DRIVE_MOVED: i64 = 1_024;
/// Identical samples that are one too many.
const FROZEN_SAMPLES: u8 = 2;
const TURN: i64 = 65_536;
/// The encoder turns with the motor.
pub const NO_GEAR: i64 = 100;
/// Bits of the angle inside one quadrant.
const QUADRANT_BITS: u32 = 14;
/// Most samples that a movement is continued over.
const AHEAD_MAX: u64 = 64;

/// What is wrong with a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Nothing of the configured kind is connected, or the hardware reports a fault.
    Absent,
    /// Circle radius too small.
    RadiusSmall,
    /// Circle radius too large.
    RadiusLarge,
    /// Tracks and counter contradict each other.
    Quadrant,
    /// A jump no shaft can make.
    Jump,
    /// The same raw signals although the shaft moves.
    Frozen,
}

/// Which encoder a channel evaluates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Selection {
    /// Kind that has to be found; `None`: whatever the slot has.
    pub kind: Option<SlotKind>,
    /// Slot 1 or 2; 0: the first one of the kind.
    pub slot: u8,
    /// Periods (or pole pairs) of one revolution.
    pub periods: i64,
    /// It counts against the direction of the motor (C15409, SC07; SC03 without encoder).
    pub inverted: bool,
    /// Turns of the motor in a hundred of the encoder (C15501).
    pub gear: i64,
}

/// Position and speed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Reading {
    /// Increments.
    pub position: i64,
    /// 1/1000 rpm.
    pub speed: i64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Point {
    fine: i64,
    sequence: u64,
    timestamp_ns: u64,
}

/// The evaluation of one axis.
#[derive(Debug, Clone)]
pub struct Evaluation {
    selection: Selection,
    history: [Point; HISTORY],
    filled: u8,
    raw: Slot,
    drive_position: i64,
    identical: u8,
    reading: Reading,
    /// Position of the motion a settled start began with, less that of the first signals.
    offset: i64,
}

/// What a fine position of one kind of encoder means.
#[derive(Clone, Copy)]
struct Scale {
    /// Increments in `periods` units of the fine position.
    increments: i64,
    periods: i64,
    /// Units of one revolution.
    revolution: i64,
    window: u8,
    /// Turns of the motor in a hundred of the encoder.
    gear: i64,
}

impl Evaluation {
    /// Nothing seen yet.
    pub fn new(selection: Selection) -> Self {
        Self {
            selection,
            history: [Point::default(); HISTORY],
            filled: 0,
            raw: Slot::default(),
            drive_position: 0,
            identical: 0,
            reading: Reading::default(),
            offset: 0,
        }
    }

    /// The reading of the newest sample taken.
    pub const fn reading(&self) -> Reading {
        self.reading
    }

    /// Enough samples for a speed have been seen.
    pub const fn is_primed(&self) -> bool {
        self.filled >= 3
    }

    fn slot<'a>(&self, encoder: &'a Encoder) -> Option<&'a Slot> {
        let [first, second] = &encoder.slots;
        let fits = |slot: &&Slot| self.selection.kind.is_none_or(|kind| slot.kind == kind);
        match self.selection.slot {
            1 => Some(first).filter(fits),
            2 => Some(second).filter(fits),
            _ => Some(first).filter(fits).or(Some(second).filter(fits)),
        }
    }

    /// Judges and takes one new sample.
    ///
    /// # Errors
    /// What is wrong with it; the reading stays.
    pub fn take(&mut self, sample: &Sampled<Encoder>) -> Result<Reading, Fault> {
        let slot = *self.slot(&sample.payload).ok_or(Fault::Absent)?;
        if slot.status != 0 {
            return Err(Fault::Absent);
        }
        check_radius(&slot)?;
        let scale = self.scale(slot.kind).ok_or(Fault::Absent)?;
        let fine = self.fine(&slot, sample.sequence)?;
        self.check_frozen(&slot, sample.payload.drive_position)?;
        let position = self.turned(scale.position(fine)).wrapping_add(self.offset);
        let measured = self.speed(fine, &scale, sample).map(|speed| self.turned(speed));
        let speed = measured.unwrap_or(self.reading.speed);
        let point = Point { fine, sequence: sample.sequence, timestamp_ns: sample.timestamp_ns };
        self.history.rotate_right(1);
        self.history[0] = point;
        self.filled = self.filled.saturating_add(1);
        self.raw = slot;
        if speed.saturating_abs() > SPEED_MAX {
            return Err(Fault::Jump);
        }
        self.reading = Reading { position, speed };
        Ok(self.reading)
    }

    const fn turned(&self, value: i64) -> i64 {
        if self.selection.inverted { value.wrapping_neg() } else { value }
    }

    fn scale(&self, kind: SlotKind) -> Option<Scale> {
        let periods = self.selection.periods.max(1);
        let gear = self.selection.gear.max(1);
        let angle = |window: u8| {
            let revolution = periods.wrapping_mul(TURN);
            Scale { increments: 1, periods, revolution, window, gear }
        };
        match kind {
            SlotKind::SineCosine => Some(angle(WINDOW_SINE)),
            SlotKind::Resolver => Some(angle(WINDOW_ANGLE)),
            SlotKind::Digital => Some(Scale { periods: 1, revolution: TURN, ..angle(WINDOW_ANGLE) }),
            SlotKind::Counter => Some(Scale {
                increments: 1 << QUADRANT_BITS,
                revolution: periods.wrapping_mul(4),
                ..angle(WINDOW_COUNTER)
            }),
            SlotKind::None | SlotKind::Encoderless => None,
        }
    }

    fn fine(&self, slot: &Slot, sequence: u64) -> Result<i64, Fault> {
        let first = self.filled == 0;
        let newest = self.history[0].fine;
        let quarters = i64::from(slot.count);
        let continued = |before: i64| if first { quarters } else { near(quarters, before, 1 << 32) };
        match slot.kind {
            SlotKind::SineCosine => {
                let angle = cordic::angle(slot.sine, slot.cosine);
                in_period(continued(newest >> QUADRANT_BITS), angle)
            }
            SlotKind::Resolver => {
                let angle = cordic::angle(slot.sine, slot.cosine);
                Ok(if first { angle } else { near(angle, self.expected(sequence), TURN) })
            }
            SlotKind::Digital => Ok(slot.digital),
            SlotKind::Counter => Ok(continued(newest)),
            SlotKind::None | SlotKind::Encoderless => Err(Fault::Absent),
        }
    }

    /// Where the movement of the last samples leads to, also over samples that were lost.
    fn expected(&self, sequence: u64) -> i64 {
        let [newest, before, ..] = &self.history;
        let samples = newest.sequence.wrapping_sub(before.sequence).min(AHEAD_MAX) as i64;
        let moved = newest.fine.wrapping_sub(before.fine);
        let moved = if self.filled > 1 { moved } else { 0 };
        let ahead = sequence.wrapping_sub(newest.sequence).min(AHEAD_MAX) as i64;
        let step = moved.checked_div(samples).unwrap_or(0);
        newest.fine.wrapping_add(step.wrapping_mul(ahead))
    }

    fn check_frozen(&mut self, slot: &Slot, drive_position: i64) -> Result<(), Fault> {
        let identical = (*slot == self.raw) & (self.filled > 0);
        if !identical {
            self.identical = 0;
            self.drive_position = drive_position;
            return Ok(());
        }
        let drive_moved = drive_position.saturating_sub(self.drive_position).saturating_abs() > DRIVE_MOVED;
        let was_moving = self.reading.speed.saturating_abs() > MOVING;
        self.identical = self.identical.saturating_add(u8::from(was_moving | drive_moved));
        if self.identical >= FROZEN_SAMPLES { Err(Fault::Frozen) } else { Ok(()) }
    }

    /// Speed over the window, 1/1000 rpm; by the producer's period where it states one.
    fn speed(&self, fine: i64, scale: &Scale, sample: &Sampled<Encoder>) -> Option<i64> {
        let reach = scale.window.min(self.filled).checked_sub(1)?;
        let from = self.history.get(usize::from(reach))?;
        let samples = sample.sequence.wrapping_sub(from.sequence);
        let stated = samples.saturating_mul(u64::from(sample.payload.period_ns));
        let measured = sample.timestamp_ns.wrapping_sub(from.timestamp_ns);
        let elapsed_ns = if stated == 0 { measured } else { stated };
        let moved = fine.wrapping_sub(from.fine);
        // 60,000 (1/1000 rpm in 1/s) * 10^9 (ns in s) over revolution * elapsed, by the gear in
        // hundredths.
        let up = i128::from(moved).wrapping_mul(600_000_000_000).wrapping_mul(i128::from(scale.gear));
        let down = i128::from(scale.revolution).wrapping_mul(i128::from(elapsed_ns));
        let half = down >> 1;
        let rounded = if up < 0 { up.wrapping_sub(half) } else { up.wrapping_add(half) };
        rounded.checked_div(down).map(|speed| speed.clamp(i128::from(i32::MIN), i128::from(i32::MAX)) as i64)
    }
}

fn check_radius(slot: &Slot) -> Result<(), Fault> {
    let analog = matches!(slot.kind, SlotKind::Resolver | SlotKind::SineCosine);
    let (sine, cosine) = (i64::from(slot.sine), i64::from(slot.cosine));
    let radius = sine * sine + cosine * cosine;
    match analog {
        true if radius < RADIUS_LOW => Err(Fault::RadiusSmall),
        true if radius > RADIUS_HIGH => Err(Fault::RadiusLarge),
        _ => Ok(()),
    }
}

impl Scale {
    /// Increments of a fine position, rounded to nearest.
    fn position(&self, fine: i64) -> i64 {
        let halved = self.periods >> 1;
        let up = fine.wrapping_mul(self.increments).wrapping_add(halved);
        let position = up.checked_div_euclid(self.periods).unwrap_or(0);
        if self.gear == NO_GEAR {
            return position;
        }
        // The gear before the rounding, or a large one would multiply its error.
        let up =
            i128::from(fine).wrapping_mul(i128::from(self.increments)).wrapping_mul(i128::from(self.gear));
        let down = i128::from(self.periods).wrapping_mul(i128::from(NO_GEAR));
        up.wrapping_add(down >> 1).checked_div_euclid(down).unwrap_or(0) as i64
    }
}

/// The quarter count says which period, the tracks where in it. The comparators that count may
/// be one quadrant ahead of or behind the tracks; two are a fault (AMKD-ENCM-02).
fn in_period(quarters: i64, angle: i64) -> Result<i64, Fault> {
    let ahead = (angle >> QUADRANT_BITS).wrapping_sub(quarters) & 3;
    let quarters = match ahead {
        0 | 1 => quarters.wrapping_add(ahead),
        3 => quarters.wrapping_sub(1),
        _ => return Err(Fault::Quadrant),
    };
    Ok((quarters >> 2).wrapping_mul(TURN).wrapping_add(angle))
}

/// Of all numbers that are `value` modulo `span` the one nearest to `expected`.
fn near(value: i64, expected: i64, span: i64) -> i64 {
    let mask = span.wrapping_sub(1);
    let step = value.wrapping_sub(expected) & mask;
    let step = if step > mask / 2 { step.wrapping_sub(span) } else { step };
    expected.wrapping_add(step)
}

#[cfg(test)]
mod tests;
