//! `safepair log`: read, verify and export the logbook.
//!
//! It only reads. A logbook is a file, the files it was continued from, and the note of the
//! newest record beside them (`crosscheck::logbook`); all are judged together.

mod show;
mod time;
mod verify;

use std::{fs, path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand, ValueEnum};
use crosscheck::logbook::{Findings, Record, export, lenze, verify as judge};
use serde_json::json;

use crate::report::bad_input;

/// Options of `safepair log`.
#[derive(Debug, Parser)]
pub struct Args {
    /// Print JSON instead of text.
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Prove that nothing is damaged or missing: exit 0, or 1 with what is.
    Verify(Book),
    /// List the records, newest last.
    Show(show::Show),
    /// Write every record, the second before each trip included.
    Export(Export),
    /// The ten newest entries of an axis, as a Lenze SM301 shows them (C15892, C15893).
    Ten(Ten),
}

/// A logbook.
#[derive(Debug, clap::Args)]
struct Book {
    /// File of the logbook.
    file: PathBuf,
}

#[derive(Debug, clap::Args)]
struct Export {
    #[command(flatten)]
    book: Book,
    /// Form.
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,
    /// File to create; standard output without it.
    #[arg(long)]
    out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// One line for each record and each moment of a trip's second.
    Csv,
    /// One object a line, the last one says what is proved.
    Json,
}

#[derive(Debug, clap::Args)]
struct Ten {
    #[command(flatten)]
    book: Book,
    /// Axis.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=64))]
    axis: u8,
    /// What ends the logging (C15891).
    #[arg(long, value_enum, default_value_t = StopOn::Never)]
    stop_on: StopOn,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum StopOn {
    /// Always active.
    Never,
    /// The first error.
    Error,
    /// The first STO.
    Sto,
    /// The first SS1.
    Ss1,
    /// The first SS2.
    Ss2,
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let done = match &args.command {
        Command::Verify(book) => read(book).map(|findings| verify::verify(book, &findings, args.json)),
        Command::Show(show) => show
            .filter()
            .and_then(|filter| read(&show.book).map(|findings| show::list(&findings, &filter, args.json))),
        Command::Export(args_of) => {
            read(&args_of.book).and_then(|findings| export_to(args_of, args.json, &findings))
        }
        Command::Ten(ten) => read(&ten.book).map(|findings| ten_entries(ten, &findings.records, args.json)),
    };
    done.unwrap_or_else(|line| bad_input(&line))
}

/// Every record there is, judged. Bad input is only a file that cannot be read.
fn read(book: &Book) -> Result<Findings, String> {
    let name = book.file.display();
    let there = judge::files(&book.file).map_err(|error| format!("{name}: {error}; expected a logbook"))?;
    if there.is_empty() {
        return Err(format!(
            "{name}: no such file; expected a logbook, as `safepair run --logbook FILE` writes it"
        ));
    }
    judge::verify_all(&book.file).map_err(|error| format!("{name}: {error}; expected a logbook"))
}

/// What is damaged is said on standard error, so that an export is never taken for whole.
fn warn(findings: &Findings) {
    for fault in &findings.faults {
        eprintln!("warning: {fault}");
    }
    if findings.torn_octets > 0 {
        eprintln!("warning: {}", verify::torn(findings));
    }
}

fn export_to(args: &Export, json: bool, findings: &Findings) -> Result<ExitCode, String> {
    warn(findings);
    let text = match (args.format, json) {
        (Format::Csv, false) => export::to_csv(findings),
        _ => export::to_json_lines(findings),
    };
    match &args.out {
        None => print!("{text}"),
        Some(path) => fs::write(path, text)
            .map_err(|error| format!("{}: {error}; expected a file that can be written", path.display()))?,
    }
    Ok(ExitCode::SUCCESS)
}

fn ten_entries(args: &Ten, records: &[Record], json: bool) -> ExitCode {
    let function = match args.stop_on {
        StopOn::Never => lenze::LogFunction::Active,
        StopOn::Error => lenze::LogFunction::StopOnError,
        StopOn::Sto => lenze::LogFunction::StopOnSto,
        StopOn::Ss1 => lenze::LogFunction::StopOnSs1,
        StopOn::Ss2 => lenze::LogFunction::StopOnSs2,
    };
    let entries = lenze::ten_entries(records, args.axis, function);
    for (at, entry) in (1_usize..).zip(&entries) {
        let words = lenze::state_words(entry.state);
        if json {
            println!(
                "{}",
                json!({ "subcode": at, "time_ms": entry.time_ms,
                    "state": format!("0x{:016X}", entry.state), "words": words })
            );
        } else {
            println!(
                "C15892/{at:<2} {:>10} ms   C15893/{at:<2} 0x{:016X}  {}",
                entry.time_ms,
                entry.state,
                words.join(", ")
            );
        }
    }
    if entries.is_empty() && !json {
        println!("no entry of axis {}", args.axis);
    }
    ExitCode::SUCCESS
}

#[cfg(test)]
mod tests;
