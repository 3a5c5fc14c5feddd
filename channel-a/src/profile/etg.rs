//! ETG.6100.2: any number of instances of sixteen functions, mapped to bits of the words.

use shm_schema::drive::DriveRequest;
use shm_schema::error::ErrorCode;
use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::{control, status};
use shm_schema::profile::{common, etg_key};
use shm_schema::word::Word;

use super::{Outside, Program, Requests, Rules, State};
use crate::engine::Range;
use crate::engine::approach::{Approach, Slope};
use crate::engine::stop::{self, Active, Demand, End, Reaction, STOPS};
use crate::engine::watch::{Plan, Quantity};
use crate::image::Image;

const RPM: i64 = 1_000;
/// Requests the watches can have; the places behind are the modes of SDI.
const SEATS: usize = 60;
const SDI_BOTH: u8 = 60;
const SDI_POSITIVE_ONLY: u8 = 61;
const SDI_NEGATIVE_ONLY: u8 = 62;
/// Monitors of the status word that ask for nothing.
const SIGNALS: usize = 16;

/// DEC-41: function, instance, control bit.
const CONTROL: [(u32, u32, u8); 24] = [
    (etg::SS1, 1, control::SS1_1),
    (etg::SS1, 2, control::SS1_2),
    (etg::SS2, 1, control::SS2_1),
    (etg::SS2, 2, control::SS2_2),
    (etg::SOS, 1, control::SOS_1),
    (etg::SOS, 2, control::SOS_2),
    (etg::SSR, 1, control::SSR_1),
    (etg::SSR, 2, control::SSR_2),
    (etg::SSR, 3, control::SSR_3),
    (etg::SSR, 4, control::SSR_4),
    (etg::SLS, 1, control::SLS_1),
    (etg::SLS, 2, control::SLS_2),
    (etg::SLS, 3, control::SLS_3),
    (etg::SLS, 4, control::SLS_4),
    (etg::SLP, 1, control::SLP_1),
    (etg::SLP, 2, control::SLP_2),
    (etg::SLI, 1, control::SLI_1),
    (etg::SLI, 2, control::SLI_2),
    (etg::SLT, 1, control::SLT_1),
    (etg::SLT, 2, control::SLT_2),
    (etg::SAR, 1, control::SAR_1),
    (etg::SAR, 2, control::SAR_2),
    (etg::SBC, 1, control::SBC_1),
    (etg::STO, 1, control::STO),
];
/// DEC-41: function, instance, status bit.
const STATUS: [(u32, u32, u8); 27] = [
    (etg::SSM, 1, status::SSM_1),
    (etg::SSM, 2, status::SSM_2),
    (etg::SSM, 3, status::SSM_3),
    (etg::SSM, 4, status::SSM_4),
    (etg::SOS, 1, status::SOS_1),
    (etg::SOS, 2, status::SOS_2),
    (etg::SSR, 1, status::SSR_1),
    (etg::SSR, 2, status::SSR_2),
    (etg::SSR, 3, status::SSR_3),
    (etg::SSR, 4, status::SSR_4),
    (etg::SLS, 1, status::SLS_1),
    (etg::SLS, 2, status::SLS_2),
    (etg::SLS, 3, status::SLS_3),
    (etg::SLS, 4, status::SLS_4),
    (etg::SLP, 1, status::SLP_1),
    (etg::SLP, 2, status::SLP_2),
    (etg::SLI, 1, status::SLI_1),
    (etg::SLI, 2, status::SLI_2),
    (etg::SLT, 1, status::SLT_1),
    (etg::SLT, 2, status::SLT_2),
    (etg::SAR, 1, status::SAR_1),
    (etg::SAR, 2, status::SAR_2),
    (etg::SMS, 1, status::SMS),
    (etg::SMA, 1, status::SMA),
    (etg::SCA, 1, status::SCA_1),
    (etg::SCA, 2, status::SCA_2),
    (etg::SBC, 1, status::SBC_1),
];

/// In place of an error reaction object: STO, not configurable.
const FIXED_STO: u32 = 0;

/// What a control bit requests.
#[derive(Debug, Clone, Copy)]
enum Target {
    Watch(u8),
    Stop(u8),
    Brake,
}

