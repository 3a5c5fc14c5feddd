//! Parameters of one ETG axis: objects by function and instance (DEC-39, DEC-40).

use std::collections::{BTreeMap, BTreeSet};

use shm_schema::facts::etg;
use shm_schema::profile::{common, etg_key};

use crate::model::approach::{Approach, Window};
use crate::model::exact::Ratio;

/// A function and its instance.
pub type Instance = (u32, u32);

/// What a violation starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reaction {
    /// STO, the default (ETG-ERR-02).
    Sto,
    /// SS1 instance.
    Ss1(u32),
    /// SS2 instance.
    Ss2(u32),
    /// No reaction: the error bit only.
    None,
}

/// Objects that give an approach its shape.
pub struct ApproachObjects {
    /// Function and instance.
    pub instance: Instance,
    /// Latest time.
    pub time: u32,
    /// Time within the limits for the early start.
    pub dwell: u32,
    /// Deceleration limit.
    pub slope: u32,
    /// Delay of the deceleration monitoring.
    pub delay: u32,
}

/// Objects of one axis.
#[derive(Debug, Clone)]
pub struct Parameters(BTreeMap<u32, i32>);

impl Parameters {
    /// The given objects.
    pub fn new(given: &BTreeMap<u32, i32>) -> Self {
        Self(given.clone())
    }

    /// An object's value, if the set names it.
    pub fn object(&self, (function, instance): Instance, object: u32) -> Option<i64> {
        self.0.get(&etg_key(function, instance, object)).map(|value| i64::from(*value))
    }

    /// An object's value or 0.
    pub fn value(&self, instance: Instance, object: u32) -> i64 {
        self.object(instance, object).unwrap_or(0)
    }

    /// DEC-40: an instance that no key names is not supported.
    pub fn supports(&self, instance: Instance) -> bool {
        self.instances(instance.0).contains(&instance.1)
    }

    /// The instances of a function that the set names.
    pub fn instances(&self, function: u32) -> BTreeSet<u32> {
        let of_profile = self.0.keys().filter(|key| **key < common::STATUS_WORD.min(common::CONTROL_WORD));
        of_profile.filter(|key| **key >> 16 == function).map(|key| key >> 8 & 0xFF).collect()
    }

    /// `[words]` assignments from `base` on: bit and function instance (DEC-41).
    pub fn assignments(&self, base: u32) -> BTreeMap<u8, Instance> {
        let range = self.0.range(base..base + 256);
        range.map(|(key, value)| ((key - base) as u8, (*value as u32 >> 8, *value as u32 & 0xFF))).collect()
    }

    /// The error reaction of an instance: default STO, 0 none (ETG-ERR-02).
    pub fn reaction(&self, instance: Instance, object: u32) -> Reaction {
        let Some(value) = self.object(instance, object) else { return Reaction::Sto };
        let (function, number) = (value as u32 >> 8, value as u32 & 0xFF);
        match function {
            0 if value == 0 => Reaction::None,
            etg::SS1 if self.supports((function, number)) => Reaction::Ss1(number),
            etg::SS2 if self.supports((function, number)) => Reaction::Ss2(number),
            _ => Reaction::Sto,
        }
    }

    /// DEC-12: acknowledged unless the set says automatic.
    pub fn needs_restart_acknowledge(&self, instance: Instance, object: u32) -> bool {
        self.object(instance, object) != Some(0)
    }

    /// Magnitudes of SMS (DEC-31), rpm.
    pub fn maximum_speeds(&self) -> (i64, i64) {
        let sms = (etg::SMS, 1);
        let positive = self.value(sms, etg::sms::VELOCITY_MAXIMUM_POSITIVE).abs();
        (positive, self.value(sms, etg::sms::VELOCITY_MAXIMUM_NEGATIVE).abs())
    }

    /// The change of speed, rpm, that a formula of the catalogue asks for (ETG-SS1-05,
    /// ETG-SS2-05, ETG-SSR-04 with DEC-04, ETG-SLS-03).
    fn largest_change(&self, function: u32, target: Window) -> i64 {
        let (positive, negative) = self.maximum_speeds();
        let (upper, lower) = (target.upper / 1000, target.lower / 1000);
        match function {
            etg::SSR => (positive - upper).abs().max((negative + lower).abs()),
            etg::SLS => (positive.max(negative) - upper).abs(),
            _ => positive.max(negative),
        }
    }

    /// Slope in 1/1000 rpm per ms, if the deceleration is monitored (DEC-04).
    fn slope(&self, objects: &ApproachObjects, target: Window) -> Option<Ratio> {
        let configured = self.value(objects.instance, objects.slope);
        if configured > 0 {
            // rpm/s and 1/1000 rpm per ms are the same number.
            return Some(Ratio::whole(configured));
        }
        let delay = self.object(objects.instance, objects.delay)?;
        let time = self.value(objects.instance, objects.time) - delay;
        let change = self.largest_change(objects.instance.0, target);
        let possible = time > 0 && change > 0;
        possible.then(|| Ratio::new(i128::from(change) * 1000, i128::from(time)))
    }

    /// The approach of an instance from its objects.
    pub fn approach(&self, objects: &ApproachObjects, now: i64, speed: i64, target: Window) -> Approaching {
        let slope = self.slope(objects, target);
        let delay = if slope.is_some() { self.value(objects.instance, objects.delay) } else { 0 };
        let latest = self.object(objects.instance, objects.time);
        // Without line and time the window applies at once (DEC-07).
        let latest = if slope.is_none() { latest.or(Some(0)) } else { latest };
        let approach = Approach { started: now, delay, latched: speed, slope, latest, target };
        let dwell = self.object(objects.instance, objects.dwell);
        Approaching { approach, dwell, inside_since: None, early: None }
    }
}

/// An approach that may also end by dwelling inside the target (ETG-SSR-02, ETG-SLS-02).
#[derive(Debug, Clone)]
pub struct Approaching {
    /// The line and the latest time.
    pub approach: Approach,
    dwell: Option<i64>,
    inside_since: Option<i64>,
    /// When the dwell time was full, ms.
    pub early: Option<i64>,
}

impl Approaching {
    /// Notes the speed of this cycle.
    pub fn observe(&mut self, now: i64, speed: i64) {
        if !self.approach.target.contains(speed) {
            self.inside_since = None;
            return;
        }
        let since = *self.inside_since.get_or_insert(now);
        if self.dwell.is_some_and(|dwell| now - since >= dwell) {
            self.early.get_or_insert(now);
        }
    }
}
