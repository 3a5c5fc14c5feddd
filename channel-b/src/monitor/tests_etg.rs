//! The generic profile through whole steps, to the cycle.

use shm_schema::exchange::Outputs;
use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::{control, status as shown};
use shm_schema::profile::{Profile, common, etg_key, reference};
use shm_schema::report::{Phase, Stop};
use std::vec;
use std::vec::Vec;

use crate::testing::{Rig, World, codes, status};

const NEUTRAL: u32 = 0x0F7F_FF7F;

fn set(objects: &[(u32, u32, u32, i32)]) -> Rig {
    let keys: Vec<_> = objects.iter().map(|(f, i, o, value)| (etg_key(*f, *i, *o), *value)).collect();
    let mut all = vec![(common::POSITION_DIFFERENCE, 1_000_000), (common::SPEED_DIFFERENCE, 60_000)];
    all.extend(keys);
    Rig::new(Profile::Etg61002, &all)
}

const AUTOMATIC: (u32, u32, u32, i32) = (etg::STO, 1, 1, 0);

fn without(bits: &[u8]) -> u32 {
    bits.iter().fold(NEUTRAL, |word, bit| word & !(1 << bit))
}

fn bit(outputs: &Outputs, bit: u8) -> bool {
    status(outputs) >> bit & 1 == 1
}

/// Ends of a stop as cycles since the request, with its errors.
fn run(rig: &mut Rig, word: u32, speed: impl Fn(i64) -> i64 + Copy) -> (Option<u64>, Vec<[u32; 4]>) {
    rig.world.speed = speed(0);
    rig.step();
    let begin = rig.cycle;
    let drive = move |cycle: u64, world: &mut World| {
        world.word = word;
        world.speed = speed((cycle - begin) as i64);
    };
    let end = rig.until(drive, |o| matches!(o.report.stop, Stop::Sto | Stop::Sos));
    (end.map(|end| end - begin), rig.last[1].as_ref().map(codes).unwrap_or_default())
}

/// ETG-SEQ-01, ETG-GEN-12: each SS1 by its own time since its own request; the first that ends is STO.
#[test]
fn two_ss1_run_side_by_side() {
    let mut rig = set(&[AUTOMATIC, (etg::SS1, 1, 1, 100), (etg::SS1, 2, 1, 2_000)]);
    let later = without(&[control::SS1_2]);
    let both = without(&[control::SS1_1, control::SS1_2]);
    rig.world.speed = 500_000;
    rig.step();
    let begin = rig.cycle;
    let drive = move |cycle: u64, world: &mut World| {
        world.word = if cycle < begin + 100 { later } else { both };
        world.speed = 500_000;
    };
    let end = rig.until(drive, |o| o.report.stop == Stop::Sto);
    assert_eq!(end.map(|end| end - begin), Some(200));
}

/// ETG-SS1-01, ETG-SS1-02, ETG-SS1-11.
#[test]
fn ss1_by_time_ends_at_its_time_or_after_the_dwell_time() {
    let word = without(&[control::SS1_1]);
    let stop = |e: i64| (1_000_000 - e * 4_000).max(0);
    let plain = [AUTOMATIC, (etg::SS1, 1, 1, 800)];
    assert_eq!(run(&mut set(&plain), word, stop), (Some(800), vec![]));
    assert_eq!(run(&mut set(&plain), word, |_| 1_000_000), (Some(800), vec![]));
    let dwell = [AUTOMATIC, (etg::SS1, 1, 1, 800), (etg::SS1, 1, 2, 10), (etg::SS1, 1, 3, 100)];
    // Inside 10 rpm from 248 ms on.
    assert_eq!(run(&mut set(&dwell), word, stop), (Some(348), vec![]));
    // DEC-05: without a dwell time the whole time passes, at standstill too.
    let zero = [AUTOMATIC, (etg::SS1, 1, 1, 800), (etg::SS1, 1, 2, 10)];
    assert_eq!(run(&mut set(&zero), word, |_| 0), (Some(800), vec![]));
    let fast = run(&mut set(&dwell), word, |_| 1_000_000);
    assert_eq!(fast, (Some(800), vec![[etg::SS1 << 16 | 0x101, 0, 0, 0]]));
}

