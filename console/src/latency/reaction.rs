//! From a reason to torque off, in the real processes.

use std::{
    thread,
    time::{Duration, Instant},
};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use shm_schema::{cell::Kind, command::Command, inhibit::Inhibit};
use sim::random::Random;
use sim::shm::{CellReader, Domain};

use super::histogram::Times;
use crate::master::Master;
use crate::run::{Plan, Role, Set};
use crate::watch::{Watch, now_ns, one};

/// Longest wait for any single condition.
const DEADLINE: Duration = Duration::from_secs(5);
/// Missing edges after which an evaluator drops a path (design 3.4).
const DEAD_MAN_CYCLES: u64 = 3;

/// Both paths as an evaluator sees them.
struct Paths {
    cells: [CellReader<Inhibit>; 2],
    command: CellReader<Command>,
    cycle_ns: u64,
}

/// When each path was off, ns.
struct Off([u64; 2]);

impl Paths {
    fn open(domain: &Domain, axis: u8, cycle_ns: u64) -> Result<Self, String> {
        let path = |kind| one(domain, kind, axis).map_err(|error| error.to_string());
        Ok(Self {
            cells: [path(Kind::InhibitA)?, path(Kind::InhibitB)?],
            command: one(domain, Kind::Command, axis).map_err(|error| error.to_string())?,
            cycle_ns,
        })
    }

    /// Watches until both paths are off: by a withdrawn permission, or by the dead-man after the
    /// last edge.
    fn until_off(&self) -> Result<Off, String> {
        let start = Instant::now();
        let dead_man_ns = DEAD_MAN_CYCLES * self.cycle_ns;
        let mut edges: [Option<(u64, u64)>; 2] = [None; 2];
        let mut off = [None; 2];
        while start.elapsed() < DEADLINE {
            for ((cell, last), off) in self.cells.iter().zip(&mut edges).zip(&mut off) {
                let Some((header, driven)) = cell.read() else { continue };
                let renewed = last.is_none_or(|(count, _)| count != driven.edges);
                if renewed {
                    *last = Some((driven.edges, header.timestamp_ns));
                }
                let dead_ns = last.map_or(0, |(_, edge_ns)| edge_ns + dead_man_ns);
                if !driven.permit {
                    *off = off.or(Some(header.timestamp_ns));
                } else if now_ns() > dead_ns {
                    *off = off.or(Some(dead_ns));
                }
            }
            if let [Some(a), Some(b)] = off {
                return Ok(Off([a, b]));
            }
            thread::sleep(Duration::from_nanos(self.cycle_ns / 8));
        }
        Err("the paths were not off within 5 s".into())
    }
}

/// Waits until the axis has torque; acknowledges as often as it takes.
pub fn energise(watch: &Watch, master: &Master) -> Result<(), String> {
    let start = Instant::now();
    let mut asked = start;
    master.acknowledge()?;
    while start.elapsed() < DEADLINE {
        if watch.now().is_some_and(|frame| frame.readback.1.path_a & frame.readback.1.path_b) {
            return Ok(());
        }
        if asked.elapsed() > Duration::from_millis(300) {
            asked = Instant::now();
            master.acknowledge()?;
        }
        thread::sleep(Duration::from_millis(1));
    }
    let seen = watch.now().map_or(String::new(), |frame| frame.in_words());
    Err(format!("no torque within 5 s; last seen:\n{seen}"))
}

/// STO requested at random instants; from the command's stamp to each path: torque off is the
/// first of the two. (torque off, both off)
pub fn requests(set: &Set, plan: &Plan, rounds: u64, random: &mut Random) -> Result<(Times, Times), String> {
    let axis = plan.axes.first().copied().ok_or("no axis")?;
    let domain = set.domain().ok_or("no shared memory")?;
    let paths = Paths::open(domain, axis, u64::from(plan.timing.cycle_us) * 1_000)?;
    let watch = Watch::open(domain, axis).map_err(|error| error.to_string())?;
    let master = Master::connect(&plan.folder, axis)?;
    let (mut first, mut both) = (Times::default(), Times::default());
    for _ in 0..rounds {
        energise(&watch, &master)?;
        thread::sleep(Duration::from_micros(random.between(5_000, 30_000) as u64));
        let before = paths.command.read().ok_or("no command")?.1.word;
        master.request("STO")?;
        let asked_ns = changed(&paths, before)?;
        let Off([a, b]) = paths.until_off()?;
        first.add(a.min(b).saturating_sub(asked_ns));
        both.add(a.max(b).saturating_sub(asked_ns));
        master.release("STO")?;
    }
    Ok((first, both))
}

/// Stamp of the command that is not `before` any more.
fn changed(paths: &Paths, before: shm_schema::word::Word) -> Result<u64, String> {
    let start = Instant::now();
    while start.elapsed() < DEADLINE {
        if let Some((header, _)) = paths.command.read().filter(|(_, command)| command.word != before) {
            return Ok(header.timestamp_ns);
        }
        thread::yield_now();
    }
    Err("the request did not reach the command cell".into())
}

/// Kills `role` of a fresh set at a random instant; ns until torque is off and until both paths
/// are.
pub fn death(plan: &Plan, role: Role, random: &mut Random) -> Result<[u64; 2], String> {
    let set = Set::start(plan).map_err(|error| error.to_string())?;
    let axis = plan.axes.first().copied().ok_or("no axis")?;
    let domain = set.domain().ok_or("no shared memory")?;
    let paths = Paths::open(domain, axis, u64::from(plan.timing.cycle_us) * 1_000)?;
    let watch = Watch::open(domain, axis).map_err(|error| error.to_string())?;
    let master = Master::connect(&plan.folder, axis)?;
    let result = awaits(&watch).and_then(|()| energise(&watch, &master)).and_then(|()| {
        thread::sleep(Duration::from_micros(random.between(20_000, 60_000) as u64));
        let process = set.process(role).ok_or("no such process")?;
        let killed_ns = now_ns();
        kill(Pid::from_raw(process as i32), Signal::SIGKILL).map_err(|error| error.to_string())?;
        let Off([a, b]) = paths.until_off()?;
        Ok([a.min(b), a.max(b)].map(|off_ns| off_ns.saturating_sub(killed_ns)))
    });
    set.stop();
    result
}

/// Waits for the end of the start-up.
pub fn awaits(watch: &Watch) -> Result<(), String> {
    use shm_schema::report::Phase;
    let start = Instant::now();
    while start.elapsed() < DEADLINE {
        let ready = |frame: crate::watch::Frame| frame.a.phase.min(frame.b.phase) >= Phase::AwaitAcknowledge;
        if watch.now().is_some_and(ready) {
            return Ok(());
        }
        thread::sleep(Duration::from_millis(1));
    }
    let seen = watch.now().map_or(String::new(), |frame| frame.in_words());
    Err(format!("the start-up did not end within 5 s; last seen:\n{seen}"))
}
