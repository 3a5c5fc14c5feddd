//! Both slaves behind one face: the same events to each, one of three answers to the bus.

use channel_a::black_channel as a;
use channel_b::black_channel as b;
use sim::master::{fsoe, profisafe};

/// Whose answer goes to the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    A,
    B,
    /// Data of A, check sums of B, and only when both processed the same frame.
    Split,
}

impl Source {
    pub const ALL: [Self; 3] = [Self::A, Self::B, Self::Split];
}

/// What a device is built from.
#[derive(Debug, Clone)]
pub enum Shape {
    Fsoe { outputs: u8, inputs: u8, address: u16, session_id: u16, application_parameters: Vec<u8> },
    Profisafe { outputs: u8, inputs: u8, address: u16, f_parameters: Vec<u8> },
}

impl Shape {
    /// The device that `config` of a master is meant for.
    pub fn of_fsoe(config: &fsoe::Config) -> Self {
        Self::Fsoe {
            outputs: config.outputs as u8,
            inputs: config.inputs as u8,
            address: config.address,
            session_id: 0x9ABD,
            application_parameters: config.application_parameters.clone(),
        }
    }

    /// The device that `config` of a host is meant for.
    pub fn of_profisafe(config: &profisafe::Config) -> Self {
        Self::Profisafe {
            outputs: config.outputs as u8,
            inputs: config.inputs as u8,
            address: config.parameters.destination,
            f_parameters: config.parameters.block(),
        }
    }
}

/// What one slave shows after an event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shown {
    /// The answer; `Err` stands for a length that fits no frame.
    pub answer: Result<Option<Vec<u8>>, ()>,
    /// Output process data; `None` while there is none.
    pub outputs: Option<Vec<u8>>,
    /// Digest of the last frame processed.
    pub digest: u32,
}

/// The slaves of both channels.
pub struct Device {
    a: a::Slave,
    b: b::Slave,
    source: Source,
    fsoe: bool,
}

impl Device {
    /// A device before its first frame; `None` when a channel has none for these values.
    pub fn try_new(shape: &Shape) -> (Option<a::Slave>, Option<b::Slave>) {
        (a::Slave::new(&config_a(shape)).ok(), b::Slave::new(&config_b(shape)).ok())
    }

    /// A device before its first frame.
    pub fn new(shape: &Shape, source: Source) -> Self {
        let fsoe = matches!(shape, Shape::Fsoe { .. });
        match Self::try_new(shape) {
            (Some(a), Some(b)) => Self { a, b, source, fsoe },
            (a, b) => panic!("no slave of {shape:?}: A {} B {}", a.is_some(), b.is_some()),
        }
    }

    /// One image to both; what each shows.
    pub fn receive_both(&mut self, image: &[u8], inputs: Option<&[u8]>, now_ns: u64) -> (Shown, Shown) {
        let from_a = self.a.frame(image, inputs, now_ns);
        let from_a = from_a.map(|answer| answer.map(|answer| answer.octets().to_vec())).map_err(|_| ());
        let mut answer = b::Answer::empty();
        let from_b = match self.b.receive(image, now_ns, inputs, &mut answer) {
            b::Outcome::WrongLength => Err(()),
            b::Outcome::Answered => Ok(Some(answer.octets().to_vec())),
            b::Outcome::Nothing => Ok(None),
        };
        self.shown(from_a, from_b)
    }

    /// Time to both; what each shows.
    pub fn advance_both(&mut self, now_ns: u64) -> (Shown, Shown) {
        let from_a = self.a.advance(now_ns).map(|answer| answer.octets().to_vec());
        let mut answer = b::Answer::empty();
        let answered = self.b.advance(now_ns, &mut answer) == b::Outcome::Answered;
        self.shown(Ok(from_a), Ok(answered.then(|| answer.octets().to_vec())))
    }

    fn shown(
        &self,
        from_a: Result<Option<Vec<u8>>, ()>,
        from_b: Result<Option<Vec<u8>>, ()>,
    ) -> (Shown, Shown) {
        let valid_a = self.a.outputs_valid().then(|| self.a.outputs().to_vec());
        let valid_b = self.b.has_process_data().then(|| self.b.outputs().to_vec());
        (
            Shown { answer: from_a, outputs: valid_a, digest: self.a.digest() },
            Shown { answer: from_b, outputs: valid_b, digest: self.b.digest() },
        )
    }

