//! One command for everything that is done with this project: `cargo xtask <task>`.
//!
//! CI runs the same tasks as a person.

mod steps;

use std::{
    env,
    path::{Path, PathBuf},
    process::{Command, ExitCode},
    time::Instant,
};

/// Name, purpose, and what runs it.
type Task = (&'static str, &'static str, fn(&[String]) -> Outcome);

const TASKS: &[Task] = &[
    ("demo", "build, run a simulated axis into its limit, show what happened", demo),
    ("test", "build everything and pass all tests", test),
    ("check", "format, lints, dependencies", check),
    ("no-panic", "link the three cores without any reachable panic", no_panic),
    ("steps", "instructions of one step of each core, against those recorded", steps::steps),
    ("rig", "real-time kernel with a GPIO chip, in emulation (deploy/README.md)", rig),
    ("ci", "check, no-panic, steps, test, demo", ci),
];

type Outcome = Result<(), String>;

fn main() -> ExitCode {
    let mut words = env::args().skip(1);
    let task = words.next().unwrap_or_default();
    let rest: Vec<String> = words.collect();
    let Some((name, _, run)) = TASKS.iter().find(|(name, _, _)| *name == task) else {
        eprintln!("cargo xtask <task>, where <task> is one of");
        for (name, purpose, _) in TASKS {
            eprintln!("  {name:10} {purpose}");
        }
        return ExitCode::from(2);
    };
    let start = Instant::now();
    match run(&rest) {
        Ok(()) => {
            eprintln!("xtask {name}: done in {} s", start.elapsed().as_secs());
            ExitCode::SUCCESS
        }
        Err(line) => {
            eprintln!("xtask {name}: {line}");
            ExitCode::FAILURE
        }
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map_or_else(PathBuf::new, Path::to_path_buf)
}

fn target() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

fn cargo(arguments: &[&str]) -> Outcome {
    run(Command::new(env!("CARGO")).args(arguments).current_dir(root()))
}

fn run(command: &mut Command) -> Outcome {
    eprintln!("+ {}", format!("{command:?}").replace('"', ""));
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{} ended with {status}", command.get_program().display())),
        Err(error) => Err(format!("{}: {error}", command.get_program().display())),
    }
}

fn demo(rest: &[String]) -> Outcome {
    cargo(&["build", "--release", "--workspace", "--bins"])?;
    let program = target().join("release/safepair");
    run(Command::new(program).arg("demo").args(rest).current_dir(root()))
}

fn test(rest: &[String]) -> Outcome {
    // Whole-system tests start the programs that stand beside them. One profile for
    // everything: what is tested is what runs, and a fresh machine builds only once.
    cargo(&["build", "--release", "--workspace", "--bins"])?;
    let mut arguments = vec!["test", "--release", "--workspace", "--no-fail-fast"];
    arguments.extend(rest.iter().map(String::as_str));
    cargo(&arguments)
}

fn check(_: &[String]) -> Outcome {
    cargo(&["fmt", "--all", "--check"])?;
    cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"])?;
    let installed =
        Command::new(env!("CARGO")).args(["deny", "--version"]).output().is_ok_and(|o| o.status.success());
    if installed {
        return cargo(&["deny", "check", "--hide-inclusion-graph", "licenses", "bans", "sources"]);
    }
    eprintln!("note: cargo deny is not installed; licences and sources were not checked");
    Ok(())
}

fn no_panic(_: &[String]) -> Outcome {
    for core in ["channel-a", "channel-b", "crosscheck"] {
        run(&mut link_alone(core)).map_err(|line| {
            format!("{core}: {line}; `a_panic_is_reachable` above means that its core can panic")
        })?;
    }
    // A check that cannot fail is none: the control indexes a slice and must not link.
    let control = link_alone("control").output().map_err(|error| error.to_string())?;
    let caught = String::from_utf8_lossy(&control.stderr).contains("a_panic_is_reachable");
    if caught { Ok(()) } else { Err("the control links although it can panic: the check is void".to_owned()) }
}

fn link_alone(feature: &str) -> Command {
    let mut command = Command::new(env!("CARGO"));
    command.args(["build", "--release", "--quiet", "--features", feature, "--manifest-path"]);
    command.arg(root().join("tests/no-panic/Cargo.toml"));
    // One directory for each, so that the artefacts can be looked at afterwards.
    command.env("CARGO_TARGET_DIR", target().join("no-panic").join(feature));
    command
}

fn rig(rest: &[String]) -> Outcome {
    cargo(&["build", "--release", "--workspace", "--bins"])?;
    run(Command::new(root().join("deploy/rig/run")).args(rest).env("CARGO_TARGET_DIR", target()))
}

fn ci(_: &[String]) -> Outcome {
    check(&[])?;
    no_panic(&[])?;
    steps::steps(&[])?;
    test(&[])?;
    let out = ["--out".to_owned(), target().join("demo").display().to_string()];
    demo(&out)
}