/// ETG-SS1-04, ETG-SS1-06, ETG-EX-03, DEC-01.
#[test]
fn ss1_by_deceleration_follows_the_line_from_the_latched_speed() {
    let rows = [
        AUTOMATIC,
        (etg::SS1, 1, 1, 1000),
        (etg::SS1, 1, 2, 30),
        (etg::SS1, 1, 4, 3750),
        (etg::SS1, 1, 5, 200),
    ];
    let word = without(&[control::SS1_1]);
    let line = |e: i64| (1_500_000 - (e - 200).max(0) * 3_750).max(0);
    // 1470 rpm at 3750 rpm/s are 392 ms.
    assert_eq!(run(&mut set(&rows), word, line), (Some(592), vec![]));
    let over = move |e: i64| line(e) + i64::from(e == 300);
    assert_eq!(run(&mut set(&rows), word, over), (Some(300), vec![[etg::SS1 << 16 | 0x102, 0, 0, 0]]));
}

/// ETG-RST-01, ETG-RST-03, DEC-12: acknowledged by default.
#[test]
fn sto_is_left_by_a_restart_edge_while_the_request_is_shown() {
    let mut rig = set(&[]);
    assert!(rig.step().report.ready);
    rig.world.word = without(&[control::STO]) | 1 << control::RESTART_ACKNOWLEDGE;
    assert_eq!(rig.step().report.stop, Stop::Sto);
    rig.world.word = NEUTRAL | 1 << control::RESTART_ACKNOWLEDGE;
    let waits = rig.step();
    assert!(bit(&waits, shown::RESTART_ACKNOWLEDGE_REQUEST) & !waits.report.ready);
    rig.world.word = NEUTRAL;
    assert!(!rig.step().report.ready);
    rig.world.word = NEUTRAL | 1 << control::RESTART_ACKNOWLEDGE;
    let left = rig.step();
    assert!(left.report.ready & !bit(&left, shown::RESTART_ACKNOWLEDGE_REQUEST));
}

/// ETG-SS2-02, ETG-SOS-01, ETG-SOS-04.
#[test]
fn ss2_ends_in_the_sos_of_its_number() {
    let rows =
        [AUTOMATIC, (etg::SS2, 2, 1, 300), (etg::SS2, 2, 5, 0), (etg::SOS, 2, 1, 50), (etg::SOS, 2, 2, 5)];
    let mut rig = set(&rows);
    let word = without(&[control::SS2_2]);
    assert_eq!(
        run(&mut rig, word, |e| (900_000 - e * 4_000).max(10_000)),
        (Some(300), vec![[etg::SOS << 16 | 0x201, 0, 0, 0]])
    );
    let mut rig = set(&rows);
    // DEC-05: without a dwell time standstill ends nothing early.
    assert_eq!(run(&mut rig, word, |e| (900_000 - e * 4_000).max(0)), (Some(300), vec![]));
    rig.world.position = 50;
    let stands = rig.step();
    assert!(bit(&stands, shown::SOS_2) & stands.inhibit.permit);
    rig.world.position = 51;
    assert_eq!(rig.step().report.stop, Stop::Sto);
}

/// ETG-SLS-01, ETG-SLS-03, ETG-EX-04, ETG-ERR-01.
#[test]
fn sls_by_time_and_by_line_with_a_reaction_of_its_own() {
    let by_time = [(etg::SLS, 1, 1, 400), (etg::SLS, 1, 2, 500)];
    let mut rig = set(&by_time);
    rig.world.speed = 2_000_000;
    rig.step();
    rig.world.word = without(&[control::SLS_1]);
    let begin = rig.cycle;
    let trip = rig.until(|_, _| (), |o| !o.report.errors.is_empty());
    assert_eq!(trip.map(|at| at - begin), Some(400));
    // The formula of ETG-EX-04: 3125 rpm/s from 200 ms on, out of the maximum speed.
    let by_line = [
        (etg::SMS, 1, 1, 3000),
        (etg::SMS, 1, 2, 3000),
        (etg::SLS, 2, 1, 1000),
        (etg::SLS, 2, 2, 500),
        (etg::SLS, 2, 5, 200),
        (etg::SLS, 2, 6, reference(etg::SS1, 1)),
        (etg::SS1, 1, 1, 100),
    ];
    let mut rig = set(&by_line);
    rig.world.speed = -3_000_000;
    rig.step();
    let begin = rig.cycle;
    let follow = move |cycle: u64, world: &mut World| {
        world.word = without(&[control::SLS_2]);
        world.speed = -(3_000_000 - ((cycle - begin) as i64 - 200).max(0) * 3_125).max(500_000);
    };
    let reached = rig.until(follow, |o| bit(o, shown::SLS_2));
    assert_eq!(reached.map(|at| at - begin), Some(1_000));
    rig.world.speed = 500_001;
    let left = rig.step();
    assert_eq!((left.report.stop, bit(&left, shown::ERROR)), (Stop::Ss1, true));
}

