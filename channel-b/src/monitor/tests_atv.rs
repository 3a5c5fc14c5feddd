//! The ATV profile through whole steps, to the cycle.

use shm_schema::encoder::SlotKind;
use shm_schema::exchange::Outputs;
use shm_schema::facts::atv340::{control, status as shown};
use shm_schema::profile::{Profile, common};
use shm_schema::report::{Phase, Stop};
use std::vec;
use std::vec::Vec;

use crate::testing::{Rig, World, codes, sine, status};

const PERMIT: u32 = 1;
/// 1/1000 rpm of one hertz at 2 pole pairs.
const HZ: i64 = 30_000;

fn set(changes: &[(u32, i32)]) -> Rig {
    let mut all =
        vec![(1, 1), (2, 2), (4, 2_000), (5, 5), (6, 1024), (common::POSITION_DIFFERENCE, 1_000_000)];
    // SS1: 20 Hz/s, monitored 10 Hz/s, offset 5 Hz, standstill 5 Hz, delay 5 ms.
    all.extend([(65, 1), (36, 1), (30, 200), (31, 100), (32, 50), (33, 50), (34, 5), (35, 0)]);
    all.extend_from_slice(changes);
    Rig::new(Profile::Atv340, &all)
}

fn with(bit: u8) -> u32 {
    PERMIT | 1 << bit
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
    let end = rig.until(drive, |o| o.report.stop == Stop::Sto);
    (end.map(|end| end - begin), rig.last[1].as_ref().map(numbers).unwrap_or_default())
}

/// ATV-SS1-06, ATV-SS1-07, ATV-SS1-10, ATV-EX-13, ATV-SEQ-01, DEC-03.
#[test]
fn ss1_falls_from_the_peak_of_the_delay_plus_the_offset() {
    // 50 Hz at the start, 51 Hz during the delay; then exactly on 56 Hz - 10 Hz/s.
    let line = |e: i64| match e {
        0 => 50 * HZ,
        1..=505 => 51 * HZ,
        _ => 56 * HZ - (e - 5) * 300,
    };
    let word = with(control::SS1);
    // 5 Hz are reached 5100 ms after the delay.
    assert_eq!(run(&mut set(&[]), word, line), (Some(5_105), vec![]));
    let over = move |e: i64| line(e) + i64::from(e == 2_000);
    assert_eq!(run(&mut set(&[]), word, over), (Some(2_000), vec![0x011]));
    // DEC-05: standstill ends it before the line does.
    assert_eq!(run(&mut set(&[]), word, |e| (50 * HZ - e * 3_000).max(0)), (Some(450), vec![]));
}

/// ATV-SS1-11, ATV-SS1-12, DEC-48.
#[test]
fn the_sto_of_a_finished_ss1_lasts_100_ms_or_as_long_as_the_request() {
    let mut rig = set(&[]);
    rig.world.speed = 10 * HZ;
    rig.step();
    rig.world.word = with(control::SS1);
    assert!(bit(&rig.step(), shown::SS1));
    rig.world.word = PERMIT;
    rig.world.speed = 0;
    let begin = rig.cycle;
    assert_eq!(rig.step().report.stop, Stop::Sto);
    let left = rig.until(|_, _| (), |o| o.report.stop == Stop::None);
    assert_eq!(left.map(|at| at - begin), Some(100));
    rig.world.word = with(control::SS1);
    for _ in 0..300 {
        rig.step();
    }
    assert!(bit(&rig.step(), shown::RESTART_REQUIRED));
    rig.world.word = PERMIT;
    assert_eq!(rig.step().report.stop, Stop::None);
}

/// ATV-SS1-09: the fifth violation survives every reset.
#[test]
fn the_fifth_ramp_violation_needs_a_restart() {
    let mut rig = set(&[(35, 1)]);
    for violation in 1..=5 {
        run(&mut rig, with(control::SS1), |_| 50 * HZ);
        rig.world.word = PERMIT;
        rig.step();
        rig.world.word = with(control::SAFETY_RESET);
        let left: Vec<u32> = if violation < 5 { vec![] } else { vec![0x068] };
        assert_eq!(numbers(&rig.step()), left, "{violation}");
        for _ in 0..200 {
            rig.step();
        }
    }
}

const SLS: [(u32, i32); 7] = [(66, 1), (40, 100), (43, 20), (46, 50), (48, 300), (50, 250), (54, 40)];

