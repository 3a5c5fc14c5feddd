//! Response times: one sum of named terms for every chain of the three products.
//!
//! Times are in microseconds, so that nothing is rounded; `ms` shows them in milliseconds.

use std::fmt;

use serde::Serialize;
use shm_schema::profile::{Profile, lenze_key};

use crate::set::AxisSet;

/// What only the machine's builder knows. Times in µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Surroundings {
    /// Response of the sensor.
    pub sensor: u64,
    /// Processing of the safety controller (T_PLC, t4, HAT).
    pub controller: u64,
    /// Cycle of the safety bus with its transmission, one direction (T_FSoE, t_ps).
    pub bus: u64,
    /// Watchdog of the safety bus (t_WD, F_WD_Time).
    pub watchdog: u64,
    /// Highest speed at which a stop may begin, electrical mHz (ATV).
    pub start_mhz: u64,
}

/// One addend.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Term {
    /// What takes the time.
    pub name: String,
    /// How long, µs.
    pub us: u64,
}

/// One chain from an event to its effect.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Chain {
    /// From what to what.
    pub name: String,
    /// Addends in the order of the signal.
    pub terms: Vec<Term>,
    /// Their sum, µs.
    pub total_us: u64,
    /// Requirement that gives the formula.
    pub source: String,
}

impl fmt::Display for Chain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} ms =", self.name, ms(self.total_us))?;
        for (at, term) in self.terms.iter().enumerate() {
            write!(f, "{} {} {}", if at == 0 { "" } else { " +" }, ms(term.us), term.name)?;
        }
        write!(f, " ({})", self.source)
    }
}

/// Milliseconds with as many places as it takes.
pub fn ms(us: u64) -> String {
    let text = format!("{}.{:03}", us / 1_000, us % 1_000);
    text.trim_end_matches('0').trim_end_matches('.').into()
}

fn chain(name: impl Into<String>, source: &str, terms: &[(&str, u64)]) -> Chain {
    Chain {
        name: name.into(),
        total_us: terms.iter().fold(0, |sum, (_, us)| sum.saturating_add(*us)),
        terms: terms.iter().map(|(name, us)| Term { name: (*name).into(), us: *us }).collect(),
        source: source.into(),
    }
}

/// Every chain of a set's profile. The generic profile defines none.
pub fn chains(axis: &AxisSet, around: &Surroundings) -> Vec<Chain> {
    match axis.profile {
        Profile::AmkKw => amk(axis, around),
        Profile::LenzeSm301 => lenze(axis, around),
        Profile::Atv340 => atv(axis, around),
        Profile::Etg61002 | Profile::None => Vec::new(),
    }
}

/// AMK: hardware delay of an input, µs (AMK-TIME-02).
const AMK_INPUT: u64 = 250;
/// AMK: reaction of STO, µs (AMK-TIME-04).
const AMK_STO: u64 = 2_000;
/// AMK: hardware delay of an output, µs (AMK-TIME-04).
const AMK_OUTPUT: u64 = 400;
/// AMK: software part of the FSoE chain, µs (AMK-TIME-05).
const AMK_FSOE: u64 = 15_000;

fn amk(axis: &AxisSet, around: &Surroundings) -> Vec<Chain> {
    let longest =
        |first: u32, second: u32| u64::from(axis.value(first).max(axis.value(second)).max(0).unsigned_abs());
    let mut chains = Vec::new();
    for (input, first, second) in [("SE1", 71, 73), ("SE2", 77, 79), ("SE3", 83, 85)] {
        let terms = [("sensor", around.sensor), ("input", AMK_INPUT), ("filter", longest(first, second))];
        chains.push(chain(format!("{input} to function"), "AMK-TIME-02", &terms));
        let with_sto: Vec<_> = terms.into_iter().chain([("STO", AMK_STO)]).collect();
        chains.push(chain(format!("{input} to STO"), "AMK-TIME-02, AMK-TIME-04", &with_sto));
    }
    for (output, on, first, second) in [("SA1", 87, 88, 90), ("SA2", 93, 94, 96)] {
        // AMK-TIME-04: the filter counts only while the output is sampled.
        let sampled = if axis.value(on) == 1 { longest(first, second) } else { 0 };
        chains.push(chain(
            format!("function to {output}"),
            "AMK-TIME-04",
            &[("function", AMK_STO), ("sampling", sampled), ("output", AMK_OUTPUT)],
        ));
    }
    let terms = [
        ("sensor", around.sensor),
        ("controller", around.controller),
        ("FSoE", around.bus),
        ("processing", AMK_FSOE),
    ];
    chains.push(chain("FSoE to function", "AMK-TIME-05", &terms));
    chains
}

