//! Strict or relaxed: how late a cell, a partner or an edge may be.
//!
//! The strict timing needs SCHED_FIFO and cores that nobody else uses. Everywhere else the host
//! stalls for some milliseconds now and then, which is torque off in the strict timing: rightly on
//! a machine, but no use in a simulation. There the relaxed timing has a cycle of 4 ms and ages and
//! partner time-outs ten times as long, and never a GPIO path.

use std::{fmt, fs, thread};

use shm_schema::exchange::RELAXED_AGE_FACTOR;
use thread_priority::unix::{RealtimeThreadSchedulePolicy, ThreadSchedulePolicy};
use thread_priority::{ThreadPriority, set_thread_priority_and_policy, thread_native_id};

/// Cycle of the relaxed timing, µs.
const RELAXED_CYCLE_US: u32 = 4_000;
/// Cycle of the strict timing when nobody says otherwise, µs.
const STRICT_CYCLE_US: u32 = 1_000;
const ISOLATED: &str = "/sys/devices/system/cpu/isolated";

/// Which timing is asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wish {
    /// Strict where the machine can, else relaxed.
    #[default]
    Auto,
    /// Strict, whatever the machine can.
    Strict,
    /// Relaxed: 4 ms, ages times ten.
    Relaxed,
}

/// The timing of a set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Timing {
    /// Cycle, µs.
    pub cycle_us: u32,
    /// Factor on ages and partner time-outs.
    pub age_factor: u8,
    /// What the machine lacks for the strict timing, a line each.
    pub lacks: Vec<String>,
}

impl Timing {
    /// The timing for `wish` on this machine, with `cpus` for the monitors at `priority`.
    pub fn choose(wish: Wish, cycle_us: Option<u32>, cpus: &[Option<u32>], priority: u8) -> Self {
        let lacks = lacks(cpus, priority);
        let relaxed = match wish {
            Wish::Auto => !lacks.is_empty(),
            Wish::Strict => false,
            Wish::Relaxed => true,
        };
        let (usual, age_factor) =
            if relaxed { (RELAXED_CYCLE_US, RELAXED_AGE_FACTOR) } else { (STRICT_CYCLE_US, 1) };
        Self { cycle_us: cycle_us.unwrap_or(usual), age_factor, lacks }
    }

    /// Whether ages are longer than a machine may have them.
    pub const fn is_relaxed(&self) -> bool {
        self.age_factor > 1
    }
}

impl fmt::Display for Timing {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = if self.is_relaxed() { "relaxed" } else { "strict" };
        write!(out, "{name} timing: cycle {} µs, ages times {}", self.cycle_us, self.age_factor)?;
        match self.lacks.as_slice() {
            [] => Ok(()),
            lacks => write!(out, "; this machine lacks {}", lacks.join(", ")),
        }
    }
}

fn lacks(cpus: &[Option<u32>], priority: u8) -> Vec<String> {
    let isolated = fs::read_to_string(ISOLATED).map(|text| parse_cores(&text)).unwrap_or_default();
    let shared = cpus.iter().any(|cpu| cpu.is_none_or(|cpu| !isolated.contains(&cpu)));
    let mut lacks = Vec::new();
    if !may_have(priority) {
        lacks.push(format!("SCHED_FIFO at priority {priority}"));
    }
    if shared {
        lacks.push("isolated cores for the monitors (isolcpus)".to_owned());
    }
    lacks
}

/// Whether a thread of ours may have the priority: tried on one that ends at once.
fn may_have(priority: u8) -> bool {
    let try_it = move || {
        let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let wanted = thread_priority::ThreadPriorityValue::try_from(priority).ok()?;
        set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(wanted), fifo).ok()
    };
    priority > 0 && thread::spawn(try_it).join().is_ok_and(|had| had.is_some())
}

/// `1,3-5` as the kernel writes a list of cores.
fn parse_cores(text: &str) -> Vec<u32> {
    let range = |part: &str| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(first.parse::<u32>().ok()?..=last.parse::<u32>().ok()?)
    };
    text.trim().split(',').filter_map(range).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_cores_is_read_as_the_kernel_writes_it() {
        assert_eq!(parse_cores("1,3-5\n"), [1, 3, 4, 5]);
        assert_eq!(parse_cores("\n"), [0; 0]);
    }

    #[test]
    fn without_cores_of_their_own_the_monitors_run_relaxed_and_it_is_said() {
        let timing = Timing::choose(Wish::Auto, None, &[None], 80);
        assert_eq!((timing.cycle_us, timing.age_factor), (4_000, 10));
        assert!(timing.to_string().contains("isolated cores"), "{timing}");
        let asked = Timing::choose(Wish::Strict, Some(250), &[None], 80);
        assert_eq!((asked.cycle_us, asked.age_factor), (250, 1));
    }
}
