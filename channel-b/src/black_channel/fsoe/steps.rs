//! One frame of the master, from the evidence to the answer.

use core::iter;

use super::super::Outcome;
use super::super::answer::Answer;
use super::super::mirrored::{Mirrored, MirroredOctets};
use super::Slave;
use super::check::Link;
use super::frame::{Command, Frame, compose, first_block};
use super::memory::{CONNECTION_OCTETS, Memory, PARAMETER_HEADER_OCTETS, SESSION_OCTETS};
use super::verdict::{Evidence, ResetCode, State, Verdict, judge};

impl Slave {
    pub(super) fn process(
        &mut self,
        memory: Memory,
        frame: &Frame<'_>,
        now_ns: u64,
        inputs: Option<&[u8]>,
        answer: &mut Answer,
    ) -> Outcome {
        let command = Command::of(frame.command);
        let (link, first_check) = next_link(&memory, frame);
        let evidence = self.gather(&memory, frame, (link, first_check));
        let start = || Memory {
            state: State::Session,
            session_id: memory.next_session_id,
            ..Memory::reset(memory.next_session_id.wrapping_add(1))
        };
        match judge(memory.state, command, evidence) {
            Verdict::Ignore => Outcome::Nothing,
            Verdict::Refuse(code) => self.refuse(memory, code, answer),
            Verdict::Acknowledge => self.refuse(memory, ResetCode::LocalReset, answer),
            Verdict::StartSession => self.hand_over_id(start().received(frame, Link::ORIGIN), answer),
            Verdict::ContinueSession => self.hand_over_id(memory.received(frame, link), answer),
            Verdict::TakeConnection => self.take_connection(memory.received(frame, link), frame, answer),
            Verdict::TakeParameter => self.take_parameter(memory.received(frame, link), frame, answer),
            Verdict::Exchange => {
                let accepted = memory.received(frame, link).exchanging(command, now_ns);
                self.exchange(accepted, frame, inputs, answer)
            }
        }
    }

    fn gather(&self, memory: &Memory, frame: &Frame<'_>, (link, first_check): (Link, u16)) -> Evidence {
        let [connection_id, address] = memory.connection_fields();
        let has_connection_id = frame.connection_id != 0;
        let is_session = Command::of(frame.command) == Command::Session;
        // Session frames carry no connection id, wherever they are in the chain.
        let may_be_chained = !(is_session && has_connection_id);
        let may_be_origin = !has_connection_id;
        Evidence {
            is_complete: usize::from(memory.done) >= self.payload(memory.state),
            has_connection_id,
            is_of_connection: frame.connection_id == memory.connection_id,
            connection_data_agree: connection_id == memory.connection_id,
            address_agrees: address == self.address,
            parameter_fault: self.parameter_fault(memory),
            is_chained: may_be_chained && frame.is_checked_by(link, first_check),
            is_origin: may_be_origin && begins_chain(frame),
        }
    }

    /// Payload octets that a state exchanges in all (black-channel 2.6).
    fn payload(&self, state: State) -> usize {
        match state {
            State::Reset | State::Data => 0,
            State::Session => SESSION_OCTETS,
            State::Connection => CONNECTION_OCTETS,
            State::Parameter => PARAMETER_HEADER_OCTETS.saturating_add(usize::from(self.application_length)),
        }
    }

    /// The first fault of the parameters in the order 8, 9, 10, 11 (mark M).
    fn parameter_fault(&self, memory: &Memory) -> Option<ResetCode> {
        let [length, watchdog_ms, application_length] = memory.parameter_fields();
        let (shortest_ms, longest_ms) = self.watchdog_ms;
        let watchdog_fits = (shortest_ms.max(1)..=longest_ms).contains(&watchdog_ms);
        let conditions = [
            (length == 2, ResetCode::InvalidCommunicationLength),
            (watchdog_fits, ResetCode::InvalidCommunicationParameter),
            (application_length == self.application_length, ResetCode::InvalidApplicationLength),
            (memory.application_agrees, ResetCode::InvalidApplicationParameter),
        ];
        conditions.into_iter().find(|(holds, _)| !holds).map(|(_, code)| code)
    }

    /// Fault procedure (black-channel 3.3), and the answer to it.
    pub(super) fn refuse(&mut self, memory: Memory, code: ResetCode, answer: &mut Answer) -> Outcome {
        self.outputs = MirroredOctets::zeros();
        self.last_reset = Some(code);
        self.memory = Mirrored::new(Memory::reset(memory.next_session_id));
        let (command, data) = (Command::Reset.octet(), iter::once(code.octet()));
        let first_check = Link::ORIGIN.first_check(command, first_block(self.input_size, data.clone()));
        compose(answer, (self.input_size, command), (Link::ORIGIN, first_check), data);
        Outcome::Answered
    }

    /// Memory and complement disagree: the connection ends, and the id that is
    /// left over is stepped on because it may be any.
    pub(super) fn recover(&mut self, answer: &mut Answer) -> Outcome {
        self.integrity_faults = self.integrity_faults.saturating_add(1);
        let next_session_id = self.memory.unchecked().next_session_id.wrapping_add(1);
        self.refuse(Memory::reset(next_session_id), ResetCode::LocalReset, answer)
    }

