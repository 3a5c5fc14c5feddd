//! `safepair soak`: many lives in virtual time, or one long run of real processes.

use std::{
    fs,
    path::PathBuf,
    process::ExitCode,
    thread,
    time::{Duration, Instant},
};

use params::AxisSet;
use serde_json::json;
use sim::soak::{Act, Plan as Life, live, smallest, trace_csv};

use crate::machine_file;
use crate::master::Master;
use crate::report::{bad_input, fell_short};
use crate::run::{Machine, RunFolder, Set, SetArgs, default_machine, stop_flag};
use crate::watch::Watch;

/// Cycles of one life: five minutes.
const LIFE_CYCLES: u64 = 300_000;
/// Between two lines of progress.
const PROGRESS: Duration = Duration::from_secs(2);

/// Runs for long.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Parameter file. Default: the embedded axis.
    #[arg(long)]
    params: Option<PathBuf>,
    /// As fast as it goes, in virtual time. Without it: real processes in real time.
    #[arg(long = "virtual")]
    virtual_time: bool,
    /// Seed of the first life; each further life takes the next.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Length in virtual or real hours.
    #[arg(long, default_value_t = 1.0)]
    hours: f64,
    /// In virtual time one event in so many is a fault; 0: none.
    #[arg(long, default_value_t = 20)]
    faults: i64,
    /// Folder for the trace of a failing life.
    #[arg(long, default_value = ".")]
    out: PathBuf,
    /// Run folder of the real set. Default: /run/safepair for root.
    #[arg(long)]
    run_dir: Option<PathBuf>,
    /// Options of the real set.
    #[command(flatten)]
    set: SetArgs,
    /// The result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let machine = match args.params.as_deref().map_or_else(default_machine, machine_file::read) {
        Ok(machine) => machine,
        Err(line) => return bad_input(&line),
    };
    if !(args.hours > 0.0 && args.hours < 1e7) {
        return bad_input("--hours: expected more than 0 and less than 10,000,000");
    }
    if args.virtual_time { in_virtual_time(args, &machine) } else { in_real_time(args, &machine) }
}

#[derive(Debug, Default)]
struct Sum {
    lives: u64,
    cycles: u64,
    trips: u64,
    energised: u64,
}

fn in_virtual_time(args: &Args, machine: &params::Machine) -> ExitCode {
    let wanted = (args.hours * 3_600_000.0) as u64;
    let start = Instant::now();
    let mut told = start;
    let mut sum = Sum::default();
    let mut seed = args.seed;
    while sum.cycles < wanted {
        for set in &machine.axes {
            let cycles = LIFE_CYCLES.min(wanted - sum.cycles.min(wanted)).max(1);
            let plan = Life::random(set, seed, cycles, args.faults);
            let outcome = live(set, &plan);
            sum.lives += 1;
            sum.cycles += outcome.cycles;
            sum.trips += outcome.trips;
            sum.energised += outcome.energised;
            if let Some((cycle, broken)) = outcome.broken {
                return failed(args, set, &plan, &format!("seed {seed}, cycle {cycle}: {broken}"));
            }
        }
        seed = seed.wrapping_add(1);
        if !args.json && told.elapsed() > PROGRESS {
            told = Instant::now();
            let share = 100.0 * sum.cycles as f64 / wanted as f64;
            eprint!("\r{share:5.1} %, {} lives, {} trips", sum.lives, sum.trips);
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    let ratio = sum.cycles as f64 / 1_000.0 / seconds;
    if args.json {
        println!(
            "{}",
            json!({ "lives": sum.lives, "cycles": sum.cycles, "trips": sum.trips, "cycles_with_torque": sum.energised,
                    "seconds": seconds, "times_real_time": ratio, "first_seed": args.seed })
        );
    } else {
        println!(
            "\r{} lives, {} cycles ({:.1} h), {} trips, torque in {:.0} % of the time; every invariant held; {ratio:.0} x \
             real time",
            sum.lives,
            sum.cycles,
            sum.cycles as f64 / 3.6e6,
            sum.trips,
            100.0 * sum.energised as f64 / sum.cycles as f64
        );
    }
    ExitCode::SUCCESS
}

/// Writes the smallest life that fails in the same way, for `safepair replay`.
fn failed(args: &Args, set: &AxisSet, plan: &Life, line: &str) -> ExitCode {
    let Some(failure) = smallest(set, plan) else {
        return fell_short(&format!("{line}; it does not fail again, which is a defect of its own"));
    };
    let path = args.out.join(format!("soak-axis-{}-seed-{}.csv", set.number, plan.seed));
    match fs::write(&path, trace_csv(set, &failure.plan)) {
        Ok(()) => fell_short(&format!(
            "{line}; the smallest life that does so has {} events and is written to {} for `safepair replay`",
            failure.plan.events.len(),
            path.display()
        )),
        Err(error) => fell_short(&format!("{line}; {}: {error}", path.display())),
    }
}

/// Random commands to a real set. A trip is no failure: hosts stall. That torque is on while a
/// channel does not permit it, or that a process ends, is one.
fn in_real_time(args: &Args, machine: &params::Machine) -> ExitCode {
    let folder = RunFolder::new(args.run_dir.clone());
    let plan = match args.set.plan(&Machine::of(machine), &folder) {
        Ok(plan) => plan,
        Err(line) => return bad_input(&line),
    };
    eprintln!("{}", plan.timing);
    let stop = stop_flag();
    let mut set = match Set::start(&plan) {
        Ok(set) => set,
        Err(error) => return fell_short(&error.to_string()),
    };
    let length = Duration::from_secs_f64(args.hours * 3_600.0);
    let played = play(args, machine, &folder, &mut set, length, &stop);
    set.stop();
    match played {
        Ok((commands, trips)) => {
            if args.json {
                println!("{}", json!({ "commands": commands, "trips": trips, "hours": args.hours }));
            } else {
                println!("\r{commands} commands, {trips} trips, every process alive to the end");
            }
            ExitCode::SUCCESS
        }
        Err(line) => fell_short(&line),
    }
}

fn play(
    args: &Args,
    machine: &params::Machine,
    folder: &RunFolder,
    set: &mut Set,
    length: Duration,
    stop: &std::sync::atomic::AtomicBool,
) -> Result<(u64, u64), String> {
    let axis = machine.axes.first().ok_or("no axis")?;
    let master = Master::connect(folder, axis.number)?;
    let watch =
        Watch::open(set.domain().ok_or("no shared memory")?, axis.number).map_err(|e| e.to_string())?;
    let cycles = (length.as_millis() as u64).max(1);
    let life = Life::random(axis, args.seed, cycles, 0);
    let (mut commands, mut trips, mut had_torque) = (0, 0, false);
    let start = Instant::now();
    let mut events = life.events.iter().peekable();
    while start.elapsed() < length && !stop.load(std::sync::atomic::Ordering::Relaxed) {
        if let Some((role, status)) = set.ended() {
            return Err(format!("{role} ended ({status}) after {:.0} s", start.elapsed().as_secs_f64()));
        }
        let now = start.elapsed().as_millis() as u64;
        while let Some(event) = events.next_if(|event| event.cycle <= now) {
            if let Act::Tell(instruction) = &event.act {
                commands += 1;
                master.send(&json!(instruction))?;
            }
        }
        let torque = watch.now().is_some_and(|frame| frame.readback.1.path_a & frame.readback.1.path_b);
        trips += u64::from(had_torque && !torque);
        had_torque = torque;
        thread::sleep(Duration::from_millis(1));
    }
    Ok((commands, trips))
}
