//! The slave's state matrix as a table (black-channel.md 3.4).
//!
//! Each cell lists its checks in the order in which they answer; the first one
//! that fails decides the reset code. The engine beside this file walks it.

use super::fault::ResetCode;
use super::wire::command;

/// State of the slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// No connection.
    Reset,
    /// Session ids are exchanged.
    Session,
    /// Connection id and address are exchanged.
    Connection,
    /// Parameters are exchanged.
    Parameter,
    /// Process data or fail-safe data are exchanged.
    Data,
}

/// Column of the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Reset,
    Session,
    Connection,
    Parameter,
    Data,
    Unknown,
}

impl Class {
    pub(super) const fn of(octet: u8) -> Self {
        match octet {
            command::RESET => Self::Reset,
            command::SESSION => Self::Session,
            command::CONNECTION => Self::Connection,
            command::PARAMETER => Self::Parameter,
            command::PROCESS_DATA | command::FAIL_SAFE_DATA => Self::Data,
            _ => Self::Unknown,
        }
    }
}

/// One condition of a cell and the code it answers with when it fails.
#[derive(Clone, Copy, Debug)]
pub(super) enum Check {
    /// Fails always.
    Never(ResetCode),
    /// Octets of this state's payload are still to come, else 1.
    Unfinished,
    /// This state's payload is complete, else 1.
    Finished,
    /// Connection id is not 0, else 3.
    ConnIdGiven,
    /// Connection id is the stored one, else 3.
    ConnIdStored,
    /// Connection id inside the connection data is the stored one, else 3.
    ConnIdConfirmed,
    /// Address inside the connection data is the own one, else 6.
    AddressOwn,
    /// Parameters acceptable, else 8 to 11.
    ParametersAccepted,
    /// First frame of a chain, else 4.
    Beginning,
    /// Next frame of the chain, else 4. Always the last check of its cell,
    /// because it moves the chain on.
    Chained,
}

/// What an accepted frame does.
#[derive(Clone, Copy, Debug)]
pub(super) enum Action {
    /// Reset with code 0.
    AcknowledgeReset,
    /// First part of the own session id, on a new chain.
    BeginSession,
    /// Next part of the own session id.
    ContinueSession,
    /// Store the connection id, then as below.
    BeginConnection,
    /// Store and echo connection data.
    ContinueConnection,
    /// Start over the parameters, then as below.
    BeginParameter,
    /// Store and echo parameters.
    ContinueParameter,
    /// Take outputs, answer with inputs, restart the watchdog.
    ExchangeData,
}

/// One cell: all checks pass, then the action.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub(super) checks: &'static [Check],
    pub(super) action: Action,
    /// A refused frame that begins a chain starts a new session instead.
    pub(super) begins_session: bool,
}

const fn cell(checks: &'static [Check], action: Action) -> Cell {
    Cell { checks, action, begins_session: false }
}

const fn session(checks: &'static [Check]) -> Cell {
    Cell { checks, action: Action::ContinueSession, begins_session: true }
}

const WRONG: Cell = cell(&[Check::Never(ResetCode::InvalidCommand)], Action::AcknowledgeReset);
const UNKNOWN: Cell = cell(&[Check::Never(ResetCode::UnknownCommand)], Action::AcknowledgeReset);
const RESET: Cell = cell(&[Check::Beginning], Action::AcknowledgeReset);
/// Mark M: a fresh Session restarts; any other Session frame is a command out
/// of place, because completeness is judged before the check sum.
const RESTART: Cell = session(&[Check::Never(ResetCode::InvalidCommand)]);

/// Rows: state. Columns: Reset, Session, Connection, Parameter, Data, unknown.
const MATRIX: [[Cell; 6]; 5] = {
    use Action::{
        AcknowledgeReset, BeginConnection, BeginParameter, BeginSession, ContinueConnection,
        ContinueParameter, ExchangeData,
    };
    use Check::{
        AddressOwn, Beginning, Chained, ConnIdConfirmed, ConnIdGiven, ConnIdStored, Finished,
        ParametersAccepted, Unfinished,
    };
    [
        [cell(&[], AcknowledgeReset), cell(&[Beginning], BeginSession), WRONG, WRONG, WRONG, UNKNOWN],
        [
            RESET,
            session(&[Unfinished, Chained]),
            cell(&[Finished, ConnIdGiven, Chained], BeginConnection),
            WRONG,
            WRONG,
            UNKNOWN,
        ],
        [
            RESET,
            RESTART,
            cell(&[Unfinished, ConnIdStored, Chained], ContinueConnection),
            cell(&[Finished, ConnIdStored, ConnIdConfirmed, AddressOwn, Chained], BeginParameter),
            WRONG,
            UNKNOWN,
        ],
        [
            RESET,
            RESTART,
            WRONG,
            cell(&[Unfinished, ConnIdStored, Chained], ContinueParameter),
            cell(&[Finished, ConnIdStored, ParametersAccepted, Chained], ExchangeData),
            UNKNOWN,
        ],
        [RESET, RESTART, WRONG, WRONG, cell(&[ConnIdStored, Chained], ExchangeData), UNKNOWN],
    ]
};

/// The cell of a state and a command.
pub(super) fn cell_of(state: State, class: Class) -> Cell {
    let row = MATRIX.get(state as usize);
    let cell = row.and_then(|row| row.get(class as usize));
    cell.copied().unwrap_or(UNKNOWN)
}
