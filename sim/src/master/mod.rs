//! Test masters of the black channel, and the bad bus between them and a slave.
//!
//! Written from `black-channel.md` alone, by somebody who has not seen the slaves: what a
//! slave answers is judged by this folder, so it must take nothing from them. Pure and in
//! virtual time; nothing here waits, and nothing here is random but by its seed.
//!
//! - [`fsoe`]: FSoE master (section 3.8)
//! - [`profisafe`]: PROFIsafe F-Host, basic protocol V2 (section 8.4)
//! - [`disturbance`]: corruption, repetition, loss, insertion, wrong order, delay, masquerade

pub mod disturbance;
pub mod fsoe;
pub mod profisafe;

/// Nanoseconds in a millisecond: watchdogs are given in the one, time passes in the other.
const NS_PER_MS: u64 = 1_000_000;
