//! Lines through given points, and walking along them cycle by cycle in exact arithmetic.

use super::decimal::{Decimal, round_offset_quotient, round_quotient};

/// One increment a millisecond is 1875/2048 rpm: 60,000 ms a minute over 65,536 increments
/// a revolution.
const INCREMENTS_NUMERATOR: i128 = 2_048;
const INCREMENTS_DENOMINATOR: i128 = 1_875;
/// Finest parts of an increment that [`Walker::integral`] gives.
pub const PARTS_MAX: i64 = 256;
const NS_PER_MS: i128 = 1_000_000;

/// Points joined by straight lines; before the first and behind the last the value stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Polyline {
    points: Vec<(i64, i128)>,
    unit: i128,
}

impl Polyline {
    /// 0 for ever.
    pub fn constant() -> Self {
        Self { points: vec![(0, 0)], unit: 1 }
    }

    /// The line through `points` (ns, strictly increasing, at least one) with as many digits
    /// as exact evaluation can carry. `None`: numbers too large for exact evaluation at all.
    pub fn new(points: &[(i64, Decimal)]) -> Option<Self> {
        let needed = points.iter().map(|(_, value)| value.digits).max().unwrap_or(0);
        (0..=needed).rev().find_map(|digits| Self::with_digits(points, digits))
    }

    fn with_digits(points: &[(i64, Decimal)], digits: u32) -> Option<Self> {
        let scaled = |(at, value): &(i64, Decimal)| Some((*at, value.scaled(digits)?));
        let points: Vec<_> = points.iter().map(scaled).collect::<Option<_>>()?;
        let line = Self { points, unit: 10_i128.checked_pow(digits)? };
        if line.evaluates() { Some(line) } else { None }
    }

    /// Whether no intermediate result of a [`Walker`] overflows, by its largest terms.
    fn evaluates(&self) -> bool {
        let fits = |index: usize| self.segment(index).largest_term(self.unit).is_some();
        (0..=self.points.len()).all(fits)
    }

    /// Segment `index`: the one that ends at point `index`; 0 is before the first point,
    /// the number of points is behind the last.
    fn segment(&self, index: usize) -> Segment {
        let last = self.points.len() - 1;
        let (end, to) = self.points[index.min(last)];
        match index {
            0 => Segment::flat(0, end.max(1), to),
            _ if index > last => Segment::flat(end, end.saturating_add(1), to),
            _ => {
                let (start, from) = self.points[index - 1];
                Segment::new(start, end, from, to)
            }
        }
    }
}

/// One straight piece. Times are in units of `grain` ns, the largest that the ends and all
/// whole milliseconds share, so that the numbers stay small.
#[derive(Debug, Clone, Copy)]
struct Segment {
    start_ns: i64,
    end_ns: i64,
    from: i128,
    rise: i128,
    grain: i128,
    length: i128,
}

impl Segment {
    fn flat(start_ns: i64, end_ns: i64, value: i128) -> Self {
        Self { start_ns, end_ns, from: value, rise: 0, grain: 1, length: 1 }
    }

    fn new(start_ns: i64, end_ns: i64, from: i128, to: i128) -> Self {
        if from == to {
            return Self::flat(start_ns, end_ns, from);
        }
        let duration = end_ns - start_ns;
        let grain = gcd(gcd(duration, start_ns), NS_PER_MS as i64);
        let length = i128::from(duration / grain);
        Self { start_ns, end_ns, from, rise: to - from, grain: i128::from(grain), length }
    }

    fn largest_term(&self, unit: i128) -> Option<i128> {
        let duration = i128::from(self.end_ns - self.start_ns);
        let sides = self.from.abs().checked_mul(2)?.checked_add(self.rise.abs())?;
        let area = sides.checked_mul(self.length)?.checked_mul(duration)?;
        let integral = area.checked_mul(2 * INCREMENTS_NUMERATOR)?.checked_mul(PARTS_MAX.into())?;
        let rest = denominator(unit)?.checked_mul(self.length)?.checked_mul(PARTS_MAX.into())?;
        let slope = self.rise.abs().checked_mul(SLOPE_NUMERATOR)?;
        let value = sides.checked_mul(self.length)?.checked_mul(1_000_000)?;
        let divisor = unit.checked_mul(duration)?.checked_mul(INCREMENTS_NUMERATOR)?;
        [rest, slope, value, divisor].iter().try_fold(integral, |sum, term| sum.checked_add(*term))
    }