fn sls(kind: i32) -> Rig {
    let mut rows = SLS.to_vec();
    rows.push((39, kind));
    set(&rows)
}

/// ATV-SLST1-02 to 04, ATV-SEQ-03.
#[test]
fn type_1_keeps_the_speed_between_standstill_and_threshold() {
    let word = with(control::SLS);
    assert_eq!(run(&mut sls(1), word, |_| 31 * HZ), (Some(0), vec![0x0AB]));
    assert_eq!(run(&mut sls(1), word, |_| 4 * HZ), (Some(0), vec![]));
    let falls = |e: i64| if e < 10 { 20 * HZ } else { 5 * HZ - i64::from(e >= 20) };
    assert_eq!(run(&mut sls(1), word, falls), (Some(20), vec![]));
    assert_eq!(run(&mut sls(1), word, |e| 30 * HZ + i64::from(e == 7)), (Some(7), vec![0x0AB]));
    let mut rig = sls(1);
    rig.world.speed = -20 * HZ;
    rig.world.word = word;
    let drive = rig.step().report.drive;
    assert_eq!((drive.set_point_min_mrpm, drive.set_point_max_mrpm), (-600_000, 0));
}

/// ATV-SLST2-01, ATV-SLST2-02, ATV-SLST2-06, ATV-SLST2-07, ATV-SEQ-04, ATV-SEQ-05.
#[test]
fn type_2_brakes_along_the_line_and_waits_below_standstill() {
    let word = with(control::SLS);
    // 40 Hz + 2 Hz - 10 Hz/s.
    let line = |e: i64| (42 * HZ - e * 300).clamp(25 * HZ, 40 * HZ);
    let over = move |e: i64| line(e) + i64::from(e == 900);
    assert_eq!(run(&mut sls(2), word, over), (Some(900), vec![0x0A9]));
    let kept = move |e: i64| if e < 2_000 { line(e) } else { 31 * HZ };
    assert_eq!(run(&mut sls(2), word, kept), (Some(2_000), vec![0x0AB]));
    assert_eq!(run(&mut sls(2), word, |_| 0), (Some(40), vec![]));
    let starts = |e: i64| if e < 39 { 0 } else { 5 * HZ - i64::from(e >= 50) };
    assert_eq!(run(&mut sls(2), word, starts), (Some(50), vec![]));
}

/// ATV-SLS-01, ATV-SLST2-01: monitored, and shown, from the activation on.
#[test]
fn sls_is_shown_from_its_activation_until_it_is_violated() {
    let mut rig = sls(2);
    rig.world.speed = 40 * HZ;
    rig.step();
    rig.world.word = with(control::SLS);
    assert!(bit(&rig.step(), shown::SLS));
    rig.world.speed = 43 * HZ;
    let violated = rig.step();
    assert_eq!((numbers(&violated), bit(&violated, shown::SLS)), (vec![0x0A9], false));
}

/// ATV-SLST3-01, ATV-SLST3-05, ATV-SLST6-01, ATV-SEQ-06.
#[test]
fn types_3_and_6_stop_from_above_the_threshold() {
    for kind in [3, 6] {
        let mut rig = sls(kind);
        rig.world.speed = 40 * HZ;
        rig.step();
        rig.world.word = with(control::SLS);
        let stops = rig.step();
        assert_eq!((stops.report.stop, stops.report.drive.brake), (Stop::Ss1, true));
        rig.world.word = PERMIT;
        rig.world.speed = 0;
        let begin = rig.cycle;
        let left = rig.until(|_, _| (), |o| o.report.stop == Stop::None);
        assert_eq!(left.map(|at| at - begin), Some(100), "type {kind}");
    }
}

/// ATV-SS1-11, DEC-48, DEC-14: an SS1 that is complete in the cycle in which SLS finds standstill
/// rests its 100 ms.
#[test]
fn ss1_beside_the_standstill_of_sls_rests_all_the_same() {
    let mut rig = sls(1);
    rig.step();
    rig.world.word = with(control::SLS) | with(control::SS1);
    let begin = rig.cycle;
    assert_eq!(rig.step().report.stop, Stop::Sto);
    let drive = move |cycle: u64, world: &mut World| {
        if cycle == begin + 79 {
            world.word = PERMIT;
        }
    };
    let left = rig.until(drive, |o| o.report.stop == Stop::None);
    assert_eq!(left.map(|at| at - begin), Some(100));
}

