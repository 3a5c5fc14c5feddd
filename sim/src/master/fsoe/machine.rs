//! States, payloads and faults of the master (2.6, 3.8).

use super::{
    chain::Chain,
    code, command,
    frame::{self, Frame},
};
use crate::master::NS_PER_MS;

/// What the connection is about.
#[derive(Debug, Clone)]
pub struct Config {
    /// Safe octets to the slave: 1, or even up to 126.
    pub outputs: usize,
    /// Safe octets from the slave.
    pub inputs: usize,
    /// Address of the slave.
    pub address: u16,
    /// Id of the connection, not 0.
    pub connection_id: u16,
    /// Watchdog in ms.
    pub watchdog_ms: u16,
    /// Application parameters.
    pub application_parameters: Vec<u8>,
    /// Id of the first session; each later one is one more.
    pub session_id: u16,
    /// Sent in place of the Parameter payload made from the above; for what no honest
    /// master would send.
    pub parameter_payload: Option<Vec<u8>>,
}

impl Config {
    /// Connection 7 to `address`, 100 ms, no application parameters.
    pub const fn new(outputs: usize, inputs: usize, address: u16) -> Self {
        Self {
            outputs,
            inputs,
            address,
            connection_id: 7,
            watchdog_ms: 100,
            application_parameters: Vec::new(),
            session_id: 0x2211,
            parameter_payload: None,
        }
    }

    /// Octets of payload in one handshake frame: the smaller of the two directions.
    pub fn chunk(&self) -> usize {
        self.outputs.min(self.inputs)
    }

    fn payload(&self, state: State, session_id: u16) -> Vec<u8> {
        match state {
            State::Session => session_id.to_le_bytes().to_vec(),
            State::Connection => [self.connection_id.to_le_bytes(), self.address.to_le_bytes()].concat(),
            State::Parameter => self.parameter_payload.clone().unwrap_or_else(|| self.parameters()),
            State::Reset | State::Data => Vec::new(),
        }
    }

    fn parameters(&self) -> Vec<u8> {
        let length = self.application_parameters.len() as u16;
        let mut payload = [2, self.watchdog_ms, length].map(u16::to_le_bytes).concat();
        payload.extend(&self.application_parameters);
        payload
    }
}

/// State of the connection as the master sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Reset sent, acknowledge awaited.
    Reset,
    /// Ids are exchanged.
    Session,
    /// Connection id and address are exchanged.
    Connection,
    /// Parameters are exchanged.
    Parameter,
    /// Safe data flows.
    Data,
}

impl State {
    const fn next(self) -> Self {
        match self {
            Self::Reset => Self::Session,
            Self::Session => Self::Connection,
            Self::Connection => Self::Parameter,
            Self::Parameter | Self::Data => Self::Data,
        }
    }

    const fn command(self) -> u8 {
        match self {
            Self::Reset => command::RESET,
            Self::Session => command::SESSION,
            Self::Connection => command::CONNECTION,
            Self::Parameter => command::PARAMETER,
            Self::Data => command::PROCESS_DATA,
        }
    }
}

/// The master. Starts by sending Reset.
#[derive(Debug, Clone)]
pub struct Master {
    config: Config,
    state: State,
    chain: Chain,
    /// The chain before the frame that is now to be sent.
    before: Chain,
    /// Handshake payload of this state not yet acknowledged.
    payload: Vec<u8>,
    session_id: u16,
    to_send: Vec<u8>,
    seen: Vec<u8>,
    outputs: Option<Vec<u8>>,
    inputs: Option<Vec<u8>>,
    slave_session: Vec<u8>,
    refusal: Option<u8>,
    sent_ns: u64,
}

impl Master {
    /// A master whose Reset waits to be sent at time 0.
    pub fn new(config: Config) -> Self {
        let mut master = Self {
            state: State::Reset,
            chain: Chain::default(),
            before: Chain::default(),
            payload: Vec::new(),
            session_id: config.session_id.wrapping_sub(1),
            to_send: Vec::new(),
            seen: Vec::new(),
            outputs: None,
            inputs: None,
            slave_session: Vec::new(),
            refusal: None,
            sent_ns: 0,
            config,
        };
        master.fault(code::LOCAL);
        master
    }

    /// The frame on the bus now.
    pub fn to_send(&self) -> &[u8] {
        &self.to_send
    }

    /// State of the connection.
    pub const fn state(&self) -> State {
        self.state
    }

    /// The chain, with the frame on the bus as its last.
    pub const fn chain(&self) -> &Chain {
        &self.chain
    }

    /// What the connection is about.
    pub const fn config(&self) -> &Config {
        &self.config
    }

    /// Process data for the next Data frame; `None` sends fail-safe data.
    pub fn set_outputs(&mut self, outputs: Option<&[u8]>) {
        self.outputs = outputs.map(<[u8]>::to_vec);
    }

    /// The slave's process data; `None` while there is none or it is fail-safe.
    pub fn inputs(&self) -> Option<&[u8]> {
        self.inputs.as_deref()
    }

    /// Session id of the slave, as far as it is known.
    pub fn slave_session(&self) -> &[u8] {
        &self.slave_session
    }

    /// Code of the slave's last Reset.
    pub const fn refusal(&self) -> Option<u8> {
        self.refusal
    }

    /// A frame of arbitrary content that fits the chain in place of the one on the bus.
    pub fn forge(&self, command: u8, data: &[u8], connection_id: u16) -> Vec<u8> {
        self.before.clone().seal(command, data, connection_id).octets()
    }