/// ETG-SLP-01, ETG-SLI-01, ETG-SLT-01, ETG-SMS-01, DEC-31, DEC-39.
#[test]
fn plain_windows_include_their_ends() {
    let rows = [
        (etg::SLP, 1, 1, 1000),
        (etg::SLP, 1, 2, -20),
        (etg::SLI, 1, 1, 100),
        (etg::SLI, 1, 2, 40),
        (etg::SMS, 1, 1, 100),
        (etg::SMS, 1, 2, 50),
    ];
    let trips = |bits: &[u8], position: i64, speed: i64| {
        let mut rig = set(&rows);
        rig.world.word = without(bits);
        rig.step();
        (rig.world.position, rig.world.speed) = (position, speed);
        !codes(&rig.step()).is_empty()
    };
    let (slp, sli) = ([control::SLP_1], [control::SLI_1]);
    assert_eq!([1000, 1001, -20, -21].map(|at| trips(&slp, at, 0)), [false, true, false, true]);
    assert_eq!([100, 101, -40, -41].map(|at| trips(&sli, at, 0)), [false, true, false, true]);
    assert_eq!([100_000, 100_001, -50_000, -50_001].map(|at| trips(&[], 0, at)), [false, true, false, true]);
}

/// ETG-SDI-02, ETG-SDI-04, ETG-SDI-05, DEC-30.
#[test]
fn sdi_watches_the_disabled_direction_from_standstill_on() {
    let rows = [(etg::SDI, 1, 1, 100), (etg::SDI, 1, 2, 10)];
    let mut rig = set(&rows);
    rig.world.word = without(&[control::SDIN]);
    rig.world.speed = 500_000;
    assert!(bit(&rig.step(), shown::SDIP));
    rig.world.speed = 0;
    rig.world.position = 1_000;
    rig.step();
    rig.world.position = 900;
    assert!(codes(&rig.step()).is_empty());
    rig.world.position = 899;
    assert_eq!(codes(&rig.step()), [[etg::SDI << 16 | 0x101, 0, 0, 0]]);
}

/// DEC-30, ETG-SDI-02, ETG-GEN-12: each direction waits for its own standstill.
#[test]
fn a_direction_forbidden_while_the_axis_moves_in_it_waits_for_standstill() {
    let mut rig = set(&[(etg::SDI, 1, 1, 100), (etg::SDI, 1, 2, 10)]);
    rig.world.word = without(&[control::SDIP]);
    rig.step();
    (rig.world.speed, rig.world.position) = (-900_000, -5_000);
    rig.step();
    rig.world.word = without(&[control::SDIP, control::SDIN]);
    assert!(codes(&rig.step()).is_empty());
    rig.world.speed = 0;
    assert!(codes(&rig.step()).is_empty());
    rig.world.position = -5_101;
    assert_eq!(codes(&rig.step()), [[etg::SDI << 16 | 0x101, 0, 0, 0]]);
    // The positive one keeps its first standstill.
    let mut first = set(&[(etg::SDI, 1, 1, 100), (etg::SDI, 1, 2, 10)]);
    first.world.word = without(&[control::SDIP]);
    first.step();
    first.world.word = without(&[control::SDIP, control::SDIN]);
    first.step();
    first.world.position = 101;
    assert_eq!(codes(&first.step()), [[etg::SDI << 16 | 0x101, 0, 0, 0]]);
}

