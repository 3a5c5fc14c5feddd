//! Acknowledgement at a terminal: the falling edge of a pulse of 0.3 to 10 s (LNZ-ACK-01,
//! LNZ-ACK-05, DEC-15).

const SHORTEST_NS: u64 = 300_000_000;
const LONGEST_NS: u64 = 10_000_000_000;

/// One terminal.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pulse {
    was_low: bool,
    since_ns: Option<u64>,
}

impl Pulse {
    /// One instant; `None` is an unreadable terminal. `true` on a valid falling edge.
    pub fn step(&mut self, level: Option<bool>, now_ns: u64) -> bool {
        match level {
            None => {
                *self = Self::default();
                false
            }
            Some(true) => {
                if self.was_low {
                    self.since_ns = Some(now_ns);
                }
                self.was_low = false;
                false
            }
            Some(false) => {
                self.was_low = true;
                let held = self.since_ns.take().map(|since| now_ns.saturating_sub(since));
                held.is_some_and(|held| (SHORTEST_NS..=LONGEST_NS).contains(&held))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_pulses_of_their_length_acknowledge_and_only_at_their_end() {
        for (length_ms, valid) in [(299, false), (300, true), (10_000, true), (10_001, false)] {
            let mut pulse = Pulse::default();
            assert!(!pulse.step(Some(false), 0));
            assert!(!pulse.step(Some(true), 1_000_000));
            assert_eq!(pulse.step(Some(false), (1 + length_ms) * 1_000_000), valid, "{length_ms}");
        }
    }

    #[test]
    fn a_terminal_that_was_always_high_is_no_pulse() {
        // DEC-16
        let mut pulse = Pulse::default();
        pulse.step(Some(true), 0);
        assert!(!pulse.step(Some(false), 1_000_000_000));
    }
}
