//! ETG.6100.2 generic drive profile: rows for every instance a set names (DEC-40), words of
//! up to 32 octets (DEC-41), SDI and the brake.

use shm_schema::error::ErrorCode;
use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::{control, status};
use shm_schema::profile::{common, etg_key, reference};
use shm_schema::word::Word;

use super::{Asked, Bits, Plan};
use crate::engine::Motion;
use crate::engine::record::Breach;
use crate::engine::spec::{Approach, MS_NS, NO_BIT, Quantity, RPM, Range, Reaction, Slope, Spec};
use crate::engine::stops::{End, Stop, Stops};
use crate::image::Image;
use crate::ledger::{Cause, Entry, Ledger};
use crate::twin::Twin;

/// Default places of the words: function, instance, control bit, status bit (DEC-41).
const PLACES: [(u32, u32, u8, u8); 32] = [
    (etg::SS1, 1, control::SS1_1, NO_BIT),
    (etg::SS1, 2, control::SS1_2, NO_BIT),
    (etg::SS2, 1, control::SS2_1, NO_BIT),
    (etg::SS2, 2, control::SS2_2, NO_BIT),
    (etg::SOS, 1, control::SOS_1, status::SOS_1),
    (etg::SOS, 2, control::SOS_2, status::SOS_2),
    (etg::SSR, 1, control::SSR_1, status::SSR_1),
    (etg::SSR, 2, control::SSR_2, status::SSR_2),
    (etg::SSR, 3, control::SSR_3, status::SSR_3),
    (etg::SSR, 4, control::SSR_4, status::SSR_4),
    (etg::SLS, 1, control::SLS_1, status::SLS_1),
    (etg::SLS, 2, control::SLS_2, status::SLS_2),
    (etg::SLS, 3, control::SLS_3, status::SLS_3),
    (etg::SLS, 4, control::SLS_4, status::SLS_4),
    (etg::SLP, 1, control::SLP_1, status::SLP_1),
    (etg::SLP, 2, control::SLP_2, status::SLP_2),
    (etg::SLI, 1, control::SLI_1, status::SLI_1),
    (etg::SLI, 2, control::SLI_2, status::SLI_2),
    (etg::SLT, 1, control::SLT_1, status::SLT_1),
    (etg::SLT, 2, control::SLT_2, status::SLT_2),
    (etg::SAR, 1, control::SAR_1, status::SAR_1),
    (etg::SAR, 2, control::SAR_2, status::SAR_2),
    (etg::SBC, 1, control::SBC_1, status::SBC_1),
    (etg::SMS, 1, NO_BIT, status::SMS),
    (etg::SMA, 1, NO_BIT, status::SMA),
    (etg::SSM, 1, NO_BIT, status::SSM_1),
    (etg::SSM, 2, NO_BIT, status::SSM_2),
    (etg::SSM, 3, NO_BIT, status::SSM_3),
    (etg::SSM, 4, NO_BIT, status::SSM_4),
    (etg::SCA, 1, NO_BIT, status::SCA_1),
    (etg::SCA, 2, NO_BIT, status::SCA_2),
    (etg::SDI, 1, NO_BIT, NO_BIT),
];

/// Windows and ramps: function with the numbers of its objects for time to monitoring, dwell,
/// deceleration, delay and error reaction.
const TIMED: [(u32, [u32; 5]); 4] = [
    (etg::SS1, [1, 3, 4, 5, 0]),
    (etg::SS2, [1, 2, 3, 4, 6]),
    (etg::SSR, [1, 4, 5, 6, 7]),
    (etg::SLS, [1, 3, 4, 5, 6]),
];
/// Number of the error reaction object of the other monitoring functions.
const REACTION: u32 = 3;

