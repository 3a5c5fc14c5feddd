//! The black-channel slaves of one channel, or of both with split frames, as one device.
//!
//! Split: command, data and connection id come from A, the check sums from B, and a frame
//! leaves only when both processed the same image and both answer (design 9).

use channel_a::black_channel as a;
use channel_b::black_channel as b;
use shm_schema::profile::Profile;

/// Whose answer is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Source {
    /// Channel A alone.
    A,
    /// Channel B alone.
    B,
    /// Data of A, check sums of B.
    Split,
}

/// The protocol on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Protocol {
    /// FSoE slave.
    Fsoe,
    /// PROFIsafe F-Device, basic protocol V2, three octets of CRC2.
    Profisafe,
}

/// What a device is built from.
#[derive(Debug, Clone)]
pub struct Shape {
    /// Protocol.
    pub protocol: Protocol,
    /// Octets from the master.
    pub outputs: u8,
    /// Octets to the master.
    pub inputs: u8,
    /// Own address.
    pub address: u16,
    /// Id of the first session.
    pub session_id: u16,
    /// Application parameters expected from an FSoE master.
    pub application_parameters: Vec<u8>,
    /// F-parameter block of a PROFIsafe host.
    pub f_parameters: Vec<u8>,
}

/// Octets from and to the master as the profile's telegram has them.
pub const fn telegram(profile: Profile) -> (u8, u8) {
    match profile {
        Profile::AmkKw => (4, 12),
        Profile::Atv340 => (2, 2),
        _ => (4, 4),
    }
}

/// An image no frame of this device has the length of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WrongLength;

/// One or both slaves.
pub struct Device {
    a: Option<a::Slave>,
    b: Option<b::Slave>,
}

impl Device {
    /// A device before its first frame.
    ///
    /// # Errors
    /// What of the shape no protocol allows.
    pub fn new(shape: &Shape, source: Source) -> Result<Self, String> {
        let fault = |fault: &dyn std::fmt::Debug| format!("a value that no device can have: {fault:?}");
        let a = match source {
            Source::B => None,
            _ => Some(a::Slave::new(&config_a(shape)).map_err(|f| fault(&f))?),
        };
        let b = match source {
            Source::A => None,
            _ => Some(b::Slave::new(&config_b(shape)).map_err(|f| fault(&f))?),
        };
        Ok(Self { a, b })
    }

    /// Takes one image; returns the answer, if it makes one.
    ///
    /// # Errors
    /// The length fits no frame; nothing has changed.
    pub fn receive(
        &mut self,
        image: &[u8],
        inputs: Option<&[u8]>,
        now_ns: u64,
    ) -> Result<Option<Vec<u8>>, WrongLength> {
        let from_a = match &mut self.a {
            Some(slave) => slave.frame(image, inputs, now_ns).map_err(|_| WrongLength)?,
            None => None,
        };
        let mut buffer = b::Answer::empty();
        let from_b = match &mut self.b {
            Some(slave) => match slave.receive(image, now_ns, inputs, &mut buffer) {
                b::Outcome::WrongLength => return Err(WrongLength),
                b::Outcome::Answered => Some(buffer),
                b::Outcome::Nothing => None,
            },
            None => None,
        };
        Ok(self.merge(from_a, from_b))
    }

    /// Lets time pass; returns the unsolicited frame of an expired watchdog.
    pub fn advance(&mut self, now_ns: u64) -> Option<Vec<u8>> {
        let from_a = self.a.as_mut().and_then(|slave| slave.advance(now_ns));
        let mut buffer = b::Answer::empty();
        let answered = |slave: &mut b::Slave| slave.advance(now_ns, &mut buffer) == b::Outcome::Answered;
        let from_b = self.b.as_mut().is_some_and(answered).then_some(buffer);
        self.merge(from_a, from_b)
    }

    fn merge(&self, from_a: Option<a::Answer>, from_b: Option<b::Answer>) -> Option<Vec<u8>> {
        match (&self.a, &self.b) {
            (Some(a), Some(b)) => {
                let (from_a, from_b) = (from_a?, from_b?);
                let same = a.digest() == b.digest();
                let merged = from_b.with_data_of(from_a.octets()).filter(|_| same)?;
                Some(merged.octets().to_vec())
            }
            (Some(_), None) => from_a.map(|answer| answer.octets().to_vec()),
            _ => from_b.map(|answer| answer.octets().to_vec()),
        }
    }
}

fn config_a(shape: &Shape) -> a::Config<'_> {
    match shape.protocol {
        Protocol::Fsoe => a::Config::Fsoe(a::FsoeConfig {
            output_length: shape.outputs,
            input_length: shape.inputs,
            address: shape.address,
            session_id: shape.session_id,
            application_parameters: &shape.application_parameters,
            watchdog_ms: (1, u16::MAX),
        }),
        Protocol::Profisafe => a::Config::Profisafe(a::ProfisafeConfig {
            output_length: shape.outputs,
            input_length: shape.inputs,
            address: shape.address,
            f_parameters: &shape.f_parameters,
            ipar_crc: None,
            lowest_watchdog_ms: 1,
            device_fault: a::DeviceFaultReport::StatusBit,
        }),
    }
}

fn config_b(shape: &Shape) -> b::Config<'_> {
    match shape.protocol {
        Protocol::Fsoe => b::Config::Fsoe(b::fsoe::Config {
            outputs: shape.outputs.into(),
            inputs: shape.inputs.into(),
            address: shape.address,
            session_id: shape.session_id,
            application_parameters: &shape.application_parameters,
            watchdog_ms: (1, u16::MAX),
        }),
        Protocol::Profisafe => b::Config::Profisafe(b::profisafe::Config {
            outputs: shape.outputs.into(),
            inputs: shape.inputs.into(),
            address: shape.address,
            f_parameters: &shape.f_parameters,
        }),
    }
}
