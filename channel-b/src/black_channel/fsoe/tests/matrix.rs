//! Every cell of the state matrix (black-channel 3.4).

use super::std::vec::Vec;

use super::super::check::Link;
use super::super::{Config, ResetCode};
use super::master::{Master, Place};
use super::{State, brought_to, config, is_reset_with, receive};

/// What a cell asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cell {
    Silent,
    /// Reset with this code.
    R(u8),
    /// An answer with the command of the frame.
    Same(State),
    /// An answer with fail-safe data.
    FailSafe,
}
use Cell::{FailSafe, R, Same, Silent};
use State::{Connection, Parameter, Session};

/// Columns: Reset, Session (chained), Connection, Parameter, ProcessData,
/// FailSafeData, unknown, command 0. All frames with a right chain.
const COMMANDS: [u8; 8] = [0x2A, 0x4E, 0x64, 0x52, 0x36, 0x08, 0x77, 0x00];

const MATRIX: [(Place, [Cell; 8]); 8] = [
    (Place::Reset, [R(0), Same(Session), R(1), R(1), R(1), R(1), R(2), Silent]),
    (Place::SessionPart, [R(0), Same(Session), R(1), R(1), R(1), R(1), R(2), R(2)]),
    (Place::Session, [R(0), R(1), Same(Connection), R(1), R(1), R(1), R(2), R(2)]),
    (Place::ConnectionPart, [R(0), R(1), Same(Connection), R(1), R(1), R(1), R(2), R(2)]),
    (Place::Connection, [R(0), R(1), R(1), Same(Parameter), R(1), R(1), R(2), R(2)]),
    (Place::ParameterPart, [R(0), R(1), R(1), Same(Parameter), R(1), R(1), R(2), R(2)]),
    (Place::Parameter, [R(0), R(1), R(1), R(1), FailSafe, FailSafe, R(2), R(2)]),
    (Place::Data, [R(0), R(1), R(1), R(1), FailSafe, FailSafe, R(2), R(2)]),
];

/// Decision on black-channel 3.4: command and completeness before check sum.
#[test]
fn a_session_frame_that_is_not_fresh_is_an_invalid_command_once_the_ids_are_complete() {
    for place in Place::ALL {
        let expected = match place {
            Place::Reset | Place::SessionPart => 4,
            _ => 1,
        };
        let (slave, master) = brought_to(&config(1, 1), place);
        let second = Link { number: 2, ..Link::ORIGIN };
        let inheriting = Link { inherited: 0x1234, ..Link::ORIGIN };
        let identified = Link { connection_id: 0x1234, ..Link::ORIGIN };
        let spoilt_fresh = spoilt(master.frame(0x4E, Link::ORIGIN, &[0x77]));
        let chains = [second, inheriting, identified].map(|link| master.frame(0x4E, link, &[0x77]));
        for frame in chains.into_iter().chain([spoilt_fresh]) {
            let mut slave = slave;
            let answer = receive(&mut slave, &frame, 0, None);
            assert!(is_reset_with(&answer, expected), "{place:?}: {answer:02X?}");
            assert_eq!((slave.state(), slave.outputs()), (State::Reset, &[0][..]));
        }
    }
}

/// The payload that the hand-shake would send next with `command`.
fn payload(master: &Master, command: u8, place: Place) -> Vec<u8> {
    let skip = match place {
        Place::SessionPart | Place::ConnectionPart | Place::ParameterPart => 1,
        _ => 0,
    };
    let mut pieces = master.handshake().into_iter().filter(|(of, _)| *of == command);
    pieces.nth(skip).map_or(Vec::new(), |(_, piece)| piece)
}

fn check_cell(place: Place, command: u8, cell: Cell) {
    let config = config(1, 1);
    let (mut slave, mut master) = brought_to(&config, place);
    let frame = match command {
        0x2A => master.reset(9), // its code is acknowledged with 0 like any
        _ => master.next(command, &payload(&master, command, place)),
    };
    let answer = receive(&mut slave, &frame, 0, None);
    let context = (place, command);
    match cell {
        Silent => assert!(answer.is_empty(), "{context:?}"),
        R(code) => {
            assert!(is_reset_with(&answer, code), "{context:?}: {answer:02X?}");
            assert_eq!(slave.state(), State::Reset);
        }
        Same(state) => {
            assert_eq!((answer[0], slave.state()), (command, state), "{context:?}");
            master.accept(&answer);
        }
        FailSafe => {
            assert_eq!((answer[0], slave.state()), (0x08, State::Data), "{context:?}");
            master.accept(&answer);
        }
    }
}

