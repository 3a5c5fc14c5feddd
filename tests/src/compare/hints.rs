//! What makes a scenario of a profile meaningful: parameters that pass its checks, and
//! where the interesting moments are.

use std::collections::BTreeMap;

use shm_schema::facts::{amk_kw, atv340};
use shm_schema::profile::Profile;

use super::random::Random;
use super::{edges, etg};

/// The monitored approach of a request.
#[derive(Debug, Clone, Copy)]
pub struct Approach {
    /// Delay, ms.
    pub delay: i64,
    /// Slope as a fraction, 1/1000 rpm per ms.
    pub slope: (i64, i64),
    /// Where it leads, 1/1000 rpm, as a magnitude.
    pub target: i64,
}

/// A request bit.
#[derive(Debug, Clone, Copy)]
pub struct Request {
    /// Bit of the control word.
    pub bit: u8,
    /// 0 requests.
    pub active_low: bool,
    /// What the motion should follow.
    pub approach: Option<Approach>,
}

impl Request {
    /// Whether the word requests.
    pub fn stands(&self, word: u64) -> bool {
        (word >> self.bit & 1 == 1) != self.active_low
    }

    /// The word with the request or without it.
    pub fn set(&self, word: u64, request: bool) -> u64 {
        let mask = 1_u64 << self.bit;
        if request == self.active_low { word & !mask } else { word | mask }
    }
}

/// Everything the generator needs to know.
#[derive(Debug, Clone, Default)]
pub struct Hints {
    /// Requests.
    pub requests: Vec<Request>,
    /// Acknowledge bits.
    pub acknowledge_bits: Vec<u8>,
    /// Speeds at which something happens, 1/1000 rpm.
    pub limits: Vec<i64>,
    /// The safe input lines matter.
    pub uses_lines: bool,
    /// The non-safe clear command matters.
    pub has_clear_error: bool,
    /// Accelerations at which something happens, rpm/s.
    pub accelerations: Vec<i64>,
    /// Torques at which something happens, per cent.
    pub torques: Vec<i64>,
    /// The acknowledge terminals matter.
    pub has_terminals: bool,
    /// Pairs whose second line is HIGH when the first is LOW.
    pub inverted: [bool; 4],
    /// Bits from 32 on that are 1 while nothing is requested.
    pub neutral_above: u64,
    /// Positions at which a trace may begin besides 0, increments.
    pub origins: Vec<i64>,
}

impl Hints {
    /// Adds a limit in rpm, both directions.
    pub(super) fn limit(&mut self, rpm: i64) {
        self.limits.extend([rpm * 1000, -rpm * 1000]);
    }
}

/// Parameters and hints of a profile.
///
/// # Panics
/// On a profile without hints.
pub fn hints(profile: Profile, random: &mut Random) -> (BTreeMap<u32, i32>, Hints) {
    let (mut set, mut hints) = match profile {
        Profile::AmkKw => amk(random),
        Profile::Etg61002 => etg::hints(random),
        Profile::Atv340 => atv(random),
        Profile::LenzeSm301 => super::lenze::hints(random),
        other @ Profile::None => panic!("no hints for {}", other.name()),
    };
    if random.chance(15) {
        edges::put(profile, random, &mut set, &mut hints);
    }
    (set, hints)
}