    fn elapsed(&self, at_ns: i64) -> i128 {
        i128::from(at_ns - self.start_ns) / self.grain
    }

    /// Twice the area under the line from its start, times `length`, in unit * ns.
    fn double_area(&self, at_ns: i64) -> i128 {
        let elapsed = self.elapsed(at_ns);
        elapsed * self.grain * (2 * self.from * self.length + self.rise * elapsed)
    }
}

/// 1/1000 rpm of one increment a nanosecond: 10^6 ns/ms * 1000 * 1875 / 2048.
const SLOPE_NUMERATOR: i128 = NS_PER_MS * 1_000 * INCREMENTS_DENOMINATOR;

/// Denominator of an integral in increments for speeds in rpm / `unit`.
fn denominator(unit: i128) -> Option<i128> {
    unit.checked_mul(2 * INCREMENTS_DENOMINATOR * NS_PER_MS)
}

fn gcd(a: i64, b: i64) -> i64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Walks along a line, forward only.
#[derive(Debug, Clone)]
pub struct Walker<'a> {
    line: &'a Polyline,
    index: usize,
    segment: Segment,
    /// Integral up to the start of the segment: whole increments and the rest.
    whole: i128,
    rest: i128,
}

impl<'a> Walker<'a> {
    /// Starts at time 0, integrals at `offset` increments.
    pub fn new(line: &'a Polyline, offset: i64) -> Self {
        Self { line, index: 0, segment: line.segment(0), whole: i128::from(offset), rest: 0 }
    }

    /// Moves on to the segment that ends at or behind `at_ns`.
    pub fn advance(&mut self, at_ns: i64) {
        while (at_ns > self.segment.end_ns) & (self.index < self.line.points.len()) {
            self.close_segment();
            self.index += 1;
            self.segment = self.line.segment(self.index);
        }
    }

    fn close_segment(&mut self) {
        let denominator = self.denominator();
        // The first point may lie at time 0; the piece before it then has no length.
        let end = if self.index == 0 { self.line.points[0].0 } else { self.segment.end_ns };
        let area = self.segment.double_area(end) / self.segment.length;
        let total = self.rest + area * INCREMENTS_NUMERATOR;
        self.whole += total.div_euclid(denominator);
        self.rest = total.rem_euclid(denominator);
    }

    fn denominator(&self) -> i128 {
        self.line.unit * (2 * INCREMENTS_DENOMINATOR * NS_PER_MS)
    }

    /// The value times `factor`, rounded to nearest.
    pub fn value(&self, at_ns: i64, factor: i128) -> i64 {
        let segment = &self.segment;
        let numerator = segment.from * segment.length + segment.rise * segment.elapsed(at_ns);
        saturated(round_quotient(numerator * factor, self.line.unit * segment.length))
    }

    /// The integral of a line in rpm from time 0 in 1/`parts` increments (at most
    /// [`PARTS_MAX`]), rounded to nearest.
    pub fn integral(&self, at_ns: i64, parts: i64) -> i64 {
        let segment = &self.segment;
        let parts = i128::from(parts);
        let area = segment.double_area(at_ns) * INCREMENTS_NUMERATOR;
        let numerator = (self.rest * segment.length + area) * parts;
        let whole = self.whole.saturating_mul(parts);
        saturated(round_offset_quotient(whole, numerator, self.denominator() * segment.length))
    }

    /// Slope of the segment that ends at or behind the present time, for a line in
    /// increments: 1/1000 rpm, rounded to nearest. Before the first point it is 0.
    pub fn slope_mrpm(&self) -> i32 {
        let segment = &self.segment;
        let duration = i128::from(segment.end_ns - segment.start_ns);
        let divisor = self.line.unit * duration * INCREMENTS_NUMERATOR;
        let slope = round_quotient(segment.rise * SLOPE_NUMERATOR, divisor);
        i32::try_from(slope).unwrap_or(if slope < 0 { i32::MIN } else { i32::MAX })
    }
}

fn saturated(value: i128) -> i64 {
    i64::try_from(value).unwrap_or(if value < 0 { i64::MIN } else { i64::MAX })
}