/// SSM or SCA.
#[derive(Debug, Clone, Copy)]
struct Signal {
    position: bool,
    range: Range,
    status: u8,
}

/// The own part of an axis.
#[derive(Debug, Clone)]
pub struct Etg {
    targets: [Option<(u8, Target)>; SEATS],
    used: usize,
    known: Word,
    signals: [Option<Signal>; SIGNALS],
    standing_status: [Option<u8>; STOPS],
    stop_times_ns: [Option<(u64, u64)>; STOPS],
    brake_status: Option<u8>,
    brake_requested: bool,
    sdi: Option<i64>,
    error_armed: bool,
    restart_armed: bool,
}

/// Reads the objects of one instance.
struct Object<'a> {
    image: &'a Image<'a>,
    function: u32,
    instance: u32,
}

impl Object<'_> {
    fn key(&self, object: u32) -> u32 {
        etg_key(self.function, self.instance, object)
    }

    fn named(&self, object: u32) -> Option<i64> {
        self.image.named(self.key(object))
    }

    /// The named value, or the profile's default.
    fn value(&self, object: u32) -> i64 {
        let default = || self.image.value(etg_key(self.function, 0, object));
        self.named(object).unwrap_or_else(default)
    }

    fn speed(&self, object: u32) -> i64 {
        self.value(object).saturating_mul(RPM)
    }

    fn time_ns(&self, object: u32) -> Option<u64> {
        self.named(object).map(|ms| (ms.max(0) as u64).saturating_mul(1_000_000))
    }
}

/// Objects of an approach: time limit, dwell, slope, delay.
struct Times {
    limit: u32,
    dwell: u32,
    slope: u32,
    delay: u32,
}

/// Time variant, or deceleration variant where a slope or its delay is configured.
fn approach(object: &Object, times: &Times, window: Range, demand_rpm: i64) -> Approach {
    let limit_ns = object.time_ns(times.limit);
    let delay_ns = object.time_ns(times.delay);
    let slope = object.named(times.slope).filter(|slope| *slope > 0);
    let base = Approach {
        window,
        dwell_ns: object.time_ns(times.dwell),
        dwell_in_delay: true,
        ..Approach::default()
    };
    if slope.is_none() & delay_ns.is_none() {
        return Approach { unmonitored: true, limit_ns: Some(limit_ns.unwrap_or(0)), ..base };
    }
    let delay_ns = delay_ns.unwrap_or(0);
    let span_ns = limit_ns.unwrap_or(0).saturating_sub(delay_ns);
    // DEC-04: the configured slope, or the one the times ask for.
    let slope = match slope {
        Some(slope) => Slope { rise: slope.saturating_mul(RPM), run_ns: 1_000_000_000 },
        None => Slope { rise: demand_rpm.saturating_mul(RPM), run_ns: (span_ns as i64).max(1) },
    };
    Approach { delay_ns, slope, limit_ns, ..base }
}

/// Numbers of the seats while the program is built.
struct Builder {
    etg: Etg,
    controls: [(u32, u8); SEATS],
    statuses: [(u32, u8); SEATS],
    top: (i64, i64),
    stops: u8,
    full: bool,
}

const fn reference(function: u32, instance: u32) -> u32 {
    function << 8 | instance
}

impl Builder {
    fn bit_of(table: &[(u32, u8)], defaults: &[(u32, u32, u8)], object: &Object) -> Option<u8> {
        let own = reference(object.function, object.instance);
        let assigned = table.iter().find(|(to, _)| *to == own).map(|(_, bit)| *bit);
        let mut rows = defaults.iter();
        let default = rows.find(|row| (row.0, row.1) == (object.function, object.instance));
        assigned.or(default.map(|row| row.2))
    }

    fn control(&self, object: &Object) -> Option<u8> {
        Self::bit_of(&self.controls, &CONTROL, object)
    }

    fn status(&self, object: &Object) -> Option<u8> {
        Self::bit_of(&self.statuses, &STATUS, object)
    }

