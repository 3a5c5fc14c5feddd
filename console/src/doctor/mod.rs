//! `safepair doctor`: is this machine fit for a real power stage?
//!
//! Each finding says what was read, what is expected and how to fix it. Nothing is changed. A
//! machine that falls short still runs simulations: `safepair run` then takes its relaxed timing.

mod checks;
mod host;
mod lines;

use std::process::ExitCode;

use serde::Serialize;

use host::Host;

/// Is this machine fit: kernel, isolation, priorities, clocks, GPIO, watchdog.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Cores of channel A, channel B, crosscheck and the producer, as in `safepair run`.
    #[arg(long, value_delimiter = ',', default_value = "0,1,1,0")]
    cpus: Vec<String>,
    /// A line an inhibit path shall have, CHIP:LINE; may be repeated.
    #[arg(long = "line")]
    lines: Vec<String>,
    /// One JSON object a line, the last one the verdict.
    #[arg(long)]
    json: bool,
}

/// What a finding means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Judgement {
    /// As expected.
    Fit,
    /// Falls short.
    Short,
    /// Worth knowing; decides nothing.
    Note,
    /// Nobody can measure it: somebody has to vouch for it.
    Assumption,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What it is about.
    pub about: &'static str,
    /// What it means.
    pub judgement: Judgement,
    /// What was read.
    pub read: String,
    /// What is expected.
    pub expected: String,
    /// How to fix it.
    pub fix: String,
}

impl Finding {
    /// A finding whose subject is not entered yet.
    pub fn new(judgement: Judgement, read: impl Into<String>, expected: &str, fix: &str) -> Self {
        Self { about: "", judgement, read: read.into(), expected: expected.into(), fix: fix.into() }
    }
}

/// Assumptions of use (README): what no program can see.
const ASSUMPTIONS: [(&str, &str); 4] = [
    (
        "one producer for both channels: both evaluate the same samples",
        "the encoder's own faults show in its sine and cosine, or each channel has a producer of its own",
    ),
    ("the evaluator of the pulses", "it drops a path after three missing edges (--evaluator)"),
    (
        "all clocks of this machine hang on one crystal",
        "the producer's sample rate and the fieldbus master's watchdog are independent of it (DEC-26)",
    ),
    (
        "all processes of a set run as one user",
        "nobody else logs in as that user; shared memory has no access rights",
    ),
];

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let cores = args.cpus.iter().take(3).filter_map(|core| core.parse().ok());
    let host = Host::new("/", cores);
    let findings = examine(&host, &args.lines);
    let short = findings.iter().filter(|finding| finding.judgement == Judgement::Short).count();
    if args.json {
        for finding in &findings {
            // Plain data of text cannot fail to serialise.
            println!("{}", serde_json::to_string(finding).unwrap_or_default());
        }
        println!("{}", serde_json::json!({ "fit": short == 0, "short": short }));
    } else {
        findings.iter().for_each(print);
        println!("{}", if short == 0 { "fit".into() } else { format!("falls short in {short}") });
    }
    if short == 0 { ExitCode::SUCCESS } else { ExitCode::from(1) }
}

fn examine(host: &Host, wanted: &[String]) -> Vec<Finding> {
    let checked = checks::CHECKS
        .iter()
        .flat_map(|(about, check)| check(host).into_iter().map(move |finding| Finding { about, ..finding }));
    let lines = lines::judge(wanted).into_iter().map(|finding| Finding { about: "GPIO", ..finding });
    let assumed = ASSUMPTIONS.iter().map(|(read, expected)| {
        let finding =
            Finding::new(Judgement::Assumption, *read, expected, "vouch for it in the acceptance report");
        Finding { about: "assumption of use", ..finding }
    });
    checked.chain(lines).chain(assumed).collect()
}

fn print(finding: &Finding) {
    let mark = match finding.judgement {
        Judgement::Fit => "ok",
        Judgement::Short => "SHORT",
        Judgement::Note => "note",
        Judgement::Assumption => "assumed",
    };
    println!("{mark:8}{}: {}", finding.about, finding.read);
    if finding.judgement != Judgement::Fit {
        println!("        expected: {}", finding.expected);
        println!("        to fix:   {}", finding.fix);
    }
}

#[cfg(test)]
mod tests;
