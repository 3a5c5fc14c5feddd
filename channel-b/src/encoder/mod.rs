//! Position and speed from raw signals, channel B's way: the angle by arc tangent in
//! floating point, the speed as the slope of a least-squares line through the last samples.
//! A value that is not finite is a fault.

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
/// Change of speed from one sample to the next that no drive reaches, 1/1000 rpm.
const JUMP_MRPM: f64 = 1_500_000.0;
/// Share of a period that angle and count may disagree by near a zero crossing.
const CROSSING: f64 = 0.25;
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
    /// Angle and count of periods contradict each other.
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
    speed: f64,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    slot: Slot,
    /// Position inside the counted range, revolutions or periods.
    place: f64,
    time_ns: u64,
}

impl Evaluation {
    /// Nothing seen yet.
    pub const fn new(setup: EncoderSetup) -> Self {
        Self { setup, last: None, slope: Slope::new(), turns: 0.0, frozen: 0, frozen_at: 0, speed: 0.0 }
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
        if !self.setup.is_inverted {
            return Ok(seen);
        }
        let (position, speed_mrpm) = (seen.position.saturating_neg(), seen.speed_mrpm.saturating_neg());
        Ok(Evaluated { position, speed_mrpm })
    }

    fn evaluate_signals(&mut self, encoder: &Encoder, time_ns: u64) -> Result<Evaluated, EncoderFault> {
        let slot = self.choose(encoder).ok_or(EncoderFault::Absent)?;
        if slot.status != 0 {
            return Err(EncoderFault::Status);
        }
        if slot.kind == SlotKind::Encoderless {
            return self.without_encoder(encoder, time_ns);
        }
        self.watch_frozen(&slot, encoder)?;
        let place = self.place(&slot)?;
        let moved = self.moved(&slot, place)?;
        self.follow(&slot, place, moved, time_ns)
    }

    fn choose(&self, encoder: &Encoder) -> Option<Slot> {
        let [first, second] = encoder.slots;
        let fits = |slot: &Slot| match self.setup.kind {
            Some(kind) => slot.kind == kind,
            None => slot.kind != SlotKind::None,
        };
        let wanted = match self.setup.slot {
            Some(0) => first,
            Some(_) => second,
            None if fits(&second) => second,
            None => first,
        };
        fits(&wanted).then_some(wanted)
    }

    /// Where the sample is, in periods (sine, counter), turns (resolver), increments (digital).
    fn place(&self, slot: &Slot) -> Result<f64, EncoderFault> {
        match slot.kind {
            SlotKind::SineCosine => {
                check_radius(slot, EncoderFault::SineSmall, EncoderFault::SineLarge)?;
                Ok(self.joined(slot))
            }
            SlotKind::Resolver => {
                check_radius(slot, EncoderFault::ResolverSmall, EncoderFault::ResolverLarge)?;
                Ok(angle(slot))
            }
            SlotKind::Digital => Ok(slot.digital as f64),
            SlotKind::Counter => Ok(f64::from(slot.count) / 4.0),
            SlotKind::None | SlotKind::Encoderless => Err(EncoderFault::Absent),
        }
    }

    /// Whole periods and angle; near a zero crossing the angle may run ahead of the count or
    /// behind it, then the neighbour that continues the movement is taken.
    fn joined(&self, slot: &Slot) -> f64 {
        let fraction = angle(slot);
        let plain = f64::from(slot.count) + fraction;
        let other = if fraction > 1.0 - CROSSING {
            plain - 1.0
        } else if fraction < CROSSING {
            plain + 1.0
        } else {
            return plain;
        };
        let Some(last) = &self.last else { return plain };
        let expected = last.place + self.expected_periods();
        let is_near = libm::fabs(libm::rint(plain) - plain) < 0.01;
        let fits_better = libm::fabs(other - expected) + 0.5 < libm::fabs(plain - expected);
        if is_near & fits_better { other } else { plain }
    }

    fn expected_periods(&self) -> f64 {
        self.slope.step() * f64::from(self.setup.periods) / INCREMENTS
    }

