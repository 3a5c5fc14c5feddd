//! SS1 and SS2.

use super::super::Program;
use super::Target;
use super::build::{Builder, reference};
use super::object::{Object, Times, approach, instances};
use crate::engine::Range;
use crate::engine::stop::{self, End, STOPS};
use crate::image::Image;
use shm_schema::facts::etg;
use shm_schema::profile::etg_key;

/// Places of the stops: every instance of SS1, then every one of SS2, in ascending order.
fn stop_instances<'a>(image: &'a Image) -> impl Iterator<Item = (u32, u32)> + 'a {
    let is_stop = |function: u32| (function == etg::SS1) | (function == etg::SS2);
    instances(image).filter(move |(function, _)| is_stop(*function)).take(STOPS)
}

pub(super) fn standing_reference(wanted: u32, image: &Image) -> Option<u8> {
    let mut stops = stop_instances(image);
    stops.position(|(function, instance)| reference(function, instance) == wanted).map(|place| place as u8)
}

fn place_stop(builder: &mut Builder, program: &mut Program, object: &Object, plan: stop::Plan) -> usize {
    let place = builder.stops;
    if usize::from(place) >= STOPS {
        builder.refuse(object);
        return STOPS;
    }
    builder.stops = place.saturating_add(1);
    builder.seat(object, |_| Target::Stop(place));
    program.stops.set(place, plan);
    usize::from(place)
}

pub(super) fn ss1(builder: &mut Builder, program: &mut Program, object: &Object, n_max: i64) {
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
    let brake = object.value(ss1::ACTIVATE_SBC) as u32;
    let brakes = brake != 0;
    let delay = object.image.value(etg_key(etg::SBC, brake & 0xFF, etg::sbc::BRAKE_TIME_DELAY));
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

pub(super) fn ss2(builder: &mut Builder, program: &mut Program, object: &Object, n_max: i64) {
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
    let bit = Builder::status(&stand);
    if let Some(entry) = builder.etg.standing_status.get_mut(place) {
        *entry = bit;
    }
}
