//! The slave against recorded traces, the state matrix and a test master.

extern crate std;

mod faults;
pub(crate) mod master;
mod matrix;
pub(crate) mod traces;

use std::vec::Vec;

use super::super::answer::Answer;
use super::super::{ConfigFault, Outcome};
use super::{Config, ResetCode, Slave, State};
use master::{Master, Place};

const MILLISECOND: u64 = 1_000_000;

fn config(outputs: usize, inputs: usize) -> Config<'static> {
    Config {
        outputs,
        inputs,
        address: 5,
        session_id: 0x0201,
        application_parameters: &[],
        watchdog_ms: (1, 65_535),
    }
}

/// The octets of the answer; empty for none.
fn receive(slave: &mut Slave, image: &[u8], now_ms: u64, inputs: Option<&[u8]>) -> Vec<u8> {
    let mut answer = Answer::empty();
    let outcome = slave.receive(image, now_ms * MILLISECOND, inputs, &mut answer);
    assert_eq!(outcome == Outcome::Answered, !answer.octets().is_empty());
    answer.octets().to_vec()
}

fn advance(slave: &mut Slave, now_ms: u64) -> Vec<u8> {
    let mut answer = Answer::empty();
    let _ = slave.advance(now_ms * MILLISECOND, &mut answer);
    answer.octets().to_vec()
}

/// A slave and a master that has brought it to `place`, at time 0.
fn brought_to(config: &Config<'_>, place: Place) -> (Slave, Master) {
    let mut slave = Slave::new(config).expect("valid configuration");
    let mut master = Master::new(config);
    master.bring(&mut slave, place);
    (slave, master)
}

fn is_reset_with(answer: &[u8], code: u8) -> bool {
    answer.starts_with(&[0x2A, code])
}

/// Black-channel 2.1.
#[test]
fn a_slave_of_impossible_size_or_address_cannot_be_created() {
    let fault = |config: Config<'_>| Slave::new(&config).err();
    for size in [0, 3, 125, 127, 128] {
        assert_eq!(fault(config(size, 2)), Some(ConfigFault::OutputLength));
        assert_eq!(fault(config(2, size)), Some(ConfigFault::InputLength));
    }
    assert_eq!(fault(Config { address: 0, ..config(2, 2) }), Some(ConfigFault::Address));
    let too_many = [0; 1025];
    let config = Config { application_parameters: &too_many, ..config(2, 2) };
    assert_eq!(fault(config), Some(ConfigFault::ApplicationParameters));
}

/// Black-channel 2.6: 1 + ceil(2/c) + ceil(4/c) + ceil((6+a)/c) + 1 frames.
#[test]
fn every_pair_of_sizes_reaches_data_in_the_expected_number_of_frames() {
    let sizes = [1, 2, 4, 6, 8, 12, 16, 32, 126];
    let application: [u8; 9] = core::array::from_fn(|index| index as u8 ^ 0x5A);
    for (outputs, inputs) in sizes.iter().flat_map(|a| sizes.iter().map(move |b| (*a, *b))) {
        for length in [0, 4, 9] {
            let application_parameters = &application[..length];
            let config = Config { application_parameters, ..config(outputs, inputs) };
            let (slave, master) = brought_to(&config, Place::Data);
            let chunk = outputs.min(inputs);
            let payloads = [2_usize, 4, 6 + length];
            let handshake: usize = payloads.iter().map(|octets| octets.div_ceil(chunk)).sum();
            assert_eq!(master.frames_sent, 1 + handshake + 1, "{outputs}/{inputs}/{length}");
            assert_eq!(slave.state(), State::Data);
        }
    }
}

/// Black-channel 2.5: 65,535 is followed by 1, and the chain goes on.
#[test]
fn the_connection_outlives_two_wraps_of_the_number() {
    let config = config(2, 2);
    let (mut slave, mut master) = brought_to(&config, Place::Data);
    for cycle in 0..140_000_u32 {
        let data = (cycle as u16).wrapping_mul(0x9E37).to_le_bytes();
        let answer = receive(&mut slave, &master.next(0x36, &data), 0, Some(&data));
        assert_eq!(answer[0], 0x36, "cycle {cycle}");
        master.accept(&answer);
        assert_eq!(slave.outputs(), data);
    }
}

/// Black-channel 2.5, collision rule, master to slave.
#[test]
fn a_repeated_first_check_sum_is_avoided_by_the_master_and_expected_by_the_slave() {
    let config = config(2, 2);
    let (mut slave, mut master) = brought_to(&config, Place::Data);
    let data = master.colliding_data(0x36);
    let mut careless = slave;
    let frame = master.without_collision_rule(0x36, &data);
    assert!(is_reset_with(&receive(&mut careless, &frame, 0, None), 4));
    let answer = receive(&mut slave, &master.next(0x36, &data), 0, None);
    assert_eq!(answer[0], 0x08);
    master.accept(&answer);
    let answer = receive(&mut slave, &master.next(0x36, &[1, 2]), 0, None);
    assert_eq!(answer[0], 0x08);
}

