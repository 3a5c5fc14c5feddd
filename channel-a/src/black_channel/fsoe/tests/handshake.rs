//! Sizes, chunks, session ids, parameters (black-channel.md 2.6, 2.7, 3.4).

use super::*;
use crate::black_channel::{ConfigFault, parameter_signature};

/// black-channel.md 2.1, 2.6: every size pair, three parameter lengths.
#[test]
fn every_size_pair_reaches_data() {
    let sizes = (1..=126).filter(|size| *size == 1 || size % 2 == 0);
    for size in sizes {
        for other in [1, 2, 4, 6, 12, 126] {
            for application in [0, 4, 33] {
                let application = vec![0x5A; application];
                let mut bench = Bench::new(size, other, &application);
                bench.inputs = Some(vec![0xC3; usize::from(other)]);
                bench.reach(State::Parameter);
                let data = vec![0x77; usize::from(size)];
                let inputs = bench.exchange(CONN_ID, command::PROCESS_DATA, &data);
                assert_eq!(inputs, vec![0xC3; usize::from(other)]);
                assert_eq!(bench.slave.outputs(), data);
            }
        }
    }
}

/// black-channel.md 2.1.
#[test]
fn other_lengths_are_refused_before_their_content() {
    let mut bench = Bench::new(4, 12, &[]);
    bench.reach(State::Data);
    for length in (0..300).filter(|length| *length != 11) {
        let fault = bench.slave.frame(&vec![0x2A; length], None, 0).unwrap_err();
        assert_eq!((fault.expected, fault.received), (11, length));
    }
    assert_eq!(bench.slave.state(), State::Data);
    for length in [0, 3, 5, 125, 127, 128, 255] {
        let config = |output_length, input_length| FsoeConfig {
            output_length,
            input_length,
            address: 1,
            session_id: 0,
            application_parameters: &[],
            watchdog_ms: (1, 1),
        };
        let refused = |config| FsoeSlave::new(&config).err();
        assert_eq!(refused(config(length, 2)), Some(ConfigFault::OutputLength));
        assert_eq!(refused(config(2, length)), Some(ConfigFault::InputLength));
    }
}

/// AMK-ADDR-05, black-channel.md 3.4.
#[test]
fn a_slave_without_address_or_watchdog_is_not_built() {
    let config = |address, watchdog_ms, application_parameters| {
        FsoeSlave::new(&FsoeConfig {
            output_length: 2,
            input_length: 2,
            address,
            session_id: 0,
            application_parameters,
            watchdog_ms,
        })
        .err()
    };
    assert_eq!(config(0, (1, 2), &[]), Some(ConfigFault::Address));
    assert_eq!(config(1, (0, 2), &[]), Some(ConfigFault::WatchdogLimits));
    assert_eq!(config(1, (3, 2), &[]), Some(ConfigFault::WatchdogLimits));
    let too_long = Some(ConfigFault::ApplicationParameterLength);
    assert_eq!(config(1, (1, 2), &[0; 1025]), too_long);
    assert_eq!(config(1, (1, 2), &[0; 1024]), None);
}

/// black-channel.md 2.6: number of master frames up to the first Data frame,
/// Reset included.
#[test]
fn the_handshake_has_the_catalogued_length() {
    for (chunk, expected) in [(1, 14), (2, 8), (4, 6), (6, 5), (12, 5)] {
        let bench = Bench::new(chunk, 12, &[]);
        let parts = |payload: &[u8]| bench.chunks(payload).len();
        let frames = 2 + parts(&[0; 2]) + parts(&bench.conn_data.clone()) + parts(&bench.parameters.clone());
        assert_eq!(frames, expected);
    }
}

/// Design 10: later sessions use the session id + 1 each.
#[test]
fn each_session_has_a_fresh_id() {
    for chunk in [1, 2] {
        let mut bench = Bench::new(chunk, 2, &[]);
        for (turn, master) in [(0x0102, 1), (0x0103, 2), (0x0104, 3)] {
            bench.raw(&reset_frame(usize::from(chunk), 0));
            assert_eq!(bench.session(master), turn);
            assert_eq!(bench.slave.session_id(), turn);
        }
    }
}

/// black-channel.md 2.6: 65535 is followed by 0, because ids only have to
/// differ.
#[test]
fn session_ids_wrap() {
    let mut bench = Bench::new(2, 2, &[]);
    bench.slave.next_session_id = u16::MAX;
    assert_eq!(bench.session(1), u16::MAX);
    bench.raw(&reset_frame(2, 0));
    assert_eq!(bench.session(2), 0);
}

