//! Time, memory faults, wrong lengths and noise.

use super::master::Place;
use super::{
    Answer, Config, MILLISECOND, Outcome, ResetCode, Slave, State, advance, brought_to, config,
    is_reset_with, receive,
};

/// Black-channel 3.6, AMK-FSOE-06.
#[test]
fn the_watchdog_expires_when_the_elapsed_time_reaches_it() {
    let (mut slave, mut master) = brought_to(&config(2, 2), Place::Data);
    assert!(advance(&mut slave, 99).is_empty());
    let answer = receive(&mut slave, &master.next(0x36, &[1, 2]), 99, None);
    master.accept(&answer);
    assert!(advance(&mut slave, 198).is_empty());
    assert_eq!(slave.outputs(), [1, 2]);
    assert!(is_reset_with(&advance(&mut slave, 199), 5));
    assert_eq!((slave.state(), slave.outputs()), (State::Reset, &[0, 0][..]));
    assert_eq!(slave.last_reset(), Some(ResetCode::WatchdogExpired));
    assert!(advance(&mut slave, 10_000).is_empty(), "it expires once");
}

#[test]
fn the_watchdog_is_exact_to_the_nanosecond() {
    let (mut slave, _) = brought_to(&config(2, 2), Place::Data);
    let mut answer = Answer::empty();
    assert_eq!(slave.advance(100 * MILLISECOND - 1, &mut answer), Outcome::Nothing);
    assert_eq!(slave.advance(100 * MILLISECOND, &mut answer), Outcome::Answered);
}

#[test]
fn a_right_but_late_frame_finds_the_connection_gone() {
    let (mut slave, mut master) = brought_to(&config(2, 2), Place::Data);
    let frame = master.next(0x36, &[1, 2]);
    assert!(is_reset_with(&receive(&mut slave, &frame, 100, None), 5));
    assert!(receive(&mut slave, &frame, 100, None).is_empty());
    assert_eq!(slave.outputs(), [0, 0]);
}

#[test]
fn a_clock_that_runs_backwards_ends_the_connection() {
    let (mut slave, mut master) = brought_to(&config(2, 2), Place::Data);
    let answer = receive(&mut slave, &master.next(0x36, &[1, 2]), 50, None);
    assert_eq!(answer[0], 0x08);
    assert!(is_reset_with(&advance(&mut slave, 49), 5));
}

#[test]
fn outside_data_the_slave_waits_for_ever() {
    for place in Place::ALL.into_iter().filter(|place| *place != Place::Data) {
        let (mut slave, _) = brought_to(&config(1, 1), place);
        let before = slave.state();
        assert!(advance(&mut slave, u64::MAX / MILLISECOND).is_empty());
        assert_eq!(slave.state(), before);
    }
}

#[test]
fn a_new_connection_can_be_made_after_the_watchdog() {
    let (mut slave, mut master) = brought_to(&config(2, 2), Place::Data);
    advance(&mut slave, 100);
    master.bring(&mut slave, Place::Data);
    assert_eq!(slave.last_reset(), None);
    assert_eq!(slave.outputs(), [0x55, 0]);
}

/// Design 3.1: value and complement are checked on use.
#[test]
fn every_spoilt_variable_resets_the_connection() {
    type Change = fn(&mut super::super::memory::Memory);
    let changes: [Change; 13] = [
        |m| m.state = State::Session,
        |m| m.done ^= 1,
        |m| m.session_id ^= 1 << 9,
        |m| m.next_session_id ^= 1,
        |m| m.connection_id ^= 1 << 15,
        |m| m.parameter_header[2] ^= 0x80,
        |m| m.connection_data[3] ^= 1,
        |m| m.application_agrees ^= true,
        |m| m.has_process_data ^= true,
        |m| m.master_number ^= 1,
        |m| m.slave_number ^= 1,
        |m| m.received_check ^= 1 << 4,
        |m| m.accepted_at_ns ^= 1 << 40,
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let (mut slave, mut master) = brought_to(&config(2, 2), Place::Data);
        slave.memory.spoil(change);
        assert_eq!(slave.outputs(), [0, 0]);
        assert!(!slave.has_process_data());
        assert_eq!(slave.state(), State::Reset);
        let answer = receive(&mut slave, &master.next(0x36, &[1, 2]), 0, None);
        assert!(is_reset_with(&answer, 0), "{index}");
        assert_eq!(slave.integrity_faults(), 1);
        master.bring(&mut slave, Place::Data);
    }
}

#[test]
fn spoilt_outputs_read_as_zeros() {
    let (mut slave, _) = brought_to(&config(2, 2), Place::Data);
    assert_eq!(slave.outputs(), [0x55, 0]);
    slave.outputs.spoil();
    assert_eq!(slave.outputs(), [0, 0]);
}

/// Black-channel 2.1: refused before the content is looked at.
#[test]
fn a_frame_of_wrong_length_is_not_looked_at() {
    let (mut slave, _) = brought_to(&config(2, 2), Place::Data);
    let digest = slave.digest();
    for length in (0..20).filter(|length| *length != 7) {
        let image = [0x2A; 20];
        let mut answer = Answer::empty();
        let outcome = slave.receive(&image[..length], 0, None, &mut answer);
        assert_eq!((outcome, answer.octets()), (Outcome::WrongLength, &[][..]));
    }
    assert_eq!((slave.state(), slave.digest()), (State::Data, digest));
}

#[test]
fn the_digest_is_that_of_the_last_frame_processed() {
    let (mut slave, mut master) = brought_to(&config(2, 2), Place::Data);
    let frame = master.next(0x36, &[1, 2]);
    receive(&mut slave, &frame, 0, None);
    assert_eq!(slave.digest(), super::super::super::frame_digest(&frame));
}

/// A small generator of noise, seeded, so that a failure repeats.
fn noise(seed: &mut u64) -> u64 {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    *seed
}

#[test]
fn noise_never_reaches_the_outputs() {
    let commands = [0x2A, 0x4E, 0x64, 0x52, 0x36, 0x08, 0x00, 0xFF];
    let mut seed = 0x5AFE_9A12;
    for (outputs, inputs) in [(1, 1), (2, 12), (8, 2), (126, 126)] {
        let config = Config { application_parameters: &[1, 2, 3], ..config(outputs, inputs) };
        let mut slave = Slave::new(&config).expect("valid");
        let length = if outputs == 1 { 6 } else { 2 * outputs + 3 };
        for cycle in 0..5_000 {
            let mut image = [0; 255];
            image.fill_with(|| noise(&mut seed) as u8);
            image[0] = commands[noise(&mut seed) as usize % 8];
            let _ = receive(&mut slave, &image[..length], cycle, None);
            assert!(slave.outputs().iter().all(|octet| *octet == 0));
        }
    }
}
