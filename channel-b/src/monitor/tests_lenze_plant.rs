//! The Lenze profile beside the plant: cascade, encoders, the drive's own speed.

use shm_schema::encoder::{Encoder, Slot, SlotKind};
use shm_schema::exchange::{Inputs, Outputs, Start};
use shm_schema::facts::lenze_sm301::{control, status as shown};
use shm_schema::profile::{Profile, common, lenze_key};
use shm_schema::report::{Phase, Stop};
use std::vec;
use std::vec::Vec;

use crate::testing::{Rig, World, codes, sine};

const NEUTRAL: u32 = 0x0180_01FF;

fn set(changes: &[(u32, u32, i32)]) -> Rig {
    with_common(&[], changes)
}

fn with_common(keys: &[(u32, i32)], changes: &[(u32, u32, i32)]) -> Rig {
    let mut all = vec![(common::POSITION_DIFFERENCE, 1_000_000), (common::SPEED_DIFFERENCE, 60_000)];
    all.extend([(lenze_key(15_320, 0), 5_000), (lenze_key(15_420, 0), 1_024)]);
    all.extend_from_slice(keys);
    all.extend(changes.iter().map(|(code, sub, value)| (lenze_key(*code, *sub), *value)));
    Rig::new(Profile::LenzeSm301, &all)
}

fn without(bit: u8) -> u32 {
    NEUTRAL & !(1 << bit)
}

fn numbers(outputs: &Outputs) -> Vec<u32> {
    codes(outputs).iter().map(|code| code[0]).collect()
}

/// LNZ-CAS-09, LNZ-CAS-10: the only settings a cascade permits.
fn cascade() -> Rig {
    let input = [(15_030, 4, 2), (15_031, 4, 1), (15_033, 4, 20), (15_034, 4, 0)];
    let mut rows =
        vec![(15_035, 0, 4), (15_205, 0, 0), (15_306, 0, 0), (15_300, 1, 0), (15_113, 0, !(1 << 24))];
    rows.extend(input);
    let mut rig = set(&rows);
    assert_eq!(rig.step().report.stop, Stop::None);
    rig
}

/// LNZ-CAS-04, LNZ-CAS-13, LNZ-CAS-07: 100 drives of 14 ms each, then 108.
#[test]
fn a_cascade_that_does_not_come_back_is_an_error() {
    let mut rig = cascade();
    rig.world.word = without(control::STO);
    let begin = rig.cycle;
    let found = rig.until(|_, _| (), |o| !o.report.errors.is_empty());
    assert_eq!(found.map(|at| at - begin), Some(1_402));
    assert_eq!(rig.last[1].as_ref().map(numbers), Some(vec![108]));
    let mut whole = cascade();
    whole.world.word = without(control::STO);
    whole.step();
    whole.world.pairs = 0b0111;
    for _ in 0..100 {
        whole.step();
    }
    whole.world.pairs = 0xF;
    for _ in 0..2_000 {
        assert!(numbers(&whole.step()).is_empty());
    }
}

/// LNZ-CAS-13, LNZ-CAS-02: a discrepancy at the cascade input is 109 and STO.
#[test]
fn a_discrepancy_at_the_cascade_input_has_its_own_message() {
    let mut rig = cascade();
    let apart = |inputs: &mut Inputs| {
        if let Ok(cell) = &mut inputs.io {
            cell.payload.line_1[3] = 0;
        }
    };
    for _ in 0..60 {
        rig.step_with(apart);
    }
    let found = rig.step_with(apart);
    assert_eq!((numbers(&found), found.report.stop), (vec![109], Stop::Sto));
}

/// LNZ-CAS-06: 100 ms after the acknowledge; a stop meanwhile takes it back.
#[test]
fn a_cascade_restarts_100_ms_after_its_acknowledge() {
    for interrupted in [false, true] {
        let mut rig = cascade();
        rig.world.word = without(control::STO);
        rig.step();
        rig.world.word = NEUTRAL;
        rig.step();
        rig.world.word = NEUTRAL | 1 << control::PS_AIS;
        let begin = rig.cycle;
        for cycle in 0..300 {
            let stops = interrupted & (cycle == 50);
            rig.world.word = if stops { without(control::STO) } else { NEUTRAL | 1 << control::PS_AIS };
            let is_left = rig.step().report.stop == Stop::None;
            assert_eq!(is_left, !interrupted & (rig.cycle - begin > 100), "{cycle}");
        }
    }
}

