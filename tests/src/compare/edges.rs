//! Numbers at the ends of their ranges, axes far from their origin, and speeds no motor turns.

use std::collections::BTreeMap;

use shm_schema::facts::etg;
use shm_schema::profile::{Profile, etg_key, lenze_key};

use super::hints::Hints;
use super::random::Random;

type Set = BTreeMap<u32, i32>;

/// Parameters (by number, code or object) and what they may be at their ends.
type Ends = (&'static [u32], &'static [i32]);

/// Times, windows and limits of AMK; a ramp time of 6 ms is the steepest slope of DEC-52.
const AMK: [Ends; 8] = [
    (&[18, 23, 30, 36, 42, 48, 54, 59], &[0, 65_535]),
    (&[20, 25, 32, 38, 44, 50, 56, 61], &[6, 65_535]),
    (&[21, 26, 28], &[1, 60_000]),
    (&[27, 29], &[1, -1, i32::MAX, -i32::MAX]),
    (&[33, 39, 45, 51], &[60_000]),
    (&[34, 40, 46, 52], &[-60_000]),
    (&[57, 62], &[1, -1, 60_000, -60_000]),
    (&[65], &[i32::MAX]),
];

const ATV: [Ends; 7] = [
    (&[31], &[1, 200_000]),
    (&[40], &[1, 200_000]),
    (&[32, 43], &[0, 2000]),
    (&[33], &[1, 2000]),
    (&[34], &[0, 3000]),
    (&[54], &[0, 65_535]),
    (&[65, 66], &[0]),
];

const LENZE: [Ends; 9] = [
    (&[15_305], &[0, 30_000]),
    (&[15_310], &[0]),
    (&[15_311, 15_342], &[0, 327_680]),
    (&[15_320], &[1, 16_000]),
    (&[15_330], &[0, 16_000]),
    (&[15_331, 15_350], &[0, 30_000]),
    (&[15_307], &[30_000]),
    (&[15_203], &[1, i32::MAX]),
    (&[15_316], &[0, 100]),
];

/// Function, objects and their ends.
const ETG: [(u32, Ends); 12] = [
    (etg::SLS, (&[etg::sls::VELOCITY_LIMIT], &[0, 1_000_000])),
    (etg::SLS, (&[etg::sls::DECELERATION_LIMIT], &[1, i32::MAX])),
    (etg::SLS, (&[etg::sls::TIME_TO_VELOCITY_MONITORING], &[65_535])),
    (etg::SS1, (&[etg::ss1::VELOCITY_ZERO_WINDOW], &[0])),
    (etg::SS1, (&[etg::ss1::TIME_TO_STO], &[65_535])),
    (etg::SS2, (&[etg::ss2::TIME_TO_SOS], &[65_535])),
    (etg::SSR, (&[etg::ssr::VELOCITY_UPPER_LIMIT], &[1_000_000])),
    (etg::SLP, (&[etg::slp::POSITION_UPPER_LIMIT], &[i32::MAX])),
    (etg::SLP, (&[etg::slp::POSITION_LOWER_LIMIT], &[i32::MIN])),
    (etg::SLI, (&[1, 2], &[0, i32::MAX])),
    (etg::SAR, (&[etg::sar::ACCELERATION_UPPER_LIMIT], &[i32::MAX])),
    (etg::SOS, (&[etg::sos::POSITION_ZERO_WINDOW], &[0, i32::MAX])),
];

/// Where 32 bits end, and where a double still tells increments apart.
const FAR: [i64; 8] = [
    i32::MAX as i64 - 60_000,
    i32::MAX as i64,
    i32::MIN as i64,
    i32::MIN as i64 + 60_000,
    u32::MAX as i64,
    1 << 40,
    -(1 << 40),
    -(1 << 52),
];

/// Puts one to three parameters at an end; the axis may begin far away or be very fast.
pub fn put(profile: Profile, random: &mut Random, set: &mut Set, hints: &mut Hints) {
    for _ in 0..random.between(1, 3) {
        match profile {
            Profile::AmkKw => end_of(random, set, &AMK, |number, _| number),
            Profile::Atv340 => end_of(random, set, &ATV, |number, _| number),
            Profile::LenzeSm301 => end_of(random, set, &LENZE, lenze_number),
            _ => end_of_etg(random, set),
        }
    }
    match profile {
        // DEC-52: the reference of every slope.
        Profile::AmkKw if random.chance(30) => {
            set.insert(67, 60_000);
            hints.limit(60_000);
        }
        Profile::Atv340 => keep_order(set),
        _ => {}
    }
    if random.chance(50) {
        hints.origins = FAR.to_vec();
    }
    if random.chance(30) {
        hints.limit(random.pick(&[60_000, 100_000, 400_000]));
    }
}

fn end_of(random: &mut Random, set: &mut Set, ends: &[Ends], key: fn(u32, u32) -> u32) {
    let (numbers, values) = random.pick(ends);
    let (number, value) = (random.pick(numbers), random.pick(values));
    set.insert(key(number, random.between(1, 4) as u32), value);
}

/// Codes with a value for each of the four SLS.
fn lenze_number(code: u32, index: u32) -> u32 {
    let has_subcodes = matches!(code, 15_330 | 15_331);
    lenze_key(code, if has_subcodes { index } else { 0 })
}

fn end_of_etg(random: &mut Random, set: &mut Set) {
    let (function, (objects, values)) = random.pick(&ETG);
    let key = etg_key(function, random.between(1, 2) as u32, random.pick(objects));
    // Only what the set names: an object may bring a whole instance into being.
    if set.contains_key(&key) {
        set.insert(key, random.pick(values));
    }
}

/// ATV-SLST2, ATV-SS1-20: types 3 and 6 of SLS ask for an SS1 that may be used.
fn keep_order(set: &mut Set) {
    let uses_ss1 = set.get(&65) == Some(&1);
    let type_is_ss1 = matches!(set.get(&39), Some(3 | 6));
    if !uses_ss1 && type_is_ss1 {
        set.insert(39, 4);
    }
}
