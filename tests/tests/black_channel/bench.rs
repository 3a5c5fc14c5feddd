//! One bus cycle after the other between a master and a device, in virtual time.

use sim::master::{
    disturbance::{Kind, Line},
    fsoe, profisafe,
};

use crate::device::{Device, Shape, Source};

pub const MS: u64 = 1_000_000;

/// What a bench needs of a master of either protocol.
pub trait Master {
    fn to_send(&self) -> Vec<u8>;
    fn receive(&mut self, image: &[u8], now_ns: u64);
    fn advance(&mut self, now_ns: u64);
    fn set_outputs(&mut self, outputs: &[u8]);
    fn inputs(&self) -> Option<Vec<u8>>;
    /// What an operator does between two cycles.
    fn operate(&mut self);
    /// Process data in the frame on the bus.
    fn process_data(&self) -> Option<Vec<u8>>;
}

impl Master for fsoe::Master {
    fn to_send(&self) -> Vec<u8> {
        self.to_send().to_vec()
    }
    fn receive(&mut self, image: &[u8], now_ns: u64) {
        self.receive(image, now_ns);
    }
    fn advance(&mut self, now_ns: u64) {
        self.advance(now_ns);
    }
    fn set_outputs(&mut self, outputs: &[u8]) {
        self.set_outputs(Some(outputs));
    }
    fn inputs(&self) -> Option<Vec<u8>> {
        self.inputs().map(<[u8]>::to_vec)
    }
    fn operate(&mut self) {}
    fn process_data(&self) -> Option<Vec<u8>> {
        let frame = fsoe::frame::Frame::parse(self.to_send(), self.config().outputs)?;
        (frame.command == fsoe::command::PROCESS_DATA).then_some(frame.data)
    }
}

impl Master for profisafe::Host {
    fn to_send(&self) -> Vec<u8> {
        self.to_send().to_vec()
    }
    fn receive(&mut self, image: &[u8], now_ns: u64) {
        self.receive(image, now_ns);
    }
    fn advance(&mut self, now_ns: u64) {
        self.advance(now_ns);
    }
    fn set_outputs(&mut self, outputs: &[u8]) {
        self.set_outputs(outputs);
    }
    fn inputs(&self) -> Option<Vec<u8>> {
        self.inputs().map(<[u8]>::to_vec)
    }
    /// Acknowledges whenever asked, by an edge.
    fn operate(&mut self) {
        let wanted = self.wants_acknowledge();
        self.set_acknowledge(wanted);
    }
    fn process_data(&self) -> Option<Vec<u8>> {
        let length = self.to_send().len() - profisafe::telegram::TRAILER;
        let passive = self.control() & profisafe::control::ACTIVATE_FV != 0;
        (!passive).then(|| self.to_send()[..length].to_vec())
    }
}

/// FSoE with these lengths, and the device for it.
pub fn fsoe_pair(outputs: usize, inputs: usize) -> (fsoe::Master, Shape) {
    let config = fsoe::Config::new(outputs, inputs, 3);
    let shape = Shape::of_fsoe(&config);
    (fsoe::Master::new(config), shape)
}

/// PROFIsafe with these lengths, and the device for it.
pub fn profisafe_pair(outputs: usize, inputs: usize) -> (profisafe::Host, Shape) {
    let parameters = profisafe::Parameters::new(7, 100);
    let config = profisafe::Config { outputs, inputs, parameters };
    (profisafe::Host::new(config), Shape::of_profisafe(&config))
}

/// A master and a device on two lines, and the oracle of what may be accepted.
pub struct Bench<M> {
    pub master: M,
    pub device: Device,
    to_device: Line,
    to_master: Line,
    answer: Vec<u8>,
    now_ns: u64,
    count: u64,
    lengths: (usize, usize),
    /// The last process data that went onto the bus, in each direction.
    last_sent: Option<Vec<u8>>,
    last_answered: Option<Vec<u8>>,
    /// Cycles in which the device, and the master, had process data.
    pub accepted: (u64, u64),
}

impl<M: Master> Bench<M> {
    pub fn new(master: M, shape: &Shape, source: Source, kinds: &[Kind], seed: u64) -> Self {
        let lengths = match shape {
            Shape::Fsoe { outputs, inputs, .. } | Shape::Profisafe { outputs, inputs, .. } => {
                (usize::from(*outputs), usize::from(*inputs))
            }
        };
        Self {
            master,
            device: Device::new(shape, source),
            to_device: Line::new(seed, kinds, 40, 150),
            to_master: Line::new(seed ^ 0x5A5A, kinds, 40, 150),
            answer: Vec::new(),
            now_ns: 0,
            count: 0,
            lengths,
            last_sent: None,
            last_answered: None,
            accepted: (0, 0),
        }
    }

    pub fn set_calm(&mut self, calm: bool) {
        self.to_device.set_calm(calm);
        self.to_master.set_calm(calm);
    }

    pub fn disturbed(&self) -> u64 {
        self.to_device.disturbed() + self.to_master.disturbed()
    }

    pub const fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// The device's last answer.
    pub fn answer(&self) -> &[u8] {
        &self.answer
    }

    /// One millisecond of bus; `foreign` is what another connection shows both ends.
    pub fn cycle(&mut self, foreign: (&[u8], &[u8])) {
        self.now_ns += MS;
        self.count += 1;
        self.master.operate();
        self.master.set_outputs(&marked(self.count, self.lengths.0));
        let inputs = marked(!self.count, self.lengths.1);
        if let Some(late) = self.device.advance(self.now_ns) {
            self.answer = late;
        }
        self.last_sent = self.master.process_data().or(self.last_sent.take());
        for image in self.to_device.carry(&self.master.to_send(), foreign.0) {
            if let Some(answer) = self.device.receive(&image, Some(&inputs), self.now_ns) {
                self.last_answered = Some(inputs.clone());
                self.answer = answer;
            }
            self.judge_device();
        }
        if self.answer.is_empty() {
            return self.master.advance(self.now_ns);
        }
        for image in self.to_master.carry(&self.answer, foreign.1) {
            self.master.receive(&image, self.now_ns);
            self.judge_master();
        }
        self.master.advance(self.now_ns);
    }

    /// Outputs are what the master sent last, or zeros; never anything else.
    fn judge_device(&mut self) {
        let outputs = self.device.outputs();
        if let Some(outputs) = &outputs {
            assert_eq!(Some(outputs), self.last_sent.as_ref(), "wrong output in cycle {}", self.count);
            self.accepted.0 += 1;
        } else {
            let zeros = vec![0; self.lengths.0];
            let (a, b) = self.device.raw_outputs();
            assert!(a == zeros || b == zeros, "invalid outputs that are not zero in cycle {}", self.count);
        }
    }

    fn judge_master(&mut self) {
        if let Some(inputs) = self.master.inputs() {
            assert_eq!(Some(inputs), self.last_answered, "wrong input in cycle {}", self.count);
            self.accepted.1 += 1;
        }
    }
}

/// Data that differs from cycle to cycle and is never all zeros.
fn marked(count: u64, length: usize) -> Vec<u8> {
    let octets = count.wrapping_mul(0x9E37_79B9_7F4A_7C15).to_le_bytes();
    (0..length)
        .map(|at| octets[at % 8] ^ at as u8)
        .map(|octet| if octet == 0 { 0x5A } else { octet })
        .collect()
}
