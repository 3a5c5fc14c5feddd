//! Test masters of the black channel, and the bad bus between them and a slave.
//!
//! Written from `black-channel.md` alone, by somebody who has not seen the slaves: what a
//! slave answers is judged by this folder, so it must take nothing from them. Pure and in
//! virtual time; nothing here waits, and nothing here is random but by its seed.
//!
//! - [`fsoe`]: FSoE master (section 3.8)
//! - [`profisafe`]: PROFIsafe F-Host, basic protocol V2 (section 8.4)
//! - [`disturbance`]: corruption, repetition, loss, insertion, wrong order, delay, masquerade

pub mod disturbance;
pub mod fsoe;
pub mod profisafe;

/// What a bus needs of whoever commands on it, in either protocol.
pub trait Master: std::fmt::Debug {
    /// The frame on the bus now.
    fn to_send(&self) -> &[u8];
    /// Takes the device's image.
    fn receive(&mut self, image: &[u8], now_ns: u64);
    /// Lets time pass.
    fn advance(&mut self, now_ns: u64);
    /// Process data for the device.
    fn set_outputs(&mut self, outputs: &[u8]);
    /// The device's process data; `None` stands for fail-safe values.
    fn inputs(&self) -> Option<&[u8]>;
    /// What an operator who is always at hand does between two cycles.
    fn operate(&mut self) {}
}

impl Master for fsoe::Master {
    fn to_send(&self) -> &[u8] {
        self.to_send()
    }

    fn receive(&mut self, image: &[u8], now_ns: u64) {
        self.receive(image, now_ns);
    }

    fn advance(&mut self, now_ns: u64) {
        self.advance(now_ns);
    }

    fn set_outputs(&mut self, outputs: &[u8]) {
        self.set_outputs(Some(outputs));
    }

    fn inputs(&self) -> Option<&[u8]> {
        self.inputs()
    }
}

impl Master for profisafe::Host {
    fn to_send(&self) -> &[u8] {
        self.to_send()
    }

    fn receive(&mut self, image: &[u8], now_ns: u64) {
        self.receive(image, now_ns);
    }

    fn advance(&mut self, now_ns: u64) {
        self.advance(now_ns);
    }

    fn set_outputs(&mut self, outputs: &[u8]) {
        self.set_outputs(outputs);
    }

    fn inputs(&self) -> Option<&[u8]> {
        self.inputs()
    }

    /// Acknowledges whenever asked, each time by an edge.
    fn operate(&mut self) {
        let wanted = self.wants_acknowledge();
        self.set_acknowledge(false);
        self.set_acknowledge(wanted);
    }
}

/// Nanoseconds in a millisecond: watchdogs are given in the one, time passes in the other.
const NS_PER_MS: u64 = 1_000_000;
