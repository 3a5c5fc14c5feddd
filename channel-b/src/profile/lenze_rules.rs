//! Lenze SM301: ranges and plausibility. The module has one message for all of it, 167.

use shm_schema::error::ErrorCode;
use shm_schema::facts;

use super::lenze::parameter;
use crate::image::Image;

/// "Plausibility error" of the parameter set.
const PLAUSIBILITY: ErrorCode = ErrorCode::single(167);

/// Every finding of the set.
pub fn findings(image: &Image<'_>, report: &mut dyn FnMut(ErrorCode)) {
    let rows = facts::lenze_sm301::PARAMETERS.iter().chain(&facts::common::PARAMETERS);
    let is_outside = |(key, value): (u32, i32)| {
        let row = rows.clone().find(|row| row.key == key);
        // A 32-bit field is its pattern: every value is possible.
        let is_field = row.is_some_and(|row| row.max > i64::from(i32::MAX));
        let fits = row.is_some_and(|row| (row.min..=row.max).contains(&i64::from(value)));
        !(fits | is_field)
    };
    let mut wrong = image.entries().any(is_outside);
    wrong |= inputs(image) | special(image) | cascade(image) | encoder(image);
    if wrong {
        report(PLAUSIBILITY);
    }
}

/// Number of used inputs with a sensor function.
fn count(image: &Image<'_>, function: i64) -> usize {
    let is_such =
        |at: &u32| (parameter(image, 15_030, *at) != 0) & (parameter(image, 15_031, *at) == function);
    (1..=4).filter(is_such).count()
}

/// LNZ-IN-06, LNZ-IN-07.
fn inputs(image: &Image<'_>) -> bool {
    let assigned_twice = (1..=4).any(|at| {
        let is_free = parameter(image, 15_031, at) == 0;
        !is_free & (parameter(image, 15_032, at) != 9)
    });
    assigned_twice | (count(image, 2) > 1) | (count(image, 3) > 1)
}

/// LNZ-OMS-19, LNZ-OMS-20, LNZ-ES-02.
fn special(image: &Image<'_>) -> bool {
    let passes = |bit: u32| {
        let has_bus = parameter(image, 15_100, 0) != 0;
        has_bus & (parameter(image, 15_113, 0) >> bit & 1 == 1)
    };
    let mode_twice = (count(image, 2) > 0) & passes(11);
    let enable_twice = (count(image, 3) > 0) & passes(9);
    let inverted_bus = (count(image, 2) == 0) & passes(11) & (parameter(image, 15_202, 0) == 1);
    mode_twice | enable_twice | inverted_bus
}

/// LNZ-CAS-09, LNZ-CAS-10, LNZ-RST-03, LNZ-SSE-02.
fn cascade(image: &Image<'_>) -> bool {
    if parameter(image, 15_035, 0) != 4 {
        return false;
    }
    let input = [(15_030, 4, 2), (15_031, 4, 1)]
        .iter()
        .all(|(code, sub, value)| parameter(image, *code, *sub) == *value);
    let delay = parameter(image, 15_034, 4) <= 10;
    let stops = [(15_205, 0), (15_306, 0)].iter().all(|(code, value)| parameter(image, *code, 0) == *value);
    let restart = parameter(image, 15_300, 1) == 0;
    let output = parameter(image, 15_113, 0) >> 24 & 1 == 0;
    !(input & delay & stops & restart & output)
}

/// LNZ-SPD-02, LNZ-SPD-10, LNZ-SS2-04, LNZ-RAMP-01.
fn encoder(image: &Image<'_>) -> bool {
    let of = |code: u32| parameter(image, code, 0);
    let is_sole_resolver = (of(15_400) == 2) & (of(15_500) == 0);
    let too_quick = is_sole_resolver & (of(15_410) == 0);
    let needs_speed = (of(15_320) > 0) | (of(15_203) > 0) | (of(15_315) == 1) | (of(15_340) != 0);
    // The response time is 12, 50 or 100 ms, coded 0, 10 and 20 (C15410).
    let is_unknown = !matches!(of(15_410), 0 | 10 | 20);
    too_quick | is_unknown | ((of(15_400) == 0) & needs_speed)
}
