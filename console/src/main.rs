//! `safepair`: the one command (design section 10).
//!
//! Every command exits 0 when it did its job, 1 when what it judged fell short, and 2 on bad
//! input with one clear line.

mod black_channel;
mod ctl;
mod demo;
mod doctor;
mod explain;
mod faults;
mod latency;
mod log;
mod machine_file;
mod master;
mod params;
mod picture;
mod replay;
mod report;
mod run;
mod soak;
mod top;
mod watch;

use std::process::ExitCode;

use clap::Parser;

/// A safe pair of hands for every axis. Certified by nobody.
#[derive(Debug, Parser)]
#[command(version, about)]
enum Command {
    /// Command and ask a running set: status, acknowledge, request and release functions.
    Ctl(ctl::Args),
    /// Show the main job: an axis runs, exceeds a limit, is stopped; a channel is killed.
    Demo(demo::Args),
    /// Look at the black channel without a machine.
    BlackChannel(black_channel::Args),
    /// Is this machine fit: kernel, isolation, priorities, clocks, GPIO, watchdog.
    Doctor(doctor::Args),
    /// Explain a diagnosis code.
    Explain(explain::Args),
    /// The fault-injection campaign in virtual time, with a coverage table.
    Faults(faults::Args),
    /// A black-channel device behind a UDP socket.
    Gateway(black_channel::gateway::Args),
    /// Measure reaction, wake-up and cells, against floors of the same run.
    Latency(latency::Args),
    /// Read, verify and export the logbook.
    Log(log::Args),
    /// Parameter sets: new, check, show, diff, seal, verify, report.
    Params(params::Args),
    /// Drive the cores over a trace, in virtual time.
    Replay(replay::Args),
    /// Start everything for one machine: simulated drive, both channels, crosscheck.
    Run(run::Args),
    /// Run for long: seeded lives in virtual time, or random commands to a real set.
    Soak(soak::Args),
    /// Live view of a running set in the terminal.
    Top(top::Args),
}

fn main() -> ExitCode {
    match Command::parse() {
        Command::Ctl(args) => ctl::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::BlackChannel(args) => black_channel::run(&args),
        Command::Doctor(args) => doctor::run(&args),
        Command::Explain(args) => explain::run(&args),
        Command::Faults(args) => faults::run(&args),
        Command::Gateway(args) => black_channel::gateway::run(&args),
        Command::Latency(args) => latency::run(&args),
        Command::Log(args) => log::run(&args),
        Command::Params(args) => params::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Run(args) => run::run(&args),
        Command::Soak(args) => soak::run(&args),
        Command::Top(args) => top::run(&args),
    }
}
