//! Plausibility of a set.

use crate::image::Image;
use shm_schema::error::ErrorCode;
use shm_schema::facts::etg;
use shm_schema::profile::etg_key;

/// Rules between objects (ETG-SS1-09 and its like, DEC-20, DEC-31).
pub fn findings(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    use etg::{sar, slp, sls, ss1, ss2, ssr};
    let delays = [
        (etg::SS1, ss1::TIME_TO_STO, ss1::TIME_DELAY_DECELERATION_MONITORING),
        (etg::SS2, ss2::TIME_TO_SOS, ss2::TIME_DELAY_DECELERATION_MONITORING),
        (etg::SSR, ssr::TIME_TO_VELOCITY_MONITORING, ssr::TIME_DELAY_DECELERATION_MONITORING),
        (etg::SLS, sls::TIME_TO_VELOCITY_MONITORING, sls::TIME_DELAY_DECELERATION_MONITORING),
    ];
    let pairs = [
        (etg::SSR, ssr::VELOCITY_UPPER_LIMIT, ssr::VELOCITY_LOWER_LIMIT),
        (etg::SAR, sar::ACCELERATION_UPPER_LIMIT, sar::ACCELERATION_LOWER_LIMIT),
        (etg::SLP, slp::POSITION_UPPER_LIMIT, slp::POSITION_LOWER_LIMIT),
    ];
    for key in image.keys() {
        let (function, instance, object) = (key >> 16, key >> 8 & 0xFF, key & 0xFF);
        let value = |object: u32| image.named(etg_key(function, instance, object));
        let broken = |(of, upper, lower): &(u32, u32, u32), strict: bool| {
            let (Some(upper), Some(lower)) = (value(*upper).filter(|_| *of == function), value(*lower))
            else {
                return false;
            };
            if strict { lower >= upper } else { lower > upper }
        };
        let late = delays.iter().any(|row| (row.2 == object) & broken(row, true));
        let crossed = pairs.iter().any(|row| (row.2 == object) & broken(row, false));
        let row = image.table().iter().find(|row| row.key == etg_key(function, 0, object) || row.key == key);
        let row = row.or_else(|| image.table().iter().find(|row| row.key == etg_key(function, 1, object)));
        let outside = row.is_some_and(|row| !(row.min..=row.max).contains(&image.value(key)));
        if late | crossed | outside {
            report(ErrorCode::amk(3605, function, instance, object));
        }
    }
    super::reach::findings(image, report);
    super::super::common_findings(image, report);
}