#[test]
fn every_cell_answers_as_the_matrix_says() {
    for (place, row) in MATRIX {
        for (command, cell) in COMMANDS.into_iter().zip(row) {
            check_cell(place, command, cell);
        }
    }
}

/// Mark M: restart rather than refuse; outputs fail-safe at once.
#[test]
fn a_fresh_session_frame_restarts_the_session_from_every_state() {
    for place in Place::ALL {
        let config = config(1, 1);
        let (mut slave, _) = brought_to(&config, place);
        let id = slave.session_id();
        let mut fresh = Master::new(&config);
        let answer = receive(&mut slave, &fresh.next(0x4E, &[0x77]), 0, None);
        assert_eq!((answer[0], slave.state()), (0x4E, State::Session), "{place:?}");
        fresh.accept(&answer);
        let expected = if place == Place::Reset { config.session_id } else { id + 1 };
        assert_eq!(slave.session_id(), expected);
        assert_eq!(slave.outputs(), [0]);
        assert!(!slave.has_process_data());
    }
}

/// The frame with one bit of CRC_0 wrong.
fn spoilt(mut frame: Vec<u8>) -> Vec<u8> {
    frame[2] ^= 0x40;
    frame
}

#[test]
fn a_wrong_check_sum_is_found_after_all_other_faults() {
    // Row by row: the code for a broken chain, where the matrix has no other.
    for (place, row) in MATRIX {
        for (command, cell) in COMMANDS.into_iter().zip(row) {
            let (mut slave, mut master) = brought_to(&config(1, 1), place);
            let frame = match command {
                0x2A => master.reset(0),
                _ => master.next(command, &payload(&master, command, place)),
            };
            let answer = receive(&mut slave, &spoilt(frame), 0, None);
            let is_reset_in_reset = (place, command) == (Place::Reset, 0x2A);
            let expected = match cell {
                Silent => continue,
                R(0) if is_reset_in_reset => 0,
                R(0) | Same(_) | FailSafe => 4,
                R(code) => code,
            };
            assert!(is_reset_with(&answer, expected), "{place:?} {command:02X} {answer:02X?}");
        }
    }
}

#[test]
fn a_wrong_connection_id_is_named_before_a_wrong_check_sum() {
    let cells = [
        (Place::ConnectionPart, 0x64),
        (Place::Connection, 0x52),
        (Place::ParameterPart, 0x52),
        (Place::Parameter, 0x36),
        (Place::Parameter, 0x08),
        (Place::Data, 0x36),
        (Place::Data, 0x08),
    ];
    for (place, command) in cells {
        for is_spoilt in [false, true] {
            let (mut slave, mut master) = brought_to(&config(1, 1), place);
            let piece = payload(&master, command, place);
            master.connection_id = 0x4321;
            let frame = master.next(command, &piece);
            let frame = if is_spoilt { spoilt(frame) } else { frame };
            assert!(is_reset_with(&receive(&mut slave, &frame, 0, None), 3), "{place:?}");
        }
    }
}

#[test]
fn connection_id_zero_is_refused() {
    let (mut slave, mut master) = brought_to(&config(4, 4), Place::Session);
    master.connection_id = 0;
    let frame = master.next(0x64, &[0, 0, 5, 0]);
    assert!(is_reset_with(&receive(&mut slave, &frame, 0, None), 3));
}

/// The Connection frame itself is echoed; its faults show at the Parameter frame.
#[test]
fn faults_of_the_connection_data_show_at_the_first_parameter_frame() {
    let cases = [([0x35, 0x12, 5, 0], 3), ([0x34, 0x12, 6, 0], 6), ([0x35, 0x12, 6, 0], 3)];
    for (connection_data, code) in cases {
        let (mut slave, mut master) = brought_to(&config(4, 4), Place::Session);
        let answer = receive(&mut slave, &master.next(0x64, &connection_data), 0, None);
        assert_eq!(answer[0], 0x64);
        master.accept(&answer);
        let frame = master.next(0x52, &[2, 0, 100, 0]);
        assert!(is_reset_with(&receive(&mut slave, &frame, 0, None), code));
    }
}

