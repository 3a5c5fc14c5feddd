//! ETG.6100.2: ranges and the rules between objects. A finding carries the key of the
//! object that is wrong (ETG-ERR-03 leaves codes to the maker).

use shm_schema::error::ErrorCode;
use shm_schema::facts::{self, etg};
use shm_schema::profile::{common, etg_key};

use crate::image::Image;

/// Function, time to monitoring, delay: the delay ends strictly earlier (ETG-SS1-09,
/// ETG-SS2-08, ETG-SSR-07, ETG-SLS-06).
const TIMES: [(u32, u32, u32); 4] = [(etg::SS1, 1, 5), (etg::SS2, 1, 4), (etg::SSR, 1, 6), (etg::SLS, 1, 5)];
/// Function, upper and lower limit, both signed: the upper lies above.
const PAIRS: [(u32, u32, u32); 5] =
    [(etg::SSR, 2, 3), (etg::SAR, 1, 2), (etg::SLP, 1, 2), (etg::SSM, 1, 2), (etg::SCA, 1, 2)];
/// Limits that are magnitudes (DEC-31); the deceleration of SMA is signed.
const MAGNITUDES: [u32; 2] = [etg::SMS, etg::SLI];

/// Every finding of the set.
pub fn findings(image: &Image<'_>, report: &mut dyn FnMut(ErrorCode)) {
    // ETG-GEN-05 permits more instances than there is room for, DEC-41 leaves some without a bit:
    // never left out silently.
    if let Some(key) = super::etg::unfit(image) {
        report(ErrorCode::single(key));
    }
    let rows = facts::etg_6100_2::PARAMETERS.iter().chain(&facts::common::PARAMETERS);
    for (key, value) in image.entries() {
        let is_word = (common::CONTROL_WORD..common::CC_FACTOR).contains(&key);
        if is_word {
            continue;
        }
        let known = if key >= common::CC_FACTOR { key } else { key & 0xFFFF_00FF };
        let row = rows.clone().find(|row| row.key == known);
        let fits = row.is_some_and(|row| (row.min..=row.max).contains(&i64::from(value)));
        if !fits {
            report(ErrorCode::single(key));
        }
        let is_limit = MAGNITUDES.contains(&(key >> 16)) & (key & 0xFF < 3);
        if is_limit & (value < 0) {
            report(ErrorCode::single(key));
        }
        between(image, key, report);
    }
}

/// Rules between two objects, judged where the first of them stands.
fn between(image: &Image<'_>, key: u32, report: &mut dyn FnMut(ErrorCode)) {
    let (function, instance, object) = (key >> 16, key >> 8 & 0xFF, key & 0xFF);
    let value = |object: u32| image.find(etg_key(function, instance, object));
    for (of, time, delay) in TIMES {
        let applies = (of == function) & (object == delay);
        if applies & (value(delay) >= value(time)) {
            report(ErrorCode::single(key));
        }
    }
    for (of, upper, lower) in PAIRS {
        let applies = (of == function) & (object == upper);
        if applies & (value(upper).unwrap_or(0) < value(lower).unwrap_or(0)) {
            report(ErrorCode::single(key));
        }
    }
}
