//! Safe inputs, the safe output, the cascade.

use shm_schema::facts::lenze_sm301::{control, status};

use super::{FILTER_MS, Lenze, Probe, REQUEST_MS, Request, Step, Trial, supervision::Manners as _};

pub(super) const COLUMNS: [&str; 4] = ["se1", "se2", "se3", "se4"];
const STATES: [u8; 4] = [status::SD_IN1, status::SD_IN2, status::SD_IN3, status::SD_IN4];
/// Discrepancy at SD-In1; the others follow.
const DISCREPANCY: u32 = 49;
/// Kinds of input (C15031).
const SELECTOR: i32 = 2;
const ENABLE: i32 = 3;
/// The input of a cascade, and what it may take (LNZ-CAS-09).
const CASCADE: u32 = 4;
/// SD-Out1 among the outputs.
const SD_OUT1: u8 = 0;
/// Rows of C15051 and C15052: the bits of the status word, each with its inverse.
const FIRST: [u8; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 29];
const SECOND: [u8; 16] = [16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31];

const fn opposite(lines: &str) -> &'static str {
    if lines.as_bytes()[0] == b'1' { "00" } else { "11" }
}

impl Lenze<'_> {
    pub(super) fn is_live(&self, input: u32) -> bool {
        self.set(15_030, input) != 0
    }

    pub(super) fn is_cascade(&self) -> bool {
        self.set(15_035, 0) == 4
    }

    /// Active inputs of one kind (C15031).
    pub(super) fn inputs_of(&self, kind: i32) -> impl Iterator<Item = u32> {
        let last = if self.is_cascade() { 3 } else { 4 };
        (1..=last).filter(move |input| self.is_live(*input) && self.set(15_031, *input) == kind)
    }

    /// Levels with which an input requests nothing.
    pub(super) fn idle(&self, input: u32) -> &'static str {
        match self.set(15_031, input) {
            ENABLE => "00",
            // C15202: which level means normal operation.
            SELECTOR if self.set(15_202, 0) == 0 => "00",
            _ => "11",
        }
    }

    pub(super) fn connect(&self, step: &mut Step) {
        for input in (1..=4).filter(|input| self.is_live(*input)) {
            step.trial.course.set(0.0, COLUMNS[input as usize - 1], self.idle(input));
        }
    }

    /// Releases every input. An STO opens a cascade, which has to come round before it closes.
    pub(super) fn disconnect(&self, step: &mut Step, tripped_ms: f64, ms: f64) {
        for input in (1..=4).filter(|input| self.is_live(*input)) {
            step.trial.course.set(ms, COLUMNS[input as usize - 1], self.idle(input));
        }
        if self.is_cascade() {
            step.trial.course.set(tripped_ms, COLUMNS[3], "00");
        }
    }

    fn delay_ms(&self, input: u32) -> f64 {
        FILTER_MS + self.value(15_034, input)
    }

    pub(super) fn inputs(&self) -> Vec<Trial> {
        let last = if self.is_cascade() { 3 } else { 4 };
        let live = (1..=last).filter(|input| self.is_live(*input));
        let mut trials: Vec<_> =
            live.flat_map(|input| [self.level(input), self.discrepancy(input)]).collect();
        if self.is_cascade() {
            trials.push(self.cascade());
        } else {
            trials.extend(self.output());
        }
        trials
    }

    /// LNZ-IN-02: the state of the input in the status word.
    fn level(&self, input: u32) -> Trial {
        let (column, bit) = (COLUMNS[input as usize - 1], STATES[input as usize - 1]);
        let mut step =
            self.begin(&format!("SD-In{input}"), "both lines to their other level".into(), "LNZ-IN-02");
        let lines = opposite(self.idle(input));
        step.trial.course.set(REQUEST_MS, column, lines);
        let at = REQUEST_MS + self.delay_ms(input);
        let on = lines == "11";
        let what = format!("status bit {bit} is {}", u8::from(on));
        step.expect(what, REQUEST_MS, at + 2.0, Probe::Bit(bit, on));
        self.settle(&mut step, at + 20.0);
        step.trial
    }

    /// LNZ-IN-14, LNZ-IN-16: both lines within the discrepancy time.
    fn discrepancy(&self, input: u32) -> Trial {
        let column = COLUMNS[input as usize - 1];
        let time = self.value(15_033, input);
        let mut step = self.begin(
            &format!("SD-In{input}"),
            format!("line .1 alone to its other level, for more than {time:.0} ms"),
            "LNZ-IN-14, LNZ-IN-16",
        );
        let idle = self.idle(input);
        let lines = if idle == "11" { "01" } else { "10" };
        step.trial.course.set(REQUEST_MS, column, lines);
        let late = REQUEST_MS + self.delay_ms(input) + time;
        let code = (DISCREPANCY + input - 1).to_string();
        step.expect(format!("code {code}, both channels"), late - 3.0, late + 4.0, Probe::Code(code));
        // LNZ-IN-15, LNZ-IN-17: acknowledged only after both lines have changed.
        step.trial.course.set(late + 20.0, column, opposite(idle));
        self.settle(&mut step, late + 20.0 + self.delay_ms(input) + 20.0);
        step.trial
    }

    /// LNZ-CAS-03, LNZ-CAS-04: the input stops the drive, every STO opens the output.
    fn cascade(&self) -> Trial {
        let mut step = self.begin("cascade", "open the cascade at SD-In4".into(), "LNZ-CAS");
        step.trial.course.set(REQUEST_MS, COLUMNS[3], "00");
        let latest = REQUEST_MS + self.delay_ms(CASCADE) + 2.0;
        step.quiet(REQUEST_MS);
        step.expect("torque off", REQUEST_MS, latest, Probe::TorqueOff);
        step.expect("SD-Out1 off", REQUEST_MS, latest, Probe::Output(SD_OUT1, false));
        self.settle(&mut step, latest + 20.0);
        step.trial
    }

    /// LNZ-OUT-05: an output whose level follows STO.
    fn output(&self) -> Option<Trial> {
        let request = self.request("STO")?;
        let idle = (1..=4).filter(|input| self.is_live(*input) && self.idle(*input) == "11");
        let permanent: u32 = match self.set(15_340, 0) {
            1 => 1 << status::SDIPOS_ACTIVE | 1 << status::SDIPOS_MONITORED,
            2 => 1 << status::SDINEG_ACTIVE | 1 << status::SDINEG_MONITORED,
            _ => 0,
        };
        let inputs = idle.fold(0, |word, input| word | 1 << STATES[input as usize - 1]);
        let asked = match request {
            Request::Input(input) => inputs & !(1 << STATES[input as usize - 1]),
            _ => inputs,
        };
        let levels = [inputs | permanent, asked | 1 << status::STO_ACTIVE].map(|word| self.expected(word));
        let [before, after] = levels;
        if before == after || self.passes(control::SD_OUT1) && self.set(15_100, 0) == 0 {
            return None;
        }
        let mut step = self.begin("SD-Out1", "request STO at standstill".into(), "LNZ-OUT-05");
        let at = self.ask(&mut step, request);
        let what = if after { "output on" } else { "output off" };
        step.expect(what, REQUEST_MS, at + 2.0, Probe::Output(SD_OUT1, after));
        self.settle(&mut step, at + 20.0);
        Some(step.trial)
    }

    /// What the conditions C15051/1 and C15052/1, joined by C15055/1, make of a status word.
    fn expected(&self, word: u32) -> bool {
        let of = |code: u32, bits: &[u8]| {
            let selected = self.set(code, 1) as u32;
            let met =
                |at: usize, bit: u8| [(2 * at, word >> bit & 1 == 1), (2 * at + 1, word >> bit & 1 == 0)];
            let all = bits.iter().enumerate().flat_map(|(at, bit)| met(at, *bit));
            all.filter(|(row, _)| selected.checked_shr(*row as u32).unwrap_or(0) & 1 == 1)
                .map(|(_, met)| met)
                .collect::<Vec<_>>()
        };
        let rows: Vec<bool> = [of(15_051, &FIRST), of(15_052, &SECOND)].concat();
        let joined = if self.set(15_055, 1) == 1 { !rows.contains(&false) } else { rows.contains(&true) };
        !rows.is_empty() && joined
    }
}