/// Black-channel 2.5, collision rule, slave to master.
#[test]
fn the_slave_never_sends_the_same_first_check_sum_twice_in_a_row() {
    let config = config(2, 2);
    let (slave, mut master) = brought_to(&config, Place::Data);
    let frame = master.next(0x36, &[1, 2]);
    let previous = master.last_check_received;
    let mut stepped = 0;
    for inputs in 0..=u16::MAX {
        let inputs = inputs.to_le_bytes();
        let answer = receive(&mut slave.clone(), &frame, 0, Some(&inputs));
        assert_ne!(u16::from_le_bytes([answer[3], answer[4]]), previous);
        let mut listener = master.clone();
        listener.accept(&answer);
        stepped += usize::from(listener.slave_number == master.slave_number + 2);
    }
    assert_eq!(stepped, 1, "exactly one pair of data octets collides");
}

/// Black-channel 3.2.
#[test]
fn an_identical_image_is_no_event_and_does_not_feed_the_watchdog() {
    let config = config(2, 2);
    let (mut slave, mut master) = brought_to(&config, Place::Data);
    let frame = master.next(0x36, &[1, 2]);
    assert_eq!(receive(&mut slave, &frame, 0, None)[0], 0x08);
    let watchdog = u64::from(master.watchdog_ms);
    assert!(receive(&mut slave, &frame, watchdog - 1, None).is_empty());
    assert!(is_reset_with(&receive(&mut slave, &frame, watchdog, None), 5));
}

/// Black-channel 3.2: nothing is sent before the first real frame.
#[test]
fn an_image_with_command_zero_is_ignored_in_state_reset_only() {
    let mut slave = Slave::new(&config(2, 2)).expect("valid");
    assert!(receive(&mut slave, &[0; 7], 0, None).is_empty());
    assert!(receive(&mut slave, &[0, 1, 2, 3, 4, 5, 6], 0, None).is_empty());
    let (mut slave, _) = brought_to(&config(2, 2), Place::Data);
    assert!(is_reset_with(&receive(&mut slave, &[0; 7], 0, None), 2));
}

/// Black-channel 3.5: the directions are independent.
#[test]
fn fail_safe_data_zero_the_outputs_whatever_their_octets_say() {
    let config = config(4, 2);
    let (mut slave, mut master) = brought_to(&config, Place::Data);
    let answer = receive(&mut slave, &master.next(0x36, &[1, 2, 3, 4]), 0, None);
    assert_eq!(answer[..3], [0x08, 0, 0]);
    assert_eq!(slave.outputs(), [1, 2, 3, 4]);
    master.accept(&answer);
    let answer = receive(&mut slave, &master.next(0x08, &[1, 2, 3, 4]), 0, Some(&[7, 8]));
    assert_eq!(answer[..3], [0x36, 7, 8]);
    assert_eq!(slave.outputs(), [0; 4]);
    assert!(!slave.has_process_data());
    assert_eq!(slave.state(), State::Data);
    master.accept(&answer);
    let answer = receive(&mut slave, &master.next(0x36, &[5; 4]), 0, Some(&[7, 8, 9]));
    assert_eq!(answer[..3], [0x08, 0, 0], "inputs of a wrong length are not sent");
}

/// Design 10: later sessions use the session id + 1 each.
#[test]
fn each_session_has_an_id_of_its_own() {
    let config = Config { session_id: 0xFFFF, ..config(2, 2) };
    let mut slave = Slave::new(&config).expect("valid");
    for id in [0xFFFF_u16, 0, 1] {
        let mut master = Master::new(&config);
        let reset = master.reset(0);
        receive(&mut slave, &reset, 0, None);
        let mut refused = master.next(0x4E, &[9, 9]);
        refused[3] ^= 1;
        assert!(is_reset_with(&receive(&mut slave, &refused, 0, None), 4), "uses up no id");
        let answer = receive(&mut slave, &Master::new(&config).next(0x4E, &[9, 9]), 0, None);
        assert_eq!(answer[1..3], id.to_le_bytes());
        assert_eq!(slave.session_id(), id);
    }
    slave.set_next_session_id(0x1234);
    let answer = receive(&mut slave, &Master::new(&config).next(0x4E, &[8, 8]), 0, None);
    assert_eq!(answer[1..3], [0x34, 0x12]);
}

/// Black-channel 3.7.
#[test]
fn a_local_reset_ends_the_connection_from_every_state() {
    for place in Place::ALL {
        let (mut slave, _) = brought_to(&config(1, 1), place);
        let mut answer = Answer::empty();
        assert_eq!(slave.local_reset(&mut answer), Outcome::Answered);
        assert!(is_reset_with(answer.octets(), 0));
        assert_eq!(slave.state(), State::Reset);
        assert_eq!(slave.last_reset(), Some(ResetCode::LocalReset));
    }
}
