//! What the functions of a set permit over time, for drawing.
//!
//! Nothing is judged with it: the channels compute their own.

use serde::Serialize;
use shm_schema::profile::{Profile, common, lenze_key};

use crate::{key, set::AxisSet};

/// The permitted speed after a request, at zero.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Envelope {
    /// Function, with the parameters that shape it.
    pub title: String,
    /// Unit of the values.
    pub unit: &'static str,
    /// Time ms and highest permitted value.
    pub upper: Vec<(f64, f64)>,
    /// Time ms and lowest permitted value.
    pub lower: Vec<(f64, f64)>,
}

/// A ramp: from `top`, after `delay`, with `slope` a millisecond, to a range.
struct Ramp {
    title: String,
    unit: &'static str,
    top: f64,
    delay: f64,
    slope: f64,
    range: (f64, f64),
}

impl Ramp {
    /// DEC-03 to DEC-06: held, then falling until it meets the range; the other side applies
    /// when the delay has passed.
    fn envelope(self) -> Envelope {
        let (low, high) = self.range;
        let from = self.top.max(high);
        let meets = self.delay + (from - high) / self.slope.max(1e-9);
        let end = (meets * 1.25).max(self.delay + 1.0).max(100.0);
        Envelope {
            title: self.title,
            unit: self.unit,
            upper: vec![(0.0, from), (self.delay, from), (meets, high), (end, high)],
            lower: vec![(0.0, -from), (self.delay, -from), (self.delay, low), (end, low)],
        }
    }
}

/// The envelopes of a set.
pub fn envelopes(axis: &AxisSet) -> Vec<Envelope> {
    match axis.profile {
        Profile::AmkKw => amk(axis),
        Profile::LenzeSm301 => lenze(axis),
        Profile::Atv340 => atv(axis),
        Profile::Etg61002 => etg(axis),
        Profile::None => Vec::new(),
    }
}

fn amk(axis: &AxisSet) -> Vec<Envelope> {
    let value = |number: u32| f64::from(axis.value(number));
    let top = value(67);
    let ramp = |name: &str, delay: u32, time: u32, range: (f64, f64)| {
        let slope = top / value(time).max(1.0);
        Ramp {
            title: format!(
                "{name}: Prm{delay} = {} ms, slope Prm67 / Prm{time} = {:.1} rpm/s, {} to {} rpm",
                value(delay),
                slope * 1_000.0,
                range.0,
                range.1
            ),
            unit: "rpm",
            top,
            delay: value(delay),
            slope,
            range,
        }
        .envelope()
    };
    let around = |number: u32| (-value(number).abs(), value(number).abs());
    let between =
        |first: u32, second: u32| (value(first).min(value(second)), value(first).max(value(second)));
    vec![
        ramp("SS1", 18, 20, around(21)),
        ramp("SS2", 23, 25, around(26)),
        ramp("SSR1", 30, 32, between(33, 34)),
        ramp("SSR2", 36, 38, between(39, 40)),
        ramp("SSR3", 42, 44, between(45, 46)),
        ramp("SSR4", 48, 50, between(51, 52)),
        ramp("SLS1", 54, 56, around(57)),
        ramp("SLS2", 59, 61, around(62)),
    ]
}

fn lenze(axis: &AxisSet) -> Vec<Envelope> {
    let value = |code: u32, sub: u32| f64::from(axis.value(lenze_key(code, sub)));
    let top = value(15_320, 0).max(1.0);
    let mut all = Vec::new();
    for number in 1..=4 {
        let (limit, braking) = (value(15_330, number), value(15_331, number));
        if limit > 0.0 {
            let title = format!(
                "SLS{number}: {limit} rpm when the braking time C15331/{number} = {braking} ms has passed"
            );
            let steep = Ramp { title, unit: "rpm", top, delay: braking, slope: 1e9, range: (-limit, limit) };
            all.push(steep.envelope());
        }
    }
    if value(15_315, 0) > 0.0 && value(15_305, 0) > 0.0 {
        let (stopping, offset) = (value(15_305, 0), value(15_317, 0) / 100.0);
        let title = format!(
            "SS1, SS2: stopping time C15305 = {stopping} ms, start offset C15317 = {:.0} % (S-ramp drawn straight)",
            offset * 100.0
        );
        let start = top * (1.0 + offset);
        let window = value(15_310, 0);
        let slope = top / stopping;
        all.push(
            Ramp { title, unit: "rpm", top: start, delay: 0.0, slope, range: (-window, window) }.envelope(),
        );
    }
    all
}

