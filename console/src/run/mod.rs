//! `safepair run`: the supervisor of one set of processes.
//!
//! It owns the lock, the domain and the images, starts the four processes, and waits. The
//! end of any of them ends all (design 3.7); nothing is ever restarted singly.

mod place;
mod set;

pub use place::RunFolder;
pub use set::{Ended, Plan, Role, Set};

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{Arc, atomic::AtomicBool},
    time::Duration,
};

use crate::report::{bad_input, fell_short};

/// Start everything for one machine: simulated drive, both channels, crosscheck.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Parameter set of the machine (TOML).
    #[arg(long, default_value = "machine.toml")]
    params: PathBuf,
    /// Folder of a sealed set (`safepair params seal`), instead of a file: its images are used
    /// as they were sealed. A set that was loaded but never validated is erased by this start.
    #[arg(long, conflicts_with = "params")]
    sealed: Option<PathBuf>,
    /// Run folder: lock, images, shared memory. Default: /run/safepair for root.
    #[arg(long)]
    run_dir: Option<PathBuf>,
    /// Options of the set.
    #[command(flatten)]
    set: SetArgs,
    /// Script of the simulated drive and master.
    #[arg(long)]
    script: Option<PathBuf>,
    /// Ends by itself after this many seconds; 0: runs until stopped.
    #[arg(long, default_value_t = 0)]
    seconds: u64,
    /// Events as JSON lines.
    #[arg(long)]
    json: bool,
}

/// Options that shape a set, common to all commands that start one.
#[derive(Debug, Clone, clap::Args)]
pub struct SetArgs {
    /// Cycle, µs (125 to 4,000). Default: 1,000; demo 4,000, because an ordinary host stalls for
    /// some milliseconds now and then, which is torque off at a shorter cycle.
    #[arg(long, value_parser = clap::value_parser!(u32).range(125..=4_000))]
    cycle_us: Option<u32>,
    /// Cores of channel A, channel B, crosscheck and the simulated drive; "none": any.
    #[arg(long, value_delimiter = ',', default_value = "0,1,1,0")]
    cpus: Vec<String>,
    /// SCHED_FIFO priority of the monitors; 0: normal scheduling.
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(u8).range(0..=98))]
    priority: u8,
    /// Inhibit path of channel A: "sim", or "gpio:CHIP:LINE".
    #[arg(long, default_value = "sim")]
    inhibit_a: String,
    /// Inhibit path of channel B.
    #[arg(long, default_value = "sim")]
    inhibit_b: String,
    /// Your statement of the evaluator behind a GPIO path: that it drops the path after three
    /// missing edges. Required for GPIO (assumption of use).
    #[arg(long)]
    evaluator: Option<String>,
    /// Accept the unprotected control word of the simulated master. Never with GPIO.
    #[arg(long, default_value_t = false)]
    plain_command: bool,
}

impl SetArgs {
    /// The same options with another default of the cycle.
    #[must_use]
    pub fn with_default_cycle(&self, cycle_us: u32) -> Self {
        Self { cycle_us: self.cycle_us.or(Some(cycle_us)), ..self.clone() }
    }

    /// The plan of a set that runs with `images`.
    ///
    /// # Errors
    /// One line that says what contradicts what.
    pub fn plan(&self, images: Vec<Images>, folder: &RunFolder) -> Result<Plan, String> {
        let gpio = [&self.inhibit_a, &self.inhibit_b].iter().any(|path| path.as_str() != "sim");
        let unprotected = gpio && self.plain_command;
        if unprotected {
            return Err(
                "--plain-command with a GPIO path: an unprotected command must not reach a real power stage"
                    .into(),
            );
        }
        let unstated = gpio && self.evaluator.is_none();
        if unstated {
            return Err(
                "a GPIO path needs --evaluator: state that yours drops the path after three missing edges"
                    .into(),
            );
        }
        Ok(Plan {
            folder: folder.clone(),
            axes: images.iter().map(|(axis, _, _)| *axis).collect(),
            images,
            cycle_us: self.cycle_us.unwrap_or(1_000),
            cpus: self.cpus.iter().map(|cpu| cpu.parse().ok()).collect(),
            priority: self.priority,
            inhibit_a: self.inhibit_a.clone(),
            inhibit_b: self.inhibit_b.clone(),
            evaluator: self.evaluator.clone(),
            plain_command: self.plain_command,
            script: None,
        })
    }
}

