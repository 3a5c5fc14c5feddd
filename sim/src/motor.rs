//! A drive with its motor: ramp generator, speed control with a torque limit, inertia and
//! friction, coasting without torque, holding brake.

use shm_schema::INCREMENTS_PER_REVOLUTION;
use shm_schema::drive::DriveRequest;

use crate::signals::FINE;

/// What the mechanics and the drive can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorData {
    /// Acceleration of the inertia at rated torque, rpm/s.
    pub rated_rpm_s: f64,
    /// Torque limit, parts of the rated torque.
    pub torque_max: f64,
    /// Dry friction as deceleration, rpm/s.
    pub friction_rpm_s: f64,
    /// Friction that grows with the speed, 1/s.
    pub drag_per_s: f64,
    /// The drive's own ramp, rpm/s.
    pub ramp_rpm_s: f64,
    /// Deceleration of the closed holding brake, rpm/s.
    pub brake_rpm_s: f64,
}

impl Default for MotorData {
    fn default() -> Self {
        Self {
            rated_rpm_s: 20_000.0,
            torque_max: 2.5,
            friction_rpm_s: 250.0,
            drag_per_s: 0.4,
            ramp_rpm_s: 6_000.0,
            brake_rpm_s: 40_000.0,
        }
    }
}

/// A drive brakes this much steeper than it is asked to, so that it stays clear of the line
/// that is monitored.
const STEEPER: f64 = 1.1;
/// Speed error that the speed control removes within one of these, 1/s.
const GAIN_PER_S: f64 = 150.0;

/// State of one drive and motor.
#[derive(Debug, Clone)]
pub struct Motor {
    data: MotorData,
    set_point_rpm: f64,
    ramp_rpm: f64,
    speed_rpm: f64,
    torque: f64,
    fine: f64,
    had_torque: bool,
}

impl Motor {
    /// A motor at rest at position 0.
    pub const fn new(data: MotorData) -> Self {
        Self {
            data,
            set_point_rpm: 0.0,
            ramp_rpm: 0.0,
            speed_rpm: 0.0,
            torque: 0.0,
            fine: 0.0,
            had_torque: false,
        }
    }

    /// Asks for a speed.
    pub fn set_point(&mut self, rpm: f64) {
        self.set_point_rpm = rpm;
    }

    /// Changes the drive's own ramp, rpm/s.
    pub fn ramp(&mut self, rpm_s: f64) {
        self.data.ramp_rpm_s = rpm_s.max(1.0);
    }

    /// Moves on by `seconds`; `energised`: both paths permit torque.
    pub fn step(&mut self, seconds: f64, energised: bool, request: &DriveRequest) {
        // A drive that lost its torque waits for a new set point: nothing restarts singly.
        if self.had_torque && !energised {
            self.set_point_rpm = 0.0;
        }
        self.had_torque = energised;
        let before = self.speed_rpm;
        self.torque = if energised { self.control(seconds, request) } else { self.coast() };
        let driven = before + self.torque * self.data.rated_rpm_s * seconds;
        self.speed_rpm = self.slowed(driven, seconds, energised | request.brake_open);
        let turned = f64::midpoint(before, self.speed_rpm) * seconds / 60.0;
        self.fine += turned * (INCREMENTS_PER_REVOLUTION * FINE) as f64;
    }

    fn coast(&mut self) -> f64 {
        self.ramp_rpm = self.speed_rpm;
        0.0
    }

    fn control(&mut self, seconds: f64, request: &DriveRequest) -> f64 {
        let (target, slope) = self.target(request);
        let before = self.ramp_rpm;
        let reach = slope * seconds;
        self.ramp_rpm += (target - before).clamp(-reach, reach);
        let ahead = (self.ramp_rpm - before) / seconds;
        let wanted = ahead + (self.ramp_rpm - self.speed_rpm) * GAIN_PER_S;
        let friction = self.ramp_rpm * self.data.drag_per_s + sign(self.ramp_rpm) * self.data.friction_rpm_s;
        ((wanted + friction) / self.data.rated_rpm_s).clamp(-self.data.torque_max, self.data.torque_max)
    }