fn atv(axis: &AxisSet) -> Vec<Envelope> {
    let value = |number: u32| f64::from(axis.value(number)) / 10.0;
    let delay = f64::from(axis.value(34));
    let top = if axis.value(56) == 0 { 50.0 } else { value(57).min(value(58)).max(1.0) };
    let mut all = Vec::new();
    if axis.value(65) == 1 {
        let title = format!(
            "SS1: SC34 = {delay} ms, from {top} Hz + SC32 with SC31 = {} Hz/s to SC33 = {} Hz",
            value(31),
            value(33)
        );
        let range = (-value(33), value(33));
        let slope = (value(31) / 1_000.0).max(1e-6);
        all.push(Ramp { title, unit: "Hz", top: top + value(32), delay, slope, range }.envelope());
    }
    if axis.value(66) == 1 {
        let title = format!(
            "SLS type {}: thresholds SC48, SC49 = {} Hz; ramp {} Hz/s, offset SC43 = {} Hz",
            axis.value(39),
            value(48),
            value(40),
            value(43)
        );
        let range = (-value(48), value(48));
        let slope = (value(40) / 1_000.0).max(1e-6);
        all.push(Ramp { title, unit: "Hz", top: top + value(43), delay: 0.0, slope, range }.envelope());
    }
    if axis.value(56) != 0 {
        let title = format!("SMS: SC57 = {} Hz, SC58 = {} Hz", value(57), value(58));
        let range = (-value(58), value(57));
        all.push(Ramp { title, unit: "Hz", top: value(57), delay: 0.0, slope: 1.0, range }.envelope());
    }
    all
}

fn etg(axis: &AxisSet) -> Vec<Envelope> {
    let value = |name: &str, object: &str| {
        let parts = key::etg(&format!("{name}.{object}")).ok()?;
        axis.values.get(&parts.number).map(|value| f64::from(*value))
    };
    let maximum = value("SMS", "velocity_maximum_positive").filter(|limit| *limit > 0.0).unwrap_or(1_000.0);
    let mut instances: Vec<u32> =
        axis.values.keys().filter(|key| **key < common::CONTROL_WORD).map(|key| key >> 8).collect();
    instances.dedup();
    let mut all = Vec::new();
    for name in instances.into_iter().map(|instance| key::reference_name(instance as i32)) {
        let (range, time) = match name.split('_').next() {
            Some("SLS") => {
                let limit = value(&name, "velocity_limit").unwrap_or_default();
                ((-limit, limit), value(&name, "time_to_velocity_monitoring"))
            }
            Some("SSR") => (
                (
                    value(&name, "velocity_lower_limit").unwrap_or_default(),
                    value(&name, "velocity_upper_limit").unwrap_or_default(),
                ),
                value(&name, "time_to_velocity_monitoring"),
            ),
            Some("SS1") => {
                let zero = value(&name, "velocity_zero_window").unwrap_or_default();
                ((-zero, zero), value(&name, "time_to_sto"))
            }
            _ => continue,
        };
        let time = time.unwrap_or_default();
        let limited = value(&name, "deceleration_limit").filter(|limit| *limit > 0.0);
        let held = value(&name, "time_delay_deceleration_monitoring").unwrap_or_default();
        // Without a deceleration limit only the end of the time is monitored.
        let (delay, slope) = limited.map_or((time, 1e9), |limit| (held, limit / 1_000.0));
        let title =
            format!("{name}: {} to {} rpm, at the latest {time} ms after the request", range.0, range.1);
        all.push(Ramp { title, unit: "rpm", top: maximum, delay, slope, range }.envelope());
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// DEC-02 to DEC-06
    #[test]
    fn the_line_is_held_for_the_delay_and_then_falls_to_the_limit() {
        let text = "profile = \"amk-kw\"\n[parameters]\nPrm67 = 2000\nPrm54 = 100\nPrm56 = 1000\nPrm57 = 500";
        let set = crate::parse(text, "x").expect("right").axes.remove(0);
        let all = envelopes(&set);
        let sls = all.iter().find(|envelope| envelope.title.starts_with("SLS1")).expect("drawn");
        assert_eq!(sls.upper[..3], [(0.0, 2_000.0), (100.0, 2_000.0), (850.0, 500.0)]);
        assert_eq!(sls.lower[2], (100.0, -500.0));
    }
}
