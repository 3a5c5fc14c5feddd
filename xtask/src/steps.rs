//! `cargo xtask steps`: instructions of one step of each core, counted by callgrind, against the
//! counts in `tests/steps.txt`.
//!
//! The difference of two runs is exact and the same on every machine with the same compiler.

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{Outcome, cargo, root, target};

/// Steps of the two runs whose difference is taken.
const FEW: u64 = 2_000;
const MANY: u64 = 4_000;
/// More than this over its recorded count fails.
const TOLERANCE_PER_CENT: u64 = 5;

/// A case of `tests/steps.txt`: program, its arguments, instructions a step, what else is said.
struct Case {
    program: String,
    arguments: Vec<String>,
    recorded: u64,
}

/// Compares; with `--write` writes what was counted instead.
pub fn steps(rest: &[String]) -> Outcome {
    let file = root().join("tests/steps.txt");
    let text = fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
    if Command::new("valgrind").arg("--version").output().is_err() {
        eprintln!("note: valgrind is not installed; instructions were not counted");
        return Ok(());
    }
    let programs = build()?;
    let (mut written, mut over) = (String::new(), Vec::new());
    for (number, line) in (1..).zip(text.lines()) {
        let Some(case) = case(line).map_err(|wanted| format!("{}:{number}: {wanted}", file.display()))?
        else {
            let _ = writeln!(written, "{line}");
            continue;
        };
        let counted = case.count(&programs)?;
        let name = format!("{} {}", case.program, case.arguments.join(" "));
        println!("{name:28} {counted:6} instructions a step, {} recorded", case.recorded);
        let _ = writeln!(written, "{name:28} {counted:6}");
        if counted * 100 > case.recorded * (100 + TOLERANCE_PER_CENT) {
            over.push(name);
        }
    }
    if rest.iter().any(|option| option == "--write") {
        return fs::write(&file, written).map_err(|error| format!("{}: {error}", file.display()));
    }
    if over.is_empty() { Ok(()) } else { Err(format!("{} cost more than recorded", over.join(", "))) }
}

fn case(line: &str) -> Result<Option<Case>, String> {
    let wanted = || "expected PROGRAM ARGUMENTS… COUNT".to_owned();
    let mut words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
    if words.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let recorded = words.pop().and_then(|count| count.parse().ok()).ok_or_else(wanted)?;
    if words.is_empty() {
        return Err(wanted());
    }
    let program = words.remove(0);
    Ok(Some(Case { program, arguments: words, recorded }))
}

/// The cores alone, with the profile of a release; the folder of the programs.
fn build() -> Result<PathBuf, String> {
    let folder = target().join("steps");
    for core in ["channel-a", "channel-b", "crosscheck"] {
        let place = folder.display().to_string();
        let arguments = ["build", "--release", "--quiet", "--no-default-features", "--features", "bench"];
        cargo(&[&arguments[..], &["--bins", "-p", core, "--target-dir", &place]].concat())?;
    }
    Ok(folder.join("release"))
}

impl Case {
    fn count(&self, programs: &Path) -> Result<u64, String> {
        let few = self.run(programs, FEW)?;
        let many = self.run(programs, MANY)?;
        Ok(many.saturating_sub(few) / (MANY - FEW))
    }

    /// All instructions of the program over `steps`.
    fn run(&self, programs: &Path, steps: u64) -> Result<u64, String> {
        let program = programs.join(&self.program);
        let failed = |text: &str| format!("{} {steps}: {text}", program.display());
        let output = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(&program)
            .args(&self.arguments)
            .arg(steps.to_string())
            .output()
            .map_err(|error| failed(&error.to_string()))?;
        let said = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            return Err(failed(&said));
        }
        let counted = said.lines().find_map(|line| line.split("Collected : ").nth(1));
        counted.and_then(|count| count.trim().parse().ok()).ok_or_else(|| failed("no count by callgrind"))
    }
}
