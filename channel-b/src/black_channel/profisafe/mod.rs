//! PROFIsafe F-Device: basic protocol, V2, three octets of CRC2 (DEC-34).
//!
//! The state table is a reconstruction (mark M, black-channel 8.3): compatible
//! by vectors, not by test against the standard.

mod memory;
mod parameters;
mod telegram;

#[cfg(test)]
pub(crate) mod tests;

use super::answer::{Answer, LastImage};
use super::division::frame_digest;
use super::mirrored::{Mirrored, MirroredOctets};
use super::{ConfigFault, Outcome};
use memory::{Memory, Reception};
pub use parameters::ParameterFault;
use parameters::{FParameters, examine};
use telegram::{LARGEST_DATA, Telegram, compose};

/// What an F-Device is created from.
#[derive(Clone, Copy, Debug)]
pub struct Config<'a> {
    /// F-data octets from the host, 0 to 12 (Lenze 4, ATV 2).
    pub outputs: usize,
    /// F-data octets to the host, 0 to 12 (Lenze 4, ATV 2).
    pub inputs: usize,
    /// Own F-address, 1 to 65,534 (LNZ-ADDR-01, ATV `SC68`).
    pub address: u16,
    /// The F-parameter block as received from the host, CRC1 at its end.
    pub f_parameters: &'a [u8],
}

/// F-Device of one F-address.
#[derive(Clone, Copy, Debug)]
pub struct Device {
    memory: Mirrored<Memory, 3>,
    outputs: MirroredOctets<LARGEST_DATA>,
    output_length: usize,
    input_length: usize,
    parameters: Result<FParameters, ParameterFault>,
    last_image: LastImage,
    digest: u32,
    integrity_faults: u32,
}

impl Device {
    /// A passivated device that has sent nothing yet. One whose F-parameters are
    /// refused never answers; see [`parameter_fault`](Self::parameter_fault).
    ///
    /// # Errors
    /// More data octets than three octets of CRC2 protect.
    pub fn new(config: &Config<'_>) -> Result<Self, ConfigFault> {
        if config.outputs > LARGEST_DATA {
            return Err(ConfigFault::OutputLength);
        }
        if config.inputs > LARGEST_DATA {
            return Err(ConfigFault::InputLength);
        }
        Ok(Self {
            memory: Mirrored::new(Memory::START),
            outputs: MirroredOctets::zeros(),
            output_length: config.outputs,
            input_length: config.inputs,
            parameters: examine(config.f_parameters, config.address),
            last_image: LastImage::untouched(),
            digest: 0,
            integrity_faults: 0,
        })
    }

    /// Takes the process image of the host's telegram at `now_ns` and writes the
    /// answer, if there is one. `inputs` are the safe inputs to send; `None`, or
    /// another length than configured, sends fail-safe values.
    pub fn receive(
        &mut self,
        image: &[u8],
        now_ns: u64,
        inputs: Option<&[u8]>,
        answer: &mut Answer,
    ) -> Outcome {
        answer.clear();
        let Some(telegram) = Telegram::parse(image, self.output_length) else {
            return Outcome::WrongLength;
        };
        let Ok(parameters) = self.parameters else {
            return Outcome::Nothing;
        };
        let memory = self.trusted();
        let is_new = self.last_image.replace(image);
        let has_expired = memory.has_expired(now_ns, parameters.watchdog_ms);
        let memory = if has_expired { self.time_out(memory) } else { memory };
        let outcome = match (is_new, has_expired) {
            (false, false) => Outcome::Nothing,
            (false, true) => self.answer(memory, inputs, answer),
            (true, _) => self.process(memory, &telegram, now_ns, inputs, answer),
        };
        // 8.3: an image that is ignored before the start is no telegram processed.
        if is_new & (outcome == Outcome::Answered) {
            self.digest = frame_digest(image);
        }
        outcome
    }

    /// Lets time pass without a telegram: writes the passivated telegram once
    /// the watchdog has expired.
    pub fn advance(&mut self, now_ns: u64, answer: &mut Answer) -> Outcome {
        answer.clear();
        let Ok(parameters) = self.parameters else {
            return Outcome::Nothing;
        };
        let memory = self.trusted();
        if !memory.has_expired(now_ns, parameters.watchdog_ms) {
            return Outcome::Nothing;
        }
        let memory = self.time_out(memory);
        self.answer(memory, None, answer)
    }

    /// The present telegram once more with other inputs: between two numbers the
    /// data may change (black-channel 7.5). Nothing before the first telegram.
    pub fn refresh(&mut self, inputs: Option<&[u8]>, answer: &mut Answer) -> Outcome {
        answer.clear();
        let memory = self.trusted();
        if !memory.is_started {
            return Outcome::Nothing;
        }
        self.answer(memory, inputs, answer)
    }