/// ATV-SS1-12, ATV-SLST6-01, DEC-14: SLS did not ask for the SS1 that ended here, so it holds
/// nothing; it begins when STO is left, and from above its threshold it stops anew.
#[test]
fn sls_beside_a_finished_ss1_begins_when_sto_is_left() {
    let mut rig = sls(6);
    rig.step();
    rig.world.word = with(control::SLS) | with(control::SS1);
    assert_eq!(rig.step().report.stop, Stop::Sto);
    rig.world.speed = 40 * HZ;
    for _ in 0..200 {
        assert_eq!(rig.step().report.stop, Stop::Sto);
    }
    rig.world.word = with(control::SLS);
    let begins = rig.step();
    assert_eq!((begins.report.stop, bit(&begins, shown::SS1)), (Stop::Ss1, true));
}

/// ATV-SS1-12: SLS that asked for the SS1 holds its STO, beside the request of SS1 or without it.
#[test]
fn sls_holds_the_sto_of_the_ss1_it_asked_for() {
    let mut rig = sls(3);
    rig.world.speed = 40 * HZ;
    rig.step();
    rig.world.word = with(control::SLS) | with(control::SS1);
    assert_eq!(rig.step().report.stop, Stop::Ss1);
    rig.world.speed = 0;
    assert_eq!(rig.step().report.stop, Stop::Sto);
    rig.world.word = with(control::SLS);
    for _ in 0..200 {
        assert_eq!(rig.step().report.stop, Stop::Sto);
    }
    rig.world.word = PERMIT;
    assert_eq!(rig.step().report.stop, Stop::None);
}

/// DEC-13: one sample asks for the SS1 of SLS type 6 and for the STO of SMS. The SS1 does not begin, so
/// it holds no STO either: the reset leaves it, and the same limits are judged anew.
#[test]
fn the_highest_of_what_one_sample_asks_for_begins() {
    let types = [(66, 1), (39, 6), (48, 200), (50, 100), (56, 1), (57, 300), (58, 300), (40, 100)];
    let mut rig = set(&types);
    let (word, reset) = (with(control::SLS), with(control::SLS) | 1 << control::SAFETY_RESET);
    rig.world.speed = 40 * HZ;
    rig.world.word = word;
    let both = rig.step();
    assert_eq!((both.report.stop, numbers(&both)), (Stop::Sto, vec![0x0B4]));
    rig.until(|cycle, _| assert!(cycle < 1_000), |_| true);
    rig.world.speed = 0;
    rig.world.word = reset;
    rig.step();
    assert_eq!(numbers(&rig.step()), [0; 0]);
    let left = rig.until(|_, _| (), |o| o.report.ready);
    assert!(left.is_some());
}

/// ATV-SLST4-01, ATV-SLST4-02, ATV-SLST5-03, ATV-SEQ-07.
#[test]
fn types_4_and_5_permit_both_directions() {
    let word = with(control::SLS);
    assert_eq!(run(&mut sls(4), word, |_| 31 * HZ), (Some(0), vec![0x0AB]));
    for kind in [4, 5] {
        let turns = |e: i64| (20 * HZ - e * 3_000).max(-30 * HZ - i64::from(e >= 900));
        assert_eq!(run(&mut sls(kind), word, turns), (Some(900), vec![0x0AB]), "type {kind}");
    }
}

/// ATV-SMS-03, ATV-SMS-04, ATV-SMS-08, ATV-SMS-10, ATV-SEQ-09.
#[test]
fn sms_follows_its_mode_and_switch() {
    let rows = |mode: i32| [(56, mode), (57, 500), (58, 400), (59, 300), (60, 200)];
    let trips = |mode: i32, switch: bool, speed: i64| {
        let word = if switch { with(control::SMS_SWITCH) } else { PERMIT };
        let mut rig = set(&rows(mode));
        rig.world.word = word;
        rig.world.speed = speed;
        numbers(&rig.step())
    };
    assert_eq!(trips(1, false, 50 * HZ), []);
    assert_eq!(trips(1, false, 50 * HZ + 1), [0x0B4]);
    assert_eq!(trips(1, false, -40 * HZ - 1), [0x0B5]);
    assert_eq!(trips(2, false, 40 * HZ), []);
    assert_eq!(trips(2, true, 30 * HZ + 1), [0x0B4]);
    assert_eq!(trips(3, false, 90 * HZ), []);
    assert_eq!(trips(3, true, 90 * HZ), [0x0B4]);
    // ATV-SMS-03: one threshold is watched whatever the bit says.
    assert_eq!(trips(1, true, 50 * HZ), []);
    assert_eq!(trips(1, true, 50 * HZ + 1), [0x0B4]);
}

