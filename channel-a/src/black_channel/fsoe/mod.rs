//! FSoE slave: chain, state matrix, parameters, watchdog.
//!
//! A small engine walks the table in `matrix`; nothing here waits or sends, it
//! turns one received frame into at most one answer.

mod chain;
mod fault;
mod matrix;
mod parameters;
#[cfg(test)]
mod tests;
mod wire;

pub use fault::ResetCode;
pub use matrix::State;
pub use parameters::MAX_APPLICATION_PARAMETERS;

use super::ConfigFault;
use super::answer::{Answer, Data, Image, LengthFault};
use chain::{Chain, NO_CONNECTION};
use matrix::{Action, Check, Class};
use parameters::{Collected, Expected};
use wire::{DataLength, Draft, Received, command};

/// Octets of the session id.
const SESSION_PAYLOAD: usize = 2;
/// Octets of connection id and slave address.
const CONNECTION_PAYLOAD: usize = 4;
const NANOSECONDS_PER_MILLISECOND: u64 = 1_000_000;

/// What an FSoE slave is built from.
#[derive(Clone, Copy, Debug)]
pub struct FsoeConfig<'a> {
    /// Safe data octets from the master: 1, or even, 2 to 126 (AMK: 4).
    pub output_length: u8,
    /// Safe data octets to the master: 1, or even, 2 to 126 (AMK: 12).
    pub input_length: u8,
    /// FSoE slave address, 1 to 65535 (AMK-ADDR-05: 0 means none).
    pub address: u16,
    /// Id of the first session; each later one takes the next number. It must
    /// come from a source that differs after each power cycle.
    pub session_id: u16,
    /// Application parameters that the master has to send, at most
    /// [`MAX_APPLICATION_PARAMETERS`] octets.
    pub application_parameters: &'a [u8],
    /// Lowest and highest acceptable watchdog time in milliseconds, from 1.
    pub watchdog_ms: (u16, u16),
}

/// FSoE slave of one channel.
pub struct FsoeSlave {
    output_length: DataLength,
    input_length: DataLength,
    address: u16,
    expected: Expected,
    image: Image,
    state: State,
    chain: Chain,
    /// Id of the session that runs or ran last.
    session_id: u16,
    next_session_id: u16,
    conn_id: u16,
    connection_data: [u8; CONNECTION_PAYLOAD],
    collected: Collected,
    /// Payload octets of the current state already exchanged.
    exchanged: usize,
    /// Start of the running watchdog, in nanoseconds; `None` when stopped.
    watchdog_start_ns: Option<u64>,
    outputs: Data,
    outputs_valid: bool,
    last_reset: Option<ResetCode>,
}

impl FsoeSlave {
    /// A slave in state Reset, silent until the first frame.
    ///
    /// # Errors
    /// The first value of the configuration that lies outside its range.
    pub fn new(config: &FsoeConfig) -> Result<Self, ConfigFault> {
        let output_length = DataLength::new(config.output_length).ok_or(ConfigFault::OutputLength)?;
        let input_length = DataLength::new(config.input_length).ok_or(ConfigFault::InputLength)?;
        if config.address == 0 {
            return Err(ConfigFault::Address);
        }
        Ok(Self {
            output_length,
            input_length,
            address: config.address,
            expected: Expected::new(config.application_parameters, config.watchdog_ms)?,
            image: Image::none(),
            state: State::Reset,
            chain: Chain::START,
            session_id: config.session_id,
            next_session_id: config.session_id,
            conn_id: NO_CONNECTION,
            connection_data: [0; CONNECTION_PAYLOAD],
            collected: Collected::NOTHING,
            exchanged: 0,
            watchdog_start_ns: None,
            outputs: Data::zeros(output_length.octets()),
            outputs_valid: false,
            last_reset: None,
        })
    }

    /// One process image of the master frame at `now_ns`. `process_data` are
    /// the safe inputs; `None`, or a wrong length, means that the application
    /// is not enabled and fail-safe data are sent. `Ok(None)`: no answer.
    ///
    /// # Errors
    /// The length fits no frame of this slave; nothing has changed.
    pub fn frame(
        &mut self,
        octets: &[u8],
        process_data: Option<&[u8]>,
        now_ns: u64,
    ) -> Result<Option<Answer>, LengthFault> {
        let received = Received::parse(octets, self.output_length)
            .ok_or(LengthFault { expected: self.output_length.frame(), received: octets.len() })?;
        let changed = self.image.renew(octets);
        // 3.6: a correct frame that comes too late answers like none.
        if let Some(answer) = self.advance(now_ns) {
            return Ok(Some(answer));
        }
        let before_start = self.state == State::Reset && received.command() == command::NONE;
        if !changed || before_start {
            return Ok(None);
        }
        Ok(Some(self.judge(&received, process_data, now_ns)))
    }

