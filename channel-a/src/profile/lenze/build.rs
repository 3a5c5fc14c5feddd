//! From the codes of a set to the instances of the engine.

use super::super::{Program, Rules};
use super::contacts::Contact;
use super::overspeed::Overspeed;
use super::pairs::{Pairs, Role};
use super::pulse::Pulse;
use super::{
    Cascade, Lenze, MILLISECOND, Mode, PAIRS, RPM, SLI_REQUEST, SLS, SLS_CODE, SMS_CODE, SS1, SS2, code,
};
use crate::encoder::Selection;
use crate::encoder::twin::{Compared, Twin};
use crate::engine::Range;
use crate::engine::approach::{Approach, Fall};
use crate::engine::stop::{self, End, Reaction};
use crate::engine::watch::{Plan, Quantity};
use crate::image::Image;
use crate::inputs::filter_samples;
use crate::outputs::Gaps;
use shm_schema::encoder::SlotKind;
use shm_schema::facts::lenze_sm301::{control, status};

/// Fixed filter for test pulses, µs (LNZ-IN-11).
const TEST_PULSE_US: u64 = 2_000;
/// Gap of the clock output, µs, below 1 ms, and its period, ms (LNZ-PAS-02).
const CLOCK_GAP_US: i64 = 500;
const CLOCK_PERIOD_MS: i64 = 2_000;
/// Where a position encoder is connected (DEC-50).
const POSITION_SLOT: u8 = 2;
const SLI: u16 = 111;
const SDI: [(u8, u16); 2] = [(control::SDIPOS, 103), (control::SDINEG, 104)];
const SOS_LEFT: u16 = 106;

fn reaction(value: i64) -> Reaction {
    match value {
        1 => Reaction::Stop(SS1),
        2 => Reaction::Stop(SS2),
        _ => Reaction::Sto,
    }
}

/// Directions as request bits: 1 is only positive, 2 only negative.
const fn direction(value: i64) -> u32 {
    match value {
        1 => 1 << control::SDIPOS,
        2 => 1 << control::SDINEG,
        _ => 0,
    }
}

/// The status bit that says "monitored".
const fn monitored_bit(request: Option<u8>) -> Option<u8> {
    match request {
        Some(bit @ control::SLS1..=control::SLS4) => Some(status::SLS1_MONITORED + (bit - control::SLS1)),
        Some(control::SDIPOS) => Some(status::SDIPOS_MONITORED),
        Some(control::SDINEG) => Some(status::SDINEG_MONITORED),
        _ => None,
    }
}

/// Builds the axis.
pub fn build(image: &Image, program: &mut Program) {
    program.take_common(image);
    let c = |number: u32| code(image, number, 0);
    let rpm = |number: u32| c(number).saturating_mul(RPM);
    let after = |delay_ms: i64, window: Range| Approach {
        unmonitored: true,
        limit_ns: Some((delay_ms.max(0) as u64).saturating_mul(MILLISECOND)),
        window,
        ..Approach::default()
    };
    let plan = |quantity, approach: Approach, window, function: u16, request, error| Plan {
        quantity,
        approach,
        window,
        function,
        request,
        status: monitored_bit(request),
        reaction: error,
    };
    let top = Range::symmetric(rpm(15_320));
    if c(15_320) > 0 {
        program.add(plan(Quantity::Speed, after(0, top), top, SMS_CODE, None, reaction(c(15_321))));
    }
    for (bit, number) in SLS.into_iter().zip(1..) {
        let window = Range::symmetric(code(image, 15_330, number).saturating_mul(RPM));
        let way = after(code(image, 15_331, number), window);
        let error = reaction(code(image, 15_332, number));
        program.add(plan(Quantity::Speed, way, window, SLS_CODE + number as u16 - 1, Some(bit), error));
    }
    let tolerance = c(15_342);
    let back = Range { lower: tolerance.saturating_neg(), upper: i64::MAX };
    let forth = Range { lower: i64::MIN, upper: tolerance };
    for ((bit, number), (quantity, window)) in
        SDI.into_iter().zip([(Quantity::TravelFromHighest, back), (Quantity::TravelFromLowest, forth)])
    {
        program.add(plan(
            quantity,
            after(c(15_341), Range::ALL),
            window,
            number,
            Some(bit),
            reaction(c(15_343)),
        ));
    }
    let increment = Range::symmetric(c(15_203));
    program.add(plan(
        Quantity::Travel,
        after(0, Range::ALL),
        increment,
        SLI,
        Some(SLI_REQUEST),
        Reaction::Sto,
    ));
    stops(image, program);
    // LNZ-PAS-02: the clock output CLA, short gaps every 2 s.
    program.gaps = [Gaps::default(), Gaps::default(), Gaps::new(CLOCK_GAP_US, CLOCK_PERIOD_MS)];
    program.supplies = true;
    let resolver = c(15_400) == 2;
    program.encoder = encoder(image, program.encoder, resolver);
    // LNZ-SPD-06
    program.twin = (c(15_400) != 0).then(|| Twin::new(Compared::Speed(c(15_411))));
    program.rules = Rules::Lenze(rules(image, resolver));
}

fn encoder(image: &Image, common: Selection, resolver: bool) -> Selection {
    let c = |number: u32| code(image, number, 0);
    if (common.slot == POSITION_SLOT) & (c(15_500) != 0) {
        return position_encoder(image, common);
    }
    let (kind, periods) = match c(15_400) {
        0 => (Some(SlotKind::Encoderless), 1),
        _ if resolver => (Some(SlotKind::Resolver), c(15_430)),
        _ => (Some(SlotKind::SineCosine), c(15_420)),
    };
    Selection { kind, periods, inverted: c(15_409) == 1, ..common }
}

