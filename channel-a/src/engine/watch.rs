//! A watch: a window on one quantity, approached, held, and left only by violation or
//! the end of its request.

use super::approach::{Approach, Progress, Stage};
use super::stop::Reaction;
use super::{Range, Sample, Side};

/// What a watch looks at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Quantity {
    /// Speed, 1/1000 rpm.
    #[default]
    Speed,
    /// Position, increments.
    Position,
    /// Position relative to where it was latched at activation.
    Travel,
    /// Position relative to where it was latched when the speed first was within this
    /// many 1/1000 rpm after activation, or had changed its sign (DEC-30).
    TravelFromZero(i64),
    /// The same, and from then on relative to the furthest position upwards.
    TravelBackFromZero(i64),
    /// The same downwards.
    TravelForthFromZero(i64),
    /// Speed, from the instant on in which it first was within this many 1/1000 rpm.
    SpeedFromZero(i64),
    /// Position relative to the furthest one reached upwards (Lenze SDI, DEC-49).
    TravelFromHighest,
    /// Position relative to the furthest one reached downwards.
    TravelFromLowest,
    /// Acceleration, 1/1000 rpm/s.
    Acceleration,
    /// Torque, millionths of the rated torque.
    Torque,
}

/// One instance, as the profile's table has it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Plan {
    /// What it looks at.
    pub quantity: Quantity,
    /// The way into the window; for a speed watch it holds the window on the way.
    pub approach: Approach,
    /// The window that is held.
    pub window: Range,
    /// The profile's number of the function, for codes and requests.
    pub function: u16,
    /// Bit of the request mask; `None`: always on.
    pub request: Option<u8>,
    /// Bit of the status word that says "active"; `None`: none.
    pub status: Option<u8>,
    /// What a violation starts.
    pub reaction: Reaction,
}

/// Which part of a watch was violated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The ramp.
    Ramp,
    /// The window at the instant in which the ramp or a stop function ends.
    End,
    /// The held window.
    Window,
}

/// A violation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Violation {
    /// Which part.
    pub part: Part,
    /// Which limit.
    pub side: Side,
}

#[derive(Debug, Clone, Copy, Default)]
enum State {
    #[default]
    Idle,
    Approaching(Progress),
    /// With the latched position; `None`: not latched yet.
    Holding(Option<i64>),
    /// Since when, ns.
    Violated(u64),
}

/// What the next instants can do to a watch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outlook {
    /// Nothing.
    None,
    /// Any of them can change it.
    Any,
    /// Only a value outside this range can.
    Outside(Basis, Range),
    /// Only a position outside this range can: it moves the latch, or leaves the window.
    Drift(Range),
}

/// A quantity that an instant shows by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// 1/1000 rpm.
    Speed,
    /// Increments.
    Position,
    /// 1/1000 rpm/s.
    Acceleration,
    /// Millionths of the rated torque.
    Torque,
}

/// One instance at work.
#[derive(Debug, Clone, Copy, Default)]
pub struct Watch {
    /// Its row of the table.
    pub plan: Plan,
    state: State,
    start_speed: i64,
    /// The last instant was a violation that starts nothing: its monitoring goes on.
    noted: bool,
}

impl Watch {
    /// An instance that has not been requested yet.
    pub fn new(plan: Plan) -> Self {
        Self { plan, ..Self::default() }
    }

    /// Requested by this mask, or always on.
    pub fn is_asked(&self, asked: u64) -> bool {
        self.plan.request.is_none_or(|bit| asked.wrapping_shr(u32::from(bit)) & 1 == 1)
    }

    /// What the next instants can do to it.
    pub fn outlook(&self) -> Outlook {
        let window = self.plan.window;
        if self.noted {
            return Outlook::Any;
        }
        let latch = match self.state {
            State::Idle | State::Violated(_) => return Outlook::None,
            State::Approaching(_) => return Outlook::Any,
            State::Holding(latch) => latch,
        };
        match (self.plan.quantity, latch) {
            (Quantity::Speed, _) | (Quantity::SpeedFromZero(_), Some(_)) => {
                Outlook::Outside(Basis::Speed, window)
            }
            (Quantity::Position, _) => Outlook::Outside(Basis::Position, window),
            (Quantity::Travel | Quantity::TravelFromZero(_), Some(from)) => {
                Outlook::Outside(Basis::Position, window.around(from))
            }
            (Quantity::TravelFromHighest | Quantity::TravelBackFromZero(_), Some(from)) => {
                Outlook::Drift(Range { upper: from, ..window.around(from) })
            }
            (Quantity::TravelFromLowest | Quantity::TravelForthFromZero(_), Some(from)) => {
                Outlook::Drift(Range { lower: from, ..window.around(from) })
            }
            (Quantity::Acceleration, _) => Outlook::Outside(Basis::Acceleration, window),
            (Quantity::Torque, _) => Outlook::Outside(Basis::Torque, window),
            _ => Outlook::Any,
        }
    }

