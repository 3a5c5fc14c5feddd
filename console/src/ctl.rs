//! `safepair ctl`: what a running set says, and what the simulated master shall do.
//!
//! Status only reads cells; a status that hangs, dies or floods changes nothing (design 3.7).

use std::{fmt::Write as _, fs, path::PathBuf, process::ExitCode, time::Duration};

use params::AxisSet;
use serde_json::{Value, json};
use shm_schema::error::ErrorList;
use shm_schema::report::Report;
use sim::replay::{Words, code_text, status_bits};

use crate::master::Master;
use crate::report::{bad_input, fell_short};
use crate::run::RunFolder;
use crate::watch::{Frame, Watch, domain_of};

/// Commands and asks a running set.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Run folder of the set. Default: /run/safepair for root.
    #[arg(long, global = true)]
    run_dir: Option<PathBuf>,
    /// Axis, 1 to 64; status: absent for all.
    #[arg(long, global = true)]
    axis: Option<u8>,
    /// The answer as JSON.
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    order: Order,
}

/// What to do.
#[derive(Debug, clap::Subcommand)]
enum Order {
    /// Phase, torque, functions, position, speed and errors of every axis.
    Status,
    /// An edge of whatever acknowledges in the profile.
    Acknowledge,
    /// The drive's non-safe command "clear error", for a moment (AMK-ACK-02).
    Clear,
    /// Request functions by the names of the profile's control word.
    Request {
        /// For example SLS1, SOS, STO; ETG: SLS_1.
        #[arg(required = true)]
        functions: Vec<String>,
    },
    /// Take requests back.
    Release {
        /// As for request.
        #[arg(required = true)]
        functions: Vec<String>,
    },
    /// The speed the simulated drive shall turn with, rpm.
    SetPoint {
        /// Signed.
        #[arg(allow_negative_numbers = true)]
        rpm: f64,
    },
    /// Levels of the simulated inputs: `se1=10`, `ais=1`.
    Input {
        /// `se1` to `se4` with 11, 10, 01, 00; `ais`, `aie` with 0, 1.
        #[arg(required = true)]
        levels: Vec<String>,
    },
    /// A fault of the simulated drive: stale-encoder, freeze-enc1, stuck-path-a …, none.
    Fault {
        /// Its name in traces.
        name: String,
    },
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let folder = RunFolder::new(args.run_dir.clone());
    let instruction = match &args.order {
        Order::Status => return status(args, &folder),
        Order::Acknowledge => json!({ "acknowledge": true }),
        Order::Clear => return clear(args, &folder),
        Order::Request { functions } => json!({ "request": functions }),
        Order::Release { functions } => json!({ "release": functions }),
        Order::SetPoint { rpm } => json!({ "set_point_rpm": rpm }),
        Order::Fault { name } => json!({ "fault": name }),
        Order::Input { levels } => match inputs(levels) {
            Ok(inputs) => json!({ "inputs": inputs }),
            Err(line) => return bad_input(&line),
        },
    };
    tell(args, &folder, &[instruction])
}

fn inputs(levels: &[String]) -> Result<Value, String> {
    let pair = |text: &String| {
        let (name, level) = text.split_once('=')?;
        Some((name.to_owned(), Value::from(level)))
    };
    let pairs = levels.iter().map(|text| pair(text).ok_or_else(|| format!("{text:?}: expected NAME=LEVEL")));
    Ok(Value::Object(pairs.collect::<Result<_, _>>()?))
}

/// A level that is taken back: its edge is what counts.
fn clear(args: &Args, folder: &RunFolder) -> ExitCode {
    tell(args, folder, &[json!({ "clear_error": true }), json!({ "clear_error": false })])
}

fn tell(args: &Args, folder: &RunFolder, instructions: &[Value]) -> ExitCode {
    let master = match Master::connect(folder, args.axis.unwrap_or(1)) {
        Ok(master) => master,
        Err(line) => return fell_short(&line),
    };
    for (at, instruction) in instructions.iter().enumerate() {
        if at > 0 {
            // Longer than the longest cycle, so that every level is seen.
            std::thread::sleep(Duration::from_millis(50));
        }
        if let Err(line) = master.send(instruction) {
            return bad_input(&line);
        }
    }
    if args.json {
        println!("{}", json!({ "taken": instructions }));
    }
    ExitCode::SUCCESS
}