    /// The id the frames of this state carry.
    pub const fn connection_field(&self) -> u16 {
        match self.state {
            State::Reset | State::Session => 0,
            _ => self.config.connection_id,
        }
    }

    /// Ends the connection with `code`, as on a fault of this master's own.
    pub fn reset(&mut self, code: u8, now_ns: u64) {
        self.fault(code);
        self.sent_ns = now_ns;
    }

    /// Lets time pass. An expired watchdog leads out of Reset into a new session, out of
    /// every other state into Reset (3.6).
    pub fn advance(&mut self, now_ns: u64) {
        let elapsed = now_ns.saturating_sub(self.sent_ns);
        if elapsed < u64::from(self.config.watchdog_ms) * NS_PER_MS {
            return;
        }
        self.sent_ns = now_ns;
        match self.state {
            State::Reset => self.open(),
            _ => self.fault(code::WATCHDOG),
        }
    }

    /// Takes the slave's image. One like the last, or of another length, is no event.
    pub fn receive(&mut self, image: &[u8], now_ns: u64) {
        self.advance(now_ns);
        if self.seen == image {
            return;
        }
        let Some(frame) = Frame::parse(image, self.config.inputs) else { return };
        self.seen = image.to_vec();
        let before = self.to_send.clone();
        self.judge(&frame);
        if self.to_send != before {
            self.sent_ns = now_ns;
        }
    }

    fn judge(&mut self, frame: &Frame) {
        let reset = frame::reset(frame.data[0], self.config.inputs);
        if *frame == reset {
            self.refusal = Some(frame.data[0]);
            return self.open();
        }
        if self.state == State::Reset {
            // What was under way before the Reset; only its acknowledge counts.
            return;
        }
        match self.objection(frame) {
            Some(code) => self.fault(code),
            None => self.proceed(frame),
        }
    }

    /// Order of checks as the slave's: command, connection id, check sums; then the echo.
    fn objection(&mut self, frame: &Frame) -> Option<u8> {
        let data_state = self.state == State::Data;
        let right_command = match frame.command {
            command::FAIL_SAFE_DATA | command::PROCESS_DATA => data_state,
            other => self.state.command() == other,
        };
        if !command::ALL.contains(&frame.command) {
            Some(code::UNKNOWN_COMMAND)
        } else if frame.command == command::RESET {
            // It names itself a Reset and its check sum says otherwise.
            Some(code::INVALID_CRC)
        } else if !right_command {
            Some(code::INVALID_COMMAND)
        } else if frame.connection_id != self.connection_field() {
            Some(code::INVALID_CONNECTION_ID)
        } else if !self.chain.accept(frame) {
            Some(code::INVALID_CRC)
        } else if !self.echoes(frame) {
            Some(code::INVALID_DATA)
        } else {
            None
        }
    }

    fn echoes(&self, frame: &Frame) -> bool {
        match self.state {
            State::Connection | State::Parameter => {
                let chunk = self.config.chunk();
                let (echo, rest) = frame.data.split_at(chunk);
                padded(&self.payload, chunk) == echo && rest.iter().all(|&octet| octet == 0)
            }
            State::Session | State::Data | State::Reset => true,
        }
    }

    fn proceed(&mut self, frame: &Frame) {
        if self.state == State::Session {
            let chunk = self.payload.len().min(self.config.chunk());
            self.slave_session.extend(frame.data.iter().take(chunk));
        }
        self.inputs = (frame.command == command::PROCESS_DATA).then(|| frame.data.clone());
        self.payload.drain(..self.payload.len().min(self.config.chunk()));
        if self.payload.is_empty() {
            self.state = self.state.next();
            self.payload = self.config.payload(self.state, self.session_id);
        }
        self.before = self.chain.clone();
        self.send();
    }

    fn send(&mut self) {
        let frame = match (self.state, &self.outputs) {
            (State::Data, Some(outputs)) => {
                self.chain.seal(command::PROCESS_DATA, outputs, self.config.connection_id)
            }
            (State::Data, None) => {
                let zeros = vec![0; self.config.outputs];
                self.chain.seal(command::FAIL_SAFE_DATA, &zeros, self.config.connection_id)
            }
            _ => {
                let data = self.chunk_as_data();
                self.chain.seal(self.state.command(), &data, self.connection_field())
            }
        };
        self.to_send = frame.octets();
    }

    fn chunk_as_data(&self) -> Vec<u8> {
        let mut data = padded(&self.payload, self.config.chunk());
        data.resize(self.config.outputs, 0);
        data
    }

    fn open(&mut self) {
        self.start_over(State::Session);
        self.session_id = self.session_id.wrapping_add(1);
        self.payload = self.config.payload(State::Session, self.session_id);
        let data = self.chunk_as_data();
        self.to_send = self.chain.open(&data).octets();
    }

    fn fault(&mut self, code: u8) {
        self.start_over(State::Reset);
        self.to_send = frame::reset(code, self.config.outputs).octets();
    }

    fn start_over(&mut self, state: State) {
        self.state = state;
        self.chain = Chain::default();
        self.before = Chain::default();
        self.payload.clear();
        self.slave_session.clear();
        self.inputs = None;
    }
}

/// The next chunk of a payload, zero padded.
fn padded(payload: &[u8], chunk: usize) -> Vec<u8> {
    let mut octets: Vec<u8> = payload.iter().copied().take(chunk).collect();
    octets.resize(chunk, 0);
    octets
}
