//! Watchdog, collision rule, number wrap, images, noise.

use super::super::chain::Chain;
use super::*;
use crate::black_channel::ResetCode;

fn in_data() -> Bench {
    let mut bench = Bench::new(2, 2, &[]);
    bench.reach(State::Parameter);
    bench.exchange(CONN_ID, command::FAIL_SAFE_DATA, &[]);
    bench
}

/// black-channel.md 3.6, AMK-FSOE-06: 99 ms is fine, 100 ms is not.
#[test]
fn the_watchdog_expires_at_its_value() {
    let mut bench = in_data();
    assert_eq!(bench.slave.advance(99 * MS), None);
    assert_eq!(bench.slave.advance(100 * MS - 1), None);
    let answer = bench.slave.advance(100 * MS).unwrap();
    bench.expect_reset(answer.octets(), 5);
    assert_eq!(bench.slave.advance(500 * MS), None, "only once");
}

/// black-channel.md 3.6: a correct frame that is late answers 5, too.
#[test]
fn a_late_frame_expires_the_watchdog() {
    for (now_ms, expired) in [(99, false), (100, true), (5000, true)] {
        let mut bench = in_data();
        bench.now_ns = now_ms * MS;
        let answer = bench.chained(CONN_ID, command::PROCESS_DATA, &[1, 2]);
        if expired {
            bench.expect_reset(&answer, 5);
        } else {
            assert_eq!(bench.slave.outputs(), [1, 2]);
        }
    }
}

/// black-channel.md 3.6, 3.2: accepted frames restart it, repeated images do
/// not.
#[test]
fn only_new_frames_restart_the_watchdog() {
    let mut bench = in_data();
    for turn in 1..10 {
        bench.now_ns = turn * 99 * MS;
        bench.exchange(CONN_ID, command::FAIL_SAFE_DATA, &[]);
    }
    let last_ns = bench.now_ns;
    let frame = bench.master.chained(CONN_ID, command::PROCESS_DATA, &[1, 2]);
    assert!(bench.raw(&frame).is_some());
    for elapsed_ms in 1..100 {
        bench.now_ns = last_ns + elapsed_ms * MS;
        assert_eq!(bench.raw(&frame), None);
    }
    bench.now_ns = last_ns + 100 * MS;
    let answer = bench.raw(&frame).unwrap();
    bench.expect_reset(&answer, 5);
}

/// black-channel.md 3.6: before Data the slave waits for ever.
#[test]
fn no_watchdog_runs_before_data() {
    for state in [State::Reset, State::Session, State::Connection, State::Parameter] {
        let mut bench = Bench::new(2, 2, &[]);
        bench.reach(state);
        assert_eq!(bench.slave.advance(u64::MAX), None);
        assert_eq!(bench.slave.state(), state);
    }
}

/// Where sources are silent: a clock that runs backwards is no clock.
#[test]
fn time_running_backwards_expires_the_watchdog() {
    let mut bench = Bench::new(2, 2, &[]);
    bench.now_ns = 5 * MS;
    bench.reach(State::Data);
    let answer = bench.slave.advance(4 * MS).unwrap();
    bench.expect_reset(answer.octets(), 5);
}

/// black-channel.md 2.5: 65535 is followed by 1, in both directions.
#[test]
fn numbers_wrap_to_one() {
    let mut bench = in_data();
    bench.slave.chain.set_numbers(u16::MAX - 2, u16::MAX - 1);
    bench.master.send.0 = u16::MAX - 2;
    bench.master.receive.0 = u16::MAX - 1;
    for turn in 0..6 {
        bench.exchange(CONN_ID, command::FAIL_SAFE_DATA, &[turn, 0]);
    }
    assert!(bench.master.send.0 < 10);
    assert!(bench.master.receive.0 < 10);
}

