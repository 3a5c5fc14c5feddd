//! The plausibility rules of the AMK set that channel 1 checks (AMKP-PLAUS): a table of
//! rows, walked once at start and by `params check`.

use shm_schema::error::ErrorCode;
use shm_schema::facts::Parameter;
use shm_schema::facts::amk_kw::thresholds::{INPUT_RATIO, SLOPE_MIN};

use crate::image::Image;

const SPEED: i64 = 60_000;
/// Smallest ratio of period to pulse of an output (AMKP-SA-06).
const OUTPUT_RATIO: i64 = 10;
const ASSIGNABLE: u32 = 1 << 3 | 1 << 4 | 1 << 5 | 1 << 6 | 0b0111_1110 << 8 | 1 << 16;

/// What breaks a rule.
#[derive(Clone, Copy)]
enum Broken {
    Below(u32, i64),
    Above(u32, i64),
    AbsoluteAbove(u32, i64),
    Zero(u32),
    Equal(u32, u32),
    EqualAssigned(u32, u32),
    NotAssignable(u32),
    NotBoolean(u32),
    OffGrid(u32, i64),
    /// Period in ms below so many pulses in µs.
    Ratio(u32, u32, i64),
    /// Reference speed over ramp time in ms is too small; too steep is channel 2's row.
    Flat(u32, u32),
}
use Broken::{
    Above, AbsoluteAbove, Below, Equal, EqualAssigned, Flat, NotAssignable, NotBoolean, OffGrid, Ratio, Zero,
};

