//! What a function is: a row of numbers, built once from the parameters.

/// No bit of a control or status word.
pub const NO_BIT: u8 = u8::MAX;

/// What a limit looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// Speed, 1/1000 rpm.
    #[default]
    Speed,
    /// Position since the reference was latched, increments.
    Travel,
    /// Absolute position, increments.
    Position,
    /// Acceleration, 1/1000 rpm/s.
    Acceleration,
    /// Torque, millionths of the rated torque.
    Torque,
}

/// A range; both ends are inside (DEC-01).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    /// What must stay inside.
    pub quantity: Quantity,
    /// Smallest permitted value.
    pub lower: i64,
    /// Largest permitted value.
    pub upper: i64,
}

impl Range {
    /// Permits everything.
    pub const OPEN: Self = Self { quantity: Quantity::Speed, lower: i64::MIN, upper: i64::MAX };

    /// From `-|half|` to `+|half|`.
    pub const fn around_zero(quantity: Quantity, half: i64) -> Self {
        let half = half.saturating_abs();
        Self { quantity, lower: -half, upper: half }
    }

    /// From the smaller to the larger of two values.
    pub const fn between(quantity: Quantity, one: i64, other: i64) -> Self {
        if one < other {
            Self { quantity, lower: one, upper: other }
        } else {
            Self { quantity, lower: other, upper: one }
        }
    }
}

/// A slope as an exact fraction: `num / den`, 1/1000 rpm for each ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slope {
    /// 1/1000 rpm; 0: no ramp, the window applies after the delay (DEC-07).
    pub num: i64,
    /// ns, above 0.
    pub den: i64,
}

impl Slope {
    /// No ramp.
    pub const NONE: Self = Self { num: 0, den: 1 };

    /// `speed_mrpm` in `time_ns`; no ramp when either is 0.
    pub const fn over(speed_mrpm: i64, time_ns: i64) -> Self {
        if time_ns <= 0 {
            return Self::NONE;
        }
        Self { num: speed_mrpm.saturating_abs(), den: time_ns }
    }

    /// `rate` in rpm/s.
    pub const fn per_second(rate_rpm_s: i64) -> Self {
        Self::over(rate_rpm_s.saturating_mul(1_000), SECOND_NS)
    }
}

/// One second, ns.
pub const SECOND_NS: i64 = 1_000_000_000;
/// One millisecond, ns.
pub const MS_NS: i64 = 1_000_000;
/// 1/1000 rpm of one rpm.
pub const RPM: i64 = 1_000;

/// What follows a violation, or what a request asks: the stop functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reaction {
    /// Nothing.
    None,
    /// Torque off.
    #[default]
    Sto,
    /// Stop function in place n of the plan's stops (SS1 and SS2 alike).
    Stop(u8),
}

/// How the approach of a function begins and ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Approach {
    /// Time without monitoring, ns (DEC-02).
    pub delay_ns: i64,
    /// Slope of the line.
    pub slope: Slope,
    /// Added to the magnitude of the latched speed, 1/1000 rpm.
    pub offset: i64,
    /// Added to the magnitude of the latched speed, 1/1000 of it.
    pub offset_permille: i64,
    /// The line starts from the highest magnitude seen during the delay (ATV SS1).
    pub track_peak: bool,
    /// The line falls from its start to zero in the slope's time, whatever the start
    /// (LNZ-RAMP-02); the slope's numerator only says that there is a line.
    pub falls_to_zero: bool,
    /// The approach ends where the line meets the window; otherwise the window goes on as
    /// the line until time or dwell ends it (DEC-49).
    pub line_ends: bool,
    /// The line itself is watched, or only its end.
    pub watch_line: bool,
    /// The start of the line is watched during the delay (LNZ-RAMP-05).
    pub watch_start: bool,
    /// The approach ends this long after the start at the latest, ns; negative: never by time.
    pub timeout_ns: i64,
    /// A timeout with the speed outside the window is a violation.
    pub timeout_strict: bool,
    /// The approach ends early when the speed has stayed inside the window this long, ns;
    /// negative: it does not (DEC-05).
    pub dwell_ns: i64,
}

impl Approach {
    /// None: the window applies at once.
    pub const NONE: Self = Self {
        delay_ns: 0,
        slope: Slope::NONE,
        offset: 0,
        offset_permille: 0,
        track_peak: false,
        falls_to_zero: false,
        line_ends: true,
        watch_line: true,
        watch_start: false,
        timeout_ns: -1,
        timeout_strict: false,
        dwell_ns: -1,
    };

    /// A delay and a line (AMK-RAMP-01).
    pub const fn line(delay_ns: i64, slope: Slope) -> Self {
        Self { delay_ns, slope, ..Self::NONE }
    }
}

/// One function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spec {
    /// The profile's own number of the function (AMK: Info1).
    pub id: u32,
    /// Bit of the request word; [`NO_BIT`]: always requested.
    pub control: u8,
    /// Bit of the status word, or [`NO_BIT`].
    pub status: u8,
    /// Delay, line, dwell.
    pub approach: Approach,
    /// The window the approach leads to.
    pub window: Range,
    /// A second window, in force once the first is reached.
    pub hold: Range,
    /// The reference position is latched when the window is reached, not at the start
    /// (DEC-08), and travel counts from there.
    pub latch_late: bool,
    /// Once the window was reached only `hold` counts (LNZ-SOS-05).
    pub hold_only: bool,
    /// The end of the line judges nothing, and from there on only `hold` counts (ETG-SOS-02).
    pub lands_free: bool,
    /// Travel counts from the furthest position reached upwards (1) or downwards (-1) since
    /// the window was reached (DEC-49); 0: from the latched one.
    pub ratchet: i8,
    /// The status bit shows the window from the request on, before it is monitored
    /// (LNZ-SLS-02).
    pub shows_inside: bool,
    /// Only the status bit shows the window; leaving it is no violation (SSM, SCA).
    pub bit_only: bool,
    /// Goes on in STO (DEC-14).
    pub in_sto: bool,
    /// Leaving the window faster than any ramp monitoring accepts has a name of its own.
    pub names_too_fast: bool,
    /// What follows a violation.
    pub reaction: Reaction,
}

impl Spec {
    /// A function that permits everything and is never requested by a bit.
    pub const IDLE: Self = Self {
        id: 0,
        control: NO_BIT,
        status: NO_BIT,
        approach: Approach::NONE,
        window: Range::OPEN,
        hold: Range::OPEN,
        latch_late: false,
        hold_only: false,
        lands_free: false,
        ratchet: 0,
        shows_inside: false,
        bit_only: false,
        in_sto: false,
        names_too_fast: true,
        reaction: Reaction::Sto,
    };
}
