//! Position and speed from raw signals, channel B's way: the angle by arc tangent in
//! floating point, the speed as the slope of a least-squares line through the last samples.
//! A value that is not finite is a fault.

pub mod drive;
mod slope;
#[cfg(test)]
mod tests;

use shm_schema::INCREMENTS_PER_REVOLUTION;
use shm_schema::encoder::{Encoder, NOMINAL_AMPLITUDE, Slot, SlotKind};

use slope::Slope;

/// Circle of sine and cosine, shares of the nominal amplitude (DEC-46): a healthy 1 Vpp
/// encoder stays within 0.6 and 1.2 Vpp.
const RADIUS_LEAST: f64 = 0.6;
const RADIUS_MOST: f64 = 1.3;
/// Samples that may be bit-for-bit equal while the drive turns (design 8: two cycles).
const FROZEN_SAMPLES: u32 = 2;
/// Movement of the drive's own position that a frozen signal cannot have, increments.
const FROZEN_TRAVEL: i64 = 8;
/// Output frequency of the drive that cannot go with a frozen signal, 1/1000 Hz.
const FROZEN_FREQUENCY: u32 = 1_000;
/// Distance of the mean speed between two samples from the speed before that no drive
/// reaches, 1/1000 rpm. A mean over the time that has passed, so that a skipped sample is a
/// missed exchange and no jump.
const JUMP_MRPM: f64 = 5_000_000.0;
/// Square of the nominal amplitude: radii are compared without their root.
const NOMINAL_SQUARE: f64 = NOMINAL_AMPLITUDE as f64 * NOMINAL_AMPLITUDE as f64;
const INCREMENTS: f64 = INCREMENTS_PER_REVOLUTION as f64;

/// What to evaluate.
#[derive(Debug, Clone, Copy)]
pub struct EncoderSetup {
    /// Index of the slot, 0 or 1; `None`: the slot that carries `kind`, the second first.
    pub slot: Option<u8>,
    /// The expected kind; `None`: any.
    pub kind: Option<SlotKind>,
    /// Sine periods of one revolution.
    pub periods: u32,
    /// Pole pairs, for a drive without encoder (DEC-32).
    pub pole_pairs: u32,
    /// The encoder counts against the motor.
    pub is_inverted: bool,
    /// Turns of the motor for 100 turns of the encoder (C15501).
    pub gear_percent: u32,
}

/// Why a sample is not believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncoderFault {
    /// Nothing of the expected kind is connected.
    Absent,
    /// The acquisition hardware reports a fault.
    Status,
    /// Radius of a sine encoder too large.
    SineLarge,
    /// Radius of a sine encoder too small.
    SineSmall,
    /// Radius of a resolver too small.
    ResolverSmall,
    /// Radius of a resolver too large.
    ResolverLarge,
    /// Angle and count of quarter periods contradict each other.
    Quadrant,
    /// A jump, or a signal that stands still while the drive turns.
    Implausible,
}

/// Position and speed of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Evaluated {
    /// Extended position, increments.
    pub position: i64,
    /// Speed, 1/1000 rpm.
    pub speed_mrpm: i64,
}

/// Evaluates one encoder.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation {
    setup: EncoderSetup,
    last: Option<Sample>,
    slope: Slope,
    turns: f64,
    frozen: u32,
    frozen_at: i64,
    /// Slope of the newest line, increments for each ns.
    rate: f64,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    slot: Slot,
    place: Place,
    time_ns: u64,
}

/// Where a sample is inside the counted range.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Quarter periods counted; wraps as the count does.
    quarters: i32,
    /// Rest: share of a quarter period, or of a resolver's turn.
    rest: f64,
}

impl Place {
    const ZERO: Self = Self { quarters: 0, rest: 0.0 };
}

impl Evaluation {
    /// Nothing seen yet.
    pub const fn new(setup: EncoderSetup) -> Self {
        Self { setup, last: None, slope: Slope::new(), turns: 0.0, frozen: 0, frozen_at: 0, rate: 0.0 }
    }

    /// Takes the sample at `time_ns` as one of a motion that has gone on for ever: position
    /// and speed are `exact`, samples are `spacing_ns` apart (design 10, settled start). A
    /// sample that is not believed settles nothing.
    pub fn settle(&mut self, encoder: &Encoder, time_ns: u64, exact: &Evaluated, spacing_ns: u64) {
        let Some(slot) = self.choose(encoder).copied() else { return };
        let is_encoderless = slot.kind == SlotKind::Encoderless;
        let place = if is_encoderless { Ok(Place::ZERO) } else { place_of(&slot) };
        let Ok(place) = place else { return };
        let share = self.share_of_motor();
        let position = exact.position as f64 * share;
        let origin = self.origin(&slot, place);
        // The signals resolve parts of an increment that the given position has lost.
        self.turns = if libm::fabs(origin - position) <= 1.0 { origin } else { position };
        self.rate = exact.speed_mrpm as f64 * share / MRPM_PER_INCREMENT_NS;
        self.slope = Slope::settled(self.turns, self.rate, time_ns, spacing_ns);
        self.frozen_at = encoder.drive_position;
        let slot = if is_encoderless { Slot::default() } else { slot };
        self.last = Some(Sample { slot, place, time_ns });
    }