/// LNZ-SS2-04, LNZ-SPD-10: without an encoder whatever needs a speed is 107.
#[test]
fn without_an_encoder_a_function_that_needs_a_speed_is_an_error() {
    let blind = [(15_400, 0, 0), (15_320, 0, 0), (15_203, 0, 0), (15_305, 0, 100)];
    let needs = [control::SLS1, control::SLS1 + 3, control::SS2, control::SDIPOS, control::SDINEG];
    for bit in needs {
        let mut rig = set(&blind);
        assert_eq!((rig.step().report.phase, numbers(&rig.step())), (Phase::Operational, vec![]));
        rig.world.word = without(bit);
        let found = rig.step();
        assert_eq!((numbers(&found), found.report.stop), (vec![107], Stop::Sto), "{bit}");
    }
    let mut rig = set(&blind);
    rig.world.word = without(control::SS1);
    assert!(numbers(&rig.step()).is_empty());
}

/// LNZ-EX-32, LNZ-OMS-05: the selector and the enable switch are no requested functions; a partner
/// that leaves them out differs in nothing.
#[test]
fn special_operation_is_no_requested_function() {
    let mut rig = set(&[(15_200, 0, 2), (15_201, 0, 11), (15_305, 0, 100), (15_310, 0, 10)]);
    rig.step();
    for word in [NEUTRAL | 1 << control::OMS, NEUTRAL | 1 << control::OMS | 1 << control::ES] {
        rig.world.word = word;
        assert_eq!(rig.step().report.requested.0[0], 0);
    }
    rig.world.word = without(control::SSE) & without(control::SLS1);
    assert_eq!(rig.step().report.requested.0[0], 1 << control::SSE | 1 << control::SLS1);
}

/// LNZ-EX-29, LNZ-SS2-02: in mode 0 the stopping time is waited for; too fast then is 97.
#[test]
fn ss2_of_mode_0_waits_for_its_stopping_time() {
    for (speed, stop, found) in [(10_000, Stop::Sos, vec![]), (10_001, Stop::Sto, vec![97])] {
        let mut rig = set(&[(15_305, 0, 100), (15_308, 0, 0), (15_310, 0, 10), (15_311, 0, 100_000)]);
        rig.world.speed = speed;
        rig.step();
        rig.world.word = without(control::SS2);
        for _ in 0..100 {
            assert_eq!(rig.step().report.stop, Stop::Ss2);
        }
        let ended = rig.step();
        assert_eq!((ended.report.stop, numbers(&ended)), (stop, found));
    }
}

/// LNZ-EX-31: SDI counts from the position after its delay; its reaction is C15343.
#[test]
fn sdi_is_judged_after_its_delay() {
    let rows = [(15_341, 0, 50), (15_342, 0, 100), (15_343, 0, 1), (15_305, 0, 100), (15_310, 0, 10)];
    let mut rig = set(&rows);
    rig.step();
    rig.world.word = without(control::SDINEG);
    for _ in 0..50 {
        rig.world.position += 1_000;
        assert!(numbers(&rig.step()).is_empty());
    }
    rig.step();
    rig.world.position += 100;
    assert!(numbers(&rig.step()).is_empty());
    rig.world.position += 1;
    let found = rig.step();
    assert_eq!((numbers(&found), found.report.stop), (vec![104], Stop::Ss1));
}

/// LNZ-EX-35, DEC-13.
#[test]
fn a_higher_stop_aborts_a_lower_one_and_never_the_other_way() {
    let cases = [
        (control::SS1, control::STO, Stop::Sto),
        (control::SS2, control::STO, Stop::Sto),
        (control::SS2, control::SS1, Stop::Ss1),
        (control::SS1, control::SS2, Stop::Ss1),
    ];
    for (first, second, stop) in cases {
        let mut rig = set(&[(15_305, 0, 100), (15_308, 0, 0), (15_310, 0, 10)]);
        rig.step();
        rig.world.word = without(first);
        rig.step();
        rig.world.word &= without(second);
        assert_eq!(rig.step().report.stop, stop, "{first} {second}");
    }
}

/// LNZ-SPD-02: 0, 10 and 20 are all there is.
#[test]
fn an_unknown_response_time_of_the_encoder_is_refused() {
    for (value, is_refused) in [(0, false), (5, true), (10, false), (20, false)] {
        let phase = set(&[(15_410, 0, value)]).step().report.phase;
        assert_eq!(phase == Phase::Refused, is_refused, "{value}");
    }
}

