//! What makes a scenario of a profile meaningful: parameters that pass its checks, and
//! where the interesting moments are.

use std::collections::BTreeMap;

use shm_schema::facts::etg;
use shm_schema::facts::{amk_kw, atv340, etg_6100_2};
use shm_schema::profile::{Profile, etg_key, reference};

use super::random::Random;

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
    pub fn stands(&self, word: u32) -> bool {
        (word >> self.bit & 1 == 1) != self.active_low
    }

    /// The word with the request or without it.
    pub fn set(&self, word: u32, request: bool) -> u32 {
        let mask = 1 << self.bit;
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
    match profile {
        Profile::AmkKw => amk(random),
        Profile::Etg61002 => etg_profile(random),
        Profile::Atv340 => atv(random),
        Profile::LenzeSm301 => super::lenze::hints(random),
        other @ Profile::None => panic!("no hints for {}", other.name()),
    }
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
        let functions = [3, 4, 5, 6, 9, 10, 11, 12, 13, 14];
        let one = random.pick(&functions);
        let other =
            random.pick(&functions.iter().copied().filter(|function| *function != one).collect::<Vec<_>>());
        set.extend([(7, 1), (15, one), (16, other), (17, random.between(0, 2) as i32)]);
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
    let pole_pairs = random.pick(&[1, 2, 3, 4]);
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

fn etg_profile(random: &mut Random) -> (BTreeMap<u32, i32>, Hints) {
    use etg_6100_2::control as c;
    let mut set = BTreeMap::new();
    let mut hints =
        Hints { acknowledge_bits: vec![c::ERROR_ACK, c::RESTART_ACKNOWLEDGE], ..Hints::default() };
    hints.limit(0);
    let low = |bit| Request { bit, active_low: true, approach: None };
    hints.requests.push(low(c::STO));
    set.insert(etg_key(etg::STO, 1, etg::sto::RESTART_ACKNOWLEDGE_BEHAVIOR), random.between(0, 1) as i32);
    let maximum = random.between(1000, 4000) as i32;
    set.insert(etg_key(etg::SMS, 1, etg::sms::VELOCITY_MAXIMUM_POSITIVE), maximum);
    set.insert(etg_key(etg::SMS, 1, etg::sms::VELOCITY_MAXIMUM_NEGATIVE), maximum);
    hints.limit(maximum.into());
    for (bit, instance) in [(c::SS1_1, 1), (c::SS1_2, 2)] {
        let window = random.between(1, 60) as i32;
        let keys = [
            etg::ss1::TIME_TO_STO,
            etg::ss1::DECELERATION_LIMIT,
            etg::ss1::TIME_DELAY_DECELERATION_MONITORING,
        ];
        let approach = etg_ramp(&mut set, random, (etg::SS1, instance), keys, i64::from(window));
        set.insert(etg_key(etg::SS1, instance, etg::ss1::VELOCITY_ZERO_WINDOW), window);
        if random.chance(40) {
            set.insert(
                etg_key(etg::SS1, instance, etg::ss1::TIME_FOR_VELOCITY_ZERO),
                random.between(1, 100) as i32,
            );
        }
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
    }
    for (bit, sos_bit, instance) in [(c::SS2_1, c::SOS_1, 1), (c::SS2_2, c::SOS_2, 2)] {
        let window = random.between(1, 60) as i32;
        let keys = [
            etg::ss2::TIME_TO_SOS,
            etg::ss2::DECELERATION_LIMIT,
            etg::ss2::TIME_DELAY_DECELERATION_MONITORING,
        ];
        let approach = etg_ramp(&mut set, random, (etg::SS2, instance), keys, i64::from(window));
        // ETG-SOS-02: optional; without it the line of SS2 ends at 0 rpm.
        if random.chance(75) {
            set.insert(etg_key(etg::SOS, instance, etg::sos::VELOCITY_ZERO_WINDOW), window);
        }
        if random.chance(60) {
            set.insert(etg_key(etg::SS2, instance, etg::ss2::ERROR_REACTION), etg_reaction(random));
        }
        set.insert(
            etg_key(etg::SOS, instance, etg::sos::POSITION_ZERO_WINDOW),
            random.between(20, 5000) as i32,
        );
        set.insert(
            etg_key(etg::SS2, instance, etg::ss2::RESTART_ACKNOWLEDGE_BEHAVIOR),
            random.between(0, 1) as i32,
        );
        hints.limit(window.into());
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
        hints.requests.push(low(sos_bit));
    }
    for (bit, instance) in [(c::SLS_1, 1), (c::SLS_2, 2), (c::SLS_3, 3), (c::SLS_4, 4)] {
        let limit = random.between(1, maximum.into()) as i32;
        let keys = [
            etg::sls::TIME_TO_VELOCITY_MONITORING,
            etg::sls::DECELERATION_LIMIT,
            etg::sls::TIME_DELAY_DECELERATION_MONITORING,
        ];
        let approach = etg_ramp(&mut set, random, (etg::SLS, instance), keys, i64::from(limit));
        set.insert(etg_key(etg::SLS, instance, etg::sls::VELOCITY_LIMIT), limit);
        set.insert(etg_key(etg::SLS, instance, etg::sls::ERROR_REACTION), etg_reaction(random));
        hints.limit(limit.into());
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
    }
    for (bit, instance) in [(c::SSR_1, 1), (c::SSR_2, 2)] {
        let lower = random.between(-i64::from(maximum), i64::from(maximum) - 20) as i32;
        let upper = random.between(i64::from(lower) + 10, i64::from(maximum)) as i32;
        let keys = [
            etg::ssr::TIME_TO_VELOCITY_MONITORING,
            etg::ssr::DECELERATION_LIMIT,
            etg::ssr::TIME_DELAY_DECELERATION_MONITORING,
        ];
        let approach = etg_ramp(&mut set, random, (etg::SSR, instance), keys, i64::from(upper));
        set.insert(etg_key(etg::SSR, instance, etg::ssr::VELOCITY_UPPER_LIMIT), upper);
        set.insert(etg_key(etg::SSR, instance, etg::ssr::VELOCITY_LOWER_LIMIT), lower);
        set.insert(etg_key(etg::SSR, instance, etg::ssr::ERROR_REACTION), etg_reaction(random));
        hints.limits.extend([i64::from(upper) * 1000, i64::from(lower) * 1000]);
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
    }
    etg_positions(&mut set, random);
    hints.requests.extend([c::SLP_1, c::SLI_1, c::SLT_1, c::SAR_1, c::SDIP, c::SDIN].map(low));
    hints.accelerations = vec![0, 3000, -2000];
    hints.torques = vec![0, 80, -60];
    (set, hints)
}

fn etg_positions(set: &mut BTreeMap<u32, i32>, random: &mut Random) {
    let size = |random: &mut Random| random.between(100, 500_000) as i32;
    set.extend([
        (etg_key(etg::SLP, 1, etg::slp::POSITION_UPPER_LIMIT), size(random)),
        (etg_key(etg::SLP, 1, etg::slp::POSITION_LOWER_LIMIT), -size(random)),
        (etg_key(etg::SLP, 1, etg::slp::ERROR_REACTION), etg_reaction(random)),
        (etg_key(etg::SLI, 1, etg::sli::POSITION_RELATIVE_UPPER_LIMIT), size(random)),
        (etg_key(etg::SLI, 1, etg::sli::POSITION_RELATIVE_LOWER_LIMIT), size(random)),
        (etg_key(etg::SLT, 1, etg::slt::TORQUE_LIMIT_POSITIVE_DIRECTION), 800),
        (etg_key(etg::SLT, 1, etg::slt::TORQUE_LIMIT_NEGATIVE_DIRECTION), 600),
        (etg_key(etg::SAR, 1, etg::sar::ACCELERATION_UPPER_LIMIT), 3000),
        (etg_key(etg::SAR, 1, etg::sar::ACCELERATION_LOWER_LIMIT), -2000),
        (etg_key(etg::SDI, 1, etg::sdi::POSITION_ZERO_WINDOW), size(random)),
        (etg_key(etg::SDI, 1, etg::sdi::VELOCITY_ZERO_WINDOW), random.between(1, 40) as i32),
        (etg_key(etg::SSM, 1, etg::ssm::VELOCITY_UPPER_LIMIT), 30),
        (etg_key(etg::SSM, 1, etg::ssm::VELOCITY_LOWER_LIMIT), -30),
        (etg_key(etg::SCA, 1, etg::sca::POSITION_UPPER_LIMIT), size(random)),
        (etg_key(etg::SCA, 1, etg::sca::POSITION_LOWER_LIMIT), -size(random)),
    ]);
}

/// STO as often as the others together; none (0) seldom, because nothing ends what it reports.
fn etg_reaction(random: &mut Random) -> i32 {
    let stops = [(etg::SS1, 1), (etg::SS1, 2), (etg::SS2, 1), (etg::SS2, 2)];
    match random.between(0, 99) {
        0..=11 => 0,
        12..=55 => reference(etg::STO, 1),
        _ => {
            let (function, instance) = random.pick(&stops);
            reference(function, instance)
        }
    }
}

/// Time, slope and delay of an instance; two of three monitor the line.
fn etg_ramp(
    set: &mut BTreeMap<u32, i32>,
    random: &mut Random,
    (function, instance): (u32, u32),
    [time, slope, delay]: [u32; 3],
    target_rpm: i64,
) -> Approach {
    let to_target = random.pick(&[400, 800, 2000]);
    let per_second = random.pick(&[1500, 3000, 7777]);
    let wait = random.pick(&[0, 1, 50, 300]);
    set.insert(etg_key(function, instance, time), to_target);
    let monitored = random.chance(66);
    if monitored {
        set.insert(etg_key(function, instance, slope), per_second);
        set.insert(etg_key(function, instance, delay), wait);
    }
    Approach { delay: wait.into(), slope: (per_second.into(), 1), target: target_rpm * 1000 }
}
