//! Monitoring channel b.
#![no_std]
#![forbid(unsafe_code)]

pub mod black_channel;
