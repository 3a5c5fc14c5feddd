//! The AMK profile through whole steps, to the cycle.

use shm_schema::encoder::Encoder;
use shm_schema::exchange::{CellFault, Inputs, Published, Start};
use shm_schema::facts::amk_kw::{control, status as shown};
use shm_schema::profile::Profile;
use shm_schema::report::{Phase, Stop};
use std::vec;
use std::vec::Vec;

use crate::testing::{MS, Rig, World, codes, status};

const NEUTRAL: u32 = 0x0000_7E7F;

fn amk(changes: &[(u32, i32)]) -> Rig {
    let mut all = vec![(67, 3000), (2, 1_000_000), (3, 60_000), (64, 10)];
    all.extend_from_slice(changes);
    Rig::new(Profile::AmkKw, &all)
}

fn request(bit: u8) -> u32 {
    NEUTRAL & !(1 << bit)
}

fn bit(outputs: &shm_schema::exchange::Outputs, bit: u8) -> bool {
    status(outputs) >> bit & 1 == 1
}

#[test]
fn a_neutral_axis_is_permitted_from_the_first_cycle_and_stays_so() {
    let mut rig = amk(&[]);
    rig.world.speed = 2_000_000;
    for _ in 0..3_000 {
        let outputs = rig.step();
        assert_eq!(codes(&outputs), Vec::<[u32; 4]>::new());
        assert!(outputs.inhibit.permit);
        assert_eq!(status(&outputs), 0xF000_0100);
    }
}

/// AMK-STO-04, AMK-GEN-05, DEC-12: at once, and left when the request is gone.
#[test]
fn sto_is_entered_and_left_in_the_cycle_of_its_request() {
    let mut rig = amk(&[]);
    rig.step();
    rig.world.word = request(control::STO);
    let off = rig.step();
    assert!(!off.inhibit.permit);
    assert_eq!(status(&off), 0xF000_0001);
    rig.world.word = NEUTRAL;
    rig.step();
    assert!(rig.step().inhibit.permit);
}

/// AMKP-RAMP-04: only what has a ramp row names 60,000 rpm; SMS names its side.
#[test]
fn beyond_60_000_rpm_sms_still_names_its_side() {
    for (speed, side) in [(60_001_000, 3), (-60_001_000, 4)] {
        let mut rig = amk(&[]);
        rig.step();
        rig.world.speed = speed;
        assert_eq!(codes(&rig.step()), [[3606, 108, side, 0]]);
    }
}

/// AMK-EX-SMS-2, AMK-GEN-12: up to and including the limit is permitted.
#[test]
fn sms_trips_beyond_the_limit_and_clears_on_an_edge_only() {
    let mut rig = amk(&[]);
    rig.world.speed = 3_000_000;
    assert!(rig.step().inhibit.permit);
    rig.world.speed = -3_000_001;
    let tripped = rig.step();
    assert_eq!(codes(&tripped), [[3606, 108, 4, 0]]);
    assert_eq!(status(&tripped), 0xF000_0081);
    assert!(!tripped.inhibit.permit);
    rig.world.speed = 0;
    rig.step();
    rig.world.word = NEUTRAL | 1 << control::ERROR_ACK;
    let cleared = rig.step();
    assert!(codes(&cleared).is_empty());
    assert!(cleared.report.ready);
    assert!(bit(&cleared, shown::SMS));
}

/// DEC-15, DEC-16: a level that was high when the error appeared is no edge.
#[test]
fn a_standing_acknowledge_clears_nothing() {
    let mut rig = amk(&[]);
    rig.world.word = NEUTRAL | 1 << control::ERROR_ACK;
    rig.step();
    rig.world.speed = 4_000_000;
    rig.step();
    rig.world.speed = 0;
    for _ in 0..10 {
        assert_eq!(codes(&rig.step()).len(), 1);
    }
}

/// AMK-EX-SS1-1: 3000 rpm, 100 ms delay, 3000 rpm in 1000 ms, window 30 rpm: the line meets
/// the window at 100 + 990 ms.
#[test]
fn ss1_ends_in_sto_when_the_line_meets_the_window() {
    let mut rig = amk(&[(18, 100), (20, 1000), (21, 30)]);
    rig.world.speed = 3_000_000;
    rig.step();
    let begin = rig.cycle;
    let follow = move |cycle: u64, world: &mut World| {
        world.word = request(control::SS1);
        let e = (cycle - begin) as i64;
        world.speed = (3_000_000 - (e - 100).max(0) * 3_000).max(0);
    };
    let end = rig.until(follow, |outputs| outputs.report.stop == Stop::Sto);
    assert_eq!(end.map(|end| end - begin), Some(1_090));
    assert!(rig.step().report.errors.is_empty());
    // DEC-12: left when the request is gone.
    rig.world.word = NEUTRAL;
    assert_eq!(rig.step().report.stop, Stop::None);
}

