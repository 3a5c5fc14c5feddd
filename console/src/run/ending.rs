//! How a run ends: SS1 on the first signal, STO at its end or on the second one.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use super::{Ended, Plan, Set};
use crate::master::Master;
use crate::watch::{Frame, Watch, now_ns};

/// A stop that has not begun by then was not heard: STO.
const BEGIN: Duration = Duration::from_millis(500);
/// Longest braking: the longest delay and ramp of any profile end below.
const BRAKE: Duration = Duration::from_secs(130);
const LOOK: Duration = Duration::from_millis(2);

/// Sets a flag on SIGINT and SIGTERM.
pub fn stop_flag() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        // Cannot fail for these two; without it the signal would just end the process.
        let _ = signal_hook::flag::register(signal, Arc::clone(&stop));
    }
    stop
}

/// Requests SS1 on every axis of a simulated master and waits until no path is on, the set ends
/// by itself, or `stop` is set again. Whatever happens, ending the set afterwards is STO.
pub fn brake(set: &mut Set, plan: &Plan, stop: &AtomicBool) -> Ended {
    stop.store(false, Ordering::Relaxed);
    // Another producer brakes by its own means when it is told to end.
    if !plan.plain_command {
        return Ended::Asked;
    }
    let watches: Vec<Watch> = plan.axes.iter().filter_map(|axis| watch(set, *axis)).collect();
    plan.axes.iter().for_each(|axis| request(plan, *axis));
    let start = Instant::now();
    while start.elapsed() < BRAKE && !stop.load(Ordering::Relaxed) {
        if let Some((role, status)) = set.ended() {
            return Ended::Process(role, status);
        }
        let frames: Vec<_> = watches.iter().filter_map(Watch::now).collect();
        let moving = frames.iter().any(is_on);
        let heard = frames.iter().all(|frame| frame.a.stop != shm_schema::report::Stop::None);
        let ignored = !heard && start.elapsed() > BEGIN;
        if !moving || ignored {
            break;
        }
        thread::sleep(LOOK);
    }
    Ended::Asked
}

/// A path that reads on, and not from a producer that has stopped saying so.
fn is_on(frame: &Frame) -> bool {
    let age_ns = now_ns().saturating_sub(frame.readback.0);
    let said = age_ns < BEGIN.as_nanos() as u64;
    said & (frame.readback.1.path_a | frame.readback.1.path_b)
}

fn watch(set: &Set, axis: u8) -> Option<Watch> {
    Watch::open(set.domain()?, axis).ok()
}

/// The names of the stop differ by profile; what has none of them ends in STO at once.
fn request(plan: &Plan, axis: u8) {
    let Ok(master) = Master::connect(&plan.folder, axis) else { return };
    // First the one that shows whether anybody listens.
    let turned = master.set_point(0.0);
    let asked = turned.is_ok() && ["SS1", "SS1_1", "STO"].iter().any(|name| master.request(name).is_ok());
    if !asked | turned.is_err() {
        tracing::warn!("axis {axis}: the simulated master does not take SS1; STO at once");
    }
}
