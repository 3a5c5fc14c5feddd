//! `safepair explain CODE`: what a diagnosis code means and what to do.

use std::process::ExitCode;

use ::params::Explanation;

use crate::report::bad_input;

/// Explain a diagnosis code, for example 3606/13/6, a Lenze message or SME0A9.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The code.
    code: String,
    /// As JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let found = ::params::explain(&args.code);
    if found.is_empty() {
        return unknown(args);
    }
    if args.json {
        // Plain data of text and numbers cannot fail to serialise.
        println!("{}", serde_json::to_string_pretty(&found).unwrap_or_default());
        return ExitCode::SUCCESS;
    }
    for explanation in &found {
        print(explanation);
    }
    ExitCode::SUCCESS
}

fn unknown(args: &Args) -> ExitCode {
    let near = ::params::diagnosis::nearest(&args.code);
    if args.json {
        println!("{}", serde_json::json!({ "code": args.code, "known": false, "nearest": near }));
    }
    bad_input(&format!(
        "{}: no such code; the nearest are {}; expected for example 3606/13/6 (AMK), 102 (Lenze), SME0A9 (ATV) or SLS-E1 (ETG)",
        args.code,
        near.join(", ")
    ))
}

fn print(explanation: &Explanation) {
    println!("{} ({}): {}", explanation.code, explanation.profile, explanation.title);
    let rows = [
        ("class", &explanation.class),
        ("raised by channel", &explanation.channel),
        ("cause", &explanation.cause),
        ("reaction", &explanation.reaction),
        ("remedy", &explanation.remedy),
        ("acknowledge", &explanation.acknowledge),
        ("look at", &explanation.params),
        ("source", &explanation.source),
    ];
    for (name, text) in rows.into_iter().filter(|(_, text)| !text.is_empty()) {
        println!("  {name}: {text}");
    }
    for info in &explanation.infos {
        println!("  {} {}: {}", info.field, info.value, info.meaning);
    }
}
