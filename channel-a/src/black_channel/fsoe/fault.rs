//! Reasons of a reset, as they stand in the first data octet of a Reset frame.

/// Why the slave resets the connection (black-channel.md 2.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCode {
    /// Local reset, or acknowledgement of the master's Reset.
    Local,
    /// Known command, not allowed in this state.
    InvalidCommand,
    /// No command of the protocol.
    UnknownCommand,
    /// Connection id 0, or another than the connection's.
    InvalidConnId,
    /// Check sum, number or inheritance wrong.
    InvalidCrc,
    /// No accepted frame within the watchdog time.
    WatchdogExpired,
    /// The connection names another slave address.
    InvalidAddress,
    /// Communication parameter length is not 2.
    InvalidCommunicationParameterLength,
    /// Watchdog time not acceptable.
    InvalidCommunicationParameter,
    /// Application parameter length is not the expected one.
    InvalidApplicationParameterLength,
    /// Application parameters are not the expected ones.
    InvalidApplicationParameter,
}

impl ResetCode {
    /// The octet on the wire.
    #[must_use]
    pub const fn octet(self) -> u8 {
        match self {
            Self::Local => 0,
            Self::InvalidCommand => 1,
            Self::UnknownCommand => 2,
            Self::InvalidConnId => 3,
            Self::InvalidCrc => 4,
            Self::WatchdogExpired => 5,
            Self::InvalidAddress => 6,
            // 7, echo differs, is raised by masters only.
            Self::InvalidCommunicationParameterLength => 8,
            Self::InvalidCommunicationParameter => 9,
            Self::InvalidApplicationParameterLength => 10,
            Self::InvalidApplicationParameter => 11,
        }
    }
}