/// A motor that turns `own` increments each millisecond as its signals say, and `drive` as
/// the drive says; the speed after 10 s and what stands then.
fn turn(rig: &mut Rig, slot: impl Fn(f64) -> Slot, place: usize, own: f64, drive: i64) -> (i64, Vec<u32>) {
    let mut last = None;
    for cycle in 0..10_000_i64 {
        let mut encoder = Encoder { drive_position: drive * cycle, ..Encoder::default() };
        encoder.slots[place] = slot(own * cycle as f64);
        let outputs = rig.step_with(|inputs| {
            inputs.motion = None;
            if let Ok(cell) = &mut inputs.encoder {
                cell.payload = encoder;
            }
        });
        if !outputs.report.errors.is_empty() {
            return (cycle, numbers(&outputs));
        }
        last = Some(i64::from(outputs.report.speed_mrpm));
    }
    (last.unwrap_or(0), vec![])
}

fn motor(position: f64) -> Slot {
    sine(position, 16_384.0).slots[0]
}

/// LNZ-SPD-06: 100 increments each ms are 91.55 rpm, 63 % of it after 2 s.
#[test]
fn the_speed_of_the_drive_is_compared_after_a_filter() {
    assert_eq!(turn(&mut set(&[(15_411, 0, 91)]), motor, 0, 200.0, 100).1, []);
    let (late, found) = turn(&mut set(&[(15_411, 0, 57)]), motor, 0, 200.0, 100);
    assert_eq!(found, [212]);
    assert!((2_000..2_015).contains(&late), "{late}");
    // A standing drive beside a turning motor is found by the same comparison.
    assert_eq!(turn(&mut set(&[(15_411, 0, 20)]), motor, 0, 100.0, 0).1, [212]);
}

/// LNZ-SPD-12, LNZ-EX-05: the motor's mounting direction.
#[test]
fn a_motor_mounted_counter_clockwise_turns_the_other_way() {
    let (speed, found) = turn(&mut set(&[(15_409, 0, 1), (15_411, 0, 1)]), motor, 0, 10.0, -10);
    assert_eq!((found, (speed + 9_155).abs() < 50), (vec![], true), "{speed}");
}

/// LNZ-SPD-17, LNZ-EX-04, LNZ-EX-05: a position encoder behind a gear, in its direction.
#[test]
fn a_position_encoder_is_seen_at_the_motor() {
    let digital =
        |position: f64| Slot { kind: SlotKind::Digital, digital: position as i64, ..Slot::default() };
    let second = [(common::ENCODER_B, 2)];
    // (C15409, C15502) and the sign that the table of the mounting directions gives.
    for (motor, encoder, sign) in [(0, 0, 1), (0, 1, -1), (1, 1, 1), (1, 0, -1)] {
        let rows =
            [(15_500, 0, 2), (15_501, 0, 2_500), (15_409, 0, motor), (15_502, 0, encoder), (15_411, 0, 1)];
        // One increment each ms behind the gear is 25 at the motor: 22.888 rpm.
        let mut rig = with_common(&second, &rows);
        let (speed, found) = turn(&mut rig, digital, 1, 1.0, sign * 25);
        assert_eq!(found, [], "{motor} {encoder}");
        assert!((speed - sign * 22_888).abs() < 50, "{speed}");
    }
}

/// LNZ-PRIO-04, LNZ-SOS-04: an SS2 requested while a higher stop ran passes from STO to SOS directly,
/// and so does one whose own error was acknowledged.
#[test]
fn an_ss2_requested_when_sto_is_left_stands_at_once() {
    let rows = [(15_305, 0, 20), (15_310, 0, 10), (15_300, 1, 1), (15_311, 0, 5)];
    let mut rig = set(&rows);
    rig.world.word = without(control::SS1);
    assert!(rig.until(|_, _| (), |o| o.report.stop == Stop::Sto).is_some());
    rig.world.word = without(control::SS2);
    rig.step();
    assert_eq!(rig.step().report.stop, Stop::Sos);
    rig.world.position = 6;
    assert_eq!(numbers(&rig.step()), [106]);
    rig.world.word |= 1 << control::PS_AIE;
    let left = rig.step();
    assert_eq!((left.report.stop, numbers(&left)), (Stop::Sos, vec![]));
}

/// LNZ-SDI-08: the permanent direction belongs to normal operation.
#[test]
fn the_permanent_direction_is_not_watched_in_special_operation() {
    let mut rig = set(&[(15_340, 0, 1), (15_342, 0, 100), (15_200, 0, 2), (15_305, 0, 1_000)]);
    assert!(rig.step().report.status.bit(shown::SDIPOS_MONITORED));
    rig.world.word = NEUTRAL | 1 << control::OMS;
    assert!(!rig.step().report.status.bit(shown::SDIPOS_ACTIVE));
    rig.world.position = -101;
    assert!(numbers(&rig.step()).is_empty());
}

