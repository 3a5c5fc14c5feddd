//! The `inhibit-a`, `inhibit-b` and `inhibit-readback` cells: the two dynamic paths.
//!
//! A path permits torque only while `edges` grows every cycle. The evaluator (drive,
//! charge pump, simulator) drops a path at once when `permit` is withdrawn and after
//! [`MISSING_EDGES`] cycles without a new edge (design 3.4).

use crate::cell::payload;
use crate::layout;

/// Missing edges after which the evaluator drops a path.
pub const MISSING_EDGES: u8 = 3;

layout! {
    /// What a channel drives on its path, for the simulated backend.
    pub struct Inhibit {
        /// The channel wants torque.
        pub permit: bool,
        /// Grows by one with each edge.
        pub edges: u64,
        /// The channel's own lines of the safe outputs in the cycle that follows: SA1.n, SA2.n,
        /// SDYNn (n = 1 for A, 2 for B). Bit k is the level of the k-th sample of 62.5 µs.
        pub outputs: [u64; 3],
    }
}
payload!(Inhibit);

layout! {
    /// What the evaluator saw of both paths.
    pub struct Readback {
        /// Path A permits torque, after the dead-man.
        pub path_a: bool,
        /// Path B permits torque, after the dead-man.
        pub path_b: bool,
        /// Edges seen on A.
        pub edges_a: u64,
        /// Edges seen on B.
        pub edges_b: u64,
    }
}
payload!(Readback);