    /// Seats `target`; its number.
    fn seat(&mut self, object: &Object, target: impl Fn(u8) -> Target) -> u8 {
        let number = self.etg.used;
        let Some(bit) = self.control(object) else { return SDI_NEGATIVE_ONLY + 1 };
        match self.etg.targets.get_mut(number) {
            Some(place) => {
                *place = Some((bit, target(number as u8)));
                self.etg.known = self.etg.known.with(bit, true);
                self.etg.used = number.saturating_add(1);
            }
            None => self.full = true,
        }
        number as u8
    }

    /// A requested watch.
    fn watch(
        &mut self,
        program: &mut Program,
        object: &Object,
        quantity: Quantity,
        approach: Approach,
        window: Range,
        error: u32,
    ) -> u8 {
        let request = self.seat(object, Target::Watch);
        program.add(Plan {
            quantity,
            approach,
            window,
            function: reference(object.function, object.instance) as u16,
            request: Some(request),
            status: self.status(object),
            reaction: Self::reaction(object, error),
        });
        request
    }

    /// ETG-ERR-01, ETG-ERR-02; the stops come before everything that refers to them.
    fn reaction(object: &Object, error: u32) -> Reaction {
        if error == FIXED_STO {
            return Reaction::Sto;
        }
        let wanted = object.value(error) as u32;
        if wanted == 0 {
            return Reaction::None;
        }
        let stop = standing_reference(wanted, object.image);
        stop.map_or(Reaction::Sto, Reaction::Stop)
    }
}

/// Places of the stops: every instance of SS1, then every one of SS2, in ascending order.
fn stop_instances<'a>(image: &'a Image) -> impl Iterator<Item = (u32, u32)> + 'a {
    let mut before = 0;
    let instances = image
        .keys()
        .map(|key| key >> 8)
        .filter(move |instance| core::mem::replace(&mut before, *instance) != *instance);
    let pairs = instances.map(|instance| (instance >> 8, instance & 0xFF));
    pairs.filter(|(function, _)| (*function == etg::SS1) | (*function == etg::SS2)).take(STOPS)
}

fn standing_reference(wanted: u32, image: &Image) -> Option<u8> {
    let mut stops = stop_instances(image);
    stops.position(|(function, instance)| reference(function, instance) == wanted).map(|place| place as u8)
}

/// Builds the axis.
pub fn build(image: &Image, program: &mut Program) {
    program.take_common(image);
    let etg = Etg {
        targets: [None; SEATS],
        used: 0,
        known: Word::ZERO.with(control::STO, true),
        signals: [None; SIGNALS],
        standing_status: [None; STOPS],
        stop_times_ns: [None; STOPS],
        brake_status: None,
        brake_requested: false,
        sdi: None,
        error_armed: false,
        restart_armed: false,
    };
    let sms = Object { image, function: etg::SMS, instance: 1 };
    let top =
        (sms.value(etg::sms::VELOCITY_MAXIMUM_POSITIVE), sms.value(etg::sms::VELOCITY_MAXIMUM_NEGATIVE));
    let mut builder = Builder {
        etg,
        controls: assignments(image, common::CONTROL_WORD),
        statuses: assignments(image, common::STATUS_WORD),
        top,
        stops: 0,
        full: false,
    };
    let sto = Object { image, function: etg::STO, instance: 1 };
    program.stops.restart = sto.value(etg::sto::RESTART_ACKNOWLEDGE_BEHAVIOR) != 0;
    let mut before = 0;
    for key in image.keys() {
        let instance = key >> 8;
        if core::mem::replace(&mut before, instance) != instance {
            let object = Object { image, function: instance >> 8, instance: instance & 0xFF };
            add(&mut builder, program, &object);
        }
    }
    let full = builder.full;
    program.rules = match program.rules {
        Rules::Etg(_) | Rules::Refused if full => Rules::Refused,
        _ => Rules::Etg(builder.etg),
    };
}

fn assignments(image: &Image, base: u32) -> [(u32, u8); SEATS] {
    let mut table = [(0, 0); SEATS];
    let keys = image.keys().filter(|key| (base..base + 0x100).contains(key));
    for (place, key) in table.iter_mut().zip(keys) {
        *place = (image.value(key) as u32, key as u8);
    }
    table
}