fn rows<'a>(image: &'a Image<'a>) -> Builder<'a> {
    let mut plan = Plan::new(image);
    plan.set_common(image);
    let sto = |object: u32| image.find(etg_key(etg::STO, 1, object));
    plan.needs_restart = sto(etg::sto::RESTART_ACKNOWLEDGE_BEHAVIOR).unwrap_or(1) != 0;
    plan.bits = Bits {
        sto: control::STO,
        acknowledge: control::ERROR_ACK,
        restart: control::RESTART_ACKNOWLEDGE,
        sto_active: status::STO,
        error: status::ERROR,
        restart_request: if plan.needs_restart | needs_any_restart(image) {
            status::RESTART_ACKNOWLEDGE_REQUEST
        } else {
            NO_BIT
        },
        low: Word::ZERO.with(control::STO, true),
        either: combined_by_or(image),
        ..Bits::NONE
    };
    plan.words = (octets(image, common::CONTROL_WORD), octets(image, common::STATUS_WORD));
    let mut builder = Builder { image, plan, unfit: None, places: [(0, 0); crate::engine::stops::STOPS_MAX] };
    builder.each(Builder::place_stop);
    builder.each(Builder::add_stop);
    builder.each(Builder::add_monitor);
    builder
}

/// First instance for which there is no room besides the others, or that nothing can request, as a
/// key without object.
pub fn unfit(image: &Image<'_>) -> Option<u32> {
    rows(image).unfit
}

/// Builds rows for every instance the set names, stops first.
pub fn build(image: &Image<'_>) -> Plan {
    let builder = rows(image);
    let logic = builder.logic();
    let mut plan = builder.plan;
    if logic.has_directions {
        plan.bits.low = plan.bits.low.with(control::SDIP, true).with(control::SDIN, true);
    }
    plan.logic = super::Logic::Etg(logic);
    plan
}

fn needs_any_restart(image: &Image<'_>) -> bool {
    let mut keys = image.entries().map(|(key, _)| key >> 16);
    keys.any(|function| function == etg::SS2)
}

/// Errors, movements and the request to the operator (DEC-25, DEC-41).
fn combined_by_or(image: &Image<'_>) -> Word {
    let fixed = [status::ERROR, status::SDIP, status::SDIN, status::RESTART_ACKNOWLEDGE_REQUEST];
    let mut word = fixed.into_iter().fold(Word::ZERO, |word, bit| word.with(bit, true));
    for (key, value) in image.entries() {
        let bit = key.wrapping_sub(common::STATUS_WORD);
        if bit < 256 {
            word = word.with(bit as u8, (value as u32) >> 8 == etg::SDI);
        }
    }
    word
}

/// Octets up to the last bit that `[words]` assigns from `base` on, four at least (DEC-41).
fn octets(image: &Image<'_>, base: u32) -> u8 {
    let bits = image.entries().map(|(key, _)| key.wrapping_sub(base)).filter(|bit| *bit < 256);
    let last = bits.max().unwrap_or(0);
    (last >> 3).saturating_add(1).clamp(4, 32) as u8
}

struct Builder<'a> {
    image: &'a Image<'a>,
    plan: Plan,
    /// First instance there is no room for, or no request.
    unfit: Option<u32>,
    /// Function and instance of each stop place.
    places: [(u32, u32); crate::engine::stops::STOPS_MAX],
}

