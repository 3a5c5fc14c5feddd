//! Acknowledge terminals.

/// Pulse of an acknowledge terminal (LNZ-ACK-01, LNZ-ACK-03, LNZ-ACK-05).
#[derive(Debug, Clone, Default)]
pub struct Pulse {
    /// Level of the cycle before.
    pub level: bool,
    high_since: Option<i64>,
}

impl Pulse {
    /// The falling edge of a pulse of 0.3 to 10 s.
    pub fn is_given(&mut self, level: bool, now: i64) -> bool {
        let rises = level && !self.level;
        let falls = !level && self.level;
        self.level = level;
        if rises {
            self.high_since = Some(now);
        }
        let length = self.high_since.map(|since| now - since);
        if falls {
            self.high_since = None;
        }
        falls && length.is_some_and(|length| (300..=10_000).contains(&length))
    }
}
