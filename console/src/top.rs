//! `safepair top`: a running set in the terminal, looked at ten times a second.
//!
//! It only reads; if it hangs or dies, nothing changes.

use std::{
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
    sync::atomic::Ordering,
    thread,
    time::Duration,
};

use crate::ctl::{as_json, in_words, sets};
use crate::report::fell_short;
use crate::run::{RunFolder, stop_flag};
use crate::watch::{Watch, domain_of};

/// Clear the screen, cursor to the top left.
const CLEAR: &str = "\x1b[H\x1b[J";

/// Live view of a running set.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Run folder of the set. Default: /run/safepair for root.
    #[arg(long)]
    run_dir: Option<PathBuf>,
    /// Milliseconds between two looks.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(10..=60_000))]
    every_ms: u64,
    /// Ends after so many looks; 0: until Ctrl-C or the end of the set.
    #[arg(long, default_value_t = 0)]
    count: u64,
    /// One JSON array a look.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    match look(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(line) => fell_short(&line),
    }
}

fn look(args: &Args) -> Result<(), String> {
    let folder = RunFolder::new(args.run_dir.clone());
    let sets = sets(&folder, None)?;
    let domain = domain_of(&folder)?;
    let open = |axis: u8| Watch::open(&domain, axis).map_err(|error| error.to_string());
    let watches = sets.iter().map(|set| open(set.number)).collect::<Result<Vec<_>, _>>()?;
    let stop = stop_flag();
    let mut looks = 0;
    let mut standing = 0;
    let mut newest = 0;
    while !stop.load(Ordering::Relaxed) {
        let frames: Vec<_> = sets.iter().zip(watches.iter().map(Watch::now)).collect();
        let exchange =
            frames.iter().filter_map(|(_, frame)| Some(frame.as_ref()?.a.exchange)).max().unwrap_or(0);
        standing = if exchange == newest { standing + 1 } else { 0 };
        newest = exchange;
        let seen = frames.iter().filter_map(|(set, frame)| Some((set, frame.as_ref()?)));
        let text = if args.json {
            serde_json::Value::from(seen.map(|(set, frame)| as_json(set, frame)).collect::<Vec<_>>())
                .to_string()
        } else {
            let still = if standing > 3 { "NOTHING MOVES: the set has ended or is stopped\n" } else { "" };
            CLEAR.to_owned() + still + &seen.map(|(set, frame)| in_words(set, frame)).collect::<String>()
        };
        // A closed pipe has seen enough.
        if writeln!(io::stdout(), "{text}").is_err() {
            return Ok(());
        }
        looks += 1;
        let over = (args.count > 0) & (looks >= args.count);
        if over || standing > 50 {
            return Ok(());
        }
        thread::sleep(Duration::from_millis(args.every_ms));
    }
    Ok(())
}
