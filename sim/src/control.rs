//! The simulated control of an axis: what it can be told, over its socket or from a script, and the
//! command word and inputs that follow.
//!
//! One JSON object a datagram, or one `[[at]]` table with `t_ms` in a script:
//!
//! ```text
//! {"axis": 1, "set_point_rpm": 1500}          speed of the drive
//! {"axis": 1, "request": ["SLS1"], "release": ["STO"]}   functions by the names of the profile
//! {"axis": 1, "set": [3], "clear": [0]}       bits of the control word
//! {"axis": 1, "pulse": [7]}                   0, 1, 0: a rising edge whatever it was
//! {"axis": 1, "word": "0x00007E7F"}           the whole control word
//! {"axis": 1, "acknowledge": true}            the profile's acknowledge
//! {"axis": 1, "inputs": {"se1": "10", "ais": "1"}}
//! {"axis": 1, "fault": "stale-encoder"}       until "none"
//! ```

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use shm_schema::facts::{amk_kw, atv340, etg_6100_2, lenze_sm301};
use shm_schema::profile::Profile;
use shm_schema::word::Word;

use crate::machine::Lines;
use crate::replay::Bits;
use crate::trace::{Fault, Faults};

/// Milliseconds each level of a pulse lasts: longer than any bus cycle, and than what a host
/// stalls now and then.
const PULSE_MS: u64 = 60;

/// One instruction.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Instruction {
    /// Axis; absent: 1.
    pub axis: Option<u8>,
    /// When, in a script, ms from the start of the cycle.
    pub t_ms: Option<f64>,
    /// Speed the drive shall turn with, rpm.
    pub set_point_rpm: Option<f64>,
    /// The drive's own ramp, rpm/s.
    pub ramp_rpm_s: Option<f64>,
    /// The whole control word, hexadecimal.
    pub word: Option<String>,
    /// Functions to request, by the names of the profile's control word.
    pub request: Vec<String>,
    /// Functions whose request is taken back.
    pub release: Vec<String>,
    /// Bits to set.
    pub set: Vec<u8>,
    /// Bits to clear: requests of active-low functions.
    pub clear: Vec<u8>,
    /// Bits to give a rising edge.
    pub pulse: Vec<u8>,
    /// The profile's acknowledge.
    pub acknowledge: bool,
    /// Non-safe command "clear error".
    pub clear_error: Option<bool>,
    /// The drive's power stage is enabled.
    pub drive_enabled: Option<bool>,
    /// Input lines: `se1` to `se4` as `11`, `00`, `10`, `01`; `ais`, `aie` as `0`, `1`.
    pub inputs: BTreeMap<String, String>,
    /// A fault by its name in traces, or `none`.
    pub fault: Option<String>,
}

/// A script: `[[at]]` tables.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Script {
    /// What to do, each with `t_ms`.
    #[serde(default)]
    pub at: Vec<Instruction>,
}

impl Script {
    /// Reads a script and puts it in order of time.
    ///
    /// # Errors
    /// One line: where, and what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut script: Self = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or("");
            format!("line {}: {}", before.matches('\n').count() + 1, error.message())
        })?;
        if script.at.iter().any(|instruction| instruction.t_ms.is_none()) {
            return Err("an [[at]] table has no t_ms, expected a time in ms".to_owned());
        }
        let time = |instruction: &Instruction| instruction.t_ms.unwrap_or(0.0);
        script.at.sort_by(|left, right| time(left).total_cmp(&time(right)));
        Ok(script)
    }
}

/// A pulse under way on some bit of the control word.
#[derive(Debug, Clone, Copy)]
struct Pulse {
    bit: u8,
    rise_ms: u64,
    fall_ms: u64,
}

/// Bits whose rising edge acknowledges whatever can be acknowledged.
const fn acknowledge_bits(profile: Profile) -> &'static [u8] {
    match profile {
        Profile::None => &[],
        Profile::AmkKw => &[amk_kw::control::ERROR_ACK],
        Profile::LenzeSm301 => &[lenze_sm301::control::PS_AIS, lenze_sm301::control::PS_AIE],
        Profile::Atv340 => &[atv340::control::SAFETY_RESET],
        Profile::Etg61002 => &[etg_6100_2::control::ERROR_ACK, etg_6100_2::control::RESTART_ACKNOWLEDGE],
    }
}

