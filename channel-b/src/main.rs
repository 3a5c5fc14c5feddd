//! Shell of channel B: owns the clock, the shared memory, the inhibit line and the thread
//! around the pure core. It decides nothing; on every way out the path is off.

mod shell;

use std::process::ExitCode;

fn main() -> ExitCode {
    shell::run()
}
