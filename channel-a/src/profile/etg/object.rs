//! The objects of one function instance, and the approach they ask for.

use super::RPM;
use crate::engine::Range;
use crate::engine::approach::{Approach, Slope};
use crate::image::Image;
use shm_schema::profile::etg_key;

/// The instances that an image names, as function and number, in ascending order.
pub(super) fn instances<'a>(image: &'a Image<'a>) -> impl Iterator<Item = (u32, u32)> + 'a {
    let mut before = 0;
    let named = image.keys().map(|key| key >> 8);
    let each = named.filter(move |instance| core::mem::replace(&mut before, *instance) != *instance);
    each.map(|instance| (instance >> 8, instance & 0xFF))
}

/// Reads the objects of one instance.
pub(super) struct Object<'a> {
    pub(super) image: &'a Image<'a>,
    pub(super) function: u32,
    pub(super) instance: u32,
}

impl Object<'_> {
    pub(super) fn key(&self, object: u32) -> u32 {
        etg_key(self.function, self.instance, object)
    }

    pub(super) fn named(&self, object: u32) -> Option<i64> {
        self.image.named(self.key(object))
    }

    /// The named value, or the profile's default.
    pub(super) fn value(&self, object: u32) -> i64 {
        let default = || self.image.value(etg_key(self.function, 0, object));
        self.named(object).unwrap_or_else(default)
    }

    pub(super) fn speed(&self, object: u32) -> i64 {
        self.value(object).saturating_mul(RPM)
    }

    pub(super) fn time_ns(&self, object: u32) -> Option<u64> {
        self.named(object).map(|ms| (ms.max(0) as u64).saturating_mul(1_000_000))
    }
}

/// Objects of an approach: time limit, dwell, slope, delay.
pub(super) struct Times {
    pub(super) limit: u32,
    pub(super) dwell: u32,
    pub(super) slope: u32,
    pub(super) delay: u32,
}

/// Time variant, or deceleration variant where a slope or its delay is configured.
pub(super) fn approach(object: &Object, times: &Times, window: Range, demand_rpm: i64) -> Approach {
    let limit_ns = object.time_ns(times.limit);
    let delay_ns = object.time_ns(times.delay);
    let slope = object.named(times.slope).filter(|slope| *slope > 0);
    let base = Approach {
        window,
        dwell_ns: object.time_ns(times.dwell),
        dwell_in_delay: true,
        ..Approach::default()
    };
    if slope.is_none() & delay_ns.is_none() {
        return Approach { unmonitored: true, limit_ns: Some(limit_ns.unwrap_or(0)), ..base };
    }
    let delay_ns = delay_ns.unwrap_or(0);
    let span_ns = limit_ns.unwrap_or(0).saturating_sub(delay_ns);
    // DEC-04: the configured slope, or the one the times ask for.
    let slope = match slope {
        Some(slope) => Slope { rise: slope.saturating_mul(RPM), run_ns: 1_000_000_000 },
        None => Slope { rise: demand_rpm.saturating_mul(RPM), run_ns: (span_ns as i64).max(1) },
    };
    Approach { delay_ns, slope, limit_ns, ..base }
}
