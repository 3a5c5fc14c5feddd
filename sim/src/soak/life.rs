//! One axis in closed loop: the paths feed the motor, the motor feeds the encoders.

use params::AxisSet;
use shm_schema::exchange::{Motion, Start};

use super::Act;
use crate::control::Control;
use crate::machine::{Axis, Cores, Options, Stimulus, View, Wiring};
use crate::motor::{Motor, MotorData};
use crate::replay::Words;
use crate::trace::Faults;

/// Seconds of one cycle.
const CYCLE_S: f64 = 0.001;
/// Below this magnitude the drive says its speed is zero, 1/1000 rpm.
const STANDSTILL_MRPM: i32 = 5_000;

/// What one cycle showed.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// Number of the cycle.
    pub cycle: u64,
    /// What went in.
    pub stimulus: &'a Stimulus,
    /// a, b, crosscheck.
    pub views: &'a [View; 3],
}

/// An axis that lives.
#[derive(Debug)]
pub struct Life {
    axis: Axis<channel_a::Monitor, channel_b::Monitor, crosscheck::Crosscheck>,
    control: Control,
    motor: Motor,
    faults: Faults,
    stimulus: Stimulus,
}

impl Life {
    /// A settled axis at rest.
    pub fn new(set: &AxisSet, seed: u64) -> Self {
        Self::with_signals(set, seed, false)
    }

    /// A settled axis at rest; `raw`: its motion reaches the cores as encoder signals.
    pub fn with_signals(set: &AxisSet, seed: u64, raw: bool) -> Self {
        let words = Words::of(set);
        let options = Options { seed, raw_encoder: raw, ..Options::default() };
        let cores = Cores::of(set, 1, Start::Settled);
        Self {
            axis: Axis::new(cores, &Wiring::of(set), options),
            control: Control::new(set.profile, words.neutral, crate::replay::control_bits(set)),
            motor: Motor::new(MotorData::default()),
            faults: Faults::NONE,
            stimulus: crate::replay::idle_stimulus(&words),
        }
    }

    /// Does something to the axis before cycle `cycle`.
    pub fn act(&mut self, act: &Act, cycle: u64) {
        match act {
            Act::Inject(faults) => self.faults = *faults,
            // A plan holds only what the control knows.
            Act::Tell(instruction) => drop(self.control.take(instruction, cycle)),
        }
    }

    /// One cycle of a millisecond.
    pub fn step(&mut self, cycle: u64) -> Moment<'_> {
        if let Some(rpm) = self.control.set_point_rpm.take() {
            self.motor.set_point(rpm);
        }
        if let Some(rpm_s) = self.control.ramp_rpm_s.take() {
            self.motor.ramp(rpm_s);
        }
        if cycle > 0 {
            let energised = self.axis.torque() & self.control.drive_enabled;
            self.motor.step(CYCLE_S, energised, self.axis.drive_request());
        }
        self.sense(cycle);
        self.axis.step(&self.stimulus);
        Moment { cycle, stimulus: &self.stimulus, views: self.axis.views() }
    }

    fn sense(&mut self, cycle: u64) {
        let (word, lines) = self.control.show(cycle);
        let speed_mrpm = self.motor.speed_mrpm();
        let motion = Motion { position: self.motor.position(), speed_mrpm, acceleration_mrpm_s: None };
        self.stimulus = Stimulus {
            motion_a: motion,
            motion_b: motion,
            fine: Some([self.motor.fine(); 2]),
            torque_ppm: self.motor.torque_ppm(),
            word,
            lines,
            clear_error: self.control.clear_error,
            drive_n0: speed_mrpm.abs() < STANDSTILL_MRPM,
            drive_enabled: self.control.drive_enabled,
            faults: self.faults,
        };
    }
}
