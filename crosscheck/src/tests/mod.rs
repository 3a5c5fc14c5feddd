//! The core, cycle by cycle, in virtual time.

mod bench;
mod differences;
mod form;
mod outward;
mod presence;
mod start;