/// LNZ-EX-27, LNZ-SMS-06: it counts what is when C15350 is over, and from then on.
#[test]
fn a_limit_kept_in_between_does_not_end_the_response_time() {
    let rows = [(15_320, 0, 1000), (15_321, 0, 1), (15_350, 0, 80), (15_305, 0, 400), (15_310, 0, 10)];
    for late in [80, 200] {
        let mut rig = set(&rows);
        rig.step();
        let begin = rig.cycle;
        let drive = move |cycle: u64, world: &mut World| {
            let e = cycle - begin;
            world.speed = if (e == 0) | (e >= late) { 1_000_001 } else { 0 };
        };
        let end = rig.until(drive, |o| o.report.stop == Stop::Sto);
        assert_eq!(end.map(|end| end - begin), Some(late));
        assert_eq!(numbers(&rig.step()), [102, 105]);
    }
}

/// LNZ-IN-03, codes 57 to 60: a signal at a deactivated input keeps the axis from starting.
#[test]
fn a_signal_at_a_deactivated_input_is_an_error_of_the_initialisation() {
    let rows: Vec<_> = [1, 3].map(|at| (lenze_key(15_030, at), 2)).to_vec();
    let run = |pairs: u32, start: Start| {
        let mut rig = Rig::start(Profile::LenzeSm301, &rows, start);
        rig.world.pairs = pairs;
        let seen = (0..20).flat_map(|_| numbers(&rig.step())).filter(|number| (57..=60).contains(number));
        let mut all: Vec<_> = seen.collect();
        all.dedup();
        all
    };
    assert_eq!(run(0b0111, Start::Cold), [58]);
    assert_eq!(run(0b0101, Start::Cold), []);
    assert_eq!(run(0b1111, Start::Settled), []);
}

/// LNZ-OMS-12, LNZ-OMS-13: C15300 restarts automatically, and special operation selected again is
/// no acknowledge, whether its own stop or an emergency stop ended in STO.
#[test]
fn special_operation_selected_again_leaves_sto_to_the_restart_acknowledge() {
    let special = NEUTRAL | 1 << control::OMS;
    for stopped in [special, special & !(1 << control::SSE)] {
        let mut rig = set(&[(15_200, 0, 1), (15_300, 1, 1), (15_305, 0, 100), (15_310, 0, 10)]);
        rig.step();
        rig.world.word = stopped;
        assert!(rig.until(|_, _| (), |o| o.report.stop == Stop::Sto).is_some());
        for word in [NEUTRAL, special, NEUTRAL, special] {
            rig.world.word = word;
            for _ in 0..3 {
                let stands = rig.step();
                let is_special = stands.report.status.bit(shown::OMS_ACTIVE);
                assert_eq!((stands.report.stop, is_special), (Stop::Sto, word == special));
            }
        }
        rig.world.word = special | 1 << control::PS_AIS;
        assert_eq!(rig.step().report.stop, Stop::Ss1);
    }
}

/// LNZ-OMS-14: what the enable switch has brought back waits no longer; C15300 counts again.
#[test]
fn the_enable_switch_ends_the_wait_for_the_restart_acknowledge() {
    let special = NEUTRAL | 1 << control::OMS;
    let enabled = special | 1 << control::ES;
    let mut rig = set(&[(15_200, 0, 0), (15_201, 0, 11), (15_300, 1, 1)]);
    for (word, stop) in [
        (special, Stop::Sto),
        (NEUTRAL, Stop::Sto),
        (special, Stop::Sto),
        (enabled, Stop::None),
        (enabled & !(1 << control::SSE), Stop::Sto),
        (enabled, Stop::None),
    ] {
        rig.world.word = word;
        assert_eq!((rig.step().report.stop, rig.step().report.stop), (stop, stop), "{word:08x}");
    }
}

/// LNZ-OMS-22: while SS2 of special operation brakes, the limit of C15201 must be kept, in the
/// braking time of its SLS too.
#[test]
fn the_enable_switch_is_refused_above_the_limit_while_ss2_brakes() {
    for (speed, is_enabled, stop) in [(500_000, true, Stop::None), (-500_001, false, Stop::Ss2)] {
        let rows = [(15_200, 0, 2), (15_201, 0, 5), (15_330, 3, 500), (15_331, 3, 400), (15_305, 0, 1_000)];
        let mut rig = set(&rows);
        rig.world.speed = speed;
        rig.step();
        rig.world.word = NEUTRAL | 1 << control::OMS;
        assert_eq!((rig.step().report.stop, rig.step().report.stop), (Stop::Ss2, Stop::Ss2));
        rig.world.word |= 1 << control::ES;
        let seen = rig.step();
        assert_eq!((seen.report.status.bit(shown::ES_ACTIVE), seen.report.stop), (is_enabled, stop));
    }
}
