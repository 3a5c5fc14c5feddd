//! `safepair run`: the supervisor of one set of processes.
//!
//! It owns the lock, the domain and the images, starts the four processes, and waits. The
//! end of any of them ends all (design 3.7); nothing is ever restarted singly.

mod ending;
mod machine;
mod place;
mod set;
mod timing;

pub use ending::stop_flag;
pub use machine::{Bus, Fieldbus, Machine};
pub use place::RunFolder;
pub use set::{Ended, Plan, Role, Set};
pub use timing::{Timing, Wish};

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    time::Duration,
};

use crate::machine_file;
use crate::report::{bad_input, fell_short};

/// Start everything for one machine: producer, both channels, crosscheck.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file. Default: `safepair.toml` here, else one simulated axis.
    #[arg(long)]
    machine: Option<PathBuf>,
    /// Only a parameter set (TOML): a simulated machine with its axes.
    #[arg(long, conflicts_with = "machine")]
    params: Option<PathBuf>,
    /// Folder of a sealed set (`safepair params seal`), instead of a file: its images are used
    /// as they were sealed. A set that was loaded but never validated is erased by this start.
    #[arg(long, conflicts_with_all = ["machine", "params"])]
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

/// Options that shape a set, common to all commands that start one; they win over the file.
#[derive(Debug, Clone, clap::Args)]
pub struct SetArgs {
    /// Timing: strict (1 ms; needs SCHED_FIFO and isolated cores) or relaxed (4 ms, ages and
    /// partner time-outs times ten; simulation only). Auto takes what the machine can.
    #[arg(long, value_enum)]
    timing: Option<Wish>,
    /// Cycle, µs (125 to 4,000). Default: by the timing.
    #[arg(long, value_parser = clap::value_parser!(u32).range(125..=4_000))]
    cycle_us: Option<u32>,
    /// Cores of channel A, channel B, crosscheck and the producer; "none": any.
    #[arg(long, value_delimiter = ',')]
    cpus: Option<Vec<String>>,
    /// SCHED_FIFO priority of the monitors; 0: normal scheduling. Default: 80.
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=98))]
    priority: Option<u8>,
    /// Inhibit path of channel A: "sim", or "gpio:CHIP:LINE".
    #[arg(long)]
    inhibit_a: Option<String>,
    /// Inhibit path of channel B.
    #[arg(long)]
    inhibit_b: Option<String>,
    /// Your statement of the evaluator behind a GPIO path: that it drops the path after three
    /// missing edges. Required for GPIO (assumption of use).
    #[arg(long)]
    evaluator: Option<String>,
    /// Accept the unprotected control word of the simulated master: the default where both paths
    /// are simulated, an error with GPIO.
    #[arg(long)]
    plain_command: bool,
    /// File of the logbook.
    #[arg(long)]
    logbook: Option<PathBuf>,
    /// Where the simulated drive's gateway listens for black-channel frames (UDP).
    #[arg(long)]
    gateway: Option<std::net::SocketAddr>,
}

impl SetArgs {
    /// The plan of a set for `machine`.
    ///
    /// # Errors
    /// One line that says what contradicts what.
    pub fn plan(&self, machine: &Machine, folder: &RunFolder) -> Result<Plan, String> {
        let path = |wish: &Option<String>, file: &Option<String>| {
            wish.as_ref().or(file.as_ref()).map_or_else(|| "sim".to_owned(), Clone::clone)
        };
        let inhibit_a = path(&self.inhibit_a, &machine.inhibit.a);
        let inhibit_b = path(&self.inhibit_b, &machine.inhibit.b);
        let evaluator = self.evaluator.as_ref().or(machine.inhibit.evaluator.as_ref()).cloned();
        let gpio = [&inhibit_a, &inhibit_b].iter().any(|path| path.as_str() != "sim");
        let cpus = self.cpus(machine);
        let priority = self.priority.or(machine.priority).unwrap_or(80);
        let wish = self.timing.unwrap_or(machine.timing);
        let cycle_us = self.cycle_us.or(machine.period_us);
        let timing = Timing::choose(wish, cycle_us, cpus.get(..3).unwrap_or_default(), priority);
        if gpio {
            self.refuse_gpio(&timing, evaluator.is_some())?;
        }
        let own_program = machine.producer.program.is_some();
        Ok(Plan {
            folder: folder.clone(),
            axes: machine.images.iter().map(|(axis, _, _)| *axis).collect(),
            images: machine.images.clone(),
            timing,
            cpus,
            priority,
            inhibit_a,
            inhibit_b,
            evaluator,
            plain_command: !gpio && !own_program,
            producer: machine.producer.program.clone(),
            script: machine.producer.script.clone(),
            gateway: self.gateway.or(machine.producer.gateway),
            buses: machine.buses.clone(),
            logbook: self.logbook.as_ref().or(machine.logbook.as_ref()).cloned(),
        })
    }

