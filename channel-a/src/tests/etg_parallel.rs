//! The generic profile: stops side by side, and violations without a reaction.

use shm_schema::exchange::Start;
use shm_schema::facts::etg as f;
use shm_schema::facts::etg_6100_2::{control, status};
use shm_schema::profile::{Profile, common, etg_key, reference};
use shm_schema::report::{Phase, Stop};
use std::vec::Vec;

use super::bench::{Bench, codes};

type Object = (u32, u32, u32, i64);

fn keyed(objects: &[Object]) -> Vec<(u32, i64)> {
    let key = |(function, instance, object, value): &Object| (etg_key(*function, *instance, *object), *value);
    objects.iter().map(key).chain([(common::SPEED_DIFFERENCE, 315)]).collect()
}

fn bench(objects: &[Object]) -> Bench {
    Bench::new(Profile::Etg61002, &keyed(objects), Start::Settled)
}

/// The neutral word without these bits.
fn without(bits: &[u8]) -> u32 {
    bits.iter().fold(Profile::Etg61002.neutral_word(), |word, bit| word & !(1 << bit))
}

/// SS2_1 brakes for 400 ms, SS2_2 for 100 ms; both may be left without an acknowledge.
const TWO_SS2: [Object; 6] = [
    (f::SS2, 1, f::ss2::TIME_TO_SOS, 400),
    (f::SS2, 1, f::ss2::RESTART_ACKNOWLEDGE_BEHAVIOR, 0),
    (f::SS2, 2, f::ss2::TIME_TO_SOS, 100),
    (f::SS2, 2, f::ss2::RESTART_ACKNOWLEDGE_BEHAVIOR, 1),
    (f::SOS, 1, f::sos::POSITION_ZERO_WINDOW, 1_000_000),
    (f::SOS, 2, f::sos::POSITION_ZERO_WINDOW, 1_000),
];
const BOTH: [u8; 2] = [control::SS2_1, control::SS2_2];

#[test]
fn the_quicker_of_two_ss2_stands_while_the_other_brakes() {
    // ETG-SS2-01, ETG-SS2-02, ETG-GEN-12
    let mut bench = bench(&TWO_SS2);
    bench.until(9);
    bench.word = without(&BOTH);
    assert_eq!(bench.first(900, |_| 0.0, |report| report.status.bit(status::SOS_2)), Some(110));
    assert_eq!(bench.until(409).stop, Stop::Ss2, "the other still brakes");
    let report = bench.until(410);
    assert!(report.status.bit(status::SOS_1) && report.status.bit(status::SOS_2));
    assert_eq!(report.stop, Stop::Sos);
}

#[test]
fn a_standing_ss2_is_monitored_around_its_own_position_although_another_brakes() {
    // ETG-GEN-12, DEC-08
    let run = |position: i64| {
        let mut bench = bench(&TWO_SS2);
        bench.travel = false;
        bench.position = 5_000;
        bench.until(9);
        bench.word = without(&BOTH);
        bench.until(110);
        bench.position = position;
        bench.until(111)
    };
    assert!(run(6_000).driving);
    let report = run(6_001);
    assert_eq!((report.driving, report.stop), (false, Stop::Sto));
    assert_eq!(codes(&report), [(f::SOS << 16 | 2 << 8 | 1, 0, 0, 0)]);
}

#[test]
fn each_standing_ss2_is_left_by_its_own_request_and_restart_behaviour() {
    // ETG-RST-02, ETG-SS2-11
    let mut bench = bench(&TWO_SS2);
    bench.until(9);
    bench.word = without(&BOTH);
    bench.until(500);
    bench.word = without(&[control::SS2_2]);
    let report = bench.until(501);
    assert!(!report.status.bit(status::SOS_1), "SS2_1 restarts by itself");
    assert!(report.status.bit(status::SOS_2), "SS2_2 is still requested");
    bench.word = without(&[]);
    let report = bench.until(502);
    assert!(report.status.bit(status::SOS_2) && report.status.bit(status::RESTART_ACKNOWLEDGE_REQUEST));
    bench.word |= 1 << control::RESTART_ACKNOWLEDGE;
    assert_eq!(bench.until(503).stop, Stop::None);
}

