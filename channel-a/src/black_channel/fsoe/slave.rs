//! The slave's variables, its events, and the engine that walks the matrix.

use super::super::ConfigFault;
use super::super::answer::{Answer, Data, Image, LengthFault};
use super::FsoeConfig;
use super::chain::{Chain, NO_CONNECTION};
use super::fault::ResetCode;
use super::matrix::{self, Check, Class, State};
use super::parameters::{Collected, Expected};
use super::wire::{DataLength, Received, command};

/// Octets of the session id.
pub(super) const SESSION_PAYLOAD: usize = 2;
/// Octets of connection id and slave address.
pub(super) const CONNECTION_PAYLOAD: usize = 4;
const NANOSECONDS_PER_MILLISECOND: u64 = 1_000_000;

/// FSoE slave of one channel.
#[derive(Clone, Debug)]
pub struct FsoeSlave {
    pub(super) output_length: DataLength,
    pub(super) input_length: DataLength,
    pub(super) address: u16,
    pub(super) expected: Expected,
    pub(super) image: Image,
    pub(super) state: State,
    pub(super) chain: Chain,
    /// Id of the session that runs or ran last.
    pub(super) session_id: u16,
    pub(super) next_session_id: u16,
    pub(super) conn_id: u16,
    pub(super) connection_data: [u8; CONNECTION_PAYLOAD],
    pub(super) collected: Collected,
    /// Payload octets of the current state already exchanged.
    pub(super) exchanged: usize,
    /// Start of the running watchdog, in nanoseconds; `None` when stopped.
    pub(super) watchdog_start_ns: Option<u64>,
    pub(super) outputs: Data,
    pub(super) outputs_valid: bool,
    pub(super) last_reset: Option<ResetCode>,
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
            session_id: 0,
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
        // 3.2: the bus has started, the master has not.
        let before_start = self.state == State::Reset && received.command() == command::NONE;
        if changed && !before_start {
            self.image.count(octets);
        }
        // 3.6: a correct frame that comes too late answers like none.
        if let Some(answer) = self.advance(now_ns) {
            return Ok(Some(answer));
        }
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

    pub(super) fn payload(&self) -> usize {
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
