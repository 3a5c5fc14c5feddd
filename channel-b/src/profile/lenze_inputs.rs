//! Lenze SM301: input pairs with discrepancy time, terminals that acknowledge with a pulse.

/// A valid acknowledge pulse (LNZ-ACK-01), ns.
const PULSE: (u64, u64) = (300_000_000, 10_000_000_000);

/// One input pair (LNZ-IN-14 to 18).
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// The input is not deactivated (C15030).
    pub is_used: bool,
    /// C15031.
    pub function: i64,
    /// C15032.
    pub assignment: i64,
    /// C15033, ns.
    pub discrepancy_ns: u64,
    /// Level both lines had last.
    pub agreed: bool,
    /// Since when only one line has changed, ns.
    pub differs_since: Option<u64>,
    /// Its error stands.
    pub is_faulty: bool,
}

/// A terminal that acknowledges with the end of a pulse.
#[derive(Debug, Clone, Copy, Default)]
pub struct Terminal {
    /// When it went high; `None` while low or when it was high from the beginning.
    since: Option<u64>,
    level: bool,
}

impl Terminal {
    /// Whether a pulse of the right length ends in this cycle.
    pub fn edge(&mut self, level: bool, is_first: bool, now: u64) -> bool {
        let falls = self.level & !level;
        let rises = level & !self.level & !is_first;
        self.level = level;
        let length = self.since.map(|since| now.saturating_sub(since));
        if rises {
            self.since = Some(now);
        } else if !level {
            self.since = None;
        }
        falls && length.is_some_and(|length| (PULSE.0..=PULSE.1).contains(&length))
    }
}

impl Pair {
    /// Whether the discrepancy time is over; equal to it is still permitted (LNZ-IN-09).
    pub fn judge(&mut self, (own, other): (bool, bool), is_first: bool, now: u64) -> bool {
        let both = own == other;
        if both & (is_first | (own != self.agreed)) {
            self.agreed = own;
            self.differs_since = None;
            return false;
        }
        if is_first {
            self.agreed = false;
        }
        if both & self.differs_since.is_none() {
            return false;
        }
        // LNZ-IN-18: once one line has changed, both must be seen changed.
        let since = *self.differs_since.get_or_insert(now);
        now.saturating_sub(since) > self.discrepancy_ns
    }
}
