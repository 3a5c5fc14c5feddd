//! `safepair latency`: how fast and how steady, in real processes, against floors measured in the
//! same run.
//!
//! Absolute figures are the machine's; what is ours are the ratios.

mod floor;
mod growth;
mod histogram;
mod load;
mod place;
mod reaction;
mod report;
mod sampler;

use std::{fs, path::PathBuf, process::ExitCode, thread, time::Duration};

use shm_schema::cell::Kind;
use shm_schema::report::Report;
use sim::random::Random;
use sim::shm::{Domain, Place};

use crate::machine_file;
use crate::master::Master;
use crate::report::{bad_input, fell_short};
use crate::run::{Machine, Plan, Role, RunFolder, Set, SetArgs, default_machine};
use crate::watch::Watch;
use histogram::{Line, Times};
use load::{Load, Running};
use place::Seat;

/// Measures wake-up, cells, reaction and deaths, against a bare timer and a bare seqlock.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Parameter file. Default: the embedded axis.
    #[arg(long)]
    params: Option<PathBuf>,
    /// Cycle, µs.
    #[arg(long, default_value_t = 1_000, value_parser = clap::value_parser!(u32).range(125..=4_000))]
    period_us: u32,
    /// Cycles to look at.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(100..=1_000_000_000))]
    cycles: u64,
    /// Minutes instead of cycles.
    #[arg(long, conflicts_with = "cycles")]
    minutes: Option<f64>,
    /// Axes: those of the parameter file in turn.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=64))]
    axes: u8,
    /// Numbers of axes over which the processor time of a cycle is drawn, as 1,8,64.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u8).range(1..=64))]
    growth: Vec<u8>,
    /// Requests of STO at random instants.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    reactions: u64,
    /// Times each process is killed.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(0..=10_000))]
    kills: u64,
    /// Load beside the measurement.
    #[arg(long, value_enum, value_delimiter = ',')]
    load: Vec<Load>,
    /// Seed of the random instants.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for the report (HTML, SVG, JSON).
    #[arg(long, default_value = "latency")]
    out: PathBuf,
    /// Run folder. Default: /run/safepair for root.
    #[arg(long)]
    run_dir: Option<PathBuf>,
    /// Options of the set.
    #[command(flatten)]
    set: SetArgs,
    /// The result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Everything that was measured.
#[derive(Debug, serde::Serialize)]
pub struct Results {
    /// The machine and how the set ran.
    pub machine: Vec<(String, String)>,
    /// The table.
    pub lines: Vec<Line>,
    /// Exchanges whose sample A, B skipped.
    pub skipped: [u64; 2],
    /// Mean processor time of one cycle, µs: A, B, crosscheck.
    pub cycle_cpu_us: [Option<f64>; 3],
    /// The same over the number of axes.
    pub growth: Vec<growth::Point>,
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let plan = match plan(args, args.axes) {
        Ok(plan) => plan,
        Err(line) => return bad_input(&line),
    };
    let written = measure(args, &plan).and_then(|results| {
        report::write(&results, &args.out).map_err(|error| format!("{}: {error}", args.out.display()))?;
        Ok(results)
    });
    match written {
        Ok(results) if args.json => {
            println!("{}", serde_json::json!(results));
            ExitCode::SUCCESS
        }
        Ok(results) => {
            print!("{}", report::table(&results));
            println!("report: {}", args.out.join("latency.html").display());
            ExitCode::SUCCESS
        }
        Err(line) => fell_short(&line),
    }
}

fn plan(args: &Args, axes: u8) -> Result<Plan, String> {
    let machine = args.params.as_deref().map_or_else(default_machine, machine_file::read)?;
    if machine.axes.is_empty() {
        return Err("the parameter file has no axis".into());
    }
    let numbered = (1..=axes).zip(machine.axes.iter().cycle());
    let copies = numbered.map(|(number, axis)| params::AxisSet { number, ..axis.clone() }).collect();
    let axes = params::Machine { axes: copies, ..machine };
    let mut set = args.set.clone();
    set.cycle_us(args.period_us);
    fs::create_dir_all(&args.out).map_err(|error| format!("{}: {error}", args.out.display()))?;
    set.plan(&Machine::of(&axes), &RunFolder::new(args.run_dir.clone()))
}

