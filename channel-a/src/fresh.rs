//! How old is what the cells say: time stamp against the own clock (DEC-18, DEC-26).

use shm_schema::exchange::{RELAXED_AGE_FACTOR, Received, Sampled};

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

/// How much later than in the strict timing everything may come: `Setup::age_factor`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience(u8);

impl Patience {
    /// 1 is the strict timing; more than the relaxed one is none of ours.
    pub fn new(age_factor: u8) -> Self {
        Self(age_factor.clamp(1, RELAXED_AGE_FACTOR))
    }

    /// As many cycles as `strict` stands for.
    pub fn cycles(self, strict: u8) -> u16 {
        u16::from(strict).saturating_mul(u16::from(self.0))
    }

    /// The time that `strict_ns` stands for.
    pub fn time_ns(self, strict_ns: u64) -> u64 {
        strict_ns.saturating_mul(u64::from(self.0))
    }
}

/// Counts the cycles in which something did not advance.
#[derive(Debug, Clone, Copy)]
pub struct Missed {
    last: u64,
    cycles: u16,
    most: u16,
}

impl Missed {
    /// Cycles after which a partner is lost (DEC-23), in the strict timing.
    pub const LOST: u8 = 3;

    /// Nothing missed yet.
    pub fn new(patience: Patience) -> Self {
        Self { last: 0, cycles: 0, most: patience.cycles(Self::LOST) }
    }

    /// One cycle with what was read.
    pub fn step(&mut self, sequence: Option<u64>) -> bool {
        let news = sequence.filter(|sequence| *sequence != self.last);
        self.last = news.unwrap_or(self.last);
        self.count(news.is_some())
    }

    /// One cycle in which what was waited for came, or did not.
    pub fn count(&mut self, came: bool) -> bool {
        self.cycles = if came { 0 } else { self.cycles.saturating_add(1) };
        self.cycles >= self.most
    }
}
