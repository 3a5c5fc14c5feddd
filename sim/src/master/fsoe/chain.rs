//! Numbers and inherited check sums: what ties each frame to the one before (2.5).

use super::frame::{FRESH, Frame, Implicit};

/// The chain as the master sees it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chain {
    /// Number of the next frame to the slave.
    to_slave: u16,
    /// Number of the next frame from the slave.
    to_master: u16,
    /// CRC_0 of the slave's last frame: the master's next one inherits it.
    received: u16,
    /// CRC_0 of the master's last frame: the slave's answer inherits it.
    sent: u16,
}

/// 65535 is followed by 1: 0 is never used.
const fn following(number: u16) -> u16 {
    match number {
        u16::MAX => 1,
        _ => number + 1,
    }
}

impl Default for Chain {
    fn default() -> Self {
        Self { to_slave: 1, to_master: 1, received: 0, sent: 0 }
    }
}

impl Chain {
    /// The first Session frame: nothing inherited, and no collision rule.
    pub fn open(&mut self, data: &[u8]) -> Frame {
        *self = Self::default();
        let frame = Frame::build(super::command::SESSION, data, 0, FRESH);
        self.to_slave = following(self.to_slave);
        self.sent = frame.first_check_sum();
        frame
    }

    /// The master's next frame; its number is stepped past a CRC_0 like the one before.
    pub fn seal(&mut self, command: u8, data: &[u8], connection_id: u16) -> Frame {
        let (number, frame) = differing(self.to_slave, self.sent, |number| {
            Frame::build(command, data, connection_id, Implicit { inherited: self.received, number })
        });
        self.to_slave = following(number);
        self.sent = frame.first_check_sum();
        frame
    }

    /// Whether `frame` is the slave's next one; if so, the chain goes on.
    pub fn accept(&mut self, frame: &Frame) -> bool {
        let (number, expected) = differing(self.to_master, self.received, |number| {
            let implicit = Implicit { inherited: self.sent, number };
            Frame::build(frame.command, &frame.data, frame.connection_id, implicit)
        });
        let right = expected == *frame;
        if right {
            self.to_master = following(number);
            self.received = frame.first_check_sum();
        }
        right
    }

    /// Numbers of the next frame to the slave and from it.
    pub const fn numbers(&self) -> (u16, u16) {
        (self.to_slave, self.to_master)
    }

    /// CRC_0 of the last frame from the slave and to it.
    pub const fn check_sums(&self) -> (u16, u16) {
        (self.received, self.sent)
    }
}

/// Collision rule: the number is advanced until the CRC_0 is not `last` again.
fn differing(mut number: u16, last: u16, build: impl Fn(u16) -> Frame) -> (u16, Frame) {
    loop {
        let frame = build(number);
        if frame.first_check_sum() != last {
            return (number, frame);
        }
        number = following(number);
    }
}
