//! What is remembered of an active function, and the verdict on it.
//!
//! The line of an approach is never stored: it is `start - slope * elapsed`, compared as
//! an exact fraction, so that a value equal to the limit is inside at any cycle (DEC-01).

use super::Motion;
use super::calm::Band;
use super::spec::{Approach, Quantity, Range, Spec};
use crate::twin::Twin;

/// Largest speed any ramp monitoring accepts, 1/1000 rpm (AMKP-RAMP-04).
pub const SPEED_MAX: i64 = 60_000_000;

/// How far a function is (AMK-RAMP-01).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// A: not monitored.
    Delay,
    /// B: the line is monitored.
    Line,
    /// C: the window is monitored.
    Window,
}

/// What was left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breach {
    /// Faster than any ramp monitoring accepts.
    TooFast,
    /// The line, or the far limit during the line.
    Line,
    /// Outside the window at the moment the line has met it.
    Landing,
    /// Above the upper limit.
    Above(Quantity),
    /// Below the lower limit.
    Below(Quantity),
    /// The record itself is damaged.
    Damage,
}

/// A function's answer in one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdict {
    /// How far it is.
    pub phase: Phase,
    /// What was left, if anything.
    pub breach: Option<Breach>,
}

/// Start of an active function, each value with its complement.
#[derive(Debug, Clone, Copy)]
pub struct Record {
    start: Twin,
    speed: Twin,
    position: Twin,
    landed: Twin,
    /// Since when the speed has been inside the window, for a dwell time.
    inside: Twin,
}

/// "Not yet" in a time place.
const NEVER: i64 = -1;

impl Record {
    /// Starts at `now` with the motion of this cycle (DEC-03).
    pub const fn begin(now: u64, motion: &Motion) -> Self {
        Self {
            start: Twin::time(now),
            speed: Twin::new(motion.speed),
            position: Twin::new(motion.position),
            landed: Twin::flag(false),
            inside: Twin::new(NEVER),
        }
    }

    /// The window has been reached before.
    pub const fn has_landed(&self) -> bool {
        self.landed.is(true)
    }

    /// The window was reached before and is kept. Damage is no answer here: what is asked for
    /// is found whole, or the full judgement follows.
    #[inline]
    pub fn keeps(&self, window: &Range, motion: &Motion, band: &mut Band) -> bool {
        let Some(reference) = self.position.get() else { return false };
        let is_inside = breach_of(window, motion, reference).is_none();
        let keeps = is_inside & (self.landed == Twin::flag(true));
        if keeps {
            band.stay_inside(window, reference);
        }
        keeps
    }

    /// Narrows `band` to where the next cycle's verdict is the same as `phase` without a breach.
    pub fn hold(&self, spec: &Spec, phase: Phase, band: &mut Band) {
        let approach = &spec.approach;
        let (Some(start), Some(reference)) = (self.start.get(), self.position.get()) else {
            return band.shut();
        };
        let has_line = (phase == Phase::Line) & (approach.slope.num > 0);
        let may_end = approach.track_peak | approach.watch_start | (approach.dwell_ns >= 0);
        if phase == Phase::Window {
            self.hold_window(spec, reference, band);
        } else if has_line | may_end {
            band.shut();
        } else {
            // Nothing but time ends a delay, or an approach without a line (DEC-02, DEC-07).
            let by_time = if phase == Phase::Delay { approach.delay_ns } else { approach.timeout_ns };
            let ends = if approach.timeout_ns >= 0 { by_time.min(approach.timeout_ns) } else { by_time };
            band.ends_at(start.saturating_add(ends));
        }
    }

    fn hold_window(&self, spec: &Spec, reference: i64, band: &mut Band) {
        let is_past = spec.hold_only | spec.lands_free;
        if !is_past {
            band.stay_inside(&spec.window, reference);
        }
        band.stay_inside(&spec.hold, reference);
        match spec.ratchet {
            1 => band.at_most(Quantity::Travel, reference),
            -1 => band.at_least(Quantity::Travel, reference),
            _ => {}
        }
    }

    /// Reference position, increments.
    pub fn reference(&self) -> Option<i64> {
        self.position.get()
    }

    /// Keeps what depends on the cycle: landing, latched reference, peak and dwell.
    pub fn note(&mut self, spec: &Spec, verdict: &Verdict, now: u64, motion: &Motion) {
        match verdict.phase {
            Phase::Delay if spec.approach.track_peak => self.note_peak(motion),
            Phase::Window => self.note_landing(spec, motion),
            Phase::Delay | Phase::Line => {}
        }
        if spec.approach.dwell_ns >= 0 {
            self.note_dwell(spec, now, motion);
        }
    }

