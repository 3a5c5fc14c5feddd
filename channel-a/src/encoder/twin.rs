//! The drive's own movement beside the safe one. It is not safe, but it uncovers an evaluation
//! that has failed: a difference of the speeds over two seconds (LNZ-SPD-06), and a movement
//! the other way round (ATV-ENC-09).
//!
//! A speed that is averaged over two seconds is the way of two seconds: what is compared is
//! where both have come since the oldest of sixteen marks, without any division.

/// Marks of the window, and their distance, ns: two seconds.
const MARKS: usize = 16;
const DISTANCE_NS: u64 = 125_000_000;
/// Increments of two seconds at 1 rpm.
const WAY: i64 = 2 * 65_536 / 60;
/// Movement against each other that is no reversal seen too late: a quarter of a revolution
/// (DEC-46).
const OPPOSITE: i64 = 65_536 / 4;
/// 1/1000 rpm times ns in one increment.
const MRPM_NS: i64 = 915_527_344;

/// What contradicts the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contradiction {
    /// The speeds differ by more than permitted.
    Speed,
    /// The two move in opposite directions.
    Direction,
}

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compared {
    /// The speeds may differ by so many whole rpm.
    Speed(i64),
    /// The directions are the same.
    Direction,
}

#[derive(Debug, Clone, Copy, Default)]
struct Mark {
    own: i64,
    drive: i64,
}

/// Both movements of one axis.
#[derive(Debug, Clone)]
pub struct Twin {
    compared: Compared,
    marks: [Mark; MARKS],
    oldest: usize,
    /// When the next mark is set, ns; `None`: nothing seen yet.
    next_ns: Option<u64>,
    /// Position by the speed alone, what is left of the next increment, and when it was reached, ns.
    reached: (i64, i64, u64),
}

impl Twin {
    /// Nothing seen yet.
    pub fn new(compared: Compared) -> Self {
        Self { compared, marks: [Mark::default(); MARKS], oldest: 0, next_ns: None, reached: (0, 0, 0) }
    }

    /// The same for an axis whose own position is not known, only its speed, 1/1000 rpm.
    pub fn step_by_speed(&mut self, speed: i64, drive: i64, time_ns: u64) -> Option<Contradiction> {
        let (position, rest, before_ns) = self.reached;
        let elapsed_ns = if self.next_ns.is_some() { time_ns.saturating_sub(before_ns) } else { 0 };
        let way = speed.saturating_mul(elapsed_ns.min(DISTANCE_NS) as i64).saturating_add(rest);
        self.reached = (position.wrapping_add(way / MRPM_NS), way % MRPM_NS, time_ns);
        self.step(self.reached.0, drive, time_ns)
    }

    /// Both positions of one sample, increments.
    pub fn step(&mut self, own: i64, drive: i64, time_ns: u64) -> Option<Contradiction> {
        let now = Mark { own, drive };
        match self.next_ns {
            None => self.begin(now, time_ns),
            Some(next_ns) if time_ns >= next_ns => self.mark(now, time_ns),
            Some(_) => {}
        }
        let then = self.marks.get(self.oldest).copied().unwrap_or(now);
        let (own, drive) = (own.wrapping_sub(then.own), drive.wrapping_sub(then.drive));
        match self.compared {
            // Whole rpm: one more than permitted is too much.
            Compared::Speed(rpm) => {
                let most = rpm.saturating_add(1).saturating_mul(WAY);
                (own.wrapping_sub(drive).saturating_abs() >= most).then_some(Contradiction::Speed)
            }
            Compared::Direction => {
                let up_and_down = (own > OPPOSITE) & (drive < -OPPOSITE);
                let down_and_up = (own < -OPPOSITE) & (drive > OPPOSITE);
                (up_and_down | down_and_up).then_some(Contradiction::Direction)
            }
        }
    }

    fn begin(&mut self, now: Mark, time_ns: u64) {
        self.marks = [now; MARKS];
        self.next_ns = Some(time_ns.saturating_add(DISTANCE_NS));
    }

    fn mark(&mut self, now: Mark, time_ns: u64) {
        if let Some(mark) = self.marks.get_mut(self.oldest) {
            *mark = now;
        }
        self.oldest = self.oldest.wrapping_add(1) % MARKS;
        self.next_ns = Some(time_ns.saturating_add(DISTANCE_NS));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// First ms up to 6 s in which something contradicts; both move so many increments each ms.
    fn first(compared: Compared, own: i64, drive: i64) -> Option<(i64, Contradiction)> {
        let mut twin = Twin::new(compared);
        (0..6_000).find_map(|k| Some((k, twin.step(k * own, k * drive, k as u64 * MS)?)))
    }

    #[test]
    fn a_lasting_difference_of_speeds_is_found_within_two_seconds() {
        // LNZ-SPD-06: 22 increments each ms are 20.1 rpm
        let speed = Compared::Speed(20);
        assert_eq!(first(speed, 1_000, 1_000), None);
        assert_eq!(first(speed, 1_000, 978), None, "20 rpm in whole rpm");
        assert_eq!(first(speed, 1_000, 950), Some((918, Contradiction::Speed)));
        assert_eq!(first(speed, 0, -24), Some((1_911, Contradiction::Speed)));
    }

    #[test]
    fn a_difference_that_does_not_last_is_none() {
        // LNZ-SPD-06: the filter of 2 s
        let mut twin = Twin::new(Compared::Speed(20));
        for k in 0..10_000_i64 {
            let apart = if k % 4_000 < 200 { 100 * (k % 4_000) } else { 20_000 };
            assert_eq!(twin.step(k * 500 + apart, k * 500, k as u64 * MS), None, "{k}");
        }
    }

    #[test]
    fn a_movement_the_other_way_round_is_found() {
        // ATV-ENC-09
        assert_eq!(first(Compared::Direction, 100, -100), Some((164, Contradiction::Direction)));
        assert_eq!(first(Compared::Direction, -100, 100), Some((164, Contradiction::Direction)));
        assert_eq!(first(Compared::Direction, -100, -5), None);
        let mut twin = Twin::new(Compared::Direction);
        let by_speed = |k: u64| twin.step_by_speed(91_553, k as i64 * -100, k * MS);
        assert_eq!((0..6_000).find_map(by_speed), Some(Contradiction::Direction));
    }

    #[test]
    fn a_slow_speed_adds_up_to_its_way() {
        // ATV-ENC-09: 0.5 rpm are half an increment each ms
        let mut twin = Twin::new(Compared::Direction);
        (0..=120_000).for_each(|k| {
            twin.step_by_speed(500, 0, k * MS);
        });
        assert_eq!(twin.reached.0, 65_535);
    }
}
