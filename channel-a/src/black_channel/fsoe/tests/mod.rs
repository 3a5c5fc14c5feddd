//! Tests of the FSoE slave against a plain test master with a check sum of its
//! own (bit by bit, black-channel.md 2.4).

extern crate std;

mod handshake;
mod matrix;
mod robustness;
mod vectors;

use super::wire::command;
use super::{FsoeConfig, FsoeSlave, State};
use std::vec;
use std::vec::Vec;

const MS: u64 = 1_000_000;
const ADDRESS: u16 = 0x0305;
const CONN_ID: u16 = 0x1234;
const WATCHDOG_MS: u16 = 100;

/// Polynomial division bit by bit, zeros appended.
fn plain_sum(octets: &[u8]) -> u16 {
    let mut register = 0_u32;
    for octet in octets.iter().chain(&[0; 3]) {
        register ^= u32::from(*octet) << 8;
        for _ in 0..8 {
            register <<= 1;
            if register & 0x1_0000 != 0 {
                register ^= 0x1_39B7;
            }
        }
    }
    register as u16
}

fn frame_length(data: usize) -> usize {
    if data == 1 { 6 } else { 2 * data + 3 }
}

fn build(inherited: u16, conn_id: u16, number: u16, command: u8, data: &[u8]) -> Vec<u8> {
    let mut frame = vec![command];
    for (index, block) in data.chunks(2).enumerate() {
        let mut input = Vec::new();
        input.extend(inherited.to_le_bytes());
        input.extend(conn_id.to_le_bytes());
        input.extend(number.to_le_bytes());
        input.push(command);
        if index > 0 {
            input.extend((index as u16).to_le_bytes());
        }
        input.extend(block);
        frame.extend(block);
        frame.extend(plain_sum(&input).to_le_bytes());
    }
    frame.extend(conn_id.to_le_bytes());
    frame
}

fn crc_0(frame: &[u8]) -> u16 {
    let place = if frame.len() == 6 { 2 } else { 3 };
    u16::from_le_bytes([frame[place], frame[place + 1]])
}

fn data_of(frame: &[u8]) -> Vec<u8> {
    if frame.len() == 6 {
        return vec![frame[1]];
    }
    let blocks = frame[1..frame.len() - 2].chunks(4);
    blocks.flat_map(|block| block[..2].to_vec()).collect()
}

fn reset_frame(length: usize, code: u8) -> Vec<u8> {
    let mut data = vec![0; length];
    data[0] = code;
    build(0, 0, 1, command::RESET, &data)
}

const fn next(number: u16) -> u16 {
    if number == u16::MAX { 1 } else { number + 1 }
}

/// The master's side of the chain.
pub(crate) struct Master {
    inherited: u16,
    send: (u16, u16),
    receive: (u16, u16),
}

impl Master {
    pub(crate) const fn new() -> Self {
        Self { inherited: 0, send: (1, 0), receive: (1, 0) }
    }

    pub(crate) fn chained(&mut self, conn_id: u16, command: u8, data: &[u8]) -> Vec<u8> {
        let first = self.inherited == 0;
        let mut number = self.send.0;
        let mut frame = build(self.inherited, conn_id, number, command, data);
        while !first && crc_0(&frame) == self.send.1 {
            number = next(number);
            frame = build(self.inherited, conn_id, number, command, data);
        }
        self.send = (next(number), crc_0(&frame));
        self.inherited = crc_0(&frame);
        frame
    }

    /// Data and connection id of `frame` under the number and the check sums the chain asks for.
    fn expected(&self, frame: &[u8]) -> (u16, Vec<u8>) {
        let conn_id = u16::from_le_bytes([frame[frame.len() - 2], frame[frame.len() - 1]]);
        let data = data_of(frame);
        let mut number = self.receive.0;
        let mut expected = build(self.inherited, conn_id, number, frame[0], &data);
        while crc_0(&expected) == self.receive.1 {
            number = next(number);
            expected = build(self.inherited, conn_id, number, frame[0], &data);
        }
        (number, expected)
    }

    /// The whole frame of which channel A's part is `part`.
    pub(crate) fn seal(&self, part: &[u8]) -> Vec<u8> {
        self.expected(part).1
    }

    /// Panics unless the frame continues the chain; returns its data.
    pub(crate) fn receive(&mut self, frame: &[u8]) -> Vec<u8> {
        let (number, expected) = self.expected(frame);
        assert_eq!(frame, expected);
        self.receive = (next(number), crc_0(frame));
        self.inherited = crc_0(frame);
        data_of(frame)
    }
}

