//! `safepair demo`: the main job, with real processes, in some seconds, with a picture.

mod envelope;
mod story;

use std::{fs, path::PathBuf, process::ExitCode};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plotters::style::RGBColor;
use shm_schema::facts::amk_kw::status;
use sim::host::{Failure, Witness};

use crate::master::Master;
use crate::picture::{self, Chart, Curve, Lane};
use crate::report::{bad_input, fell_short};
use crate::run::{Machine, Plan, Role, RunFolder, Set, SetArgs, default_machine};
use crate::watch::{self, Frame, Recorder, Recording, Watch};
use envelope::{Restriction, envelope, value};
use story::{Event, Story, What};

/// A play that the host disturbed is tried so often.
const TRIES: u32 = 6;

/// A simulated axis runs, exceeds a limit, is stopped; then a channel is killed.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder for the picture and the timeline.
    #[arg(long, default_value = "demo")]
    out: PathBuf,
    /// Run folder: lock, images, shared memory. Default: /run/safepair for root.
    #[arg(long)]
    run_dir: Option<PathBuf>,
    /// Options of the set.
    #[command(flatten)]
    set: SetArgs,
    /// The result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> ExitCode {
    let machine = match default_machine() {
        Ok(machine) => machine,
        Err(line) => return bad_input(&line),
    };
    let folder = RunFolder::new(args.run_dir.clone());
    let plan = match args.set.plan(&Machine::of(&machine), &folder) {
        Ok(plan) => plan,
        Err(line) => return bad_input(&line),
    };
    match undisturbed(&plan, args.json) {
        Ok((events, recording)) => finish(args, &machine.axes[0].values, &events, &recording),
        Err(line) => fell_short(&line),
    }
}

/// Plays until the host left a whole play alone, or it failed by itself.
fn undisturbed(plan: &Plan, quiet: bool) -> Result<(Vec<Event>, Recording), String> {
    let played = Witness::start().undisturbed(
        TRIES,
        || play(plan, quiet),
        |attempt, stall| {
            if !quiet {
                let (stall_ms, next) = (stall.as_millis(), attempt + 1);
                println!("\nthis host stood still for {stall_ms} ms, which is torque off: once more ({next} of {TRIES})\n");
            }
        },
    );
    played.map_err(|(Failure::Own(line) | Failure::Host(line))| line)
}

fn play(plan: &Plan, quiet: bool) -> Result<(Vec<Event>, Recording), String> {
    let set = Set::start(plan).map_err(|error| error.to_string())?;
    let axis = plan.axes.first().copied().ok_or("no axis")?;
    let domain = set.domain().ok_or("no shared memory")?;
    let recorder = Recorder::start(domain, axis).map_err(|error| error.to_string())?;
    let watch = Watch::open(domain, axis).map_err(|error| error.to_string())?;
    let master = Master::connect(&plan.folder, axis)?;
    let origin = watch::now_ns();
    let tell = |event: &Event| {
        if !quiet {
            println!("{:8.3} s  {}", seconds(event.time_ns, origin), event.text);
        }
    };
    let mut story = Story::new(&watch, &master, &tell);
    let played = story.play().and_then(|()| {
        let channel = set.process(Role::ChannelB).ok_or("channel B has no process")?;
        kill(Pid::from_raw(channel as i32), Signal::SIGKILL).map_err(|error| error.to_string())?;
        story.after_kill()
    });
    let events = story.events;
    let recording = recorder.finish();
    set.stop();
    played.map(|()| (events, recording))
}

fn seconds(time_ns: u64, origin: u64) -> f64 {
    (time_ns as f64 - origin as f64) / 1e9
}

/// A condition of one observed instant.
type Seen = fn(&Frame) -> bool;

/// A measured reaction, ms.
#[derive(Debug, serde::Serialize)]
struct Reaction {
    what: &'static str,
    milliseconds: f64,
}

