//! ATV340: ranges and compatibility of the parameters. The module has one error for a
//! configuration it cannot use, SME032.

use shm_schema::error::ErrorCode;
use shm_schema::facts;

use super::atv::parameter;
use crate::image::Image;

/// "Corrupted config".
const CONFIGURATION: ErrorCode = ErrorCode::single(0x032);

/// Every finding of the set.
pub fn findings(image: &Image<'_>, report: &mut dyn FnMut(ErrorCode)) {
    let rows = facts::atv340::PARAMETERS.iter().chain(&facts::common::PARAMETERS);
    let is_outside = |(key, value): (u32, i32)| {
        let row = rows.clone().find(|row| row.key == key);
        !row.is_some_and(|row| (row.min..=row.max).contains(&i64::from(value)))
    };
    let sc = |number: u32| parameter(image, number);
    let wrong = image.entries().any(is_outside) | motor(&sc) | ss1(&sc) | sls(&sc) | sms(&sc);
    if wrong {
        report(CONFIGURATION);
    }
}

fn uses_speed(sc: &dyn Fn(u32) -> i64) -> bool {
    (sc(65) == 1) | (sc(66) == 1) | (sc(56) != 0)
}

/// ATV-ENC-04, ATV-ENC-10: motor, pole pairs and encoder are known; a synchronous motor
/// needs an encoder.
fn motor(sc: &dyn Fn(u32) -> i64) -> bool {
    let is_unknown = (sc(1) == 0) | (sc(2) == 0) | (sc(5) == 0);
    let is_blind = (sc(1) == 2) & (sc(5) == 1);
    let has_resolution = (sc(5) <= 1) | (sc(6) > 0);
    uses_speed(sc) & (is_unknown | is_blind | !has_resolution)
}

/// ATV-SS1-19: what SS1 needs where it is used.
fn ss1(sc: &dyn Fn(u32) -> i64) -> bool {
    let is_used = (sc(65) == 1) | is_stopping_type(sc);
    let is_undefined = (sc(31) == 0) | (sc(33) == 0);
    let has_no_ramp = (sc(36) == 1) & (sc(30) == 0);
    is_used & (is_undefined | has_no_ramp)
}

/// SLS types 3 and 6 execute SS1.
fn is_stopping_type(sc: &dyn Fn(u32) -> i64) -> bool {
    (sc(66) == 1) & matches!(sc(39), 3 | 6)
}

/// ATV-SLS-04, ATV-SS1-20 and the table of the types.
fn sls(sc: &dyn Fn(u32) -> i64) -> bool {
    if sc(66) != 1 {
        return false;
    }
    let kind = sc(39);
    let is_external = is_stopping_type(sc) & (sc(36) != 1);
    let above = if kind == 1 { sc(46) > sc(48) } else { sc(50) > sc(48) };
    let below = matches!(kind, 2 | 3) & (sc(46) > sc(50));
    let has_no_line = matches!(kind, 2 | 5) & (sc(40) == 0);
    let highest = sc(48).max(sc(50)).max(sc(46));
    let is_above_sms = match sc(56) {
        0 => false,
        2 => highest > sc(57).min(sc(58)).min(sc(59)).min(sc(60)),
        _ => highest > sc(57).min(sc(58)),
    };
    (kind == 0) | is_external | above | below | has_no_line | is_above_sms
}

/// ATV-SMS-05.
fn sms(sc: &dyn Fn(u32) -> i64) -> bool {
    (sc(56) == 2) & ((sc(59) > sc(57)) | (sc(60) > sc(58)))
}