/// AMK-EX-SS1-2: one 1/1000 rpm above the line is an error in that very cycle.
#[test]
fn ss1_trips_on_the_first_deviation_from_the_line() {
    let run = |over: i64| {
        let mut rig = amk(&[(18, 0), (20, 1000), (21, 30)]);
        rig.world.speed = -3_000_000;
        rig.step();
        let begin = rig.cycle;
        let follow = move |cycle: u64, world: &mut World| {
            world.word = request(control::SS1);
            let e = (cycle - begin) as i64;
            world.speed = -(3_000_000 - e * 3_000 + if e == 500 { over } else { 0 }).max(0);
        };
        let end = rig.until(follow, |outputs| outputs.report.stop == Stop::Sto);
        (end.map(|end| end - begin), codes(&rig.step()))
    };
    assert_eq!(run(0), (Some(990), vec![]));
    assert_eq!(run(1), (Some(500), vec![[3606, 101, 0, 14]]));
}

/// DEC-11, DEC-12: what a violation ended in its end state stands while its request stands.
#[test]
fn a_violated_ss1_stays_in_sto_until_its_request_is_gone() {
    let mut rig = amk(&[(18, 0), (20, 1000), (21, 30)]);
    rig.world.speed = 2_000_000;
    rig.step();
    rig.world.word = request(control::SS1);
    rig.step();
    assert_eq!(codes(&rig.step()), [[3606, 101, 0, 14]]);
    rig.world.speed = 0;
    rig.step();
    rig.world.word = request(control::SS1) | 1 << control::ERROR_ACK;
    for _ in 0..50 {
        let stands = rig.step();
        assert_eq!((codes(&stands).len(), stands.report.stop), (0, Stop::Sto));
        assert!(!bit(&stands, shown::SS1_ACTIVE) & !stands.inhibit.permit);
    }
    rig.world.word = NEUTRAL;
    assert_eq!(rig.step().report.stop, Stop::None);
}

/// DEC-13, decision 0002: an SS1 requested in the STO that an SS1 reaction left behind is
/// remembered, and begins when STO is left.
#[test]
fn an_ss1_requested_after_an_ss1_reaction_is_remembered() {
    let set = [(59, 0), (61, 1000), (62, 400), (63, 1), (18, 10), (20, 1000), (21, 30)];
    let mut rig = amk(&set);
    rig.world.word = request(control::SLS2);
    rig.step();
    rig.world.speed = 2_000_000;
    assert_eq!(rig.step().report.stop, Stop::Ss1);
    rig.until(|_, _| (), |outputs| outputs.report.stop == Stop::Sto).expect("off its ramp");
    rig.world.speed = 0;
    rig.world.word &= request(control::SS1);
    rig.step();
    rig.world.clear = true;
    let cleared = rig.step();
    assert_eq!((codes(&cleared), cleared.report.stop), (vec![], Stop::Ss1));
    rig.world.clear = false;
    // Prm18: its delay passes, then it stands at once and holds STO.
    let begin = rig.cycle;
    assert_eq!(rig.until(|_, _| (), |o| o.report.stop == Stop::Sto).map(|end| end - begin), Some(9));
    assert_eq!(rig.step().report.stop, Stop::Sto);
    rig.world.word = request(control::SLS2);
    assert_eq!(rig.step().report.stop, Stop::None);
}

/// DEC-11, DEC-13: an SS1 that STO aborted has its end state; its standing request holds it.
#[test]
fn an_aborted_ss1_does_not_start_again_while_its_request_stands() {
    let mut rig = amk(&[(18, 500), (20, 1000), (21, 30)]);
    rig.step();
    rig.world.word = request(control::SS1);
    assert_eq!(rig.step().report.stop, Stop::Ss1);
    rig.world.word &= request(control::STO);
    rig.step();
    rig.world.word = request(control::SS1);
    for _ in 0..50 {
        assert_eq!(rig.step().report.stop, Stop::Sto);
    }
    rig.world.word = NEUTRAL;
    assert_eq!(rig.step().report.stop, Stop::None);
}

