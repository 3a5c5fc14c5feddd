//! A test master: as simple as the text, with numbers and chain of its own.

use super::std::vec;
use super::std::vec::Vec;

use super::super::check::Link;
use super::super::frame::{DataSize, Frame, compose, first_block};
use super::super::{Config, Slave};
use super::{Answer, receive};

/// Where in the hand-shake a slave stands. "Part" means that the payload of the
/// state is not complete yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    Reset,
    SessionPart,
    Session,
    ConnectionPart,
    Connection,
    ParameterPart,
    Parameter,
    Data,
}

impl Place {
    pub const ALL: [Self; 8] = [
        Self::Reset,
        Self::SessionPart,
        Self::Session,
        Self::ConnectionPart,
        Self::Connection,
        Self::ParameterPart,
        Self::Parameter,
        Self::Data,
    ];
}

#[derive(Clone)]
#[allow(clippy::struct_field_names, reason = "the numbers have the names of the text")]
pub struct Master {
    outputs: usize,
    inputs: usize,
    pub connection_id: u16,
    pub address: u16,
    pub communication_length: u16,
    pub watchdog_ms: u16,
    pub application: Vec<u8>,
    pub application_length: u16,
    master_number: u16,
    pub slave_number: u16,
    last_check_sent: u16,
    pub last_check_received: u16,
    pub frames_sent: usize,
}

impl Master {
    pub fn new(config: &Config<'_>) -> Self {
        Self {
            outputs: config.outputs,
            inputs: config.inputs,
            connection_id: 0x1234,
            address: config.address,
            communication_length: 2,
            watchdog_ms: 100,
            application: config.application_parameters.to_vec(),
            application_length: config.application_parameters.len() as u16,
            master_number: 0,
            slave_number: 0,
            last_check_sent: 0,
            last_check_received: 0,
            frames_sent: 0,
        }
    }

    fn chunk(&self) -> usize {
        self.outputs.min(self.inputs)
    }

    pub(in crate::black_channel::fsoe) fn frame(&self, command: u8, link: Link, data: &[u8]) -> Vec<u8> {
        let size = DataSize::new(self.outputs).expect("valid size");
        let mut answer = Answer::empty();
        let data = data.iter().copied();
        let first_check = link.first_check(command, first_block(size, data.clone()));
        compose(&mut answer, (size, command), (link, first_check), data);
        answer.octets().to_vec()
    }

    /// The Reset frame, after which both sides begin anew.
    pub fn reset(&mut self, code: u8) -> Vec<u8> {
        self.master_number = 0;
        self.slave_number = 0;
        self.last_check_sent = 0;
        self.last_check_received = 0;
        self.frames_sent += 1;
        self.frame(0x2A, Link::ORIGIN, &[code])
    }

    fn link(&self, command: u8) -> Link {
        let connection_id = if command == 0x4E { 0 } else { self.connection_id };
        let number = match self.master_number {
            u16::MAX => 1,
            number => number + 1,
        };
        Link { inherited: self.last_check_received, connection_id, number }
    }

    /// The next frame of the chain, without stepping on after a collision.
    pub fn without_collision_rule(&self, command: u8, data: &[u8]) -> Vec<u8> {
        self.frame(command, self.link(command), data)
    }

    /// The next frame of the chain.
    pub fn next(&mut self, command: u8, data: &[u8]) -> Vec<u8> {
        let mut link = self.link(command);
        let mut frame = self.frame(command, link, data);
        let is_first = self.master_number == 0;
        if first_check(&frame, self.outputs) == self.last_check_sent && !is_first {
            link.number = if link.number == u16::MAX { 1 } else { link.number + 1 };
            frame = self.frame(command, link, data);
        }
        self.master_number = link.number;
        self.last_check_sent = first_check(&frame, self.outputs);
        self.frames_sent += 1;
        frame
    }

    /// Checks an answer that is no Reset and goes on in the chain.
    pub fn accept(&mut self, answer: &[u8]) {
        let size = DataSize::new(self.inputs).expect("valid size");
        let frame = Frame::parse(answer, size).expect("length of an answer");
        for _ in 0..2 {
            self.slave_number = if self.slave_number == u16::MAX { 1 } else { self.slave_number + 1 };
            let link = Link {
                inherited: self.last_check_sent,
                connection_id: frame.connection_id,
                number: self.slave_number,
            };
            let check = first_check(answer, self.inputs);
            if frame.is_checked_by(link, link.first_check(frame.command, frame.first().0)) {
                assert_ne!(check, self.last_check_received, "collision rule");
                self.last_check_received = check;
                return;
            }
        }
        panic!("answer outside the chain: {answer:02X?}");
    }

    /// Data octets whose CRC_0 would be that of the previous frame.
    pub fn colliding_data(&self, command: u8) -> Vec<u8> {
        let link = self.link(command);
        let collides = |data: &u16| {
            first_check(&self.frame(command, link, &data.to_le_bytes()), self.outputs) == self.last_check_sent
        };
        let data = (0..=u16::MAX).find(collides).expect("one of all values collides");
        data.to_le_bytes().to_vec()
    }

    fn parameters(&self) -> Vec<u8> {
        let header = [self.communication_length, self.watchdog_ms, self.application_length];
        let mut octets: Vec<u8> = header.iter().flat_map(|word| word.to_le_bytes()).collect();
        octets.extend(&self.application);
        octets
    }

    /// Command and payload of the hand-shake frames, in order.
    pub fn handshake(&self) -> Vec<(u8, Vec<u8>)> {
        let mut connection = self.connection_id.to_le_bytes().to_vec();
        connection.extend(self.address.to_le_bytes());
        let payloads = [(0x4E, vec![0x22, 0x11]), (0x64, connection), (0x52, self.parameters())];
        let mut frames = Vec::new();
        for (command, payload) in payloads {
            frames.extend(payload.chunks(self.chunk()).map(|piece| (command, piece.to_vec())));
        }
        frames
    }

    /// Frames of the hand-shake that lead to `place`.
    fn frames_to(&self, place: Place) -> usize {
        let pieces = |octets: usize| octets.div_ceil(self.chunk());
        let (session, connection) = (pieces(2), pieces(4));
        let parameter = pieces(6 + self.application.len());
        match place {
            Place::Reset => 0,
            Place::SessionPart => 1,
            Place::Session => session,
            Place::ConnectionPart => session + 1,
            Place::Connection => session + connection,
            Place::ParameterPart => session + connection + 1,
            Place::Parameter | Place::Data => session + connection + parameter,
        }
    }

    /// Resets the slave and leads it to `place`.
    pub fn bring(&mut self, slave: &mut Slave, place: Place) {
        let answer = receive(slave, &self.reset(0), 0, None);
        assert_eq!(answer[..2], [0x2A, 0]);
        let count = self.frames_to(place);
        for (command, piece) in self.handshake().into_iter().take(count) {
            let answer = receive(slave, &self.next(command, &piece), 0, None);
            assert_eq!(answer[0], command, "hand-shake to {place:?}");
            self.accept(&answer);
            if command != 0x4E {
                assert!(answer[1..].starts_with(&piece[..1]), "echo");
            }
        }
        if place == Place::Data {
            let answer = receive(slave, &self.next(0x36, &[0x55]), 0, None);
            assert_eq!(answer[0], 0x08);
            self.accept(&answer);
        }
    }
}

fn first_check(frame: &[u8], octets: usize) -> u16 {
    let place = if octets == 1 { 2 } else { 3 };
    u16::from_le_bytes([frame[place], frame[place + 1]])
}