/// The encoder on the machine: its direction is stated against that of the motor encoder
/// (LNZ-SPD-12), its gear in hundredths (LNZ-SPD-17); sine or TTL is what the slot has.
fn position_encoder(image: &Image, common: Selection) -> Selection {
    let c = |number: u32| code(image, number, 0);
    let kind = (c(15_500) == 2).then_some(SlotKind::Digital);
    let inverted = (c(15_409) == 1) ^ (c(15_502) == 1);
    Selection { kind, inverted, gear: c(15_501), ..common }
}

fn stops(image: &Image, program: &mut Program) {
    let c = |number: u32| code(image, number, 0);
    let time_ns = |number: u32| (c(number).max(0) as u64).saturating_mul(MILLISECOND);
    let end_ns = time_ns(15_305);
    let window = Range::symmetric(c(15_310).saturating_mul(RPM));
    // LNZ-RAMP-04: 10 % of the stopping time, 30 % at full S-ramp time; in thousandths.
    let share = 100_u64.saturating_add((c(15_316).max(0) as u64).saturating_mul(2));
    let fall = Fall {
        percent: c(15_317),
        least: window.upper,
        hold_ns: end_ns.saturating_mul(share) / 1_000,
        end_ns,
    };
    let way = Approach {
        unmonitored: true,
        limit_ns: Some(end_ns),
        window,
        dwell_in_delay: true,
        fall: (c(15_315) == 1).then_some(fall),
        ..Approach::default()
    };
    let at_zero_1 = (c(15_306) == 1).then(|| time_ns(15_307));
    let at_zero_2 = (c(15_308) == 1).then_some(0);
    let plan = |end, approach, restart| stop::Plan {
        end,
        approach,
        restart,
        judged_at_end: true,
        stand_speed: Range::ALL,
        stand_position: Range::symmetric(c(15_311)),
        stand_function: SOS_LEFT,
        ..stop::Plan::default()
    };
    let restart = |subcode: u32| code(image, 15_300, subcode) == 0;
    program.stops.set(SS1, plan(End::Sto, Approach { dwell_ns: at_zero_1, ..way }, false));
    program.stops.set(SS2, plan(End::Sos, Approach { dwell_ns: at_zero_2, ..way }, restart(2)));
    program.stops.restart = restart(1);
    program.stops.direct_sos = true;
}

fn rules(image: &Image, resolver: bool) -> Lenze {
    let c = |number: u32| code(image, number, 0);
    let each = |number: u32| [1, 2, 3, 4].map(|subcode| code(image, number, subcode));
    let cascading = c(15_035) == 4;
    let mut roles = [Role::Deactivated; PAIRS];
    let rows = each(15_030).into_iter().zip(each(15_031)).zip(each(15_032));
    for (role, ((sensor, function), assigned)) in roles.iter_mut().zip(rows) {
        *role = match (sensor, function) {
            (0, _) => Role::Deactivated,
            (_, 1) => Role::Request(1 << control::SSE),
            (_, 2) => Role::Mode,
            (_, 3) => Role::Enable,
            _ if assigned >= 9 => Role::Request(0),
            _ => Role::Request(1_u32.wrapping_shl(assigned as u32)),
        };
    }
    if cascading {
        roles[3] = Role::Cascade;
    }
    let with_sls = each(15_333).map(direction);
    let directed = SLS.into_iter().zip(with_sls).filter(|(_, direction)| *direction != 0);
    let directed_sls = directed.fold(0, |all, (bit, _)| all | 1_u32.wrapping_shl(u32::from(bit)));
    let contact = |(discrepancy, delay): (i64, i64)| {
        let filter_us = TEST_PULSE_US.saturating_add((delay.max(0) as u64).saturating_mul(1_000));
        Contact::new(filter_samples(filter_us), (discrepancy.max(0) as u64).saturating_mul(MILLISECOND))
    };
    let mut contacts = [Contact::default(); PAIRS];
    for (place, row) in contacts.iter_mut().zip(each(15_033).into_iter().zip(each(15_034))) {
        *place = contact(row);
    }
    let filter = c(15_113) as u32;
    Lenze {
        filter,
        bus: c(15_100) != 0,
        pairs: Pairs::new(roles, contacts),
        mode: Mode::Normal,
        special_when_low: c(15_202) == 1,
        special_stop: reaction(c(15_200)),
        motion: if (3..=6).contains(&c(15_201)) { 1_u32.wrapping_shl(c(15_201) as u32) } else { 0 },
        permanent: direction(c(15_340)),
        with_sls,
        directed_sls,
        limited_increment: c(15_203) > 0,
        emergency_stop: if c(15_205) == 1 { Reaction::Stop(SS1) } else { Reaction::Sto },
        emergency: false,
        emergency_asked: false,
        cascade: cascading.then_some(Cascade::Closed),
        overspeed: Overspeed::new((c(15_350).max(0) as u64).saturating_mul(MILLISECOND)),
        encoderless: c(15_400) == 0,
        enable_armed: false,
        ais_armed: false,
        aie_armed: false,
        ais: Pulse::default(),
        aie: Pulse::default(),
        special_requested: false,
        output_off: false,
        output_by_bus: filter & (1 << control::SD_OUT1) != 0,
        output_conditions: [code(image, 15_051, 1) as u32, code(image, 15_052, 1) as u32],
        output_and: code(image, 15_055, 1) == 1,
        resolver,
        window: Range::symmetric(c(15_310).saturating_mul(RPM)),
    }
}
