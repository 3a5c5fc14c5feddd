//! The machine of one axis in virtual time: both monitors, crosscheck, the evaluator of the
//! inhibit paths, and the faults that sit between them. One call is one cycle; in it
//! nothing allocates.
//!
//! Order and delays are those of a live set: A, then B, then crosscheck on the same sample;
//! the agreement and the readback act one cycle later.

mod axis;
mod core;
mod evaluator;
mod lines;
mod view;
mod wiring;

pub use axis::{Axis, Options, Stimulus};
pub use core::{Channel, Cores, Referee};
pub use evaluator::Evaluator;
pub use lines::{Lines, read_back};
pub use view::{Codes, Source, View};
pub use wiring::Wiring;

#[cfg(test)]
mod tests;
