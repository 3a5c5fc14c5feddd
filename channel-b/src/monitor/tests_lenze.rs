//! The Lenze profile through whole steps, to the cycle.

use shm_schema::exchange::Outputs;
use shm_schema::facts::lenze_sm301::{control, status as shown};
use shm_schema::profile::{Profile, common, lenze_key};
use shm_schema::report::{Phase, Stop};
use std::vec;
use std::vec::Vec;

use crate::testing::{Rig, World, codes, status};

const NEUTRAL: u32 = 0x0180_01FF;

fn set(changes: &[(u32, u32, i32)]) -> Rig {
    let mut all = vec![(common::POSITION_DIFFERENCE, 1_000_000), (common::SPEED_DIFFERENCE, 60_000)];
    all.push((lenze_key(15_320, 0), 5_000));
    all.extend(changes.iter().map(|(code, sub, value)| (lenze_key(*code, *sub), *value)));
    Rig::new(Profile::LenzeSm301, &all)
}

fn without(bit: u8) -> u32 {
    NEUTRAL & !(1 << bit)
}

fn bit(outputs: &Outputs, bit: u8) -> bool {
    status(outputs) >> bit & 1 == 1
}

fn numbers(outputs: &Outputs) -> Vec<u32> {
    codes(outputs).iter().map(|code| code[0]).collect()
}

fn run(rig: &mut Rig, word: u32, speed: impl Fn(i64) -> i64 + Copy) -> (Option<u64>, Vec<u32>) {
    rig.world.speed = speed(0);
    rig.step();
    let begin = rig.cycle;
    let drive = move |cycle: u64, world: &mut World| {
        world.word = word;
        world.speed = speed((cycle - begin) as i64);
    };
    let end = rig.until(drive, |o| matches!(o.report.stop, Stop::Sto | Stop::Sos));
    (end.map(|end| end - begin), rig.last[1].as_ref().map(numbers).unwrap_or_default())
}

/// LNZ-SS1-01, LNZ-SS1-03, LNZ-SS1-04, LNZ-EX-28.
#[test]
fn ss1_waits_for_its_stopping_time_or_ends_after_standstill() {
    let word = without(control::SS1);
    let stop = |e: i64| (1_000_000 - e * 4_000).max(0);
    let plain = [(15_305, 0, 500), (15_310, 0, 10)];
    assert_eq!(run(&mut set(&plain), word, stop), (Some(500), vec![]));
    assert_eq!(run(&mut set(&plain), word, |_| 20_000), (Some(500), vec![97]));
    let early = [(15_305, 0, 500), (15_310, 0, 10), (15_306, 0, 1), (15_307, 0, 50)];
    assert_eq!(run(&mut set(&early), word, stop), (Some(298), vec![]));
}

/// DEC-02: without a stopping time the end is reached in the cycle of the request.
#[test]
fn no_stopping_time_ends_at_once() {
    let stop = |word: u32, speed: i64| {
        let mut rig = set(&[(15_305, 0, 0), (15_310, 0, 10)]);
        rig.step();
        (rig.world.word, rig.world.speed) = (word, speed);
        let outputs = rig.step();
        (outputs.report.stop, numbers(&outputs))
    };
    assert_eq!(stop(without(control::SS1), 10_000), (Stop::Sto, vec![]));
    assert_eq!(stop(without(control::SS1), 10_001), (Stop::Sto, vec![97]));
    assert_eq!(stop(without(control::SS2), 0), (Stop::Sos, vec![]));
    assert_eq!(stop(without(control::SS2), 10_001), (Stop::Sto, vec![97]));
}

/// LNZ-SS1-11, LNZ-RST-01, DEC-12: acknowledged by default, PS_AIS on its rising edge.
#[test]
fn the_end_of_ss1_shows_both_bits_and_waits_for_the_restart() {
    let mut rig = set(&[(15_305, 0, 100), (15_310, 0, 10)]);
    run(&mut rig, without(control::SS1), |_| 0);
    let ended = rig.step();
    assert!(bit(&ended, shown::SS1_ACTIVE) & bit(&ended, shown::STO_ACTIVE));
    rig.world.word = NEUTRAL;
    rig.step();
    assert_eq!(rig.step().report.stop, Stop::Sto);
    rig.world.word = NEUTRAL | 1 << control::PS_AIS;
    assert_eq!(rig.step().report.stop, Stop::None);
}