fn add(builder: &mut Builder, program: &mut Program, object: &Object) {
    let (n_positive, n_negative) = (builder.top.0, builder.top.1.saturating_abs());
    let n_max = n_positive.saturating_abs().max(n_negative);
    let window = |lower: i64, upper: i64| Range { lower, upper };
    let at_once = Approach { limit_ns: Some(0), unmonitored: true, ..Approach::default() };
    match object.function {
        etg::SS1 => ss1(builder, program, object, n_max),
        etg::SS2 => ss2(builder, program, object, n_max),
        etg::SOS => {
            let position = Range::symmetric(object.value(etg::sos::POSITION_ZERO_WINDOW));
            let request = builder.watch(program, object, Quantity::Travel, at_once, position, FIXED_STO);
            let plan = Plan {
                quantity: Quantity::Speed,
                approach: at_once,
                window: Range::symmetric(object.speed(etg::sos::VELOCITY_ZERO_WINDOW)),
                function: reference(object.function, object.instance) as u16,
                request: Some(request),
                status: builder.status(object),
                reaction: Reaction::Sto,
            };
            if object.named(etg::sos::VELOCITY_ZERO_WINDOW).is_some() {
                program.add(plan);
            }
        }
        etg::SSR => {
            use etg::ssr;
            let times = Times {
                limit: ssr::TIME_TO_VELOCITY_MONITORING,
                dwell: ssr::TIME_FOR_VELOCITY_IN_LIMITS,
                slope: ssr::DECELERATION_LIMIT,
                delay: ssr::TIME_DELAY_DECELERATION_MONITORING,
            };
            let (upper, lower) =
                (object.value(ssr::VELOCITY_UPPER_LIMIT), object.value(ssr::VELOCITY_LOWER_LIMIT));
            // DEC-04: the larger of the two demands.
            let above = n_positive.saturating_sub(upper).saturating_abs();
            let below = n_negative.saturating_add(lower).saturating_abs();
            let range = window(lower.saturating_mul(RPM), upper.saturating_mul(RPM));
            let way = approach(object, &times, range, above.max(below));
            builder.watch(program, object, Quantity::Speed, way, range, ssr::ERROR_REACTION);
        }
        etg::SLS => {
            use etg::sls;
            let times = Times {
                limit: sls::TIME_TO_VELOCITY_MONITORING,
                dwell: sls::TIME_FOR_VELOCITY_IN_LIMITS,
                slope: sls::DECELERATION_LIMIT,
                delay: sls::TIME_DELAY_DECELERATION_MONITORING,
            };
            let limit = object.value(sls::VELOCITY_LIMIT);
            let range = Range::symmetric(limit.saturating_mul(RPM));
            let way = approach(object, &times, range, n_max.saturating_sub(limit).saturating_abs());
            builder.watch(program, object, Quantity::Speed, way, range, sls::ERROR_REACTION);
        }
        etg::SAR => {
            use etg::sar;
            let range = window(
                object.speed(sar::ACCELERATION_LOWER_LIMIT),
                object.speed(sar::ACCELERATION_UPPER_LIMIT),
            );
            builder.watch(program, object, Quantity::Acceleration, at_once, range, sar::ERROR_REACTION);
        }
        etg::SLP => {
            use etg::slp;
            let range =
                window(object.value(slp::POSITION_LOWER_LIMIT), object.value(slp::POSITION_UPPER_LIMIT));
            builder.watch(program, object, Quantity::Position, at_once, range, slp::ERROR_REACTION);
        }
        etg::SLT => {
            use etg::slt;
            // Per mille to millionths.
            let negative = object.value(slt::TORQUE_LIMIT_NEGATIVE_DIRECTION).saturating_mul(-1_000);
            let range =
                window(negative, object.value(slt::TORQUE_LIMIT_POSITIVE_DIRECTION).saturating_mul(1_000));
            builder.watch(program, object, Quantity::Torque, at_once, range, slt::ERROR_REACTION);
        }
        etg::SLI => {
            use etg::sli;
            // DEC-31: magnitudes.
            let lower = object.value(sli::POSITION_RELATIVE_LOWER_LIMIT).saturating_abs().saturating_neg();
            let range = window(lower, object.value(sli::POSITION_RELATIVE_UPPER_LIMIT));
            builder.watch(program, object, Quantity::Travel, at_once, range, sli::ERROR_REACTION);
        }
        etg::SMS => {
            let range = window(n_negative.saturating_mul(-RPM), n_positive.saturating_mul(RPM));
            let wanted = (n_negative | n_positive) != 0;
            always(builder, program, object, (Quantity::Speed, range, etg::sms::ERROR_REACTION), wanted);
        }
        etg::SMA => {
            use etg::sma;
            let slowest = object.speed(sma::DECELERATION_MAXIMUM).saturating_abs();
            let range = window(slowest.saturating_neg(), object.speed(sma::ACCELERATION_MAXIMUM));
            let wanted = (range.lower | range.upper) != 0;
            always(builder, program, object, (Quantity::Acceleration, range, sma::ERROR_REACTION), wanted);
        }
        etg::SDI => sdi(builder, program, object),
        etg::SSM | etg::SCA => signal(builder, object),
        etg::SBC => {
            builder.seat(object, |_| Target::Brake);
            builder.etg.brake_status = builder.status(object);
        }
        _ => {}
    }
}

