//! The state matrix of the FSoE slave (black-channel 3.4), as one total match.

use super::frame::Command;

/// State of the connection, in the order of the hand-shake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// No connection; waiting for a Session frame.
    Reset,
    /// The session ids are being exchanged.
    Session,
    /// Connection id and slave address are being exchanged.
    Connection,
    /// The parameters are being exchanged.
    Parameter,
    /// Process data or fail-safe data are being exchanged.
    Data,
}

/// Why a connection was reset: the code in the first data octet of the Reset
/// frame (black-channel 2.3). Code 7 (echo differs) only a master can raise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCode {
    /// Own wish, or acknowledgement of the master's Reset.
    LocalReset,
    /// Known command that this state does not allow.
    InvalidCommand,
    /// Command octet that no table knows.
    UnknownCommand,
    /// Connection id is 0, or not the one of this connection.
    InvalidConnectionId,
    /// Check sum wrong for this place in the chain.
    InvalidCheckSum,
    /// No new frame within the watchdog time.
    WatchdogExpired,
    /// Connection data name another slave.
    InvalidAddress,
    /// Communication parameters are not two octets long.
    InvalidCommunicationLength,
    /// Watchdog time is outside the limits.
    InvalidCommunicationParameter,
    /// Application parameters have another length than expected.
    InvalidApplicationLength,
    /// Application parameters differ from the expected ones.
    InvalidApplicationParameter,
}

impl ResetCode {
    /// The code on the wire.
    #[must_use]
    pub const fn octet(self) -> u8 {
        match self {
            Self::LocalReset => 0,
            Self::InvalidCommand => 1,
            Self::UnknownCommand => 2,
            Self::InvalidConnectionId => 3,
            Self::InvalidCheckSum => 4,
            Self::WatchdogExpired => 5,
            Self::InvalidAddress => 6,
            Self::InvalidCommunicationLength => 8,
            Self::InvalidCommunicationParameter => 9,
            Self::InvalidApplicationLength => 10,
            Self::InvalidApplicationParameter => 11,
        }
    }
}

/// What is known about a received frame, given everything remembered.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::struct_excessive_bools, reason = "each is a column of the matrix, not a state")]
pub(super) struct Evidence {
    /// The payload of the present state has been exchanged completely.
    pub(super) is_complete: bool,
    /// The connection id field is not 0.
    pub(super) has_connection_id: bool,
    /// The connection id field is the stored one.
    pub(super) is_of_connection: bool,
    /// The connection id in the connection data is the stored one.
    pub(super) connection_data_agree: bool,
    /// The address in the connection data is the own one.
    pub(super) address_agrees: bool,
    /// What is wrong with the parameters received, if anything.
    pub(super) parameter_fault: Option<ResetCode>,
    /// Check sums right for the next place in the chain.
    pub(super) is_chained: bool,
    /// Check sums right for the beginning of a chain, without connection id.
    pub(super) is_origin: bool,
}

/// What is to be done with a received frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// No answer.
    Ignore,
    /// Answer Reset with the code, state Reset.
    Refuse(ResetCode),
    /// Answer Reset with code 0, state Reset.
    Acknowledge,
    /// A new session with a new session id.
    StartSession,
    /// The next piece of the own session id.
    ContinueSession,
    /// Store a piece of connection data and echo it.
    TakeConnection,
    /// Store a piece of the parameters and echo it.
    TakeParameter,
    /// Exchange data.
    Exchange,
}

use ResetCode::{InvalidAddress, InvalidCheckSum, InvalidCommand, InvalidConnectionId, UnknownCommand};

