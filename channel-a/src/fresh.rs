//! How old is what the cells say: time stamp against the own clock (DEC-18, DEC-26).

use shm_schema::exchange::{Received, Sampled};

/// The last valid content of a cell and its age.
#[derive(Debug, Clone, Copy)]
pub struct Fresh<T> {
    last: Option<Sampled<T>>,
    /// This step brought a new sample.
    pub advanced: bool,
}

impl<T: Copy> Fresh<T> {
    /// Nothing seen.
    pub const fn new() -> Self {
        Self { last: None, advanced: false }
    }

    /// Takes what this step read.
    pub fn take(&mut self, received: &Received<T>) {
        self.advanced = false;
        if let Ok(sample) = received {
            let newer = self.last.as_ref().is_none_or(|last| sample.sequence > last.sequence);
            if newer {
                self.last = Some(*sample);
                self.advanced = true;
            }
        }
    }

    /// The last content, as long as it is younger than `stale_ns` and not from the future
    /// by more than `cycle_ns`.
    pub fn current(&self, now_ns: u64, stale_ns: u64, cycle_ns: u64) -> Option<&Sampled<T>> {
        let last = self.last.as_ref()?;
        let stale = now_ns.saturating_sub(last.timestamp_ns) >= stale_ns;
        let future = last.timestamp_ns.saturating_sub(now_ns) > cycle_ns;
        (!(stale | future)).then_some(last)
    }

    /// The last content, however old.
    pub const fn last(&self) -> Option<&Sampled<T>> {
        self.last.as_ref()
    }
}

/// Counts the cycles in which something did not advance.
#[derive(Debug, Clone, Copy, Default)]
pub struct Missed {
    last: u64,
    cycles: u8,
}

impl Missed {
    /// Cycles after which a partner is lost (DEC-23).
    pub const LOST: u8 = 3;

    /// One cycle with what was read.
    pub fn step(&mut self, sequence: Option<u64>) -> bool {
        match sequence {
            Some(sequence) if sequence != self.last => {
                self.last = sequence;
                self.cycles = 0;
            }
            _ => self.cycles = self.cycles.saturating_add(1),
        }
        self.cycles >= Self::LOST
    }
}