    /// Lets time pass to `now_ns`; returns the unsolicited Reset frame of an
    /// expired watchdog. A clock that runs backwards counts as expired.
    pub fn advance(&mut self, now_ns: u64) -> Option<Answer> {
        let start_ns = self.watchdog_start_ns?;
        let watchdog_ns = u64::from(self.collected.watchdog_ms()).saturating_mul(NANOSECONDS_PER_MILLISECOND);
        let running = now_ns.checked_sub(start_ns).is_some_and(|elapsed_ns| elapsed_ns < watchdog_ns);
        if running {
            return None;
        }
        Some(self.reset(ResetCode::WatchdogExpired))
    }

    /// The application resets the connection (3.7).
    pub fn local_reset(&mut self) -> Answer {
        self.reset(ResetCode::Local)
    }

    fn judge(&mut self, received: &Received, process_data: Option<&[u8]>, now_ns: u64) -> Answer {
        let cell = matrix::cell_of(self.state, Class::of(received.command()));
        let failed = cell.checks.iter().find_map(|check| self.failure(*check, received));
        match failed {
            None => self.perform(cell.action, received, process_data, now_ns),
            Some(code) => {
                let restarts = cell.begins_session && Chain::begins_with(received);
                if restarts { self.begin_session(received) } else { self.reset(code) }
            }
        }
    }

    fn failure(&mut self, check: Check, received: &Received) -> Option<ResetCode> {
        let (passed, code) = match check {
            Check::Never(code) => (false, code),
            Check::Unfinished => (!self.is_finished(), ResetCode::InvalidCommand),
            Check::Finished => (self.is_finished(), ResetCode::InvalidCommand),
            Check::ConnIdGiven => (received.conn_id() != NO_CONNECTION, ResetCode::InvalidConnId),
            Check::ConnIdStored => (received.conn_id() == self.conn_id, ResetCode::InvalidConnId),
            Check::ConnIdConfirmed => (self.connection_words().0 == self.conn_id, ResetCode::InvalidConnId),
            Check::AddressOwn => (self.connection_words().1 == self.address, ResetCode::InvalidAddress),
            Check::ParametersAccepted => return self.collected.fault(&self.expected),
            Check::Beginning => (Chain::begins_with(received), ResetCode::InvalidCrc),
            Check::Chained => (self.is_chained(received), ResetCode::InvalidCrc),
        };
        (!passed).then_some(code)
    }

    /// Session frames carry connection id 0, whatever their check sums say.
    fn is_chained(&mut self, received: &Received) -> bool {
        if received.command() == command::SESSION && received.conn_id() != NO_CONNECTION {
            return false;
        }
        self.chain.accept(received)
    }

    fn is_finished(&self) -> bool {
        self.exchanged >= self.payload()
    }

    fn payload(&self) -> usize {
        match self.state {
            State::Session => SESSION_PAYLOAD,
            State::Connection => CONNECTION_PAYLOAD,
            State::Parameter => self.expected.payload(),
            State::Reset | State::Data => 0,
        }
    }

    /// Connection id and address inside the connection data.
    const fn connection_words(&self) -> (u16, u16) {
        let [id_low, id_high, address_low, address_high] = self.connection_data;
        (u16::from_le_bytes([id_low, id_high]), u16::from_le_bytes([address_low, address_high]))
    }

    fn perform(
        &mut self,
        action: Action,
        received: &Received,
        process_data: Option<&[u8]>,
        now_ns: u64,
    ) -> Answer {
        match action {
            Action::AcknowledgeReset => self.reset(ResetCode::Local),
            Action::BeginSession => self.begin_session(received),
            Action::ContinueSession => self.continue_session(),
            Action::BeginConnection => {
                self.enter(State::Connection);
                self.conn_id = received.conn_id();
                self.continue_connection(received)
            }
            Action::ContinueConnection => self.continue_connection(received),
            Action::BeginParameter => {
                self.enter(State::Parameter);
                self.collected = Collected::NOTHING;
                self.continue_parameter(received)
            }
            Action::ContinueParameter => self.continue_parameter(received),
            Action::ExchangeData => self.exchange_data(received, process_data, now_ns),
        }
    }

    fn enter(&mut self, state: State) {
        self.state = state;
        self.exchanged = 0;
    }

