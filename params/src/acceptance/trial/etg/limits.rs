//! Limits of speed, acceleration and torque.

use super::{Etg, Instance, RAMP, REQUEST_MS, Step, Trial, WINDOW};

const SIDES: [f64; 2] = [1.0, -1.0];

impl Etg<'_> {
    /// Crosses `limit` from `ms` on; returns the cycle that sees it, and the speed reached.
    fn cross(&self, step: &mut Step, ms: f64, limit: f64, side: f64) -> (f64, f64) {
        let ms = ms.ceil();
        let beyond = limit + side * 2.0 * self.steep;
        step.trial.course.speed(ms, limit).speed(ms + 2.0, beyond);
        (ms + 1.0, beyond)
    }

    /// The same, with code and reaction, until the axis is ready again.
    fn left(&self, mut step: Step, of: Instance<'_>, ms: f64, limit: f64, side: f64) -> Trial {
        let (trip, beyond) = self.cross(&mut step, ms, limit, side);
        step.quiet(trip);
        let reaction = self.violated(&mut step, (trip, trip), of, WINDOW);
        self.brake_and_settle(&mut step, trip + 1.0, beyond, &reaction);
        step.trial
    }

    pub(super) fn limited_speed(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let Some(limit) = self.value("SLS", of.number, "velocity_limit") else { return Vec::new() };
        if !self.permitted(limit) {
            return Vec::new();
        }
        let hold = REQUEST_MS + self.time(of, "time_to_velocity_monitoring") + 100.0;
        let slow = (limit - 1.0).max(0.0);
        let side = |side: f64| {
            let action = format!("request below, exceed {:.0} rpm", side * limit);
            let mut step = self.start(of.name, action, side * slow);
            self.ask(&mut step, bit);
            step.trial.course.speed(hold, side * slow);
            self.left(step, of, hold + 1.0 / self.steep, side * limit, side)
        };
        SIDES.map(side).into_iter().chain(self.late(of, bit, limit)).collect()
    }

    pub(super) fn speed_range(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let value = |object| self.value("SSR", of.number, object);
        let (Some(high), Some(low)) = (value("velocity_upper_limit"), value("velocity_lower_limit")) else {
            return Vec::new();
        };
        let middle = f64::midpoint(high, low);
        let hold = REQUEST_MS + self.time(of, "time_to_velocity_monitoring") + 100.0;
        let sides = [(1.0, high), (-1.0, low)].into_iter().filter(|(_, limit)| self.permitted(*limit));
        let side = |(side, limit): (f64, f64)| {
            let action = format!("request at {middle:.0} rpm, leave at {limit:.0} rpm");
            let mut step = self.start(of.name, action, middle);
            self.ask(&mut step, bit);
            step.trial.course.speed(hold, middle);
            let reach = hold + (limit - middle).abs().max(1.0) / self.steep;
            self.left(step, of, reach, limit, side)
        };
        sides.map(side).chain(self.late(of, bit, high)).collect()
    }

    /// Requested above its limit, and not braked: by its line, or when its time is over.
    fn late(&self, of: Instance<'_>, bit: u8, limit: f64) -> Option<Trial> {
        let time = self.time(of, "time_to_velocity_monitoring");
        let slope = self.value(of.function, of.number, "deceleration_limit").filter(|slope| *slope > 0.0);
        let delay = self.value(of.function, of.number, "time_delay_deceleration_monitoring");
        // With a delay alone the line is the steeper of two that the set does not name (DEC-04).
        if self.top <= limit || slope.is_none() && delay.is_some() {
            return None;
        }
        let mut step =
            self.start(of.name, format!("request at {:.0} rpm, and do not brake", self.top), self.top);
        self.ask(&mut step, bit);
        let line = slope.map(|slope| delay.unwrap_or_default() + (1.0 / slope).max(1.0).ceil());
        let seen = REQUEST_MS + line.unwrap_or(f64::MAX).min(time);
        step.quiet((seen - 1.0).min(REQUEST_MS));
        let row = if line.is_some_and(|line| line < time) { RAMP } else { WINDOW };
        let reaction = self.violated(&mut step, (seen - 1.0, seen + 1.0), of, row);
        step.trial.course.speed(seen + 3.0, self.top);
        self.brake_and_settle(&mut step, seen + 3.0, self.top, &reaction);
        Some(step.trial)
    }

    pub(super) fn maximum_speed(&self) -> Vec<Trial> {
        let objects = [("velocity_maximum_positive", 1.0), ("velocity_maximum_negative", -1.0)];
        let of = self.single("SMS");
        let values = objects.map(|(object, side)| (self.value("SMS", 1, object).unwrap_or_default(), side));
        // ETG-SMS-01: active while one limit is not zero.
        if values.iter().all(|(limit, _)| *limit == 0.0) {
            return Vec::new();
        }
        let side = |(limit, side): (f64, f64)| {
            let below = side * (limit - 1.0).max(0.0);
            let step = self.start("SMS", format!("exceed {:.0} rpm", side * limit), below);
            self.left(step, of, REQUEST_MS, side * limit, side)
        };
        values.map(side).into()
    }

    /// An instance of a function that exists once.
    fn single(&self, function: &'static str) -> Instance<'static> {
        let reference = crate::key::reference(function).unwrap_or_default() as u32;
        Instance { function, number: 1, name: function, reference }
    }

    pub(super) fn acceleration_range(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let value = |object| self.value("SAR", of.number, object).unwrap_or_default();
        let (high, low) = (value("acceleration_upper_limit"), value("acceleration_lower_limit"));
        let middle = f64::midpoint(high, low);
        let side = |(side, limit): (f64, f64)| {
            let action = format!("request at {middle:.0} rpm/s, leave at {limit:.0} rpm/s");
            let mut step = self.start(of.name, action, 0.0);
            self.ask(&mut step, bit);
            self.accelerated(step, of, middle, limit, side)
        };
        [(1.0, high), (-1.0, low)].map(side).into()
    }

    pub(super) fn maximum_acceleration(&self) -> Vec<Trial> {
        let value = |object| self.value("SMA", 1, object).unwrap_or_default();
        let (high, low) = (value("acceleration_maximum"), -value("deceleration_maximum").abs());
        if high == 0.0 && low == 0.0 {
            return Vec::new();
        }
        let of = self.single("SMA");
        let side = |(side, limit): (f64, f64)| {
            let step = self.start("SMA", format!("exceed {limit:.0} rpm/s"), 0.0);
            self.accelerated(step, of, 0.0, limit, side)
        };
        [(1.0, high), (-1.0, low)].map(side).into()
    }

    /// The acceleration is a column of its own: what the speed does stays out of it.
    fn accelerated(&self, mut step: Step, of: Instance<'_>, middle: f64, limit: f64, side: f64) -> Trial {
        let column = "accel_rpm_s";
        let at = REQUEST_MS + 100.0;
        step.trial.course.set(0.0, column, middle).set(at, column, middle).set(at + 10.0, column, limit);
        step.trial.course.set(at + 12.0, column, limit + side * 2.0).set(at + 13.0, column, middle);
        let trip = at + 11.0;
        step.quiet(trip);
        let reaction = self.violated(&mut step, (trip, trip), of, WINDOW);
        self.brake_and_settle(&mut step, at + 20.0, 0.0, &reaction);
        step.trial
    }

    pub(super) fn limited_torque(&self, of: Instance<'_>, bit: u8) -> Vec<Trial> {
        let objects = [("torque_limit_positive_direction", 1.0), ("torque_limit_negative_direction", -1.0)];
        let side = |(object, side): (&str, f64)| {
            // Per mille of the rated torque; the trace has per cent.
            let limit = side * self.value("SLT", of.number, object).unwrap_or_default() / 10.0;
            let action = format!("request, exceed {limit:.1} % of the rated torque");
            let mut step = self.start(of.name, action, 0.0);
            self.ask(&mut step, bit);
            let (column, at) = ("torque_pct", REQUEST_MS + 100.0);
            step.trial.course.set(0.0, column, 0).set(REQUEST_MS, column, 0).set(at, column, limit);
            step.trial.course.set(at + 2.0, column, limit + 2.0 * side).set(at + 3.0, column, 0);
            step.quiet(at + 1.0);
            let reaction = self.violated(&mut step, (at + 1.0, at + 1.0), of, WINDOW);
            self.brake_and_settle(&mut step, at + 20.0, 0.0, &reaction);
            step.trial
        };
        objects.map(side).into()
    }
}
