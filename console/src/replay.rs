//! `safepair replay`: a trace through the cores in virtual time (design 10).

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args as ClapArgs;
use sim::replay::{ReplayOptions, replay_to};

use crate::{machine_file, report::bad_input};

/// Drive the cores of A, B and crosscheck over a trace, in virtual time.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Parameter file.
    #[arg(long, value_name = "SET.toml")]
    params: PathBuf,
    /// Trace: CSV with a header and a column t_ms.
    #[arg(long, value_name = "TRACE.csv")]
    trace: PathBuf,
    /// Write the output here instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Make raw encoder signals from the trace and have them evaluated.
    #[arg(long)]
    encoder: bool,
    /// Begin at power-up instead of settled and acknowledged.
    #[arg(long)]
    cold: bool,
    /// The output is JSON in any case: one object a line.
    #[arg(long)]
    json: bool,
}

/// Runs the command: 0 when the trace was replayed, 2 on bad input with one clear line.
pub fn run(args: &Args) -> ExitCode {
    match replay(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => bad_input(&message),
    }
}

fn replay(args: &Args) -> Result<(), String> {
    let machine = machine_file::read(&args.params)?;
    let trace = sim::trace::parse(&machine_file::text(&args.trace)?).map_err(|error| {
        let sim::trace::TraceError { line, message } = error;
        format!("{}:{line}: {message}", args.trace.display())
    })?;
    let options = ReplayOptions { encoder: args.encoder, cold: args.cold, outputs: false };
    let mut out = BufWriter::new(target(args.out.as_deref())?);
    let done = replay_to(&machine, &trace, options, &mut out);
    let flushed = out.flush();
    match done {
        // A reader that has seen enough is no error.
        Err(sim::replay::ReplayError::Write(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(error @ sim::replay::ReplayError::Axis(_)) => Err(format!("{}: {error}", args.trace.display())),
        Err(error) => Err(error.to_string()),
        Ok(_) => flushed.map_err(|error| format!("output: {error}")),
    }
}

fn target(path: Option<&Path>) -> Result<Box<dyn Write>, String> {
    match path {
        None => Ok(Box::new(io::stdout().lock())),
        Some(path) => match File::create(path) {
            Ok(file) => Ok(Box::new(file)),
            Err(error) => Err(format!("{}: {error}", path.display())),
        },
    }
}
