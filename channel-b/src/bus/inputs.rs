//! What the answer carries: both channels combined to the safe side (DEC-25), bit for bit as
//! the other channel does it.

use shm_schema::profile::Profile;
use shm_schema::report::Report;
use shm_schema::word::Word;

/// Most safe data octets of one direction: 32 of status, or 12 of AMK.
const OCTETS: usize = 32;
/// Reports of each channel kept until their exchange is complete.
const KEPT: usize = 4;

/// Lengths and layout of a profile's safe data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Telegram {
    profile: Profile,
    outputs: u8,
    inputs: u8,
    /// Status bits combined by OR: errors, movements, requests to the operator.
    either: Word,
    /// Largest difference of the positions (Prm2).
    position: i64,
}

impl Telegram {
    /// The telegram of `profile` with words of so many octets; `either` are the status bits
    /// combined by OR.
    pub fn new(profile: Profile, words: (u8, u8), either: Word, position: i64) -> Self {
        let (outputs, inputs) = match profile {
            // AMK-FSOE-03: status, position and speed, 32 bits each.
            Profile::AmkKw => (4, 12),
            Profile::Atv340 => (2, 2),
            // DEC-41: up to 32 octets; FSoE frames carry an even number.
            Profile::Etg61002 => (words.0.clamp(4, 32), words.1.clamp(4, 32)),
            Profile::LenzeSm301 | Profile::None => (4, 4),
        };
        let even = |octets: u8| octets.saturating_add(octets & 1);
        Self { profile, outputs: even(outputs), inputs: even(inputs), either, position }
    }

    /// Safe data octets from the master.
    pub const fn outputs(&self) -> usize {
        self.outputs as usize
    }

    /// Safe data octets to the master.
    pub const fn inputs(&self) -> usize {
        self.inputs as usize
    }

    /// The safe data to send, low octet first.
    pub fn compose(&self, seen: &Seen) -> [u8; OCTETS] {
        let mut octets = [0; OCTETS];
        let status = self.combine(&seen.own.status, &seen.partner.status);
        let words = status.0.iter().flat_map(|word| word.to_le_bytes());
        octets.iter_mut().zip(words).for_each(|(to, from)| *to = from);
        if self.profile == Profile::AmkKw {
            let position = (seen.partner.position as i32).to_le_bytes();
            let values = position.into_iter().chain(further(seen).to_le_bytes());
            octets.iter_mut().skip(4).zip(values).for_each(|(to, from)| *to = from);
        }
        octets
    }

    fn combine(&self, one: &Word, other: &Word) -> Word {
        let mut parts = [0; 8];
        let bits = one.0.iter().zip(other.0).zip(self.either.0);
        for (part, ((one, other), either)) in parts.iter_mut().zip(bits) {
            *part = (one & other) | ((one | other) & either);
        }
        Word(parts)
    }

    /// DEC-25: a position is sent only while the channels agree about it.
    pub fn is_sendable(&self, seen: &Seen) -> bool {
        let distance = seen.own.position.saturating_sub(seen.partner.position).saturating_abs();
        distance <= self.position
    }
}

/// The speed further from zero, A's when they are equally far (DEC-25).
const fn further(seen: &Seen) -> i32 {
    let (a, b) = (seen.partner.speed_mrpm, seen.own.speed_mrpm);
    if b.unsigned_abs() > a.unsigned_abs() { b } else { a }
}

/// What of a report leaves the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Shown {
    exchange: u64,
    status: Word,
    position: i64,
    speed_mrpm: i32,
}

impl Shown {
    /// Of `report`.
    pub const fn of(report: &Report) -> Self {
        Self {
            exchange: report.exchange,
            status: report.status,
            position: report.position,
            speed_mrpm: report.speed_mrpm,
        }
    }
}

/// Both channels in one exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    own: Shown,
    partner: Shown,
}

