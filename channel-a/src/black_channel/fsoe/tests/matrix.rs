//! Every cell of black-channel.md 3.4, with right and with wrong check sums.

use super::*;

const STATES: [State; 5] = [State::Reset, State::Session, State::Connection, State::Parameter, State::Data];
const COMMANDS: [u8; 7] = [
    command::RESET,
    command::SESSION,
    command::CONNECTION,
    command::PARAMETER,
    command::PROCESS_DATA,
    command::FAIL_SAFE_DATA,
    0x77,
];

/// What a cell answers: a reset code, or the command of the answer.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Answers {
    Reset(u8),
    With(u8),
}
use Answers::{Reset, With};

fn answers(frame: &[u8]) -> Answers {
    match frame[0] {
        command::RESET => Reset(frame[1]),
        command => With(command),
    }
}

/// Rows as STATES, payload of the state complete; columns as COMMANDS; every
/// frame chained, with the connection's id.
const COMPLETE: [[Answers; 7]; 5] = [
    [Reset(0), With(command::SESSION), Reset(1), Reset(1), Reset(1), Reset(1), Reset(2)],
    [Reset(4), Reset(1), With(command::CONNECTION), Reset(1), Reset(1), Reset(1), Reset(2)],
    [Reset(4), Reset(1), Reset(1), With(command::PARAMETER), Reset(1), Reset(1), Reset(2)],
    [
        Reset(4),
        Reset(1),
        Reset(1),
        Reset(1),
        With(command::FAIL_SAFE_DATA),
        With(command::FAIL_SAFE_DATA),
        Reset(2),
    ],
    [
        Reset(4),
        Reset(1),
        Reset(1),
        Reset(1),
        With(command::FAIL_SAFE_DATA),
        With(command::FAIL_SAFE_DATA),
        Reset(2),
    ],
];

fn conn_id_of(state: State, command: u8) -> u16 {
    let without = matches!(command, command::RESET | command::SESSION);
    if without || state == State::Reset { 0 } else { CONN_ID }
}

#[test]
fn each_cell_answers_as_catalogued_when_the_payload_is_complete() {
    for (state, row) in STATES.into_iter().zip(COMPLETE) {
        for (command, expected) in COMMANDS.into_iter().zip(row) {
            let mut bench = Bench::new(4, 4, &[]);
            bench.reach(state);
            let conn_id = conn_id_of(state, command);
            let answer = bench.chained(conn_id, command, &[0x34, 0x12, 5, 3]);
            assert_eq!(answers(&answer), expected, "{state:?} {command:02X}");
        }
    }
}

/// Leaves the state's payload one part short of complete.
fn reach_incomplete(bench: &mut Bench, state: State) {
    match state {
        State::Session => {
            bench.exchange(0, command::SESSION, &[7]);
        }
        State::Connection => {
            bench.session(7);
            bench.exchange(CONN_ID, command::CONNECTION, &[0x34]);
        }
        State::Parameter => {
            bench.session(7);
            bench.connection();
            bench.exchange(CONN_ID, command::PARAMETER, &[2]);
        }
        State::Reset | State::Data => bench.reach(state),
    }
    assert_eq!(bench.slave.state(), state);
}

/// Completeness is judged before connection id and check sum: even a frame
/// that is wrong in both answers 1.
#[test]
fn an_incomplete_payload_lets_only_its_own_command_pass() {
    let own = [
        (State::Session, command::SESSION),
        (State::Connection, command::CONNECTION),
        (State::Parameter, command::PARAMETER),
    ];
    for (state, own) in own {
        for command in COMMANDS {
            let mut bench = Bench::new(1, 1, &[]);
            reach_incomplete(&mut bench, state);
            let conn_id = conn_id_of(state, command);
            let answer = bench.chained(conn_id, command, &[0x12]);
            let expected = match command {
                command::RESET => Reset(4),
                0x77 => Reset(2),
                _ if command == own => With(own),
                _ => Reset(1),
            };
            assert_eq!(answers(&answer), expected, "{state:?} {command:02X}");
            if expected == Reset(1) && command != command::SESSION {
                let mut bench = Bench::new(1, 1, &[]);
                reach_incomplete(&mut bench, state);
                let answer = bench.raw(&build(1, 0, 9, command, &[1])).unwrap();
                assert_eq!(answers(&answer), expected, "{state:?} {command:02X}");
            }
        }
    }
}

/// Every command that could be right in its state answers 4 when its check
/// sum is not, in the first, in the last block, and by the wrong number.
#[test]
fn a_broken_chain_answers_four() {
    for (state, command) in [
        (State::Reset, command::SESSION),
        (State::Session, command::RESET),
        (State::Session, command::CONNECTION),
        (State::Connection, command::RESET),
        (State::Connection, command::PARAMETER),
        (State::Parameter, command::RESET),
        (State::Parameter, command::PROCESS_DATA),
        (State::Parameter, command::FAIL_SAFE_DATA),
        (State::Data, command::RESET),
        (State::Data, command::PROCESS_DATA),
        (State::Data, command::FAIL_SAFE_DATA),
    ] {
        for place in [3, 8] {
            let mut bench = Bench::new(4, 4, &[]);
            bench.reach(state);
            let conn_id = conn_id_of(state, command);
            let mut frame = bench.master.chained(conn_id, command, &[1, 2, 3, 4]);
            frame[place] ^= 0x10;
            let answer = bench.raw(&frame).unwrap();
            bench.expect_reset(&answer, 4);
        }
    }
}