fn measure(args: &Args, plan: &Plan) -> Result<Results, String> {
    let cycle_ns = u64::from(plan.timing.cycle_us) * 1_000;
    let cycles = args.minutes.map_or(args.cycles, |minutes| (minutes * 6e10 / cycle_ns as f64) as u64);
    let mut random = Random::new(args.seed);
    let load = Running::start(&args.load, &args.out);
    let say = |text: &str| {
        if !args.json {
            eprintln!("{text}");
        }
    };
    say(&plan.timing.to_string());

    say(&format!("cycles: {cycles} at {} µs, {} axes", plan.timing.cycle_us, plan.axes.len()));
    let set = Set::start(plan).map_err(|error| error.to_string())?;
    let cycled = in_cycles(plan, &set, cycle_ns, cycles);
    say(&format!("reactions: {} requests of STO", args.reactions));
    let reacted = cycled.and_then(|c| Ok((c, reaction::requests(&set, plan, args.reactions, &mut random)?)));
    set.stop();
    let (cycled, (first_off, both_off)) = reacted?;

    say("cells: against a seqlock");
    let (cell, lock) = cells(plan)?;
    let a_seat = seat(plan, 0);
    say("cyclictest, where it is installed");
    let cyclictest = floor::cyclictest(a_seat, plan.timing.cycle_us.into(), cycles.min(20_000));
    let deaths = deaths(args, plan, &mut random, &say)?;
    let growth = growth::measure(args, &say)?;
    drop(load);

    let bare = Some(("bare timer", &cycled.floor));
    let mut lines = vec![Line::new("bare timer", &cycled.floor, None)];
    lines.extend(cyclictest.iter().map(|times| Line::new("cyclictest", times, None)));
    for (name, woken) in ["channel A", "channel B", "crosscheck"].iter().zip(&cycled.stamps.woken) {
        lines.push(Line::new(format!("{name}: wake-up"), woken, bare));
    }
    lines.push(Line::new("sample to agreement", &cycled.stamps.exchange, None));
    lines.push(Line::new("bare seqlock: write to read", &lock, None));
    lines.push(Line::new("cell: write to read", &cell, Some(("bare seqlock", &lock))));
    lines.push(Line::new("STO command to torque off", &first_off, None));
    lines.push(Line::new("STO command to both paths off", &both_off, None));
    lines.extend(deaths);
    Ok(Results {
        machine: report::machine(args, plan),
        lines,
        skipped: cycled.stamps.skipped,
        cycle_cpu_us: cycled.cpu_us,
        growth,
    })
}

struct Cycled {
    stamps: sampler::Stamps,
    floor: Times,
    cpu_us: [Option<f64>; 3],
}

/// An axis in motion for `cycles`, with the bare timer on the core of A in the same minutes.
fn in_cycles(plan: &Plan, set: &Set, cycle_ns: u64, cycles: u64) -> Result<Cycled, String> {
    let domain = set.domain().ok_or("no shared memory")?;
    let axis = plan.axes.first().copied().ok_or("no axis")?;
    let watch = Watch::open(domain, axis).map_err(|error| error.to_string())?;
    let master = Master::connect(&plan.folder, axis)?;
    reaction::awaits(&watch)?;
    reaction::energise(&watch, &master)?;
    master.set_point(400.0)?;
    let sampler = sampler::Sampler::start(domain, axis, cycle_ns).map_err(|error| error.to_string())?;
    // Behind all phases of the set, so that it delays nobody in the cycle.
    let bare = floor::BareTimer::start(seat(plan, 0), cycle_ns, cycle_ns / 16 * 15);
    let processes = [Role::ChannelA, Role::ChannelB, Role::Crosscheck].map(|role| set.process(role));
    let before = processes.map(cpu_ns);
    thread::sleep(Duration::from_nanos(cycle_ns.saturating_mul(cycles)));
    let after = processes.map(cpu_ns);
    let floor = bare.finish();
    let stamps = sampler.finish();
    let mut cpu_us = [None; 3];
    for (mean, (before, after)) in cpu_us.iter_mut().zip(before.into_iter().zip(after)) {
        *mean = before.zip(after).map(|(before, after)| (after - before) as f64 / cycles as f64 / 1e3);
    }
    Ok(Cycled { stamps, floor, cpu_us })
}

/// Processor time of a process's first thread, which is its cycle, ns.
fn cpu_ns(process: Option<u32>) -> Option<u64> {
    let process = process?;
    let text = fs::read_to_string(format!("/proc/{process}/task/{process}/schedstat")).ok()?;
    text.split_whitespace().next()?.parse().ok()
}

fn seat(plan: &Plan, at: usize) -> Seat {
    Seat { core: plan.cpus.get(at).copied().flatten(), priority: plan.priority }
}

/// In a domain of its own, so that nobody else reads or writes.
fn cells(plan: &Plan) -> Result<(Times, Times), String> {
    let place =
        Place::new(plan.folder.domain().join("latency"), format!("latency_{}", std::process::id()), 1);
    let failed = |error: sim::shm::DomainError| error.to_string();
    let domain = Domain::create(&place, &[1]).map_err(failed)?;
    let writer = domain.writers::<Report>(Kind::ReportA, &[1]).map_err(failed)?.into_iter().next();
    let reader = domain.readers::<Report>(Kind::ReportA, &[1]).map_err(failed)?.into_iter().next();
    // Busy threads at real-time priority would take a whole core from the rest of the machine.
    let seats = [Seat { priority: 0, ..seat(plan, 0) }, Seat { priority: 0, ..seat(plan, 1) }];
    let blocks = 40;
    let measured = writer.zip(reader).map(|(w, r)| floor::cell_against_seqlock(w, r, seats, blocks));
    drop(domain);
    let wiped = place.wipe();
    let _ = fs::remove_dir_all(place.root());
    wiped.map_err(failed)?;
    measured.ok_or("no cell".into())
}

fn deaths(args: &Args, plan: &Plan, random: &mut Random, say: &dyn Fn(&str)) -> Result<Vec<Line>, String> {
    let mut lines = Vec::new();
    for role in Role::ALL {
        if args.kills == 0 {
            break;
        }
        say(&format!("deaths: {role}, {} times", args.kills));
        let mut both = Times::default();
        for _ in 0..args.kills {
            let [_, off_ns] = reaction::death(plan, role, random)?;
            both.add(off_ns);
        }
        lines.push(Line::new(format!("death of {role} to both paths off"), &both, None));
    }
    Ok(lines)
}