/// LNZ-RAMP-03, LNZ-RAMP-04, LNZ-RAMP-05, LNZ-EX-09, LNZ-EX-10, DEC-49.
#[test]
fn the_ramp_falls_from_its_start_value_after_its_delay() {
    let rows = [(15_305, 0, 1000), (15_310, 0, 20), (15_315, 0, 1), (15_316, 0, 50), (15_317, 0, 10)];
    // Start 1100 rpm, held 200 ms, then 1375 rpm/s down to 0 at 1000 ms.
    let line = |e: i64| if e <= 200 { 1_000_000 } else { (1_100_000 - (e - 200) * 1_375).max(20_000) };
    let hug = move |e: i64| line(e).min(1_000_000);
    assert_eq!(run(&mut set(&rows), without(control::SS1), hug), (Some(1_000), vec![]));
    let over = move |e: i64| if e == 700 { line(e) + 1 } else { hug(e) };
    assert_eq!(run(&mut set(&rows), without(control::SS1), over), (Some(700), vec![110]));
}

/// LNZ-RAMP-03, LNZ-RAMP-05, LNZ-EX-08: the start value is held for 10 to 30 % of the stopping time
/// and must not be exceeded meanwhile.
#[test]
fn the_start_of_the_ramp_is_watched_during_its_delay() {
    for (share, delay) in [(0, 100), (50, 200), (100, 300)] {
        let rows = [(15_305, 0, 1000), (15_310, 0, 20), (15_315, 0, 1), (15_316, 0, share), (15_317, 0, 10)];
        let over = |e: i64| if e == 0 { -1_000_000 } else { -1_100_000 - i64::from(e == 79) };
        assert_eq!(run(&mut set(&rows), without(control::SS1), over), (Some(79), vec![110]));
        // Held up to the end of the delay; one cycle later the line has fallen.
        let kept = |e: i64| if e == 0 { 1_000_000 } else { 1_100_000 };
        assert_eq!(run(&mut set(&rows), without(control::SS1), kept), (Some(delay + 1), vec![110]));
    }
    let rows = [(15_305, 0, 1000), (15_310, 0, 20), (15_315, 0, 1)];
    let offset = |e: i64| if e == 0 { 1_000_000 } else { 1_020_000 + i64::from(e == 50) };
    assert_eq!(run(&mut set(&rows), without(control::SS1), offset), (Some(50), vec![110]));
}

/// DEC-14: STO by 97 in the very cycle in which the response time would end.
#[test]
fn no_response_time_runs_in_sto() {
    let rows = [(15_320, 0, 1000), (15_321, 0, 1), (15_350, 0, 80), (15_305, 0, 80), (15_310, 0, 10)];
    let mut rig = set(&rows);
    rig.step();
    rig.world.speed = 1_000_001;
    rig.until(|_, _| (), |o| o.report.stop == Stop::Sto);
    assert_eq!(rig.last[1].as_ref().map(numbers), Some(vec![97, 105]));
    for _ in 0..100 {
        assert_eq!(numbers(&rig.step()), [97, 105]);
    }
}

/// LNZ-OMS-06, LNZ-OMS-10, LNZ-ES-04: the edge confirms in the cycle in which SOS is left too; the
/// error stop stands all the same.
#[test]
fn an_error_stop_does_not_refuse_the_enable_switch() {
    let rows = [(15_200, 0, 2), (15_201, 0, 11), (15_305, 0, 100), (15_310, 0, 10), (15_308, 0, 1)];
    let mut rig = set(&rows);
    rig.step();
    rig.world.word = NEUTRAL | 1 << control::OMS;
    assert_eq!(rig.step().report.stop, Stop::Sos);
    rig.world.position = 2;
    assert_eq!(numbers(&rig.step()), [106]);
    rig.world.word |= 1 << control::ES;
    let confirmed = rig.step();
    assert_eq!((confirmed.report.stop, bit(&confirmed, shown::ES_ACTIVE)), (Stop::Sto, true));
}