    /// Speed to go to, and the slope to go there with.
    fn target(&self, request: &DriveRequest) -> (f64, f64) {
        if request.brake {
            let asked = f64::from(request.deceleration_rpm_s) * STEEPER;
            return (0.0, if asked > 0.0 { asked } else { self.data.ramp_rpm_s });
        }
        if request.limit_set_point {
            let low = f64::from(request.set_point_min_mrpm) / 1_000.0;
            let high = f64::from(request.set_point_max_mrpm) / 1_000.0;
            return (self.set_point_rpm.min(high).max(low), self.data.ramp_rpm_s);
        }
        (self.set_point_rpm, self.data.ramp_rpm_s)
    }

    fn slowed(&self, speed: f64, seconds: f64, brake_open: bool) -> f64 {
        let brake = if brake_open { 0.0 } else { self.data.brake_rpm_s };
        let loss = (self.data.friction_rpm_s + speed.abs() * self.data.drag_per_s + brake) * seconds;
        if speed.abs() <= loss { 0.0 } else { speed - sign(speed) * loss }
    }

    /// Speed, 1/1000 rpm.
    pub fn speed_mrpm(&self) -> i32 {
        (self.speed_rpm * 1_000.0).round() as i32
    }

    /// Position in 1/[`FINE`] increments.
    pub fn fine(&self) -> i64 {
        self.fine.round() as i64
    }

    /// Position, increments.
    pub fn position(&self) -> i64 {
        self.fine().div_euclid(FINE)
    }

    /// Torque, millionths of the rated torque.
    pub fn torque_ppm(&self) -> i32 {
        (self.torque * 1e6).round() as i32
    }
}

fn sign(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.signum() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: f64 = 0.001;
    const OPEN: DriveRequest = DriveRequest {
        brake: false,
        deceleration_rpm_s: 0,
        limit_set_point: false,
        set_point_max_mrpm: 0,
        set_point_min_mrpm: 0,
        brake_open: true,
        outputs: 0,
    };

    fn run(motor: &mut Motor, milliseconds: u32, energised: bool, request: &DriveRequest) -> i32 {
        for _ in 0..milliseconds {
            motor.step(MS, energised, request);
        }
        motor.speed_mrpm()
    }

    fn running() -> Motor {
        let mut motor = Motor::new(MotorData::default());
        motor.set_point(1_500.0);
        assert!((run(&mut motor, 600, true, &OPEN) - 1_500_000).abs() < 5_000);
        motor
    }

    #[test]
    fn it_reaches_its_set_point_and_position_is_the_integral_of_speed() {
        let mut motor = running();
        let before = motor.position();
        run(&mut motor, 1_000, true, &OPEN);
        assert!((motor.position() - before - 25 * INCREMENTS_PER_REVOLUTION).abs() < 3_000);
    }

    #[test]
    fn without_torque_it_coasts_and_does_not_restart_by_itself() {
        let mut motor = running();
        let coasting = run(&mut motor, 100, false, &OPEN);
        assert!((1_300_000..1_480_000).contains(&coasting), "{coasting}");
        assert_eq!(motor.torque_ppm(), 0);
        run(&mut motor, 10_000, false, &OPEN);
        assert_eq!(run(&mut motor, 500, true, &OPEN), 0, "the old set point is forgotten");
    }

    #[test]
    fn asked_to_brake_it_stays_below_the_line_it_was_given() {
        let mut motor = running();
        let request = DriveRequest { brake: true, deceleration_rpm_s: 3_000, ..OPEN };
        for millisecond in 1..=500 {
            let speed = run(&mut motor, 1, true, &request);
            let line = 1_500_000 - 3_000 * (millisecond - 5).max(0);
            assert!(speed <= line + 6_000, "{millisecond} ms: {speed} above {line}");
        }
        assert_eq!(motor.speed_mrpm() / 2_000, 0);
    }

    #[test]
    fn the_set_point_limit_and_the_brake_are_obeyed() {
        let mut motor = running();
        let limit = DriveRequest { limit_set_point: true, set_point_max_mrpm: 500_000, ..OPEN };
        assert!((run(&mut motor, 500, true, &limit) - 500_000).abs() < 5_000);
        let closed = DriveRequest { brake_open: false, ..OPEN };
        assert_eq!(run(&mut motor, 50, false, &closed), 0);
    }
}