/// What the master and the inputs of one axis show.
#[derive(Debug, Clone)]
pub struct Control {
    profile: Profile,
    neutral: Word,
    bits: Bits,
    word: Word,
    lines: Lines,
    pulses: Vec<Pulse>,
    /// Non-safe command "clear error".
    pub clear_error: bool,
    /// The drive's power stage is enabled.
    pub drive_enabled: bool,
    /// Faults that act.
    pub faults: Faults,
    /// Speed to turn with, when it was changed.
    pub set_point_rpm: Option<f64>,
    /// Ramp of the drive, when it was changed.
    pub ramp_rpm_s: Option<f64>,
}

impl Control {
    /// Nothing requested, every line high, no acknowledge.
    pub fn new(profile: Profile, neutral: Word, bits: Bits) -> Self {
        Self {
            profile,
            neutral,
            bits,
            word: neutral,
            lines: Lines::default(),
            pulses: Vec::new(),
            clear_error: false,
            drive_enabled: true,
            faults: Faults::NONE,
            set_point_rpm: None,
            ramp_rpm_s: None,
        }
    }

    /// Takes an instruction at `now_ms`.
    ///
    /// # Errors
    /// One line: what was found and what was expected. Nothing has changed then.
    pub fn take(&mut self, instruction: &Instruction, now_ms: u64) -> Result<(), String> {
        let mut next = self.clone();
        next.apply(instruction, now_ms)?;
        *self = next;
        Ok(())
    }

    fn apply(&mut self, instruction: &Instruction, now_ms: u64) -> Result<(), String> {
        if let Some(word) = &instruction.word {
            self.word = parse_word(word)?;
        }
        let changed =
            |word: Word, bits: &[u8], value| bits.iter().fold(word, |word, bit| word.with(*bit, value));
        self.word = changed(changed(self.word, &instruction.set, true), &instruction.clear, false);
        for name in &instruction.request {
            self.function(name, true)?;
        }
        for name in &instruction.release {
            self.function(name, false)?;
        }
        for (name, level) in &instruction.inputs {
            self.input(name, level)?;
        }
        if let Some(name) = &instruction.fault {
            self.faults = fault(name)?;
        }
        self.clear_error = instruction.clear_error.unwrap_or(self.clear_error);
        self.drive_enabled = instruction.drive_enabled.unwrap_or(self.drive_enabled);
        self.set_point_rpm = instruction.set_point_rpm.or(self.set_point_rpm);
        self.ramp_rpm_s = instruction.ramp_rpm_s.or(self.ramp_rpm_s);
        instruction.pulse.iter().for_each(|bit| self.pulse(*bit, now_ms));
        if instruction.acknowledge {
            self.acknowledge(now_ms);
        }
        Ok(())
    }

    /// A function is requested by the level that its neutral bit does not have.
    fn function(&mut self, name: &str, requested: bool) -> Result<(), String> {
        let bit = self.bits.get(&name.to_uppercase()).copied().ok_or_else(|| {
            let known: Vec<_> = self.bits.keys().map(String::as_str).collect();
            format!("function {name:?}, expected one of {}", known.join(", "))
        })?;
        self.word = self.word.with(bit, self.neutral.bit(bit) != requested);
        Ok(())
    }

    fn acknowledge(&mut self, now_ms: u64) {
        for bit in acknowledge_bits(self.profile) {
            self.pulse(*bit, now_ms);
        }
    }

    fn pulse(&mut self, bit: u8, now_ms: u64) {
        self.pulses.retain(|pulse| pulse.bit != bit);
        let rise_ms = now_ms + PULSE_MS;
        self.pulses.push(Pulse { bit, rise_ms, fall_ms: rise_ms + PULSE_MS });
    }

    fn input(&mut self, name: &str, level: &str) -> Result<(), String> {
        let pair = ["se1", "se2", "se3", "se4"].iter().position(|known| *known == name);
        match (pair, level) {
            (Some(pair), "11") => self.lines.pairs[pair] = (true, true),
            (Some(pair), "10") => self.lines.pairs[pair] = (true, false),
            (Some(pair), "01") => self.lines.pairs[pair] = (false, true),
            (Some(pair), "00") => self.lines.pairs[pair] = (false, false),
            (None, "0" | "1") if name == "ais" => self.lines.ais = level == "1",
            (None, "0" | "1") if name == "aie" => self.lines.aie = level == "1",
            _ => {
                return Err(format!(
                    "input {name} {level:?}, expected se1 to se4 with 11, 00, 10, 01, or ais, aie with 0, 1"
                ));
            }
        }
        Ok(())
    }

