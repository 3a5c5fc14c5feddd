//! The core, cycle by cycle, in virtual time.

#![allow(clippy::struct_excessive_bools, clippy::large_types_passed_by_value, reason = "plain test data")]

mod bench;
mod differences;
mod form;
mod outward;
mod presence;
mod start;