/// black-channel.md 2.5: a long session meets natural collisions in both
/// directions, and the chain survives them and the wrap.
#[test]
fn the_collision_rule_holds_the_chain() {
    let mut bench = in_data();
    let (mut sent, mut received) = (0_u32, 0_u32);
    for turn in 0..250_000_u32 {
        let (send, receive) = (bench.master.send.0, bench.master.receive.0);
        let octet = (turn.wrapping_mul(2_654_435_761) >> 24) as u8;
        bench.exchange(CONN_ID, command::FAIL_SAFE_DATA, &[octet, 0]);
        sent += u32::from(bench.master.send.0 != next(send));
        received += u32::from(bench.master.receive.0 != next(receive));
    }
    assert!(sent > 0, "no collision of the master's frames met");
    assert!(received > 0, "no collision of the slave's frames met");
}

/// The same rule, constructed: data that collide with the frame before.
#[test]
fn a_constructed_collision_advances_the_number() {
    let mut bench = in_data();
    let (number, previous) = bench.master.send;
    let inherited = bench.master.inherited;
    let colliding = (0..=u16::MAX).map(u16::to_le_bytes).find(|data| {
        let frame = build(inherited, CONN_ID, number, command::PROCESS_DATA, data);
        crc_0(&frame) == previous
    });
    let data = colliding.unwrap();
    let unadvanced = build(inherited, CONN_ID, number, command::PROCESS_DATA, &data);
    let mut wrong = in_data();
    let answer = wrong.raw(&unadvanced).unwrap();
    wrong.expect_reset(&answer, 4);
    let answer = bench.chained(CONN_ID, command::PROCESS_DATA, &data);
    assert_eq!(bench.master.send.0, number + 2);
    bench.master.receive(&answer);
    assert_eq!(bench.slave.outputs(), data);
}

/// black-channel.md 2.5: the rule holds for the slave's Session answer, too,
/// against a memory of 0.
#[test]
fn the_session_answer_never_has_check_sum_zero() {
    let mut met = 0;
    for id in 0..=u16::MAX {
        let mut bench = Bench::new(2, 2, &[]);
        bench.slave.next_session_id = id;
        bench.session(0x0102);
        met += u32::from(bench.master.receive.0 == 3);
    }
    assert_eq!(met, 1);
}

/// black-channel.md 3.2.
#[test]
fn an_image_without_command_is_ignored_in_reset_only() {
    let mut bench = Bench::new(2, 2, &[]);
    assert_eq!(bench.raw(&[0; 7]), None);
    assert_eq!(bench.raw(&[0, 1, 2, 3, 4, 5, 6]), None);
    bench.reach(State::Session);
    let answer = bench.raw(&[0; 7]).unwrap();
    bench.expect_reset(&answer, 2);
}

/// black-channel.md 3.2: an image is an event when it differs from the last.
#[test]
fn the_same_frame_after_another_image_is_an_event() {
    let mut bench = Bench::new(2, 2, &[]);
    let reset = reset_frame(2, 0);
    assert!(bench.raw(&reset).is_some());
    assert_eq!(bench.raw(&reset), None);
    assert_eq!(bench.raw(&[0; 7]), None);
    assert!(bench.raw(&reset).is_some());
}

/// black-channel.md 3.5: directions are independent, fail-safe data are zeros.
#[test]
fn fail_safe_data_keep_the_connection_and_clear_the_outputs() {
    let mut bench = in_data();
    bench.chained(CONN_ID, command::PROCESS_DATA, &[3, 4]);
    let answer = bench.raw(&[0; 7]);
    bench.expect_reset(&answer.unwrap(), 2);

    let mut bench = in_data();
    let answer = bench.exchange_any(CONN_ID, command::PROCESS_DATA, &[3, 4]);
    assert_eq!((answer.0, answer.1), (command::FAIL_SAFE_DATA, vec![0, 0]));
    assert_eq!(bench.slave.outputs(), [3, 4]);
    bench.inputs = Some(vec![8, 9]);
    let answer = bench.exchange_any(CONN_ID, command::FAIL_SAFE_DATA, &[5, 6]);
    assert_eq!((answer.0, answer.1), (command::PROCESS_DATA, vec![8, 9]));
    assert_eq!(bench.slave.outputs(), [0, 0]);
    bench.inputs = Some(vec![8]);
    let answer = bench.exchange_any(CONN_ID, command::PROCESS_DATA, &[5, 6]);
    assert_eq!(answer.0, command::FAIL_SAFE_DATA, "inputs of a wrong length");
}