/// The matrix: the verdict about `command` in `state`. Rows and columns as in
/// black-channel 3.4; checks in the order command, completeness, connection id,
/// address or parameter content, check sum.
pub(super) fn judge(state: State, command: Command, evidence: Evidence) -> Verdict {
    let e = evidence;
    match (state, command) {
        // Mark M: an image with command 0 was observed only in state Reset.
        (State::Reset, Command::Idle) => Verdict::Ignore,
        (_, Command::Idle | Command::Unknown) => Verdict::Refuse(UnknownCommand),

        (State::Reset, Command::Reset) => Verdict::Acknowledge,
        (_, Command::Reset) => checked([(e.is_origin, InvalidCheckSum)], Verdict::Acknowledge),

        (State::Session, Command::Session) => judge_further_session(e),
        (State::Reset, Command::Session) => checked([(e.is_origin, InvalidCheckSum)], Verdict::StartSession),
        // Mark M: a fresh frame restarts rather than being refused, outputs are
        // fail-safe either way. Only a fresh one is a command of these states, and
        // the command is judged before the check sum (decision on 3.4).
        (State::Connection | State::Parameter | State::Data, Command::Session) => {
            checked([(e.is_origin, InvalidCommand)], Verdict::StartSession)
        }

        (State::Session, Command::Connection) => checked(
            [
                (e.is_complete, InvalidCommand),
                (e.has_connection_id, InvalidConnectionId),
                (e.is_chained, InvalidCheckSum),
            ],
            Verdict::TakeConnection,
        ),
        (State::Connection, Command::Connection) => judge_further_piece(e, Verdict::TakeConnection),
        (State::Connection, Command::Parameter) => checked(
            [
                (e.is_complete, InvalidCommand),
                (e.is_of_connection, InvalidConnectionId),
                (e.connection_data_agree, InvalidConnectionId),
                (e.address_agrees, InvalidAddress),
                (e.is_chained, InvalidCheckSum),
            ],
            Verdict::TakeParameter,
        ),
        (State::Parameter, Command::Parameter) => judge_further_piece(e, Verdict::TakeParameter),
        (State::Parameter, Command::ProcessData | Command::FailSafeData) => judge_first_data(e),
        (State::Data, Command::ProcessData | Command::FailSafeData) => checked(
            [(e.is_of_connection, InvalidConnectionId), (e.is_chained, InvalidCheckSum)],
            Verdict::Exchange,
        ),

        (State::Reset | State::Parameter | State::Data, Command::Connection)
        | (State::Reset | State::Session | State::Data, Command::Parameter)
        | (State::Reset | State::Session | State::Connection, Command::ProcessData | Command::FailSafeData) => {
            Verdict::Refuse(InvalidCommand)
        }
    }
}

fn judge_further_session(e: Evidence) -> Verdict {
    match (e.is_complete, e.is_chained, e.is_origin) {
        (false, true, _) => Verdict::ContinueSession,
        (_, _, true) => Verdict::StartSession,
        // Completeness is judged before the check sum (decision on 3.4).
        (true, _, false) => Verdict::Refuse(InvalidCommand),
        (false, false, false) => Verdict::Refuse(InvalidCheckSum),
    }
}

fn judge_further_piece(e: Evidence, accepted: Verdict) -> Verdict {
    checked(
        [
            (!e.is_complete, InvalidCommand),
            (e.is_of_connection, InvalidConnectionId),
            (e.is_chained, InvalidCheckSum),
        ],
        accepted,
    )
}

fn judge_first_data(e: Evidence) -> Verdict {
    let content = e.parameter_fault.unwrap_or(ResetCode::InvalidApplicationParameter);
    checked(
        [
            (e.is_complete, InvalidCommand),
            (e.is_of_connection, InvalidConnectionId),
            (e.parameter_fault.is_none(), content),
            (e.is_chained, InvalidCheckSum),
        ],
        Verdict::Exchange,
    )
}

/// `accepted`, or the code of the first condition that does not hold.
fn checked<const N: usize>(conditions: [(bool, ResetCode); N], accepted: Verdict) -> Verdict {
    let first_fault = conditions.into_iter().find(|(holds, _)| !holds);
    first_fault.map_or(accepted, |(_, code)| Verdict::Refuse(code))
}
