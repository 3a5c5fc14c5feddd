//! Number, toggle, faults and operator acknowledgement of the host (8.4).

use super::{Parameters, control, status, telegram::Telegram};
use crate::master::NS_PER_MS;

/// What the host's connection is about.
#[derive(Debug, Clone, Copy)]
pub struct Config {
    /// F-data octets to the device.
    pub outputs: usize,
    /// F-data octets from the device.
    pub inputs: usize,
    /// F-parameters of the connection.
    pub parameters: Parameters,
}

/// Where the host stands after a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// No fault is stored.
    Running,
    /// The number was started over, the device's answer to it is awaited.
    Restarting,
    /// The device is well again, the operator's acknowledgement is awaited.
    Acknowledging,
}

/// The F-Host. Starts with fail-safe values and a new number.
#[derive(Debug, Clone)]
pub struct Host {
    config: Config,
    crc1: u16,
    phase: Phase,
    number: u32,
    old_number: u32,
    control: u8,
    old_control: u8,
    activate_fv: bool,
    acknowledge: bool,
    acknowledged: bool,
    outputs: Vec<u8>,
    inputs: Option<Vec<u8>>,
    last_status: Option<u8>,
    to_send: Vec<u8>,
    seen: Vec<u8>,
    sent_ns: u64,
    restarts: u64,
}

impl Host {
    /// A host whose first telegram waits to be sent at time 0.
    pub fn new(config: Config) -> Self {
        let mut host = Self {
            crc1: config.parameters.crc1(),
            phase: Phase::Running,
            number: 0,
            old_number: 0,
            control: control::ACTIVATE_FV | control::TOGGLE | control::R_CONS_NR,
            old_control: 0,
            activate_fv: false,
            acknowledge: false,
            acknowledged: false,
            outputs: vec![0; config.outputs],
            inputs: None,
            last_status: None,
            to_send: Vec::new(),
            seen: Vec::new(),
            sent_ns: 0,
            restarts: 0,
            config,
        };
        host.send();
        host
    }

    /// The telegram on the bus now.
    pub fn to_send(&self) -> &[u8] {
        &self.to_send
    }

    /// Number of the telegram on the bus.
    pub const fn number(&self) -> u32 {
        self.number
    }

    /// How often the number was started over.
    pub const fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Control octet of the telegram on the bus.
    pub const fn control(&self) -> u8 {
        self.control
    }

    /// Status octet of the last right telegram of the device.
    pub const fn status(&self) -> Option<u8> {
        self.last_status
    }

    /// Process values for the next number.
    pub fn set_outputs(&mut self, outputs: &[u8]) {
        self.outputs = outputs.to_vec();
    }

    /// activate_FV_C of the user program: takes effect with the next number.
    pub const fn set_activate_fv(&mut self, active: bool) {
        self.activate_fv = active;
    }

    /// OA_C of the user program. Only a rising edge after OA_Req acknowledges.
    pub const fn set_acknowledge(&mut self, active: bool) {
        let rising = active && !self.acknowledge;
        if rising && self.wants_acknowledge() {
            self.acknowledged = true;
        }
        self.acknowledge = active;
    }

    /// Whether OA_Req stands.
    pub const fn wants_acknowledge(&self) -> bool {
        self.control & control::OA_REQ != 0
    }

    /// Whether no fault is stored.
    pub fn healthy(&self) -> bool {
        self.phase == Phase::Running
    }

    /// The device's process values; `None` stands for fail-safe values.
    pub fn inputs(&self) -> Option<&[u8]> {
        self.inputs.as_deref()
    }

    /// A telegram of arbitrary content and number, right for this connection.
    pub fn forge(&self, data: &[u8], control: u8, number: u32) -> Vec<u8> {
        Telegram::build(data, control, self.crc1, number).octets()
    }

