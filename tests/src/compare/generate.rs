//! Random but meaningful: speeds near the limits, requests, ramps that hug their line,
//! acknowledgements at right and wrong moments, lines of a pair that switch apart.

use shm_schema::profile::Profile;

use super::hints::{Hints, Request, hints};
use super::random::Random;
use super::scenario::{Lines, Row, Scenario};

/// The scenario of a seed.
pub fn scenario(profile: Profile, seed: u64) -> Scenario {
    let mut random = Random::new(seed ^ (profile as u64) << 56);
    let (parameters, hints) = hints(profile, &mut random);
    let mut plan = Plan::new(profile, &hints, &mut random);
    for _ in 0..plan.random.between(4, 16) {
        plan.event();
    }
    let last = plan.now + plan.random.between(1, 700);
    let rows = plan.rows;
    let origin = if hints.origins.is_empty() { 0 } else { random.pick(&hints.origins) };
    Scenario { profile, parameters, rows, last, origin }
}

struct Plan<'a> {
    hints: &'a Hints,
    random: &'a mut Random,
    now: i64,
    speed: i64,
    control: u64,
    lines: Lines,
    rows: Vec<Row>,
}

impl<'a> Plan<'a> {
    fn new(profile: Profile, hints: &'a Hints, random: &'a mut Random) -> Self {
        let lines = hints.inverted.map(|inverted| (true, !inverted));
        let control = u64::from(profile.neutral_word()) | hints.neutral_above;
        let mut plan = Self { hints, random, now: 0, speed: 0, control, lines, rows: Vec::new() };
        plan.speed = if plan.random.chance(40) { 0 } else { plan.near_a_limit() };
        // A request that has always stood (design 10, start).
        if plan.random.chance(10) {
            let request = plan.random.pick(&plan.hints.requests);
            plan.control = request.set(plan.control, true);
        }
        let first = Row {
            speed_mrpm: Some(plan.speed),
            control: Some(plan.control),
            lines: Some(plan.lines),
            torque_percent: Some(0),
            acceleration_rpm_s: plan.hints.accelerations.first().map(|_| 0),
            ..Row::default()
        };
        plan.rows.push(first);
        plan
    }

    /// The row at `now`, new or the one that is there.
    fn row(&mut self) -> &mut Row {
        if self.rows.last().is_none_or(|row| row.at != self.now) {
            self.rows.push(Row { at: self.now, ..Row::default() });
        }
        self.rows.last_mut().expect("just pushed")
    }

    fn wait(&mut self, longest: i64) {
        // The motion until here is a corner, so that later corners do not bend it.
        self.now += self.random.between(1, longest);
        let speed = self.speed;
        self.row().speed_mrpm = Some(speed);
    }

    fn near_a_limit(&mut self) -> i64 {
        let limit = self.random.pick(&self.hints.limits);
        let offset = self.random.pick(&[-1000, -1, 0, 0, 1, 1000]);
        limit + offset
    }

    fn event(&mut self) {
        self.wait(200);
        match self.random.between(0, 99) {
            0..=36 => self.request(),
            37..=41 => self.release_all(),
            42..=49 => self.recover(),
            50..=64 => self.acknowledge(),
            65..=79 => self.move_to_a_limit(),
            80..=84 if !self.hints.has_terminals => self.move_to_a_limit(),
            80..=84 if self.hints.has_terminals => self.press_terminal(),
            85..=94 if self.hints.uses_lines => self.switch_lines(),
            85..=89 if !self.hints.accelerations.is_empty() => self.accelerate(),
            90..=94 if !self.hints.torques.is_empty() => self.push(),
            _ => self.crawl(),
        }
    }

    fn command(&mut self, control: u64) {
        self.control = control;
        self.row().control = Some(control);
    }

    fn request(&mut self) {
        let request = self.random.pick(&self.hints.requests);
        let stands = request.stands(self.control);
        self.command(request.set(self.control, !stands));
        if !stands && self.random.chance(70) {
            self.follow(&request);
        }
    }

