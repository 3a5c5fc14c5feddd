//! The simulated machine around the cores of safepair: everything a real drive PC would
//! have outside the two monitors, as models that run in virtual time or as a process.
//!
//! It may use every other folder. It must never be linked into a monitor, and nothing here
//! decides about safety: what it models as evaluator or drive is an assumption of use.
//!
//! - [`shm`]: the private shared-memory domain of one run, and its cells
//! - [`trace`]: written or recorded traces, read without rounding
#![forbid(unsafe_code)]

pub mod acceptance;
pub mod control;
pub mod host;
pub mod machine;
pub mod master;
pub mod motor;
pub mod random;
pub mod replay;
pub mod shm;
pub mod signals;
pub mod soak;
pub mod trace;
