//! Which agreement counts (design 3.3).
//!
//! An agreement is accepted when it echoes the own report of at most two exchanges ago, as
//! published; one that echoes anything else is none. A cell that is unreadable for a cycle is
//! no information: what was accepted before counts until its echo is too old. So neither a
//! lying nor a repeating crosscheck can keep torque on.

use shm_schema::agreement::{Agreement, Echo, PathTest};
use shm_schema::exchange::{Published, Received, Sampled};

/// Own reports kept for the echo: the relaxed timing reaches back this far.
const KEPT: usize = 32;

/// The newest accepted agreement, and the own reports it may echo.
#[derive(Debug, Clone, Copy)]
pub struct Agreed {
    published: [Option<Published>; KEPT],
    place: usize,
    accepted: Option<Accepted>,
    has_error: bool,
}

#[derive(Debug, Clone, Copy)]
struct Accepted {
    exchange: u64,
    permit: bool,
    path_test: PathTest,
}

/// What the accepted agreement says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heard {
    /// There is one, young enough.
    pub is_agreed: bool,
    /// It permits torque as far as crosscheck is concerned.
    pub permits: bool,
    /// What it asks of the paths.
    pub path_test: PathTest,
}

impl Heard {
    /// No agreement counts.
    pub const NOTHING: Self = Self { is_agreed: false, permits: false, path_test: PathTest::None };
}

impl Agreed {
    /// Nothing published, nothing accepted.
    pub const fn new() -> Self {
        Self { published: [None; KEPT], place: 0, accepted: None, has_error: false }
    }

    /// Keeps the own report as the shell published it.
    pub fn note_published(&mut self, published: Option<Published>) {
        let newest = self.published.get(self.place).copied().flatten();
        let is_new = published.is_some() & (newest != published);
        if !is_new {
            return;
        }
        self.place = self.place.wrapping_add(1) % KEPT;
        if let Some(slot) = self.published.get_mut(self.place) {
            *slot = published;
        }
    }

    /// Takes what the cell says in this cycle; an unreadable cell says nothing.
    pub fn take(&mut self, received: &Received<Agreement>, boot_nonce: u32) {
        let Ok(Sampled { payload, .. }) = received else { return };
        self.has_error = payload.error;
        let accepted = Accepted {
            exchange: payload.echo_b.exchange,
            permit: payload.permit & !payload.error,
            path_test: payload.path_test,
        };
        self.accepted = self.is_own(&payload.echo_b, boot_nonce).then_some(accepted);
    }

    /// The agreement has not advanced: nothing it said counts any more.
    pub const fn forget(&mut self) {
        self.accepted = None;
        self.has_error = false;
    }

    fn is_own(&self, echo: &Echo, boot_nonce: u32) -> bool {
        let same = |own: &Published| (own.exchange, own.crc32) == (echo.exchange, echo.crc32);
        let newest = self.published.get(self.place).is_some_and(|newest| newest.as_ref().is_some_and(same));
        if newest {
            return echo.boot_nonce == boot_nonce;
        }
        // From the newest backwards.
        let (newer, older) = self.published.split_at(self.place.wrapping_add(1).min(KEPT));
        let is_known = newer.iter().rev().chain(older.iter().rev()).flatten().any(same);
        is_known & (echo.boot_nonce == boot_nonce)
    }

    /// What counts of it in `exchange`: only an agreement on a report of at most `age_max`
    /// exchanges before.
    pub fn heard(&self, exchange: u64, age_max: u64) -> Heard {
        let is_young = |accepted: &&Accepted| exchange.saturating_sub(accepted.exchange) <= age_max;
        let Some(accepted) = self.accepted.as_ref().filter(is_young) else { return Heard::NOTHING };
        Heard { is_agreed: true, permits: accepted.permit, path_test: accepted.path_test }
    }

    /// An error of crosscheck's own stands.
    pub const fn has_error(&self) -> bool {
        self.has_error
    }
}

impl Default for Agreed {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shm_schema::exchange::CellFault;

    const NONCE: u32 = 9;

    #[allow(clippy::unnecessary_wraps, reason = "the type the inputs have")]
    fn agreement(exchange: u64, permit: bool) -> Received<Agreement> {
        let echo_b = Echo { exchange, boot_nonce: NONCE, crc32: exchange as u32 };
        let payload = Agreement { permit, echo_b, ..Agreement::default() };
        Ok(Sampled { sequence: exchange, timestamp_ns: 0, crc32: 0, payload })
    }

    /// Reports 1 to `newest` published, the agreement on the one before the newest taken.
    fn agreed(newest: u64) -> Agreed {
        let mut agreed = Agreed::new();
        for exchange in 1..=newest {
            agreed.note_published(Some(Published { exchange, crc32: exchange as u32 }));
        }
        agreed.take(&agreement(newest - 1, true), NONCE);
        agreed
    }

    /// Design 3.3: at most two exchanges old.
    #[test]
    fn an_accepted_agreement_counts_until_its_echo_is_three_exchanges_old() {
        let agreed = agreed(40);
        assert_eq!([40, 41, 42].map(|exchange| agreed.heard(exchange, 2).permits), [true, true, false]);
    }

    /// Architecture: a cell's content is as old as its last valid update.
    #[test]
    fn an_unreadable_agreement_takes_nothing_back() {
        let mut agreed = agreed(40);
        agreed.take(&Err(CellFault::CheckSum), NONCE);
        assert!(agreed.heard(41, 2).permits);
        assert!(!agreed.heard(42, 2).permits);
    }

    #[test]
    fn an_agreement_that_echoes_anything_else_is_none() {
        let changes: [fn(&mut Echo); 3] =
            [|echo| echo.crc32 ^= 1, |echo| echo.boot_nonce ^= 1, |echo| echo.exchange = 41];
        for change in changes {
            let mut cell = agreement(40, true).expect("readable");
            change(&mut cell.payload.echo_b);
            let mut agreed = agreed(40);
            agreed.take(&Ok(cell), NONCE);
            assert!(!agreed.heard(40, 2).is_agreed);
        }
    }

    #[test]
    fn an_agreement_without_permit_or_with_an_error_permits_nothing() {
        for (permit, error) in [(false, false), (true, true)] {
            let mut cell = agreement(40, permit).expect("readable");
            cell.payload.error = error;
            let mut agreed = agreed(40);
            agreed.take(&Ok(cell), NONCE);
            assert!(agreed.heard(40, 2).is_agreed & !agreed.heard(40, 2).permits);
        }
    }

    #[test]
    fn only_reports_of_the_last_32_are_known() {
        let mut agreed = agreed(40);
        for (exchange, known) in [(9, true), (8, false)] {
            agreed.forget();
            agreed.take(&agreement(exchange, true), NONCE);
            assert_eq!(agreed.heard(exchange, 0).is_agreed, known, "{exchange}");
        }
    }
}
