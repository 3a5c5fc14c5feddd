//! SLS of the ATV340: six types, told apart by what happens at activation above the
//! threshold and below standstill (ATV-SLST1 to ATV-SLST6). Frequencies are electrical
//! speeds: 1/1000 rpm times pole pairs.

/// The levels of SLS.
#[derive(Debug, Clone, Copy, Default)]
pub struct Levels {
    /// SC39.
    pub kind: i64,
    /// SC46; 0: none.
    pub standstill: i64,
    /// SC48.
    pub threshold: i64,
    /// SC50.
    pub set_point: i64,
    /// SC43.
    pub offset: i64,
    /// SC40, which SC41 equals, per second.
    pub slope: i64,
    /// SC54, ns; 0: none.
    pub wait_ns: u64,
}

/// What SLS has to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Kept.
    Kept,
    /// STO without error.
    Standstill,
    /// SS1 is executed (types 3 and 6).
    Stop,
    /// SME0AB.
    Threshold,
    /// SME0A9.
    Ramp,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum State {
    #[default]
    Idle,
    /// From this magnitude at this time, in this direction.
    Ramp(i64, u64, i64),
    /// Below standstill since.
    Waiting(u64),
    /// Constant limits, in this direction.
    Limits(i64),
    /// Has led to a stop.
    Done,
}

/// SLS at work.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sls {
    /// Its levels.
    pub levels: Levels,
    state: State,
    cap: i64,
}

impl Sls {
    /// Not requested yet.
    pub const fn new(levels: Levels) -> Self {
        Self { levels, state: State::Idle, cap: 0 }
    }

    /// Not requested, or STO.
    pub fn rest(&mut self) {
        self.state = State::Idle;
    }

    /// Requested and monitored.
    pub fn engaged(&self) -> bool {
        !matches!(self.state, State::Idle | State::Done)
    }

    /// The direction may not change: types 1 to 3.
    const fn one_way(&self) -> bool {
        self.levels.kind <= 3
    }

    /// Lower and upper limit of the set point while SLS is engaged.
    pub fn set_point(&self) -> Option<(i64, i64)> {
        let top = if self.levels.kind == 1 { self.cap } else { self.levels.set_point };
        let both = (top.saturating_neg(), top);
        match self.state {
            State::Idle | State::Done => None,
            State::Limits(sign) | State::Ramp(_, _, sign) if self.one_way() => {
                Some(if sign < 0 { (both.0, 0) } else { (0, both.1) })
            }
            _ => Some(both),
        }
    }

    /// One instant under request.
    pub fn step(&mut self, frequency: i64, now_ns: u64) -> Verdict {
        if self.state == State::Idle {
            self.cap = frequency.saturating_abs();
            return self.activate(frequency, now_ns);
        }
        self.go_on(frequency, now_ns)
    }

    fn end(&mut self, verdict: Verdict) -> Verdict {
        self.state = State::Done;
        verdict
    }

    fn activate(&mut self, frequency: i64, now_ns: u64) -> Verdict {
        let levels = self.levels;
        let magnitude = frequency.saturating_abs();
        let sign = if frequency < 0 { -1 } else { 1 };
        let slow = self.one_way() & (magnitude < levels.standstill);
        let fast = magnitude > levels.threshold;
        match (levels.kind, fast, slow) {
            (1 | 4, true, _) => self.end(Verdict::Threshold),
            (3 | 6, true, _) => self.end(Verdict::Stop),
            (2 | 5, true, _) => {
                self.state = State::Ramp(magnitude, now_ns, sign);
                Verdict::Kept
            }
            (1, _, true) => self.end(Verdict::Standstill),
            (_, _, true) if levels.wait_ns == 0 => self.end(Verdict::Standstill),
            (_, _, true) => {
                self.state = State::Waiting(now_ns);
                Verdict::Kept
            }
            (1..=6, false, false) => {
                self.state = State::Limits(sign);
                Verdict::Kept
            }
            // A type that does not exist permits nothing.
            _ => self.end(Verdict::Standstill),
        }
    }