/// Info1, Info2, Info3, and any of these breaks the rule.
type Row = (u32, u32, u32, &'static [Broken]);

const ROWS: &[Row] = &[
    (7, 1, 0, &[Below(6, 16)]),
    (7, 2, 0, &[Above(6, 65_536)]),
    (13, 9, 0, &[Below(105, 7), Above(105, 199)]),
    (16, 1, 1, &[Below(71, 250), Below(73, 250)]),
    (16, 3, 1, &[Above(71, 65_500), Above(73, 65_500)]),
    (16, 1, 2, &[Below(77, 250), Below(79, 250)]),
    (16, 3, 2, &[Above(77, 65_500), Above(79, 65_500)]),
    (16, 1, 3, &[Below(83, 250), Below(85, 250)]),
    (16, 3, 3, &[Above(83, 65_500), Above(85, 65_500)]),
    (18, 2, 1, &[Above(72, 64_000), Above(74, 64_000)]),
    (18, 3, 1, &[Below(72, 50), Below(74, 50)]),
    (18, 5, 1, &[Ratio(72, 71, INPUT_RATIO), Ratio(74, 73, INPUT_RATIO)]),
    (18, 2, 2, &[Above(78, 64_000), Above(80, 64_000)]),
    (18, 3, 2, &[Below(78, 50), Below(80, 50)]),
    (18, 5, 2, &[Ratio(78, 77, INPUT_RATIO), Ratio(80, 79, INPUT_RATIO)]),
    (18, 2, 3, &[Above(84, 64_000), Above(86, 64_000)]),
    (18, 3, 3, &[Below(84, 50), Below(86, 50)]),
    (18, 5, 3, &[Ratio(84, 83, INPUT_RATIO), Ratio(86, 85, INPUT_RATIO)]),
    (20, 1, 0, &[Below(17, 0), Above(17, 2)]),
    (20, 2, 0, &[NotAssignable(15)]),
    (20, 3, 0, &[NotAssignable(16)]),
    (20, 4, 0, &[Equal(15, 17)]),
    (20, 5, 0, &[Equal(16, 17)]),
    (20, 6, 0, &[EqualAssigned(15, 16)]),
    (23, 3, 0, &[NotBoolean(7)]),
    (23, 4, 0, &[NotBoolean(8)]),
    (25, 1, 0, &[Above(89, 65_500), Above(91, 65_500)]),
    (25, 2, 0, &[Below(89, 50), Below(91, 50)]),
    (25, 3, 0, &[Above(88, 65_500), Above(90, 65_500)]),
    (25, 4, 0, &[Below(88, 500), Below(90, 500)]),
    (25, 5, 0, &[OffGrid(88, 125), OffGrid(90, 125)]),
    (25, 6, 0, &[Ratio(89, 88, OUTPUT_RATIO), Ratio(91, 90, OUTPUT_RATIO)]),
    (25, 7, 0, &[NotBoolean(87)]),
    (25, 10, 0, &[Above(95, 65_500), Above(97, 65_500)]),
    (25, 11, 0, &[Below(95, 50), Below(97, 50)]),
    (25, 12, 0, &[Above(94, 65_500), Above(96, 65_500)]),
    (25, 13, 0, &[Below(94, 500), Below(96, 500)]),
    (25, 14, 0, &[OffGrid(94, 125), OffGrid(96, 125)]),
    (25, 15, 0, &[Ratio(95, 94, OUTPUT_RATIO), Ratio(97, 96, OUTPUT_RATIO)]),
    (25, 17, 0, &[NotBoolean(93)]),
    (25, 20, 0, &[Above(100, 65_500), Above(102, 65_500)]),
    (25, 21, 0, &[Below(100, 50), Below(102, 50)]),
    (25, 22, 0, &[Above(99, 65_500), Above(101, 65_500)]),
    (25, 23, 0, &[Below(99, 500), Below(101, 500)]),
    (25, 24, 0, &[OffGrid(99, 125), OffGrid(101, 125)]),
    (25, 25, 0, &[Ratio(100, 99, OUTPUT_RATIO), Ratio(102, 101, OUTPUT_RATIO)]),
    (38, 1, 0, &[Above(9, 60_000)]),
    (38, 2, 0, &[Above(10, 60_000)]),
    // SS1
    (101, 7, 0, &[Above(21, SPEED)]),
    (101, 8, 0, &[Below(21, -SPEED)]),
    (101, 0, 2, &[Below(21, -SPEED)]),
    (101, 0, 3, &[Above(21, SPEED)]),
    (101, 0, 4, &[Zero(21)]),
    // SS2
    (102, 1, 0, &[Zero(26)]),
    (102, 2, 0, &[Zero(27)]),
    (102, 7, 0, &[Above(26, SPEED)]),
    (102, 8, 0, &[Below(26, -SPEED)]),
    (102, 0, 2, &[Below(26, -SPEED)]),
    (102, 0, 3, &[Above(26, SPEED)]),
    (102, 0, 4, &[Zero(26)]),
    // SOS
    (103, 1, 0, &[Zero(28)]),
    (103, 2, 0, &[Zero(29)]),
    (103, 7, 0, &[Above(28, SPEED)]),
    (103, 8, 0, &[Below(28, -SPEED)]),
    // SDIp, SDIn: which parameter is Info2 7 is swapped between them (AMKP-SDI-03)
    (105, 1, 0, &[Equal(64, 67)]),
    (105, 7, 0, &[AbsoluteAbove(64, SPEED)]),
    (105, 8, 0, &[AbsoluteAbove(67, SPEED)]),
    (105, 0, 5, &[Above(67, SPEED)]),
    (106, 1, 0, &[Equal(64, 67)]),
    (106, 7, 0, &[AbsoluteAbove(67, SPEED)]),
    (106, 8, 0, &[AbsoluteAbove(64, SPEED)]),
    (106, 0, 5, &[Above(67, SPEED)]),
    // SMS
    (108, 1, 0, &[Zero(67)]),
    (108, 7, 0, &[Above(67, SPEED)]),
    (108, 8, 0, &[Below(67, -SPEED)]),
    // SLI
    (114, 1, 0, &[Zero(67)]),
    (114, 2, 0, &[Equal(65, 66)]),
    (114, 7, 0, &[Above(67, SPEED)]),
    (114, 8, 0, &[Below(67, -SPEED)]),
];

/// SSR1 to SSR4: Info1, ramp time, upper, lower.
const RANGES: [[u32; 4]; 4] = [[104, 32, 33, 34], [109, 38, 39, 40], [110, 44, 45, 46], [111, 50, 51, 52]];
/// SLS1, SLS2: Info1, ramp time, limit.
const LIMITS: [[u32; 3]; 2] = [[112, 56, 57], [113, 61, 62]];
/// Every monitored ramp: Info1, ramp time.
const RAMPS: [[u32; 2]; 8] =
    [[101, 20], [102, 25], [104, 32], [109, 38], [110, 44], [111, 50], [112, 56], [113, 61]];
/// Periods of the sine encoder as the drive has them: not safe, and only compared when given.
const DRIVE_PERIODS: u32 = 32_776;

fn is_broken(image: &Image, rule: Broken) -> bool {
    let p = |number: u32| image.value(number);
    match rule {
        Below(number, limit) => p(number) < limit,
        Above(number, limit) => p(number) > limit,
        AbsoluteAbove(number, limit) => p(number).saturating_abs() > limit,
        Zero(number) => p(number) == 0,
        Equal(one, other) => p(one) == p(other),
        EqualAssigned(one, other) => (p(one) == p(other)) & (p(one) != 16),
        NotAssignable(number) => {
            let value = u32::try_from(p(number)).unwrap_or(u32::MAX);
            ASSIGNABLE.checked_shr(value).is_none_or(|bits| bits & 1 == 0)
        }
        NotBoolean(number) => !(0..=1).contains(&p(number)),
        OffGrid(number, grid) => p(number).checked_rem(grid).is_none_or(|rest| rest != 0),
        Ratio(period, pulse, ratio) => p(period).saturating_mul(1_000) < p(pulse).saturating_mul(ratio),
        Flat(speed, time) => {
            let flat = p(speed).saturating_mul(1_000) < p(time).saturating_mul(SLOPE_MIN);
            (p(time) > 0) & flat
        }
    }
}

/// Every broken rule of `image` that is channel 1's, or both channels'.
pub fn findings(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    let mut judge = |info1: u32, info2: u32, info3: u32, rules: &[Broken]| {
        if rules.iter().any(|rule| is_broken(image, *rule)) {
            report(ErrorCode::amk(3605, info1, info2, info3));
        }
    };
    for (info1, info2, info3, rules) in ROWS {
        judge(*info1, *info2, *info3, rules);
    }
    for [info1, time] in RAMPS {
        judge(info1, 0, 5, &[Above(67, SPEED)]);
        judge(info1, 0, 6, &[Zero(time)]);
        judge(info1, 0, 7, &[Flat(67, time)]);
    }
    for [info1, _, upper, lower] in RANGES {
        for (info2, info3, rule) in [
            (1, 4, Equal(upper, lower)),
            (7, 2, AbsoluteAbove(upper, SPEED)),
            (8, 3, AbsoluteAbove(lower, SPEED)),
        ] {
            judge(info1, info2, 0, &[rule]);
            judge(info1, 0, info3, &[rule]);
        }
    }
    for [info1, _, limit] in LIMITS {
        for (info2, info3, rule) in
            [(1, 4, Zero(limit)), (7, 2, Above(limit, SPEED)), (8, 3, Below(limit, -SPEED))]
        {
            judge(info1, info2, 0, &[rule]);
            judge(info1, 0, info3, &[rule]);
        }
    }
    let both = is_broken(image, NotBoolean(7)) & is_broken(image, NotBoolean(8));
    if both {
        report(ErrorCode::amk(3605, 23, 2, 0));
    }
    sine_periods(image, report);
    ranges(image, report);
}

/// AMKP-ENC-02: the drive has to count the same periods.
fn sine_periods(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    let sine = [4, 5].iter().any(|number| image.value(*number) == 1);
    let Some(drive) = image.named(DRIVE_PERIODS).filter(|_| sine) else { return };
    let safe = image.value(6);
    if drive != safe {
        report(ErrorCode::amk(3605, 200, drive as u32, safe as u32));
    }
}

/// AMKP-SET-05: parameters without a row of their own are checked all the same. Reading
/// such a parameter fails: 3607/30, Info2 the number, Info3 the signed 32-bit read.
fn ranges(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    for key in image.keys() {
        let row = image.table().iter().find(|row| row.key == key);
        let inside = row.is_some_and(|row| holds(row, image.value(key)));
        let named = has_rows(key) & row.is_some();
        if !(inside | named) {
            report(ErrorCode::amk(3607, 30, key, 3));
        }
    }
}

fn holds(row: &Parameter, value: i64) -> bool {
    (row.min..=row.max).contains(&value)
}

/// Whether an out-of-range value of `key` already breaks a row of 3605.
fn has_rows(key: u32) -> bool {
    matches!(key, 6..=8 | 15..=17 | 20 | 21 | 25..=29 | 64 | 67 | 71..=74 | 77..=80 | 83..=91 | 93..=97 | 99..=102 | 105)
}