/// LNZ-SS2-02, LNZ-SOS-03, LNZ-SOS-05.
#[test]
fn ss2_stores_the_position_at_standstill_and_watches_only_it() {
    let rows = [(15_305, 0, 500), (15_310, 0, 10), (15_308, 0, 1), (15_311, 0, 100)];
    let mut rig = set(&rows);
    rig.world.position = 7_000;
    assert_eq!(run(&mut rig, without(control::SS2), |e| (400_000 - e * 4_000).max(0)), (Some(98), vec![]));
    let stands = rig.step();
    assert!(bit(&stands, shown::SOS_MONITORED) & bit(&stands, shown::SS2_ACTIVE));
    rig.world.speed = 200_000;
    rig.world.position = 7_100;
    assert!(numbers(&rig.step()).is_empty());
    rig.world.position = 6_899;
    assert_eq!(numbers(&rig.step()), [106]);
}

/// LNZ-SOS-04, LNZ-EX-11: STO in between, then SOS at once from the new position.
#[test]
fn sos_interrupted_by_sto_goes_on_from_the_new_position() {
    let rows = [(15_305, 0, 500), (15_310, 0, 10), (15_308, 0, 1), (15_311, 0, 100), (15_300, 1, 1)];
    let mut rig = set(&rows);
    run(&mut rig, without(control::SS2), |_| 0);
    rig.world.word = without(control::SS2) & without(control::STO);
    rig.step();
    rig.world.position = 50_000;
    rig.step();
    rig.world.word = without(control::SS2);
    assert_eq!(rig.step().report.stop, Stop::Sos);
    rig.world.position = 50_101;
    assert_eq!(numbers(&rig.step()), [106]);
}

/// LNZ-SLS-01, LNZ-SLS-02, LNZ-SLS-05, LNZ-EX-30.
#[test]
fn sls_shows_its_limit_at_once_and_judges_after_the_braking_time() {
    let mut rig = set(&[(15_330, 1, 500), (15_331, 1, 200)]);
    rig.world.speed = 600_000;
    rig.step();
    rig.world.word = without(control::SLS1);
    let begin = rig.cycle;
    let first = rig.step();
    assert!(bit(&first, shown::SLS1_ACTIVE) & !bit(&first, shown::SLS1_MONITORED));
    rig.world.speed = 500_000;
    assert!(bit(&rig.step(), shown::SLS1_MONITORED));
    rig.world.speed = -500_001;
    let trip = rig.until(|_, _| (), |o| !o.report.errors.is_empty());
    assert_eq!(trip.map(|at| at - begin), Some(200));
    assert_eq!(numbers(&rig.step()), [98]);
}

/// LNZ-SMS-06, LNZ-EX-27: still too fast after C15350 is STO.
#[test]
fn a_stop_as_reaction_must_bring_the_speed_back_in_the_response_time() {
    let rows = [(15_320, 0, 1000), (15_321, 0, 1), (15_350, 0, 80), (15_305, 0, 400), (15_310, 0, 10)];
    let run = |recovers: bool| {
        let mut rig = set(&rows);
        rig.step();
        let begin = rig.cycle;
        let drive = move |cycle: u64, world: &mut World| {
            let e = cycle - begin;
            world.speed = if recovers & (e >= 79) { 0 } else { 1_000_001 };
        };
        let end = rig.until(drive, |o| o.report.stop == Stop::Sto);
        (end.map(|end| end - begin), numbers(&rig.step()))
    };
    assert_eq!(run(false), (Some(80), vec![102, 105]));
    assert_eq!(run(true), (Some(400), vec![105]));
}