/// A slave and its master.
struct Bench {
    slave: FsoeSlave,
    master: Master,
    out: usize,
    inputs: Option<Vec<u8>>,
    now_ns: u64,
    parameters: Vec<u8>,
    conn_data: Vec<u8>,
}

impl Bench {
    fn new(out: u8, input: u8, application: &[u8]) -> Self {
        let slave = FsoeSlave::new(&FsoeConfig {
            output_length: out,
            input_length: input,
            address: ADDRESS,
            session_id: 0x0102,
            application_parameters: application,
            watchdog_ms: (1, u16::MAX),
        })
        .unwrap();
        let mut parameters = vec![2, 0];
        parameters.extend(WATCHDOG_MS.to_le_bytes());
        parameters.extend((application.len() as u16).to_le_bytes());
        parameters.extend(application);
        let mut conn_data = CONN_ID.to_le_bytes().to_vec();
        conn_data.extend(ADDRESS.to_le_bytes());
        Self {
            slave,
            master: Master::new(),
            out: usize::from(out),
            inputs: None,
            now_ns: 0,
            parameters,
            conn_data,
        }
    }

    fn raw(&mut self, frame: &[u8]) -> Option<Vec<u8>> {
        self.slave
            .frame(frame, self.inputs.as_deref(), self.now_ns)
            .unwrap()
            .map(|answer| answer.octets().to_vec())
    }

    /// Sends a frame that continues the chain; returns the answer unjudged.
    fn chained(&mut self, conn_id: u16, command: u8, data: &[u8]) -> Vec<u8> {
        let mut padded = data.to_vec();
        padded.resize(self.out, 0);
        let frame = self.master.chained(conn_id, command, &padded);
        self.raw(&frame).unwrap()
    }

    /// The same, and the answer has to continue the chain with `command`.
    fn exchange(&mut self, conn_id: u16, command: u8, data: &[u8]) -> Vec<u8> {
        let answer = self.chained(conn_id, command, data);
        assert_eq!(answer[0], command, "{answer:02X?}");
        self.master.receive(&answer)
    }

    /// The same with whatever command the slave chooses.
    fn exchange_any(&mut self, conn_id: u16, command: u8, data: &[u8]) -> (u8, Vec<u8>) {
        let answer = self.chained(conn_id, command, data);
        let data = self.master.receive(&answer);
        (answer[0], data)
    }

    fn chunk(&self) -> usize {
        self.out.min(usize::from(self.input_octets()))
    }

    fn input_octets(&self) -> u8 {
        self.slave.input_length.octets() as u8
    }

    fn chunks(&self, payload: &[u8]) -> Vec<Vec<u8>> {
        payload.chunks(self.chunk()).map(<[u8]>::to_vec).collect()
    }

    /// Sends the payload of a state; the echo has to be the same.
    fn send_payload(&mut self, command: u8, payload: &[u8]) {
        for part in self.chunks(payload) {
            let mut expected = part.clone();
            expected.resize(usize::from(self.input_octets()), 0);
            assert_eq!(self.exchange(CONN_ID, command, &part), expected);
        }
    }

    fn session(&mut self, id: u16) -> u16 {
        self.master = Master::new();
        let mut answer = Vec::new();
        for part in self.chunks(&id.to_le_bytes()) {
            let data = self.exchange(0, command::SESSION, &part);
            answer.extend(&data[..data.len().min(self.chunk()).min(2)]);
        }
        u16::from_le_bytes([answer[0], answer[1]])
    }

    fn connection(&mut self) {
        let payload = self.conn_data.clone();
        self.send_payload(command::CONNECTION, &payload);
    }

    fn parameter(&mut self) {
        let payload = self.parameters.clone();
        self.send_payload(command::PARAMETER, &payload);
    }

    fn reach(&mut self, state: State) {
        if state == State::Reset {
            return;
        }
        self.session(0xBEEF);
        if state == State::Session {
            return;
        }
        self.connection();
        if state == State::Connection {
            return;
        }
        self.parameter();
        if state == State::Parameter {
            return;
        }
        self.exchange_any(CONN_ID, command::FAIL_SAFE_DATA, &[]);
        assert_eq!(self.slave.state(), State::Data);
    }

    fn expect_reset(&self, answer: &[u8], code: u8) {
        let expected = reset_frame(usize::from(self.input_octets()), code);
        assert_eq!(answer, expected, "expected code {code}");
        assert_eq!(self.slave.state(), State::Reset);
        assert!(self.slave.outputs().iter().all(|octet| *octet == 0));
        assert!(!self.slave.outputs_valid());
    }
}