/// DEC-48: a stop whose request has gone before its end is visible for one cycle.
#[test]
fn a_pulse_runs_ss1_to_its_end_and_one_cycle_of_sto() {
    let mut rig = amk(&[(18, 10), (20, 1000), (21, 30)]);
    rig.step();
    rig.world.word = request(control::SS1);
    assert!(bit(&rig.step(), shown::SS1_ACTIVE));
    rig.world.word = NEUTRAL;
    let stops: Vec<Stop> = (0..12).map(|_| rig.step().report.stop).collect();
    assert_eq!(stops[8..11], [Stop::Ss1, Stop::Sto, Stop::None]);
}

/// AMK-EX-SS2-1, DEC-08: SOS around the position where the standstill phase begins.
#[test]
fn ss2_holds_the_position_at_which_the_line_met_the_window() {
    let mut rig = amk(&[(23, 0), (25, 1000), (26, 30), (27, 100)]);
    rig.world.speed = 30_000;
    rig.world.word = request(control::SS2);
    rig.world.position = 5_000;
    let stands = rig.step();
    assert_eq!(stands.report.stop, Stop::Sos);
    assert!(bit(&stands, shown::SOS));
    rig.world.position = 5_100;
    assert!(rig.step().inhibit.permit);
    rig.world.position = 5_101;
    assert_eq!(codes(&rig.step()), [[3606, 102, 5, 0]]);
}

/// AMK-EX-SLS-1, AMK-EX-SLS-3.
#[test]
fn sls_acknowledges_at_the_end_of_the_line_and_trips_beyond_the_limit() {
    let mut rig = amk(&[(54, 50), (56, 1000), (57, -500), (58, 0)]);
    rig.world.speed = 2_000_000;
    rig.step();
    let begin = rig.cycle;
    let follow = move |cycle: u64, world: &mut World| {
        world.word = request(control::SLS1);
        let e = (cycle - begin) as i64;
        world.speed = (2_000_000 - (e - 50).max(0) * 3_000).max(500_000);
    };
    let end = rig.until(follow, |outputs| bit(outputs, shown::SLS1));
    assert_eq!(end.map(|end| end - begin), Some(550));
    rig.world.speed = -500_001;
    assert_eq!(codes(&rig.step()), [[3606, 112, 4, 0]]);
}

/// AMK-EX-SSR-2A, DEC-44: the reaction SS2 is a warning with the error bit, and ends in SOS.
#[test]
fn ssr_with_reaction_ss2_ends_in_sos_and_clears_there() {
    let set = [(30, 0), (32, 1000), (33, 800), (34, 200), (35, 2), (23, 20), (25, 1000), (26, 30), (27, 100)];
    let mut rig = amk(&set);
    rig.world.speed = 500_000;
    rig.world.word = request(control::SSR1);
    assert!(bit(&rig.step(), shown::SSR1));
    rig.world.speed = 199_999;
    let left = rig.step();
    assert_eq!(codes(&left), [[3610, 104, 4, 0]]);
    assert!(bit(&left, shown::ERROR) & bit(&left, shown::SS2_ACTIVE) & !bit(&left, shown::SSR1));
    rig.world.speed = 0;
    rig.until(|_, _| (), |outputs| outputs.report.stop == Stop::Sos).expect("SOS");
    rig.world.word = request(control::SSR1) | 1 << control::ERROR_ACK;
    let cleared = rig.step();
    // DEC-17: the function starts again, from 0 rpm towards 200.
    assert_eq!((codes(&cleared).len(), cleared.report.stop), (0, Stop::None));
}

/// AMK-SSR-06: a range without zero is approached from standstill along the rising line.
#[test]
fn ssr_as_minimum_speed_follows_the_rising_line() {
    let run = |slow: i64| {
        let mut rig = amk(&[(30, 0), (32, 1000), (33, 800), (34, 200), (35, 0)]);
        rig.step();
        let begin = rig.cycle;
        let follow = move |cycle: u64, world: &mut World| {
            world.word = request(control::SSR1);
            let e = (cycle - begin) as i64;
            world.speed = (e * 3_000 - if e == 30 { slow } else { 0 }).min(400_000);
        };
        let end = rig.until(follow, |outputs| bit(outputs, shown::SSR1) | !outputs.report.ready);
        (end.map(|end| end - begin), codes(&rig.step()))
    };
    assert_eq!(run(0), (Some(67), vec![]));
    assert_eq!(run(1), (Some(30), vec![[3606, 104, 0, 14]]));
}