/// Reads a parameter set.
///
/// # Errors
/// Every finding, one a line.
pub fn read_machine(path: &Path) -> Result<params::Machine, String> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|error| format!("{name}: {error}"))?;
    params::parse(&text, &name)
        .map_err(|findings| findings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

/// Safety images of one axis: number, encoding A, encoding B.
pub type Images = (u8, Vec<u8>, Vec<u8>);

/// The images of a file that was only read: good for simulation and tests.
pub fn images_of(machine: &params::Machine) -> Vec<Images> {
    machine.axes.iter().map(|axis| (axis.number, axis.image_a(true), axis.image_b(true))).collect()
}

/// The images of a sealed set.
///
/// # Errors
/// One line: there is no validated set, or an image is missing.
fn sealed_images(folder: &Path) -> Result<Vec<Images>, String> {
    let at = |error: &dyn std::fmt::Display| format!("{}: {error}", folder.display());
    let erased = params::seal::restart(folder).map_err(|error| at(&error))?;
    if erased {
        return Err(at(
            &"expected a sealed set; none is there, or it was loaded without validation and is erased now",
        ));
    }
    let current = folder.join("current");
    let image =
        |axis: u8, channel: &str| std::fs::read(current.join(format!("axis-{axis:02}.{channel}.img")));
    let present = (1..=shm_schema::AXES_MAX as u8).filter(|axis| image(*axis, "a").is_ok());
    let read = |axis: u8| Ok((axis, image(axis, "a")?, image(axis, "b")?));
    let images = present.map(read).collect::<std::io::Result<Vec<_>>>().map_err(|error| at(&error))?;
    if images.is_empty() { Err(at(&"expected current/axis-NN.a.img of a sealed set")) } else { Ok(images) }
}

/// Sets a flag on SIGINT and SIGTERM.
pub fn stop_flag() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        // Cannot fail for these two; without it the signal would just end the process.
        let _ = signal_hook::flag::register(signal, Arc::clone(&stop));
    }
    stop
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let images = match &args.sealed {
        Some(folder) => sealed_images(folder),
        None => read_machine(&args.params).map(|machine| images_of(&machine)),
    };
    let images = match images {
        Ok(images) => images,
        Err(line) => return bad_input(&line),
    };
    let folder = RunFolder::new(args.run_dir.clone());
    let plan = match args.set.plan(images, &folder) {
        Ok(plan) => Plan { script: args.script.clone(), ..plan },
        Err(line) => return bad_input(&line),
    };
    let stop = stop_flag();
    let mut set = match Set::start(&plan) {
        Ok(set) => set,
        Err(error) => return fell_short(&error.to_string()),
    };
    say(args.json, "running", &format!("axes {:?}, cycle {} µs; stop with Ctrl-C", plan.axes, plan.cycle_us));
    let limit = (args.seconds > 0).then(|| Duration::from_secs(args.seconds));
    match set.wait(&stop, limit) {
        Ended::Asked => {
            set.stop();
            say(args.json, "stopped", "torque off");
            ExitCode::SUCCESS
        }
        Ended::Process(role, status) => {
            set.stop();
            fell_short(&format!("{role} ended ({status}): the whole set was stopped, torque off"))
        }
    }
}

fn say(json: bool, event: &str, text: &str) {
    if json {
        println!("{}", serde_json::json!({ "event": event, "text": text }));
    } else {
        println!("{event}: {text}");
    }
}
