//! SafePara: judged octet by octet as it arrives (black-channel.md 2.6, 3.4).

use super::super::ConfigFault;
use super::fault::ResetCode;

/// Most application parameter octets a slave can expect.
pub const MAX_APPLICATION_PARAMETERS: usize = 1024;
/// Both lengths and the watchdog time.
const HEADER: usize = 6;

/// What the parameters have to be.
#[derive(Clone, Debug)]
pub(super) struct Expected {
    application: [u8; MAX_APPLICATION_PARAMETERS],
    length: u16,
    watchdog_ms: (u16, u16),
}

impl Expected {
    pub(super) fn new(application: &[u8], watchdog_ms: (u16, u16)) -> Result<Self, ConfigFault> {
        if application.len() > MAX_APPLICATION_PARAMETERS {
            return Err(ConfigFault::ApplicationParameterLength);
        }
        let (lowest, highest) = watchdog_ms;
        if lowest == 0 || lowest > highest {
            return Err(ConfigFault::WatchdogLimits);
        }
        let mut octets = [0; MAX_APPLICATION_PARAMETERS];
        for (place, octet) in octets.iter_mut().zip(application) {
            *place = *octet;
        }
        Ok(Self { application: octets, length: application.len() as u16, watchdog_ms })
    }

    /// Octets of the whole payload.
    pub(super) fn payload(&self) -> usize {
        usize::from(self.length).saturating_add(HEADER)
    }
}

/// What has been received of the parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Collected {
    header: [u8; HEADER],
    position: usize,
    application_differs: bool,
}

impl Collected {
    pub(super) const NOTHING: Self = Self { header: [0; HEADER], position: 0, application_differs: false };

    pub(super) fn add(&mut self, octets: &[u8], expected: &Expected) {
        for octet in octets {
            self.add_octet(*octet, expected);
            self.position = self.position.saturating_add(1);
        }
    }

    fn add_octet(&mut self, octet: u8, expected: &Expected) {
        if let Some(place) = self.header.get_mut(self.position) {
            *place = octet;
            return;
        }
        let index = self.position.saturating_sub(HEADER);
        self.application_differs |= expected.application.get(index) != Some(&octet);
    }

    /// Watchdog time in milliseconds as received.
    pub(super) const fn watchdog_ms(&self) -> u16 {
        let [_, _, low, high, _, _] = self.header;
        u16::from_le_bytes([low, high])
    }

    /// Content faults in the order of black-channel.md 3.4.
    pub(super) fn fault(&self, expected: &Expected) -> Option<ResetCode> {
        let [low, high, _, _, app_low, app_high] = self.header;
        let (lowest, highest) = expected.watchdog_ms;
        if u16::from_le_bytes([low, high]) != 2 {
            Some(ResetCode::InvalidCommunicationParameterLength)
        } else if !(lowest..=highest).contains(&self.watchdog_ms()) {
            Some(ResetCode::InvalidCommunicationParameter)
        } else if u16::from_le_bytes([app_low, app_high]) != expected.length {
            Some(ResetCode::InvalidApplicationParameterLength)
        } else if self.application_differs {
            Some(ResetCode::InvalidApplicationParameter)
        } else {
            None
        }
    }
}
