//! `params report` and `params accept`: the acceptance report, empty or filled in.

mod accept;
mod html;
mod pdf;
mod plot;

use std::{fs, path::PathBuf};

use clap::ValueEnum;
use params::{
    acceptance::{self, Acceptance, Outcome, document},
    response::Surroundings,
};

use super::{Failure, Outcome as Done, machine, print};

/// Options of `report`.
#[derive(Debug, clap::Args)]
pub struct Report {
    /// Parameter file.
    file: PathBuf,
    #[command(flatten)]
    sheet: Sheet,
}

/// Options of `accept`.
#[derive(Debug, clap::Args)]
pub struct Accept {
    /// Parameter file.
    #[arg(long = "params", value_name = "SET.toml")]
    file: PathBuf,
    /// Folder for the trace of every step, to be looked at with `safepair replay`.
    #[arg(long, value_name = "DIR")]
    traces: Option<PathBuf>,
    #[command(flatten)]
    sheet: Sheet,
}

/// Form and place of a report, and what only the builder knows.
#[derive(Debug, clap::Args)]
struct Sheet {
    /// Form; by the end of --out, else HTML.
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// File to create or replace; standard output without it.
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    around: super::judge::Around,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// One file with everything in it, ready to print.
    Html,
    /// PDF, A4.
    Pdf,
    /// Markdown.
    Md,
    /// Data.
    Json,
}

impl Sheet {
    fn format(&self, json: bool) -> Format {
        if json {
            return Format::Json;
        }
        let end = self.out.as_ref().and_then(|out| out.extension()?.to_str().map(str::to_ascii_lowercase));
        let by_end = match end.as_deref() {
            Some("pdf") => Format::Pdf,
            Some("md") => Format::Md,
            Some("json") => Format::Json,
            _ => Format::Html,
        };
        self.format.unwrap_or(by_end)
    }

    /// Writes the report in its form.
    fn write(&self, reports: &[Acceptance], json: bool) -> Done {
        let blocks: Vec<_> = reports.iter().flat_map(Acceptance::blocks).collect();
        let octets = match self.format(json) {
            Format::Html => html::page(&blocks).into_bytes(),
            Format::Md => document::markdown(&blocks).into_bytes(),
            Format::Json => serde_json::to_string_pretty(reports).unwrap_or_default().into_bytes(),
            Format::Pdf => pdf::file(&blocks),
        };
        let Some(path) = &self.out else {
            if self.format(json) == Format::Pdf {
                return Err(Failure::line("a PDF needs --out FILE; expected a file to create"));
            }
            println!("{}", String::from_utf8_lossy(&octets));
            return Ok(());
        };
        fs::write(path, octets).map_err(|error| {
            Failure::line(format!("{}: {error}; expected a file that can be created", path.display()))
        })
    }

    fn surroundings(&self) -> Surroundings {
        self.around.surroundings()
    }
}

/// The report with places for what is measured by hand.
pub fn report(args: &Report, json: bool) -> Done {
    let machine = machine(&args.file)?;
    let file = args.file.display().to_string();
    let around = args.sheet.surroundings();
    let of = |axis| acceptance::acceptance(axis, &file, &around, acceptance::steps(axis));
    let reports: Vec<_> = machine.axes.iter().map(of).collect();
    args.sheet.write(&reports, json)
}

/// Runs every step on the simulated axis and writes the report with what was measured; 1 when
/// any step falls short, or an active function has none.
pub fn accept(args: &Accept, json: bool) -> Done {
    let machine = machine(&args.file)?;
    let file = args.file.display().to_string();
    let around = args.sheet.surroundings();
    let mut reports = Vec::new();
    for axis in &machine.axes {
        let steps = accept::run(axis, args.traces.as_deref()).map_err(Failure::line)?;
        reports.push(acceptance::acceptance(axis, &file, &around, steps));
    }
    let steps: Vec<(u8, &Outcome)> =
        reports.iter().flat_map(|report| report.steps.iter().map(move |step| (report.axis, step))).collect();
    let passed = steps.iter().filter(|(_, step)| step.passed() == Some(true)).count();
    if args.sheet.out.is_some() {
        args.sheet.write(&reports, false)?;
    }
    let open: Vec<_> = reports
        .iter()
        .flat_map(|report| report.unproven.iter().map(move |open| (report.axis, open)))
        .collect();
    print(json, &reports, || {
        let text: String = steps.iter().map(|(axis, step)| accept::line(*axis, step)).collect();
        let missing: String = open
            .iter()
            .map(|(axis, open)| format!("NOT PROVEN axis {axis} {:<8} {}\n", open.function, open.reason))
            .collect();
        text + &missing
            + &format!(
                "{passed} of {} steps passed, {} active functions not proven\n",
                steps.len(),
                open.len()
            )
    });
    let complete = [passed == steps.len(), open.is_empty()];
    if complete.contains(&false) { Err(Failure::Short) } else { Ok(()) }
}