/// LNZ-SDI-03, DEC-49: the tolerance counts from the furthest position.
#[test]
fn sdi_counts_from_the_furthest_position_in_the_permitted_direction() {
    let mut rig = set(&[(15_342, 0, 100), (15_343, 0, 0)]);
    rig.world.word = without(control::SDIPOS);
    assert!(bit(&rig.step(), shown::SDIPOS_MONITORED));
    for (position, trips) in [(5_000, false), (4_900, false), (4_899, true)] {
        rig.world.position = position;
        assert_eq!(!numbers(&rig.step()).is_empty(), trips, "{position}");
    }
    assert_eq!(numbers(&rig.step()), [103]);
}

/// LNZ-OMS-02, LNZ-OMS-06, LNZ-OMS-10, LNZ-ES-03, LNZ-SLI-02.
#[test]
fn special_operation_stops_and_moves_only_with_the_enable_switch() {
    let mut rig = set(&[(15_200, 0, 0), (15_203, 0, 1_000)]);
    rig.step();
    let special = NEUTRAL | 1 << control::OMS;
    let enabled = special | 1 << control::ES;
    rig.world.word = special;
    let stopped = rig.step();
    assert!(bit(&stopped, shown::OMS_ACTIVE) & (stopped.report.stop == Stop::Sto));
    rig.world.word = enabled & !1;
    let moves = rig.step();
    assert!(bit(&moves, shown::ES_ACTIVE) & bit(&moves, shown::SLI_ACTIVE) & moves.report.ready);
    // LNZ-OMS-08: an emergency stop is not overridden.
    rig.world.word = enabled & !(1 << control::SSE);
    let emergency = rig.step();
    assert!(bit(&emergency, shown::SSE_ACTIVE) & !emergency.report.ready);
    rig.world.word = special;
    assert_eq!(rig.step().report.stop, Stop::Sto);
    // LNZ-STOP-02: nor what is left of it before its restart acknowledge.
    rig.world.word = enabled;
    let confirmed = rig.step();
    assert!(bit(&confirmed, shown::ES_ACTIVE) & !confirmed.report.ready);
    rig.world.word = enabled | 1 << control::PS_AIS;
    assert!(rig.step().report.ready);
    rig.world.position = 1_001;
    assert_eq!(numbers(&rig.step()), [111]);
}

/// LNZ-OMS-22, DEC-14: in STO the limit of C15201 is asked at the edge; the SLS begins when STO is left.
#[test]
fn the_enable_switch_moves_out_of_sto_below_the_limit_of_its_sls() {
    let enabled = NEUTRAL | 1 << control::OMS | 1 << control::ES;
    for (speed, is_enabled) in [(500_000, true), (-500_001, false)] {
        let mut rig = set(&[(15_200, 0, 0), (15_201, 0, 3), (15_330, 1, 500), (15_331, 1, 50)]);
        rig.world.word = NEUTRAL | 1 << control::OMS;
        rig.world.speed = speed;
        assert_eq!((rig.step().report.stop, rig.step().report.stop), (Stop::Sto, Stop::Sto));
        rig.world.word = enabled;
        let moves = rig.step();
        let seen = (bit(&moves, shown::ES_ACTIVE), bit(&moves, shown::SLS1_ACTIVE), moves.report.ready);
        assert_eq!(seen, (is_enabled, is_enabled, is_enabled));
    }
}

/// LNZ-PRIO-04, LNZ-SOS-04: only a request stands at once when STO is left; a reaction brakes.
#[test]
fn an_ss2_as_reaction_when_sto_is_left_brakes() {
    let stop = |word: u32| {
        let mut rig =
            set(&[(15_305, 0, 400), (15_330, 1, 500), (15_332, 1, 2), (15_350, 0, 500), (15_300, 1, 1)]);
        rig.world.word = without(control::STO);
        rig.step();
        rig.step();
        rig.world.word = word;
        rig.world.speed = 600_000;
        rig.until(|_, _| (), |o| o.report.stop != Stop::Sto);
        rig.last[1].map(|left| left.report.stop)
    };
    assert_eq!(stop(without(control::SS2)), Some(Stop::Sos));
    assert_eq!(stop(without(control::SLS1)), Some(Stop::Ss2));
}

