//! The ten entries a Lenze SM301 shows (LNZ-LOG-01 to 03): C15892 log time, C15893 log state.
//!
//! The reports do not say which of several sources requested a function. Requested while a
//! safe input is off counts as "via SD-In", otherwise as "via S-bus"; with an error standing a
//! stop counts as "through error".

use std::format;
use std::string::String;
use std::vec::Vec;

use shm_schema::facts::lenze_sm301::status as s;

use super::moment::Moment;
use super::record::{Entry, Record};

/// Entries shown.
pub const ENTRIES: usize = 10;

/// C15891: what ends the logging.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogFunction {
    /// 0: always active.
    Active,
    /// 2: stops with the first error.
    StopOnError,
    /// 3: stops with the first STO.
    StopOnSto,
    /// 4: stops with the first SS1.
    StopOnSs1,
    /// 5: stops with the first SS2.
    StopOnSs2,
}

/// One entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogEntry {
    /// C15892: relative time, ms.
    pub time_ms: u32,
    /// C15893: log state.
    pub state: u64,
}

/// The entries of `axis`, newest first (subcode 1 is the first).
pub fn ten_entries(records: &[Record], axis: u8, function: LogFunction) -> Vec<LogEntry> {
    let mut entries: Vec<LogEntry> = Vec::new();
    for moment in records.iter().filter_map(moment).filter(|moment| moment.axis == axis) {
        let entry = LogEntry { time_ms: (moment.now_ns / 1_000_000) as u32, state: log_state(moment) };
        if entries.last().is_none_or(|last| last.state != entry.state) {
            entries.push(entry);
        }
        if stops(function, moment) {
            break;
        }
    }
    entries.into_iter().rev().take(ENTRIES).collect()
}

fn moment(record: &Record) -> Option<&Moment> {
    match record.entry.as_ref()? {
        Entry::Change(moment) | Entry::Trip { moment, .. } => Some(moment),
        _ => None,
    }
}

fn stops(function: LogFunction, moment: &Moment) -> bool {
    let [_, _, status] = moment.status;
    match function {
        LogFunction::Active => false,
        LogFunction::StopOnError => moment.codes().next().is_some(),
        LogFunction::StopOnSto => bit(status, s::STO_ACTIVE),
        LogFunction::StopOnSs1 => bit(status, s::SS1_ACTIVE),
        LogFunction::StopOnSs2 => bit(status, s::SS2_ACTIVE),
    }
}

const fn bit(word: u64, bit: u8) -> bool {
    word >> bit & 1 == 1
}

/// First bit of C15893 for each function, and its status bit.
const FUNCTIONS: [(u8, u8); 9] = [
    (0, s::STO_ACTIVE),
    (4, s::SS1_ACTIVE),
    (8, s::SS2_ACTIVE),
    (12, s::SLS1_ACTIVE),
    (16, s::SLS2_ACTIVE),
    (20, s::SLS3_ACTIVE),
    (24, s::SLS4_ACTIVE),
    (28, s::SDIPOS_ACTIVE),
    (32, s::SDINEG_ACTIVE),
];

const NAMES: [&str; 9] = ["STO", "SS1", "SS2", "SLS1", "SLS2", "SLS3", "SLS4", "SDIpos", "SDIneg"];
const SOURCES: [&str; 3] = ["via SD-In", "via S-bus", "through error"];

/// C15893 as words.
pub fn state_words(state: u64) -> Vec<String> {
    let set = |at: u8| state >> at & 1 == 1;
    let mut words = Vec::new();
    let rows = FUNCTIONS.iter().zip(NAMES).map(|((first, _), name)| (*first, name));
    for (first, name) in rows.chain([(40, "OMS"), (44, "ES")]) {
        // The stops have three sources, the others two.
        let sources = if first <= 8 { 3 } else { 2 };
        for (offset, source) in (0..sources).zip(SOURCES) {
            if set(first + offset) {
                words.push(format!("{name} {source}"));
            }
        }
    }
    if set(36) {
        words.push("SLI".into());
    }
    for (input, at) in (1..=4).zip(52_u8..) {
        if !set(at) {
            words.push(format!("SD-In{input} off"));
        }
    }
    words
}

/// C15893 of a moment.
pub fn log_state(moment: &Moment) -> u64 {
    let [_, _, status] = moment.status;
    let [inputs_a, inputs_b] = moment.inputs;
    let inputs = u64::from(inputs_a & inputs_b & 0xF);
    let source = u8::from(inputs == 0xF);
    let error = moment.codes().next().is_some();
    let mut state = inputs << 52;
    for (first, active) in FUNCTIONS {
        // "Through error" exists for the stops only.
        let through_error = error && first <= 8;
        let offset = if through_error { 2 } else { source };
        state |= u64::from(bit(status, active)) << (first + offset);
    }
    state |= u64::from(bit(status, s::SLI_ACTIVE)) << 36;
    state |= u64::from(bit(status, s::OMS)) << (40 + source);
    state |= u64::from(bit(status, s::ES_ACTIVE)) << (44 + source);
    state
}
