//! Whole-system tests and the reference model.
