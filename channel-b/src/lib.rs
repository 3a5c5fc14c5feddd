//! Monitoring channel B of safepair: the lower switches of the power stage conduct only
//! while this channel agrees.
//!
//! Pure core: [`Monitor::step`] is given what the cells say and the own time, and answers
//! with a report and the state of the own inhibit path. It reads no clock, allocates
//! nothing, and cannot panic. B judges motion by closed-form envelopes over the time since
//! a function started, compared as exact fractions; it keeps each safety variable together
//! with its complement; it evaluates encoders in floating point (design 3.1).
//!
//! - [`guard`]: form of cells · [`image`]: parameters · [`profile`]: rows of each product
//! - [`engine`]: what functions have in common · [`encoder`], [`inputs`]: the senses ·
//!   [`outputs`]: the safe outputs
//! - [`fresh`], [`agreed`], [`compare`], [`path`]: watching the others · [`ledger`]: standing errors
//! - [`monitor`]: one axis, one step · [`bus`]: its fieldbus · [`black_channel`]: the slaves
//!
//! Conditions are joined without short circuit: every part of a decision is computed in
//! every cycle, and a decision is one branch.
#![no_std]
#![forbid(unsafe_code)]
#![allow(clippy::needless_bitwise_bool, reason = "decisions without short circuit, see above")]
#![allow(clippy::large_stack_arrays, reason = "there is no allocation to put tables into")]
#![allow(clippy::large_types_passed_by_value, reason = "there is no allocation to box a plan")]
#![allow(clippy::struct_excessive_bools, reason = "flags as the catalogues name them")]

#[cfg(test)]
extern crate std;

pub mod agreed;
pub mod black_channel;
pub mod bus;
pub mod compare;
pub mod crc;
pub mod encoder;
pub mod engine;
pub mod fresh;
pub mod guard;
pub mod image;
pub mod inputs;
pub mod ledger;
pub mod monitor;
pub mod outputs;
pub mod path;
pub mod profile;
pub mod startup;
#[cfg(test)]
mod testing;
pub mod twin;

pub use monitor::Monitor;
pub use profile::findings;

/// Identity of this program, named by the release manifest (DEC-22).
pub const BUILD: u32 = shm_schema::wire::digest(
    shm_schema::wire::DIGEST_START,
    concat!("channel-b ", env!("CARGO_PKG_VERSION")),
);