fn always(
    builder: &mut Builder,
    program: &mut Program,
    object: &Object,
    row: (Quantity, Range, u32),
    wanted: bool,
) {
    let (quantity, window, error) = row;
    if wanted {
        program.add(Plan {
            quantity,
            approach: Approach { window, ..Approach::default() },
            window,
            function: reference(object.function, object.instance) as u16,
            request: None,
            status: builder.status(object),
            reaction: Builder::reaction(object, error),
        });
    }
}

fn place_stop(builder: &mut Builder, program: &mut Program, object: &Object, plan: stop::Plan) -> usize {
    let place = builder.stops;
    if usize::from(place) >= STOPS {
        builder.full = true;
        return STOPS;
    }
    builder.stops = place.saturating_add(1);
    builder.seat(object, |_| Target::Stop(place));
    program.stops.set(place, plan);
    usize::from(place)
}

fn ss1(builder: &mut Builder, program: &mut Program, object: &Object, n_max: i64) {
    use etg::ss1;
    let times = Times {
        limit: ss1::TIME_TO_STO,
        dwell: ss1::TIME_FOR_VELOCITY_ZERO,
        slope: ss1::DECELERATION_LIMIT,
        delay: ss1::TIME_DELAY_DECELERATION_MONITORING,
    };
    let window = Range::symmetric(object.speed(ss1::VELOCITY_ZERO_WINDOW));
    let mut way = approach(object, &times, window, n_max);
    let windowed = object.named(ss1::VELOCITY_ZERO_WINDOW).is_some();
    way.dwell_ns = way.dwell_ns.filter(|_| windowed);
    let brakes = object.value(ss1::ACTIVATE_SBC) != 0;
    let delay = object.image.value(etg_key(etg::SBC, 1, etg::sbc::BRAKE_TIME_DELAY));
    let delay_ns = (delay.max(0) as u64).saturating_mul(1_000_000);
    let dwell_ns = way.dwell_ns;
    if brakes {
        // ETG-SBC-04: the brake closes after the dwell, STO follows when it is closed.
        way.dwell_ns = dwell_ns.map(|dwell| dwell.saturating_add(delay_ns));
    }
    let number = reference(object.function, object.instance) as u16;
    let plan = stop::Plan {
        end: End::Sto,
        approach: way,
        judged_at_end: windowed,
        function: number,
        stand_function: number,
        ..stop::Plan::default()
    };
    let place = place_stop(builder, program, object, plan);
    let late_ns = way.limit_ns.map(|limit| limit.saturating_sub(delay_ns));
    if let Some(times) = builder.etg.stop_times_ns.get_mut(place).filter(|_| brakes) {
        *times = Some((late_ns.unwrap_or(u64::MAX), dwell_ns.unwrap_or(u64::MAX)));
    }
}