/// ETG-SSM-01, DEC-14, DEC-29: a status bit only, also in STO.
#[test]
fn ssm_shows_its_range_and_goes_on_in_sto() {
    let mut rig = set(&[(etg::SSM, 1, 1, 10), (etg::SSM, 1, 2, -10)]);
    assert!(bit(&rig.step(), shown::SSM_1));
    rig.world.word = without(&[control::STO]);
    assert!(bit(&rig.step(), shown::SSM_1));
    rig.world.speed = 10_001;
    assert!(!bit(&rig.step(), shown::SSM_1));
    assert!(!bit(&set(&[]).step(), shown::SSM_1));
}

/// ETG-EX-06, ETG-SBC-01, ETG-SBC-05.
#[test]
fn the_brake_closes_before_ss1_ends() {
    let rows =
        [AUTOMATIC, (etg::SS1, 1, 1, 1000), (etg::SS1, 1, 6, reference(etg::SBC, 1)), (etg::SBC, 1, 1, 150)];
    let mut rig = set(&rows);
    assert!(bit(&rig.step(), shown::SBC_1));
    let begin = rig.cycle;
    let closed = rig.until(|_, w| w.word = without(&[control::SS1_1]), |o| !bit(o, shown::SBC_1));
    assert_eq!(closed.map(|at| at - begin), Some(850));
    rig.world.word = NEUTRAL;
    let open = rig.until(|_, _| (), |o| bit(o, shown::SBC_1));
    assert_eq!(open.map(|at| at - begin), Some(1_001));
}

/// DEC-41: further octets are assigned in the set.
#[test]
fn a_set_places_a_fifth_sls_in_its_own_bits() {
    let mut all = vec![(etg_key(etg::SLS, 5, 2), 100), (common::CONTROL_WORD + 32, reference(etg::SLS, 5))];
    all.push((common::STATUS_WORD + 32, reference(etg::SLS, 5)));
    all.push((common::POSITION_DIFFERENCE, 1_000_000));
    let mut rig = Rig::new(Profile::Etg61002, &all);
    // Bit 32 of a 32-bit neutral word is 0: requested.
    assert!(rig.step().report.status.bit(32));
    rig.world.speed = 100_001;
    assert_eq!(codes(&rig.step()), [[etg::SLS << 16 | 0x501, 0, 0, 0]]);
}

/// ETG-SS1-09, DEC-31.
#[test]
fn a_delay_as_long_as_the_time_and_a_negative_magnitude_are_refused() {
    for rows in
        [[(etg::SS1, 1, 1, 200), (etg::SS1, 1, 5, 200)], [(etg::SMS, 1, 1, 200), (etg::SMS, 1, 2, -200)]]
    {
        assert_eq!(set(&rows).step().report.phase, Phase::Refused);
    }
    let signed = [(etg::SMA, 1, 1, 9_000), (etg::SMA, 1, 2, -9_000)];
    assert_eq!(set(&signed).step().report.phase, Phase::Operational);
}

/// ETG-GEN-12, ETG-SS2-01, ETG-SS2-02, DEC-13: each SS2 brakes by its own time and stands in the SOS
/// of its number from its own end on, while another still brakes.
#[test]
fn two_ss2_run_side_by_side_and_each_sos_is_monitored_from_its_own_end() {
    let rows = [
        AUTOMATIC,
        (etg::SS2, 1, 1, 300),
        (etg::SS2, 2, 1, 100),
        (etg::SOS, 1, 1, 1_000),
        (etg::SOS, 2, 1, 10),
    ];
    let both = without(&[control::SS2_1, control::SS2_2]);
    let stands = |position: i64| {
        let mut rig = set(&rows);
        rig.world.word = both;
        let begin = rig.cycle;
        let quick = rig.until(|_, _| (), |o| bit(o, shown::SOS_2));
        assert_eq!(quick.map(|end| end - begin), Some(100));
        let during = rig.last[1].expect("stepped");
        assert_eq!((during.report.stop, bit(&during, shown::SOS_1)), (Stop::Ss2, false));
        rig.world.position = position;
        let next = rig.step();
        (rig, begin, next)
    };
    let (_, _, left) = stands(11);
    assert_eq!((left.report.stop, codes(&left)), (Stop::Sto, vec![[etg::SOS << 16 | 0x201, 0, 0, 0]]));
    let (mut rig, begin, kept) = stands(10);
    assert!(codes(&kept).is_empty());
    let slow = rig.until(|_, _| (), |o| bit(o, shown::SOS_1));
    assert_eq!(slow.map(|end| end - begin), Some(300));
    let last = rig.step();
    assert_eq!((last.report.stop, bit(&last, shown::SOS_2)), (Stop::Sos, true));
}

