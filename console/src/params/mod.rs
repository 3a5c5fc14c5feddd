//! `safepair params`: from a file that a person edits to the sealed images of one machine.
//!
//! Exit 0 when the command did its job, 1 when what it judged fell short (a broken rule, a
//! difference, a set that does not verify), 2 on bad input, with file, line and what was
//! expected.

mod edit;
mod judge;
mod prompt;
mod report;
mod running;
mod sealing;
pub mod start;

use std::{fs, path::Path, process::ExitCode};

use crate::machine_file;

use clap::{Parser, Subcommand};
use serde::Serialize;

/// Options of `safepair params`.
#[derive(Debug, Parser)]
pub struct Args {
    /// Print one JSON value instead of text.
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a new file: every parameter with unit, range and meaning, in delivery state.
    New(edit::New),
    /// Judge a file by every rule of its profile.
    Check(judge::Check),
    /// Show every value of a file in words.
    Show(judge::Show),
    /// Explain one parameter.
    Explain(judge::Explain),
    /// Compare two files.
    Diff(judge::Diff),
    /// Show the object dictionary of a file of the generic profile.
    Dictionary(judge::Show),
    /// Calculate the response times that a file leads to.
    Response(judge::Response),
    /// Write the acceptance report of a file.
    Report(report::Report),
    /// Run every step of the acceptance on the simulated axis; fill in the report.
    Accept(report::Accept),
    /// Write the plain list of the vendor.
    Export(edit::Export),
    /// Turn a plain list of the vendor into a file.
    Import(edit::Import),
    /// Set the password of an installation.
    Password(sealing::Password),
    /// Write the images without validation: they die with the next restart.
    Load(sealing::Load),
    /// Seal a file to an installation, by its password and the content signature.
    Seal(sealing::Seal),
    /// Verify what is sealed against its installation.
    Verify(sealing::Verify),
    /// Take the file out of a sealed set, to seal it to another device.
    Clone(sealing::Clone),
}

/// Why a command ends without its result.
enum Failure {
    /// What it judged fell short; everything is printed already.
    Short,
    /// Bad input, one line each.
    Input(Vec<String>),
}

impl Failure {
    fn line(line: impl ToString) -> Self {
        Self::Input(vec![line.to_string()])
    }
}

impl From<Vec<params::Diagnostic>> for Failure {
    fn from(diagnostics: Vec<params::Diagnostic>) -> Self {
        Self::Input(diagnostics.iter().map(ToString::to_string).collect())
    }
}

type Outcome = Result<(), Failure>;

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let json = args.json;
    let outcome = match &args.command {
        Command::New(args) => edit::new(args, json),
        Command::Check(args) => judge::check(args, json),
        Command::Show(args) => judge::show(args, json),
        Command::Explain(args) => judge::explain(args, json),
        Command::Diff(args) => judge::diff(args, json),
        Command::Dictionary(args) => judge::dictionary(args, json),
        Command::Response(args) => judge::response(args, json),
        Command::Report(args) => report::report(args, json),
        Command::Accept(args) => report::accept(args, json),
        Command::Export(args) => edit::export(args, json),
        Command::Import(args) => edit::import(args, json),
        Command::Password(args) => sealing::password(args, json),
        Command::Load(args) => sealing::load(args, json),
        Command::Seal(args) => sealing::seal(args, json),
        Command::Verify(args) => sealing::verify(args, json),
        Command::Clone(args) => sealing::clone(args, json),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Short) => ExitCode::from(1),
        Err(Failure::Input(lines)) => {
            lines.iter().for_each(|line| eprintln!("{line}"));
            ExitCode::from(2)
        }
    }
}

/// Reads a text file.
fn read(path: &Path) -> Result<String, Failure> {
    machine_file::text(path).map_err(Failure::line)
}

/// Reads a parameter file.
fn machine(path: &Path) -> Result<params::Machine, Failure> {
    machine_file::read(path).map_err(Failure::line)
}

/// Writes to a file, or to standard output without one. An existing file stays.
fn write(path: Option<&Path>, text: &str) -> Outcome {
    let Some(path) = path else {
        print!("{text}");
        return Ok(());
    };
    let file = fs::File::create_new(path);
    let written = file.and_then(|mut file| std::io::Write::write_all(&mut file, text.as_bytes()));
    written.map_err(|error| {
        Failure::line(format!("{}: {error}; expected a file that can be created", path.display()))
    })
}

/// Prints a result as JSON, or its text.
fn print<T: Serialize>(json: bool, value: &T, text: impl FnOnce() -> String) {
    if json {
        println!("{}", serde_json::to_string(value).unwrap_or_default());
    } else {
        print!("{}", text());
    }
}
