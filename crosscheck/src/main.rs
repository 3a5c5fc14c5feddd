//! `safepair-crosscheck`: the process around the core.
//!
//! It owns the clock, the shared memory and the thread, and nothing else: what is permitted
//! is decided in the library. In the cycle it allocates nothing, takes no lock, logs nothing
//! and makes no system call but the sleep (design 3.6).

mod shell;

use std::process::ExitCode;

fn main() -> ExitCode {
    shell::log::begin();
    let options = match shell::options::Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(wrong) => {
            eprintln!("safepair-crosscheck: {wrong}");
            return ExitCode::from(2);
        }
    };
    match shell::run(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("safepair-crosscheck: {why}");
            ExitCode::from(3)
        }
    }
}