impl Builder<'_> {
    /// Calls `act` once for each instance named in the set; keys are in order.
    fn each(&mut self, act: impl Fn(&mut Self, u32, u32)) {
        let mut last = (0, 0);
        for (key, _) in self.image.entries() {
            let found = (key >> 16, key >> 8 & 0xFF);
            let is_function = found.0 <= etg::SCA;
            if is_function & (found != last) {
                last = found;
                act(self, found.0, found.1);
            }
        }
    }

    fn find(&self, function: u32, instance: u32, object: u32) -> Option<i64> {
        self.image.find(etg_key(function, instance, object)).map(i64::from)
    }

    fn value(&self, function: u32, instance: u32, object: u32) -> i64 {
        self.find(function, instance, object).unwrap_or(0)
    }

    /// Control and status bit: the set's own assignment before the default (DEC-41).
    fn bits(&self, function: u32, instance: u32) -> (u8, u8) {
        let wanted = reference(function, instance);
        let default = PLACES.iter().find(|place| (place.0, place.1) == (function, instance));
        let (mut control, mut status) = default.map_or((NO_BIT, NO_BIT), |place| (place.2, place.3));
        for (key, value) in self.image.entries() {
            let place = key.wrapping_sub(common::CONTROL_WORD);
            let shown = key.wrapping_sub(common::STATUS_WORD);
            let is_wanted = value == wanted;
            if is_wanted & (place < 255) {
                control = place as u8;
            }
            if is_wanted & (shown < 255) {
                status = shown as u8;
            }
        }
        (control, status)
    }

    fn base(&mut self, function: u32, instance: u32) -> Spec {
        let (control, status) = self.bits(function, instance);
        if control != NO_BIT {
            self.plan.bits.low = self.plan.bits.low.with(control, true);
        }
        Spec { id: function << 16 | instance << 8, control, status, ..Spec::IDLE }
    }

    /// ETG-ERR-02: the default is STO, 0 is none.
    fn reaction(&self, function: u32, instance: u32, object: u32) -> Reaction {
        match self.find(function, instance, object) {
            Some(0) => Reaction::None,
            Some(value) => {
                let wanted = (value as u32 >> 8 & 0xFF, value as u32 & 0xFF);
                let place = (0_u8..).zip(&self.places).find(|(_, stop)| **stop == wanted);
                place.map_or(Reaction::Sto, |(place, _)| Reaction::Stop(place))
            }
            None => Reaction::Sto,
        }
    }

    /// The larger magnitude of the SMS limits (ETG-SMS-02), 1/1000 rpm.
    fn fastest(&self) -> i64 {
        let limits = [1, 2].map(|object| self.value(etg::SMS, 1, object).saturating_abs());
        limits.into_iter().fold(0, i64::max).saturating_mul(RPM)
    }

    /// Delay, line and times of SS1, SS2, SSR, SLS. Without a dwell time nothing but the line
    /// or the whole time ends it (DEC-05).
    fn approach(&self, function: u32, instance: u32, window: &Range) -> Approach {
        let row = TIMED.iter().find(|row| row.0 == function);
        let Some((_, [time, dwell, slope, delay, _])) = row else { return Approach::NONE };
        let ms = |object: u32| self.find(function, instance, object).map(|time| time.saturating_mul(MS_NS));
        // DEC-07: no time is no time-out.
        let timeout_ns = ms(*time).filter(|time| *time > 0).unwrap_or(-1);
        let delay_ns = ms(*delay);
        let rate = self.find(function, instance, *slope);
        let has_line = rate.is_some() | delay_ns.is_some();
        let length = timeout_ns.saturating_sub(delay_ns.unwrap_or(0));
        let slope = match rate {
            Some(rate) => Slope::per_second(rate),
            None if has_line => Slope::over(self.largest_change(window), length),
            None => Slope::NONE,
        };
        Approach {
            delay_ns: delay_ns.unwrap_or(0),
            slope,
            timeout_ns,
            timeout_strict: true,
            dwell_ns: ms(*dwell).unwrap_or(-1),
            ..Approach::NONE
        }
    }

    /// DEC-04: the larger of the changes the limits may ask for.
    fn largest_change(&self, window: &Range) -> i64 {
        let [positive, negative] =
            [1, 2].map(|object| self.value(etg::SMS, 1, object).saturating_abs().saturating_mul(RPM));
        let down = positive.saturating_sub(window.upper).saturating_abs();
        let up = negative.saturating_add(window.lower).saturating_abs();
        if window.upper == i64::MAX { self.fastest() } else { down.max(up) }
    }

    /// Places come before rows: an SS2 may have another one as its reaction (ETG-SS2-10).
    fn place_stop(&mut self, function: u32, instance: u32) {
        let is_stop = matches!(function, etg::SS1 | etg::SS2);
        let free = self.places.iter_mut().find(|place| **place == (0, 0));
        if let Some(place) = free.filter(|_| is_stop) {
            *place = (function, instance);
        }
    }

    fn add_stop(&mut self, function: u32, instance: u32) {
        let stop = match function {
            etg::SS1 => self.ss1(instance),
            etg::SS2 => self.ss2(instance),
            _ => return,
        };
        let Some(place) = self.plan.stops.add(stop) else {
            return self.refuse(function, instance);
        };
        let is_lost = (stop.spec.control == NO_BIT) && !self.is_reaction(function, instance);
        if is_lost {
            self.refuse(function, instance);
        }
        let restart = self.find(etg::SS2, instance, 5).unwrap_or(1) != 0;
        if (function == etg::SS2) & restart {
            self.plan.sos_needs_restart |= 1 << (place & 15);
        }
    }

    fn ss1(&mut self, instance: u32) -> Stop {
        let base = self.base(etg::SS1, instance);
        let zero = self.find(etg::SS1, instance, 2);
        let window = Range::around_zero(Quantity::Speed, zero.unwrap_or(0).saturating_mul(RPM));
        let mut approach = self.approach(etg::SS1, instance, &window);
        // ETG-SS1-11: the end of the time is an error only where the zero window is used.
        approach.timeout_strict = zero.is_some();
        if zero.is_none() {
            approach.dwell_ns = -1;
        }
        if (approach.dwell_ns >= 0) & (self.value(etg::SS1, instance, 6) != 0) {
            // ETG-SBC-04: the brake closes first.
            approach.dwell_ns = approach.dwell_ns.saturating_add(self.brake_ns());
        }
        Stop {
            spec: Spec { approach, window, ..base },
            end: End::Sto,
            standing_status: NO_BIT,
            resumes: false,
        }
    }

    /// ETG-SS2-02: instance k ends in SOS k.
    fn ss2(&mut self, instance: u32) -> Stop {
        let base = self.base(etg::SS2, instance);
        let (_, standing_status) = self.bits(etg::SOS, instance);
        let zero = self.find(etg::SOS, instance, 2);
        let window = Range::around_zero(Quantity::Speed, zero.unwrap_or(0).saturating_mul(RPM));
        let mut approach = self.approach(etg::SS2, instance, &window);
        approach.timeout_strict = zero.is_some();
        let travel = self.find(etg::SOS, instance, 1);
        let hold = travel.map_or(Range::OPEN, |half| Range::around_zero(Quantity::Travel, half));
        // ETG-SOS-02: without a velocity window the line ends at 0 and only the position is watched.
        let lands_free = zero.is_none();
        let is_open = lands_free & (approach.slope.num == 0);
        let window = if is_open { Range::OPEN } else { window };
        let reaction = self.reaction(etg::SS2, instance, 6);
        let spec = Spec { approach, window, hold, lands_free, latch_late: true, reaction, ..base };
        Stop { spec, end: End::Sos, standing_status, resumes: false }
    }

    fn brake_ns(&self) -> i64 {
        self.value(etg::SBC, 1, 1).saturating_mul(MS_NS)
    }

    fn add_monitor(&mut self, function: u32, instance: u32) {
        let Some((quantity, scale, is_magnitude)) = quantity(function) else {
            return self.add_special(function, instance);
        };
        let of = |object: u32| self.value(function, instance, object).saturating_mul(scale);
        let (upper, lower) = (of(1), of(2));
        let lower = if is_magnitude { lower.saturating_abs().saturating_neg() } else { lower };
        let upper = if is_magnitude { upper.saturating_abs() } else { upper };
        let is_bit = matches!(function, etg::SSM | etg::SCA);
        let by_parameter = is_bit | matches!(function, etg::SMS | etg::SMA);
        // ETG-SMS-01, ETG-SSM-02, DEC-29: active only when one of the limits is not zero.
        if by_parameter & (upper == 0) & (lower == 0) {
            return;
        }
        let reaction = self.reaction(function, instance, REACTION);
        let window = Range { quantity, lower, upper };
        let base = self.base(function, instance);
        self.add(Spec { window, bit_only: is_bit, in_sto: is_bit, reaction, ..base });
    }

    fn add_special(&mut self, function: u32, instance: u32) {
        match function {
            etg::SOS => self.add_sos(instance),
            etg::SSR => {
                let of = |object: u32| self.value(etg::SSR, instance, object).saturating_mul(RPM);
                let window = Range { quantity: Quantity::Speed, lower: of(3), upper: of(2) };
                self.add_timed(etg::SSR, instance, window);
            }
            etg::SLS => {
                let limit = self.value(etg::SLS, instance, 2).saturating_mul(RPM);
                self.add_timed(etg::SLS, instance, Range::around_zero(Quantity::Speed, limit));
            }
            etg::SBC => self.add_brake(instance),
            _ => {}
        }
    }

    /// One brake hangs on a channel: a second would share its output (ETG-SBC-08).
    fn add_brake(&mut self, instance: u32) {
        self.base(etg::SBC, instance);
        if instance != 1 {
            self.refuse(etg::SBC, instance);
        }
    }

    fn add_sos(&mut self, instance: u32) {
        let around = |object: u32, quantity: Quantity, scale: i64| {
            let half = self.find(etg::SOS, instance, object);
            half.map_or(Range::OPEN, |half| Range::around_zero(quantity, half.saturating_mul(scale)))
        };
        let window = around(1, Quantity::Travel, 1);
        let hold = around(2, Quantity::Speed, RPM);
        let base = self.base(etg::SOS, instance);
        self.add(Spec { window, hold, ..base });
    }

    fn add_timed(&mut self, function: u32, instance: u32, window: Range) {
        let approach = self.approach(function, instance, &window);
        let object = TIMED.iter().find(|row| row.0 == function).map_or(0, |row| row.1[4]);
        let reaction = self.reaction(function, instance, object);
        let base = self.base(function, instance);
        self.add(Spec { approach, window, reaction, ..base });
    }

    /// What is not active by its parameters needs a control bit, else nothing can request it. It
    /// stays out rather than being always on, and the set is refused (DEC-41).
    fn add(&mut self, spec: Spec) {
        let (function, instance) = (spec.id >> 16, spec.id >> 8 & 0xFF);
        let by_parameter = matches!(function, etg::SMS | etg::SMA | etg::SSM | etg::SCA);
        let is_reached = by_parameter | (spec.control != NO_BIT);
        let fits = !is_reached || self.plan.bank.add(spec);
        let is_lost = !(is_reached | self.ends_ss2(function, instance));
        if !fits | is_lost {
            self.refuse(function, instance);
        }
    }

    /// ETG-SS2-02: the windows of SOS k are those of SS2 k.
    fn ends_ss2(&self, function: u32, instance: u32) -> bool {
        (function == etg::SOS) & self.places.contains(&(etg::SS2, instance))
    }

    /// A stop without a control bit is one only as somebody's reaction.
    fn is_reaction(&self, function: u32, instance: u32) -> bool {
        let wanted = reference(function, instance);
        let mut objects = self.image.entries().filter(|(key, _)| key >> 16 <= etg::SCA);
        objects.any(|(key, value)| (value == wanted) & (is_reaction(key >> 16, key & 0xFF)))
    }

    fn refuse(&mut self, function: u32, instance: u32) {
        self.unfit = self.unfit.or(Some(etg_key(function, instance, 0)));
    }

    fn logic(&self) -> Logic {
        let zero = |object: u32| self.find(etg::SDI, 1, object);
        let has = |function: u32| self.image.entries().any(|(key, _)| key >> 16 == function);
        let (brake_control, brake_status) = self.bits(etg::SBC, 1);
        let mut closes = 0;
        for (place, stop) in (0_u8..).zip(&self.places) {
            let activates = (stop.0 == etg::SS1) && self.value(etg::SS1, stop.1, 6) != 0;
            closes |= u16::from(activates) << (place & 15);
        }
        Logic {
            has_directions: has(etg::SDI),
            position_zero: zero(1),
            velocity_zero: zero(2).map(|rpm| rpm.saturating_mul(RPM)),
            directions: [Direction::OFF; 2],
            has_brake: has(etg::SBC),
            brake_control,
            brake_status,
            brake_ns: self.brake_ns(),
            closes,
        }
    }
}