    fn note_landing(&mut self, spec: &Spec, motion: &Motion) {
        if self.landed.is(true) {
            return self.note_furthest(spec, motion);
        }
        self.landed = Twin::flag(true);
        if spec.latch_late {
            self.position = Twin::new(motion.position);
        }
    }

    /// A function that has reached its window already (LNZ-SOS-04).
    #[must_use]
    pub const fn landed(self) -> Self {
        Self { landed: Twin::flag(true), ..self }
    }

    fn note_furthest(&mut self, spec: &Spec, motion: &Motion) {
        let Some(reference) = self.position.get() else { return };
        let furthest = match spec.ratchet {
            1 => reference.max(motion.position),
            -1 => reference.min(motion.position),
            _ => return,
        };
        self.position = Twin::new(furthest);
    }

    fn note_peak(&mut self, motion: &Motion) {
        let peak = self.speed.get().map_or(0, i64::saturating_abs);
        if motion.speed.saturating_abs() > peak {
            self.speed = Twin::new(motion.speed);
        }
    }

    fn note_dwell(&mut self, spec: &Spec, now: u64, motion: &Motion) {
        let inside = breach_of(&spec.window, motion, 0).is_none();
        if !inside {
            self.inside = Twin::new(NEVER);
        } else if self.inside.get() == Some(NEVER) {
            self.inside = Twin::time(now);
        }
    }

    /// Time since the start and time inside the window, ns; negative: not inside.
    pub fn progress(&self, now: u64) -> Option<(i64, i64)> {
        self.values(now).map(|values| (values.elapsed, values.dwelt))
    }

    /// Whether the motion is permitted `now`; a pure function of what it is given.
    pub fn judge(&self, spec: &Spec, now: u64, motion: &Motion) -> Verdict {
        match self.values(now) {
            Some(values) => values.judge(spec, motion),
            None => Verdict { phase: Phase::Window, breach: Some(Breach::Damage) },
        }
    }

    #[inline]
    fn values(&self, now: u64) -> Option<Values> {
        let start = self.start.get_time()?;
        let inside = self.inside.get()?;
        Some(Values {
            elapsed: now.saturating_sub(start) as i64,
            speed: self.speed.get()?,
            position: self.position.get()?,
            landed: self.landed.is(true),
            dwelt: if inside == NEVER { NEVER } else { now.saturating_sub(inside as u64) as i64 },
        })
    }
}

struct Values {
    elapsed: i64,
    speed: i64,
    position: i64,
    landed: bool,
    dwelt: i64,
}

impl Values {
    fn judge(&self, spec: &Spec, motion: &Motion) -> Verdict {
        if self.landed {
            return Verdict { phase: Phase::Window, breach: self.window_breach(spec, motion) };
        }
        if let Some(verdict) = self.early_end(spec, motion) {
            return verdict;
        }
        let past = self.elapsed.saturating_sub(spec.approach.delay_ns);
        let line = Line::new(&spec.approach, self.speed, past.max(0), &spec.window);
        if past < 0 {
            let breach = || line.breach(&spec.approach, motion.speed);
            let is_watched = spec.approach.watch_start;
            return Verdict { phase: Phase::Delay, breach: is_watched.then(breach).flatten() };
        }
        if line.is_met(&spec.approach) {
            if spec.approach.line_ends {
                return self.landing(spec, motion);
            }
            let outside = breach_of(&spec.window, motion, self.position).is_some();
            return Verdict { phase: Phase::Line, breach: outside.then_some(Breach::Line) };
        }
        Verdict { phase: Phase::Line, breach: line.breach(&spec.approach, motion.speed) }
    }

    /// DEC-05: the line, not the speed, ends the ramp; outside at that moment is a breach.
    fn landing(&self, spec: &Spec, motion: &Motion) -> Verdict {
        let reference = if spec.latch_late { motion.position } else { self.position };
        let outside = if spec.lands_free { None } else { breach_of(&spec.window, motion, reference) };
        let breach = match outside {
            Some(_) if has_approach(&spec.approach) => {
                Some(too_fast(spec, motion).unwrap_or(Breach::Landing))
            }
            Some(breach) => Some(breach),
            None => breach_of(&spec.hold, motion, reference),
        };
        Verdict { phase: Phase::Window, breach }
    }

    fn window_breach(&self, spec: &Spec, motion: &Motion) -> Option<Breach> {
        let is_past = spec.hold_only | spec.lands_free;
        let first = if is_past { None } else { breach_of(&spec.window, motion, self.position) };
        let second = || breach_of(&spec.hold, motion, self.position);
        first.or_else(second).map(|breach| too_fast(spec, motion).unwrap_or(breach))
    }