    /// Sets the cycle, unless another one was asked for.
    pub fn cycle_us(&mut self, cycle_us: u32) {
        self.cycle_us = self.cycle_us.or(Some(cycle_us));
    }

    fn cpus(&self, machine: &Machine) -> Vec<Option<u32>> {
        let usual = || match machine.cores.in_order() {
            // Two cores are enough for a simulation, and every machine has them or falls back.
            [None, None, None, None] => vec![Some(0), Some(1), Some(1), Some(0)],
            cores => cores.to_vec(),
        };
        self.cpus.as_ref().map_or_else(usual, |cpus| cpus.iter().map(|cpu| cpu.parse().ok()).collect())
    }

    fn refuse_gpio(&self, timing: &Timing, stated: bool) -> Result<(), String> {
        if self.plain_command {
            return Err(
                "--plain-command with a GPIO path: an unprotected command must not reach a real power stage"
                    .into(),
            );
        }
        if !stated {
            return Err(
                "a GPIO path needs --evaluator: state that yours drops the path after three missing edges"
                    .into(),
            );
        }
        if timing.is_relaxed() {
            return Err(format!("a GPIO path needs the strict timing: {timing}"));
        }
        Ok(())
    }
}

/// The axis that runs when no file says otherwise.
///
/// # Errors
/// None, unless the program itself is broken.
pub fn default_machine() -> Result<params::Machine, String> {
    machine_file::parse(include_str!("../demo/axis.toml"), Path::new("embedded axis"))
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
/// One line: there is no set that is sealed to this installation, or an image is missing.
fn sealed_images(folder: &Path) -> Result<Vec<Images>, String> {
    let at = |error: &dyn std::fmt::Display| format!("{}: {error}", folder.display());
    crate::params::start::verified(folder)?;
    let current = folder.join("current");
    let image =
        |axis: u8, channel: &str| std::fs::read(current.join(format!("axis-{axis:02}.{channel}.img")));
    let present = (1..=shm_schema::AXES_MAX as u8).filter(|axis| image(*axis, "a").is_ok());
    let read = |axis: u8| Ok((axis, image(axis, "a")?, image(axis, "b")?));
    let images = present.map(read).collect::<std::io::Result<Vec<_>>>().map_err(|error| at(&error))?;
    if images.is_empty() { Err(at(&"expected current/axis-NN.a.img of a sealed set")) } else { Ok(images) }
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let machine = match machine(args) {
        Ok(machine) => machine,
        Err(line) => return bad_input(&line),
    };
    let folder = RunFolder::new(args.run_dir.clone());
    let plan = match args.set.plan(&machine, &folder) {
        Ok(plan) => Plan { script: args.script.clone().or(plan.script), ..plan },
        Err(line) => return bad_input(&line),
    };
    say(args.json, "timing", &plan.timing.to_string());
    let stop = stop_flag();
    let mut set = match Set::start(&plan) {
        Ok(set) => set,
        Err(error) => return fell_short(&error.to_string()),
    };
    say(args.json, "running", &format!("axes {:?}; stop with Ctrl-C", plan.axes));
    let limit = (args.seconds > 0).then(|| Duration::from_secs(args.seconds));
    let ended = match set.wait(&stop, limit) {
        Ended::Asked => {
            say(args.json, "stopping", "SS1 requested; once more for STO at once");
            ending::brake(&mut set, &plan, &stop)
        }
        ended @ Ended::Process(..) => ended,
    };
    set.stop();
    match ended {
        Ended::Asked => {
            say(args.json, "stopped", "torque off");
            ExitCode::SUCCESS
        }
        Ended::Process(role, status) => {
            fell_short(&format!("{role} ended ({status}): the whole set was stopped, torque off"))
        }
    }
}

fn machine(args: &Args) -> Result<Machine, String> {
    let here = PathBuf::from("safepair.toml");
    if let Some(folder) = &args.sealed {
        return sealed_images(folder).map(Machine::with_images);
    }
    if let Some(file) = &args.params {
        return machine_file::read(file).map(|set| Machine::of(&set));
    }
    match &args.machine {
        Some(file) => Machine::read(file),
        None if here.is_file() => Machine::read(&here),
        None => Machine::embedded(),
    }
}

fn say(json: bool, event: &str, text: &str) {
    if json {
        println!("{}", serde_json::json!({ "event": event, "text": text }));
    } else {
        println!("{event}: {text}");
    }
}
