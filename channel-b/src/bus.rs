//! The black channel of one axis (design 9): which frame is processed in which exchange, what
//! the answer carries, and what became of the connection.
//!
//! The gateway names the exchange in which both channels take a frame, so that both answer
//! the same frame with the same inputs. Everything else about frames is in
//! [`crate::black_channel`].

pub mod inputs;

use shm_schema::answer;
use shm_schema::command::{Command, CommandSource};
use shm_schema::exchange::Bus as Protocol;
use shm_schema::word::Word;

use crate::black_channel::{Answer, Config, Outcome, Slave, fsoe, profisafe};
use fsoe::ResetCode;
use inputs::{Seen, Telegram};
use profisafe::ParameterFault;

/// Frames further ahead than this are refused (architecture, "Black channel").
const AHEAD_MAX: u64 = 16;
/// Watchdog times a master may ask for, ms (design 10).
const WATCHDOG_MS: (u16, u16) = (1, u16::MAX);

/// What happened on the black channel in a step, for the profile's diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Events {
    /// The protocol's watchdog expired in this step.
    pub has_timed_out: bool,
    /// A frame was refused in this step because its check sum does not fit.
    pub is_corrupt: bool,
    /// What the slave remembers did not match its complement.
    pub is_damaged: bool,
    /// PROFIsafe: why the F-parameters stand refused.
    pub parameter_fault: Option<u8>,
}

impl Events {
    /// Nothing happened.
    pub const NONE: Self =
        Self { has_timed_out: false, is_corrupt: false, is_damaged: false, parameter_fault: None };
}

/// The black channel of one axis.
#[derive(Debug, Clone, Copy)]
pub struct Bus {
    protocol: Protocol,
    telegram: Telegram,
    slave: Option<Slave>,
    /// The way the first command came: another one later is none (architecture).
    source: Option<CommandSource>,
    /// Number of the frame seen last; 0: none yet.
    frame_number: u32,
    /// A frame whose exchange has not come: an unreadable cell then delays nothing.
    pending: Option<Command>,
    answers: u32,
    damages: u32,
}

impl Bus {
    /// The slave that `protocol` names, for the telegram of a profile; `signature`: the SRA CRC
    /// of the set (black-channel 2.7).
    pub fn new(protocol: Protocol, telegram: Telegram, signature: u32) -> Self {
        let signature = signature.to_le_bytes();
        let slave = match protocol {
            Protocol::Fsoe { address, session_id, sra } => Slave::new(&Config::Fsoe(fsoe::Config {
                outputs: telegram.outputs(),
                inputs: telegram.inputs(),
                address,
                session_id,
                application_parameters: signature.get(..if sra { 4 } else { 0 }).unwrap_or(&[]),
                watchdog_ms: WATCHDOG_MS,
            }))
            .ok(),
            // Silent until the host's parameters have come.
            Protocol::None | Protocol::Profisafe { .. } => None,
        };
        Self {
            protocol,
            telegram,
            slave,
            source: None,
            frame_number: 0,
            pending: None,
            answers: 0,
            damages: 0,
        }
    }

    /// A fieldbus commands the axis.
    pub const fn is_used(&self) -> bool {
        !matches!(self.protocol, Protocol::None)
    }

    /// Whether a command that comes by `source` is one for this axis. Only frames where there
    /// is a bus, only plain words where there is none, and the same for the whole run.
    pub fn is_believed(&mut self, source: CommandSource) -> bool {
        let kind = match source {
            CommandSource::ProfisafeParameters => CommandSource::Profisafe,
            other => other,
        };
        let wanted = match self.protocol {
            Protocol::None => CommandSource::Plain,
            Protocol::Fsoe { .. } => CommandSource::Fsoe,
            Protocol::Profisafe { .. } => CommandSource::Profisafe,
        };
        if kind == CommandSource::None {
            return false;
        }
        let first = *self.source.get_or_insert(kind);
        (kind == wanted) & (kind == first)
    }

    /// One step in `exchange` at `now`: takes the frame of `command` when its exchange has
    /// come, else lets time pass. `seen`: both channels as of the exchange before.
    pub fn step(
        &mut self,
        command: Option<&Command>,
        exchange: u64,
        now: u64,
        seen: Option<&Seen>,
    ) -> (Option<answer::Answer>, Events) {
        if let Some(command) = command {
            self.note(command, exchange);
        }
        let due = self.pending.filter(|command| command.frame_exchange <= exchange);
        let (answer, mut events) = match &due {
            Some(command) => self.take(command, now, seen),
            None => self.advance(now),
        };
        let damages = self.slave.as_ref().map_or(0, Slave::integrity_faults);
        events.is_damaged = damages != self.damages;
        self.damages = damages;
        events.parameter_fault = match &self.slave {
            Some(Slave::Profisafe(device)) => device.parameter_fault().map(ParameterFault::code),
            _ => None,
        };
        (answer, events)
    }

