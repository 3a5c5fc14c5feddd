//! PROFIsafe F-Host, basic protocol V2 with three octets of CRC2, for tests.
//!
//! - [`parameters`]: F-parameter block and CRC1 (7.1, 7.2)
//! - [`telegram`]: octets of a telegram and CRC2 (7.3, 7.4)
//! - [`host`]: number, toggle, faults, operator acknowledgement (8.4)

pub mod host;
pub mod parameters;
pub mod telegram;
#[cfg(test)]
mod tests;

pub use host::{Config, Host};
pub use parameters::Parameters;

/// Bits of the control octet, host to device (7.6).
pub mod control {
    /// Operator acknowledgement is wanted.
    pub const OA_REQ: u8 = 0x02;
    /// The virtual consecutive number starts over.
    pub const R_CONS_NR: u8 = 0x04;
    /// Fail-safe values are to be used.
    pub const ACTIVATE_FV: u8 = 0x10;
    /// Changes with each new number.
    pub const TOGGLE: u8 = 0x20;
}

/// Bits of the status octet, device to host (7.6).
pub mod status {
    /// The device has a fault of its own.
    pub const DEVICE_FAULT: u8 = 0x02;
    /// The device saw a wrong check sum.
    pub const CE_CRC: u8 = 0x04;
    /// The device's watchdog expired.
    pub const WD_TIMEOUT: u8 = 0x08;
    /// Fail-safe values are in use.
    pub const FV_ACTIVATED: u8 = 0x10;
    /// Follows the host's toggle.
    pub const TOGGLE: u8 = 0x20;
    /// The number was started over.
    pub const CONS_NR_R: u8 = 0x40;
}