/// ETG-RST-02, ETG-SS2-11: each standing SOS is left by its own rule, while another goes on.
#[test]
fn each_sos_is_left_by_the_rule_of_its_own_ss2() {
    let rows = [(etg::SS2, 1, 1, 100), (etg::SS2, 2, 1, 100), (etg::SS2, 2, 5, 0)];
    let mut rig = set(&rows);
    let both = without(&[control::SS2_1, control::SS2_2]);
    assert!(rig.until(|_, w| w.word = both, |o| bit(o, shown::SOS_1) & bit(o, shown::SOS_2)).is_some());
    rig.world.word = NEUTRAL;
    let waits = rig.step();
    assert!(bit(&waits, shown::SOS_1) & !bit(&waits, shown::SOS_2));
    assert!(bit(&waits, shown::RESTART_ACKNOWLEDGE_REQUEST));
    // A new SS2_2 brakes beside the SOS that waits.
    rig.world.word = without(&[control::SS2_2]) | 1 << control::RESTART_ACKNOWLEDGE;
    let left = rig.step();
    assert_eq!((left.report.stop, bit(&left, shown::SOS_1)), (Stop::Ss2, false));
}

/// DEC-13, ETG-GEN-12: SS1 aborts every SS2, and what is requested begins anew when STO is left.
#[test]
fn an_ss1_aborts_every_ss2_and_they_begin_anew_after_its_sto() {
    let rows = [AUTOMATIC, (etg::SS1, 1, 1, 50), (etg::SS2, 1, 1, 300), (etg::SS2, 2, 1, 20)];
    let mut rig = set(&rows);
    let ss2 = [control::SS2_1, control::SS2_2];
    assert!(rig.until(|_, w| w.word = without(&ss2), |o| bit(o, shown::SOS_2)).is_some());
    let all = without(&[control::SS1_1, control::SS2_1, control::SS2_2]);
    rig.world.word = all;
    let aborts = rig.step();
    assert_eq!((aborts.report.stop, bit(&aborts, shown::SOS_2)), (Stop::Ss1, false));
    assert!(rig.until(|_, _| (), |o| o.report.stop == Stop::Sto).is_some());
    let begin = rig.cycle;
    let again = rig.until(|_, w| w.word = without(&ss2), |o| bit(o, shown::SOS_2));
    assert_eq!(again.map(|end| end - begin), Some(20));
}

/// ETG-SS2-10, DEC-17: a left line hands over to the other SS2, and does not begin again itself.
#[test]
fn an_ss2_off_its_line_hands_over_to_its_reaction() {
    let line = [(etg::SS2, 1, 1, 1000), (etg::SS2, 1, 3, 10_000), (etg::SS2, 1, 4, 100), (etg::SOS, 1, 2, 5)];
    let other = [(etg::SS2, 1, 6, reference(etg::SS2, 2)), (etg::SS2, 2, 1, 200)];
    let mut rig = set(&[&line[..], &other[..], &[AUTOMATIC][..]].concat());
    let (ends, codes) = run(&mut rig, without(&[control::SS2_1]), |_| 500_000);
    // The line is left 1 ms after the delay; SS2_2 takes its own time from there.
    assert_eq!((ends, codes), (Some(301), vec![[etg::SS2 << 16 | 0x101, 0, 0, 0]]));
    assert_eq!(rig.step().report.stop, Stop::Sos);
}

/// ETG-SS2-10: from its own delay on SS2_1 is off its line, and its reaction may be off its own 100 ms
/// later. Cycles from the request to STO, and the stops meanwhile.
fn off_line(reaction: i32, of_other: i32, request: u8) -> (u64, Vec<Stop>) {
    let line = |instance: u32| {
        let of = |object: u32, value: i32| (etg::SS2, instance, object, value);
        [of(1, 1000), of(3, 10_000), of(4, 100), (etg::SOS, instance, 2, 5)]
    };
    let reactions = [(etg::SS2, 1, 6, reaction), (etg::SS2, 2, 6, of_other)];
    let rest = [AUTOMATIC, (etg::SS1, 1, 1, 200), (etg::SLS, 1, 2, 100), (etg::SLS, 1, 6, SS2_1)];
    let mut rig = set(&[&line(1)[..], &line(2)[..], &reactions[..], &rest[..]].concat());
    rig.world.speed = 500_000;
    rig.step();
    let begin = rig.cycle;
    rig.world.word = without(&[request]);
    let mut stops = Vec::new();
    while stops.last() != Some(&Stop::Sto) {
        stops.push(rig.step().report.stop);
    }
    let cycles = rig.cycle - begin - 1;
    stops.dedup();
    (cycles, stops)
}

