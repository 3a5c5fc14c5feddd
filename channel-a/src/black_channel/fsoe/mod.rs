//! FSoE slave: chain, state matrix, parameters, watchdog.
//!
//! A small engine (`slave`) walks the table in `matrix` and lets `actions` do
//! what an accepted frame asks for; nothing here waits or sends, it turns one
//! received frame into at most one answer.

mod actions;
mod chain;
mod fault;
mod matrix;
mod parameters;
mod slave;
#[cfg(test)]
pub(crate) mod tests;
mod wire;

pub use fault::ResetCode;
pub use matrix::State;
pub use parameters::MAX_APPLICATION_PARAMETERS;
pub use slave::FsoeSlave;

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
