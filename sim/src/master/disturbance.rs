//! The bad bus: everything that IEC 61784-3 lets happen to a frame, by seed.

use std::collections::VecDeque;

use crate::random::Random;

/// One kind of disturbance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// One to three bits of the frame change.
    Corruption,
    /// An old frame of this connection arrives again.
    Repetition,
    /// Nothing arrives, for a while that may outlast a watchdog.
    Loss,
    /// Octets that nobody sent arrive.
    Insertion,
    /// A frame arrives after the one sent after it.
    WrongOrder,
    /// Frames arrive, but later.
    Delay,
    /// The frame of another connection arrives in its place.
    Masquerade,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Corruption,
        Self::Repetition,
        Self::Loss,
        Self::Insertion,
        Self::WrongOrder,
        Self::Delay,
        Self::Masquerade,
    ];
}

/// Old frames kept for repetition.
const MEMORY: usize = 64;

/// One direction of a bus, one cycle at a time.
pub struct Line {
    random: Random,
    kinds: Vec<Kind>,
    once_in: i64,
    longest: i64,
    calm: bool,
    past: VecDeque<Vec<u8>>,
    /// Frames under way, each with the cycles it still needs.
    under_way: VecDeque<(i64, Vec<u8>)>,
    held_back: Option<Vec<u8>>,
    silent: i64,
    slow: i64,
    disturbed: u64,
}

impl Line {
    /// A line that disturbs one cycle `once_in` by one of `kinds`; loss and delay last up
    /// to `longest` cycles.
    pub fn new(seed: u64, kinds: &[Kind], once_in: i64, longest: i64) -> Self {
        Self {
            random: Random::new(seed),
            kinds: kinds.to_vec(),
            once_in,
            longest,
            calm: false,
            past: VecDeque::new(),
            under_way: VecDeque::new(),
            held_back: None,
            silent: 0,
            slow: 0,
            disturbed: 0,
        }
    }

    /// Ends all disturbance; what is under way still arrives.
    pub const fn set_calm(&mut self, calm: bool) {
        self.calm = calm;
    }

    /// Old frames are gone: none of them is repeated.
    pub fn forget(&mut self) {
        self.past.clear();
    }

    /// Cycles disturbed so far.
    pub const fn disturbed(&self) -> u64 {
        self.disturbed
    }

    /// One cycle: `image` goes in, what arrives comes out, in order. `foreign` is what
    /// another connection has on the bus.
    pub fn carry(&mut self, image: &[u8], foreign: &[u8]) -> Vec<Vec<u8>> {
        let mut arriving = self.kept_back_until(image);
        let disturb = !self.calm && !self.kinds.is_empty();
        if disturb && self.random.once_in(self.once_in) {
            self.disturbed += 1;
            let kind = self.random.pick(&self.kinds);
            self.disturb(kind, image, foreign, &mut arriving);
        } else {
            arriving.insert(0, image.to_vec());
        }
        self.remember(image);
        if self.silent > 0 {
            self.silent -= 1;
            arriving.clear();
        }
        self.queue(arriving)
    }

    fn disturb(&mut self, kind: Kind, image: &[u8], foreign: &[u8], arriving: &mut Vec<Vec<u8>>) {
        match kind {
            Kind::Corruption => arriving.push(self.corrupted(image)),
            Kind::Repetition => {
                let old = self.random.between(0, self.past.len() as i64 - 1).max(0) as usize;
                arriving.push(self.past.get(old).cloned().unwrap_or_default());
            }
            Kind::Loss => self.silent = self.random.between(1, self.longest),
            Kind::Insertion => {
                arriving.push(image.iter().map(|_| self.random.next() as u8).collect());
                arriving.push(image.to_vec());
            }
            Kind::WrongOrder => self.held_back = Some(image.to_vec()),
            Kind::Delay => {
                self.slow = self.random.between(1, self.longest);
                arriving.push(image.to_vec());
            }
            Kind::Masquerade => arriving.push(foreign.to_vec()),
        }
    }

    fn corrupted(&mut self, image: &[u8]) -> Vec<u8> {
        let mut image = image.to_vec();
        let bits = image.len() as i64 * 8;
        for _ in 0..self.random.between(1, 3) {
            let bit = self.random.between(0, bits - 1) as usize;
            image[bit / 8] ^= 1 << (bit % 8);
        }
        image
    }

    /// The frame held back arrives behind the next one that differs from it.
    fn kept_back_until(&mut self, image: &[u8]) -> Vec<Vec<u8>> {
        match self.held_back.take() {
            Some(held) if held == image => {
                self.held_back = Some(held);
                self.silent = self.silent.max(1);
                self.held_back_ages()
            }
            Some(held) => vec![held],
            None => Vec::new(),
        }
    }

    /// A partner that waits for this very frame would wait for ever: calm ends the wait.
    fn held_back_ages(&mut self) -> Vec<Vec<u8>> {
        if self.calm {
            self.silent = 0;
            self.held_back = None;
        }
        Vec::new()
    }

    fn remember(&mut self, image: &[u8]) {
        if self.past.back().is_none_or(|last| last != image) {
            self.past.push_back(image.to_vec());
        }
        if self.past.len() > MEMORY {
            self.past.pop_front();
        }
    }

    /// A slow line stays in order: nothing overtakes.
    fn queue(&mut self, arriving: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        for frame in arriving {
            self.under_way.push_back((self.slow, frame));
        }
        self.slow = (self.slow - 1).max(0);
        let mut out = Vec::new();
        while self.under_way.front().is_some_and(|(left, _)| *left <= 0) {
            out.extend(self.under_way.pop_front().map(|(_, frame)| frame));
        }
        for (left, _) in &mut self.under_way {
            *left -= 1;
        }
        out
    }
}
