//! Delay, ramp and dwell on the way into a speed window (DEC-02 to DEC-07).
//!
//! The line is evaluated at the elapsed time, as a fraction: nothing is rounded and
//! nothing accumulates.

use super::{Range, Side};

/// A slope as a fraction: `rise` 1/1000 rpm in `run_ns` nanoseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Slope {
    /// 1/1000 rpm, magnitude.
    pub rise: i64,
    /// ns; 0: no ramp, the window applies at once (DEC-07).
    pub run_ns: i64,
}

/// Where the monitored line starts (DEC-03).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Origin {
    /// The speed latched at activation.
    #[default]
    Latched,
    /// The highest speed seen during the delay plus an offset (ATV, SC32).
    Highest(i64),
}

/// A line that falls from an offset start value to zero within a span (Lenze, DEC-49).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fall {
    /// Start value above the latched speed, per cent of it.
    pub percent: i64,
    /// Start value above the latched speed when `percent` is 0, 1/1000 rpm.
    pub least: i64,
    /// Held for this long, ns.
    pub hold_ns: u64,
    /// Zero is reached after this long, ns.
    pub end_ns: u64,
}

/// How a window is approached.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Approach {
    /// Not monitored for this long after activation, ns.
    pub delay_ns: u64,
    /// Slope of the monitored line.
    pub slope: Slope,
    /// Start of the monitored line.
    pub origin: Origin,
    /// Target window, 1/1000 rpm.
    pub window: Range,
    /// Inside the window for this long ends the approach early, ns (DEC-05).
    pub dwell_ns: Option<u64>,
    /// The dwell counts during the delay too.
    pub dwell_in_delay: bool,
    /// The approach ends here at the latest, ns after activation.
    pub limit_ns: Option<u64>,
    /// No line is monitored: only time and dwell end the approach (ETG, time variants).
    pub unmonitored: bool,
    /// A line that is monitored from activation on and does not end the approach.
    pub fall: Option<Fall>,
    /// Highest speed that a ramp tolerates at all, 1/1000 rpm (AMKP-RAMP-04).
    pub ceiling: Option<i64>,
}

/// An approach under way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    since_ns: u64,
    start: i64,
    inside_since_ns: Option<u64>,
}

/// Where an approach is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// On the way; nothing of it is violated.
    Under,
    /// The monitored line was left.
    Violated(Side),
    /// The window is in force from this instant on.
    Arrived,
}

impl Progress {
    /// Activation now, with the speed of now.
    pub const fn begin(now_ns: u64, speed: i64) -> Self {
        Self { since_ns: now_ns, start: speed, inside_since_ns: None }
    }

    /// When the approach was activated, ns.
    pub const fn since_ns(&self) -> u64 {
        self.since_ns
    }

    /// Since when the speed has been inside the window, ns.
    pub const fn inside_since_ns(&self) -> Option<u64> {
        self.inside_since_ns
    }

    /// The stage at `now_ns`.
    pub fn step(&mut self, plan: &Approach, now_ns: u64, speed: i64) -> Stage {
        let elapsed = now_ns.saturating_sub(self.since_ns);
        let delayed = elapsed < plan.delay_ns;
        if delayed {
            self.track_highest(plan, speed);
        }
        let dwelt = self.dwelt(plan, now_ns, speed, delayed);
        let expired = plan.limit_ns.is_some_and(|limit| elapsed >= limit);
        if dwelt | expired {
            return Stage::Arrived;
        }
        if let Some(fall) = &plan.fall {
            return self.under_fall(plan, fall, elapsed, speed);
        }
        if delayed {
            return Stage::Under;
        }
        if plan.unmonitored {
            // Without a time limit an unmonitored approach is its delay alone.
            return if plan.limit_ns.is_some() { Stage::Under } else { Stage::Arrived };
        }
        self.on_line(plan, elapsed.saturating_sub(plan.delay_ns), speed)
    }

    fn track_highest(&mut self, plan: &Approach, speed: i64) {
        let higher = speed.saturating_abs() > self.start.saturating_abs();
        if matches!(plan.origin, Origin::Highest(_)) & higher {
            self.start = speed;
        }
    }

    fn dwelt(&mut self, plan: &Approach, now_ns: u64, speed: i64, delayed: bool) -> bool {
        let Some(dwell_ns) = plan.dwell_ns else { return false };
        let counts = plan.dwell_in_delay | !delayed;
        let inside = plan.window.left_by(speed).is_none();
        if !(counts & inside) {
            self.inside_since_ns = None;
            return false;
        }
        let since = *self.inside_since_ns.get_or_insert(now_ns);
        now_ns.saturating_sub(since) >= dwell_ns
    }

    fn on_line(&self, plan: &Approach, ramp_ns: u64, speed: i64) -> Stage {
        let start = self.line_start(plan.origin);
        let (limit, falling) = match plan.window.left_by(start) {
            Some(Side::Upper) => (plan.window.upper, true),
            Some(_) => (plan.window.lower, false),
            None => return Stage::Arrived,
        };
        if plan.slope.run_ns == 0 {
            return Stage::Arrived;
        }
        if plan.ceiling.is_some_and(|ceiling| speed.saturating_abs() > ceiling) {
            return Stage::Violated(Side::Ceiling);
        }
        let run = i128::from(plan.slope.run_ns);
        let fallen = i128::from(plan.slope.rise).wrapping_mul(i128::from(ramp_ns));
        let distance = i128::from(start).wrapping_sub(i128::from(limit)).wrapping_abs();
        let left = distance.wrapping_mul(run).wrapping_sub(fallen);
        // DEC-05: the line, not the speed, ends the ramp.
        if left <= 0 {
            return Stage::Arrived;
        }
        let beyond = i128::from(speed).wrapping_sub(i128::from(limit));
        let beyond = if falling { beyond } else { beyond.wrapping_neg() };
        // DEC-06: the own direction against the line, the other side against the window.
        if beyond.wrapping_mul(run) > left {
            return Stage::Violated(if falling { Side::Upper } else { Side::Lower });
        }
        match (falling, plan.window.left_by(speed)) {
            (true, Some(Side::Lower)) => Stage::Violated(Side::Lower),
            (false, Some(Side::Upper)) => Stage::Violated(Side::Upper),
            _ => Stage::Under,
        }
    }

    fn under_fall(&self, plan: &Approach, fall: &Fall, elapsed: u64, speed: i64) -> Stage {
        let magnitude = self.start.saturating_abs();
        let share = magnitude.saturating_mul(fall.percent) / 100;
        let offset = if fall.percent == 0 { fall.least } else { share };
        let top = i128::from(magnitude.saturating_add(offset));
        let span = i128::from(fall.end_ns.saturating_sub(fall.hold_ns));
        let left = i128::from(fall.end_ns.saturating_sub(elapsed.max(fall.hold_ns)));
        let forward = if self.start < 0 { speed.saturating_neg() } else { speed };
        let above_line = i128::from(forward).wrapping_mul(span) > top.wrapping_mul(left);
        // DEC-49: never below the tolerance window.
        let above_window = forward > plan.window.upper;
        let behind = forward < plan.window.lower;
        match (above_line & above_window, behind) {
            (false, false) => Stage::Under,
            (above, _) => Stage::Violated(if above == (self.start >= 0) { Side::Upper } else { Side::Lower }),
        }
    }

    fn line_start(&self, origin: Origin) -> i64 {
        match origin {
            Origin::Latched => self.start,
            Origin::Highest(offset) => {
                let magnitude = self.start.saturating_abs().saturating_add(offset);
                if self.start < 0 { magnitude.saturating_neg() } else { magnitude }
            }
        }
    }
}
