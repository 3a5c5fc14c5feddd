//! Every layout that crosses a process boundary of safepair, and the facts of
//! the four product documents that both channels read.
//!
//! This crate holds layouts and facts (bit positions, numbers, ranges) and **no
//! rule**: what a value means, whether it may be trusted and what follows from
//! it is written by hand in each channel, twice and differently (design 3.1).
//! It depends on nothing of ours, allocates nothing, contains no `unsafe` and
//! cannot panic: every decoder is total and answers `None` to what it does not
//! know.
//!
//! - [`wire`]: how fields become octets (little endian, no padding)
//! - [`cell`]: the header that every cell starts with, names and writers
//! - [`encoder`], [`io`], [`command`]: what producers tell the channels
//! - [`report`], [`agreement`]: what channels and crosscheck tell each other
//! - [`inhibit`], [`drive`], [`answer`]: what leaves towards drive and fieldbus
//! - [`image`]: the safety image, the parameters of one axis as raw integers
//! - [`profile`]: profiles and the keys of their parameters
//! - [`exchange`]: what a core's step is given and what it returns
#![no_std]
#![forbid(unsafe_code)]

pub mod agreement;
pub mod answer;
#[cfg(feature = "catalogue")]
pub mod catalogue;
pub mod cell;
pub mod command;
pub mod drive;
pub mod encoder;
pub mod error;
pub mod exchange;
pub mod image;
pub mod inhibit;
pub mod io;
pub mod profile;
pub mod report;
pub mod wire;
pub mod word;

/// Facts generated from `facts/*.toml`.
#[allow(clippy::all, clippy::pedantic)]
pub mod facts {
    include!(concat!(env!("OUT_DIR"), "/facts.rs"));
}

/// Increments of one motor revolution, in every profile (DEC-10, AMK-GEN-14).
pub const INCREMENTS_PER_REVOLUTION: i64 = 65_536;

/// Axes one instance serves at most (design 5).
pub const AXES_MAX: usize = 64;
