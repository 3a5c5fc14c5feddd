//! The `encoder` cell: two encoder slots of one axis, raw, of one instant.

use crate::cell::payload;
use crate::{enumeration, layout};

enumeration! {
    /// What is connected to a slot (Prm4, Prm5, C15400, C15500, SC05).
    pub enum SlotKind {
        /// Nothing; using it is a fault.
        #[default]
        None = 0,
        /// Resolver: sine and cosine once per pole pair, no count; `count` is 0.
        Resolver = 1,
        /// Sine encoder: sine, cosine and the count of quarter periods.
        SineCosine = 2,
        /// Digital absolute position in `digital`.
        Digital = 3,
        /// Square-wave counter: four counts per period in `count`.
        Counter = 4,
        /// No encoder: `frequency_mhz` of the drive's output is all there is.
        Encoderless = 5,
    }
}

layout! {
    /// One encoder slot.
    pub struct Slot {
        /// What is connected.
        pub kind: SlotKind,
        /// 0: the acquisition hardware reports no fault; otherwise its fault bits.
        pub status: u8,
        /// Sine, nominal amplitude [`NOMINAL_AMPLITUDE`].
        pub sine: i16,
        /// Cosine, nominal amplitude [`NOMINAL_AMPLITUDE`].
        pub cosine: i16,
        /// Quarter periods since power-up, signed; wraps. Counted by comparators of their own, so
        /// near a boundary the count may be one quadrant ahead of or behind sine and cosine;
        /// further apart is a fault (3606/5/3, 3606/6/3). Quadrant 0 is angle 0 to 90 degrees,
        /// with angle 0 at the rising zero crossing of the sine; count 0 was taken in quadrant 0.
        pub count: i32,
        /// Digital position in increments of 1/65,536 revolution, multi-turn, signed.
        pub digital: i64,
    }
}

/// Amplitude of sine and cosine of a healthy encoder (1 Vpp), in counts.
pub const NOMINAL_AMPLITUDE: i32 = 16_384;

layout! {
    /// One axis of one instant. The sequence of the header is the exchange number.
    pub struct Encoder {
        /// Slot 1, slot 2.
        pub slots: [Slot; 2],
        /// Position of the drive's own control, increments; for plausibility only.
        pub drive_position: i64,
        /// Output frequency of the drive, 1/1000 Hz, signed.
        pub frequency_mhz: i32,
        /// Torque, millionths of the rated torque, signed.
        pub torque_ppm: i32,
        /// Distance of two samples as the producer counts it, ns.
        pub period_ns: u32,
    }
}
payload!(Encoder);
