//! From the objects of a set to the instances of the engine, in the order of their keys.

use super::super::{Program, Rules};
use super::object::{Object, Times, approach, instances};
use super::stops::{ss1, ss2, standing_reference};
use super::words::{control_bit, status_bit};
use super::{Etg, RPM, SDI_BOTH, SDI_NEGATIVE_ONLY, SDI_POSITIVE_ONLY, SEATS, SIGNALS, Signal, Target};
use crate::engine::Range;
use crate::engine::approach::Approach;
use crate::engine::stop::{Reaction, STOPS};
use crate::engine::watch::{Plan, Quantity};
use crate::image::Image;
use shm_schema::error::ErrorCode;
use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::control;
use shm_schema::word::Word;

/// In place of an error reaction object: STO, not configurable.
const FIXED_STO: u32 = 0;

/// Numbers of the seats while the program is built.
pub(super) struct Builder {
    pub(super) etg: Etg,
    top: (i64, i64),
    pub(super) stops: u8,
    braked: bool,
    pub(super) excess: Option<ErrorCode>,
}

pub(super) const fn reference(function: u32, instance: u32) -> u32 {
    function << 8 | instance
}

impl Builder {
    fn control(object: &Object) -> Option<u8> {
        control_bit(object.image, object.function, object.instance)
    }

    pub(super) fn status(object: &Object) -> Option<u8> {
        status_bit(object.image, object.function, object.instance)
    }

    /// There is no place for this instance; the first one is named.
    pub(super) fn refuse(&mut self, object: &Object) {
        let code = super::super::no_place(reference(object.function, object.instance));
        self.excess.get_or_insert(code);
    }

    /// Seats `target`; its number.
    pub(super) fn seat(&mut self, object: &Object, target: impl Fn(u8) -> Target) -> u8 {
        let number = self.etg.used;
        let Some(bit) = Self::control(object) else { return SDI_NEGATIVE_ONLY + 1 };
        match self.etg.targets.get_mut(number) {
            Some(place) => {
                *place = Some((bit, target(number as u8)));
                self.etg.known = self.etg.known.with(bit, true);
                self.etg.used = number.saturating_add(1);
            }
            None => self.refuse(object),
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
            status: Self::status(object),
            reaction: Self::reaction(object, error),
        });
        request
    }

    /// ETG-ERR-01, ETG-ERR-02; the stops come before everything that refers to them.
    pub(super) fn reaction(object: &Object, error: u32) -> Reaction {
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
    let mut builder = Builder { etg, top, stops: 0, braked: false, excess: None };
    let sto = Object { image, function: etg::STO, instance: 1 };
    program.stops.restart = sto.value(etg::sto::RESTART_ACKNOWLEDGE_BEHAVIOR) != 0;
    for (function, instance) in instances(image) {
        add(&mut builder, program, &Object { image, function, instance });
    }
    program.excess = builder.excess.or(program.excess);
    program.rules = Rules::Etg(builder.etg);
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
                status: Builder::status(object),
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
            always(program, object, (Quantity::Speed, range, etg::sms::ERROR_REACTION), wanted);
        }
        etg::SMA => {
            use etg::sma;
            let slowest = object.speed(sma::DECELERATION_MAXIMUM).saturating_abs();
            let range = window(slowest.saturating_neg(), object.speed(sma::ACCELERATION_MAXIMUM));
            let wanted = (range.lower | range.upper) != 0;
            always(program, object, (Quantity::Acceleration, range, sma::ERROR_REACTION), wanted);
        }
        etg::SDI => sdi(builder, program, object),
        etg::SSM | etg::SCA => signal(builder, object),
        etg::SBC => brake(builder, object),
        _ => {}
    }
}

/// ETG-SBC-08: there is one brake; a second one finds no place.
fn brake(builder: &mut Builder, object: &Object) {
    if builder.braked {
        return builder.refuse(object);
    }
    builder.braked = true;
    builder.seat(object, |_| Target::Brake);
    builder.etg.brake_status = Builder::status(object);
}

fn always(program: &mut Program, object: &Object, row: (Quantity, Range, u32), wanted: bool) {
    let (quantity, window, error) = row;
    if wanted {
        program.add(Plan {
            quantity,
            approach: Approach { window, ..Approach::default() },
            window,
            function: reference(object.function, object.instance) as u16,
            request: None,
            status: Builder::status(object),
            reaction: Builder::reaction(object, error),
        });
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
    let (Some(upper), Some(lower), Some(status)) = (upper, lower, Builder::status(object)) else { return };
    if (upper | lower) == 0 {
        return;
    }
    match builder.etg.signals.iter_mut().find(|place| place.is_none()) {
        Some(place) => *place = Some(Signal { position, range: Range { lower, upper }, status }),
        None => builder.refuse(object),
    }
}
