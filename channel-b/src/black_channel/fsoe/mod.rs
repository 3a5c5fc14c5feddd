//! FSoE slave (IEC 61784-3-12 by way of black-channel sections 2 and 3).
//!
//! Each frame is judged as a whole against everything remembered, and answers
//! with a new memory and a new frame; nothing is changed in between.

mod check;
mod frame;
mod memory;
mod steps;
mod verdict;

#[cfg(test)]
pub(crate) mod tests;

use super::answer::{Answer, LastImage};
use super::division::frame_digest;
use super::mirrored::{Mirrored, MirroredOctets};
use super::{ConfigFault, Outcome};
use frame::{DataSize, Frame, LARGEST_DATA};
use memory::Memory;
pub use verdict::{ResetCode, State};

/// Most octets of application parameters that a slave can expect.
pub const MOST_APPLICATION_PARAMETERS: usize = 1024;

/// What an FSoE slave is created from.
#[derive(Clone, Copy, Debug)]
pub struct Config<'a> {
    /// Safe data octets from the master: 1, or even and at most 126.
    pub outputs: usize,
    /// Safe data octets to the master: 1, or even and at most 126.
    pub inputs: usize,
    /// Own FSoE address, 1 to 65,535 (AMK-ADDR-05: 0 cannot communicate).
    pub address: u16,
    /// Id of the first session. Must differ after each power cycle
    /// (black-channel 3.9); each later session uses the next number.
    pub session_id: u16,
    /// The application parameters that the master must send, octet for octet.
    pub application_parameters: &'a [u8],
    /// Shortest and longest watchdog time to accept, in milliseconds; 0 is
    /// refused whatever these say.
    pub watchdog_ms: (u16, u16),
}

/// FSoE slave of one connection.
#[derive(Clone, Copy, Debug)]
pub struct Slave {
    memory: Mirrored<Memory, 6>,
    outputs: MirroredOctets<LARGEST_DATA>,
    output_size: DataSize,
    input_size: DataSize,
    address: u16,
    watchdog_ms: (u16, u16),
    application_parameters: [u8; MOST_APPLICATION_PARAMETERS],
    application_length: u16,
    last_image: LastImage,
    digest: u32,
    last_reset: Option<ResetCode>,
    integrity_faults: u32,
}

impl Slave {
    /// A slave in state Reset that has sent nothing yet.
    ///
    /// # Errors
    /// A size that no frame carries, address 0, or too many application
    /// parameters.
    pub fn new(config: &Config<'_>) -> Result<Self, ConfigFault> {
        let output_size = DataSize::new(config.outputs).ok_or(ConfigFault::OutputLength)?;
        let input_size = DataSize::new(config.inputs).ok_or(ConfigFault::InputLength)?;
        if config.address == 0 {
            return Err(ConfigFault::Address);
        }
        let expected = config.application_parameters;
        if expected.len() > MOST_APPLICATION_PARAMETERS {
            return Err(ConfigFault::ApplicationParameters);
        }
        let mut application_parameters = [0; MOST_APPLICATION_PARAMETERS];
        application_parameters.iter_mut().zip(expected).for_each(|(to, from)| *to = *from);
        Ok(Self {
            memory: Mirrored::new(Memory::reset(config.session_id)),
            outputs: MirroredOctets::zeros(),
            output_size,
            input_size,
            address: config.address,
            watchdog_ms: config.watchdog_ms,
            application_parameters,
            application_length: expected.len() as u16,
            last_image: LastImage::untouched(),
            digest: 0,
            last_reset: None,
            integrity_faults: 0,
        })
    }

    /// Takes the process image of the master's frame at `now_ns` and writes the
    /// answer, if there is one. `inputs` are the safe inputs to send; `None`, or
    /// another length than configured, sends fail-safe data.
    pub fn receive(
        &mut self,
        image: &[u8],
        now_ns: u64,
        inputs: Option<&[u8]>,
        answer: &mut Answer,
    ) -> Outcome {
        answer.clear();
        let Some(frame) = Frame::parse(image, self.output_size) else {
            return Outcome::WrongLength;
        };
        let Some(memory) = self.memory.read() else {
            return self.recover(answer);
        };
        let is_new = self.last_image.replace(image);
        // A frame that is right but late finds the connection gone.
        let outcome = if memory.has_expired(now_ns) {
            self.refuse(memory, ResetCode::WatchdogExpired, answer)
        } else if is_new {
            self.process(memory, &frame, now_ns, inputs, answer)
        } else {
            Outcome::Nothing
        };
        // 3.2: an image that is ignored is no frame processed.
        if is_new & (outcome == Outcome::Answered) {
            self.digest = frame_digest(image);
        }
        outcome
    }

    /// Lets time pass without a frame: writes Reset(5) once the watchdog has
    /// expired.
    pub fn advance(&mut self, now_ns: u64, answer: &mut Answer) -> Outcome {
        answer.clear();
        match self.memory.read() {
            None => self.recover(answer),
            Some(memory) if memory.has_expired(now_ns) => {
                self.refuse(memory, ResetCode::WatchdogExpired, answer)
            }
            Some(_) => Outcome::Nothing,
        }
    }

    /// Ends the connection by the application's wish (black-channel 3.7).
    pub fn local_reset(&mut self, answer: &mut Answer) -> Outcome {
        match self.memory.read() {
            None => self.recover(answer),
            Some(memory) => self.refuse(memory, ResetCode::LocalReset, answer),
        }
    }

    /// Process data from the master; all zeros, the fail-safe values, whenever
    /// they are not certain (DEC-18).
    #[must_use]
    pub fn outputs(&self) -> &[u8] {
        const ZEROS: [u8; LARGEST_DATA] = [0; LARGEST_DATA];
        let length = self.output_size.octets();
        let believed = self.outputs.read(length).filter(|_| self.has_process_data());
        believed.or_else(|| ZEROS.get(..length)).unwrap_or(&[])
    }

    /// Whether [`outputs`](Self::outputs) are process data of a standing
    /// connection. Edges count only while this has been true throughout (DEC-16).
    #[must_use]
    pub fn has_process_data(&self) -> bool {
        self.memory.read().is_some_and(|memory| memory.has_process_data)
    }

    /// State of the connection; Reset when the memory cannot be trusted.
    #[must_use]
    pub fn state(&self) -> State {
        self.memory.read().map_or(State::Reset, |memory| memory.state)
    }

    /// Own id of the present session; 0 without one.
    #[must_use]
    pub fn session_id(&self) -> u16 {
        self.memory.read().map_or(0, |memory| memory.session_id)
    }

    /// Sets the id that the next session will use (the other channel's, which
    /// is the one on the wire).
    pub fn set_next_session_id(&mut self, session_id: u16) {
        if let Some(memory) = self.memory.read() {
            self.memory = Mirrored::new(Memory { next_session_id: session_id, ..memory });
        }
    }

    /// CRC-32 of the last frame processed; 0 before the first.
    #[must_use]
    pub const fn digest(&self) -> u32 {
        self.digest
    }

    /// Why the connection was last reset, until it is established again.
    #[must_use]
    pub const fn last_reset(&self) -> Option<ResetCode> {
        self.last_reset
    }

    /// How often remembered values disagreed with their complement.
    #[must_use]
    pub const fn integrity_faults(&self) -> u32 {
        self.integrity_faults
    }
}
