//! Writes `docs/trace.md`; with `--accept` also the baseline of known gaps.

use std::process::ExitCode;

use system_tests::trace::{self, BASELINE, DOCUMENT, Trace, render};

const HEAD: &str = "# Known gaps of the requirement trace; a gap that is not here fails the build.\n\
                    # Written by `cargo run -p system-tests --bin trace -- --accept`.\n";

fn main() -> ExitCode {
    let accept = std::env::args().skip(1).any(|argument| argument == "--accept");
    let root = trace::root();
    let trace = Trace::read(&root);
    let gaps: Vec<String> = trace.gaps().iter().map(ToString::to_string).collect();
    let mut files = vec![(DOCUMENT, render::document(&trace))];
    if accept {
        files.push((BASELINE, format!("{HEAD}{}\n", gaps.join("\n"))));
    }
    for (file, text) in files {
        if let Err(error) = std::fs::write(root.join(file), text) {
            eprintln!("{file}: {error}");
            return ExitCode::from(2);
        }
        println!("{file} written");
    }
    println!("{} requirements, {} gaps", trace.requirements.len(), gaps.len());
    ExitCode::SUCCESS
}
