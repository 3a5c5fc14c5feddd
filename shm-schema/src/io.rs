//! The `io` cell: safe input lines as sample patterns, readback of the outputs.

use crate::cell::payload;
use crate::layout;

/// Distance of two samples, ns (AMK-FILT, 62.5 µs).
pub const SAMPLE_NS: u64 = 62_500;
/// Safe input pairs: AMK SE1 to SE3, Lenze SD-In1 to SD-In4.
pub const PAIRS: usize = 4;

layout! {
    /// Safe inputs of one axis. In every pattern bit 0 is the newest sample, bit n the
    /// one n samples older; 1 is high.
    pub struct Io {
        /// Samples taken since power-up: tells how many of a pattern are new.
        pub samples: u64,
        /// Lines .1 of the pairs, evaluated by channel A (DEC-36).
        pub line_1: [u64; 4],
        /// Lines .2 of the pairs, evaluated by channel B (DEC-36).
        pub line_2: [u64; 4],
        /// Acknowledge in, restart (AIS).
        pub ais: u64,
        /// Acknowledge in, error (AIE).
        pub aie: u64,
        /// Readback of safe outputs SA1.1, SA1.2, SA2.1, SA2.2.
        pub output_readback: [u64; 4],
        /// Readback of the dynamic sampling outputs SDYN1, SDYN2.
        pub dynamic_readback: [u64; 2],
    }
}
payload!(Io);
