//! Special operation: mode selector, enable switch, limited increment.

use shm_schema::facts::lenze_sm301::{control, status};
use shm_schema::word::Word;

use super::inputs::COLUMNS;
use super::{Lenze, Probe, REQUEST_MS, Reaction, Step, Trial, leaves_window_ms, supervision::Manners as _};

/// Exceeded increment (LNZ-SLI-02).
const INCREMENT: &str = "111";
/// Kinds of input (C15031).
const SELECTOR: i32 = 2;
const ENABLE: i32 = 3;

/// An input of the plant, or a bit of the bus where no input has its role (LNZ-OMS-11, LNZ-ES-02).
#[derive(Clone, Copy)]
enum Switch {
    Input(u32),
    Bit(u8),
}

impl Lenze<'_> {
    fn switch(&self, kind: i32, bit: u8) -> Option<Switch> {
        let input = self.inputs_of(kind).next().map(Switch::Input);
        input.or_else(|| self.passes(bit).then_some(Switch::Bit(bit)))
    }

    pub(super) fn special(&self) -> Vec<Trial> {
        let Some(selector) = self.switch(SELECTOR, control::OMS) else { return Vec::new() };
        let mut trials = vec![self.selected(selector)];
        let Some(enable) = self.switch(ENABLE, control::ES) else { return trials };
        // LNZ-CAS-08: a cascade lets a drive go on from SOS only.
        if self.is_cascade() && self.set(15_200, 0) != 2 {
            return trials;
        }
        trials.push(self.enabled(selector, enable));
        if self.set(15_203, 0) > 0 && self.set(15_400, 0) != 0 {
            trials.push(self.increment(selector, enable));
        }
        trials
    }

    /// Sets the switches from `ms` on.
    fn switched(&self, step: &mut Step, ms: f64, switches: &[(Switch, bool)]) {
        let mut word: Word = self.neutral;
        for (switch, on) in switches {
            match switch {
                Switch::Bit(bit) => word = word.with(*bit, *on),
                Switch::Input(input) => {
                    let idle = self.idle(*input);
                    let other = if idle == "11" { "00" } else { "11" };
                    step.trial.course.set(ms, COLUMNS[*input as usize - 1], if *on { other } else { idle });
                }
            }
        }
        step.trial.course.command(ms, word);
    }

    fn delay(&self, switch: Switch) -> f64 {
        match switch {
            Switch::Input(input) => super::FILTER_MS + self.value(15_034, input),
            Switch::Bit(_) => 0.0,
        }
    }

    /// LNZ-OMS-02, LNZ-OMS-05: the change to special operation executes the stop of C15200.
    fn selected(&self, selector: Switch) -> Trial {
        let mut step = self.begin("OMS", "select special operation at standstill".into(), "LNZ-OMS-05");
        self.switched(&mut step, REQUEST_MS, &[(selector, true)]);
        let at = REQUEST_MS + self.delay(selector);
        let end = at + self.value(15_305, 0) + 4.0;
        step.quiet(REQUEST_MS);
        let active = status::OMS_ACTIVE;
        step.expect(format!("status bit {active}"), REQUEST_MS, at + 2.0, Probe::Bit(active, true));
        match self.set(15_200, 0) {
            0 => step.expect("STO: torque off", REQUEST_MS, at + 2.0, Probe::TorqueOff),
            1 => step.expect("SS1, then torque off", REQUEST_MS, end, Probe::TorqueOff),
            _ => step.expect("SS2, then SOS", REQUEST_MS, end, Probe::Bit(status::SOS_MONITORED, true)),
        }
        self.settle(&mut step, end + 20.0);
        step.trial
    }

    /// Special operation, stopped and confirmed; returns when it is confirmed.
    fn confirm(&self, step: &mut Step, selector: Switch, enable: Switch) -> f64 {
        self.switched(step, REQUEST_MS, &[(selector, true), (enable, false)]);
        let stopped = REQUEST_MS + self.delay(selector) + self.value(15_305, 0) + 50.0;
        self.switched(step, stopped, &[(selector, true), (enable, true)]);
        stopped + self.delay(enable)
    }

    /// LNZ-ES-03, LNZ-OMS-06: free to move by the edge of the enable switch, as long as it is held.
    fn enabled(&self, selector: Switch, enable: Switch) -> Trial {
        let mut step = self.begin("ES", "special operation, enable switch on, then off".into(), "LNZ-ES-03");
        let confirmed = self.confirm(&mut step, selector, enable);
        let active = status::ES_ACTIVE;
        let (earliest, latest) = (confirmed - self.delay(enable), confirmed + 3.0);
        step.expect(format!("status bit {active}"), earliest, latest, Probe::Bit(active, true));
        step.expect("torque on, no code", confirmed + 30.0, confirmed + 50.0, Probe::Recovered);
        let off = confirmed + 100.0;
        self.switched(&mut step, off, &[(selector, true), (enable, false)]);
        let end = off + self.delay(enable) + self.value(15_305, 0) + 4.0;
        match self.set(15_200, 0) {
            0 | 1 => step.expect("stopped again: torque off", off, end, Probe::LaterOff),
            _ => step.expect("stopped again: SOS", off, end, Probe::LaterBit(status::SOS_MONITORED)),
        }
        self.settle(&mut step, end + 20.0);
        step.trial
    }

    /// LNZ-SLI-02
    fn increment(&self, selector: Switch, enable: Switch) -> Trial {
        let window = self.value(15_203, 0);
        let action = format!("special operation, enable switch on, move by more than {window:.0} increments");
        let mut step = self.begin("SLI", action, "LNZ-SLI-02");
        let from = self.confirm(&mut step, selector, enable) + 100.0;
        let limits = (1..=4).filter(|number| self.set(15_201, 0) == *number as i32 + 2);
        let limit = limits.map(|number| self.value(15_330, number)).fold(self.top, f64::min);
        let side = if self.blocked(self.set(15_340, 0), 1.0) { -1.0 } else { 1.0 };
        let rpm = side * limit.clamp(0.1, 60.0);
        let trip = leaves_window_ms(from, rpm, window);
        step.trial.course.speed(from, 0.0).speed(from + 0.001, rpm).speed(trip + 5.0, rpm);
        step.violation_near(trip, INCREMENT, Reaction::Code);
        step.expect("torque off", trip - 1.0, trip + 1.0, Probe::LaterOff);
        self.settle(&mut step, trip + 10.0);
        step.trial
    }
}