/// Whether an object names an error reaction.
fn is_reaction(function: u32, object: u32) -> bool {
    let of_timed = TIMED.iter().find(|row| row.0 == function).map(|row| row.1[4]);
    object == of_timed.unwrap_or(REACTION)
}

/// Plain windows: quantity, scale, and whether both limits are magnitudes (DEC-31, DEC-39).
const fn quantity(function: u32) -> Option<(Quantity, i64, bool)> {
    Some(match function {
        etg::SAR => (Quantity::Acceleration, RPM, false),
        etg::SLP | etg::SCA => (Quantity::Position, 1, false),
        etg::SMS => (Quantity::Speed, RPM, true),
        etg::SLT => (Quantity::Torque, 1_000, true),
        etg::SMA => (Quantity::Acceleration, RPM, true),
        etg::SLI => (Quantity::Travel, 1, true),
        etg::SSM => (Quantity::Speed, RPM, false),
        _ => return None,
    })
}

/// ETG-ERR-03 leaves codes to the maker: function, instance and the catalogue's E-number.
pub const fn code(spec: &Spec, breach: Breach) -> ErrorCode {
    let is_ss2 = spec.id >> 16 == etg::SS2;
    let number = match breach {
        Breach::Line | Breach::TooFast => 2,
        Breach::Damage => return ErrorCode::single(0xFF30),
        _ => 1,
    };
    ErrorCode::single(match (is_ss2, number) {
        (true, 2) => spec.id | 1,
        // ETG-SS2-10: behind the transition it is the SOS of the same number that is violated.
        (true, _) => etg::SOS << 16 | (spec.id & 0xFF00) | 1,
        (false, number) => spec.id | number,
    })
}