    /// What decides its outlook: on its way, and violated without a reaction.
    pub const fn face(&self) -> (bool, bool) {
        (matches!(self.state, State::Approaching(_)), self.noted)
    }

    /// Forgets everything: no request, or STO (DEC-14).
    pub fn rest(&mut self) {
        self.state = State::Idle;
        self.noted = false;
    }

    /// What this instant violates without any reaction (DEC-15).
    pub fn stands(&mut self, sample: &Sample) -> Option<Violation> {
        let goes_on = self.engaged() & (self.plan.reaction == Reaction::None);
        if goes_on { self.step(sample) } else { None }
    }

    /// A violation that was acknowledged: one whose reaction is `settled` starts again with its
    /// transition (DEC-17); one that started nothing goes on as it was.
    pub fn acknowledge(&mut self, settled: bool) {
        if matches!(self.state, State::Violated(_)) & settled {
            self.state = State::Idle;
        }
    }

    /// The target state is monitored and kept.
    pub fn active(&self) -> bool {
        matches!(self.state, State::Holding(_)) & !self.noted
    }

    /// Was violated and not acknowledged since.
    pub fn violated(&self) -> bool {
        matches!(self.state, State::Violated(_)) | self.noted
    }

    /// Since when a violation has not been acknowledged, ns.
    pub const fn violated_since_ns(&self) -> Option<u64> {
        match self.state {
            State::Violated(since_ns) => Some(since_ns),
            _ => None,
        }
    }

    /// Requested and on its way or holding.
    pub fn engaged(&self) -> bool {
        matches!(self.state, State::Approaching(_) | State::Holding(_))
    }

    /// One instant under request.
    pub fn step(&mut self, sample: &Sample) -> Option<Violation> {
        if matches!(self.state, State::Idle) {
            self.state = State::Approaching(Progress::begin(sample.now_ns, sample.speed));
            self.start_speed = sample.speed;
        }
        let found = match &mut self.state {
            State::Approaching(progress) => {
                let stage = progress.step(&self.plan.approach, sample.now_ns, sample.speed);
                self.arrive(stage, sample)
            }
            State::Holding(_) => self.hold(sample, Part::Window),
            State::Idle | State::Violated(_) => None,
        };
        self.noted = false;
        if found.is_some() {
            self.note(sample);
        }
        found
    }

    /// A violation ends the monitoring, unless nothing follows from it.
    fn note(&mut self, sample: &Sample) {
        if self.plan.reaction == Reaction::None {
            self.noted = true;
        } else {
            self.state = State::Violated(sample.now_ns);
        }
    }

    fn arrive(&mut self, stage: Stage, sample: &Sample) -> Option<Violation> {
        match stage {
            Stage::Under => None,
            Stage::Violated(side) => Some(Violation { part: Part::Ramp, side }),
            Stage::Arrived => {
                self.state = State::Holding(zero_of(self.plan.quantity).is_none().then_some(sample.position));
                let ramped = self.plan.approach.slope.run_ns != 0;
                self.hold(sample, if ramped { Part::End } else { Part::Window })
            }
        }
    }

    fn hold(&mut self, sample: &Sample, part: Part) -> Option<Violation> {
        let State::Holding(latch) = &mut self.state else { return None };
        if let Some(zero) = zero_of(self.plan.quantity).filter(|_| latch.is_none()) {
            let slow = sample.speed.saturating_abs() <= zero;
            let turned = sample.speed.signum() != self.start_speed.signum();
            *latch = (slow | turned).then_some(sample.position);
        }
        let value = value(self.plan.quantity, latch, sample)?;
        self.plan.window.left_by(value).map(|side| Violation { part, side })
    }
}

/// The zero window of a quantity that waits for standstill first.
const fn zero_of(quantity: Quantity) -> Option<i64> {
    match quantity {
        Quantity::TravelFromZero(zero)
        | Quantity::TravelBackFromZero(zero)
        | Quantity::TravelForthFromZero(zero)
        | Quantity::SpeedFromZero(zero) => Some(zero),
        _ => None,
    }
}

/// The value judged; `None` while there is nothing to judge.
fn value(quantity: Quantity, latch: &mut Option<i64>, sample: &Sample) -> Option<i64> {
    match quantity {
        Quantity::Speed => return Some(sample.speed),
        Quantity::Position => return Some(sample.position),
        Quantity::Acceleration => return Some(sample.acceleration),
        Quantity::Torque => return Some(sample.torque),
        Quantity::SpeedFromZero(_) => return latch.map(|_| sample.speed),
        Quantity::Travel | Quantity::TravelFromZero(_) => {}
        Quantity::TravelFromHighest | Quantity::TravelBackFromZero(_) => {
            *latch = latch.map(|far| far.max(sample.position));
        }
        Quantity::TravelFromLowest | Quantity::TravelForthFromZero(_) => {
            *latch = latch.map(|far| far.min(sample.position));
        }
    }
    latch.map(|from| sample.position.saturating_sub(from))
}
