//! What an accepted frame does to the slave, and the answer it gets.

use super::super::answer::{Answer, Data};
use super::chain::{Chain, NO_CONNECTION};
use super::fault::ResetCode;
use super::matrix::{Action, State};
use super::parameters::Collected;
use super::slave::{CONNECTION_PAYLOAD, FsoeSlave, SESSION_PAYLOAD};
use super::wire::{Draft, Received, command};

impl FsoeSlave {
    pub(super) fn perform(
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

    pub(super) fn reset(&mut self, code: ResetCode) -> Answer {
        self.disconnect();
        self.enter(State::Reset);
        self.last_reset = Some(code);
        let draft = Draft::new(command::RESET, self.input_length, &[code.octet()]);
        Chain::seal_reset(&draft)
    }

    pub(super) fn begin_session(&mut self, received: &Received) -> Answer {
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
}