    /// Raises or clears the fault of the device itself; it passivates. A profile
    /// that never reports it (ATV-PSF-10) stops answering instead.
    pub fn set_device_fault(&mut self, has_device_fault: bool) {
        let memory = self.trusted();
        self.memory = Mirrored::new(Memory { has_device_fault, ..memory });
    }

    /// Process values from the host; all zeros, the fail-safe values, whenever
    /// they are not certain (DEC-18, LNZ-BUS-20).
    #[must_use]
    pub fn outputs(&self) -> &[u8] {
        const ZEROS: [u8; LARGEST_DATA] = [0; LARGEST_DATA];
        let length = self.output_length;
        let believed = self.outputs.read(length).filter(|_| self.has_process_data());
        believed.or_else(|| ZEROS.get(..length)).unwrap_or(&[])
    }

    /// Whether [`outputs`](Self::outputs) are process values. Edges count only
    /// while this has been true throughout (DEC-16).
    #[must_use]
    pub fn has_process_data(&self) -> bool {
        self.memory.read().is_some_and(|memory| memory.uses_process_values())
    }

    /// Why the F-parameters were refused, if they were.
    #[must_use]
    pub fn parameter_fault(&self) -> Option<ParameterFault> {
        self.parameters.err()
    }

    /// The status octet that an answer would carry now if process values were
    /// sent: CE_CRC (Lenze message 34) is bit 2, WD_timeout (35) is bit 3.
    #[must_use]
    pub fn status(&self) -> u8 {
        let memory = self.memory.unchecked();
        memory.status(!self.has_process_data())
    }

    /// CRC-32 of the last telegram processed; 0 before the first.
    #[must_use]
    pub const fn digest(&self) -> u32 {
        self.digest
    }

    /// How often remembered values disagreed with their complement.
    #[must_use]
    pub const fn integrity_faults(&self) -> u32 {
        self.integrity_faults
    }

    /// The memory; when it and its complement have come apart, that of a start
    /// with a device fault, which only the application can clear.
    fn trusted(&mut self) -> Memory {
        if let Some(memory) = self.memory.read() {
            return memory;
        }
        self.integrity_faults = self.integrity_faults.saturating_add(1);
        self.outputs = MirroredOctets::zeros();
        let memory = Memory { has_device_fault: true, ..Memory::START };
        self.memory = Mirrored::new(memory);
        memory
    }

    fn time_out(&mut self, memory: Memory) -> Memory {
        let memory = memory.timed_out();
        self.outputs = MirroredOctets::zeros();
        self.memory = Mirrored::new(memory);
        memory
    }

    fn process(
        &mut self,
        memory: Memory,
        telegram: &Telegram<'_>,
        now_ns: u64,
        inputs: Option<&[u8]>,
        answer: &mut Answer,
    ) -> Outcome {
        let is_blank = self.last_image.is_blank();
        if is_blank && !memory.is_started {
            return Outcome::Nothing;
        }
        let reception = self.examine(&memory, telegram);
        let memory = memory.after(reception, telegram.control, now_ns);
        self.outputs = MirroredOctets::zeros();
        let is_corrupt = reception == Reception::Corrupt;
        // activate_FV counts as taken over on the last edge; a telegram without
        // one brings data only (black-channel 8.3), and the timer goes on.
        if !(is_corrupt || memory.host_wants_fail_safe) {
            self.outputs.store(telegram.data.iter().copied());
        }
        self.memory = Mirrored::new(memory);
        self.answer(memory, inputs, answer)
    }

    fn examine(&self, memory: &Memory, telegram: &Telegram<'_>) -> Reception {
        let (number, reception) = memory.candidate(telegram.control);
        let is_right = self.parameters.is_ok_and(|known| telegram.is_checked_by(known.check, number));
        if is_right { reception } else { Reception::Corrupt }
    }

    /// Writes the telegram that belongs to `memory`.
    fn answer(&self, memory: Memory, inputs: Option<&[u8]>, answer: &mut Answer) -> Outcome {
        let Ok(parameters) = self.parameters else {
            return Outcome::Nothing;
        };
        let inputs = inputs.filter(|inputs| inputs.len() == self.input_length);
        let inputs = inputs.filter(|_| memory.uses_process_values());
        let status = memory.status(inputs.is_none());
        let data = inputs.unwrap_or(&[]);
        compose(answer, (parameters.check, memory.number), status, data, self.input_length);
        Outcome::Answered
    }
}