    fn go_on(&mut self, frequency: i64, now_ns: u64) -> Verdict {
        let levels = self.levels;
        let magnitude = frequency.saturating_abs();
        match self.state {
            State::Idle | State::Done => Verdict::Kept,
            State::Ramp(from, since, sign) => {
                let fallen = i128::from(levels.slope).wrapping_mul(i128::from(now_ns.saturating_sub(since)));
                let top = i128::from(from.saturating_add(levels.offset)).wrapping_mul(1_000_000_000);
                let line = top.wrapping_sub(fallen);
                if magnitude <= levels.threshold {
                    self.state = State::Limits(sign);
                    return self.go_on(frequency, now_ns);
                }
                let above = i128::from(magnitude).wrapping_mul(1_000_000_000) > line;
                if above { self.end(Verdict::Ramp) } else { Verdict::Kept }
            }
            State::Waiting(since) => {
                if magnitude >= levels.standstill {
                    self.state = State::Limits(if frequency < 0 { -1 } else { 1 });
                    return self.go_on(frequency, now_ns);
                }
                let over = now_ns.saturating_sub(since) >= levels.wait_ns;
                if over { self.end(Verdict::Standstill) } else { Verdict::Kept }
            }
            State::Limits(sign) => {
                if magnitude > levels.threshold {
                    return self.end(Verdict::Threshold);
                }
                let forward = if sign < 0 { frequency.saturating_neg() } else { frequency };
                let slow = forward < levels.standstill;
                let watched = self.one_way() & (levels.standstill > 0);
                if watched & slow { self.end(Verdict::Standstill) } else { Verdict::Kept }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn sls(kind: i64) -> Sls {
        let levels = Levels {
            kind,
            standstill: 50,
            threshold: 300,
            set_point: 200,
            offset: 20,
            slope: 100,
            wait_ns: 40 * MS,
        };
        Sls::new(levels)
    }

    fn run(kind: i64, path: &[(u64, i64)]) -> std::vec::Vec<Verdict> {
        let mut sls = sls(kind);
        path.iter().map(|(at_ms, frequency)| sls.step(*frequency, at_ms * MS)).collect()
    }

    #[test]
    fn above_the_threshold_each_type_does_its_own() {
        // ATV-SLST1-02, ATV-SLST2-01, ATV-SLST3-01, ATV-SLST4-02, ATV-SLST5-01, ATV-SLST6-01
        use Verdict::{Kept, Stop, Threshold};
        let found = [1, 2, 3, 4, 5, 6].map(|kind| run(kind, &[(0, 301)])[0]);
        assert_eq!(found, [Threshold, Kept, Stop, Threshold, Kept, Stop]);
    }

    #[test]
    fn below_standstill_types_2_and_3_wait_and_type_1_does_not() {
        // ATV-SLST1-04, ATV-SLST2-06
        use Verdict::{Kept, Standstill};
        assert_eq!(run(1, &[(0, 49)]), [Standstill]);
        assert_eq!(run(2, &[(0, 0), (39, 49), (40, 49)]), [Kept, Kept, Standstill]);
        assert_eq!(run(3, &[(0, 0), (39, 50), (60, 49)]), [Kept, Kept, Standstill]);
        assert_eq!(run(4, &[(0, 0), (90, -300), (91, -301)]), [Kept, Kept, Verdict::Threshold]);
    }

    #[test]
    fn the_ramp_starts_at_once_with_its_offset_and_ends_at_the_threshold() {
        // ATV-SLST2-01, ATV-SLST2-02
        use Verdict::{Kept, Ramp, Threshold};
        assert_eq!(run(2, &[(0, 400), (0, 420), (500, 370), (501, 370)]), [Kept, Kept, Kept, Ramp]);
        assert_eq!(run(5, &[(0, 400), (100, 300), (101, 301)]), [Kept, Kept, Threshold]);
    }

    #[test]
    fn types_1_to_3_keep_their_direction() {
        // ATV-SLS-03
        assert_eq!(
            run(2, &[(0, -250), (1, -50), (2, 60)]),
            [Verdict::Kept, Verdict::Kept, Verdict::Standstill]
        );
    }
}
