//! The approach primitive of design 6: delay, then a line from the latched speed to the
//! target window (DEC-02 to DEC-07).

use super::exact::Ratio;

/// A closed range of speed, 1/1000 rpm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Lowest permitted value.
    pub lower: i64,
    /// Highest permitted value.
    pub upper: i64,
}

impl Window {
    /// `-limit ..= limit` with the limit in rpm; a negative limit counts by its size (AMK-SLS-06).
    pub fn symmetric_rpm(limit: i32) -> Self {
        let size = i64::from(limit).abs() * 1000;
        Self { lower: -size, upper: size }
    }

    /// Between two limits in rpm, in whichever order they are given.
    pub fn between_rpm(one: i32, other: i32) -> Self {
        let (one, other) = (i64::from(one) * 1000, i64::from(other) * 1000);
        Self { lower: one.min(other), upper: one.max(other) }
    }

    /// DEC-01: a value equal to a limit is inside.
    pub fn contains(&self, value: i64) -> bool {
        self.side(value).is_none()
    }

    /// On which side `value` lies outside, if it does.
    pub fn side(&self, value: i64) -> Option<Side> {
        if value > self.upper {
            Some(Side::Above)
        } else if value < self.lower {
            Some(Side::Below)
        } else {
            None
        }
    }
}

/// Which bound of a range was passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Above the upper bound.
    Above,
    /// Below the lower bound.
    Below,
}

/// What an approach demands at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// DEC-02: `t0 <= t < t1`, nothing is monitored.
    Delay,
    /// `t1 <= t < t2`: the line and the far limit are monitored.
    Ramp,
    /// `t >= t2`: the target window is in force.
    Target,
}

/// Delay, ramp and target window of one activation.
#[derive(Debug, Clone)]
pub struct Approach {
    /// t0, ms.
    pub started: i64,
    /// Delay, ms.
    pub delay: i64,
    /// Speed latched at t0, 1/1000 rpm (DEC-03).
    pub latched: i64,
    /// Slope of the line, 1/1000 rpm per ms; `None`: no line, the window comes at `latest`
    /// or, without a latest time, at the end of the delay (DEC-07).
    pub slope: Option<Ratio>,
    /// Time after t0 at which the target is in force at the latest, ms.
    pub latest: Option<i64>,
    /// The window the line leads to.
    pub target: Window,
}

impl Approach {
    /// The line at `now`, 1/1000 rpm: held until the delay has passed, then towards the
    /// target (DEC-03, DEC-06).
    fn line(&self, now: i64) -> Ratio {
        let start = Ratio::whole(self.latched);
        let elapsed = (now - self.started - self.delay).max(0);
        let Some(slope) = self.slope else { return start };
        let travelled = slope.times(elapsed);
        match self.target.side(self.latched) {
            Some(Side::Above) => start.minus(travelled),
            Some(Side::Below) => start.plus(travelled),
            None => start,
        }
    }

    /// DEC-05: the line, not the speed, ends the ramp.
    fn line_has_met_the_target(&self, now: i64) -> bool {
        let line = self.line(now);
        match self.target.side(self.latched) {
            Some(Side::Above) => line <= Ratio::whole(self.target.upper),
            Some(Side::Below) => line >= Ratio::whole(self.target.lower),
            None => true,
        }
    }

    /// The phase at `now`, ms.
    pub fn phase(&self, now: i64) -> Phase {
        let elapsed = now - self.started;
        if self.latest.is_some_and(|latest| elapsed >= latest) {
            return Phase::Target;
        }
        if elapsed < self.delay {
            return Phase::Delay;
        }
        match (self.slope.is_some(), self.latest.is_some()) {
            (true, _) if self.line_has_met_the_target(now) => Phase::Target,
            (false, false) => Phase::Target,
            (true, _) => Phase::Ramp,
            (false, true) => Phase::Delay,
        }
    }

    /// DEC-06: in the ramp the line bounds the side the motion comes from, the target
    /// window the other side.
    pub fn ramp_side(&self, now: i64, speed: i64) -> Option<Side> {
        let line = self.line(now);
        let (lower, upper) = (Ratio::whole(self.target.lower), Ratio::whole(self.target.upper));
        let (lower, upper) = match self.target.side(self.latched) {
            Some(Side::Above) => (lower, upper.max(line)),
            Some(Side::Below) => (lower.min(line), upper),
            None => (lower, upper),
        };
        let speed = Ratio::whole(speed);
        if speed > upper {
            Some(Side::Above)
        } else if speed < lower {
            Some(Side::Below)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from(latched: i64, target: Window) -> Approach {
        let slope = Some(Ratio::new(3_000_000, 1000));
        Approach { started: 10, delay: 100, latched, slope, latest: None, target }
    }

    /// DEC-02, DEC-03, DEC-05
    #[test]
    fn the_line_is_held_then_falls_and_ends_where_it_meets_the_window() {
        let ramp = from(1_500_000, Window::symmetric_rpm(30));
        assert_eq!(ramp.phase(109), Phase::Delay);
        assert_eq!(ramp.phase(110), Phase::Ramp);
        assert_eq!(ramp.ramp_side(110, 1_500_000), None);
        assert_eq!(ramp.ramp_side(111, 1_497_001), Some(Side::Above));
        // (1500 - 30) / 3 = 490 ms
        assert_eq!(ramp.phase(599), Phase::Ramp);
        assert_eq!(ramp.phase(600), Phase::Target);
    }

    /// DEC-06
    #[test]
    fn a_minimum_speed_is_approached_from_below_and_its_far_limit_holds_after_the_delay() {
        let ramp = from(0, Window { lower: 900_000, upper: 1_000_000 });
        assert_eq!(ramp.ramp_side(110, 1_000_001), Some(Side::Above));
        assert_eq!(ramp.ramp_side(210, 299_999), Some(Side::Below));
        assert_eq!(ramp.ramp_side(210, 300_000), None);
        assert_eq!(ramp.phase(409), Phase::Ramp);
        assert_eq!(ramp.phase(410), Phase::Target);
    }

    /// DEC-06
    #[test]
    fn the_other_direction_is_bounded_by_the_window() {
        let ramp = from(-1_500_000, Window::symmetric_rpm(30));
        assert_eq!(ramp.ramp_side(110, 30_001), Some(Side::Above));
        assert_eq!(ramp.ramp_side(110, -1_500_001), Some(Side::Below));
        assert_eq!(ramp.ramp_side(110, 30_000), None);
    }
}