#[test]
fn an_ss1_aborts_every_ss2_and_those_requested_begin_again() {
    // DEC-13
    let mut objects = Vec::from(TWO_SS2);
    objects.extend([
        (f::SS1, 1, f::ss1::TIME_TO_STO, 100),
        (f::STO, 1, f::sto::RESTART_ACKNOWLEDGE_BEHAVIOR, 0),
    ]);
    let mut bench = bench(&objects);
    bench.until(9);
    bench.word = without(&BOTH);
    bench.until(200);
    bench.word = without(&[control::SS2_1, control::SS2_2, control::SS1_1]);
    let report = bench.until(201);
    assert_eq!((report.stop, report.status.bit(status::SOS_2)), (Stop::Ss1, false));
    bench.until(400);
    bench.word = without(&BOTH);
    assert_eq!(bench.until(401).stop, Stop::Ss2);
    assert_eq!(bench.first(900, |_| 0.0, |report| report.status.bit(status::SOS_2)), Some(501));
}

/// `count` instances each of SS1 and SS2, on bits from 64 on.
fn many(count: u32) -> Vec<(u32, i64)> {
    let mut entries = keyed(&[]);
    for instance in 1..=count {
        let time = i64::from(instance) * 100;
        for (function, object, first, word) in
            [(f::SS1, f::ss1::TIME_TO_STO, 64, time + 2_000), (f::SS2, f::ss2::TIME_TO_SOS, 96, time)]
        {
            entries.push((etg_key(function, instance, object), word));
            entries.push((common::CONTROL_WORD + first + instance, i64::from(reference(function, instance))));
        }
        entries.push((etg_key(f::SOS, instance, f::sos::POSITION_ZERO_WINDOW), 100 + i64::from(instance)));
        entries.push((common::STATUS_WORD + 64 + instance, i64::from(reference(f::SOS, instance))));
    }
    entries
}

/// The command with these bits requested.
fn command(entries: &[(u32, i64)], requested: impl Fn(u8) -> bool) -> shm_schema::command::Command {
    use shm_schema::command::{Command, CommandSource};
    let neutral = shm_schema::word::Word::from_u32(Profile::Etg61002.neutral_word());
    let bits =
        entries.iter().filter_map(|(key, _)| u8::try_from(key.checked_sub(common::CONTROL_WORD)?).ok());
    let word = bits.fold(neutral, |word, bit| word.with(bit, !requested(bit)));
    Command { source: CommandSource::Plain, drive_enabled: true, word, ..Command::default() }
}

#[test]
fn eight_ss1_and_eight_ss2_fit_and_each_has_its_own_time() {
    // ETG-GEN-05, ETG-GEN-12
    let entries = many(8);
    let mut bench = Bench::new(Profile::Etg61002, &entries, Start::Settled);
    bench.command = Some(command(&entries, |_| false));
    assert!(bench.until(9).driving);
    bench.command = Some(command(&entries, |bit| bit >= 96));
    let standing = |report: shm_schema::report::Report| (1..=8).filter(|n| report.status.bit(64 + n)).count();
    for instance in 1..=8_u64 {
        assert_eq!(standing(bench.until(9 + 100 * instance)) as u64, instance - 1);
        assert_eq!(standing(bench.until(10 + 100 * instance)) as u64, instance);
    }
    // SS1_3 since 811, SS1_2 since 910: the earlier end is that of the later.
    bench.command = Some(command(&entries, |bit| bit == 67));
    bench.until(909);
    bench.command = Some(command(&entries, |bit| (bit == 66) | (bit == 67)));
    assert_eq!(bench.first(9_000, |_| 0.0, |report| report.stop == Stop::Sto), Some(910 + 2_200));
}

#[test]
fn one_stop_too_many_refuses_the_set() {
    // design 8: nothing that finds no place is ignored
    let entries = many(9);
    let mut bench = Bench::new(Profile::Etg61002, &entries, Start::Settled);
    let report = bench.until(1);
    assert_eq!(report.phase, Phase::Refused);
    assert!(codes(&report).contains(&(3605, f::SS2, 8, 0)), "{:?}", codes(&report));
    let mut found = Vec::new();
    crate::findings(&super::bench::image(Profile::Etg61002, &entries), &mut |code| found.push(code));
    assert!(found.contains(&shm_schema::error::ErrorCode::amk(3605, f::SS2, 8, 0)));
}

