//! Every step of the start-up, with a partner that is late, early or begins anew.

use super::*;

const MS: u64 = 1_000_000;
const TCC: u64 = 120 * MS;

fn progress(path_test: PathTest, path_a: bool, path_b: bool) -> Progress {
    Progress {
        is_sound: true,
        is_equal: true,
        path_test,
        readback: Some(Readback { path_a, path_b, edges_a: 0, edges_b: 0 }),
        partner: Some(Phase::AwaitAcknowledge),
        edge: false,
        is_stopped: false,
    }
}

const IDLE: fn() -> Progress = || progress(PathTest::None, false, false);

fn counted(path_test: PathTest, edges_a: u64, edges_b: u64) -> Progress {
    let readback = Some(Readback { path_a: false, path_b: false, edges_a, edges_b });
    Progress { readback, ..progress(path_test, false, false) }
}

/// A start-up that has passed its self-test.
fn tested() -> Startup {
    let mut startup = Startup::new(Phase::SelfTest);
    startup.step(&progress(PathTest::RaiseA, true, false), 0, 0);
    assert!(startup.raises(PathTest::RaiseB));
    startup.step(&progress(PathTest::RaiseB, false, true), 0, 0);
    startup.step(&progress(PathTest::Passed, false, false), 0, 0);
    assert_eq!(startup.phase(), Phase::AwaitAcknowledge);
    startup
}

fn operational() -> Startup {
    let mut startup = tested();
    startup.step(&Progress { edge: true, ..IDLE() }, TCC, 0);
    assert_eq!(startup.phase(), Phase::Operational);
    startup
}

/// DEC-19: equality for one fault tolerance time, then each path seen off and on.
#[test]
fn the_self_test_waits_for_one_fault_tolerance_time_of_equality() {
    let mut startup = Startup::new(Phase::Boot);
    for cycle in 0..=121 {
        assert_ne!(startup.phase(), Phase::SelfTest);
        startup.step(&IDLE(), TCC, cycle * MS);
    }
    assert_eq!(startup.phase(), Phase::SelfTest);
}

/// DEC-19: a sample missed, late or doubled in between starts the time again.
#[test]
fn one_cycle_without_equality_or_without_a_sample_starts_the_time_again() {
    for (is_sound, is_equal) in [(false, true), (true, false)] {
        let mut startup = Startup::new(Phase::Pairing);
        let disturbed = Progress { is_sound, is_equal, ..IDLE() };
        let first = (0..400).find(|cycle| {
            let seen = if *cycle == 100 { disturbed } else { IDLE() };
            startup.step(&seen, TCC, cycle * MS);
            startup.phase() == Phase::SelfTest
        });
        assert_eq!(first, Some(101 + 120));
    }
}

#[test]
fn an_edge_counts_only_without_a_stop() {
    let mut startup = tested();
    let edge = Progress { edge: true, ..IDLE() };
    startup.step(&Progress { is_stopped: true, ..edge }, TCC, 0);
    assert_eq!(startup.phase(), Phase::AwaitAcknowledge);
    startup.step(&edge, TCC, 0);
    assert_eq!(startup.phase(), Phase::Operational);
}

/// A partner that is behind, lost or refused is not left behind.
#[test]
fn an_edge_counts_only_when_the_partner_has_come_as_far() {
    for partner in [None, Some(Phase::Refused), Some(Phase::SelfTest)] {
        let mut startup = tested();
        startup.step(&Progress { edge: true, partner, ..IDLE() }, TCC, 0);
        assert_eq!(startup.phase(), Phase::AwaitAcknowledge, "{partner:?}");
    }
    let mut startup = tested();
    startup.step(&Progress { edge: true, partner: Some(Phase::Operational), ..IDLE() }, TCC, 0);
    assert_eq!(startup.phase(), Phase::Operational);
}

#[test]
fn waiting_for_the_self_test_a_partner_may_still_pair() {
    let mut startup = Startup::new(Phase::SelfTest);
    startup.step(&Progress { partner: Some(Phase::Pairing), ..IDLE() }, TCC, 0);
    assert_eq!(startup.phase(), Phase::SelfTest);
}

