//! Cross-communication: makes the two channels check each other.
//!
//! The core is pure: [`Crosscheck::step`] takes what the cells show and the own clock, and
//! returns the agreement. It knows nothing of shared memory, files or threads, allocates
//! nothing, contains no `unsafe` and cannot panic on any input. It may read reports,
//! readback and the encoder's sequence; it must never raise a path, and an error of its own
//! only ever removes torque.
//!
//! - [`guard`]: the form of a cell
//! - [`limits`]: what it takes from the safety image
//! - [`monitor`]: one axis, step by step
//! - `logbook` (feature of that name, outside the core): what happened, kept so that it can be proved
#![no_std]
#![forbid(unsafe_code)]

// The core needs nothing of it; the tests and the logbook do.
#[cfg(any(test, feature = "logbook"))]
extern crate std;

mod clock;
mod combine;
mod compare;
mod fault;
pub mod guard;
pub mod limits;
#[cfg(feature = "logbook")]
pub mod logbook;
pub mod monitor;
mod pairing;
mod path;
pub mod profile;

#[cfg(test)]
mod tests;

pub use combine::DRIVE_SAFE;
pub use limits::Limits;
pub use monitor::Crosscheck;
