//! All monitoring functions of one axis: a table of specs beside a table of records.

use shm_schema::word::Word;

use super::Motion;
use super::calm::{Band, Calm};
use super::record::{Breach, Phase, Record, is_inside};
use super::spec::{NO_BIT, Quantity, Reaction, Spec};

/// Most monitoring functions of one axis.
pub const MONITORS_MAX: usize = 96;

/// The monitoring functions a profile built from its parameters.
#[derive(Debug, Clone, Copy)]
pub struct Bank {
    slots: [Slot; MONITORS_MAX],
    count: usize,
    /// Some function limits the acceleration.
    is_accelerating: bool,
    /// Status bits of the functions that stand in their window, and of those that are active, as
    /// the last step has found them.
    shown: Word,
    active: Word,
    /// While these stay, both words do.
    calm: Calm,
    requested: Word,
    in_sto: bool,
}

/// A bit of a word, found once: its part and its mask there.
#[derive(Debug, Clone, Copy)]
struct Place {
    part: u8,
    mask: u32,
}

impl Place {
    /// [`NO_BIT`] is an empty mask: nothing is entered, and nothing is missing.
    const fn of(bit: u8) -> Self {
        let mask = if bit == NO_BIT { 0 } else { 1 << (bit & 31) };
        Self { part: bit >> 5, mask }
    }

    #[inline]
    fn is_set(self, word: &Word) -> bool {
        let part = word.0.get(usize::from(self.part & 7)).copied().unwrap_or(0);
        part & self.mask == self.mask
    }

    #[inline]
    fn enter(self, word: &mut Word) {
        if let Some(part) = word.0.get_mut(usize::from(self.part & 7)) {
            *part |= self.mask;
        }
    }
}

/// What one function answers in one cycle.
struct Seen {
    breach: Option<(Breach, Phase)>,
    is_active: bool,
    is_shown: bool,
}

impl Seen {
    const OFF: Self = Self { breach: None, is_active: false, is_shown: false };
}

#[derive(Debug, Clone, Copy)]
struct Slot {
    spec: Spec,
    control: Place,
    status: Place,
    state: State,
    /// Once landed, the window is all there is to judge.
    is_plain: bool,
}

#[derive(Debug, Clone, Copy)]
enum State {
    Idle,
    Active(Record),
    /// Violated; waits for the acknowledgement of its error, or for the end of its request: a new
    /// one is a new activation.
    Tripped,
}

impl Bank {
    /// No function.
    pub const fn new() -> Self {
        Self {
            slots: [Slot::of(Spec::IDLE, false); MONITORS_MAX],
            count: 0,
            is_accelerating: false,
            shown: Word::ZERO,
            active: Word::ZERO,
            calm: Calm::NONE,
            requested: Word::ZERO,
            in_sto: false,
        }
    }

    /// Adds a function; `false` when the bank is full.
    pub fn add(&mut self, spec: Spec) -> bool {
        let Some(slot) = self.slots.get_mut(self.count) else {
            return false;
        };
        *slot = Slot::of(spec, is_plain(&spec));
        self.count = self.count.saturating_add(1);
        let quantities = [spec.window.quantity, spec.hold.quantity];
        self.is_accelerating |= quantities.contains(&Quantity::Acceleration);
        true
    }

    /// Some function limits the acceleration, which has to be derived for it.
    pub const fn limits_acceleration(&self) -> bool {
        self.is_accelerating
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
        let is_same = self.in_sto == in_sto;
        if is_same & self.is_calm(requested, motion, now) {
            return;
        }
        (self.requested, self.in_sto) = (*requested, in_sto);
        let mut band = Band::OPEN;
        let (mut shown, mut active) = (Word::ZERO, Word::ZERO);
        for (place, slot) in (0..).zip(self.slots.iter_mut().take(self.count)) {
            // Nothing has changed since the window was reached.
            if slot.keeps(requested, in_sto, motion, &mut band) {
                slot.status.enter(&mut shown);
                continue;
            }
            let seen = slot.step(requested, in_sto, now, motion, &mut band);
            if seen.is_active {
                slot.status.enter(&mut active);
            }
            if seen.is_shown {
                slot.status.enter(&mut shown);
            }
            if let Some((breach, phase)) = seen.breach {
                found(place, &slot.spec, breach, phase);
            }
        }
        // What stands in its window is active.
        for (part, shown) in active.0.iter_mut().zip(shown.0) {
            *part |= shown;
        }
        (self.shown, self.active) = (shown, active);
        self.calm = Calm::of(&band);
    }

    /// For `requested` every function answers as it did in the last step.
    #[inline]
    pub fn is_calm(&self, requested: &Word, motion: &Motion, now: u64) -> bool {
        (self.requested == *requested) & self.calm.holds(motion, now)
    }