    /// Octets of one hand-shake frame that carry payload: the smaller direction.
    fn piece(&self) -> usize {
        self.output_size.octets().min(self.input_size.octets())
    }

    fn hand_over_id(&mut self, memory: Memory, answer: &mut Answer) -> Outcome {
        if memory.done == 0 {
            self.outputs = MirroredOctets::zeros();
        }
        let (piece, done) = (self.piece(), usize::from(memory.done));
        let id = memory.session_id.to_le_bytes().into_iter().skip(done).take(piece);
        let memory = memory.further(piece);
        self.send(memory, Command::Session.octet(), 0, id, answer)
    }

    fn take_connection(&mut self, memory: Memory, frame: &Frame<'_>, answer: &mut Answer) -> Outcome {
        let mut taken = match memory.state {
            State::Connection => memory,
            _ => memory.entering(State::Connection),
        };
        taken.connection_id = frame.connection_id;
        let done = usize::from(taken.done);
        let places = taken.connection_data.iter_mut().skip(done);
        places.zip(frame.data().take(self.piece())).for_each(|(to, from)| *to = from);
        self.echo(taken, frame, answer)
    }

    fn take_parameter(&mut self, memory: Memory, frame: &Frame<'_>, answer: &mut Answer) -> Outcome {
        let mut taken = match memory.state {
            State::Parameter => memory,
            _ => memory.entering(State::Parameter),
        };
        let done = usize::from(taken.done);
        let piece = frame.data().take(self.piece());
        let header = taken.parameter_header.iter_mut().skip(done);
        header.zip(piece.clone()).for_each(|(to, from)| *to = from);
        // The application parameters need not be kept, only compared.
        let length = usize::from(self.application_length);
        let expected = self.application_parameters.iter().take(length);
        let ahead = PARAMETER_HEADER_OCTETS.saturating_sub(done);
        let behind = done.saturating_sub(PARAMETER_HEADER_OCTETS);
        let mut pairs = expected.skip(behind).zip(piece.skip(ahead));
        taken.application_agrees &= pairs.all(|(wanted, got)| *wanted == got);
        self.echo(taken, frame, answer)
    }

    /// Sends the payload octets of `frame` back.
    fn echo(&mut self, memory: Memory, frame: &Frame<'_>, answer: &mut Answer) -> Outcome {
        let left = self.payload(memory.state).saturating_sub(usize::from(memory.done));
        let payload = frame.data().take(self.piece().min(left));
        let memory = memory.further(self.piece());
        self.send(memory, frame.command, frame.connection_id, payload, answer)
    }

    fn exchange(
        &mut self,
        memory: Memory,
        frame: &Frame<'_>,
        inputs: Option<&[u8]>,
        answer: &mut Answer,
    ) -> Outcome {
        self.last_reset = None;
        self.outputs = MirroredOctets::zeros();
        if memory.has_process_data {
            self.outputs.store(frame.data());
        }
        let inputs = inputs.filter(|inputs| inputs.len() == self.input_size.octets());
        let command = match inputs {
            Some(_) => Command::ProcessData,
            None => Command::FailSafeData,
        };
        let data = inputs.unwrap_or(&[]).iter().copied();
        self.send(memory, command.octet(), memory.connection_id, data, answer)
    }

    /// Sends `data` as the next frame of the chain and remembers it.
    fn send(
        &mut self,
        memory: Memory,
        command: u8,
        connection_id: u16,
        data: impl Iterator<Item = u8> + Clone,
        answer: &mut Answer,
    ) -> Outcome {
        let block = first_block(self.input_size, data.clone());
        let link = Link { inherited: memory.received_check, connection_id, number: 0 };
        let (link, sent_check) = link.numbered(memory.slave_number, memory.sent_check, command, block);
        self.memory = Mirrored::new(Memory { slave_number: link.number, sent_check, ..memory });
        compose(answer, (self.input_size, command), (link, sent_check), data);
        Outcome::Answered
    }
}

/// Where in the chain the next frame of the master has to be, and its CRC_0.
fn next_link(memory: &Memory, frame: &Frame<'_>) -> (Link, u16) {
    let (block, _) = frame.first();
    let (number, avoided) = (memory.master_number, memory.received_check);
    memory.expected(frame.connection_id).numbered(number, avoided, frame.command, block)
}

/// Whether the check sums are those of the first frame of a chain.
fn begins_chain(frame: &Frame<'_>) -> bool {
    let (block, _) = frame.first();
    frame.is_checked_by(Link::ORIGIN, Link::ORIGIN.first_check(frame.command, block))
}

impl Memory {
    /// This memory with `frame`, found right by `link`, as the last one received.
    fn received(self, frame: &Frame<'_>, link: Link) -> Self {
        let (_, received_check) = frame.first();
        Self { master_number: link.number, received_check, ..self }
    }

    /// The beginning of the exchange of the next state.
    const fn entering(self, state: State) -> Self {
        Self { state, done: 0, ..self }
    }

    /// One more piece of the present exchange is done.
    const fn further(self, piece: usize) -> Self {
        Self { done: self.done.saturating_add(piece as u16), ..self }
    }

    /// A data frame has been accepted at `now_ns`.
    fn exchanging(self, command: Command, now_ns: u64) -> Self {
        let has_process_data = command == Command::ProcessData;
        Self { state: State::Data, has_process_data, accepted_at_ns: now_ns, ..self }
    }
}
