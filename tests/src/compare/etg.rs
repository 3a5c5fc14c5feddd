//! Meaningful parameters of the generic profile ETG.6100.2.

use std::collections::BTreeMap;

use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::control as c;
use shm_schema::profile::{common, etg_key, reference};

use super::hints::{Approach, Hints, Request};
use super::random::Random;

type Set = BTreeMap<u32, i32>;

/// Parameters that pass the profile's checks, and where something happens.
pub fn hints(random: &mut Random) -> (Set, Hints) {
    let mut set = Set::new();
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
        let approach = ramp(&mut set, random, (etg::SS1, instance), keys, i64::from(window));
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
        let approach = ramp(&mut set, random, (etg::SS2, instance), keys, i64::from(window));
        // ETG-SOS-02: optional; without it the line of SS2 ends at 0 rpm.
        if random.chance(75) {
            set.insert(etg_key(etg::SOS, instance, etg::sos::VELOCITY_ZERO_WINDOW), window);
        }
        if random.chance(60) {
            set.insert(etg_key(etg::SS2, instance, etg::ss2::ERROR_REACTION), reaction(random));
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
        let approach = ramp(&mut set, random, (etg::SLS, instance), keys, i64::from(limit));
        set.insert(etg_key(etg::SLS, instance, etg::sls::VELOCITY_LIMIT), limit);
        set.insert(etg_key(etg::SLS, instance, etg::sls::ERROR_REACTION), reaction(random));
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
        let approach = ramp(&mut set, random, (etg::SSR, instance), keys, i64::from(upper));
        set.insert(etg_key(etg::SSR, instance, etg::ssr::VELOCITY_UPPER_LIMIT), upper);
        set.insert(etg_key(etg::SSR, instance, etg::ssr::VELOCITY_LOWER_LIMIT), lower);
        set.insert(etg_key(etg::SSR, instance, etg::ssr::ERROR_REACTION), reaction(random));
        hints.limits.extend([i64::from(upper) * 1000, i64::from(lower) * 1000]);
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
    }
    positions(&mut set, random);
    hints.requests.extend([c::SLP_1, c::SLI_1, c::SLT_1, c::SAR_1, c::SDIP, c::SDIN].map(low));
    // Bits of default instances that `more_instances` may bring into being.
    hints.requests.extend([c::SSR_3, c::SLP_2, c::SLT_2].map(low));
    if random.chance(25) {
        more_instances(&mut set, random, maximum, &mut hints);
    }
    if random.chance(25) {
        brake(&mut set, random, &mut hints);
    }
    hints.accelerations = vec![0, 3000, -2000];
    hints.torques = vec![0, 80, -60];
    (set, hints)
}

fn positions(set: &mut Set, random: &mut Random) {
    let size = |random: &mut Random| random.between(100, 500_000) as i32;
    set.extend([
        (etg_key(etg::SLP, 1, etg::slp::POSITION_UPPER_LIMIT), size(random)),
        (etg_key(etg::SLP, 1, etg::slp::POSITION_LOWER_LIMIT), -size(random)),
        (etg_key(etg::SLP, 1, etg::slp::ERROR_REACTION), reaction(random)),
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
fn reaction(random: &mut Random) -> i32 {
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
fn ramp(
    set: &mut Set,
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

/// Functions with instances beyond those that have a bit of their own (DEC-41).
const MORE: [(u32, u32); 10] = [
    (etg::SLS, 5),
    (etg::SLS, 8),
    (etg::SSR, 3),
    (etg::SSR, 8),
    (etg::SLP, 2),
    (etg::SLP, 8),
    (etg::SLI, 5),
    (etg::SLT, 2),
    (etg::SAR, 7),
    (etg::SOS, 8),
];

/// Two to five more instances, commanded and shown in octets 5 to 8.
fn more_instances(set: &mut Set, random: &mut Random, maximum: i32, hints: &mut Hints) {
    for bit in 32..random.between(34, 37) as u8 {
        let (function, instance) = random.pick(&MORE);
        let key = |object| etg_key(function, instance, object);
        let size = random.between(1, maximum.into()) as i32;
        let (first, second) = match function {
            etg::SLS => (None, Some(size)),
            etg::SLI => (Some(size * 50), Some(size * 20)),
            etg::SLT => (Some(random.between(0, 900) as i32), Some(random.between(0, 900) as i32)),
            etg::SOS => (Some(size), Some(random.between(1, 60) as i32)),
            _ => (Some(size), Some(-size)),
        };
        match function {
            etg::SSR => {
                set.insert(key(etg::ssr::VELOCITY_UPPER_LIMIT), size);
                set.insert(key(etg::ssr::VELOCITY_LOWER_LIMIT), -size);
                set.insert(key(etg::ssr::TIME_TO_VELOCITY_MONITORING), random.pick(&[0, 100, 500]));
                set.insert(key(etg::ssr::ERROR_REACTION), reaction(random));
            }
            _ => {
                set.extend(first.map(|value| (key(1), value)));
                set.extend(second.map(|value| (key(2), value)));
            }
        }
        match function {
            etg::SLS => {
                set.insert(key(etg::sls::TIME_TO_VELOCITY_MONITORING), random.pick(&[0, 100, 500]));
                set.insert(key(etg::sls::ERROR_REACTION), reaction(random));
            }
            etg::SLP | etg::SLI | etg::SLT | etg::SAR => {
                set.insert(key(etg::sar::ERROR_REACTION), reaction(random));
            }
            _ => {}
        }
        if [etg::SLS, etg::SSR].contains(&function) {
            hints.limit(size.into());
        }
        assign(set, bit, (function, instance), hints);
    }
}

/// `[words]`: the same bit of both words; an instance that has one keeps it.
fn assign(set: &mut Set, bit: u8, (function, instance): (u32, u32), hints: &mut Hints) {
    let value = reference(function, instance);
    let has_bit = set.iter().any(|(key, other)| *key >= common::CONTROL_WORD && *other == value);
    let is_default = matches!((function, instance), (etg::SSR, 3) | (etg::SLP | etg::SLT, 2));
    if has_bit || is_default {
        return;
    }
    set.insert(common::CONTROL_WORD + u32::from(bit), value);
    set.insert(common::STATUS_WORD + u32::from(bit), value);
    hints.neutral_above |= 1 << bit;
    hints.requests.push(Request { bit, active_low: true, approach: None });
}

/// ETG-SBC-04 to 06: a brake, closed by its bit and in time for STO.
fn brake(set: &mut Set, random: &mut Random, hints: &mut Hints) {
    set.insert(etg_key(etg::SBC, 1, etg::sbc::BRAKE_TIME_DELAY), random.pick(&[0, 1, 50, 399]));
    for instance in 1..=2 {
        if random.chance(60) {
            set.insert(etg_key(etg::SS1, instance, etg::ss1::ACTIVATE_SBC), reference(etg::SBC, 1));
        }
    }
    hints.requests.push(Request { bit: c::SBC_1, active_low: true, approach: None });
}
