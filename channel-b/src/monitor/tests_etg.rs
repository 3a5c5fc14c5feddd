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
        (Some(300), vec![[etg::SS2 << 16 | 0x202, 0, 0, 0]])
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
}