    /// A motion along the monitored line, a touch steeper, flatter or later than it.
    fn follow(&mut self, request: &Request) {
        let Some(approach) = request.approach else { return };
        let late = self.random.pick(&[-3, -1, 0, 0, 0, 1, 2]);
        let hold = (approach.delay + late).max(0);
        if hold > 0 {
            self.now += hold;
            let speed = self.speed;
            self.row().speed_mrpm = Some(speed);
        }
        let beyond = self.random.pick(&[-1000, -1, 0, 0, 1]);
        let target = if self.speed < 0 { -approach.target - beyond } else { approach.target + beyond };
        let share = self.random.pick(&[95, 99, 100, 100, 100, 101, 120]);
        let way = (self.speed - target).abs();
        let time = way * approach.slope.1 * 100 / (approach.slope.0 * share).max(1);
        self.now += time.clamp(1, 4000);
        self.speed = target;
        self.row().speed_mrpm = Some(target);
    }

    fn release_all(&mut self) {
        let requests = &self.hints.requests;
        let released = requests.iter().fold(self.control, |word, request| request.set(word, false));
        self.command(released);
    }

    /// What an operator does: withdraw everything, stand still, acknowledge in order.
    fn recover(&mut self) {
        self.release_all();
        self.now += self.random.between(1, 200);
        self.speed = 0;
        self.row().speed_mrpm = Some(0);
        self.wait(150);
        for bit in self.hints.acknowledge_bits.clone() {
            self.command(self.control & !(1_u64 << bit));
            self.wait(5);
            self.command(self.control | 1_u64 << bit);
            self.wait(5);
            self.command(self.control & !(1_u64 << bit));
        }
    }

    fn acknowledge(&mut self) {
        let bits = &self.hints.acknowledge_bits;
        if self.hints.has_clear_error && self.random.chance(20) {
            self.row().clear_error = Some(true);
            self.wait(20);
            self.row().clear_error = Some(false);
            return;
        }
        let mask = 1_u64 << self.random.pick(bits);
        self.command(self.control | mask);
        self.wait(20);
        if self.random.chance(90) {
            self.command(self.control & !mask);
        }
    }

    /// A pulse of an acknowledge terminal, near the ends of its range (LNZ-ACK-01).
    fn press_terminal(&mut self) {
        let length = self.random.pick(&[299, 300, 301, 400]);
        let is_error = self.random.chance(50);
        for level in [true, false] {
            let row = self.row();
            if is_error {
                row.aie = Some(level);
            } else {
                row.ais = Some(level);
            }
            if level {
                self.now += length;
                let speed = self.speed;
                self.row().speed_mrpm = Some(speed);
            }
        }
    }

    fn move_to_a_limit(&mut self) {
        let target = self.near_a_limit();
        self.now += self.random.between(1, 300);
        self.speed = target;
        self.row().speed_mrpm = Some(target);
    }

    fn crawl(&mut self) {
        self.now += self.random.between(1, 50);
        self.speed = self.random.between(-30_000, 30_000);
        let speed = self.speed;
        self.row().speed_mrpm = Some(speed);
    }

    fn switch_lines(&mut self) {
        let pair = self.random.between(0, 3) as usize;
        let level = !self.lines[pair].0;
        let skew = self.random.pick(&[0, 0, 0, 1, 3, 9, 10, 11, 12, 20, 119, 120, 121]);
        let second_leads = self.random.chance(50);
        for is_second in [second_leads, !second_leads] {
            self.set_line(pair, is_second, level != (is_second && self.hints.inverted[pair]));
            self.now += if is_second == second_leads { skew } else { 0 };
        }
    }

    fn set_line(&mut self, pair: usize, is_second: bool, level: bool) {
        let lines = &mut self.lines[pair];
        if is_second {
            lines.1 = level;
        } else {
            lines.0 = level;
        }
        let lines = self.lines;
        self.row().lines = Some(lines);
    }

    fn accelerate(&mut self) {
        let value = self.random.pick(&self.hints.accelerations) + self.random.pick(&[-1, 0, 1]);
        self.row().acceleration_rpm_s = Some(value);
    }

    fn push(&mut self) {
        let value = self.random.pick(&self.hints.torques) + self.random.pick(&[-1, 0, 1]);
        self.row().torque_percent = Some(value);
    }
}
