//! Black-channel slaves of channel A: FSoE slave and PROFIsafe F-Device.
//!
//! A [`Slave`] turns one received process image into at most one answer, and
//! the passing of time into the answer of an expired watchdog. It owns the
//! protocol state and the safe outputs; it never sends, waits, or decides what
//! an output bit means. Incremental and table-driven: check sums from constant
//! tables, the FSoE state matrix as data (black-channel.md).
//!
//! An answer leaves the device only when both channels report the same digest
//! of the same frame; command, data and connection id then come from here, the
//! check sums from the other channel (design 9).

mod answer;
mod crc;
mod fsoe;
mod profisafe;
#[cfg(test)]
mod tests;

pub use answer::{Answer, LengthFault, MAX_DATA, MAX_FRAME};
#[cfg(test)]
pub(crate) use fsoe::tests::Master as TestMaster;

pub use crc::{frame_digest, parameter_signature};
pub use fsoe::{FsoeConfig, FsoeSlave, MAX_APPLICATION_PARAMETERS, ResetCode, State};
pub use profisafe::{
    Communication, DeviceFaultReport, FDevice, FParameterFault, FParameters, ProfisafeConfig,
};

/// A value of a configuration that lies outside its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfigFault {
    /// Octets from the master: FSoE 1 or even up to 126, PROFIsafe 0 to 12.
    OutputLength,
    /// Octets to the master: as for [`ConfigFault::OutputLength`].
    InputLength,
    /// Own address 0, or 65535 in PROFIsafe.
    Address,
    /// More application parameters than [`MAX_APPLICATION_PARAMETERS`].
    ApplicationParameterLength,
    /// Lowest watchdog 0, or above the highest.
    WatchdogLimits,
    /// No F-parameter block has this length (10, 12, 14 or 16 octets).
    FParameterLength,
}

/// What a slave is built from.
#[derive(Clone, Copy, Debug)]
pub enum Config<'a> {
    /// FSoE slave.
    Fsoe(FsoeConfig<'a>),
    /// PROFIsafe F-Device.
    Profisafe(ProfisafeConfig<'a>),
}

/// The black-channel slave of this channel.
// One slave lives for the whole run in a fixed place; there is no allocator.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
pub enum Slave {
    /// FSoE slave.
    Fsoe(FsoeSlave),
    /// PROFIsafe F-Device.
    Profisafe(FDevice),
}

impl Slave {
    /// A slave that waits for its first frame, outputs fail-safe.
    ///
    /// # Errors
    /// The first value of the configuration that lies outside its range.
    pub fn new(config: &Config) -> Result<Self, ConfigFault> {
        match config {
            Config::Fsoe(config) => FsoeSlave::new(config).map(Self::Fsoe),
            Config::Profisafe(config) => FDevice::new(config).map(Self::Profisafe),
        }
    }

    /// One received process image at `now_ns` (nanoseconds of a monotonic
    /// clock). `process_data` are the safe inputs to send; `None`, or a wrong
    /// length, means that the application is not enabled: fail-safe zeros.
    /// `Ok(None)`: no answer, the image is no event.
    ///
    /// # Errors
    /// The length fits no frame of this slave; nothing has changed.
    pub fn frame(
        &mut self,
        octets: &[u8],
        process_data: Option<&[u8]>,
        now_ns: u64,
    ) -> Result<Option<Answer>, LengthFault> {
        match self {
            Self::Fsoe(slave) => slave.frame(octets, process_data, now_ns),
            Self::Profisafe(device) => device.frame(octets, process_data, now_ns),
        }
    }

    /// Lets time pass to `now_ns`; returns the unsolicited frame of a watchdog
    /// that has expired (elapsed >= watchdog).
    pub fn advance(&mut self, now_ns: u64) -> Option<Answer> {
        match self {
            Self::Fsoe(slave) => slave.advance(now_ns),
            Self::Profisafe(device) => device.advance(now_ns),
        }
    }

    /// Safe outputs; zeros while fail-safe (DEC-18).
    #[must_use]
    pub fn outputs(&self) -> &[u8] {
        match self {
            Self::Fsoe(slave) => slave.outputs(),
            Self::Profisafe(device) => device.outputs(),
        }
    }

    /// Whether the outputs are process values of the running connection. Edges
    /// count only while this holds (DEC-16).
    #[must_use]
    pub fn outputs_valid(&self) -> bool {
        match self {
            Self::Fsoe(slave) => slave.outputs_valid(),
            Self::Profisafe(device) => device.outputs_valid(),
        }
    }

    /// CRC-32 of the last process image, 0 before the first.
    #[must_use]
    pub const fn digest(&self) -> u32 {
        match self {
            Self::Fsoe(slave) => slave.digest(),
            Self::Profisafe(device) => device.digest(),
        }
    }

    /// FSoE session id for the other channel (design 9); 0 for PROFIsafe,
    /// which has none.
    #[must_use]
    pub const fn session_id(&self) -> u16 {
        match self {
            Self::Fsoe(slave) => slave.session_id(),
            Self::Profisafe(_) => 0,
        }
    }
}