fn status(args: &Args, folder: &RunFolder) -> ExitCode {
    let sets = match sets(folder, args.axis) {
        Ok(sets) => sets,
        Err(line) => return fell_short(&line),
    };
    let domain = match domain_of(folder) {
        Ok(domain) => domain,
        Err(line) => return fell_short(&line),
    };
    let mut seen = Vec::new();
    for set in &sets {
        match Watch::open(&domain, set.number).map(|watch| watch.now()) {
            Ok(Some(frame)) => seen.push((set, frame)),
            Ok(None) => return fell_short(&format!("axis {}: not every cell is written yet", set.number)),
            Err(error) => return fell_short(&format!("axis {}: {error}", set.number)),
        }
    }
    if args.json {
        let all: Vec<Value> = seen.iter().map(|(set, frame)| as_json(set, frame)).collect();
        println!("{}", Value::from(all));
    } else {
        seen.iter().for_each(|(set, frame)| print!("{}", in_words(set, frame)));
    }
    ExitCode::SUCCESS
}

/// The axes of the running set, from the images it runs with.
///
/// # Errors
/// One line: no set runs, or its images cannot be read.
pub fn sets(folder: &RunFolder, only: Option<u8>) -> Result<Vec<AxisSet>, String> {
    let images = folder.images();
    let one = |axis: u8| {
        let path = images.join(format!("axis-{axis:02}.a.img"));
        let octets = fs::read(&path).ok()?;
        let image = params::Image::read(&octets).map_err(|error| format!("{}: {error}", path.display()));
        Some(image.map(|image| {
            let profile = image.profile().unwrap_or(shm_schema::profile::Profile::None);
            AxisSet { values: image.values, ..AxisSet::delivery(profile, axis, &image.serial) }
        }))
    };
    let wanted = (1..=64).filter(|axis| only.is_none_or(|only| only == *axis));
    let sets = wanted.filter_map(one).collect::<Result<Vec<_>, _>>()?;
    if sets.is_empty() {
        return Err(format!("{}: no set runs with such an axis", images.display()));
    }
    Ok(sets)
}

fn codes(set: &AxisSet, errors: &ErrorList) -> Vec<String> {
    let one = |code| {
        let mut text = String::new();
        code_text(&mut text, set.profile, code);
        text
    };
    errors.iter().map(one).collect()
}

/// Status bits that are 1, by name.
fn functions(set: &AxisSet, frame: &Frame) -> Vec<String> {
    let bits = status_bits(set);
    let mut set_bits: Vec<_> = bits.iter().filter(|(_, bit)| frame.agreement.status.bit(**bit)).collect();
    set_bits.sort_by_key(|(_, bit)| **bit);
    set_bits.into_iter().map(|(name, _)| name.clone()).collect()
}

fn status_word(set: &AxisSet, frame: &Frame) -> String {
    let mut text = String::new();
    Words::of(set).write_status(&mut text, &frame.agreement.status);
    text
}

/// One axis as an object.
pub fn as_json(set: &AxisSet, frame: &Frame) -> Value {
    let side = |report: &Report| {
        json!({
            "exchange": report.exchange,
            "phase": format!("{:?}", report.phase),
            "stop": format!("{:?}", report.stop),
            "ready": report.ready,
            "driving": report.driving,
            "position": report.position,
            "speed": f64::from(report.speed_mrpm) / 1_000.0,
            "errors": codes(set, &report.errors),
        })
    };
    json!({
        "axis": set.number,
        "profile": set.profile.name(),
        "torque": frame.readback.1.path_a & frame.readback.1.path_b,
        "path_a": frame.readback.1.path_a,
        "path_b": frame.readback.1.path_b,
        "status": status_word(set, frame),
        "status_bits": functions(set, frame),
        "position": frame.agreement.position,
        "speed": f64::from(frame.agreement.speed_mrpm) / 1_000.0,
        "a": side(&frame.a),
        "b": side(&frame.b),
        "crosscheck": { "permit": frame.agreement.permit, "errors": codes(set, &frame.agreement.errors) },
    })
}

/// One axis for a person.
pub fn in_words(set: &AxisSet, frame: &Frame) -> String {
    let paths = frame.readback.1;
    let torque = if paths.path_a & paths.path_b { "TORQUE" } else { "no torque" };
    let speed = f64::from(frame.agreement.speed_mrpm) / 1_000.0;
    let mut text = format!(
        "axis {} ({}): {torque}, {speed:.1} rpm, position {}, status {} [{}]\n",
        set.number,
        set.profile.name(),
        frame.agreement.position,
        status_word(set, frame),
        functions(set, frame).join(" "),
    );
    for (name, report) in [("channel A", &frame.a), ("channel B", &frame.b)] {
        // Writing into a string does not fail.
        let _ = writeln!(
            text,
            "  {name}: {:?}, stop {:?}, ready {}, driving {}",
            report.phase, report.stop, report.ready, report.driving
        );
    }
    let standing = [("A", &frame.a.errors), ("B", &frame.b.errors), ("crosscheck", &frame.agreement.errors)];
    for (name, errors) in standing {
        for code in codes(set, errors) {
            let _ = writeln!(text, "  {code} ({name}); safepair explain {code} says what to do");
        }
    }
    text
}