const SS1_1: i32 = reference(etg::SS1, 1);
const SS2_1: i32 = reference(etg::SS2, 1);
const SS2_2: i32 = reference(etg::SS2, 2);

/// ETG-SS2-10, ETG-ERR-01: the configured stop; STO where that is the stop itself, or one that has
/// left its own line already.
#[test]
fn an_ss2_off_its_line_starts_the_reaction_it_names() {
    let sto = reference(etg::STO, 1);
    for request in [control::SS2_1, control::SLS_1] {
        assert_eq!(off_line(sto, sto, request), (101, vec![Stop::Ss2, Stop::Sto]));
        assert_eq!(off_line(SS2_1, sto, request), (101, vec![Stop::Ss2, Stop::Sto]));
        assert_eq!(off_line(SS1_1, sto, request), (301, vec![Stop::Ss2, Stop::Ss1, Stop::Sto]));
        assert_eq!(off_line(SS2_2, SS2_1, request), (202, vec![Stop::Ss2, Stop::Sto]));
        assert_eq!(off_line(SS2_2, SS1_1, request), (402, vec![Stop::Ss2, Stop::Ss1, Stop::Sto]));
    }
}

/// ETG-SOS-02: the velocity window is an option; without it the line ends at 0, and the position alone
/// is watched from there on.
#[test]
fn an_sos_without_velocity_window_watches_the_position_alone() {
    let mut rig = set(&[AUTOMATIC, (etg::SS2, 1, 1, 900), (etg::SS2, 1, 3, 1_000), (etg::SOS, 1, 1, 50)]);
    let line = |e: i64| (500_000 - e * 1_000).max(700);
    let word = without(&[control::SS2_1]);
    assert_eq!(run(&mut rig, word, line), (Some(500), vec![]));
    rig.world.speed = 5_000;
    assert_eq!(rig.step().report.stop, Stop::Sos);
    rig.world.position = 51;
    assert_eq!(codes(&rig.step()), [[etg::SOS << 16 | 0x101, 0, 0, 0]]);
    // On the way there the line counts.
    let mut fast = set(&[AUTOMATIC, (etg::SS2, 1, 1, 900), (etg::SS2, 1, 3, 1_000), (etg::SOS, 1, 1, 50)]);
    let (end, codes) = run(&mut fast, word, |e| 500_000 - e * 999);
    assert_eq!((end, codes), (Some(1), vec![[etg::SS2 << 16 | 0x101, 0, 0, 0]]));
}

/// DEC-41, ETG-SBC-08: what nothing could request, and a second brake, is refused, never left out.
#[test]
fn an_instance_that_nothing_can_request_is_refused() {
    let refused = |rows: &[(u32, u32, u32, i32)], key: u32| {
        let first = set(rows).step();
        assert_eq!((first.report.phase, codes(&first)), (Phase::Refused, vec![[key, 0, 0, 0]]), "{rows:?}");
    };
    let sls = [(etg::SLS, 5, 1, 100), (etg::SLS, 5, 2, 500)];
    refused(&sls, etg_key(etg::SLS, 5, 0));
    refused(&[(etg::SOS, 3, 1, 100)], etg_key(etg::SOS, 3, 0));
    refused(&[(etg::SS1, 3, 1, 100)], etg_key(etg::SS1, 3, 0));
    refused(&[(etg::SBC, 1, 1, 100), (etg::SBC, 2, 1, 200)], etg_key(etg::SBC, 2, 0));
    // Requested by an error, or ending an SS2 that is.
    let reaction = [(etg::SLS, 1, 2, 100), (etg::SLS, 1, 6, reference(etg::SS2, 3)), (etg::SS2, 3, 1, 100)];
    let named = [&reaction[..], &[(etg::SOS, 3, 1, 100), (etg::SLT, 9, 1, 5)]].concat();
    refused(&named, etg_key(etg::SLT, 9, 0));
    assert!(set(&named[..4]).step().report.ready);
}