/// AMK-EX-CONFLICT, DEC-13.
#[test]
fn reactions_ss1_and_ss2_together_end_in_sto() {
    let set = [(54, 0), (57, 500), (58, 1), (59, 0), (62, 400), (63, 2), (20, 1000), (21, 30), (25, 1000)];
    let mut rig = amk(&set);
    rig.world.word = request(control::SLS1) & request(control::SLS2);
    rig.step();
    rig.world.speed = 600_000;
    let both = rig.step();
    assert_eq!(codes(&both), [[3610, 112, 3, 0], [3610, 113, 3, 0]]);
    assert_eq!(both.report.stop, Stop::Ss1);
    rig.until(|_, world| world.speed = (world.speed - 3_500).max(0), |o| o.report.stop == Stop::Sto)
        .expect("STO");
    for _ in 0..100 {
        assert_eq!(rig.step().report.stop, Stop::Sto);
    }
}

/// AMK-EX-SOS-3, AMK-SOS-03.
#[test]
fn sos_is_centred_on_the_position_of_the_command() {
    let mut rig = amk(&[(28, 10), (29, -50)]);
    rig.world.position = -1_000;
    rig.world.word = request(control::SOS);
    assert!(bit(&rig.step(), shown::SOS));
    rig.world.position = -1_051;
    assert_eq!(codes(&rig.step()), [[3606, 103, 6, 0]]);
}

/// AMK-EX-SDIP-2, AMK-EX-SDIN-2, AMKP-SDI-02.
#[test]
fn sdi_permits_one_direction_and_the_window() {
    let run = |function: u8, speed: i64| {
        let mut rig = amk(&[]);
        rig.world.word = request(function);
        rig.world.speed = speed;
        codes(&rig.step())
    };
    assert!(run(control::SDIP, -10_000).is_empty());
    assert_eq!(run(control::SDIP, -10_001), [[3606, 105, 4, 0]]);
    assert_eq!(run(control::SDIN, 10_001), [[3606, 106, 3, 0]]);
}

/// AMK-EX-SLI-POS, AMK-EX-SLI-POS-SWAP, AMK-SLI-04.
#[test]
fn sli_keeps_the_increment_around_its_start() {
    for (one, other) in [(1000, -100), (-100, 1000)] {
        for (position, trips) in [(9_900, false), (9_899, true), (11_000, false), (11_001, true)] {
            let mut rig = amk(&[(65, one), (66, other), (103, 0)]);
            rig.world.position = 10_000;
            rig.world.word = request(control::SLI);
            rig.step();
            rig.world.position = position;
            assert_eq!(!codes(&rig.step()).is_empty(), trips, "{position}");
        }
    }
}

/// AMK-SEM-04, AMK-SEM-07, AMK-SEM-08: warning, error with SS1, again every 30 minutes.
#[test]
fn standstill_times_warn_and_then_stop() {
    let mut rig = amk(&[(9, 1), (10, 1), (20, 1000), (21, 30)]);
    let warned = rig.until(|_, _| (), |o| !o.report.errors.is_empty());
    assert_eq!(warned, Some(60_000));
    assert_eq!(codes(&rig.step()), [[3610, 39, 3, 0]]);
    let stopped = rig.until(|_, _| (), |o| o.report.stop != Stop::None);
    assert_eq!(stopped, Some(120_000));
    assert_eq!(codes(&rig.step()), [[3606, 39, 4, 0], [3610, 39, 3, 0]]);
}

/// AMK-IN-04, AMKP-CMD-01: with Prm7 = 1 only the inputs request.
#[test]
fn inputs_request_their_functions_after_the_filter_time() {
    let mut rig = amk(&[(7, 1), (15, 12), (16, 16), (17, 0), (85, 250), (83, 250), (73, 250), (71, 250)]);
    rig.world.word = 0;
    rig.world.speed = 0;
    assert!(rig.step().inhibit.permit);
    rig.world.pairs = 0b1011;
    // Glitch filter and time filter, 250 µs each, pass within one cycle of 16 samples.
    let off = rig.step();
    assert_eq!((off.report.stop, off.report.inputs), (Stop::Sto, 0b0011));
}

