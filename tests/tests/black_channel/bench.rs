//! One bus cycle after the other between a master and a device, in virtual time.

use sim::master::{
    Master,
    disturbance::{Kind, Line},
    fsoe, profisafe,
};

use crate::device::{Device, Shape, Source};

pub const MS: u64 = 1_000_000;

/// What the oracle needs of a master beside.
pub trait Observed: Master {
    /// Process data in the frame on the bus.
    fn process_data(&self) -> Option<Vec<u8>>;
    /// Process data in an answer of the device.
    fn process_data_of(&self, answer: &[u8]) -> Option<Vec<u8>>;
    /// How often numbering was started over without anything new that ties frames to it.
    fn restarts(&self) -> u64;
    /// Whether the device's answer to the last such restart is still awaited: what the bus
    /// carries from it is from before.
    fn restarting(&self) -> bool;
    /// The connection's watchdog in ms.
    fn watchdog_ms(&self) -> u64;
}

impl Observed for fsoe::Master {
    fn process_data(&self) -> Option<Vec<u8>> {
        let frame = fsoe::frame::Frame::parse(self.to_send(), self.config().outputs)?;
        (frame.command == fsoe::command::PROCESS_DATA).then_some(frame.data)
    }
    fn process_data_of(&self, answer: &[u8]) -> Option<Vec<u8>> {
        let frame = fsoe::frame::Frame::parse(answer, self.config().inputs)?;
        (frame.command == fsoe::command::PROCESS_DATA).then_some(frame.data)
    }
    /// New session ids enter the chain.
    fn restarts(&self) -> u64 {
        0
    }
    fn restarting(&self) -> bool {
        false
    }
    fn watchdog_ms(&self) -> u64 {
        self.config().watchdog_ms.into()
    }
}

impl Observed for profisafe::Host {
    fn process_data(&self) -> Option<Vec<u8>> {
        let length = self.to_send().len() - profisafe::telegram::TRAILER;
        let passive = self.control() & profisafe::control::ACTIVATE_FV != 0;
        (!passive).then(|| self.to_send()[..length].to_vec())
    }
    fn process_data_of(&self, answer: &[u8]) -> Option<Vec<u8>> {
        let (data, trailer) = answer.split_at_checked(answer.len() - profisafe::telegram::TRAILER)?;
        (trailer[0] & profisafe::status::FV_ACTIVATED == 0).then(|| data.to_vec())
    }
    fn restarts(&self) -> u64 {
        self.restarts()
    }
    fn restarting(&self) -> bool {
        self.number() == 0
    }
    fn watchdog_ms(&self) -> u64 {
        100
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
    restarts: u64,
    lengths: (usize, usize),
    /// The last process data that went onto the bus, in each direction.
    last_sent: Option<Vec<u8>>,
    last_answered: Option<Vec<u8>>,
    /// What each end holds, and the cycle in which it was new.
    held_by_device: (Option<Vec<u8>>, u64),
    held_by_master: (Option<Vec<u8>>, u64),
    /// Cycles in which the device, and the master, had process data.
    pub accepted: (u64, u64),
}

impl<M: Observed> Bench<M> {
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
            restarts: 0,
            lengths,
            last_sent: None,
            last_answered: None,
            held_by_device: (None, 0),
            held_by_master: (None, 0),
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
        self.forget_what_no_device_can_tell();
        self.master.operate();
        self.master.set_outputs(&marked(self.count, self.lengths.0));
        let inputs = marked(!self.count, self.lengths.1);
        if let Some(late) = self.device.advance(self.now_ns) {
            self.answer = late;
        }
        self.last_sent = self.master.process_data().or(self.last_sent.take());
        for image in self.to_device.carry(self.master.to_send(), foreign.0) {
            if let Some(answer) = self.device.receive(&image, Some(&inputs), self.now_ns) {
                self.last_answered = self.master.process_data_of(&answer).or(self.last_answered.take());
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

    /// The basic protocol counts from 0 after each restart: a telegram from before it, with
    /// the number that is now due, is right in every bit (7.5). That no bus keeps one so
    /// long is an assumption of use.
    fn forget_what_no_device_can_tell(&mut self) {
        if self.restarts != self.master.restarts() || self.master.restarting() {
            self.restarts = self.master.restarts();
            self.to_device.forget();
            self.to_master.forget();
        }
    }

    /// New outputs are what the master sent last; held ones are no older than the watchdog.
    fn judge_device(&mut self) {
        let outputs = self.device.outputs();
        if outputs.is_none() {
            let zeros = vec![0; self.lengths.0];
            let (a, b) = self.device.raw_outputs();
            assert!(a == zeros || b == zeros, "invalid outputs that are not zero in cycle {}", self.count);
        }
        self.accepted.0 += u64::from(outputs.is_some());
        self.judge(outputs, self.last_sent.as_ref(), &self.held_by_device, "output");
        self.held_by_device = self.held(self.device.outputs(), &self.held_by_device);
    }

    fn judge_master(&mut self) {
        let inputs = self.master.inputs().map(<[u8]>::to_vec);
        self.accepted.1 += u64::from(inputs.is_some());
        self.judge(inputs, self.last_answered.as_ref(), &self.held_by_master, "input");
        self.held_by_master = self.held(self.master.inputs().map(<[u8]>::to_vec), &self.held_by_master);
    }

    fn judge(&self, now: Option<Vec<u8>>, sent: Option<&Vec<u8>>, held: &(Option<Vec<u8>>, u64), what: &str) {
        let Some(now) = now else { return };
        if held.0.as_ref() == Some(&now) {
            let age_ms = self.count - held.1;
            assert!(age_ms < self.master.watchdog_ms(), "{what} {age_ms} ms old in cycle {}", self.count);
        } else {
            assert_eq!(Some(&now), sent, "wrong {what} in cycle {}", self.count);
        }
    }

    fn held(&self, now: Option<Vec<u8>>, before: &(Option<Vec<u8>>, u64)) -> (Option<Vec<u8>>, u64) {
        let since = if before.0 == now { before.1 } else { self.count };
        (now, since)
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
