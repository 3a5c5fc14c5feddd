//! All columns of one axis at one time.

use shm_schema::exchange::Motion;

use super::{AxisTrace, Course, Polyline, Step, Walker};

/// What an axis is and does at one time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instant {
    /// What channel A's encoder sees.
    pub motion_a: Motion,
    /// What channel B's encoder sees.
    pub motion_b: Motion,
    /// Torque, millionths of the rated torque.
    pub torque_ppm: i32,
    /// The step columns.
    pub step: Step,
}

/// Rows between two cycles that are kept: more than the sixteen samples of a line can show.
const BETWEEN_MAX: usize = 16;

/// Rows of the step columns since the time before, each with its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Between {
    rows: [(i64, Step); BETWEEN_MAX],
    count: usize,
}

impl Between {
    fn new() -> Self {
        Self { rows: [(0, Step::default()); BETWEEN_MAX], count: 0 }
    }

    /// The rows in order of time; of too many, the last take the place of each other.
    pub fn rows(&self) -> &[(i64, Step)] {
        &self.rows[..self.count]
    }

    fn push(&mut self, row: (i64, Step)) {
        let place = self.count.min(BETWEEN_MAX - 1);
        self.rows[place] = row;
        self.count = place + 1;
    }
}

/// Walks through the columns of one axis, forward only, without allocating.
#[derive(Debug)]
pub struct Cursor<'a> {
    course: CourseWalker<'a>,
    second_speed: Option<Walker<'a>>,
    second_offset: Option<Walker<'a>>,
    torque: Option<Walker<'a>>,
    acceleration: Option<Walker<'a>>,
    steps: &'a [(i64, Step)],
    step: Step,
    between: Between,
}

#[derive(Debug)]
enum CourseWalker<'a> {
    Speed(Walker<'a>),
    Position(Walker<'a>),
}

impl CourseWalker<'_> {
    /// Position in increments and speed in 1/1000 rpm.
    fn at(&mut self, at_ns: i64) -> (i64, i32) {
        match self {
            Self::Speed(line) => speed_at(line, at_ns),
            Self::Position(line) => {
                line.advance(at_ns);
                (line.value(at_ns, 1), line.slope_mrpm())
            }
        }
    }
}

fn speed_at(line: &mut Walker<'_>, at_ns: i64) -> (i64, i32) {
    line.advance(at_ns);
    (line.integral(at_ns, 1), narrow(line.value(at_ns, 1_000)))
}

fn narrow(value: i64) -> i32 {
    value.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

impl<'a> Cursor<'a> {
    /// Starts at time 0: the first row has stood for ever.
    pub fn new(trace: &'a AxisTrace) -> Self {
        let mut course = match &trace.course {
            Course::Speed(line) => CourseWalker::Speed(Walker::new(line, 0)),
            Course::Position(line) => CourseWalker::Position(Walker::new(line, 0)),
        };
        // Two encoders of one shaft start at the same position.
        let (start, _) = course.at(0);
        let walk = |line: &'a Option<Polyline>, offset| line.as_ref().map(|line| Walker::new(line, offset));
        Self {
            course,
            second_speed: walk(&trace.second_speed, start),
            second_offset: walk(&trace.second_offset, 0),
            torque: walk(&trace.torque, 0),
            acceleration: walk(&trace.acceleration, 0),
            steps: &trace.steps,
            step: trace.steps.first().map_or_else(Step::default, |(_, step)| *step),
            between: Between::new(),
        }
    }

    /// The columns at `at_ns`, which never goes back.
    pub fn at(&mut self, at_ns: i64) -> Instant {
        let (position, speed_mrpm) = self.course.at(at_ns);
        let acceleration = value(&mut self.acceleration, at_ns, 1_000);
        let motion_a = Motion { position, speed_mrpm, acceleration_mrpm_s: acceleration };
        let (position, speed_mrpm) = match &mut self.second_speed {
            Some(line) => speed_at(line, at_ns),
            None => (position, speed_mrpm),
        };
        let position = position.saturating_add(value(&mut self.second_offset, at_ns, 1).unwrap_or(0));
        let motion_b = Motion { position, speed_mrpm, acceleration_mrpm_s: acceleration };
        let torque_ppm = narrow(value(&mut self.torque, at_ns, 10_000).unwrap_or(0));
        Instant { motion_a, motion_b, torque_ppm, step: self.step_at(at_ns) }
    }

    /// Positions of both encoders at the time of the last [`Self::at`], in 1/`parts` increments.
    pub fn fine(&self, at_ns: i64, parts: i64) -> [i64; 2] {
        let first = match &self.course {
            CourseWalker::Speed(line) => line.integral(at_ns, parts),
            CourseWalker::Position(line) => line.value(at_ns, parts.into()),
        };
        let second = self.second_speed.as_ref().map_or(first, |line| line.integral(at_ns, parts));
        let offset = self.second_offset.as_ref().map_or(0, |line| line.value(at_ns, parts.into()));
        [first, second.saturating_add(offset)]
    }

    /// Rows of the step columns that came since the call of [`Self::at`] before the last.
    pub const fn between(&self) -> &Between {
        &self.between
    }

    fn step_at(&mut self, at_ns: i64) -> Step {
        self.between.count = 0;
        while let Some(((from_ns, step), later)) = self.steps.split_first() {
            if *from_ns > at_ns {
                break;
            }
            self.step = *step;
            self.between.push((*from_ns, *step));
            self.steps = later;
        }
        self.step
    }
}

fn value(line: &mut Option<Walker<'_>>, at_ns: i64, factor: i128) -> Option<i64> {
    let line = line.as_mut()?;
    line.advance(at_ns);
    Some(line.value(at_ns, factor))
}