    /// One image; the answer to the bus.
    pub fn receive(&mut self, image: &[u8], inputs: Option<&[u8]>, now_ns: u64) -> Option<Vec<u8>> {
        let shown = self.receive_both(image, inputs, now_ns);
        self.merged(&shown)
    }

    /// Time; the unsolicited frame of an expired watchdog.
    pub fn advance(&mut self, now_ns: u64) -> Option<Vec<u8>> {
        let shown = self.advance_both(now_ns);
        self.merged(&shown)
    }

    /// Output process data of the slave whose answers go to the bus. Split asks both, and
    /// one that has none is enough for fail-safe.
    pub fn outputs(&self) -> Option<Vec<u8>> {
        let a = self.a.outputs_valid().then(|| self.a.outputs().to_vec());
        let b = self.b.has_process_data().then(|| self.b.outputs().to_vec());
        match self.source {
            Source::A => a,
            Source::B => b,
            Source::Split => a.filter(|_| b.is_some()),
        }
    }

    /// What the raw outputs read, whether they are valid or not (DEC-18).
    pub fn raw_outputs(&self) -> (Vec<u8>, Vec<u8>) {
        (self.a.outputs().to_vec(), self.b.outputs().to_vec())
    }

    fn merged(&self, (from_a, from_b): &(Shown, Shown)) -> Option<Vec<u8>> {
        match self.source {
            Source::A => from_a.answer.clone().ok()?,
            Source::B => from_b.answer.clone().ok()?,
            Source::Split => {
                let (data, sums) = (from_a.answer.clone().ok()??, from_b.answer.clone().ok()??);
                (from_a.digest == from_b.digest).then(|| self.spliced(&data, &sums))
            }
        }
    }

    /// Command, data and id of A, check sums of B; done here, not by either channel.
    fn spliced(&self, data: &[u8], sums: &[u8]) -> Vec<u8> {
        assert_eq!(data.len(), sums.len(), "answers of two lengths");
        let length = data.len();
        let is_sum = |at: usize| match (self.fsoe, length) {
            (true, 6) => (2..4).contains(&at),
            (true, _) => (1..length - 2).contains(&at) && matches!(at % 4, 3 | 0),
            (false, _) => at >= length - 3,
        };
        (0..length).map(|at| if is_sum(at) { sums[at] } else { data[at] }).collect()
    }
}

fn config_a(shape: &Shape) -> a::Config<'_> {
    match shape {
        Shape::Fsoe { outputs, inputs, address, session_id, application_parameters } => {
            a::Config::Fsoe(a::FsoeConfig {
                output_length: *outputs,
                input_length: *inputs,
                address: *address,
                session_id: *session_id,
                application_parameters,
                watchdog_ms: (1, u16::MAX),
            })
        }
        Shape::Profisafe { outputs, inputs, address, f_parameters } => {
            a::Config::Profisafe(a::ProfisafeConfig {
                output_length: *outputs,
                input_length: *inputs,
                address: *address,
                f_parameters,
                ipar_crc: None,
                lowest_watchdog_ms: 1,
                device_fault: a::DeviceFaultReport::StatusBit,
            })
        }
    }
}

fn config_b(shape: &Shape) -> b::Config<'_> {
    match shape {
        Shape::Fsoe { outputs, inputs, address, session_id, application_parameters } => {
            b::Config::Fsoe(b::fsoe::Config {
                outputs: (*outputs).into(),
                inputs: (*inputs).into(),
                address: *address,
                session_id: *session_id,
                application_parameters,
                watchdog_ms: (1, u16::MAX),
            })
        }
        Shape::Profisafe { outputs, inputs, address, f_parameters } => {
            b::Config::Profisafe(b::profisafe::Config {
                outputs: (*outputs).into(),
                inputs: (*inputs).into(),
                address: *address,
                f_parameters,
            })
        }
    }
}
