//! Plausibility of a set.

use super::code;
use crate::image::Image;
use shm_schema::error::ErrorCode;
use shm_schema::facts::lenze_sm301::control;

/// 167 for every broken rule; Info1 and Info2 name code and subcode.
pub fn findings(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    let c = |number: u32| code(image, number, 0);
    let each = |number: u32| [1, 2, 3, 4].map(|subcode| code(image, number, subcode));
    let broken = |number: u32, subcode: u32| ErrorCode { code: 167, info1: number, info2: subcode, info3: 0 };
    let functions = each(15_031);
    let count = |wanted: i64| functions.iter().filter(|function| **function == wanted).count();
    let filter = c(15_113) as u32;
    let passes = |bit: u8| filter & (1 << (bit & 31)) != 0;
    let by_bus = (c(15_100) != 0) & passes(control::OMS) & (count(2) == 0);
    let stop_passes = passes(control::STO) | passes(control::SS1) | passes(control::SS2);
    let cascading = c(15_035) == 4;
    let encoderless = c(15_400) == 0;
    let assigned = each(15_032);
    let seeing = assigned.iter().any(|function| (2..=8).contains(function));
    let sole_resolver = (c(15_400) == 2) & (c(15_500) == 0);
    let rows = [
        (15_031, 0, (count(2) > 1) | (count(3) > 1)),
        (15_113, 11, (count(2) > 0) & passes(control::OMS)),
        (15_113, 9, (count(3) > 0) & passes(control::ES)),
        (15_113, 0, by_bus & !stop_passes),
        (15_202, 0, by_bus & (c(15_202) != 0)),
        (15_030, 4, cascading & (code(image, 15_030, 4) != 2)),
        (15_031, 4, cascading & (code(image, 15_031, 4) != 1)),
        (15_034, 4, cascading & (code(image, 15_034, 4) > 10)),
        (15_205, 0, cascading & (c(15_205) != 0)),
        (15_300, 1, cascading & (code(image, 15_300, 1) != 0)),
        (15_306, 0, cascading & (c(15_306) != 0)),
        (15_113, 24, cascading & passes(control::SD_OUT1)),
        (15_320, 0, encoderless & (c(15_320) != 0)),
        (15_203, 0, encoderless & (c(15_203) != 0)),
        (15_340, 0, encoderless & (c(15_340) != 0)),
        (15_315, 0, encoderless & (c(15_315) != 0)),
        (15_032, 0, encoderless & seeing),
        (15_410, 0, sole_resolver & (c(15_410) == 0)),
        (15_410, 0, ![0, 10, 20].contains(&c(15_410))),
    ];
    for (number, subcode, is_broken) in rows {
        if is_broken {
            report(broken(number, subcode));
        }
    }
    for (subcode, (function, assigned)) in (1..).zip(functions.into_iter().zip(assigned)) {
        // LNZ-IN-07
        if (function != 0) & (assigned != 9) {
            report(broken(15_032, subcode));
        }
    }
    for key in image.keys() {
        let row = image.table().iter().find(|row| row.key == key);
        let common = shm_schema::facts::common::PARAMETERS.iter().any(|row| row.key == key);
        let bits = row.is_some_and(|row| row.max > i64::from(i32::MAX));
        let inside = row.is_some_and(|row| (row.min..=row.max).contains(&image.value(key)));
        if !(inside | bits | common) {
            report(broken(key >> 8, key & 0xFF));
        }
    }
    super::super::common_findings(image, report);
}