    /// Forgets the samples, after a fault.
    pub const fn restart(&mut self) {
        *self = Self::new(self.setup);
    }

    /// Evaluates the sample taken at `time_ns` of the producer.
    ///
    /// # Errors
    /// Why it is not believed.
    pub fn evaluate(&mut self, encoder: &Encoder, time_ns: u64) -> Result<Evaluated, EncoderFault> {
        let seen = self.evaluate_signals(encoder, time_ns)?;
        let is_plain = !self.setup.is_inverted & (self.setup.gear_percent == 100);
        if is_plain {
            return Ok(seen);
        }
        let sign = if self.setup.is_inverted { -1 } else { 1 };
        let gear = i128::from(self.setup.gear_percent.max(1));
        let at_motor = |value: i64| {
            let value = i128::from(value).saturating_mul(gear).saturating_mul(sign) / 100;
            value.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64
        };
        Ok(Evaluated { position: at_motor(seen.position), speed_mrpm: at_motor(seen.speed_mrpm) })
    }

    /// Turns of the encoder for one of the motor, with its direction.
    fn share_of_motor(&self) -> f64 {
        let sign = if self.setup.is_inverted { -100.0 } else { 100.0 };
        sign / f64::from(self.setup.gear_percent.max(1))
    }

    fn evaluate_signals(&mut self, encoder: &Encoder, time_ns: u64) -> Result<Evaluated, EncoderFault> {
        let slot = self.choose(encoder).ok_or(EncoderFault::Absent)?;
        if slot.status != 0 {
            return Err(EncoderFault::Status);
        }
        if slot.kind == SlotKind::Encoderless {
            return self.without_encoder(encoder, time_ns);
        }
        self.watch_frozen(slot, encoder)?;
        let place = place_of(slot)?;
        let moved = self.moved(slot, place, time_ns)?;
        self.follow(slot, place, moved, time_ns)
    }

    fn choose<'a>(&self, encoder: &'a Encoder) -> Option<&'a Slot> {
        let [first, second] = &encoder.slots;
        let fits = |slot: &Slot| match self.setup.kind {
            Some(kind) => slot.kind == kind,
            None => slot.kind != SlotKind::None,
        };
        let wanted = match self.setup.slot {
            Some(0) => first,
            Some(_) => second,
            None if fits(second) => second,
            None => first,
        };
        fits(wanted).then_some(wanted)
    }

    /// Movement since the last sample, increments.
    fn moved(&self, slot: &Slot, place: Place, time_ns: u64) -> Result<f64, EncoderFault> {
        let Some(last) = &self.last else { return Ok(0.0) };
        if last.slot.kind != slot.kind {
            return Err(EncoderFault::Implausible);
        }
        let rest = place.rest - last.place.rest;
        match slot.kind {
            SlotKind::Resolver => {
                // Whole turns are not counted: the movement nearest to the expected one.
                let expected = self.rate * elapsed(last, time_ns) / self.per_pole_pair();
                Ok((rest - libm::rint(rest - expected)) * self.per_pole_pair())
            }
            SlotKind::Digital => Ok(slot.digital.saturating_sub(last.slot.digital) as f64),
            _ => {
                let whole = place.quarters.wrapping_sub(last.place.quarters);
                Ok((f64::from(whole) + rest) * self.per_quarter())
            }
        }
    }

    fn follow(
        &mut self,
        slot: &Slot,
        place: Place,
        moved: f64,
        time_ns: u64,
    ) -> Result<Evaluated, EncoderFault> {
        if self.jumps(moved, time_ns) {
            return Err(EncoderFault::Implausible);
        }
        self.turns = if self.last.is_some() { self.turns + moved } else { self.origin(slot, place) };
        self.rate = self.slope.add(self.turns, time_ns);
        let speed = self.rate * MRPM_PER_INCREMENT_NS;
        let is_finite = speed.is_finite() & self.turns.is_finite();
        if !is_finite {
            return Err(EncoderFault::Implausible);
        }
        self.last = Some(Sample { slot: *slot, place, time_ns });
        Ok(Evaluated { position: nearest(self.turns), speed_mrpm: nearest(speed) })
    }

    /// The mean speed since the last sample is out of reach from the speed before.
    fn jumps(&self, moved: f64, time_ns: u64) -> bool {
        let Some(last) = &self.last else { return false };
        let elapsed = elapsed(last, time_ns);
        let beyond = libm::fabs(moved - self.rate * elapsed) * MRPM_PER_INCREMENT_NS > JUMP_MRPM * elapsed;
        beyond & self.slope.is_full()
    }

    /// Increments of a quarter period.
    fn per_quarter(&self) -> f64 {
        INCREMENTS / (4.0 * f64::from(self.setup.periods.max(1)))
    }

    /// Increments of one electrical turn of a resolver.
    fn per_pole_pair(&self) -> f64 {
        INCREMENTS / f64::from(self.setup.pole_pairs.max(1))
    }

    /// First position: both channels count from the same origin.
    fn origin(&self, slot: &Slot, place: Place) -> f64 {
        match slot.kind {
            SlotKind::Resolver => place.rest * self.per_pole_pair(),
            SlotKind::Digital => slot.digital as f64,
            _ => (f64::from(place.quarters) + place.rest) * self.per_quarter(),
        }
    }

    /// Bit-for-bit equal signals while the drive turns (design 5, 8).
    fn watch_frozen(&mut self, slot: &Slot, encoder: &Encoder) -> Result<(), EncoderFault> {
        let same = self.last.as_ref().is_some_and(|last| last.slot == *slot);
        if !same {
            self.frozen = 0;
            self.frozen_at = encoder.drive_position;
            return Ok(());
        }
        self.frozen = self.frozen.saturating_add(1);
        let travelled = encoder.drive_position.saturating_sub(self.frozen_at).saturating_abs();
        let turns = (travelled > FROZEN_TRAVEL) | (encoder.frequency_mhz.unsigned_abs() > FROZEN_FREQUENCY);
        if turns & (self.frozen >= FROZEN_SAMPLES) { Err(EncoderFault::Implausible) } else { Ok(()) }
    }

    /// DEC-32: `n = 60 * f / pole pairs`; the position is its integral.
    fn without_encoder(&mut self, encoder: &Encoder, time_ns: u64) -> Result<Evaluated, EncoderFault> {
        let pairs = f64::from(self.setup.pole_pairs.max(1));
        let speed = f64::from(encoder.frequency_mhz) * 60.0 / pairs;
        let step = self.last.as_ref().map_or(0, |last| time_ns.saturating_sub(last.time_ns));
        self.turns += speed / MRPM_PER_INCREMENT_NS * step as f64;
        self.last = Some(Sample { slot: Slot::default(), place: Place::ZERO, time_ns });
        if !self.turns.is_finite() {
            return Err(EncoderFault::Implausible);
        }
        Ok(Evaluated { position: libm::rint(self.turns) as i64, speed_mrpm: libm::rint(speed) as i64 })
    }
}

