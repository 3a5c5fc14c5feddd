//! `safepair-channel-a`: the process around the core of channel A.
//!
//! Owns clock, shared memory, inhibit path and thread of one core; decides nothing. In the
//! cycle it neither allocates, logs nor locks, and asks the kernel for the sleep and the
//! inhibit line only (design 3.6). On every way out the path is off.

mod shell;

use std::process::ExitCode;

fn main() -> ExitCode {
    shell::main()
}
