//! PROFIsafe F-Device, basic protocol V2 with 3-octet CRC2 (DEC-34).
//!
//! The state table is a reconstruction (black-channel.md 8.3, mark M): the bit
//! definitions, the host's rows and a capture close a loop without
//! contradiction, the device's own table is not public.

mod parameters;
mod pdu;
#[cfg(test)]
mod tests;

pub use parameters::{FParameterFault, FParameters};

use super::ConfigFault;
use super::answer::{Answer, Data, Image, LengthFault};
use parameters::Demand;
use pdu::{Number, Received, control, status};

const NANOSECONDS_PER_MILLISECOND: u64 = 1_000_000;

/// How an internal fault of the device shows on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceFaultReport {
    /// By `Device_Fault` in the status octet.
    StatusBit,
    /// By silence: the bit stays 0, communication stops (ATV-PSF-10).
    Silence,
}

/// What an F-Device is built from.
#[derive(Clone, Copy, Debug)]
pub struct ProfisafeConfig<'a> {
    /// Data octets from the host, 0 to 12 (Lenze 4, ATV 2).
    pub output_length: u8,
    /// Data octets to the host, 0 to 12 (Lenze 4, ATV 2).
    pub input_length: u8,
    /// Own address, 1 to 65534; `F_Dest_Add` has to be equal (address type 1).
    pub address: u16,
    /// The F-parameter block as received, `F_Par_CRC` at its end.
    pub f_parameters: &'a [u8],
    /// Sum over the device's iParameters; `None` when it has none.
    pub ipar_crc: Option<u32>,
    /// Lowest acceptable `F_WD_Time` in milliseconds (Lenze 110).
    pub lowest_watchdog_ms: u16,
    /// How an internal fault shows.
    pub device_fault: DeviceFaultReport,
}

/// State of the communication, for display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Communication {
    /// The F-parameters are refused: no communication, passivated.
    Refused(FParameterFault),
    /// Waiting for the first frame of the host.
    Waiting,
    /// Frames are exchanged, values are fail-safe.
    FailSafe,
    /// Process values are exchanged.
    DataExchange,
}

/// PROFIsafe F-Device of one channel.
// Each flag is one bit of the protocol; an enum would hide the table of 8.3.
#[allow(clippy::struct_excessive_bools)]
#[derive(Clone, Debug)]
pub struct FDevice {
    output_length: u8,
    input_length: u8,
    report: DeviceFaultReport,
    crc1: u16,
    watchdog_ns: u64,
    refusal: Option<FParameterFault>,
    image: Image,
    /// A frame of the host has been accepted since start-up.
    started: bool,
    number: Number,
    toggle: bool,
    number_was_reset: bool,
    crc_fault: bool,
    watchdog_fault: bool,
    device_fault: bool,
    activate_fv: bool,
    operator_request: bool,
    /// Start of the running timer, in nanoseconds; `None` when stopped.
    timer_start_ns: Option<u64>,
    received: Data,
    outputs: Data,
}

impl FDevice {
    /// A device that waits for its first frame, or refuses its F-parameters:
    /// then it stays passivated and silent (black-channel.md 8.1).
    ///
    /// # Errors
    /// The first value of the configuration that lies outside its range.
    pub fn new(config: &ProfisafeConfig) -> Result<Self, ConfigFault> {
        if config.output_length > pdu::MAX_DATA {
            return Err(ConfigFault::OutputLength);
        }
        if config.input_length > pdu::MAX_DATA {
            return Err(ConfigFault::InputLength);
        }
        if matches!(config.address, 0 | u16::MAX) {
            return Err(ConfigFault::Address);
        }
        let block = FParameters::parse(config.f_parameters).ok_or(ConfigFault::FParameterLength)?;
        let zeros = Data::zeros(usize::from(config.output_length));
        Ok(Self {
            output_length: config.output_length,
            input_length: config.input_length,
            report: config.device_fault,
            crc1: block.crc1,
            watchdog_ns: u64::from(block.watchdog_ms).saturating_mul(NANOSECONDS_PER_MILLISECOND),
            refusal: block.fault(&Demand {
                address: config.address,
                ipar_crc: config.ipar_crc,
                lowest_watchdog_ms: config.lowest_watchdog_ms,
            }),
            image: Image::none(),
            started: false,
            number: Number::RESET,
            toggle: false,
            number_was_reset: false,
            crc_fault: false,
            watchdog_fault: false,
            device_fault: false,
            activate_fv: true,
            operator_request: false,
            timer_start_ns: None,
            received: zeros,
            outputs: zeros,
        })
    }

    /// One process image of the host's PDU at `now_ns`; see
    /// [`super::Slave::frame`].
    ///
    /// # Errors
    /// The length fits no PDU of this device; nothing has changed.
    pub fn frame(
        &mut self,
        octets: &[u8],
        process_data: Option<&[u8]>,
        now_ns: u64,
    ) -> Result<Option<Answer>, LengthFault> {
        let received = Received::parse(octets, self.output_length).ok_or(LengthFault {
            expected: usize::from(self.output_length).saturating_add(pdu::TRAILER),
            received: octets.len(),
        })?;
        let changed = self.image.renew(octets);
        let empty = octets.iter().all(|octet| *octet == 0);
        // 8.3: the bus has started, the host has not.
        let before_start = empty && !self.started;
        if changed && !before_start {
            self.image.count(octets);
        }
        let late = self.advance(now_ns);
        if !changed {
            return Ok(late);
        }
        if before_start || self.is_silent() {
            return Ok(None);
        }
        self.judge(&received, now_ns);
        Ok(Some(self.status_pdu(process_data)))
    }

