//! Two-channel contacts with a discrepancy time (LNZ-IN-14 to LNZ-IN-18). Both lines reach both
//! channels (DEC-36): the first LOW of either is OFF at once.

use crate::inputs::{Line, Newest};

/// Both lines of a pair.
#[derive(Debug, Clone, Copy, Default)]
pub struct Contact {
    own: Line,
    other: Line,
    limit_ns: u64,
    state: State,
    /// A discrepancy was not acknowledged since: the valuation stays OFF, while the lines are
    /// watched as ever.
    latched: bool,
    /// Neither line nor time can change anything but by another level.
    rests: bool,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum State {
    /// Both low.
    #[default]
    Off,
    /// One became high.
    Rising(u64),
    /// Both high.
    On,
    /// One became low: OFF from then on. Which lines have been low since.
    Falling(u64, bool, bool),
    /// Too late; whether it began from ON. Over when both lines show the level that the
    /// acknowledgement waits for (LNZ-IN-15, LNZ-IN-17).
    Faulty(bool),
}

impl Contact {
    /// Filter in samples of 62.5 µs, discrepancy time in ns.
    pub fn new(filter: u64, limit_ns: u64) -> Self {
        let line = Line::unglitched(filter);
        Self { own: line, other: line, limit_ns, ..Self::default() }
    }

    /// The lines have stood like this for ever.
    pub fn settle(&mut self, own: bool, other: bool) {
        self.own.settle(own);
        self.other.settle(other);
        self.state = if own & other { State::On } else { State::Off };
        self.rests = false;
    }

    /// The valuation: ON.
    pub const fn is_on(&self) -> bool {
        matches!(self.state, State::On) & !self.latched
    }

    /// A discrepancy was not acknowledged since: OFF, and no level of a sound input (LNZ-IN-04).
    pub const fn is_faulty(&self) -> bool {
        self.latched
    }

    /// Either line is high.
    pub const fn has_signal(&self) -> bool {
        self.own.level() | self.other.level()
    }

    /// New samples; `true` while a discrepancy error stands.
    pub fn take(&mut self, patterns: (u64, u64), newest: Newest, now_ns: u64) -> bool {
        let quiet = self.own.rests(patterns.0, newest) & self.other.rests(patterns.1, newest);
        if quiet & self.rests {
            return false;
        }
        self.own.take(patterns.0, newest);
        self.other.take(patterns.1, newest);
        let (own, other) = (self.own.level(), self.other.level());
        let late = |since: u64| now_ns.saturating_sub(since) > self.limit_ns;
        self.state = match self.state {
            State::Off | State::Rising(_) | State::Faulty(false) if own & other => State::On,
            State::Off if own | other => State::Rising(now_ns),
            State::Rising(since) if late(since) => State::Faulty(false),
            State::On | State::Faulty(true) if !(own | other) => State::Off,
            State::On if !(own & other) => State::Falling(now_ns, !own, !other),
            State::Falling(since, own_fell, other_fell) => {
                let (own_fell, other_fell) = (own_fell | !own, other_fell | !other);
                match own_fell & other_fell {
                    true => State::Off,
                    false if late(since) => State::Faulty(true),
                    false => State::Falling(since, own_fell, other_fell),
                }
            }
            state => state,
        };
        let faulty = matches!(self.state, State::Faulty(_));
        self.latched |= faulty;
        self.rests = matches!(self.state, State::On | State::Off);
        faulty
    }

    /// The error was acknowledged.
    pub fn acknowledge(&mut self) {
        self.latched &= matches!(self.state, State::Faulty(_));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn run(contact: &mut Contact, from_ms: u64, to_ms: u64, own: bool, other: bool) -> bool {
        let pattern = |high: bool| if high { u64::MAX } else { 0 };
        let mut faulty = false;
        for k in from_ms..=to_ms {
            faulty = contact.take((pattern(own), pattern(other)), Newest::new(16), k * MS);
        }
        faulty
    }

    fn settled(on: bool) -> Contact {
        let mut contact = Contact::new(4, 10 * MS);
        contact.settle(on, on);
        contact
    }

    #[test]
    fn one_low_line_is_off_at_once_and_tolerated_for_the_discrepancy_time() {
        // LNZ-IN-09, LNZ-IN-14, LNZ-EX-34
        for (own, other) in [(false, true), (true, false)] {
            let mut contact = settled(true);
            assert!(!run(&mut contact, 1, 1, own, other));
            assert!(!contact.is_on(), "with the first of either line");
            assert!(!run(&mut contact, 2, 11, own, other));
            assert!(run(&mut contact, 12, 12, own, other));
        }
    }

    #[test]
    fn an_error_from_on_is_acknowledged_after_both_lines_were_low() {
        // LNZ-IN-15
        let mut contact = settled(true);
        assert!(run(&mut contact, 1, 20, false, true));
        contact.acknowledge();
        assert!(run(&mut contact, 21, 30, true, true));
        assert!(!run(&mut contact, 31, 35, false, false));
        contact.acknowledge();
        run(&mut contact, 36, 40, true, true);
        assert!(contact.is_on());
    }

    #[test]
    fn a_rise_out_of_time_is_a_discrepancy_before_the_acknowledgement_too() {
        // LNZ-IN-16, LNZ-IN-18
        let mut contact = settled(true);
        assert!(run(&mut contact, 1, 20, false, true));
        assert!(!run(&mut contact, 21, 30, false, false));
        assert!(run(&mut contact, 31, 50, true, false));
        assert!(!run(&mut contact, 51, 52, true, true));
        assert!(!contact.is_on(), "not acknowledged");
        contact.acknowledge();
        assert!(contact.is_on());
    }

    #[test]
    fn a_line_that_falls_and_returns_does_not_switch_on_again() {
        // LNZ-IN-18
        let mut contact = settled(true);
        run(&mut contact, 1, 2, false, true);
        assert!(!run(&mut contact, 3, 5, true, true));
        assert!(!contact.is_on());
        assert!(run(&mut contact, 6, 12, true, true));
    }
}