fn reactions(events: &[Event], recording: &Recording) -> Vec<Reaction> {
    let mut found = Vec::new();
    let frames = &recording.frames;
    if let Some(frame) = frames.iter().find(|frame| !frame.a.errors.is_empty()) {
        // From the sample that shows the violation to the report that reacts to it.
        if let Some(sample) = recording.samples.get(&frame.a.exchange) {
            let reported = frame.a.time_ns.saturating_sub(*sample) as f64 / 1e6;
            found.push(Reaction {
                what: "sample with the exceeded limit → channel A reacts",
                milliseconds: reported,
            });
        }
    }
    if let Some(killed) = events.iter().find(|event| event.what == What::Kill) {
        let off = |path: Seen| {
            let after = frames.iter().filter(|frame| frame.time_ns >= killed.time_ns);
            after
                .into_iter()
                .find(|frame| !path(frame))
                .map(|frame| (frame.readback.0 as f64 - killed.time_ns as f64) / 1e6)
        };
        let paths: [(&'static str, Seen); 2] = [
            ("channel B killed → path A off", |frame| frame.readback.1.path_a),
            ("channel B killed → path B off (dead-man)", |frame| frame.readback.1.path_b),
        ];
        found.extend(
            paths
                .into_iter()
                .filter_map(|(what, path)| Some(Reaction { what, milliseconds: off(path)?.max(0.0) })),
        );
    }
    found
}

fn finish(
    args: &Args,
    values: &std::collections::BTreeMap<u32, i32>,
    events: &[Event],
    recording: &Recording,
) -> ExitCode {
    let Some(first) = recording.frames.first() else {
        return fell_short("nothing was recorded");
    };
    let origin = events.first().map_or(first.time_ns, |event| event.time_ns);
    let reactions = reactions(events, recording);
    let chart = chart(values, events, recording, origin);
    let written = fs::create_dir_all(&args.out).and_then(|()| picture::write(&chart, &args.out.join("demo")));
    if let Err(error) = written {
        return fell_short(&format!("{}: {error}", args.out.display()));
    }
    if args.json {
        let told: Vec<_> = events
            .iter()
            .map(|event| serde_json::json!({ "t_s": seconds(event.time_ns, origin), "text": event.text }))
            .collect();
        println!("{}", serde_json::json!({ "events": told, "reactions": reactions, "out": args.out }));
    } else {
        println!("\nmeasured on this machine, simulated drive:");
        for reaction in &reactions {
            println!("  {:7.2} ms  {}", reaction.milliseconds, reaction.what);
        }
        println!("\npicture: {0}/demo.svg and {0}/demo.png", args.out.display());
    }
    ExitCode::SUCCESS
}

fn chart(
    values: &std::collections::BTreeMap<u32, i32>,
    events: &[Event],
    recording: &Recording,
    origin: u64,
) -> Chart {
    let at = |time_ns: u64| seconds(time_ns, origin);
    let frames = &recording.frames;
    let end = frames.last().map_or(1.0, |frame| at(frame.time_ns));
    let speed = |pick: fn(&Frame) -> i32| {
        let points = frames.iter().map(|frame| (at(frame.time_ns), f64::from(pick(frame)) / 1_000.0));
        points.filter(|(time, _)| *time >= 0.0).collect::<Vec<_>>()
    };
    // A dead channel says nothing more: its curve ends with it.
    let killed = events.iter().find(|event| event.what == What::Kill).map_or(end, |event| at(event.time_ns));
    let of_b = speed(|frame| frame.b.speed_mrpm).into_iter().filter(|(time, _)| *time <= killed).collect();
    let blue = RGBColor(31, 98, 180);
    let orange = RGBColor(230, 126, 34);
    let marks =
        events.iter().enumerate().map(|(index, event)| (at(event.time_ns), format!(" {}", index + 1)));
    Chart {
        title: "safepair demo: one axis, two monitors, one crosscheck (simulated drive)".into(),
        time: (0.0, end),
        speed: (-300.0, value(values, 67) * 1.15),
        envelope: envelope(
            (0.0, end),
            value(values, 67),
            &restrictions(values, events, recording, origin, end),
        ),
        curves: vec![
            Curve { name: "speed, channel A", colour: blue, points: speed(|frame| frame.a.speed_mrpm) },
            Curve { name: "speed, channel B", colour: orange, points: of_b },
        ],
        lanes: state_lanes(frames, &at),
        marks: marks.collect(),
    }
}

fn restrictions(
    values: &std::collections::BTreeMap<u32, i32>,
    events: &[Event],
    recording: &Recording,
    origin: u64,
    end: f64,
) -> Vec<Restriction> {
    let when = |what: What| events.iter().find(|event| event.what == what).map(|event| event.time_ns);
    let speed = |time_ns: u64| {
        let next = recording.frames.iter().find(|frame| frame.time_ns >= time_ns);
        next.map_or(0.0, |frame| f64::from(frame.a.speed_mrpm) / 1_000.0)
    };
    let at = |time_ns: u64| seconds(time_ns, origin);
    let until = |what: What| when(what).map_or(end, at);
    let sls1 =
        when(What::Request).map(|t| Restriction::sls1(values, at(t), speed(t), until(What::Violation)));
    let ss1 =
        when(What::Violation).map(|t| Restriction::ss1(values, at(t), speed(t), until(What::TorqueOff)));
    sls1.into_iter().chain(ss1).collect()
}

fn state_lanes(frames: &[Frame], at: &dyn Fn(u64) -> f64) -> Vec<Lane> {
    let green = RGBColor(46, 139, 87);
    let red = RGBColor(192, 57, 43);
    let grey = RGBColor(120, 130, 140);
    let amber = RGBColor(241, 196, 15);
    let rows: [(&'static str, RGBColor, Seen); 8] = [
        ("SLS1 requested", grey, |frame| frame.a.requested.bit(shm_schema::facts::amk_kw::control::SLS1)),
        ("SLS1 active", amber, |frame| frame.agreement.status.bit(status::SLS1)),
        ("SS1 active", amber, |frame| frame.agreement.status.bit(status::SS1_ACTIVE)),
        ("STO active", red, |frame| frame.agreement.status.bit(status::STO)),
        ("error", red, |frame| frame.agreement.status.bit(status::ERROR)),
        ("agreement permits", green, |frame| frame.agreement.permit),
        ("path A on", green, |frame| frame.readback.1.path_a),
        ("path B on", green, |frame| frame.readback.1.path_b),
    ];
    rows.into_iter().map(|(name, colour, on)| Lane { name, colour, spans: spans(frames, at, on) }).collect()
}

fn spans(frames: &[Frame], at: &dyn Fn(u64) -> f64, on: fn(&Frame) -> bool) -> Vec<(f64, f64)> {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    let mut open = None;
    for frame in frames {
        let time = at(frame.time_ns).max(0.0);
        match (on(frame), open) {
            (true, None) => open = Some(time),
            (false, Some(start)) => {
                spans.push((start, time));
                open = None;
            }
            _ => {}
        }
    }
    let last = frames.last().map_or(0.0, |frame| at(frame.time_ns));
    spans.extend(open.map(|start| (start, last)));
    spans
}
