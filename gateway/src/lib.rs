//! The black-channel gateway: carries frames unchanged between a fieldbus and shared memory.
//!
//! It understands nothing of what it carries, and nothing in the safety argument rests on it
//! (design 9): a gateway that loses, delays, repeats or invents frames is found by the
//! protocol in both channels and by the master. It may write the `command` cell and read the
//! answers; it must never make a check sum of its own.
//!
//! - [`bridge`]: from the newest frame to the `command` cell, from two answers to one frame
//! - [`merge`]: data of channel A, check sums of channel B
//! - [`udp`]: one frame a datagram, for tests and for masters in other programs
//!
//! A fieldbus stack hands over its process image with [`Bridge::received`] and
//! [`Bridge::answers`], as `examples/process_image.rs` shows; over UDP the same in any language
//! (`examples/process_image.py`, `examples/process_image.c`).
#![forbid(unsafe_code)]

pub mod bridge;
pub mod merge;
pub mod udp;

pub use bridge::Bridge;
pub use merge::{Protocol, merge};
