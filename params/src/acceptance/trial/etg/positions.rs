//! Limits of the position: SOS, SLI, SLP, SDI.

use super::{Etg, Instance, REQUEST_MS, Step, Trial, WINDOW};
use crate::acceptance::trial::leaves_window_ms;

/// Speed at which a window is left, 1/min.
const SLOW: f64 = 10.0;
/// Increments from which a step to an absolute limit begins.
const NEAR: f64 = 1_000.0;

impl Etg<'_> {
    /// From standstill at `from` out of a window, without a jump of the speed.
    fn moved(&self, step: &mut Step, from: f64, rpm: f64, window: f64) -> f64 {
        let ramp = rpm.abs() / self.steep;
        step.trial.course.speed(from, 0.0).speed(from + ramp, rpm);
        // Half the way of a constant speed while it grows.
        let way = |ms: f64| rpm.abs() * 65_536.0 / 60_000.0 * ms / 2.0;
        let trip = if way(ramp) > window + 0.5 {
            from + (ramp * ((window + 0.5) / way(ramp)).sqrt()).ceil()
        } else {
            leaves_window_ms(from + ramp / 2.0, rpm, window)
        };
        step.trial.course.speed(trip.max(from + ramp) + 1.0, rpm);
        trip
    }

    fn out_of(&self, of: Instance<'_>, bit: u8, rpm: f64, window: f64) -> Trial {
        let action =
            format!("request at standstill, move by more than {:.0} increments", window * rpm.signum());
        let mut step = self.start(of.name, action, 0.0);
        self.ask(&mut step, bit);
        self.out(step, of, rpm, window)
    }

    fn out(&self, mut step: Step, of: Instance<'_>, rpm: f64, window: f64) -> Trial {
        let from = REQUEST_MS + 100.0;
        let trip = self.moved(&mut step, from, rpm, window);
        step.quiet(trip - 1.0);
        let reaction = self.violated(&mut step, (trip - 1.0, trip + 1.0), of, WINDOW);
        let end = trip.max(from + rpm.abs() / self.steep) + 2.0;
        self.brake_and_settle(&mut step, end, rpm, &reaction);
        step.trial
    }

    pub(super) fn standstill(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let window = self.time(of, "position_zero_window");
        let speed = self.value("SOS", of.number, "velocity_zero_window");
        let rpm = speed.unwrap_or(SLOW).min(SLOW).min(self.top);
        let mut trials = Vec::new();
        // Where the speed may be no more than zero, only the speed can be left.
        if rpm > 0.0 {
            trials.extend([rpm, -rpm].map(|rpm| self.out_of(of, bit, rpm, window)));
        }
        trials.extend(speed.and_then(|limit| self.too_fast(of, bit, limit, window)));
        trials
    }

    /// The speed window, where it is left before the position window.
    fn too_fast(&self, of: Instance<'_>, bit: u8, limit: f64, window: f64) -> Option<Trial> {
        let from = REQUEST_MS + 100.0;
        let ms = (limit / self.steep).floor() + 1.0;
        let way = limit.max(self.steep) * 65_536.0 / 60_000.0 * ms / 2.0;
        if way >= window || limit + self.steep > self.top {
            return None;
        }
        let mut step = self.start(of.name, format!("request at standstill, exceed {limit:.0} rpm"), 0.0);
        self.ask(&mut step, bit);
        let rpm = limit + 2.0 * self.steep;
        step.trial.course.speed(from, 0.0).speed(from + rpm / self.steep, rpm);
        step.quiet(from + ms - 1.0);
        let reaction = self.violated(&mut step, (from + ms - 1.0, from + ms + 1.0), of, WINDOW);
        self.brake_and_settle(&mut step, from + rpm / self.steep + 1.0, rpm, &reaction);
        Some(step.trial)
    }

    pub(super) fn limited_increment(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let objects = [("position_relative_upper_limit", 1.0), ("position_relative_lower_limit", -1.0)];
        let rpm = SLOW.min(self.top);
        objects.map(|(object, side)| self.out_of(of, bit, side * rpm, self.time(of, object))).into()
    }

    pub(super) fn directions(&self) -> Vec<Trial> {
        let reference = crate::key::reference("SDI").unwrap_or_default() as u32;
        let window = self.value("SDI", 1, "position_zero_window").unwrap_or_default();
        let zero = self.value("SDI", 1, "velocity_zero_window").filter(|rpm| *rpm > 0.0);
        let rpm = zero.unwrap_or(SLOW).min(SLOW).min(self.top);
        let side = |(name, forbidden): (&str, f64)| {
            let bit = self.request(name)?;
            let action = format!("forbid the direction at standstill, move {window:.0} increments in it");
            let mut step = self.start(name, action, 0.0);
            self.ask(&mut step, bit);
            let of = Instance { function: "SDI", number: 1, name, reference };
            Some(self.out(step, of, forbidden * rpm, window))
        };
        // Bit SDIP 0 disables the positive direction.
        [("SDIP", 1.0), ("SDIN", -1.0)].into_iter().filter_map(side).collect()
    }

    /// ETG-SLP-01: absolute, so the step begins near the limit.
    pub(super) fn limited_position(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let value = |object| self.value("SLP", of.number, object).unwrap_or_default();
        let (high, low) = (value("position_upper_limit"), value("position_lower_limit"));
        let near = NEAR.min((high - low) / 2.0).floor();
        let side = |(side, limit): (f64, f64)| {
            let mut step =
                self.start_still(of.name, format!("request inside, go beyond {limit:.0} increments"));
            self.ask(&mut step, bit);
            let (column, at) = ("pos_incr", REQUEST_MS + 100.0);
            // The speed is that of the segments; nothing is asked of their joints.
            step.trial.course.set(0.0, "accel_rpm_s", 0);
            let rate = (self.top.min(60.0) * 65_536.0 / 60_000.0).max(1.0);
            let reach = at + (near / rate).ceil();
            let course = &mut step.trial.course;
            course.set(0.0, column, limit - side * near).set(at, column, limit - side * near);
            course.set(reach, column, limit).set(reach + 2.0, column, limit + side * 2.0);
            step.quiet(reach + 1.0);
            let reaction = self.violated(&mut step, (reach + 1.0, reach + 1.0), of, WINDOW);
            // Back inside: the acknowledge is refused while the limit is violated.
            let back = reach + 50.0;
            let course = &mut step.trial.course;
            course.set(back, column, limit + side * 2.0).set(back + 20.0, column, limit - side * near);
            let _ = reaction;
            self.release(&mut step, back + 100.0 + self.longest());
            step.trial
        };
        [(1.0, high), (-1.0, low)].map(side).into()
    }
}