    /// Outputs to fail-safe, watchdog stopped, no connection (3.3).
    fn disconnect(&mut self) {
        self.chain = Chain::START;
        self.conn_id = NO_CONNECTION;
        self.connection_data = [0; CONNECTION_PAYLOAD];
        self.collected = Collected::NOTHING;
        self.watchdog_start_ns = None;
        self.outputs = Data::zeros(self.output_length.octets());
        self.outputs_valid = false;
    }

    fn reset(&mut self, code: ResetCode) -> Answer {
        self.disconnect();
        self.enter(State::Reset);
        self.last_reset = Some(code);
        let draft = Draft::new(command::RESET, self.input_length, &[code.octet()]);
        Chain::seal_reset(&draft)
    }

    fn begin_session(&mut self, received: &Received) -> Answer {
        self.disconnect();
        self.enter(State::Session);
        self.chain = Chain::begun_by(received);
        self.session_id = self.next_session_id;
        self.next_session_id = self.next_session_id.wrapping_add(1);
        self.continue_session()
    }

    fn continue_session(&mut self) -> Answer {
        let session_id = self.session_id.to_le_bytes();
        let part = session_id.get(self.pending(SESSION_PAYLOAD)).unwrap_or(&[]);
        let draft = Draft::new(command::SESSION, self.input_length, part);
        self.exchanged = self.exchanged.saturating_add(self.chunk());
        self.chain.send(&draft, NO_CONNECTION)
    }

    /// Octets of a handshake frame that carry payload (2.6).
    fn chunk(&self) -> usize {
        self.output_length.octets().min(self.input_length.octets())
    }

    /// The part of a payload that the current frame carries.
    fn pending(&self, payload: usize) -> core::ops::Range<usize> {
        let end = self.exchanged.saturating_add(self.chunk()).min(payload);
        self.exchanged..end
    }

    fn continue_connection(&mut self, received: &Received) -> Answer {
        let range = self.pending(CONNECTION_PAYLOAD);
        let data = received.data();
        if let Some(places) = self.connection_data.get_mut(range) {
            for (place, octet) in places.iter_mut().zip(data.octets()) {
                *place = *octet;
            }
        }
        self.echo(command::CONNECTION, &data)
    }

    fn continue_parameter(&mut self, received: &Received) -> Answer {
        let length = self.pending(self.expected.payload()).len();
        let data = received.data();
        let part = data.octets().get(..length).unwrap_or(&[]);
        self.collected.add(part, &self.expected);
        self.echo(command::PARAMETER, &data)
    }

    /// Sends back the payload octets of the frame, all others 0.
    fn echo(&mut self, command: u8, data: &Data) -> Answer {
        let length = self.pending(self.payload()).len();
        let part = data.octets().get(..length).unwrap_or(&[]);
        let draft = Draft::new(command, self.input_length, part);
        self.exchanged = self.exchanged.saturating_add(self.chunk());
        self.chain.send(&draft, self.conn_id)
    }

    fn exchange_data(&mut self, received: &Received, process_data: Option<&[u8]>, now_ns: u64) -> Answer {
        self.enter(State::Data);
        self.outputs_valid = received.command() == command::PROCESS_DATA;
        // 3.5: fail-safe data are zeros, even if the octets are not.
        self.outputs =
            if self.outputs_valid { received.data() } else { Data::zeros(self.output_length.octets()) };
        self.watchdog_start_ns = Some(now_ns);
        let length = self.input_length;
        let inputs = process_data.filter(|inputs| inputs.len() == length.octets());
        let draft = match inputs {
            Some(inputs) => Draft::new(command::PROCESS_DATA, length, inputs),
            None => Draft::new(command::FAIL_SAFE_DATA, length, &[]),
        };
        self.chain.send(&draft, self.conn_id)
    }

    /// Safe outputs; zeros while fail-safe (DEC-18).
    #[must_use]
    pub fn outputs(&self) -> &[u8] {
        self.outputs.octets()
    }

    /// Whether the outputs come from an accepted ProcessData frame of the
    /// running connection. Edges count only while this holds (DEC-16).
    #[must_use]
    pub const fn outputs_valid(&self) -> bool {
        self.outputs_valid
    }

    /// Digest of the last process image, 0 before the first.
    #[must_use]
    pub const fn digest(&self) -> u32 {
        self.image.digest()
    }

    /// State of the connection.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// Id of the session that runs or ran last; before the first, its id.
    #[must_use]
    pub const fn session_id(&self) -> u16 {
        self.session_id
    }

    /// Code of the last Reset frame sent.
    #[must_use]
    pub const fn last_reset(&self) -> Option<ResetCode> {
        self.last_reset
    }
}