    /// Control word and lines at `now_ms`.
    pub fn show(&mut self, now_ms: u64) -> (Word, Lines) {
        self.pulses.retain(|pulse| now_ms < pulse.fall_ms + PULSE_MS);
        let pulsed = |word: Word, pulse: &Pulse| {
            let level = (pulse.rise_ms..pulse.fall_ms).contains(&now_ms);
            word.with(pulse.bit, level)
        };
        (self.pulses.iter().fold(self.word, pulsed), self.lines)
    }
}

fn parse_word(text: &str) -> Result<Word, String> {
    crate::trace::word(text).ok_or_else(|| format!("word {text:?}, expected one hexadecimal number"))
}

/// Faults of the producer itself: a process of the set is frozen by stopping it.
fn fault(name: &str) -> Result<Faults, String> {
    const OWN: [Fault; 6] = [
        Fault::StaleEncoder,
        Fault::FreezeEncoder1,
        Fault::FreezeEncoder2,
        Fault::CorruptEncoder,
        Fault::StuckPathA,
        Fault::StuckPathB,
    ];
    let faults = Faults::named(name).filter(|faults| {
        let known = OWN.iter().any(|fault| faults.has(*fault));
        known || (*faults == Faults::NONE)
    });
    let names: Vec<_> = OWN.iter().map(|fault| fault.name()).collect();
    faults.ok_or_else(|| format!("fault {name:?}, expected none, {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control() -> Control {
        Control::new(
            Profile::AmkKw,
            Word::from_u32(0x7E7F),
            Bits::from([("SLS1".to_owned(), amk_kw::control::SLS1)]),
        )
    }

    fn take(control: &mut Control, json: &str) -> Result<(), String> {
        let instruction = serde_json::from_str(json).map_err(|error| error.to_string())?;
        control.take(&instruction, 1_000)
    }

    #[test]
    fn bits_inputs_and_set_points_are_taken() {
        let mut control = control();
        take(&mut control, r#"{"axis":1,"set_point_rpm":1500,"clear":[0],"inputs":{"se2":"10","ais":"1"}}"#)
            .expect("sound");
        let (word, lines) = control.show(1_001);
        assert_eq!(word.0[0], 0x7E7E);
        assert_eq!((lines.pairs[1], lines.ais), ((true, false), true));
        assert_eq!(control.set_point_rpm, Some(1_500.0));
    }

    #[test]
    fn functions_are_requested_and_released_by_name() {
        let mut control = control();
        take(&mut control, r#"{"request":["sls1"]}"#).expect("sound");
        assert_eq!(control.show(1_001).0.0[0], 0x6E7F, "active-low");
        take(&mut control, r#"{"release":["SLS1"]}"#).expect("sound");
        assert_eq!(control.show(1_001).0.0[0], 0x7E7F);
        let refused = take(&mut control, r#"{"request":["SLX"]}"#).expect_err("unknown");
        assert_eq!(refused, "function \"SLX\", expected one of SLS1");
    }

    #[test]
    fn a_pulse_is_low_high_low_whatever_the_bit_was() {
        let mut control = control();
        take(&mut control, r#"{"set":[7]}"#).expect("sound");
        take(&mut control, r#"{"acknowledge":true}"#).expect("sound");
        let mut levels: Vec<_> = (1_000..1_190).map(|t| control.show(t).0.bit(7)).collect();
        levels.dedup();
        assert_eq!(levels, [false, true, false, true], "and then as it stood");
    }

    #[test]
    fn what_it_does_not_know_changes_nothing() {
        let mut control = control();
        assert!(take(&mut control, r#"{"clear":[0],"fault":"freeze-a"}"#).is_err());
        assert!(take(&mut control, r#"{"clear":[0],"inputs":{"se9":"11"}}"#).is_err());
        assert!(take(&mut control, r#"{"clears":[0]}"#).is_err());
        assert_eq!(control.show(0).0.0[0], 0x7E7F);
    }

    #[test]
    fn a_script_is_put_in_order_and_refused_with_its_line() {
        let script =
            Script::parse("[[at]]\nt_ms = 20\nset_point_rpm = 5\n[[at]]\nt_ms = 10.5\nacknowledge = true\n");
        let times: Vec<_> = script.expect("sound").at.iter().filter_map(|at| at.t_ms).collect();
        assert_eq!(times, [10.5, 20.0]);
        assert!(Script::parse("[[at]]\nt_ms = 1\nboom = 2\n").expect_err("refused").starts_with("line 3: "));
    }
}
