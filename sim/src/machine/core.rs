//! The three cores behind one interface, so that tests can put fakes in their place.

use shm_schema::exchange::{CrosscheckInputs, CrosscheckOutputs, Inputs, Outputs, Setup, Start};

/// A monitoring channel.
pub trait Channel {
    /// One cycle.
    fn step(&mut self, inputs: &Inputs, now_ns: u64) -> Outputs;
}

/// The cross-communication.
pub trait Referee {
    /// One cycle.
    fn step(&mut self, inputs: &CrosscheckInputs, now_ns: u64) -> CrosscheckOutputs;
}

impl Channel for channel_a::Monitor {
    #[inline]
    fn step(&mut self, inputs: &Inputs, now_ns: u64) -> Outputs {
        Self::step(self, inputs, now_ns)
    }
}

impl Channel for channel_b::Monitor {
    #[inline]
    fn step(&mut self, inputs: &Inputs, now_ns: u64) -> Outputs {
        Self::step(self, inputs, now_ns)
    }
}

impl Referee for crosscheck::Crosscheck {
    #[inline]
    fn step(&mut self, inputs: &CrosscheckInputs, now_ns: u64) -> CrosscheckOutputs {
        Self::step(self, inputs, now_ns)
    }
}

/// The cores of one axis.
#[derive(Debug)]
pub struct Cores<A, B, C> {
    /// Channel A.
    pub a: A,
    /// Channel B.
    pub b: B,
    /// Crosscheck.
    pub crosscheck: C,
}

impl Cores<channel_a::Monitor, channel_b::Monitor, crosscheck::Crosscheck> {
    /// The real cores on both images of a parameter set.
    pub fn of(set: &params::AxisSet, boot_nonce: u32, start: Start) -> Self {
        let setup = Setup::new(set.number, boot_nonce, start);
        let image_a = set.image_a(true);
        let limits = crosscheck::Limits::from_image(&image_a);
        Self {
            a: channel_a::Monitor::new(&image_a, &setup),
            b: channel_b::Monitor::new(&set.image_b(true), &setup),
            crosscheck: crosscheck::Crosscheck::new(&setup, &limits),
        }
    }
}