/// Further chunks of an unfinished payload are chained too.
#[test]
fn a_broken_chunk_answers_four_or_three() {
    for (state, command) in [
        (State::Session, command::SESSION),
        (State::Connection, command::CONNECTION),
        (State::Parameter, command::PARAMETER),
    ] {
        let mut bench = Bench::new(1, 1, &[]);
        reach_incomplete(&mut bench, state);
        let conn_id = conn_id_of(state, command);
        let mut frame = bench.master.chained(conn_id, command, &[0x12]);
        frame[2] ^= 1;
        let answer = bench.raw(&frame).unwrap();
        bench.expect_reset(&answer, 4);
        // A Session frame has no connection id to be wrong in: its chain is.
        let mut bench = Bench::new(1, 1, &[]);
        reach_incomplete(&mut bench, state);
        let answer = bench.chained(0x4321, command, &[0x12]);
        let code = if command == command::SESSION { 4 } else { 3 };
        bench.expect_reset(&answer, code);
    }
}

/// A Reset frame is acknowledged with 0 in every state, whatever its code.
#[test]
fn a_reset_is_acknowledged_in_every_state() {
    for state in STATES {
        for code in [0, 5, 0x80] {
            let mut bench = Bench::new(4, 6, &[]);
            bench.reach(state);
            let answer = bench.raw(&reset_frame(4, code)).unwrap();
            bench.expect_reset(&answer, 0);
        }
    }
}

/// State Reset does not check the sums of a Reset frame.
#[test]
fn a_broken_reset_is_acknowledged_in_state_reset_only() {
    let mut broken = reset_frame(4, 0);
    broken[3] ^= 1;
    let mut bench = Bench::new(4, 4, &[]);
    let answer = bench.raw(&broken).unwrap();
    bench.expect_reset(&answer, 0);
    let mut with_conn_id = reset_frame(4, 0);
    with_conn_id[9] = 1;
    for state in &STATES[1..] {
        for frame in [&broken, &with_conn_id] {
            let mut bench = Bench::new(4, 4, &[]);
            bench.reach(*state);
            let answer = bench.raw(frame).unwrap();
            bench.expect_reset(&answer, 4);
        }
    }
}

/// Mark M in Connection, Parameter and Data: a fresh Session restarts.
#[test]
fn a_fresh_session_restarts_in_every_state() {
    for state in STATES {
        let mut bench = Bench::new(4, 4, &[]);
        bench.reach(state);
        let expected = bench.slave.next_session_id;
        assert_eq!(bench.session(0x5555), expected);
        assert_eq!(bench.slave.state(), State::Session);
        assert_eq!(bench.slave.outputs(), [0; 4]);
        bench.connection();
        bench.parameter();
        bench.exchange(CONN_ID, command::FAIL_SAFE_DATA, &[]);
    }
}

/// The same while the session ids are not complete.
#[test]
fn a_fresh_session_restarts_an_unfinished_one() {
    let mut bench = Bench::new(1, 1, &[]);
    bench.exchange(0, command::SESSION, &[7]);
    assert_eq!(bench.session(0x0908), 0x0103);
    bench.connection();
}

/// Session and Connection: connection id 0, another one, another one inside.
#[test]
fn wrong_connection_ids_answer_three() {
    let mut bench = Bench::new(4, 4, &[]);
    bench.reach(State::Session);
    let answer = bench.chained(0, command::CONNECTION, &[0, 0, 5, 3]);
    bench.expect_reset(&answer, 3);
    for (state, command) in [
        (State::Connection, command::PARAMETER),
        (State::Parameter, command::PROCESS_DATA),
        (State::Parameter, command::FAIL_SAFE_DATA),
        (State::Data, command::PROCESS_DATA),
        (State::Data, command::FAIL_SAFE_DATA),
    ] {
        for conn_id in [0, 0x4321] {
            let mut bench = Bench::new(4, 4, &[]);
            bench.reach(state);
            let answer = bench.chained(conn_id, command, &[2, 0, 100, 0]);
            bench.expect_reset(&answer, 3);
        }
    }
}

/// Shows only at the first Parameter frame; the Connection frame is echoed.
#[test]
fn wrong_connection_data_answer_three_or_six() {
    for (data, code) in [
        ([0x35, 0x12, 0x05, 0x03], 3),
        ([0x34, 0x12, 0x06, 0x03], 6),
        ([0x34, 0x12, 0x05, 0x02], 6),
        ([0x35, 0x12, 0x06, 0x03], 3),
    ] {
        for length in [1, 2, 4, 6] {
            let mut bench = Bench::new(length, 12, &[]);
            bench.conn_data = data.to_vec();
            bench.reach(State::Connection);
            let answer = bench.chained(CONN_ID, command::PARAMETER, &[2]);
            bench.expect_reset(&answer, code);
        }
    }
}

/// Order of checks: connection id before check sum, content before check sum.
#[test]
fn the_first_failing_check_decides() {
    let mut bench = Bench::new(4, 4, &[]);
    bench.reach(State::Data);
    let answer = bench.raw(&build(1, 0x4321, 1, command::PROCESS_DATA, &[0; 4]));
    bench.expect_reset(&answer.unwrap(), 3);

    let mut bench = Bench::new(4, 4, &[]);
    bench.parameters[0] = 3;
    bench.reach(State::Parameter);
    let answer = bench.raw(&build(1, CONN_ID, 1, command::PROCESS_DATA, &[0; 4]));
    bench.expect_reset(&answer.unwrap(), 8);

    let mut bench = Bench::new(4, 4, &[]);
    bench.conn_data[2] ^= 1;
    bench.reach(State::Connection);
    let answer = bench.raw(&build(1, CONN_ID, 1, command::PARAMETER, &[0; 4]));
    bench.expect_reset(&answer.unwrap(), 6);
}