    /// Lets time pass to `now_ns`; returns the unsolicited status PDU of an
    /// expired watchdog. A clock that runs backwards counts as expired.
    pub fn advance(&mut self, now_ns: u64) -> Option<Answer> {
        let start_ns = self.timer_start_ns?;
        let running = now_ns.checked_sub(start_ns).is_some_and(|elapsed_ns| elapsed_ns < self.watchdog_ns);
        if running {
            return None;
        }
        self.timer_start_ns = None;
        self.watchdog_fault = true;
        self.select_outputs();
        if self.is_silent() {
            return None;
        }
        Some(self.status_pdu(None))
    }

    /// Sets or clears the internal fault; the outputs follow at once.
    pub fn set_device_fault(&mut self, present: bool) {
        self.device_fault = present;
        self.select_outputs();
    }

    fn is_silent(&self) -> bool {
        let stopped = self.device_fault && self.report == DeviceFaultReport::Silence;
        self.refusal.is_some() || stopped
    }

    /// The table of black-channel.md 8.3, mark M.
    fn judge(&mut self, received: &Received, now_ns: u64) {
        let edge = self.is_edge(received);
        let number = self.candidate(received, edge);
        if received.carries(self.crc1, number) {
            if edge {
                self.take_over(received, number, now_ns);
            }
            let length = usize::from(self.output_length);
            self.received = Data::from_octets(length, received.data.iter().copied());
        } else {
            // Passivate at once; a tolerated first error is mark L.
            self.crc_fault = true;
        }
        self.select_outputs();
    }

    /// The toggle alone shows no edge after a rejected frame, because the host
    /// toggles back. The first frame always starts cyclic operation (8.1).
    fn is_edge(&self, received: &Received) -> bool {
        let toggled = received.has(control::TOGGLE) != self.toggle;
        let reset = received.has(control::RESET_NUMBER) && !self.number_was_reset;
        toggled || reset || !self.started
    }

    fn candidate(&self, received: &Received, edge: bool) -> Number {
        let restart = received.has(control::RESET_NUMBER) || !self.started;
        match (edge, restart) {
            (false, _) => self.number,
            (true, true) => Number::RESET,
            (true, false) => self.number.following(),
        }
    }

    fn take_over(&mut self, received: &Received, number: Number, now_ns: u64) {
        let restart = received.has(control::RESET_NUMBER) || !self.started;
        if restart {
            self.crc_fault = false;
            self.watchdog_fault = false;
        }
        self.started = true;
        self.number = number;
        self.toggle = received.has(control::TOGGLE);
        self.number_was_reset = received.has(control::RESET_NUMBER);
        self.activate_fv = received.has(control::ACTIVATE_FV);
        self.operator_request = received.has(control::OPERATOR_REQUEST);
        self.timer_start_ns = Some(now_ns);
    }

    fn is_passivated(&self) -> bool {
        let communication = self.crc_fault || self.watchdog_fault;
        let commanded = self.activate_fv || self.number == Number::RESET;
        communication || commanded || self.device_fault
    }

    fn select_outputs(&mut self) {
        self.outputs =
            if self.is_passivated() { Data::zeros(usize::from(self.output_length)) } else { self.received };
    }

    /// Inputs are zero and `FV_activated` is set whenever outputs or inputs
    /// are fail-safe. `iPar_OK` stays 0 (iParameter server: mark L).
    fn status_pdu(&self, process_data: Option<&[u8]>) -> Answer {
        let length = usize::from(self.input_length);
        let inputs = process_data.filter(|inputs| inputs.len() == length).filter(|_| !self.is_passivated());
        let octet = [
            (self.reports_device_fault(), status::DEVICE_FAULT),
            (self.crc_fault, status::CRC_FAULT),
            (self.watchdog_fault, status::WATCHDOG),
            (inputs.is_none(), status::FV_ACTIVATED),
            (self.toggle, status::TOGGLE),
            (self.number_was_reset, status::NUMBER_RESET),
        ]
        .iter()
        .filter(|(set, _)| *set)
        .fold(0, |octet, (_, bit)| octet | bit);
        let octets = inputs.unwrap_or(&[]).iter().copied();
        let data = Data::from_octets(length, octets);
        pdu::seal(self.crc1, self.number, octet, data.octets())
    }

    fn reports_device_fault(&self) -> bool {
        self.device_fault && self.report == DeviceFaultReport::StatusBit
    }

    /// Safe outputs; zeros while fail-safe (DEC-18, LNZ-BUS-20).
    #[must_use]
    pub fn outputs(&self) -> &[u8] {
        self.outputs.octets()
    }

    /// Whether the outputs are process values of the host.
    #[must_use]
    pub fn outputs_valid(&self) -> bool {
        !self.is_passivated()
    }

    /// Digest of the last process image, 0 before the first.
    #[must_use]
    pub const fn digest(&self) -> u32 {
        self.image.digest()
    }

    /// Whether the host asks for an operator acknowledgement (`OA_Req`).
    #[must_use]
    pub const fn operator_acknowledgement_requested(&self) -> bool {
        self.operator_request
    }

    /// Code for the diagnosis of a disturbed communication: 4E watchdog, 4D
    /// CRC2 (black-channel.md 8.2); `None` without a fault.
    #[must_use]
    pub const fn communication_fault_code(&self) -> Option<u8> {
        match (self.watchdog_fault, self.crc_fault) {
            (true, _) => Some(0x4E),
            (false, true) => Some(0x4D),
            (false, false) => None,
        }
    }

    /// State of the communication.
    #[must_use]
    pub fn communication(&self) -> Communication {
        match (self.refusal, self.started, self.is_passivated()) {
            (Some(fault), _, _) => Communication::Refused(fault),
            (None, false, _) => Communication::Waiting,
            (None, true, true) => Communication::FailSafe,
            (None, true, false) => Communication::DataExchange,
        }
    }
}