/// The last reports of both channels.
#[derive(Debug, Clone, Copy)]
pub struct History {
    own: [Option<Shown>; KEPT],
    partner: [Option<Shown>; KEPT],
    place: usize,
}

impl History {
    /// Nothing reported yet.
    pub const fn new() -> Self {
        Self { own: [None; KEPT], partner: [None; KEPT], place: 0 }
    }

    /// A new cycle with the partner's report as read in it.
    pub fn note_partner(&mut self, report: Option<&Report>) {
        self.place = self.place.wrapping_add(1) % KEPT;
        if let Some(place) = self.partner.get_mut(self.place) {
            *place = report.map(Shown::of);
        }
    }

    /// The own report of this cycle.
    pub fn note_own(&mut self, report: &Report) {
        if let Some(place) = self.own.get_mut(self.place) {
            *place = Some(Shown::of(report));
        }
    }

    /// Both reports of `exchange`, each channel's last where a sample stood for longer; `None`
    /// when one is missing.
    pub fn of(&self, exchange: u64) -> Option<Seen> {
        let find = |kept: &[Option<Shown>; KEPT]| {
            let newest_first = (0..KEPT).map(|back| self.place.wrapping_sub(back) % KEPT);
            let mut shown = newest_first.filter_map(|place| kept.get(place).copied().flatten());
            shown.find(|shown| shown.exchange == exchange)
        };
        Some(Seen { own: find(&self.own)?, partner: find(&self.partner)? })
    }
}

impl Default for History {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(exchange: u64, status: u32, position: i64, speed_mrpm: i32) -> Report {
        Report { exchange, status: Word::from_u32(status), position, speed_mrpm, ..Report::default() }
    }

    fn seen(partner: &Report, own: &Report) -> Seen {
        let mut history = History::new();
        history.note_partner(Some(partner));
        history.note_own(own);
        history.of(partner.exchange).expect("both")
    }

    /// DEC-25, AMK-FSOE-03: active by AND, error by OR, position of A, speed further from zero.
    #[test]
    fn an_amk_answer_carries_status_position_and_speed_low_octet_first() {
        let telegram = Telegram::new(Profile::AmkKw, (4, 4), Word::from_u32(1 << 7), 50);
        let pair = seen(&shown(3, 0x1000_0101, -2, 1_000), &shown(3, 0x1000_0181, 7, -1_001));
        let octets = telegram.compose(&pair);
        let speed = (-1_001_i32).to_le_bytes();
        assert_eq!(octets[..8], [0x81, 1, 0, 0x10, 0xFE, 0xFF, 0xFF, 0xFF]);
        assert_eq!(octets[8..12], speed);
        assert!(telegram.is_sendable(&pair));
        assert!(!telegram.is_sendable(&seen(&shown(3, 0, 0, 0), &shown(3, 0, 51, 0))));
    }

    #[test]
    fn lengths_are_those_of_the_profile_and_even() {
        let lengths = |profile, words| {
            let telegram = Telegram::new(profile, words, Word::ZERO, 0);
            (telegram.outputs(), telegram.inputs())
        };
        assert_eq!(lengths(Profile::AmkKw, (4, 4)), (4, 12));
        assert_eq!(lengths(Profile::LenzeSm301, (4, 4)), (4, 4));
        assert_eq!(lengths(Profile::Atv340, (4, 4)), (2, 2));
        assert_eq!(lengths(Profile::Etg61002, (5, 32)), (6, 32));
    }

    /// Architecture: the reports of the exchange before, or none.
    #[test]
    fn an_exchange_that_one_channel_skipped_is_not_sent() {
        let mut history = History::new();
        for exchange in 1..=4 {
            history.note_partner((exchange != 3).then_some(&shown(exchange, 0, 0, 0)));
            history.note_own(&shown(exchange, 0, 0, 0));
        }
        assert_eq!([1, 2, 3, 4, 5].map(|k| history.of(k).is_some()), [true, true, false, true, false]);
    }
}