/// Brings a slave of 6/6 octets through a hand-shake changed by `change`, then
/// sends process data, perhaps spoilt.
fn first_data(config: &Config<'_>, change: Change, is_spoilt: bool) -> Vec<u8> {
    let (mut slave, mut master) = brought_to(config, Place::Reset);
    change(&mut master);
    for (command, piece) in master.handshake() {
        let answer = receive(&mut slave, &master.next(command, &piece), 0, None);
        assert_eq!(answer[0], command, "parameter faults show at the first data frame");
        master.accept(&answer);
    }
    let mut frame = master.next(0x36, &[1]);
    frame[3] ^= u8::from(is_spoilt);
    receive(&mut slave, &frame, 0, None)
}

type Change = fn(&mut Master);

/// Marks H and M: length 8, watchdog 9, application length 10, content 11.
#[test]
fn parameter_faults_are_named_in_the_order_of_their_codes() {
    let application_parameters = &[0xA1, 0xB2, 0xC3, 0xD4, 0xE5];
    let config = Config { application_parameters, watchdog_ms: (10, 500), ..config(6, 6) };
    let changes: [(Change, ResetCode); 9] = [
        (|m| m.communication_length = 3, ResetCode::InvalidCommunicationLength),
        (|m| m.watchdog_ms = 0, ResetCode::InvalidCommunicationParameter),
        (|m| m.watchdog_ms = 9, ResetCode::InvalidCommunicationParameter),
        (|m| m.watchdog_ms = 501, ResetCode::InvalidCommunicationParameter),
        (|m| m.application_length = 4, ResetCode::InvalidApplicationLength),
        (|m| m.application[0] ^= 1, ResetCode::InvalidApplicationParameter),
        (|m| m.application[4] ^= 1, ResetCode::InvalidApplicationParameter),
        (
            |m| {
                (m.communication_length, m.watchdog_ms, m.application_length) = (0, 0, 0);
            },
            ResetCode::InvalidCommunicationLength,
        ),
        (
            |m| {
                (m.watchdog_ms, m.application_length) = (0, 0);
            },
            ResetCode::InvalidCommunicationParameter,
        ),
    ];
    for (change, code) in changes {
        for is_spoilt in [false, true] {
            assert!(is_reset_with(&first_data(&config, change, is_spoilt), code.octet()), "{code:?}");
        }
    }
    for change in [|m: &mut Master| m.watchdog_ms = 10, |m: &mut Master| m.watchdog_ms = 500] {
        assert_eq!(first_data(&config, change, false)[0], 0x08);
        assert!(is_reset_with(&first_data(&config, change, true), 4));
    }
}

#[test]
fn watchdog_zero_is_refused_even_if_the_limits_allow_it() {
    let config = Config { watchdog_ms: (0, 65_535), ..config(6, 6) };
    assert!(is_reset_with(&first_data(&config, |m| m.watchdog_ms = 0, false), 9));
    assert_eq!(first_data(&config, |m| m.watchdog_ms = 1, false)[0], 0x08);
    assert_eq!(first_data(&config, |m| m.watchdog_ms = 65_535, false)[0], 0x08);
}

/// Mark H: a length that changes the number of frames gives 1 instead of 10.
#[test]
fn a_missing_or_additional_parameter_frame_is_an_invalid_command() {
    let config = Config { application_parameters: &[1, 2, 3, 4], ..config(2, 2) };
    let (mut slave, mut master) = brought_to(&config, Place::ParameterPart);
    assert!(is_reset_with(&receive(&mut slave, &master.next(0x36, &[1, 2]), 0, None), 1));
    let (mut slave, mut master) = brought_to(&config, Place::Parameter);
    assert!(is_reset_with(&receive(&mut slave, &master.next(0x52, &[1, 2]), 0, None), 1));
}

#[test]
fn reset_and_session_frames_with_a_connection_id_are_refused() {
    let (mut slave, master) = brought_to(&config(1, 1), Place::Data);
    let link = Link { connection_id: 0x1234, ..Link::ORIGIN };
    for (command, code) in [(0x2A, 4), (0x4E, 1)] {
        let mut slave = slave;
        let frame = master.frame(command, link, &[0]);
        assert!(is_reset_with(&receive(&mut slave, &frame, 0, None), code));
    }
    let frame = master.frame(0x2A, Link::ORIGIN, &[0]);
    assert!(is_reset_with(&receive(&mut slave, &frame, 0, None), 0));
}