/// ATV-PSF-07, ATV-SS1-18, ATV-SLS-13, ATV-SMS-14, DEC-33.
#[test]
fn bits_without_configuration_are_errors() {
    let run = |bit: u8| {
        let mut rig = set(&[(65, 0)]);
        rig.step();
        rig.world.word = with(bit);
        let outputs = rig.step();
        assert_eq!(outputs.report.stop, Stop::Sto);
        numbers(&outputs)
    };
    let found = [3, 8, control::SS1, control::SLS, control::SMS_SWITCH].map(run);
    assert_eq!(found, [[0x152], [0x152], [0x156], [0x157], [0x158]]);
}

/// ATV-SLS-04, ATV-SS1-20, ATV-SMS-05, ATV-ENC-10.
#[test]
fn incompatible_settings_are_refused() {
    let external = vec![(66, 1), (39, 3), (36, 0), (48, 300), (50, 250), (40, 100)];
    let above = vec![(66, 1), (39, 4), (48, 600), (50, 250), (40, 100), (56, 1), (57, 500), (58, 500)];
    for rows in [external, above, vec![(56, 2), (59, 10)], vec![(1, 2), (5, 1)]] {
        let outputs = set(&rows).step();
        assert_eq!((outputs.report.phase, numbers(&outputs)), (Phase::Refused, vec![0x032]));
    }
}

/// ATV-SLS-09: with an encoder SLS must not begin while the drive has switched its motor off.
#[test]
fn sls_activated_in_a_freewheel_is_an_error() {
    let begin = |enabled: bool, speed: i64, encoder: i32| {
        let mut rows = SLS.to_vec();
        rows.extend([(39, 4), (5, encoder)]);
        let mut rig = set(&rows);
        (rig.world.enabled, rig.world.speed) = (enabled, speed);
        rig.step();
        rig.world.word = with(control::SLS);
        numbers(&rig.step())
    };
    assert_eq!(begin(false, 20 * HZ, 5), [0x071]);
    assert_eq!(begin(true, 20 * HZ, 5), []);
    assert_eq!(begin(false, 5 * HZ, 5), []);
    assert_eq!(begin(false, 20 * HZ, 1), []);
}

/// ATV-SS1-13: without an encoder a switched off power stage ends SS1.
#[test]
fn ss1_without_an_encoder_ends_with_the_power_stage() {
    for (encoder, stop) in [(1, Stop::Sto), (5, Stop::Ss1)] {
        let mut rig = set(&[(5, encoder)]);
        rig.world.speed = 20 * HZ;
        rig.world.word = with(control::SS1);
        assert_eq!(rig.step().report.stop, Stop::Ss1);
        rig.world.enabled = false;
        assert_eq!(rig.step().report.stop, stop);
    }
}

/// ATV-ENC-09: against the drive's own direction it is the phase rotation without an encoder, and
/// the inversion of the encoder with one.
#[test]
fn a_drive_that_turns_the_other_way_is_named_by_its_encoder() {
    for (encoder, number) in [(1, 0x0DA), (5, 0x0DB)] {
        let mut rig = set(&[(5, encoder), (common::SPEED_DIFFERENCE, 60_000)]);
        let found = (0..2_000_i64).find_map(|cycle| {
            let mut cell = sine(-50.0 * cycle as f64, 16_384.0);
            cell.drive_position = 50 * cycle;
            if encoder == 1 {
                cell.slots[0].kind = SlotKind::Encoderless;
                cell.frequency_mhz = -1_526;
            }
            let outputs = rig.step_with(|inputs| {
                inputs.motion = None;
                if let Ok(sampled) = &mut inputs.encoder {
                    sampled.payload = cell;
                }
            });
            let found = numbers(&outputs);
            (!found.is_empty()).then_some(found)
        });
        assert_eq!(found, Some(vec![number]), "{encoder}");
    }
}
