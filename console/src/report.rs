//! How commands end: 0 did its job, 1 what it judged fell short, 2 bad input (design 10).

use std::process::ExitCode;

/// Says what fell short.
pub fn fell_short(line: &str) -> ExitCode {
    eprintln!("safepair: {line}");
    ExitCode::from(1)
}

/// Says what the input should have been.
pub fn bad_input(line: &str) -> ExitCode {
    eprintln!("{line}");
    ExitCode::from(2)
}