/// Faults of the channel itself: 0xFF00 plus Info2 of the AMK row between the channels,
/// 0xFF40 and above for what only one channel sees.
pub const fn internal(code: ErrorCode) -> ErrorCode {
    ErrorCode::single(match (code.info1, code.info2) {
        (13, info2) => 0xFF00 | info2,
        (76, info2) => 0xFF10 | info2,
        (72, _) => 0xFF22,
        (info1, info2) => 0xFF_0000 | info1 << 8 | info2,
    })
}

/// One direction that is not enabled.
#[derive(Debug, Clone, Copy)]
struct Direction {
    /// Position at which the speed first reached zero after activation (DEC-30).
    latched: Option<Twin>,
    /// Sign of the last motion, for a zero crossed between two samples.
    moved: i64,
}

impl Direction {
    const OFF: Self = Self { latched: None, moved: 0 };

    /// Whether motion towards `sign` is past the windows of position and speed; `None`: damaged.
    fn judge(&mut self, sign: i64, motion: &Motion, windows: [Option<i64>; 2]) -> Option<[bool; 2]> {
        let [_, velocity_zero] = windows;
        let speed = motion.speed;
        let has_crossed = speed.signum().saturating_mul(self.moved) < 0;
        let stands = speed.saturating_abs() <= velocity_zero.unwrap_or(0);
        self.moved = speed.signum();
        if self.latched.is_none() & (stands | has_crossed) {
            self.latched = Some(Twin::new(motion.position));
        }
        let Some(latched) = self.latched else { return Some([false; 2]) };
        let travel = motion.position.saturating_sub(latched.get()?);
        let mut left = [false; 2];
        for ((left, value), window) in left.iter_mut().zip([travel, speed]).zip(windows) {
            *left = window.is_some_and(|window| value.saturating_mul(sign) > window);
        }
        Some(left)
    }
}

