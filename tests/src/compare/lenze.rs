//! Meaningful parameters of the Lenze SM301.

use std::collections::BTreeMap;

use shm_schema::facts::lenze_sm301::control as c;
use shm_schema::profile::lenze_key;

use super::hints::{Approach, Hints, Request};
use super::random::Random;

type Set = BTreeMap<u32, i32>;

/// Parameters that pass the profile's checks, and where something happens.
pub fn hints(random: &mut Random) -> (Set, Hints) {
    let mut set = Set::new();
    let mut hints =
        Hints { acknowledge_bits: vec![c::PS_AIS, c::PS_AIE], has_terminals: true, ..Hints::default() };
    hints.limit(0);
    let maximum = random.pick(&[1500, 3000, 6000]);
    stops(&mut set, random, maximum, &mut hints);
    monitors(&mut set, random, maximum, &mut hints);
    special(&mut set, random, &mut hints);
    if random.chance(40) {
        hints.uses_lines = true;
        inputs(&mut set, random, &mut hints);
    }
    (set, hints)
}

fn code(set: &mut Set, code: u32, value: i32) {
    set.insert(lenze_key(code, 0), value);
}

fn low(bit: u8) -> Request {
    Request { bit, active_low: true, approach: None }
}

fn stops(set: &mut Set, random: &mut Random, maximum: i32, hints: &mut Hints) {
    let stopping = random.pick(&[2, 100, 500, 1000]);
    let window = random.between(1, 60) as i32;
    code(set, 15_400, 1);
    set.insert(lenze_key(15_300, 1), random.between(0, 1) as i32);
    set.insert(lenze_key(15_300, 2), random.between(0, 1) as i32);
    code(set, 15_305, stopping);
    code(set, 15_306, random.between(0, 1) as i32);
    code(set, 15_307, random.pick(&[0, 10, 300]));
    code(set, 15_308, random.between(0, 1) as i32);
    code(set, 15_310, window);
    code(set, 15_311, random.pick(&[0, 500, 20_000, 327_680]));
    code(set, 15_315, random.between(0, 1) as i32);
    code(set, 15_316, random.pick(&[0, 33, 100]));
    code(set, 15_317, random.pick(&[0, 10, 30]));
    code(set, 15_205, random.between(0, 1) as i32);
    hints.limit(window.into());
    let slope = (i64::from(maximum) * 1000, i64::from(stopping));
    let approach = Approach { delay: i64::from(stopping) / 10, slope, target: i64::from(window) * 1000 };
    hints.requests.extend([low(c::STO), low(c::SSE)]);
    hints.requests.extend([c::SS1, c::SS2].map(|bit| Request { approach: Some(approach), ..low(bit) }));
}

fn monitors(set: &mut Set, random: &mut Random, maximum: i32, hints: &mut Hints) {
    code(set, 15_320, random.pick(&[0, maximum, maximum]));
    code(set, 15_321, random.between(0, 2) as i32);
    code(set, 15_350, random.pick(&[0, 2, 100, 500]));
    hints.limit(maximum.into());
    for (index, bit) in (1..).zip([c::SLS1, c::SLS2, c::SLS3, c::SLS4]) {
        let limit = random.between(0, maximum.into()) as i32;
        let time = random.pick(&[0, 2, 100, 400]);
        set.insert(lenze_key(15_330, index), limit);
        set.insert(lenze_key(15_331, index), time);
        set.insert(lenze_key(15_332, index), random.between(0, 2) as i32);
        set.insert(lenze_key(15_333, index), random.pick(&[0, 0, 1, 2]));
        hints.limit(limit.into());
        let slope = (i64::from(maximum) * 1000, i64::from(time.max(1)));
        let approach = Approach { delay: 0, slope, target: i64::from(limit) * 1000 };
        hints.requests.push(Request { approach: Some(approach), ..low(bit) });
    }
    code(set, 15_340, random.pick(&[0, 0, 0, 1, 2]));
    code(set, 15_341, random.pick(&[0, 30, 200]));
    code(set, 15_342, random.pick(&[0, 100, 50_000]));
    code(set, 15_343, random.between(0, 2) as i32);
    hints.requests.extend([low(c::SDIPOS), low(c::SDINEG)]);
}

fn special(set: &mut Set, random: &mut Random, hints: &mut Hints) {
    code(set, 15_200, random.between(0, 2) as i32);
    code(set, 15_201, random.pick(&[3, 4, 5, 6, 11, 11]));
    code(set, 15_203, random.pick(&[0, 1, 30_000]));
    if random.chance(50) {
        let high = |bit| Request { bit, active_low: false, approach: None };
        hints.requests.extend([high(c::OMS), high(c::ES), high(c::ES)]);
    }
}

/// Every function of an input once at most; what an input selects the bus does not.
fn inputs(set: &mut Set, random: &mut Random, hints: &mut Hints) {
    let mut filter = -1_i32;
    let (mut selectors, mut enables) = (0, 0);
    for number in 1..=4 {
        let sensor = random.pick(&[0, 1, 2, 2]);
        set.insert(lenze_key(15_030, number), sensor);
        let function = match random.pick(&[0, 0, 0, 1, 2, 3]) {
            2 if selectors > 0 => 0,
            3 if enables > 0 => 0,
            _ if sensor == 0 => 0,
            function => function,
        };
        selectors += u32::from(function == 2);
        enables += u32::from(function == 3);
        set.insert(lenze_key(15_031, number), function);
        // 9 is "no function": the assignment counts for a free, used input only.
        let is_free = function == 0 && sensor != 0;
        let assigned = if is_free { random.between(0, 9) as i32 } else { 9 };
        set.insert(lenze_key(15_032, number), assigned);
        set.insert(lenze_key(15_033, number), random.pick(&[0, 2, 10, 100]));
        set.insert(lenze_key(15_034, number), random.pick(&[0, 0, 2, 20]));
    }
    if selectors > 0 {
        filter &= !(1 << c::OMS);
        code(set, 15_202, random.between(0, 1) as i32);
        hints.requests.retain(|request| request.bit != c::OMS);
    }
    if enables > 0 {
        filter &= !(1 << c::ES);
    }
    code(set, 15_113, filter);
}
