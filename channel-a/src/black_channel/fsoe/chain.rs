//! The chain of check sums and numbers that ties each frame to the one before
//! (black-channel.md 2.5).

use super::super::answer::Answer;
use super::wire::{Draft, Link, Received};

/// Number of the first frame of a chain.
const FIRST: u16 = 1;
/// Check sum inherited by the first frame of a chain.
const NOTHING: u16 = 0;
/// Connection id of Reset and Session frames.
pub(super) const NO_CONNECTION: u16 = 0;

/// 65535 is followed by 1; 0 is never used.
const fn following(number: u16) -> u16 {
    match number {
        u16::MAX => FIRST,
        _ => number.saturating_add(1),
    }
}

/// Number and last first check sum of one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Direction {
    number: u16,
    previous: u16,
}

impl Direction {
    const START: Self = Self { number: FIRST, previous: NOTHING };

    /// Collision rule: the next number whose check sum differs from the last
    /// one sent in this direction. The sum is a one-to-one function of the
    /// number (an odd polynomial, 16 bits each), so one step always suffices.
    fn choose(self, crc_0: impl Fn(u16) -> u16) -> (u16, u16) {
        let sum = crc_0(self.number);
        if sum != self.previous {
            return (self.number, sum);
        }
        let number = following(self.number);
        (number, crc_0(number))
    }

    fn used(&mut self, number: u16, crc_0: u16) {
        self.number = following(number);
        self.previous = crc_0;
    }
}

/// Both directions, and the check sum the next frame inherits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chain {
    inherited: u16,
    receive: Direction,
    send: Direction,
}

impl Chain {
    /// As after a Reset, on both sides.
    pub(super) const START: Self =
        Self { inherited: NOTHING, receive: Direction::START, send: Direction::START };

    /// Whether the frame begins a chain: a Reset, or the first of a Session.
    /// A connection id other than 0 cannot belong to one.
    pub(super) fn begins_with(received: &Received) -> bool {
        let linked =
            received.is_linked_by(Link { inherited: NOTHING, conn_id: NO_CONNECTION, number: FIRST });
        linked && received.conn_id() == NO_CONNECTION
    }

    /// The chain behind a first Session frame, without collision rule.
    pub(super) fn begun_by(received: &Received) -> Self {
        let mut chain = Self::START;
        let crc_0 = received.crc_0();
        chain.receive.used(FIRST, crc_0);
        chain.inherited = crc_0;
        chain
    }

    /// Takes the frame as the next of the chain if it is that; leaves the
    /// chain alone if not.
    pub(super) fn accept(&mut self, received: &Received) -> bool {
        let link = |number| Link { inherited: self.inherited, conn_id: received.conn_id(), number };
        let (number, crc_0) = self.receive.choose(|number| received.expected_crc_0(link(number)));
        if !received.is_linked_by(link(number)) {
            return false;
        }
        self.receive.used(number, crc_0);
        self.inherited = crc_0;
        true
    }

    /// Seals the next own frame of the chain.
    pub(super) fn send(&mut self, draft: &Draft, conn_id: u16) -> Answer {
        let link = |number| Link { inherited: self.inherited, conn_id, number };
        let (number, crc_0) = self.send.choose(|number| draft.crc_0(link(number)));
        let answer = draft.seal(link(number));
        self.send.used(number, crc_0);
        self.inherited = crc_0;
        answer
    }

    /// Seals a Reset frame, which stands outside every chain.
    pub(super) fn seal_reset(draft: &Draft) -> Answer {
        draft.seal(Link { inherited: NOTHING, conn_id: NO_CONNECTION, number: FIRST })
    }

    #[cfg(test)]
    pub(super) fn set_numbers(&mut self, receive: u16, send: u16) {
        self.receive.number = receive;
        self.send.number = send;
    }
}