/// SLS_1 without reaction, SS2_1 with SOS_1 that nothing can leave.
const WITHOUT_REACTION: [Object; 4] = [
    (f::SLS, 1, f::sls::VELOCITY_LIMIT, 500),
    (f::SLS, 1, f::sls::ERROR_REACTION, 0),
    (f::SS2, 1, f::ss2::TIME_TO_SOS, 0),
    (f::SOS, 1, f::sos::POSITION_ZERO_WINDOW, 1_000_000_000),
];
const ERROR_ACK: u32 = 1 << control::ERROR_ACK;

#[test]
fn without_a_reaction_the_error_stands_as_long_as_the_limit_is_violated() {
    // ETG-ERR-02, ETG-ERR-04, DEC-15
    let mut bench = bench(&WITHOUT_REACTION);
    bench.word = without(&[control::SLS_1]);
    let shown = |report: &shm_schema::report::Report| {
        (report.status.bit(status::ERROR), report.status.bit(status::SLS_1), report.driving)
    };
    assert_eq!(shown(&bench.ride(9, |_| 500.0)), (false, true, true));
    assert_eq!(shown(&bench.ride(10, |_| 501.0)), (true, false, true));
    bench.word |= ERROR_ACK;
    assert_eq!(shown(&bench.ride(11, |_| 501.0)), (true, false, true), "refused");
    bench.word &= !ERROR_ACK;
    assert_eq!(shown(&bench.ride(12, |_| 500.0)), (true, true, true), "kept again, not acknowledged");
    bench.word |= ERROR_ACK;
    let report = bench.ride(13, |_| 500.0);
    assert_eq!((shown(&report), codes(&report).len()), ((false, true, true), 0), "no new transition");
}

#[test]
fn a_restart_edge_counts_once_the_request_is_shown() {
    // ETG-RST-03: with the error's own edge it is too early
    let mut bench = bench(&[
        (f::SLS, 1, f::sls::VELOCITY_LIMIT, 500),
        (f::SLS, 1, f::sls::ERROR_REACTION, i64::from(reference(f::STO, 1))),
    ]);
    bench.word = without(&[control::SLS_1]);
    assert_eq!(bench.ride(9, |_| 501.0).stop, Stop::Sto);
    bench.word |= ERROR_ACK | 1 << control::RESTART_ACKNOWLEDGE;
    let report = bench.ride(10, |_| 0.0);
    assert_eq!((report.stop, report.status.bit(status::RESTART_ACKNOWLEDGE_REQUEST)), (Stop::Sto, true));
    bench.word = without(&[control::SLS_1]);
    bench.ride(11, |_| 0.0);
    bench.word |= 1 << control::RESTART_ACKNOWLEDGE;
    assert_eq!(bench.ride(12, |_| 0.0).stop, Stop::None);
}

#[test]
fn while_it_stands_no_finished_stop_is_left() {
    // DEC-12: both edges in one word do not help
    let mut bench = bench(&WITHOUT_REACTION);
    bench.word = without(&[control::SLS_1, control::SS2_1]);
    assert_eq!(bench.ride(9, |_| 501.0).stop, Stop::Sos);
    bench.word = without(&[control::SLS_1]);
    let report = bench.ride(10, |_| 501.0);
    assert_eq!((report.stop, report.status.bit(status::RESTART_ACKNOWLEDGE_REQUEST)), (Stop::Sos, false));
    bench.word |= ERROR_ACK | 1 << control::RESTART_ACKNOWLEDGE;
    assert_eq!(bench.ride(11, |_| 501.0).stop, Stop::Sos);
    bench.word = without(&[control::SLS_1]);
    assert_eq!(bench.ride(12, |_| 500.0).stop, Stop::Sos);
    bench.word |= ERROR_ACK;
    assert!(bench.ride(13, |_| 500.0).status.bit(status::RESTART_ACKNOWLEDGE_REQUEST));
    bench.word |= 1 << control::RESTART_ACKNOWLEDGE;
    assert_eq!(bench.ride(14, |_| 500.0).stop, Stop::None);
}