    /// The error of the function in `place` was acknowledged: it may start again (DEC-17).
    pub fn release(&mut self, place: u8) {
        let slot = self.slots.get_mut(usize::from(place));
        if let Some(slot) = slot.filter(|slot| matches!(slot.state, State::Tripped)) {
            slot.state = State::Idle;
        }
        self.calm = Calm::NONE;
    }

    /// Whether the function in `place` is requested and off its limit now, the one that was
    /// violated without a reaction.
    pub fn is_violated(&self, place: u8, requested: &Word, now: u64, motion: &Motion) -> bool {
        self.slots.get(usize::from(place)).is_some_and(|slot| slot.is_off(requested, now, motion))
    }

    /// Status bits of the functions that stand in their window.
    pub const fn shown(&self) -> Word {
        self.shown
    }

    /// Whether the function with status bit `bit` is requested and was not violated.
    pub fn is_active(&self, bit: u8) -> bool {
        self.active.bit(bit)
    }

    /// Whether the function with status bit `bit` stands in its window.
    pub fn stands(&self, bit: u8) -> bool {
        self.shown.bit(bit)
    }
}

impl Default for Bank {
    fn default() -> Self {
        Self::new()
    }
}

impl Slot {
    const fn of(spec: Spec, is_plain: bool) -> Self {
        let (control, status) = (Place::of(spec.control), Place::of(spec.status));
        Self { spec, control, status, state: State::Idle, is_plain }
    }

    /// It is requested and keeps the window it has reached before.
    #[inline]
    fn keeps(&self, requested: &Word, in_sto: bool, motion: &Motion, band: &mut Band) -> bool {
        let may_keep = self.is_plain & !in_sto & self.control.is_set(requested);
        match &self.state {
            State::Active(record) if may_keep => record.keeps(&self.spec.window, motion, band),
            _ => false,
        }
    }

    fn step(&mut self, requested: &Word, in_sto: bool, now: u64, motion: &Motion, band: &mut Band) -> Seen {
        let is_suspended = in_sto & !self.spec.in_sto;
        let is_off = is_suspended | !self.control.is_set(requested);
        match &self.state {
            State::Tripped if is_suspended | !is_off => return Seen::OFF,
            _ if is_off => {
                self.state = State::Idle;
                return Seen::OFF;
            }
            State::Active(_) => {}
            State::Idle | State::Tripped => self.state = State::Active(Record::begin(now, motion)),
        }
        if self.spec.bit_only {
            self.show_beside(motion, band);
            return Seen { breach: None, is_active: true, is_shown: is_inside(&self.spec, motion) };
        }
        let seen = self.judge(now, motion, band);
        if seen.breach.is_some() {
            // A violation that has no reaction is told again in every cycle.
            band.shut();
        }
        seen
    }

    /// The status bit stays while the motion stays on its side of both windows.
    fn show_beside(&self, motion: &Motion, band: &mut Band) {
        band.stay_beside(&self.spec.window, motion);
        band.stay_beside(&self.spec.hold, motion);
    }

    fn is_off(&self, requested: &Word, now: u64, motion: &Motion) -> bool {
        let State::Active(record) = &self.state else { return false };
        self.control.is_set(requested) && record.judge(&self.spec, now, motion).breach.is_some()
    }

    fn judge(&mut self, now: u64, motion: &Motion, band: &mut Band) -> Seen {
        let State::Active(record) = &mut self.state else {
            return Seen::OFF;
        };
        let verdict = record.judge(&self.spec, now, motion);
        let is_violated = verdict.breach.is_some();
        let breach = verdict.breach.map(|breach| (breach, verdict.phase));
        let goes_on = !is_violated | is_unanswered(&self.spec, verdict.breach);
        if !goes_on {
            self.state = State::Tripped;
            return Seen { breach, ..Seen::OFF };
        }
        record.note(&self.spec, &verdict, now, motion);
        record.hold(&self.spec, verdict.phase, band);
        if self.spec.shows_inside {
            band.stay_beside(&self.spec.window, motion);
            band.stay_beside(&self.spec.hold, motion);
        }
        let is_shown = if self.spec.shows_inside {
            is_inside(&self.spec, motion)
        } else {
            record.has_landed() & !is_violated
        };
        Seen { breach, is_active: true, is_shown }
    }
}

/// ETG-ERR-02: without a reaction the monitoring goes on as it was; a damaged record cannot.
fn is_unanswered(spec: &Spec, breach: Option<Breach>) -> bool {
    (spec.reaction == Reaction::None) & (breach != Some(Breach::Damage))
}

/// No second window, no dwell, no furthest position: the landed state has nothing to keep.
fn is_plain(spec: &Spec) -> bool {
    let has_hold = (spec.hold.lower != i64::MIN) | (spec.hold.upper != i64::MAX);
    let keeps =
        has_hold | spec.hold_only | spec.lands_free | (spec.ratchet != 0) | (spec.approach.dwell_ns >= 0);
    !(keeps | spec.bit_only)
}
