//! Short scripts for tests: a speed polyline, events, and what the model answered.

use std::collections::BTreeMap;

use shm_schema::profile::Profile;

use super::{Model, ModelInput, ModelOutput, View};

/// Exact position of a speed polyline sampled at each millisecond.
#[derive(Debug, Clone, Default)]
pub struct Integral {
    /// Twice the area under the speed, in 1/1000 rpm times ms.
    twice_area: i128,
    before: Option<i64>,
}

impl Integral {
    /// Position after one more cycle that ends with `speed_mrpm`, increments, rounded to
    /// nearest (design 10).
    pub fn step(&mut self, speed_mrpm: i64) -> i64 {
        if let Some(before) = self.before {
            self.twice_area += i128::from(before + speed_mrpm);
        }
        self.before = Some(speed_mrpm);
        let (numerator, denominator) = (self.twice_area * 65_536, 120_000_000);
        ((2 * numerator + denominator).div_euclid(2 * denominator)) as i64
    }
}

/// A script over whole milliseconds.
pub struct Script {
    profile: Profile,
    parameters: BTreeMap<u32, i32>,
    speed_rpm: Vec<(i64, f64)>,
    events: Vec<(i64, Event)>,
}

type Event = Box<dyn Fn(&mut ModelInput)>;

impl Script {
    /// A script over a set of parameters.
    pub fn new(profile: Profile, parameters: &[(u32, i32)]) -> Self {
        Self {
            profile,
            parameters: parameters.iter().copied().collect(),
            speed_rpm: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Corners of the speed polyline, ms and rpm.
    #[must_use]
    pub fn speed(mut self, corners: &[(i64, f64)]) -> Self {
        self.speed_rpm.extend_from_slice(corners);
        self
    }

    /// From `at` ms on the input is changed so.
    #[must_use]
    pub fn at(mut self, at: i64, event: impl Fn(&mut ModelInput) + 'static) -> Self {
        self.events.push((at, Box::new(event)));
        self
    }

    /// Control bit `bit` takes `value` at `at` ms.
    #[must_use]
    pub fn bit(self, at: i64, bit: u8, value: bool) -> Self {
        self.at(at, move |input| input.control = input.control.with(bit, value))
    }

    /// The inputs of cycles 0 to `last`.
    pub fn inputs(&self, last: i64) -> Vec<ModelInput> {
        let mut input = ModelInput::neutral(self.profile);
        let mut integral = Integral::default();
        (0..=last)
            .map(|now| {
                for (_, event) in self.events.iter().filter(|(at, _)| *at == now) {
                    event(&mut input);
                }
                input.speed_mrpm = speed_at(&self.speed_rpm, now);
                input.position = integral.step(input.speed_mrpm);
                input.clone()
            })
            .collect()
    }

    /// Runs the model over cycles 0 to `last`.
    pub fn run(&self, last: i64) -> Played {
        let mut model = Model::new(self.profile, &self.parameters);
        Played(self.inputs(last).iter().map(|input| model.step(input)).collect())
    }
}

/// Speed of the polyline at `now`, 1/1000 rpm.
fn speed_at(corners: &[(i64, f64)], now: i64) -> i64 {
    let Some(first) = corners.first() else { return 0 };
    let mut before = *first;
    for corner in corners {
        if corner.0 > now {
            let share = (now - before.0) as f64 / (corner.0 - before.0) as f64;
            let inside = now >= before.0;
            let speed = if inside { before.1 + (corner.1 - before.1) * share } else { before.1 };
            return (speed * 1000.0).round() as i64;
        }
        before = *corner;
    }
    (before.1 * 1000.0).round() as i64
}

/// What the model answered, cycle by cycle.
pub struct Played(pub Vec<ModelOutput>);

impl Played {
    /// Channel A in cycle `at`.
    pub fn a(&self, at: i64) -> &View {
        &self.0[at as usize].a
    }

    /// Channel B in cycle `at`.
    pub fn b(&self, at: i64) -> &View {
        &self.0[at as usize].b
    }

    /// Crosscheck in cycle `at`.
    pub fn crosscheck(&self, at: i64) -> &View {
        &self.0[at as usize].crosscheck
    }

    /// The combined status bit `bit` in cycle `at`.
    pub fn bit(&self, at: i64, bit: u8) -> bool {
        self.crosscheck(at).status.bit(bit)
    }

    /// First cycle in which the combined status bit `bit` is `value`.
    pub fn first(&self, bit: u8, value: bool) -> Option<i64> {
        self.first_where(|view| view.status.bit(bit) == value)
    }

    /// First cycle whose combined view satisfies `condition`.
    pub fn first_where(&self, condition: impl Fn(&View) -> bool) -> Option<i64> {
        self.0.iter().position(|output| condition(&output.crosscheck)).map(|at| at as i64)
    }
}