/// DEC-18, architecture: frozen from cycle k on, the path is dropped in cycle k + 2.
#[test]
fn a_frozen_sample_drops_the_path_in_the_third_cycle() {
    let mut rig = amk(&[]);
    let frozen = (0..5).map(|_| ()).fold(None, |_, ()| Some(rig.step())).expect("steps");
    assert!(frozen.inhibit.permit);
    let exchange = frozen.report.exchange;
    let dropped: Vec<bool> = (0..4)
        .map(|_| {
            let stale = |inputs: &mut shm_schema::exchange::Inputs| {
                if let Ok(cell) = &mut inputs.encoder {
                    cell.sequence = exchange;
                    cell.timestamp_ns = 4_000_000;
                }
            };
            rig.step_with(stale).inhibit.permit
        })
        .collect();
    assert_eq!(dropped, [true, true, false, false]);
}

/// The encoder cell of cycle `k`, with raw signals only.
fn raw(position: f64, k: u64, inputs: &mut Inputs) {
    inputs.motion = inputs.motion.filter(|_| k == 0);
    inputs.encoder = crate::testing::cell(k + 1, k * MS, crate::testing::sine(position, 16_384.0));
}

/// Design 10: raw signals trip nothing and leave no gap; a skipped sample is a missed exchange.
#[test]
fn a_settled_start_with_raw_signals_runs_through_skipped_samples() {
    for (rpm, rpm_s) in [(0.0, 0.0), (2_900.0, 0.0), (0.0, 3_000.0)] {
        let mut rig = amk(&[(2, 50), (3, 16)]);
        let at = |k: u64| 65_536.0 / 60.0 * (rpm * k as f64 / 1e3 + rpm_s * (k * k) as f64 / 2e6);
        rig.world.speed = rpm as i64 * 1_000;
        for cycle in 0..900 {
            // Two of ten samples are not seen; what comes then carries their numbers and time.
            let k = if matches!(cycle % 10, 8 | 9) { cycle - cycle % 10 + 7 } else { cycle };
            let outputs = rig.step_with(|inputs| raw(at(k), k, inputs));
            assert_eq!((codes(&outputs), outputs.inhibit.permit), (vec![], true), "{rpm} {rpm_s} {cycle}");
        }
    }
}

/// DEC-23 counts exchange cycles; architecture: a cell fault counts as no sample.
#[test]
fn a_producer_that_stands_still_is_no_lost_partner() {
    for is_corrupt in [false, true] {
        let mut rig = amk(&[]);
        for _ in 0..5 {
            rig.step();
        }
        let permits: Vec<bool> = (0..10)
            .map(|_| {
                let outputs = rig.step_with(|inputs| {
                    // Reports go on under the same exchange number, with new check sums.
                    if let Ok(cell) = &mut inputs.agreement {
                        cell.payload.echo_b.exchange = 5;
                    }
                    inputs.published = inputs.published.map(|own| Published { exchange: 5, ..own });
                    inputs.encoder = if is_corrupt {
                        Err(CellFault::CheckSum)
                    } else {
                        crate::testing::cell(5, 4 * MS, Encoder::default())
                    };
                });
                assert_eq!(outputs.report.exchange, 5);
                assert!(!codes(&outputs).contains(&[3606, 13, 1, 0]));
                outputs.inhibit.permit
            })
            .collect();
        assert_eq!(permits[..4], [true, true, false, false]);
        // When the producer goes on, so do both.
        for _ in 0..5 {
            assert!(!codes(&rig.step()).contains(&[3606, 13, 1, 0]));
        }
    }
}

/// DEC-23: a partner that does not advance for three cycles.
#[test]
fn a_lost_partner_is_sto_in_the_third_cycle() {
    let mut rig = amk(&[]);
    for _ in 0..5 {
        rig.step();
    }
    let stops: Vec<Stop> = (0..4)
        .map(|_| {
            rig.step_with(|inputs| {
                if let Ok(cell) = &mut inputs.partner {
                    cell.payload.exchange = 4;
                }
            })
            .report
            .stop
        })
        .collect();
    assert_eq!(stops, [Stop::None, Stop::None, Stop::Sto, Stop::Sto]);
}

/// Design 3.3, DEC-22: without permit no torque. The functions go on, and what was withheld for
/// the partner's sake comes back when both are ready.
#[test]
fn a_withheld_permit_drops_the_path_touches_no_function_and_may_come_back() {
    let mut rig = amk(&[]);
    rig.step();
    rig.world.permit = false;
    for _ in 0..50 {
        let outputs = rig.step();
        assert!(!outputs.inhibit.permit);
        assert_eq!((outputs.report.ready, outputs.report.stop), (true, Stop::None));
    }
    rig.world.permit = true;
    assert!(rig.step().inhibit.permit);
}

