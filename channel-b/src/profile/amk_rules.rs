//! AMK: the rules channel 2 is responsible for, judged from the raw values (AMKP-PLAUS).
//! Families of rows are tables; each rule names the code it is reported with.

use shm_schema::error::ErrorCode;
use shm_schema::facts;

/// Smallest ratio of sampling period to pulse of an input (DEC-46): the outputs demand 10,
/// and an input has to accept pulses longer than the output's.
const INPUT_RATIO: i64 = 5;
/// Flattest and steepest ramp, rpm/s (DEC-52).
const SLOPE: (i64, i64) = (1, 10_000_000);
const SPEED: i64 = 60_000;

/// Info3, level parameter, pulses, periods, Info2 of the level in 3605/22.
type InputRow = (u32, u32, [u32; 2], [u32; 2], u32);
/// The input pairs.
const INPUTS: [InputRow; 3] =
    [(1, 70, [71, 73], [72, 74], 16), (2, 76, [77, 79], [78, 80], 17), (3, 82, [83, 85], [84, 86], 18)];
/// Outputs: first Info2, pulses, periods.
const OUTPUTS: [(u32, [u32; 2], [u32; 2]); 3] =
    [(1, [88, 90], [89, 91]), (10, [94, 96], [95, 97]), (20, [99, 101], [100, 102])];
/// Switches of 3605/26: Info2, parameter.
const SWITCHES: [(u32, u32); 5] = [(7, 87), (17, 93), (8, 92), (18, 98), (28, 104)];
/// Ramped functions: Info1, ramp time, the two limits.
const RAMPS: [(u32, u32, u32, u32); 8] = [
    (101, 20, 21, 21),
    (102, 25, 26, 26),
    (104, 32, 33, 34),
    (109, 38, 39, 40),
    (110, 44, 45, 46),
    (111, 50, 51, 52),
    (112, 56, 57, 57),
    (113, 61, 62, 62),
];
/// Inputs may request these (AMKP-SE-04); 16 is none.
const ASSIGNABLE: [i64; 11] = [3, 4, 5, 6, 9, 10, 11, 12, 13, 14, 16];

/// Collects findings of one set.
struct Rules<'a> {
    value: &'a dyn Fn(u32) -> i64,
    report: &'a mut dyn FnMut(ErrorCode),
    found: bool,
}

/// Every rule of channel 2 over the set that `value` reads; `raw` finds what is carried.
pub fn findings(
    value: &dyn Fn(u32) -> i64,
    raw: &dyn Fn(u32) -> Option<i64>,
    report: &mut dyn FnMut(ErrorCode),
) {
    let mut rules = Rules { value, report, found: false };
    rules.general(raw);
    rules.inputs();
    rules.assignment();
    rules.outputs();
    rules.ramps();
    rules.windows();
    if !rules.found {
        rules.ranges(raw);
    }
}

