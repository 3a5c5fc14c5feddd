//! `cargo xtask steps`: instructions of one step of each core, counted by callgrind, against the
//! counts in `tests/steps.txt`.
//!
//! The difference of two runs is exact and the same on every machine with the same compiler.
//! `--parts` shows the source files a step spends them in: what check sums, complements, diverse
//! evaluation and comparison cost.

use std::{
    collections::BTreeMap,
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

/// Files of a core that are shown by name; the smaller ones together.
const SHOWN: usize = 14;

/// Compares; with `--write` writes what was counted instead; with `--parts` shows where.
pub fn steps(rest: &[String]) -> Outcome {
    let asked = |option: &str| rest.iter().any(|word| word == option);
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
        if asked("--parts") {
            case.show_parts(&programs)?;
        }
        if counted * 100 > case.recorded * (100 + TOLERANCE_PER_CENT) {
            over.push(name);
        }
    }
    if asked("--write") {
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

    fn show_parts(&self, programs: &Path) -> Outcome {
        let few = self.by_file(programs, FEW)?;
        let mut parts: Vec<(u64, String)> = self
            .by_file(programs, MANY)?
            .into_iter()
            .map(|(file, many)| {
                let more = many.saturating_sub(few.get(&file).copied().unwrap_or(0));
                (more / (MANY - FEW), file)
            })
            .collect();
        parts.sort_unstable_by(|one, other| other.cmp(one));
        for (count, file) in parts.iter().take(SHOWN).filter(|(count, _)| *count > 0) {
            println!("    {count:6} {file}");
        }
        let rest: u64 = parts.iter().skip(SHOWN).map(|(count, _)| count).sum();
        println!("    {rest:6} in other files");
        Ok(())
    }

    /// Instructions by source file, inlined code where it was written.
    fn by_file(&self, programs: &Path, steps: u64) -> Result<BTreeMap<String, u64>, String> {
        let profile = programs.join("callgrind.out");
        self.callgrind(programs, steps, &profile)?;
        let text = fs::read_to_string(&profile).map_err(|error| format!("{}: {error}", profile.display()))?;
        Ok(by_file(&text))
    }

    /// All instructions of the program over `steps`.
    fn run(&self, programs: &Path, steps: u64) -> Result<u64, String> {
        self.callgrind(programs, steps, Path::new("/dev/null"))
    }

    fn callgrind(&self, programs: &Path, steps: u64, profile: &Path) -> Result<u64, String> {
        let program = programs.join(&self.program);
        let failed = |text: &str| format!("{} {steps}: {text}", program.display());
        let output = Command::new("valgrind")
            .arg("--tool=callgrind")
            .arg(format!("--callgrind-out-file={}", profile.display()))
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

/// The costs of a callgrind profile by source file. Its names are written once with a number,
/// `fl=(3) path`, and by the number afterwards; the line behind `calls=` is the callee's.
fn by_file(profile: &str) -> BTreeMap<String, u64> {
    let mut names: BTreeMap<&str, &str> = BTreeMap::new();
    let mut costs: BTreeMap<String, u64> = BTreeMap::new();
    let (mut file, mut is_call) = ("", false);
    for line in profile.lines() {
        let named = ["fl=", "fi=", "fe="].iter().find_map(|mark| line.strip_prefix(mark));
        if let Some(reference) = named {
            let (number, name) = reference.split_once(' ').unwrap_or((reference, ""));
            if !name.is_empty() {
                names.insert(number, name);
            }
            file = names.get(number).copied().unwrap_or("?");
        } else if let Some(reference) = line.strip_prefix("cfi=").or(line.strip_prefix("cfl=")) {
            if let Some((number, name)) = reference.split_once(' ') {
                names.insert(number, name);
            }
        } else if line.starts_with("calls=") {
            is_call = true;
        } else if line.starts_with(['+', '-', '*']) || line.starts_with(|first: char| first.is_ascii_digit())
        {
            let cost = line.split_whitespace().nth(1).and_then(|cost| cost.parse::<u64>().ok());
            if !std::mem::take(&mut is_call) {
                *costs.entry(short(file).to_owned()).or_default() += cost.unwrap_or(0);
            }
        }
    }
    costs
}

/// A path as a reader of the project knows it.
fn short(file: &str) -> &str {
    let ours = ["channel-a/", "channel-b/", "crosscheck/", "shm-schema/"];
    ours.iter()
        .find_map(|folder| file.find(folder).map(|at| &file[at..]))
        .unwrap_or("libraries of the compiler")
}

#[cfg(test)]
mod tests {
    use super::by_file;

    #[test]
    fn costs_go_to_the_file_they_were_written_in_and_calls_count_once() {
        let profile = "fl=(1) /x/channel-a/src/a.rs\nfn=(1) step\n5 10\nfi=(2) \
                       /x/shm-schema/src/b.rs\n+2 7\nfe=(1)\n* 3\ncfi=(2)\ncfn=(2) sum\ncalls=1 9\n7 100\n8 \
                       1\nfl=(2)\nfn=(2)\n9 100\n";
        let costs = by_file(profile);
        assert_eq!((costs["channel-a/src/a.rs"], costs["shm-schema/src/b.rs"]), (14, 107));
    }
}
