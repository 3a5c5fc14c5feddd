//! From raw encoder signals to position and speed: angle by rotation ([`cordic`]), whole
//! periods by the counter, speed by differences over a short window. Every sample is
//! judged before it counts.

mod cordic;

use shm_schema::encoder::{Encoder, NOMINAL_AMPLITUDE, Slot, SlotKind};
use shm_schema::exchange::Sampled;

/// Samples the speed is averaged over, per kind of encoder.
const WINDOW_FINE: u8 = 2;
const WINDOW_COARSE: u8 = 8;
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
/// Part of a period around the zero crossing in which counter and tracks may be apart.
const CROSSING: i64 = TURN / 16;

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
}

/// Fine position and what one revolution of it is.
struct Fine {
    value: i64,
    revolution: i64,
    window: u8,
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
        let fine = self.fine(&slot)?;
        self.check_frozen(&slot, sample.payload.drive_position)?;
        let position = fine.value.wrapping_mul(TURN).checked_div_euclid(fine.revolution).unwrap_or(0);
        let position = if fine.revolution == TURN { fine.value } else { position };
        let speed = self.speed(&fine, sample).unwrap_or(self.reading.speed);
        let point = Point { fine: fine.value, sequence: sample.sequence, timestamp_ns: sample.timestamp_ns };
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

    fn fine(&self, slot: &Slot) -> Result<Fine, Fault> {
        let before = self.history[0].fine;
        let first = self.filled == 0;
        let periods = self.selection.periods.max(1);
        match slot.kind {
            SlotKind::SineCosine => {
                let angle = cordic::angle(slot.sine, slot.cosine);
                let count = i64::from(slot.count);
                let count = if first { count } else { unwrapped(count, before.div_euclid(TURN), 1 << 32) };
                let value = count.wrapping_mul(TURN).wrapping_add(angle);
                let expected = before.wrapping_add(before.wrapping_sub(self.history[1].fine));
                let value = if self.filled > 1 { near_crossing(value, angle, expected) } else { value };
                self.check_quadrant(value, angle, before, first)?;
                Ok(Fine { value, revolution: periods.wrapping_mul(TURN), window: WINDOW_FINE })
            }
            SlotKind::Resolver => {
                let angle = cordic::angle(slot.sine, slot.cosine);
                let value = if first { angle } else { unwrapped(angle, before, TURN) };
                Ok(Fine { value, revolution: periods.wrapping_mul(TURN), window: WINDOW_COARSE })
            }
            SlotKind::Digital => Ok(Fine { value: slot.digital, revolution: TURN, window: WINDOW_COARSE }),
            SlotKind::Counter => {
                let count = i64::from(slot.count);
                let value = if first { count } else { unwrapped(count, before, 1 << 32) };
                Ok(Fine { value, revolution: periods.wrapping_mul(4), window: WINDOW_COARSE })
            }
            SlotKind::None | SlotKind::Encoderless => Err(Fault::Absent),
        }
    }

    /// While the shaft is slow the counter has to follow the tracks period by period.
    fn check_quadrant(&self, value: i64, angle: i64, before: i64, first: bool) -> Result<(), Fault> {
        let known = !first & (self.filled > 1);
        let last_step = before.wrapping_sub(self.history[1].fine);
        let slow = last_step.saturating_abs() < TURN / 8;
        let turned = unwrapped(angle, before, TURN).wrapping_sub(before);
        let counted = value.wrapping_sub(before);
        let small_turn = turned.saturating_abs() < TURN / 4;
        let contradicted = counted.wrapping_sub(turned).saturating_abs() > TURN / 4;
        if known & slow & small_turn & contradicted { Err(Fault::Quadrant) } else { Ok(()) }
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
    fn speed(&self, fine: &Fine, sample: &Sampled<Encoder>) -> Option<i64> {
        let reach = fine.window.min(self.filled).checked_sub(1)?;
        let from = self.history.get(usize::from(reach))?;
        let samples = sample.sequence.wrapping_sub(from.sequence);
        let stated = samples.saturating_mul(u64::from(sample.payload.period_ns));
        let measured = sample.timestamp_ns.saturating_sub(from.timestamp_ns);
        let elapsed_ns = if stated == 0 { measured } else { stated };
        let moved = fine.value.wrapping_sub(from.fine);
        // 60,000 (1/1000 rpm in 1/s) * 10^9 (ns in s) over revolution * elapsed.
        let up = i128::from(moved).wrapping_mul(60_000_000_000_000);
        let down = i128::from(fine.revolution).wrapping_mul(i128::from(elapsed_ns));
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

/// `value` of a counter that wraps at `span`, continued from `before`.
fn unwrapped(value: i64, before: i64, span: i64) -> i64 {
    let mask = span.wrapping_sub(1);
    let step = value.wrapping_sub(before) & mask;
    let step = if step > mask / 2 { step.wrapping_sub(span) } else { step };
    before.wrapping_add(step)
}

/// Near the zero crossing the counter may be one period early or late: the value that
/// continues the movement counts (AMKD-ENCM-02 tolerates one quadrant).
fn near_crossing(value: i64, angle: i64, expected: i64) -> i64 {
    let late = (angle < CROSSING).then(|| value.wrapping_add(TURN));
    let early = (angle > TURN - CROSSING).then(|| value.wrapping_sub(TURN));
    let off = |candidate: i64| candidate.wrapping_sub(expected).saturating_abs();
    late.or(early).filter(|other| off(*other) < off(value)).unwrap_or(value)
}

#[cfg(test)]
mod tests;