fn ss2(builder: &mut Builder, program: &mut Program, object: &Object, n_max: i64) {
    use etg::{sos, ss2};
    let times = Times {
        limit: ss2::TIME_TO_SOS,
        dwell: ss2::TIME_FOR_VELOCITY_ZERO,
        slope: ss2::DECELERATION_LIMIT,
        delay: ss2::TIME_DELAY_DECELERATION_MONITORING,
    };
    // ETG-SS2-02, ETG-SS2-03: the windows are those of the SOS with the same number.
    let stand = Object { image: object.image, function: etg::SOS, instance: object.instance };
    let window = Range::symmetric(stand.speed(sos::VELOCITY_ZERO_WINDOW));
    let windowed = stand.named(sos::VELOCITY_ZERO_WINDOW).is_some();
    let mut way = approach(object, &times, window, n_max);
    way.dwell_ns = way.dwell_ns.filter(|_| windowed);
    let plan = stop::Plan {
        end: End::Sos,
        approach: way,
        judged_at_end: false,
        stand_speed: if windowed { window } else { Range::ALL },
        stand_position: Range::symmetric(stand.value(sos::POSITION_ZERO_WINDOW)),
        function: reference(object.function, object.instance) as u16,
        stand_function: reference(stand.function, stand.instance) as u16,
        reaction: Builder::reaction(object, ss2::ERROR_REACTION),
        restart: object.value(ss2::RESTART_ACKNOWLEDGE_BEHAVIOR) != 0,
    };
    let place = place_stop(builder, program, object, plan);
    let bit = builder.status(&stand);
    if let Some(entry) = builder.etg.standing_status.get_mut(place) {
        *entry = bit;
    }
}

/// ETG-SDI-02, ETG-SDI-06, DEC-30.
fn sdi(builder: &mut Builder, program: &mut Program, object: &Object) {
    use etg::sdi;
    let zero = object.speed(sdi::VELOCITY_ZERO_WINDOW);
    let speed_named = object.named(sdi::VELOCITY_ZERO_WINDOW).is_some();
    let position = object.value(sdi::POSITION_ZERO_WINDOW);
    let above = |limit: i64| Range { lower: limit.saturating_neg(), upper: i64::MAX };
    let below = |limit: i64| Range { lower: i64::MIN, upper: limit };
    let rows = [
        (SDI_BOTH, Quantity::TravelFromZero(zero), Range::symmetric(position), Range::symmetric(zero)),
        (SDI_POSITIVE_ONLY, Quantity::TravelBackFromZero(zero), above(position), above(zero)),
        (SDI_NEGATIVE_ONLY, Quantity::TravelForthFromZero(zero), below(position), below(zero)),
    ];
    let plan = |quantity, window, request| Plan {
        quantity,
        window,
        approach: Approach { limit_ns: Some(0), unmonitored: true, ..Approach::default() },
        function: reference(object.function, object.instance) as u16,
        request: Some(request),
        status: None,
        reaction: Reaction::Sto,
    };
    for (request, quantity, travel, speed) in rows {
        program.add(plan(quantity, travel, request));
        if speed_named {
            program.add(plan(Quantity::SpeedFromZero(zero), speed, request));
        }
    }
    builder.etg.sdi = Some(zero);
    builder.etg.known = builder.etg.known.with(control::SDIP, true).with(control::SDIN, true);
}

/// ETG-SSM-02, ETG-SCA-02: both limits exist and one of them is not zero.
fn signal(builder: &mut Builder, object: &Object) {
    let position = object.function == etg::SCA;
    let (upper, lower) = if position {
        (object.named(etg::sca::POSITION_UPPER_LIMIT), object.named(etg::sca::POSITION_LOWER_LIMIT))
    } else {
        let speed = |value: i64| value.saturating_mul(RPM);
        (
            object.named(etg::ssm::VELOCITY_UPPER_LIMIT).map(speed),
            object.named(etg::ssm::VELOCITY_LOWER_LIMIT).map(speed),
        )
    };
    let (Some(upper), Some(lower), Some(status)) = (upper, lower, builder.status(object)) else { return };
    let place = builder.etg.signals.iter_mut().find(|place| place.is_none());
    if let Some(place) = place.filter(|_| (upper | lower) != 0) {
        *place = Some(Signal { position, range: Range { lower, upper }, status });
    }
}