/// Before the first torque a partner that begins anew takes this channel along.
#[test]
fn a_partner_that_begins_anew_is_followed_until_the_first_torque() {
    let back = |startup: Startup, partner: Phase| {
        let mut startup = startup;
        startup.step(&Progress { partner: Some(partner), ..IDLE() }, TCC, 0);
        startup.phase()
    };
    assert_eq!(back(Startup::new(Phase::SelfTest), Phase::Boot), Phase::Boot);
    for startup in [tested(), operational()] {
        assert_eq!(back(startup, Phase::Boot), Phase::Boot);
        assert_eq!(back(startup, Phase::Pairing), Phase::Pairing);
    }
    let mut driven = operational();
    driven.note_driven();
    assert_eq!(back(driven, Phase::Boot), Phase::Operational);
    assert_eq!(back(driven, Phase::Pairing), Phase::Operational);
}

/// The test need not be repeated by crosscheck when only the pairing was.
#[test]
fn what_was_seen_of_the_paths_survives_a_new_pairing_but_not_a_new_begin() {
    for (partner, ends) in [(Phase::Pairing, Phase::AwaitAcknowledge), (Phase::Boot, Phase::Boot)] {
        let mut startup = tested();
        startup.step(&Progress { partner: Some(partner), ..IDLE() }, 0, 0);
        let passed = progress(PathTest::Passed, false, false);
        for _ in 0..4 {
            startup.step(&passed, 0, 0);
            if startup.phase() == ends {
                break;
            }
        }
        assert_eq!(startup.phase(), ends);
    }
}

/// An edge that one channel alone has seen is void after the fault tolerance time.
#[test]
fn an_edge_the_partner_has_not_seen_is_void() {
    let mut startup = operational();
    let first = (0..400).find(|cycle| {
        startup.step(&IDLE(), TCC, cycle * MS);
        startup.phase() == Phase::AwaitAcknowledge
    });
    assert_eq!(first, Some(120));
    let mut followed = operational();
    for cycle in 0..400 {
        followed.step(&Progress { partner: Some(Phase::Operational), ..IDLE() }, TCC, cycle * MS);
    }
    assert_eq!(followed.phase(), Phase::Operational);
}

/// DEC-19: a channel that slept through a step has the evaluator's counts as witness.
#[test]
fn the_counted_edges_tell_of_a_step_that_was_slept_through() {
    let mut startup = Startup::new(Phase::SelfTest);
    startup.step(&counted(PathTest::None, 7, 3), 0, 0);
    startup.step(&counted(PathTest::RaiseB, 9, 3), 0, 0);
    assert!(startup.raises(PathTest::RaiseB));
    startup.step(&counted(PathTest::None, 9, 4), 0, 0);
    startup.step(&counted(PathTest::Passed, 9, 4), 0, 0);
    assert_eq!(startup.phase(), Phase::AwaitAcknowledge);
}

/// A cross-fault shows as edges on the own path while the partner's was raised.
#[test]
fn a_test_passed_without_having_been_seen_begins_anew() {
    let ends = |steps: &[Progress]| {
        let mut startup = Startup::new(Phase::SelfTest);
        for step in steps {
            startup.step(step, 0, 0);
            startup.raises(step.path_test);
        }
        startup.phase()
    };
    let passed = counted(PathTest::Passed, 9, 4);
    assert_eq!(ends(&[counted(PathTest::None, 7, 3), passed]), Phase::Boot);
    let coupled = [counted(PathTest::None, 7, 3), counted(PathTest::RaiseA, 9, 4)];
    assert_eq!(ends(&[coupled[0], coupled[1], counted(PathTest::RaiseB, 9, 4), passed]), Phase::Boot);
    let unraised = [counted(PathTest::None, 7, 3), counted(PathTest::RaiseA, 9, 3)];
    assert_eq!(ends(&[unraised[0], unraised[1], passed]), Phase::Boot);
}

#[test]
fn the_path_is_not_raised_for_ever() {
    let mut startup = Startup::new(Phase::SelfTest);
    let raised = (0..100).filter(|_| {
        let raises = startup.raises(PathTest::RaiseB);
        startup.step(&progress(PathTest::RaiseB, false, false), 0, 0);
        raises
    });
    assert_eq!(raised.count(), 24);
}
