//! The four safe inputs: filter, delay, contact function test, discrepancy (LNZ-IN).

use super::parameters::Parameters;

/// LNZ-IN-11: disturbance and test pulses within this time are not seen, ms.
const FILTER: i64 = 2;

/// A level that counts once it has stood for a time.
#[derive(Debug, Clone)]
struct Steady {
    level: bool,
    since: i64,
    counts: bool,
}

impl Steady {
    fn new(level: bool) -> Self {
        Self { level, since: i64::MIN / 2, counts: level }
    }

    fn step(&mut self, level: bool, now: i64, time: i64) -> bool {
        if level != self.level {
            (self.level, self.since) = (level, now);
        }
        if now - self.since >= time {
            self.counts = level;
        }
        self.counts
    }
}

/// A running contact function test: both channels have to show `wanted`.
#[derive(Debug, Clone, Copy)]
struct Test {
    wanted: bool,
    since: i64,
    seen: (bool, bool),
}

/// One input.
#[derive(Debug, Clone)]
pub struct Input {
    lines: [(Steady, Steady); 2],
    /// What the contact function test says, whether or not an error hides it.
    on: bool,
    test: Option<Test>,
    failed: Option<Test>,
}

impl Input {
    /// An input whose lines have stood for ever.
    pub fn settled(levels: (bool, bool)) -> Self {
        let line = |level| (Steady::new(level), Steady::new(level));
        let on = levels.0 && levels.1;
        Self { lines: [line(levels.0), line(levels.1)], on, test: None, failed: None }
    }

    /// The internal valuation: ON. LNZ-IN-04: a faulty input is OFF until it is acknowledged.
    pub fn is_on(&self) -> bool {
        self.on && self.failed.is_none()
    }

    /// Whether messages 49 to 52 stand.
    pub fn has_failed(&self) -> bool {
        self.failed.is_some()
    }

    /// LNZ-IN-15, LNZ-IN-17: only after the level that was missing was seen at both channels.
    pub fn acknowledge(&mut self) {
        if self.failed.is_some_and(|test| test.is_passed()) {
            self.failed = None;
        }
    }

    /// One cycle of input `number`, 1 to 4.
    pub fn step(&mut self, parameters: &Parameters, number: u32, levels: (bool, bool), now: i64) {
        let delay = parameters.sub(15_034, number);
        let [first, second] = &mut self.lines;
        let filtered = |line: &mut (Steady, Steady), level| {
            let level = line.0.step(level, now, FILTER);
            line.1.step(level, now, delay)
        };
        let levels = (filtered(first, levels.0), filtered(second, levels.1));
        if let Some(failed) = self.failed.as_mut().filter(|failed| !failed.is_passed()) {
            failed.see(levels);
            if !failed.is_passed() {
                return;
            }
            self.on = failed.wanted;
        }
        // Under an error too: a late rise is a discrepancy of its own (LNZ-IN-16, LNZ-IN-18).
        self.judge(levels, now, parameters.sub(15_033, number));
    }

    /// LNZ-EX-34, row by row.
    fn judge(&mut self, levels: (bool, bool), now: i64, discrepancy: i64) {
        let both_high = levels == (true, true);
        let begin = |wanted| Some(Test { wanted, since: now, seen: (false, false) });
        if self.test.is_none() && self.on && !both_high {
            self.on = false;
            self.test = begin(false);
        } else if self.test.is_none() && !self.on && (levels.0 || levels.1) {
            self.test = begin(true);
        }
        let Some(test) = &mut self.test else { return };
        test.see(levels);
        if test.is_passed() {
            self.on = test.wanted;
            self.test = None;
        } else if test.wanted && levels == (false, false) {
            self.test = None;
        } else if now - test.since > discrepancy {
            // LNZ-IN-09: the longest time without error reaction.
            self.failed = self.test.take();
        }
    }
}

impl Test {
    /// HIGH has to be seen at both at once, LOW at each.
    fn see(&mut self, levels: (bool, bool)) {
        if self.is_passed() {
            return;
        }
        let both_high = levels == (true, true);
        if self.wanted {
            self.seen = (both_high, both_high);
        } else {
            self.seen = (self.seen.0 || !levels.0, self.seen.1 || !levels.1);
        }
    }

    fn is_passed(&self) -> bool {
        self.seen == (true, true)
    }
}