/// Directions and brake.
#[derive(Debug, Clone, Copy)]
pub struct Logic {
    has_directions: bool,
    position_zero: Option<i64>,
    velocity_zero: Option<i64>,
    /// Positive, negative.
    directions: [Direction; 2],
    has_brake: bool,
    brake_control: u8,
    brake_status: u8,
    brake_ns: i64,
    closes: u16,
}

impl Logic {
    /// ETG-SDI-02, ETG-SDI-03: once standstill was reached, not past the windows in a
    /// direction that is not enabled, each from its own standstill on (ETG-GEN-12).
    pub fn watch(&mut self, asked: &Asked<'_>, requested: &Word, in_sto: bool, ledger: &mut Ledger) {
        if !self.has_directions {
            return;
        }
        let windows = [self.position_zero, self.velocity_zero];
        let mut left = [false; 2];
        let bits = [(control::SDIP, 1), (control::SDIN, -1)];
        for (direction, (bit, sign)) in self.directions.iter_mut().zip(bits) {
            let is_off = in_sto | !requested.bit(bit);
            if is_off {
                *direction = Direction::OFF;
                continue;
            }
            let Some(found) = direction.judge(sign, asked.motion, windows) else {
                return ledger.raise(Entry::sto(ErrorCode::single(0xFF30), Cause::Lasting));
            };
            left.iter_mut().zip(found).for_each(|(all, one)| *all |= one);
        }
        let id = etg::SDI << 16 | 1 << 8;
        for (number, _) in (1..).zip(left).filter(|(_, is_left)| *is_left) {
            self.directions = [Direction::OFF; 2];
            ledger.raise(Entry::sto(ErrorCode::single(id | number), Cause::Reaction));
        }
    }