fn foreign_echo(inputs: &mut Inputs) {
    if let Ok(cell) = &mut inputs.agreement {
        cell.payload.echo_b.crc32 ^= 1;
    }
}

/// Design 3.3, 3.7, DEC-23: a driven path that loses its agreement is a loss of a partner; it
/// does not come back with the agreement, but by an edge.
#[test]
fn a_driven_path_without_an_accepted_agreement_is_a_trip() {
    let mut rig = amk(&[]);
    rig.step();
    assert!(rig.step().inhibit.permit);
    assert!(!rig.step_with(foreign_echo).inhibit.permit);
    for _ in 0..50 {
        let outputs = rig.step();
        assert_eq!((codes(&outputs), outputs.inhibit.permit), (vec![[3606, 13, 1, 0]], false));
    }
    rig.world.word = NEUTRAL | 1 << control::ERROR_ACK;
    assert!(codes(&rig.step()).is_empty());
    rig.world.word = NEUTRAL;
    assert!(rig.step().inhibit.permit);
}

/// Architecture: frozen from cycle k on, the path drops in k + 2; DEC-23: lost in the third.
#[test]
fn a_frozen_agreement_drops_the_path_in_the_third_cycle_and_is_a_lost_partner() {
    let mut rig = amk(&[]);
    for _ in 0..5 {
        rig.step();
    }
    let frozen = rig.cycle;
    let seen: Vec<(bool, usize)> = (0..4)
        .map(|_| {
            let outputs = rig.step_with(|inputs| {
                if let Ok(cell) = &mut inputs.agreement {
                    cell.sequence = frozen;
                    cell.payload.echo_b.exchange = frozen;
                    cell.payload.echo_b.crc32 = frozen as u32;
                }
            });
            (outputs.inhibit.permit, codes(&outputs).len())
        })
        .collect();
    assert_eq!(seen, [(true, 0), (true, 0), (false, 0), (false, 1)]);
}

/// Architecture: a cell that fails is no information, its content as old as its last update.
#[test]
fn an_agreement_unreadable_for_a_cycle_costs_nothing() {
    let mut rig = amk(&[]);
    for _ in 0..5 {
        rig.step();
    }
    for cycle in 0..20 {
        let outputs = rig.step_with(|inputs| {
            if cycle % 4 < 1 {
                inputs.agreement = Err(CellFault::CheckSum);
            }
        });
        assert!(outputs.inhibit.permit, "{cycle}");
    }
}

/// DEC-22: beyond Prm2 at once.
#[test]
fn a_position_difference_beyond_prm2_is_sto_in_that_exchange() {
    let mut rig = amk(&[(2, 100)]);
    rig.step();
    let at = |difference: i64, rig: &mut Rig| {
        codes(&rig.step_with(move |inputs| {
            if let Ok(cell) = &mut inputs.partner {
                cell.payload.position += difference;
            }
        }))
    };
    assert!(at(100, &mut rig).is_empty());
    assert_eq!(at(101, &mut rig), [[3606, 13, 5, 0]]);
}

#[test]
fn a_refused_image_never_permits_and_says_why() {
    for (key, value, code) in [(105, 200, [3605, 13, 9, 0]), (20, 0, [3605, 101, 0, 6])] {
        let mut rig = amk(&[(key, value)]);
        let outputs = rig.step();
        assert_eq!((outputs.report.phase, outputs.inhibit.permit), (Phase::Refused, false));
        assert_eq!(codes(&outputs), [code]);
    }
    let mut torn = crate::testing::image(Profile::AmkKw, &[]);
    torn[40] ^= 1;
    let mut found = vec![];
    crate::findings(&torn, &mut |code| found.push(code.info2));
    assert_eq!(found, [4]);
}

/// DEC-28: the delivery state passes every rule.
#[test]
fn the_defaults_have_no_finding() {
    let mut found = vec![];
    crate::findings(&crate::testing::image(Profile::AmkKw, &[]), &mut |code| found.push(code));
    assert_eq!(found, []);
}

#[test]
fn a_cold_start_permits_nothing() {
    let mut rig = Rig::start(Profile::AmkKw, &[(67, 3000)], Start::Cold);
    for _ in 0..300 {
        assert!(!rig.step().inhibit.permit);
    }
    assert_eq!(rig.step().report.phase, Phase::SelfTest);
}
