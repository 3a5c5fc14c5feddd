//! FSoE master: the other end of the slaves' connection, for tests.
//!
//! - [`frame`]: octets of a frame and their check sums (2.1 to 2.4)
//! - [`chain`]: numbers and inherited check sums (2.5)
//! - [`machine`]: states, payloads and faults (2.6, 3.8)

pub mod chain;
pub mod frame;
pub mod machine;
#[cfg(test)]
mod tests;

pub use chain::Chain;
pub use machine::{Config, Master, State};

/// Commands (2.2).
pub mod command {
    /// Safe data that counts.
    pub const PROCESS_DATA: u8 = 0x36;
    /// Ends whatever was.
    pub const RESET: u8 = 0x2A;
    /// Exchanges session ids.
    pub const SESSION: u8 = 0x4E;
    /// Exchanges connection id and address.
    pub const CONNECTION: u8 = 0x64;
    /// Exchanges watchdog and application parameters.
    pub const PARAMETER: u8 = 0x52;
    /// The connection stands, the data does not count.
    pub const FAIL_SAFE_DATA: u8 = 0x08;
    /// All of them.
    pub const ALL: [u8; 6] = [PROCESS_DATA, RESET, SESSION, CONNECTION, PARAMETER, FAIL_SAFE_DATA];
}

/// Codes in the first octet of a Reset (2.3).
pub mod code {
    /// Local reset, or acknowledge of a Reset.
    pub const LOCAL: u8 = 0;
    /// Known command, not allowed in this state.
    pub const INVALID_COMMAND: u8 = 1;
    /// No command at all.
    pub const UNKNOWN_COMMAND: u8 = 2;
    /// Wrong connection id.
    pub const INVALID_CONNECTION_ID: u8 = 3;
    /// Wrong check sum.
    pub const INVALID_CRC: u8 = 4;
    /// Watchdog expired.
    pub const WATCHDOG: u8 = 5;
    /// Address in the Connection data is not the slave's.
    pub const INVALID_ADDRESS: u8 = 6;
    /// The echo differs (master only).
    pub const INVALID_DATA: u8 = 7;
    /// Length of the communication parameters is not 2.
    pub const INVALID_COMMUNICATION_LENGTH: u8 = 8;
    /// Watchdog not acceptable.
    pub const INVALID_COMMUNICATION_PARAMETER: u8 = 9;
    /// Length of the application parameters differs.
    pub const INVALID_APPLICATION_LENGTH: u8 = 10;
    /// Application parameters differ.
    pub const INVALID_APPLICATION_PARAMETER: u8 = 11;
}