/// Lenze: local processing, µs (LNZ-RT-02).
const LENZE_LOCAL: u64 = 4_000;
/// Lenze: input to PROFIsafe data, µs (LNZ-RT-04).
const LENZE_TO_BUS: u64 = 24_000;
/// Lenze: PROFIsafe data to function, µs (LNZ-RT-05).
const LENZE_FROM_BUS: u64 = 14_000;
/// Lenze: delay of an input in error instead of its own, µs (LNZ-RT-02).
const LENZE_INPUT_ERROR: u64 = 2_000;

fn lenze(axis: &AxisSet, around: &Surroundings) -> Vec<Chain> {
    let value_us =
        |code: u32, sub: u32| u64::from(axis.value(lenze_key(code, sub)).max(0).unsigned_abs()) * 1_000;
    let sensor = ("sensor", around.sensor);
    let mut chains = Vec::new();
    for input in 1..=4 {
        let delay = ("input delay", value_us(15_034, input));
        chains.push(chain(
            format!("SD-In{input} to function"),
            "LNZ-RT-02",
            &[sensor, delay, ("processing", LENZE_LOCAL)],
        ));
        chains.push(chain(
            format!("SD-In{input} to PROFIsafe data"),
            "LNZ-RT-04",
            &[sensor, delay, ("processing", LENZE_TO_BUS)],
        ));
        chains.push(chain(
            format!("SD-In{input} to PROFIsafe data in the controller"),
            "LNZ-RT-04",
            &[sensor, delay, ("processing", LENZE_TO_BUS), ("bus", around.bus)],
        ));
        let way = around.bus + around.controller + around.bus + LENZE_FROM_BUS;
        let slower = ("watchdog or way through the controller", around.watchdog.max(way));
        chains.push(chain(
            format!("SD-In{input} through the controller to function"),
            "LNZ-RT-06",
            &[sensor, delay, ("processing", LENZE_TO_BUS), slower],
        ));
    }
    chains.push(chain(
        "input error to function",
        "LNZ-RT-02",
        &[sensor, ("input error", LENZE_INPUT_ERROR), ("processing", LENZE_LOCAL)],
    ));
    chains.push(chain(
        "PROFIsafe control word to function",
        "LNZ-RT-05",
        &[("controller", around.controller), ("bus", around.bus), ("processing", LENZE_FROM_BUS)],
    ));
    chains.push(chain("function to SD-Out1", "LNZ-RT-03", &[("output", LENZE_LOCAL)]));
    chains.push(chain("SS1 to STO", "LNZ-RT-06", &[("stopping time", value_us(15_305, 0))]));
    chains
}

/// ATV: worst case delay of a function, µs (ATV-TIM-06).
const ATV_WCDT: u64 = 20_000;
/// ATV: response to a violation in closed loop, µs (ATV-TIM-07).
const ATV_CLOSED: u64 = 100_000;
/// ATV: response to a violation in open loop, µs (ATV-TIM-07).
const ATV_OPEN: u64 = 650_000;
/// ATV: device acknowledgement time, µs (ATV-TIM-04).
const ATV_DAT: u64 = 12_000;
/// Raw value of SC05 "No encoder used".
const OPEN_LOOP: i32 = 1;

fn atv(axis: &AxisSet, around: &Surroundings) -> Vec<Chain> {
    let raw = |number: u32| u64::from(axis.value(number).max(0).unsigned_abs());
    let delay = ("delay SC34", raw(34) * 1_000);
    let wcdt = ("WCDT", ATV_WCDT);
    let open = axis.value(5) == OPEN_LOOP;
    let response = ("response", if open { ATV_OPEN } else { ATV_CLOSED });
    let mut chains = vec![
        chain("telegram to STO", "ATV-TIM-06", &[wcdt]),
        chain("lost telegram to STO", "ATV-TIM-01", &[("F_WD_Time", around.watchdog), wcdt]),
        chain("violation of SLS or SMS to STO", "ATV-TIM-07", &[wcdt, response]),
        chain(
            "smallest watchdog time",
            "ATV-TIM-02",
            &[("DAT", ATV_DAT), ("controller", around.controller), ("bus", around.bus), ("bus", around.bus)],
        ),
    ];
    // Tenths of a Hz against mHz; an undefined slope never ends.
    let height = (around.start_mhz + raw(32) * 100).saturating_sub(raw(33) * 100);
    if let Some(ramp) = (height * 10_000).checked_div(raw(31)) {
        chains.push(chain("SS1 to STO", "ATV-TIM-06", &[wcdt, delay, ("ramp", ramp)]));
    }
    chains
}

/// Longest watchdog time that still fits the smallest one, µs: 30 % more (ATV-TIM-03).
pub fn atv_watchdog_limit(smallest_us: u64) -> u64 {
    smallest_us.saturating_mul(13) / 10
}

#[cfg(test)]
mod tests;