/// black-channel.md 2.7: the parameter signature, low octet first, is the
/// first application parameter.
#[test]
fn the_parameter_signature_is_checked() {
    let signature = parameter_signature(b"123456789").to_le_bytes();
    assert_eq!(signature, [0x7F, 0xBF, 0x10, 0x30]);
    let mut bench = Bench::new(4, 12, &signature);
    bench.reach(State::Data);
    for octet in 0..4 {
        let mut bench = Bench::new(4, 12, &signature);
        bench.parameters[6 + octet] ^= 1;
        bench.reach(State::Parameter);
        let answer = bench.chained(CONN_ID, command::FAIL_SAFE_DATA, &[]);
        bench.expect_reset(&answer, 11);
    }
}

fn parameter_fault(chunk: u8, application: &[u8], parameters: &[u8]) -> u8 {
    let mut bench = Bench::new(chunk, 12, application);
    bench.parameters = parameters.to_vec();
    bench.reach(State::Parameter);
    let answer = bench.chained(CONN_ID, command::PROCESS_DATA, &[]);
    bench.expect_reset(&answer, answer[1]);
    answer[1]
}

/// black-channel.md 3.4: content faults show at the first Data frame, in the
/// order 8, 9, 10, 11.
#[test]
fn parameter_faults_have_their_codes_in_order() {
    for chunk in [1, 2, 4, 12] {
        let fault = |parameters: &[u8]| parameter_fault(chunk, &[9], parameters);
        assert_eq!(fault(&[3, 0, 0, 0, 2, 0, 8]), 8);
        assert_eq!(fault(&[2, 1, 100, 0, 1, 0, 9]), 8);
        assert_eq!(fault(&[2, 0, 0, 0, 2, 0, 8]), 9);
        assert_eq!(fault(&[2, 0, 100, 0, 2, 0, 8]), 10);
        assert_eq!(fault(&[2, 0, 100, 0, 0, 0, 9]), 10);
        assert_eq!(fault(&[2, 0, 100, 0, 1, 0, 8]), 11);
    }
}

/// black-channel.md 3.4: a length error that changes the number of chunks
/// shows as code 1.
#[test]
fn a_wrong_number_of_chunks_is_a_command_out_of_place() {
    let mut bench = Bench::new(2, 2, &[1, 2, 3, 4]);
    bench.parameters = vec![2, 0, 100, 0, 2, 0, 1, 2];
    bench.reach(State::Parameter);
    let answer = bench.chained(CONN_ID, command::FAIL_SAFE_DATA, &[]);
    bench.expect_reset(&answer, 1);

    let mut bench = Bench::new(2, 2, &[]);
    bench.reach(State::Parameter);
    let answer = bench.chained(CONN_ID, command::PARAMETER, &[1, 2]);
    bench.expect_reset(&answer, 1);
}

/// Design 10: watchdogs of 1 to 65,535 ms are accepted, unless the
/// configuration says otherwise.
#[test]
fn watchdog_limits_are_inclusive() {
    let accepts = |watchdog_ms: u16, limits| {
        let mut bench = Bench::new(12, 12, &[]);
        bench.slave.expected = super::super::parameters::Expected::new(&[], limits).unwrap();
        bench.parameters[2..4].copy_from_slice(&watchdog_ms.to_le_bytes());
        bench.reach(State::Parameter);
        bench.chained(CONN_ID, command::FAIL_SAFE_DATA, &[]);
        bench.slave.state() == State::Data
    };
    for limit in [1, u16::MAX] {
        assert!(accepts(limit, (1, u16::MAX)));
    }
    assert!(!accepts(0, (1, u16::MAX)));
    assert!(!accepts(9, (10, 20)));
    assert!(accepts(10, (10, 20)));
    assert!(accepts(20, (10, 20)));
    assert!(!accepts(21, (10, 20)));
}

/// black-channel.md 2.6: only the chunk is echoed, the rest is zero.
#[test]
fn octets_behind_the_payload_are_not_echoed() {
    let mut bench = Bench::new(6, 8, &[]);
    bench.reach(State::Session);
    let mut payload = bench.conn_data.clone();
    payload.extend([0xEE, 0xEE]);
    let echo = bench.exchange(CONN_ID, command::CONNECTION, &payload);
    assert_eq!(echo, [0x34, 0x12, 0x05, 0x03, 0, 0, 0, 0]);
}