impl Etg {
    /// Requests of this step.
    pub fn requests(&mut self, outside: &Outside) -> Requests {
        let mut requests = Requests::default();
        let word = outside.word.unwrap_or(Word::ZERO);
        let mut requested = self.known;
        for (asked, word) in requested.0.iter_mut().zip(word.0) {
            *asked &= !word;
        }
        requests.requested = requested;
        self.brake_requested = false;
        requests.demand = Demand { sto: requested.bit(control::STO), ..Demand::default() };
        for (bit, target) in self.targets.iter().take(self.used).flatten() {
            if !requested.bit(*bit) {
                continue;
            }
            match target {
                Target::Watch(seat) => requests.watches |= 1_u64.wrapping_shl(u32::from(*seat)),
                Target::Stop(place) => requests.demand.stops |= 1_u8.wrapping_shl(u32::from(*place)),
                Target::Brake => self.brake_requested = true,
            }
        }
        let mode = match (requested.bit(control::SDIP), requested.bit(control::SDIN)) {
            (false, false) => None,
            (true, true) => Some(SDI_BOTH),
            (false, true) => Some(SDI_POSITIVE_ONLY),
            (true, false) => Some(SDI_NEGATIVE_ONLY),
        };
        requests.watches |= mode.map_or(0, |mode| 1_u64.wrapping_shl(u32::from(mode)));
        let level = |bit: u8| outside.word.map(|word| word.bit(bit));
        let (error, restart) = (level(control::ERROR_ACK), level(control::RESTART_ACKNOWLEDGE));
        requests.acknowledgements = u32::from(error == Some(true)) | u32::from(restart == Some(true)) << 1;
        requests.acknowledge = super::edge(&mut self.error_armed, error);
        requests.demand.restart = super::edge(&mut self.restart_armed, restart);
        requests
    }

    /// Status word; SSM, SCA and the moving bits go on in STO (DEC-14).
    pub fn status(&self, state: &State) -> Word {
        let mut word = Word::ZERO.with(status::STO, state.sto).with(status::ERROR, state.error);
        for signal in self.signals.iter().flatten() {
            let value = if signal.position { state.sample.position } else { state.sample.speed };
            word = word.with(signal.status, signal.range.left_by(value).is_none());
        }
        if let Some(zero) = self.sdi {
            let speed = state.sample.speed;
            word = word.with(status::SDIP, speed > zero).with(status::SDIN, speed < zero.saturating_neg());
        }
        if let Some(bit) = self.brake_status {
            word = word.with(bit, self.brake_open(state));
        }
        word = word.with(status::RESTART_ACKNOWLEDGE_REQUEST, state.stops.restart_pending);
        if state.sto {
            return word;
        }
        let mut broken = false;
        for watch in state.watches {
            broken |= watch.violated();
            if let Some(bit) = watch.plan.status.filter(|_| watch.active()) {
                word = word.with(bit, true);
            }
        }
        // A bit with two instances needs both.
        let seen = if broken { state.watches } else { &[] };
        for watch in seen.iter().filter(|watch| watch.violated()) {
            if let Some(bit) = watch.plan.status {
                word = word.with(bit, false);
            }
        }
        if let Active::Standing(place, _) = state.stops.active() {
            let bit = self.standing_status.get(usize::from(place)).copied().flatten();
            word = bit.map_or(word, |bit| word.with(bit, true));
        }
        word
    }

    /// ETG-SBC-01 to ETG-SBC-06.
    fn brake_open(&self, state: &State) -> bool {
        let closing = match state.stops.active() {
            Active::Braking(place, progress) => {
                let times = self.stop_times_ns.get(usize::from(place)).copied().flatten();
                times.is_some_and(|(late_ns, dwell_ns)| {
                    let now_ns = state.sample.now_ns;
                    let late = now_ns.saturating_sub(progress.since_ns()) >= late_ns;
                    let inside = progress.inside_since_ns();
                    let dwelt = inside.is_some_and(|since| now_ns.saturating_sub(since) >= dwell_ns);
                    late | dwelt
                })
            }
            _ => false,
        };
        !(state.sto | self.brake_requested | closing)
    }

    /// What is asked of the drive.
    pub fn drive(&self, state: &State) -> DriveRequest {
        DriveRequest { brake_open: self.brake_open(state), ..DriveRequest::default() }
    }
}

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
    super::common_findings(image, report);
}
