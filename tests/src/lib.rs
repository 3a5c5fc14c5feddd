//! Whole-system tests, and what they compare with.
//!
//! - [`model`]: the reference model, written apart from both channels
//! - [`compare`]: random comparison of the model with the real cores
//! - [`trace`]: which requirement is met where, generated

pub mod compare;
pub mod model;
pub mod trace;