    /// No direction is watched or shown.
    pub const fn rests(&self) -> bool {
        !self.has_directions
    }

    /// Moving bits (ETG-SDI-04) and the brake (ETG-SBC-01).
    pub fn show(&self, word: &mut Word, requested: &Word, motion: &Motion, stops: &Stops, now: u64) {
        if self.has_directions {
            let zero = self.velocity_zero.unwrap_or(0);
            *word = word.with(status::SDIP, motion.speed > zero);
            *word = word.with(status::SDIN, motion.speed < zero.saturating_neg());
        }
        let is_shown = self.has_brake & (self.brake_status != NO_BIT);
        if is_shown {
            *word = word.with(self.brake_status, self.is_brake_open(requested, stops, now));
        }
    }

    /// ETG-SBC-02, ETG-SBC-04, ETG-SBC-05.
    pub fn is_brake_open(&self, requested: &Word, stops: &Stops, now: u64) -> bool {
        let is_requested = (self.brake_control != NO_BIT) && requested.bit(self.brake_control);
        let is_closed = stops.in_sto() | (self.has_brake & is_requested) | self.closes_early(stops, now);
        !is_closed
    }

    fn closes_early(&self, stops: &Stops, now: u64) -> bool {
        stops.progress(self.closes, now).any(|(stop, elapsed, dwelt)| {
            let approach = &stop.spec.approach;
            let latest = approach.timeout_ns.saturating_sub(self.brake_ns);
            let by_time = (approach.timeout_ns >= 0) & (elapsed >= latest);
            let needed = approach.dwell_ns.saturating_sub(self.brake_ns);
            let by_standstill = (approach.dwell_ns >= 0) & (dwelt >= 0) & (dwelt >= needed);
            by_time | by_standstill
        })
    }
}