/// ETG-GEN-05, ETG-GEN-12: eight SS1 and eight SS2 at once; one more is refused at load.
#[test]
fn eight_ss1_and_eight_ss2_fit_and_the_seventeenth_stop_is_refused() {
    let all = |ss2: u32| {
        let stops = (1..=8).map(|i| (etg::SS1, i)).chain((1..=ss2).map(|i| (etg::SS2, i)));
        let rows =
            |(of, i)| [(etg_key(of, i, 1), 900), (common::CONTROL_WORD + of * 32 + i, reference(of, i))];
        Rig::new(Profile::Etg61002, &stops.flat_map(rows).collect::<Vec<_>>())
    };
    assert!(all(8).step().report.ready);
    let refused = all(9).step();
    assert_eq!(
        (refused.report.phase, codes(&refused)),
        (Phase::Refused, vec![[etg::SS2 << 16 | 0x900, 0, 0, 0]])
    );
    let many: Vec<_> = (1..=97).map(|i| (etg::SSM, i, 1, 900)).collect();
    assert_eq!(set(&many[..96]).step().report.phase, Phase::Operational);
    assert_eq!(codes(&set(&many).step()), [[etg::SSM << 16 | 97 << 8, 0, 0, 0]]);
}

fn without_reaction() -> Rig {
    set(&[AUTOMATIC, (etg::SLS, 1, 1, 0), (etg::SLS, 1, 2, 500), (etg::SLS, 1, 6, 0), (etg::SS1, 1, 1, 50)])
}

/// ETG-ERR-02, ETG-ERR-04, DEC-15: without a reaction the error stands and the monitoring goes on; an
/// edge is refused in every cycle in which the limit is violated, and changes nothing else.
#[test]
fn an_error_without_reaction_cannot_be_acknowledged_while_its_limit_is_violated() {
    let mut rig = without_reaction();
    let word = without(&[control::SLS_1]);
    let acknowledge = word | 1 << control::ERROR_ACK;
    let mut at = |speed: i64, word: u32| {
        (rig.world.speed, rig.world.word) = (speed, word);
        let outputs = rig.step();
        let bits = [shown::ERROR, shown::SLS_1].map(|of| bit(&outputs, of));
        assert!(outputs.inhibit.permit);
        (bits, codes(&outputs).len())
    };
    assert_eq!(at(500_000, word), ([false, true], 0));
    assert_eq!(at(500_001, word), ([true, false], 1));
    assert_eq!(at(500_001, acknowledge), ([true, false], 1));
    assert_eq!(at(500_000, word), ([true, true], 1));
    // Kept before and after, but not in the cycle of the edge.
    assert_eq!(at(500_001, acknowledge), ([true, false], 1));
    assert_eq!(at(500_001, word), ([true, false], 1));
    // Violated before, kept in the cycle of the edge.
    assert_eq!(at(500_000, acknowledge), ([false, true], 0));
    assert_eq!(at(500_001, word), ([true, false], 1));
    // Deselected it is not violated.
    assert_eq!(at(500_001, NEUTRAL | 1 << control::ERROR_ACK), ([false, false], 0));
}

/// DEC-12: while such an error stands a finished stop is not left, and nothing asks for a restart.
#[test]
fn an_error_without_reaction_keeps_a_finished_stop() {
    let mut rig = without_reaction();
    rig.world.word = without(&[control::SLS_1]);
    rig.world.speed = 500_001;
    rig.step();
    let both = without(&[control::SLS_1, control::SS1_1]);
    assert!(rig.until(|_, w| w.word = both, |o| o.report.stop == Stop::Sto).is_some());
    rig.world.word = without(&[control::SLS_1]);
    for _ in 0..5 {
        let kept = rig.step();
        assert_eq!((kept.report.stop, bit(&kept, shown::RESTART_ACKNOWLEDGE_REQUEST)), (Stop::Sto, false));
    }
    // In STO no limit is evaluated (DEC-14): the edge is accepted, the stop is left.
    rig.world.speed = 0;
    rig.world.word |= 1 << control::ERROR_ACK;
    assert_eq!(rig.step().report.stop, Stop::None);
}