/// 1/1000 rpm of one increment each ns.
const MRPM_PER_INCREMENT_NS: f64 = 60.0 * 1e9 * 1e3 / INCREMENTS;

/// Time since `last`, ns.
fn elapsed(last: &Sample, time_ns: u64) -> f64 {
    time_ns.saturating_sub(last.time_ns) as f64
}

/// The whole number nearest to `value`; half ways to the even one. Adding what leaves no bits for a
/// fraction rounds, as long as the value itself is smaller.
#[inline]
fn nearest(value: f64) -> i64 {
    const ROUNDS: f64 = 6_755_399_441_055_744.0;
    let is_small = (-ROUNDS / 4.0..ROUNDS / 4.0).contains(&value);
    if is_small { ((value + ROUNDS) - ROUNDS) as i64 } else { libm::rint(value) as i64 }
}

/// Where the sample is: quarter periods (sine, counter) or share of a turn (resolver).
fn place_of(slot: &Slot) -> Result<Place, EncoderFault> {
    match slot.kind {
        SlotKind::SineCosine => {
            check_radius(slot, EncoderFault::SineSmall, EncoderFault::SineLarge)?;
            joined(slot)
        }
        SlotKind::Resolver => {
            check_radius(slot, EncoderFault::ResolverSmall, EncoderFault::ResolverLarge)?;
            Ok(Place { quarters: 0, rest: angle(slot) })
        }
        SlotKind::Digital => Ok(Place::ZERO),
        SlotKind::Counter => Ok(Place { quarters: slot.count, rest: 0.0 }),
        SlotKind::None | SlotKind::Encoderless => Err(EncoderFault::Absent),
    }
}

/// Count and angle as one place. Comparators count near a boundary of two quadrants earlier or
/// later than the angle crosses it: then the angle decides. Further apart is a fault.
fn joined(slot: &Slot) -> Result<Place, EncoderFault> {
    let quarters = angle(slot) * 4.0;
    let quadrant = (quarters as i32).clamp(0, 3);
    let apart = ((quadrant - (slot.count & 3) + 2) & 3) - 2;
    if apart == -2 {
        return Err(EncoderFault::Quadrant);
    }
    Ok(Place { quarters: slot.count.wrapping_add(apart), rest: quarters - f64::from(quadrant) })
}

/// Angle as a share of the period, 0 to below 1.
fn angle(slot: &Slot) -> f64 {
    let turn = libm::atan2(f64::from(slot.sine), f64::from(slot.cosine)) / core::f64::consts::TAU;
    if turn < 0.0 { turn + 1.0 } else { turn }
}

fn check_radius(slot: &Slot, small: EncoderFault, large: EncoderFault) -> Result<(), EncoderFault> {
    let (sine, cosine) = (f64::from(slot.sine), f64::from(slot.cosine));
    let square = sine * sine + cosine * cosine;
    if square < RADIUS_LEAST * RADIUS_LEAST * NOMINAL_SQUARE {
        Err(small)
    } else if square > RADIUS_MOST * RADIUS_MOST * NOMINAL_SQUARE {
        Err(large)
    } else {
        Ok(())
    }
}