    /// Lets time pass; a device that did not answer in time is a fault.
    pub fn advance(&mut self, now_ns: u64) {
        let elapsed = now_ns.saturating_sub(self.sent_ns);
        if elapsed >= u64::from(self.config.parameters.watchdog_ms) * NS_PER_MS {
            self.fault(now_ns);
        }
    }

    /// Takes the device's image. One like the last, or of another length, is no event, nor
    /// is one of nothing but zeros before the device has answered.
    pub fn receive(&mut self, image: &[u8], now_ns: u64) {
        self.advance(now_ns);
        let silent = self.last_status.is_none() && image.iter().all(|&octet| octet == 0);
        if silent || self.seen == image {
            return;
        }
        let Some(telegram) = Telegram::parse(image, self.config.inputs) else { return };
        self.seen = image.to_vec();
        self.judge(&telegram, now_ns);
    }

    fn judge(&mut self, telegram: &Telegram, now_ns: u64) {
        let answer = answers(telegram.octet, self.control);
        if !answer && self.phase == Phase::Restarting {
            // What the device said before the restart; it is about a number that is gone.
            return;
        }
        let number = if answer { self.number } else { self.old_number };
        let expected = Telegram::build(&telegram.data, telegram.octet, self.crc1, number);
        if expected != *telegram {
            return self.fault(now_ns);
        }
        self.last_status = Some(telegram.octet);
        let faulty = telegram.octet & (status::CE_CRC | status::WD_TIMEOUT) != 0;
        let stale = !answer && !answers(telegram.octet, self.old_control);
        if faulty || stale {
            return self.fault(now_ns);
        }
        let unused = status::FV_ACTIVATED | status::DEVICE_FAULT;
        let sound = telegram.octet & unused == 0;
        let usable = sound && self.phase == Phase::Running && !self.activate_fv;
        self.inputs = usable.then(|| telegram.data.clone());
        if answer {
            self.step(now_ns);
        }
    }

    /// The next number; what it carries depends on where the host stands.
    fn step(&mut self, now_ns: u64) {
        self.phase = match self.phase {
            Phase::Running => Phase::Running,
            Phase::Acknowledging if self.acknowledged => Phase::Running,
            Phase::Restarting | Phase::Acknowledging => Phase::Acknowledging,
        };
        let waiting = self.phase == Phase::Acknowledging;
        if !waiting {
            self.acknowledged = false;
        }
        let next = if self.number >= 0x00FF_FFFF { 1 } else { self.number + 1 };
        let wanted = if waiting { control::OA_REQ | control::ACTIVATE_FV } else { 0 };
        let passive = if self.activate_fv { control::ACTIVATE_FV } else { 0 };
        self.turn(next, wanted | passive, now_ns);
    }

    fn fault(&mut self, now_ns: u64) {
        self.phase = Phase::Restarting;
        self.restarts += 1;
        self.acknowledged = false;
        self.inputs = None;
        self.turn(0, control::ACTIVATE_FV | control::R_CONS_NR, now_ns);
    }

    fn turn(&mut self, number: u32, flags: u8, now_ns: u64) {
        self.old_number = self.number;
        self.old_control = self.control;
        self.number = number;
        self.control = flags | ((self.control & control::TOGGLE) ^ control::TOGGLE);
        self.sent_ns = now_ns;
        self.send();
    }

    fn send(&mut self) {
        let passive = self.control & control::ACTIVATE_FV != 0;
        let zeros = vec![0; self.config.outputs];
        let data = if passive { &zeros } else { &self.outputs };
        self.to_send = Telegram::build(data, self.control, self.crc1, self.number).octets();
    }
}

/// Whether a status is the answer to a control octet: toggle and number restart both follow.
const fn answers(status: u8, control: u8) -> bool {
    let toggled = (status & status::TOGGLE != 0) == (control & control::TOGGLE != 0);
    let restarted = (status & status::CONS_NR_R != 0) == (control & control::R_CONS_NR != 0);
    toggled & restarted
}
