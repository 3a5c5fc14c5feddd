//! Cross-communication.
#![no_std]
#![forbid(unsafe_code)]
