//! Black-channel slaves of this channel: FSoE and PROFIsafe (design 9).
//!
//! Frame octets and time go in, an answer comes out in a buffer of the caller's;
//! nothing here knows a bus, a clock or another process. It may use `core` only,
//! and must never hand out process data that a whole chain of checks has not
//! confirmed: every doubt reads as zeros (DEC-18).
//!
//! Choices of this channel: check sums by long division without tables, each
//! event judged as one total match that gives a whole new memory, and every
//! safety variable kept beside its complement.

mod answer;
mod division;
pub mod fsoe;
mod mirrored;
pub mod profisafe;

pub use answer::{Answer, LONGEST_FRAME};
pub use division::{frame_digest, parameter_signature};

/// What became of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Outcome {
    /// No answer: nothing new, or nothing to say.
    Nothing,
    /// The buffer holds an answer to send.
    Answered,
    /// The image has a length that fits no frame; it was not looked at.
    WrongLength,
}

/// Why a slave cannot be created.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfigFault {
    /// FSoE: 1, or even and at most 126 octets. PROFIsafe: at most 12.
    OutputLength,
    /// FSoE: 1, or even and at most 126 octets. PROFIsafe: at most 12.
    InputLength,
    /// An FSoE slave needs an address from 1 to 65,535 (AMK-ADDR-05).
    Address,
    /// More than [`fsoe::MOST_APPLICATION_PARAMETERS`] octets.
    ApplicationParameters,
}

/// The protocol of a slave and what it needs.
#[derive(Clone, Copy, Debug)]
pub enum Config<'a> {
    /// FSoE slave.
    Fsoe(fsoe::Config<'a>),
    /// PROFIsafe F-Device.
    Profisafe(profisafe::Config<'a>),
}

/// A slave of either protocol.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no allocation to box it with")]
pub enum Slave {
    /// FSoE slave.
    Fsoe(fsoe::Slave),
    /// PROFIsafe F-Device.
    Profisafe(profisafe::Device),
}

impl Slave {
    /// A slave before its first frame.
    ///
    /// # Errors
    /// A length or address that the protocol does not know. Refused
    /// F-parameters are no error here: that slave stays silent.
    pub fn new(config: &Config<'_>) -> Result<Self, ConfigFault> {
        match config {
            Config::Fsoe(config) => fsoe::Slave::new(config).map(Self::Fsoe),
            Config::Profisafe(config) => profisafe::Device::new(config).map(Self::Profisafe),
        }
    }

    /// Takes the image of the partner's frame at `now_ns`, a time that never
    /// runs backwards, in nanoseconds, and writes the answer into the buffer.
    /// `inputs` are the process data to send; `None` means that the application
    /// is not enabled and sends fail-safe zeros.
    pub fn receive(
        &mut self,
        image: &[u8],
        now_ns: u64,
        inputs: Option<&[u8]>,
        answer: &mut Answer,
    ) -> Outcome {
        match self {
            Self::Fsoe(slave) => slave.receive(image, now_ns, inputs, answer),
            Self::Profisafe(device) => device.receive(image, now_ns, inputs, answer),
        }
    }

    /// Lets time pass; writes an unsolicited frame when the watchdog expires.
    pub fn advance(&mut self, now_ns: u64, answer: &mut Answer) -> Outcome {
        match self {
            Self::Fsoe(slave) => slave.advance(now_ns, answer),
            Self::Profisafe(device) => device.advance(now_ns, answer),
        }
    }

    /// Process data received, or all zeros (DEC-18).
    #[must_use]
    pub fn outputs(&self) -> &[u8] {
        match self {
            Self::Fsoe(slave) => slave.outputs(),
            Self::Profisafe(device) => device.outputs(),
        }
    }

    /// Whether [`outputs`](Self::outputs) are process data (DEC-16).
    #[must_use]
    pub fn has_process_data(&self) -> bool {
        match self {
            Self::Fsoe(slave) => slave.has_process_data(),
            Self::Profisafe(device) => device.has_process_data(),
        }
    }

    /// CRC-32 of the last frame processed; 0 before the first.
    #[must_use]
    pub fn digest(&self) -> u32 {
        match self {
            Self::Fsoe(slave) => slave.digest(),
            Self::Profisafe(device) => device.digest(),
        }
    }

    /// How often remembered values disagreed with their complement.
    #[must_use]
    pub fn integrity_faults(&self) -> u32 {
        match self {
            Self::Fsoe(slave) => slave.integrity_faults(),
            Self::Profisafe(device) => device.integrity_faults(),
        }
    }
}