    /// Movement since the last sample, increments.
    fn moved(&self, slot: &Slot, place: f64) -> Result<f64, EncoderFault> {
        let Some(last) = &self.last else { return Ok(0.0) };
        if last.slot.kind != slot.kind {
            return Err(EncoderFault::Implausible);
        }
        let difference = place - last.place;
        match slot.kind {
            SlotKind::Resolver => Ok((difference - libm::rint(difference)) * self.per_pole_pair()),
            SlotKind::Digital => Ok(slot.digital.saturating_sub(last.slot.digital) as f64),
            _ => self.periods_moved(difference),
        }
    }

    fn periods_moved(&self, difference: f64) -> Result<f64, EncoderFault> {
        // The count is 32 bits wide and wraps.
        let range =
            if libm::fabs(difference) > 1e8 { libm::copysign(4_294_967_296.0, difference) } else { 0.0 };
        let periods = difference - range;
        let is_slow = libm::fabs(self.expected_periods()) < CROSSING;
        let contradicts = is_slow & (self.slope.is_full()) & (libm::fabs(periods) > 1.0 - CROSSING);
        if contradicts & (libm::fabs(periods) < 2.0) {
            return Err(EncoderFault::Quadrant);
        }
        let per_turn = f64::from(self.setup.periods.max(1));
        Ok(periods * INCREMENTS / per_turn)
    }

    fn follow(
        &mut self,
        slot: &Slot,
        place: f64,
        moved: f64,
        time_ns: u64,
    ) -> Result<Evaluated, EncoderFault> {
        self.turns = if self.last.is_some() { self.turns + moved } else { self.origin(slot, place) };
        let speed = self.slope.add(self.turns, time_ns) * MRPM_PER_INCREMENT_NS;
        let jump = libm::fabs(speed - self.speed);
        let is_finite = speed.is_finite() & self.turns.is_finite();
        let jumps = (jump > JUMP_MRPM) & self.slope.is_full() & self.last.is_some();
        if jumps | !is_finite {
            return Err(EncoderFault::Implausible);
        }
        self.speed = speed;
        self.last = Some(Sample { slot: *slot, place, time_ns });
        Ok(Evaluated { position: libm::rint(self.turns) as i64, speed_mrpm: libm::rint(speed) as i64 })
    }

    /// Increments of one electrical turn of a resolver.
    fn per_pole_pair(&self) -> f64 {
        INCREMENTS / f64::from(self.setup.pole_pairs.max(1))
    }

    /// First position: both channels count from the same origin.
    fn origin(&self, slot: &Slot, place: f64) -> f64 {
        let per_turn = f64::from(self.setup.periods.max(1));
        match slot.kind {
            SlotKind::Resolver => place * self.per_pole_pair(),
            SlotKind::Digital => place,
            _ => place * INCREMENTS / per_turn,
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
        self.last = Some(Sample { slot: Slot::default(), place: 0.0, time_ns });
        if !self.turns.is_finite() {
            return Err(EncoderFault::Implausible);
        }
        Ok(Evaluated { position: libm::rint(self.turns) as i64, speed_mrpm: libm::rint(speed) as i64 })
    }
}

/// 1/1000 rpm of one increment each ns.
const MRPM_PER_INCREMENT_NS: f64 = 60.0 * 1e9 * 1e3 / INCREMENTS;

/// Angle as a share of the period, 0 to below 1.
fn angle(slot: &Slot) -> f64 {
    let turn = libm::atan2(f64::from(slot.sine), f64::from(slot.cosine)) / core::f64::consts::TAU;
    if turn < 0.0 { turn + 1.0 } else { turn }
}

fn check_radius(slot: &Slot, small: EncoderFault, large: EncoderFault) -> Result<(), EncoderFault> {
    let radius = libm::hypot(f64::from(slot.sine), f64::from(slot.cosine)) / f64::from(NOMINAL_AMPLITUDE);
    if radius < RADIUS_LEAST {
        Err(small)
    } else if radius > RADIUS_MOST {
        Err(large)
    } else {
        Ok(())
    }
}
