//! `safepair faults`: the fault-injection campaign, with a coverage table.

use std::{path::PathBuf, process::ExitCode};

use serde_json::{Value, json};
use sim::soak::campaign::{CASES, Result as Row, play};

use crate::machine_file;
use crate::report::{bad_input, fell_short};
use crate::run::default_machine;

/// Injects every fault at random instants of a moving axis, in virtual time.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Parameter file. Default: the embedded axis.
    #[arg(long)]
    params: Option<PathBuf>,
    /// Rounds of each fault.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    rounds: u64,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The table as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let machine = match args.params.as_deref().map_or_else(default_machine, machine_file::read) {
        Ok(machine) => machine,
        Err(line) => return bad_input(&line),
    };
    let mut rows = Vec::new();
    for set in &machine.axes {
        for (at, case) in CASES.iter().enumerate() {
            if !args.json {
                eprint!("\raxis {}: {:<20}", set.number, case.fault.name());
            }
            let seed = args.seed.wrapping_mul(1_000).wrapping_add(at as u64);
            rows.push((set.number, play(set, case, args.rounds, seed)));
        }
    }
    if args.json {
        println!("{}", Value::from(rows.iter().map(|(axis, row)| as_json(*axis, row)).collect::<Vec<_>>()));
    } else {
        eprint!("\r{:<40}\r", "");
        table(args, &rows);
    }
    let short = rows.iter().filter(|(_, row)| !row.passed()).count();
    if short == 0 { ExitCode::SUCCESS } else { fell_short(&format!("{short} faults fell short")) }
}

fn as_json(axis: u8, row: &Row) -> Value {
    json!({
        "axis": axis, "fault": row.fault, "row": row.row, "injected": row.injected, "idle": row.idle,
        "median_cycles": row.median, "worst_cycles": row.worst, "bound_cycles": row.bound,
        "named_by": { "a": row.named_by[0], "b": row.named_by[1], "crosscheck": row.named_by[2] },
        "returned": row.returned, "passed": row.passed(),
    })
}

fn table(args: &Args, rows: &[(u8, Row)]) {
    println!(
        "{} rounds each, seed {}, cycle 1 ms; times in cycles from the first faulty one",
        args.rounds, args.seed
    );
    println!(
        "{:4} {:18} {:36} {:>8} {:>6} {:>6} {:>6} {:>18} {:>8}",
        "axis",
        "fault",
        "row of the design",
        "injected",
        "median",
        "worst",
        "bound",
        "named by A/B/cross",
        "returned"
    );
    for (axis, row) in rows {
        let number = |value: Option<u64>| value.map_or("late".to_owned(), |value| value.to_string());
        let [a, b, crosscheck] = row.named_by;
        println!(
            "{axis:4} {:18} {:36} {:>8} {:>6} {:>6} {:>6} {:>18} {:>8} {}",
            row.fault,
            row.row,
            row.injected,
            number(row.median),
            number(row.worst),
            row.bound,
            format!("{a}/{b}/{crosscheck}"),
            row.returned,
            if row.passed() { "" } else { "<- fell short" }
        );
    }
}
