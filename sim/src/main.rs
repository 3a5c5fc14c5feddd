//! `safepair-sim`: drive, motor, encoders, inputs, evaluator and master of a simulated
//! machine, as a process of its own that publishes into the real cells.
//!
//! It publishes once a cycle: readback of both paths, encoder, inputs, command. What it
//! reads are the inhibit paths and the drive request. It can be commanded through a socket
//! (`DIR/master.sock`) and by a script; see [`sim::control`].

mod process;

use std::process::ExitCode;

fn main() -> ExitCode {
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_max_level(tracing::Level::WARN).init();
    match process::run(std::env::args().skip(1)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            tracing::error!("safepair-sim: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}