    /// Keeps a new frame until its exchange. One too far ahead is refused for good.
    fn note(&mut self, command: &Command, exchange: u64) {
        let is_new = (command.frame_number != 0) & (command.frame_number != self.frame_number);
        if !is_new {
            return;
        }
        self.frame_number = command.frame_number;
        let is_near = command.frame_exchange.saturating_sub(exchange) <= AHEAD_MAX;
        self.pending = is_near.then_some(*command);
    }

    fn take(&mut self, command: &Command, now: u64, seen: Option<&Seen>) -> (Option<answer::Answer>, Events) {
        self.pending = None;
        let length = usize::from(command.frame_length);
        let image = command.frame.0.get(..length).unwrap_or(&[]);
        if command.source == CommandSource::ProfisafeParameters {
            self.begin(image);
            return (None, Events::default());
        }
        let octets = seen.map(|seen| self.telegram.compose(seen));
        let inputs = octets.as_ref().and_then(|octets| octets.get(..self.telegram.inputs()));
        let mut buffer = Answer::empty();
        let Some(slave) = &mut self.slave else { return (None, Events::default()) };
        let before = Condition::of(slave);
        let outcome = slave.receive(image, now, inputs, &mut buffer);
        let events = Condition::of(slave).since(before);
        (self.answer(outcome, &buffer, command.frame_number), events)
    }

    /// Architecture: before the F-parameter block the F-Device answers nothing; a new block
    /// starts it anew.
    fn begin(&mut self, block: &[u8]) {
        let Protocol::Profisafe { address } = self.protocol else { return };
        let config = profisafe::Config {
            outputs: self.telegram.outputs(),
            inputs: self.telegram.inputs(),
            address,
            f_parameters: block,
        };
        self.slave = Slave::new(&Config::Profisafe(config)).ok();
    }

    fn advance(&mut self, now: u64) -> (Option<answer::Answer>, Events) {
        let mut buffer = Answer::empty();
        let Some(slave) = &mut self.slave else { return (None, Events::default()) };
        let before = Condition::of(slave);
        let outcome = slave.advance(now, &mut buffer);
        let events = Condition::of(slave).since(before);
        (self.answer(outcome, &buffer, 0), events)
    }

    fn answer(&mut self, outcome: Outcome, buffer: &Answer, frame_number: u32) -> Option<answer::Answer> {
        if outcome != Outcome::Answered {
            return None;
        }
        self.answers = self.answers.wrapping_add(1);
        let octets = buffer.octets();
        let mut answer = answer::Answer {
            frame_number,
            digest: self.digest(),
            number: self.answers,
            length: octets.len() as u16,
            ..answer::Answer::default()
        };
        answer.frame.0.iter_mut().zip(octets).for_each(|(to, from)| *to = *from);
        Some(answer)
    }

    /// The control word: the safe outputs while they are process data, else zeros (DEC-18).
    pub fn word(&self) -> Word {
        let octets = self.slave.as_ref().map_or(&[][..], Slave::outputs);
        let mut parts = [0; 8];
        for (part, four) in parts.iter_mut().zip(octets.chunks(4)) {
            *part =
                (0..).zip(four).fold(0, |all, (place, octet)| all | u32::from(*octet) << (place << 3 & 31));
        }
        Word(parts)
    }

    /// The connection stands and carries process data (DEC-16).
    pub fn is_connected(&self) -> bool {
        self.slave.as_ref().is_some_and(Slave::has_process_data)
    }

    /// CRC-32 of the last frame processed; 0 before the first.
    pub fn digest(&self) -> u32 {
        self.slave.as_ref().map_or(0, Slave::digest)
    }

    /// Id of the present FSoE session; 0 without one.
    pub fn session_id(&self) -> u16 {
        match &self.slave {
            Some(Slave::Fsoe(slave)) => slave.session_id(),
            _ => 0,
        }
    }
}

/// What a slave remembers of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Condition {
    has_timed_out: bool,
    is_corrupt: bool,
}

impl Condition {
    fn of(slave: &Slave) -> Self {
        match slave {
            Slave::Fsoe(slave) => Self {
                has_timed_out: slave.last_reset() == Some(ResetCode::WatchdogExpired),
                is_corrupt: slave.last_reset() == Some(ResetCode::InvalidCheckSum),
            },
            Slave::Profisafe(device) => {
                let status = device.status();
                Self { has_timed_out: status & 1 << 3 != 0, is_corrupt: status & 1 << 2 != 0 }
            }
        }
    }

    const fn since(self, before: Self) -> Events {
        Events {
            has_timed_out: self.has_timed_out & !before.has_timed_out,
            is_corrupt: self.is_corrupt & !before.is_corrupt,
            is_damaged: false,
            parameter_fault: None,
        }
    }
}