impl Rules<'_> {
    fn when(&mut self, violated: bool, info: [u32; 3]) {
        if violated {
            self.found = true;
            let [info1, info2, info3] = info;
            (self.report)(ErrorCode::amk(3605, info1, info2, info3));
        }
    }

    fn prm(&self, number: u32) -> i64 {
        (self.value)(number)
    }

    fn any(&self, numbers: [u32; 2], violates: impl Fn(i64) -> bool) -> bool {
        numbers.iter().any(|number| violates(self.prm(*number)))
    }

    fn is_switch(&self, number: u32) -> bool {
        matches!(self.prm(number), 0 | 1)
    }

    /// AMKP-PLAUS-003, 004, 056 to 058, 104, 105.
    fn general(&mut self, raw: &dyn Fn(u32) -> Option<i64>) {
        let uses_sine = self.any([4, 5], |kind| kind == 1);
        let periods = self.prm(6);
        if let Some(drive) = raw(32_776) {
            self.when(uses_sine & (drive != periods), [200, drive as u32, periods as u32]);
        }
        let factor = self.prm(105);
        self.when(!(7..=199).contains(&factor), [13, 9, 0]);
        let (source, outputs) = (self.is_switch(7), self.is_switch(8));
        self.when(!source & !outputs, [24, 2, 0]);
        self.when(!source, [24, 3, 0]);
        self.when(!outputs, [24, 4, 0]);
        self.when(self.prm(9) > 60_000, [39, 1, 0]);
        self.when(self.prm(10) > 60_000, [39, 2, 0]);
    }

    /// AMKP-PLAUS-011 to 016, 026 to 037, 050 to 052.
    fn inputs(&mut self) {
        for (input, level, pulses, periods, info2) in INPUTS {
            self.when(self.any(pulses, |pulse| pulse < 250), [17, 1, input]);
            self.when(self.any(pulses, |pulse| pulse > 65_500), [17, 3, input]);
            self.when(self.any(periods, |period| period > 64_000), [19, 2, input]);
            self.when(self.any(periods, |period| period < 50), [19, 3, input]);
            self.when(self.is_short(pulses, periods, INPUT_RATIO), [19, 5, input]);
            let is_switch = self.is_switch(level);
            self.when(!is_switch, [19, 6, input]);
            self.when(!is_switch, [22, info2, 0]);
        }
    }

    /// A period, ms, is shorter than `ratio` pulses, µs.
    fn is_short(&self, pulses: [u32; 2], periods: [u32; 2], ratio: i64) -> bool {
        let mut lines = pulses.iter().zip(periods);
        lines.any(|(pulse, period)| {
            self.prm(period).saturating_mul(1_000) < self.prm(*pulse).saturating_mul(ratio)
        })
    }

    /// AMKP-PLAUS-044 to 049.
    fn assignment(&mut self) {
        let [first, second, stop] = [15, 16, 17].map(|number| self.prm(number));
        self.when(!(0..=2).contains(&stop), [22, 1, 0]);
        self.when(!ASSIGNABLE.contains(&first), [22, 2, 0]);
        self.when(!ASSIGNABLE.contains(&second), [22, 3, 0]);
        self.when(first == stop, [22, 4, 0]);
        self.when(second == stop, [22, 5, 0]);
        self.when((first == second) & (first != 16), [22, 6, 0]);
    }

    /// AMKP-PLAUS-079 to 101.
    fn outputs(&mut self) {
        for (info2, pulses, periods) in OUTPUTS {
            let at = |offset: u32| [26, info2.saturating_add(offset), 0];
            self.when(self.any(periods, |period| period > 65_500), at(0));
            self.when(self.any(periods, |period| period < 50), at(1));
            self.when(self.any(pulses, |pulse| pulse > 65_500), at(2));
            self.when(self.any(pulses, |pulse| pulse < 500), at(3));
            self.when(self.any(pulses, |pulse| pulse.checked_rem(125) != Some(0)), at(4));
            self.when(self.is_short(pulses, periods, 10), at(5));
        }
        for (info2, number) in SWITCHES {
            self.when(!self.is_switch(number), [26, info2, 0]);
        }
    }

    /// AMKP-PLAUS-106 to 131, 136 to 187, 199 to 224.
    fn ramps(&mut self) {
        let reference = self.prm(67);
        for (info1, ramp, upper, lower) in RAMPS {
            self.limits(info1, upper, lower);
            self.when(reference > SPEED, [info1, 0, 5]);
            self.when(self.prm(ramp) == 0, [info1, 0, 6]);
            self.slope(info1, self.prm(ramp), reference);
        }
    }

    fn limits(&mut self, info1: u32, upper: u32, lower: u32) {
        let [first, second] = [self.prm(upper), self.prm(lower)];
        if upper == lower {
            // SS1 has no Info2 1 for a zero window; SS1 and SS2 number the sides the other way.
            let is_stop = info1 < 103;
            let (below, above) = if is_stop { (2, 3) } else { (3, 2) };
            self.when((first == 0) & (info1 != 101), [info1, 1, 0]);
            self.when(first > SPEED, [info1, 7, 0]);
            self.when(first < -SPEED, [info1, 8, 0]);
            self.when(first > SPEED, [info1, 0, above]);
            self.when(first < -SPEED, [info1, 0, below]);
            self.when(first == 0, [info1, 0, 4]);
            return;
        }
        let is_far = |value: i64| value.saturating_abs() > SPEED;
        self.when(first == second, [info1, 1, 0]);
        self.when(is_far(first), [info1, 7, 0]);
        self.when(is_far(second), [info1, 8, 0]);
        self.when(is_far(first), [info1, 0, 2]);
        self.when(is_far(second), [info1, 0, 3]);
        self.when(first == second, [info1, 0, 4]);
    }

    fn slope(&mut self, info1: u32, ramp_ms: i64, reference: i64) {
        if ramp_ms <= 0 {
            return;
        }
        let speed = reference.saturating_mul(1_000);
        let is_flat = speed < ramp_ms.saturating_mul(SLOPE.0);
        let is_steep = speed > ramp_ms.saturating_mul(SLOPE.1);
        self.when(is_flat, [info1, 0, 10]);
        self.when(is_flat | is_steep, [info1, 0, 11]);
        self.when(is_flat | is_steep, [info1, 0, 13]);
    }

    /// AMKP-PLAUS-119, 132 to 135, 188 to 198, 225 to 228.
    fn windows(&mut self) {
        let [sdi, maximum, zero] = [self.prm(64), self.prm(67), self.prm(28)];
        let is_far = |value: i64| value.saturating_abs() > SPEED;
        self.when(self.prm(27) == 0, [102, 2, 0]);
        self.when(zero == 0, [103, 1, 0]);
        self.when(self.prm(29) == 0, [103, 2, 0]);
        self.when(zero > SPEED, [103, 7, 0]);
        self.when(zero < -SPEED, [103, 8, 0]);
        for (info1, of_sdi, of_maximum) in [(105, 7, 8), (106, 8, 7)] {
            self.when(sdi == maximum, [info1, 1, 0]);
            self.when(is_far(sdi), [info1, of_sdi, 0]);
            self.when(is_far(maximum), [info1, of_maximum, 0]);
            self.when(maximum > SPEED, [info1, 0, 5]);
        }
        for info1 in [108, 114] {
            self.when(maximum == 0, [info1, 1, 0]);
            self.when(maximum > SPEED, [info1, 7, 0]);
            self.when(maximum < -SPEED, [info1, 8, 0]);
        }
        self.when(self.prm(65) == self.prm(66), [114, 2, 0]);
    }

    /// AMKP-SET-05: rows exist for few ranges; what has none is reported as a parameter that
    /// cannot be read, with its number.
    fn ranges(&mut self, raw: &dyn Fn(u32) -> Option<i64>) {
        for row in &facts::amk_kw::PARAMETERS {
            let outside = raw(row.key).is_some_and(|value| !(row.min..=row.max).contains(&value));
            if outside {
                (self.report)(ErrorCode::amk(3607, 30, row.key, 3));
            }
        }
    }
}
