//! All monitoring functions of one axis: a table of specs beside a table of records.

use shm_schema::word::Word;

use super::Motion;
use super::record::{Breach, Phase, Record, is_inside};
use super::spec::{NO_BIT, Reaction, Spec};

/// Most monitoring functions of one axis.
pub const MONITORS_MAX: usize = 96;

/// The monitoring functions a profile built from its parameters.
#[derive(Debug, Clone, Copy)]
pub struct Bank {
    slots: [Slot; MONITORS_MAX],
    count: usize,
}

#[derive(Debug, Clone, Copy)]
struct Slot {
    spec: Spec,
    state: State,
    /// Once landed, the window is all there is to judge.
    is_plain: bool,
    /// Violated in this cycle, without a reaction (ETG-ERR-02).
    is_violated: bool,
}

#[derive(Debug, Clone, Copy)]
enum State {
    Idle,
    Active(Record),
    /// Violated; waits for the acknowledgement of its error.
    Tripped,
}

impl Bank {
    /// No function.
    pub const fn new() -> Self {
        Self {
            slots: [Slot { spec: Spec::IDLE, state: State::Idle, is_plain: false, is_violated: false };
                MONITORS_MAX],
            count: 0,
        }
    }

    /// Adds a function; `false` when the bank is full.
    pub fn add(&mut self, spec: Spec) -> bool {
        let Some(slot) = self.slots.get_mut(self.count) else {
            return false;
        };
        *slot = Slot { spec, state: State::Idle, is_plain: is_plain(&spec), is_violated: false };
        self.count = self.count.saturating_add(1);
        true
    }

    /// The functions in use.
    pub fn specs(&self) -> impl Iterator<Item = &Spec> {
        self.slots.iter().take(self.count).map(|slot| &slot.spec)
    }

    /// Judges every function that is requested, in place order. `found` is told the place
    /// and spec of each that was violated in this cycle. In STO nothing is monitored and
    /// every function starts anew when STO is left (DEC-14).
    pub fn step(
        &mut self,
        requested: &Word,
        in_sto: bool,
        now: u64,
        motion: &Motion,
        found: &mut dyn FnMut(u8, &Spec, Breach, Phase),
    ) {
        for (place, slot) in (0..).zip(self.slots.iter_mut().take(self.count)) {
            if let Some((breach, phase)) = slot.step(requested, in_sto, now, motion) {
                found(place, &slot.spec, breach, phase);
            }
        }
    }

    /// The error of the function in `place` was acknowledged: it may start again (DEC-17).
    pub fn release(&mut self, place: u8) {
        let slot = self.slots.get_mut(usize::from(place));
        if let Some(slot) = slot.filter(|slot| matches!(slot.state, State::Tripped)) {
            slot.state = State::Idle;
        }
    }

    /// Whether the function in `place` is requested and off its limit now, the one that was
    /// violated without a reaction.
    pub fn is_violated(&self, place: u8, requested: &Word, now: u64, motion: &Motion) -> bool {
        self.slots.get(usize::from(place)).is_some_and(|slot| slot.is_off(requested, now, motion))
    }

    /// Enters the status bit of every function that stands in its window.
    pub fn show(&self, status: Word, motion: &Motion) -> Word {
        let mut word = status;
        for slot in self.slots.iter().take(self.count) {
            slot.show(&mut word, motion);
        }
        word
    }

    /// Whether the function with status bit `bit` is requested and was not violated.
    pub fn is_active(&self, bit: u8) -> bool {
        let mut slots = self.slots.iter().take(self.count);
        slots.any(|slot| (slot.spec.status == bit) && matches!(slot.state, State::Active(_)))
    }

    /// Whether the function with status bit `bit` stands in its window.
    pub fn stands(&self, bit: u8) -> bool {
        let mut slots = self.slots.iter().take(self.count);
        slots.any(|slot| (slot.spec.status == bit) & slot.stands())
    }
}

impl Default for Bank {
    fn default() -> Self {
        Self::new()
    }
}

impl Slot {
    #[inline]
    fn step(&mut self, requested: &Word, in_sto: bool, now: u64, motion: &Motion) -> Option<(Breach, Phase)> {
        if matches!(self.state, State::Tripped) {
            return None;
        }
        let is_requested = (self.spec.control == NO_BIT) || requested.bit(self.spec.control);
        let is_suspended = in_sto & !self.spec.in_sto;
        let is_off = !is_requested | is_suspended;
        if is_off {
            self.state = State::Idle;
            self.is_violated = false;
            return None;
        }
        self.judge(now, motion)
    }

    fn is_off(&self, requested: &Word, now: u64, motion: &Motion) -> bool {
        let State::Active(record) = &self.state else { return false };
        let is_requested = (self.spec.control == NO_BIT) || requested.bit(self.spec.control);
        is_requested && record.judge(&self.spec, now, motion).breach.is_some()
    }

    #[inline]
    fn judge(&mut self, now: u64, motion: &Motion) -> Option<(Breach, Phase)> {
        if let State::Idle = self.state {
            self.state = State::Active(Record::begin(now, motion));
        }
        let State::Active(record) = &mut self.state else {
            return None;
        };
        // The usual case of every cycle: nothing has changed since the window was reached.
        let is_kept = self.is_plain && record.keeps(&self.spec.window, motion);
        if is_kept {
            self.is_violated = false;
            return None;
        }
        if self.spec.bit_only {
            return None;
        }
        let verdict = record.judge(&self.spec, now, motion);
        self.is_violated = verdict.breach.is_some();
        let goes_on = !self.is_violated | is_unanswered(&self.spec, verdict.breach);
        if goes_on {
            record.note(&self.spec, &verdict, now, motion);
        } else {
            self.state = State::Tripped;
        }
        verdict.breach.map(|breach| (breach, verdict.phase))
    }

    fn stands(&self) -> bool {
        match &self.state {
            State::Active(record) => record.has_landed() & !self.is_violated,
            State::Idle | State::Tripped => false,
        }
    }

    #[inline]
    fn show(&self, word: &mut Word, motion: &Motion) {
        let bit = self.spec.status;
        let is_shown = if self.spec.bit_only | self.spec.shows_inside {
            matches!(self.state, State::Active(_)) && is_inside(&self.spec, motion)
        } else {
            self.stands()
        };
        if !is_shown {
            return;
        }
        if let Some(part) = word.0.get_mut(usize::from(bit >> 5)).filter(|_| bit != NO_BIT) {
            *part |= 1 << (bit & 31);
        }
    }
}

/// ETG-ERR-02: without a reaction the monitoring goes on as it was; a damaged record cannot.
fn is_unanswered(spec: &Spec, breach: Option<Breach>) -> bool {
    (spec.reaction == Reaction::None) & (breach != Some(Breach::Damage))
}

/// No second window, no dwell, no furthest position: the landed state has nothing to keep.
fn is_plain(spec: &Spec) -> bool {
    let has_hold = (spec.hold.lower != i64::MIN) | (spec.hold.upper != i64::MAX);
    let keeps = has_hold | spec.hold_only | (spec.ratchet != 0) | (spec.approach.dwell_ns >= 0);
    !(keeps | spec.bit_only)
}
