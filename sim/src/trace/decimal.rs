//! Decimal numbers as exact integers of a chosen number of digits.

/// Most digits behind the point that are kept; more are rounded to nearest.
pub const DIGITS_MAX: u32 = 12;

/// A decimal number: `mantissa * 10^-digits`, digits as few as the text needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decimal {
    /// All digits as one integer.
    pub mantissa: i128,
    /// Digits behind the point, 0 to [`DIGITS_MAX`].
    pub digits: u32,
}

impl Decimal {
    /// Reads `-12.5`, `+3`, `.5`, `1e-3`. `None` for anything else or beyond 10^15.
    pub fn parse(text: &str) -> Option<Self> {
        let (number, exponent) = match text.split_once(['e', 'E']) {
            Some((number, exponent)) => (number, exponent.parse::<i32>().ok()?),
            None => (text, 0),
        };
        let (negative, unsigned) = match number.strip_prefix('-') {
            Some(rest) => (true, rest),
            None => (false, number.strip_prefix('+').unwrap_or(number)),
        };
        let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
        let all_digits = |part: &str| part.bytes().all(|octet| octet.is_ascii_digit());
        let empty = whole.is_empty() & fraction.is_empty();
        let sound = all_digits(whole) && all_digits(fraction) && !empty;
        let bounded = (whole.len() <= 15) & (fraction.len() <= 22) & (exponent.abs() <= 15);
        if !(sound & bounded) {
            return None;
        }
        let digits = format!("{whole}{fraction}").parse::<i128>().ok()?;
        let signed = if negative { -digits } else { digits };
        Self::normal(signed, fraction.len() as i32 - exponent)
    }

    fn normal(mut mantissa: i128, mut digits: i32) -> Option<Self> {
        while digits < 0 {
            mantissa = mantissa.checked_mul(10)?;
            digits += 1;
        }
        while (digits > 0) && (mantissa % 10 == 0) {
            mantissa /= 10;
            digits -= 1;
        }
        let exact = Self { mantissa, digits: digits as u32 };
        let kept = exact.digits.min(DIGITS_MAX);
        let result = Self { mantissa: exact.scaled(kept)?, digits: kept };
        let limit = 10_i128.checked_pow(15 + kept)?;
        if result.mantissa.abs() <= limit { Some(result) } else { None }
    }

    /// The value in units of `10^-digits`, rounded to nearest when it has more digits.
    pub fn scaled(self, digits: u32) -> Option<i128> {
        if digits >= self.digits {
            return self.mantissa.checked_mul(10_i128.checked_pow(digits - self.digits)?);
        }
        Some(round_quotient(self.mantissa, 10_i128.checked_pow(self.digits - digits)?))
    }
}

/// `numerator / denominator` rounded to nearest, halves away from zero. The denominator
/// is positive.
pub fn round_quotient(numerator: i128, denominator: i128) -> i128 {
    round_offset_quotient(0, numerator, denominator)
}

/// `offset + numerator / denominator` rounded to nearest, halves of the sum away from zero.
pub fn round_offset_quotient(offset: i128, numerator: i128, denominator: i128) -> i128 {
    let floor = offset + numerator.div_euclid(denominator);
    let rest = numerator.rem_euclid(denominator);
    let other = denominator - rest;
    let up = (rest > other) || (rest == other) && (floor >= 0);
    floor + i128::from(up)
}
