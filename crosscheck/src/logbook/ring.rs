//! The way out of the cycle: one writer, one reader, bounded, without locks.
//!
//! A slot is plain atomic words, so that no `unsafe` is needed. The writer publishes a slot
//! by releasing `written`, the reader frees it by releasing `read`; each acquires the other's.

use std::boxed::Box;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use super::moment::{Moment, WORDS};

struct Shared {
    slots: Box<[[AtomicU64; WORDS]]>,
    written: AtomicUsize,
    read: AtomicUsize,
    lost: AtomicU64,
}

/// The cycle's end.
pub struct Feeder(Arc<Shared>);

/// The recorder's end.
pub struct Drain(Arc<Shared>);

/// A ring of at least `capacity` moments (rounded up to a power of two).
pub fn ring(capacity: usize) -> (Feeder, Drain) {
    let length = capacity.max(2).next_power_of_two();
    let slots = (0..length).map(|_| [const { AtomicU64::new(0) }; WORDS]).collect();
    let shared = Arc::new(Shared {
        slots,
        written: AtomicUsize::new(0),
        read: AtomicUsize::new(0),
        lost: AtomicU64::new(0),
    });
    (Feeder(shared.clone()), Drain(shared))
}

impl Shared {
    fn slot(&self, at: usize) -> Option<&[AtomicU64; WORDS]> {
        self.slots.get(at & self.slots.len().wrapping_sub(1))
    }
}

impl Feeder {
    /// Hands over a moment, or drops and counts it. Never waits, allocates or calls the system.
    /// Needs `&mut self`: there is one writer only.
    pub fn push(&mut self, moment: &Moment) {
        let shared = &*self.0;
        let written = shared.written.load(Ordering::Relaxed);
        // Acquire: the reader has taken everything out of the slots it freed.
        let waiting = written.wrapping_sub(shared.read.load(Ordering::Acquire));
        let slot = shared.slot(written).filter(|_| waiting < shared.slots.len());
        let Some(slot) = slot else {
            shared.lost.fetch_add(1, Ordering::Relaxed);
            return;
        };
        for (place, word) in slot.iter().zip(moment.to_words()) {
            place.store(word, Ordering::Relaxed);
        }
        // Release: the words above are there before the reader sees the slot.
        shared.written.store(written.wrapping_add(1), Ordering::Release);
    }
}

impl Drain {
    /// The oldest moment not yet taken.
    pub fn pop(&mut self) -> Option<Moment> {
        let shared = &*self.0;
        let read = shared.read.load(Ordering::Relaxed);
        // Acquire: pairs with the writer's release.
        if shared.written.load(Ordering::Acquire) == read {
            return None;
        }
        let mut words = [0; WORDS];
        for (word, place) in words.iter_mut().zip(shared.slot(read)?) {
            *word = place.load(Ordering::Relaxed);
        }
        // Release: the slot is free once everything has been read.
        shared.read.store(read.wrapping_add(1), Ordering::Release);
        Some(Moment::from_words(&words))
    }

    /// Moments dropped since the last call.
    pub fn lost(&self) -> u64 {
        self.0.lost.swap(0, Ordering::Relaxed)
    }
}
