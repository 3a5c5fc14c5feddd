//! The settled start: the first signals belong to a motion that has gone on for ever.

use shm_schema::encoder::Encoder;
use shm_schema::exchange::{Motion, Sampled};

use super::{Evaluation, HISTORY, Point};

/// 1/1000 rpm in 1 revolution/ns.
const UNITS: i128 = 60_000_000_000_000;

impl Evaluation {
    /// Takes the first sample together with the motion it was made from: position and speed
    /// go on from there. Signals that cannot be evaluated leave the evaluation as it is.
    /// `cycle_ns` is the distance of samples whose producer states none.
    pub fn seed(&mut self, sample: &Sampled<Encoder>, motion: &Motion, cycle_ns: u64) {
        let mut seeded = Self::new(self.selection);
        let Ok(reading) = seeded.take(sample) else { return };
        let Some(scale) = seeded.scale(seeded.raw.kind) else { return };
        let stated = u64::from(sample.payload.period_ns);
        let period_ns = if stated == 0 { cycle_ns } else { stated };
        let per_sample = i128::from(seeded.turned(i64::from(motion.speed_mrpm)))
            .wrapping_mul(i128::from(scale.revolution))
            .wrapping_mul(i128::from(period_ns));
        let newest = seeded.history[0];
        for (point, age) in seeded.history.iter_mut().zip(0_u64..) {
            let moved = per_sample.wrapping_mul(i128::from(age)).wrapping_add(UNITS / 2).div_euclid(UNITS);
            *point = Point {
                fine: newest.fine.wrapping_sub(moved as i64),
                sequence: newest.sequence.wrapping_sub(age),
                timestamp_ns: newest.timestamp_ns.wrapping_sub(period_ns.wrapping_mul(age)),
            };
        }
        seeded.filled = HISTORY as u8;
        seeded.offset = motion.position.wrapping_sub(reading.position);
        seeded.reading.position = motion.position;
        seeded.reading.speed = i64::from(motion.speed_mrpm);
        *self = seeded;
    }
}