/// LNZ-SDI-08, LNZ-SDI-09: a violated direction is monitored again when it is requested anew, whether its
/// error was acknowledged or not.
#[test]
fn a_new_request_is_a_new_activation() {
    let mut rig = set(&[(15_342, 0, 100), (15_343, 0, 2), (15_305, 0, 50)]);
    let word = without(control::SDIPOS);
    rig.world.word = word;
    rig.step();
    rig.world.position = -101;
    assert_eq!(numbers(&rig.step()), [103]);
    assert!(!bit(&rig.step(), shown::SDIPOS_ACTIVE));
    rig.world.word = NEUTRAL;
    rig.step();
    rig.world.word = word;
    let again = rig.step();
    assert!(bit(&again, shown::SDIPOS_ACTIVE));
    assert_eq!(numbers(&again), [103]);
    rig.world.position = -202;
    assert!(!bit(&rig.step(), shown::SDIPOS_ACTIVE));
}

/// LNZ-IN-14, LNZ-IN-15, LNZ-EX-34.
#[test]
fn one_low_line_is_off_at_once_and_an_error_after_the_discrepancy_time() {
    let rows = [(15_030, 1, 2), (15_032, 1, 0), (15_033, 1, 20), (15_300, 1, 1)];
    let mut rig = set(&rows);
    assert!(bit(&rig.step(), shown::SD_IN1));
    let only_one = |inputs: &mut shm_schema::exchange::Inputs| {
        if let Ok(cell) = &mut inputs.io {
            cell.payload.line_1[0] = 0;
        }
    };
    let mut found = None;
    for cycle in 0..60 {
        let outputs = rig.step_with(only_one);
        if (outputs.report.stop == Stop::Sto) & found.is_none() {
            found = Some(cycle);
            assert!(numbers(&outputs).is_empty());
        }
        if !numbers(&outputs).is_empty() {
            assert_eq!((numbers(&outputs), cycle), (vec![49], found.expect("off before") + 21));
            return;
        }
    }
    panic!("no discrepancy error");
}

/// DEC-49: C15113 inhibits a bit; it then requests nothing.
#[test]
fn an_inhibited_bit_of_the_bus_requests_nothing() {
    let mut rig = set(&[(15_113, 0, !1), (15_305, 0, 100)]);
    rig.world.word = without(control::STO);
    assert!(rig.step().report.ready);
    rig.world.word = without(control::SS1);
    assert_eq!(rig.step().report.stop, Stop::Ss1);
}

/// LNZ-ACK-01, LNZ-ACK-05: the end of a pulse of 0.3 to 10 s.
#[test]
fn a_terminal_acknowledges_with_the_end_of_a_pulse_of_the_right_length() {
    for (length, counts) in [(299, false), (300, true), (10_000, true), (10_001, false)] {
        let mut rig = set(&[]);
        rig.step();
        rig.world.word = without(control::STO);
        rig.step();
        rig.world.word = NEUTRAL;
        for _ in 0..length {
            rig.step_with(|inputs| {
                if let Ok(cell) = &mut inputs.io {
                    cell.payload.ais = u64::MAX;
                }
            });
        }
        assert_eq!(rig.step().report.ready, counts, "{length} ms");
    }
}

/// LNZ-IN-06, LNZ-CAS-10, LNZ-SPD-10, LNZ-OMS-19.
#[test]
fn contradicting_settings_are_refused() {
    let twice = vec![(15_030, 1, 1), (15_031, 1, 3), (15_030, 2, 1), (15_031, 2, 3), (15_113, 0, !(1 << 9))];
    let blind = vec![(15_400, 0, 0)];
    let cascade = vec![(15_035, 0, 4)];
    let mode = vec![(15_030, 1, 1), (15_031, 1, 2)];
    for rows in [twice, blind, cascade, mode] {
        let outputs = set(&rows).step();
        assert_eq!((outputs.report.phase, numbers(&outputs)), (Phase::Refused, vec![167]));
    }
}