/// black-channel.md 3.7.
#[test]
fn a_local_reset_is_sent_in_any_state() {
    for state in [State::Reset, State::Session, State::Data] {
        let mut bench = Bench::new(2, 2, &[]);
        bench.reach(state);
        let answer = bench.slave.local_reset();
        bench.expect_reset(answer.octets(), 0);
        bench.raw(&reset_frame(2, 0));
        bench.reach(State::Data);
    }
}

/// Design 3.2: no input makes the slave do anything but answer or stay silent,
/// and noise never reaches the outputs.
#[test]
fn noise_never_reaches_the_outputs() {
    let mut seed = 0x2545_F491_4F6C_DD1D_u64;
    let mut random = move || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed
    };
    for length in [1, 2, 12, 126] {
        let mut bench = Bench::new(length, length, &[1, 2, 3]);
        for turn in 0..2_000_u64 {
            let mut frame: Vec<u8> = (0..frame_length(usize::from(length))).map(|_| random() as u8).collect();
            frame[0] = [0x36, 0x2A, 0x4E, 0x64, 0x52, 0x08, 0][(random() % 7) as usize];
            bench.now_ns = turn * MS;
            bench.raw(&frame);
            assert!(!bench.slave.outputs_valid());
            assert!(bench.slave.outputs().iter().all(|octet| *octet == 0));
        }
    }
}

/// Design 9: the digest tells the other channel which frame was processed.
#[test]
fn the_digest_is_that_of_the_last_image() {
    let mut bench = Bench::new(2, 2, &[]);
    assert_eq!(bench.slave.digest(), 0);
    let frame = reset_frame(2, 0);
    bench.raw(&frame);
    let digest = crate::black_channel::frame_digest(&frame);
    assert_eq!(bench.slave.digest(), digest);
}

/// black-channel.md 3.3: a fault leaves nothing of the connection behind.
#[test]
fn a_fault_forgets_the_connection() {
    let mut bench = in_data();
    assert_eq!(bench.slave.last_reset(), None);
    bench.raw(&[0x77; 7]);
    assert_eq!(bench.slave.last_reset(), Some(ResetCode::UnknownCommand));
    assert_eq!(bench.slave.chain, Chain::START);
    assert_eq!(bench.slave.conn_id, 0);
    assert_eq!(bench.slave.connection_data, [0; 4]);
    assert_eq!(bench.slave.collected.watchdog_ms(), 0);
    assert_eq!(bench.slave.watchdog_start_ns, None);
}

/// black-channel.md 2.5: what a slave remembers of an old session is of no
/// use in a new one.
#[test]
fn a_recorded_session_cannot_be_replayed() {
    let mut bench = Bench::new(2, 2, &[]);
    let mut recorded = Vec::new();
    bench.session(7);
    let payloads =
        [(command::CONNECTION, bench.conn_data.clone()), (command::PARAMETER, bench.parameters.clone())];
    for (command, payload) in payloads {
        for part in payload.chunks(2) {
            let frame = bench.master.chained(CONN_ID, command, part);
            let answer = bench.raw(&frame).unwrap();
            bench.master.receive(&answer);
            recorded.push(frame);
        }
    }
    bench.raw(&reset_frame(2, 0));
    bench.session(7);
    let answer = bench.raw(&recorded[0]).unwrap();
    bench.expect_reset(&answer, 4);
}
