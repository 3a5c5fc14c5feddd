//! Whole-system tests and the reference model.

pub mod model;
