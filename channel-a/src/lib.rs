//! Monitoring channel A: the core.
//!
//! A pure `step(state, inputs, now) -> outputs` for one axis, without operating system,
//! heap or floating point; it cannot panic on any input. Everything is an incremental
//! integer state machine; time is judged by the sample's stamp against the channel's own
//! clock (DEC-26). A profile is a table of function instances ([`profile`]), walked by one
//! small engine ([`engine`]). The shell in `main.rs` owns clock, memory and inhibit line.
#![no_std]
#![forbid(unsafe_code)]
// Conditions are joined without branches: all parts are judged whatever the first one says.
#![allow(clippy::needless_bitwise_bool)]
// Facts of one instant stand side by side; they are no state machine in disguise.
#![allow(clippy::struct_excessive_bools)]

#[cfg(test)]
extern crate std;

pub mod black_channel;
mod bus;
mod clock;
mod compare;
mod crc32;
mod encoder;
mod engine;
mod errors;
mod fresh;
pub mod guard;
mod image;
mod inputs;
mod monitor;
mod outputs;
mod partner;
mod path;
mod profile;
mod startup;
#[cfg(test)]
mod tests;

pub use crc32::crc32;
pub use image::sound;
pub use monitor::{BUILD, Monitor};
pub use profile::findings;