    /// Dwell time or time-out, where one is configured (DEC-05).
    fn early_end(&self, spec: &Spec, motion: &Motion) -> Option<Verdict> {
        let approach = &spec.approach;
        let inside = breach_of(&spec.window, motion, self.position).is_none();
        let may_dwell = approach.dwell_ns >= 0;
        let dwelt = self.dwelt.max(if inside { 0 } else { NEVER }) >= approach.dwell_ns;
        if may_dwell & inside & dwelt {
            return Some(Verdict { phase: Phase::Window, breach: None });
        }
        let may_time_out = approach.timeout_ns >= 0;
        if may_time_out & (self.elapsed >= approach.timeout_ns) {
            let late = approach.timeout_strict & !inside;
            return Some(Verdict { phase: Phase::Window, breach: late.then_some(Breach::Landing) });
        }
        None
    }
}

fn has_approach(approach: &Approach) -> bool {
    (approach.delay_ns > 0) | (approach.slope.num > 0) | (approach.timeout_ns >= 0)
}

fn too_fast(spec: &Spec, motion: &Motion) -> Option<Breach> {
    let is_too_fast = motion.speed.saturating_abs() > SPEED_MAX;
    (spec.names_too_fast & is_too_fast).then_some(Breach::TooFast)
}

/// The two monitored lines of an approach: down from above the window, up from below it.
/// A function whose latched speed is inside the window has met it at once.
struct Line<'a> {
    /// Speed the line starts from, 1/1000 rpm.
    start: i64,
    /// `slope * elapsed`, numerator over the slope's denominator.
    fallen: i128,
    den: i128,
    window: &'a Range,
}

impl<'a> Line<'a> {
    fn new(approach: &Approach, latched: i64, past: i64, window: &'a Range) -> Self {
        let start = line_start(approach, latched);
        let num = if approach.falls_to_zero { start.saturating_abs() } else { approach.slope.num };
        Self {
            start,
            fallen: i128::from(num) * i128::from(past),
            den: i128::from(approach.slope.den),
            window,
        }
    }

    /// Distance of `speed` below the start of the line, over the denominator.
    fn distance(&self, from: i64, to: i64) -> i128 {
        (i128::from(from) - i128::from(to)) * self.den
    }

    fn is_met(&self, approach: &Approach) -> bool {
        let has_line = (approach.slope.num > 0) & (self.window.quantity == Quantity::Speed);
        if !has_line {
            // DEC-07: the window applies after the delay; a pure time-out ends elsewhere.
            return approach.timeout_ns < 0;
        }
        let above = self.distance(self.start, self.window.upper) > self.fallen;
        let below = self.distance(self.window.lower, self.start) > self.fallen;
        !(above | below)
    }

    fn breach(&self, approach: &Approach, speed: i64) -> Option<Breach> {
        let is_watched = approach.watch_line & (approach.slope.num > 0);
        if !is_watched {
            return None;
        }
        if speed.saturating_abs() > SPEED_MAX {
            return Some(Breach::TooFast);
        }
        // DEC-06: in the own direction the line, on the other side the far limit.
        let above_line = self.distance(self.start, speed) < self.fallen;
        let below_line = self.distance(speed, self.start) < self.fallen;
        let above = (speed > self.window.upper) & (above_line | (self.start <= self.window.upper));
        let below = (speed < self.window.lower) & (below_line | (self.start >= self.window.lower));
        (above | below).then_some(Breach::Line)
    }
}

fn line_start(approach: &Approach, latched: i64) -> i64 {
    let share = latched.saturating_abs().saturating_mul(approach.offset_permille);
    let extra = approach.offset.saturating_add(share.checked_div(1_000).unwrap_or(0));
    if latched < 0 { latched.saturating_sub(extra) } else { latched.saturating_add(extra) }
}

/// Which side of `range` was left.
#[inline]
fn breach_of(range: &Range, motion: &Motion, reference: i64) -> Option<Breach> {
    let value = match range.quantity {
        Quantity::Speed => motion.speed,
        Quantity::Travel => motion.position.saturating_sub(reference),
        Quantity::Position => motion.position,
        Quantity::Acceleration => motion.acceleration,
        Quantity::Torque => motion.torque,
    };
    if value > range.upper {
        Some(Breach::Above(range.quantity))
    } else if value < range.lower {
        Some(Breach::Below(range.quantity))
    } else {
        None
    }
}

/// Whether the window of a bit-only function holds.
pub fn is_inside(spec: &Spec, motion: &Motion) -> bool {
    let first = breach_of(&spec.window, motion, 0).is_none();
    let second = breach_of(&spec.hold, motion, 0).is_none();
    first & second
}