fn amk(random: &mut Random) -> (BTreeMap<u32, i32>, Hints) {
    let mut set = BTreeMap::new();
    let mut hints = Hints {
        acknowledge_bits: vec![amk_kw::control::ERROR_ACK],
        has_clear_error: true,
        ..Hints::default()
    };
    let maximum = random.pick(&[1500, 3000, 6000]);
    set.extend([(67, maximum), (68, random.between(0, 2) as i32), (9, 60_000), (10, 60_000)]);
    set.extend([(2, 1_000_000), (3, 60_000), (105, 7)]);
    hints.limit(maximum.into());
    hints.limit(0);
    let low = |bit| Request { bit, active_low: true, approach: None };
    hints.requests.push(low(amk_kw::control::STO));
    for (bit, delay, time, window) in [(amk_kw::control::SS1, 18, 20, 21), (amk_kw::control::SS2, 23, 25, 26)]
    {
        let target = random.between(1, 60) as i32;
        let approach = ramp(&mut set, random, (delay, time), maximum, i64::from(target));
        set.insert(window, target);
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
    }
    set.insert(27, random.between(20, 5000) as i32);
    set.extend([(28, random.between(1, 40) as i32), (29, random.between(20, 5000) as i32)]);
    set.extend([(64, random.between(0, 40) as i32), (103, random.between(0, 2) as i32)]);
    set.extend([(65, random.between(1, 5000) as i32), (66, -random.between(0, 5000) as i32)]);
    hints.limit(set[&28].into());
    hints.limit(set[&64].into());
    for bit in [amk_kw::control::SOS, amk_kw::control::SDIP, amk_kw::control::SDIN, amk_kw::control::SLI] {
        hints.requests.push(low(bit));
    }
    let ranges = [
        (amk_kw::control::SSR1, 30),
        (amk_kw::control::SSR2, 36),
        (amk_kw::control::SSR3, 42),
        (amk_kw::control::SSR4, 48),
    ];
    for (bit, first) in ranges {
        let lower = random.between(-i64::from(maximum), i64::from(maximum) - 20) as i32;
        let upper = random.between(i64::from(lower) + 10, i64::from(maximum)) as i32;
        let approach = ramp(&mut set, random, (first, first + 2), maximum, i64::from(upper));
        set.extend([(first + 3, upper), (first + 4, lower), (first + 5, random.between(0, 2) as i32)]);
        hints.limits.extend([i64::from(upper) * 1000, i64::from(lower) * 1000]);
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
    }
    for (bit, first) in [(amk_kw::control::SLS1, 54), (amk_kw::control::SLS2, 59)] {
        let limit = random.between(1, maximum.into()) as i32;
        let approach = ramp(&mut set, random, (first, first + 2), maximum, i64::from(limit));
        let signed = if random.chance(20) { -limit } else { limit };
        set.extend([(first + 3, signed), (first + 4, random.between(0, 2) as i32)]);
        hints.limit(limit.into());
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
    }
    if random.chance(40) {
        hints.uses_lines = true;
        let functions = [3, 4, 5, 6, 9, 10, 11, 12, 13, 14, 16];
        let one = random.pick(&functions);
        let other =
            random.pick(&functions.iter().copied().filter(|function| *function != one).collect::<Vec<_>>());
        set.extend([(7, 1), (15, one), (16, other), (17, random.between(0, 2) as i32)]);
        for (pair, number) in [70, 76, 82].into_iter().enumerate() {
            hints.inverted[pair] = random.chance(25);
            set.insert(number, hints.inverted[pair].into());
        }
        for line in [71, 73, 77, 79, 83, 85] {
            set.insert(line, random.pick(&[250, 313, 500, 1000, 1500, 2000]));
        }
    }
    (set, hints)
}

/// Delay and ramp time at the given numbers; slopes that end within seconds.
fn ramp(
    set: &mut BTreeMap<u32, i32>,
    random: &mut Random,
    at: (u32, u32),
    maximum: i32,
    target_rpm: i64,
) -> Approach {
    let delay = random.pick(&[0, 0, 1, 7, 50, 300]);
    let time = random.pick(&[100, 333, 500, 1000, 1999]);
    set.extend([(at.0, delay), (at.1, time)]);
    Approach {
        delay: delay.into(),
        slope: (i64::from(maximum) * 1000, time.into()),
        target: target_rpm * 1000,
    }
}

fn atv(random: &mut Random) -> (BTreeMap<u32, i32>, Hints) {
    let pole_pairs = random.pick(&[1, 2, 3, 4, 12]);
    let rpm = |tenths: i32| i64::from(tenths) * 6 / i64::from(pole_pairs);
    let set_point = random.between(100, 200) as i32;
    let threshold = set_point + random.between(0, 100) as i32;
    let standstill = random.between(10, set_point.into()) as i32;
    let deceleration = random.pick(&[50, 100, 777, 2000]);
    let mut set: BTreeMap<u32, i32> = [
        (1, 1),
        (2, pole_pairs),
        (4, 20),
        (5, 2),
        (6, 1024),
        (30, 20_000),
        (31, random.pick(&[50, 100, 777, 2000])),
        (32, random.between(20, 100) as i32),
        (33, random.between(1, 60) as i32),
        (34, random.pick(&[0, 5, 300])),
        (35, random.between(0, 1) as i32),
        (36, 1),
        (39, random.between(1, 6) as i32),
        (40, deceleration),
        (43, random.between(20, 60) as i32),
        (46, standstill),
        (48, threshold),
        (50, set_point),
        (54, random.pick(&[1, 100, 300])),
        (56, random.between(0, 3) as i32),
        (65, 1),
        (66, 1),
        (68, 3),
    ]
    .into();
    set.extend([(57, 600), (58, 500), (59, 450), (60, threshold.max(400))]);
    let mut hints = Hints { acknowledge_bits: vec![atv340::control::SAFETY_RESET], ..Hints::default() };
    for number in [33, 46, 48, 50, 57, 58, 59, 60] {
        hints.limit(rpm(set[&number]));
    }
    let slope = |number: u32| (i64::from(set[&number]) * 6, i64::from(pole_pairs));
    let by_ss1 = Approach { delay: set[&34].into(), slope: slope(31), target: rpm(set[&33]) * 1000 };
    let by_sls = Approach { delay: 0, slope: slope(40), target: rpm(set_point) * 1000 };
    let high = |bit, approach| Request { bit, active_low: false, approach };
    hints.requests = vec![
        Request { bit: atv340::control::STO, active_low: true, approach: None },
        high(atv340::control::SS1, Some(by_ss1)),
        high(atv340::control::SLS, Some(by_sls)),
    ];
    hints.requests.push(high(atv340::control::SMS_SWITCH, None));
    (set, hints)
}
