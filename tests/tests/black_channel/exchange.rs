//! A clean bus: every size reaches Data, numbers wrap, check sums that collide are stepped past.

use sim::master::{
    fsoe::{self, Config, State, command, frame::Frame},
    profisafe,
};

use crate::{
    bench::{Bench, MS, fsoe_pair, profisafe_pair},
    device::{Device, Shape, Source},
};

/// black-channel.md 2.1, 2.6: 1 or even octets up to 126, the shorter way cuts the payload.
#[test]
fn every_pair_of_sampled_sizes_reaches_data_and_exchanges() {
    let sizes = [1, 2, 4, 6, 8, 12, 14, 32, 62, 124, 126];
    for (outputs, inputs) in sizes.iter().flat_map(|out| sizes.iter().map(move |inp| (*out, *inp))) {
        for source in Source::ALL {
            let (master, shape) = fsoe_pair(outputs, inputs);
            let mut bench = Bench::new(master, &shape, source, &[], 0);
            for _ in 0..40 {
                bench.cycle((&[], &[]));
            }
            assert_eq!(bench.master.state(), State::Data, "{outputs}/{inputs} {source:?}");
            assert!(bench.accepted.0 > 20, "{outputs}/{inputs} {source:?}: {:?}", bench.accepted);
            assert!(bench.accepted.1 > 20, "{outputs}/{inputs} {source:?}: {:?}", bench.accepted);
        }
    }
}

/// black-channel.md 2.6: master frames up to and including the first Data frame.
#[test]
fn the_handshake_takes_as_many_frames_as_its_formula_says() {
    for (size, parameters, expected) in [(1, 0, 14), (2, 0, 8), (4, 0, 6), (6, 0, 5), (12, 0, 5), (2, 4, 10)]
    {
        let config =
            Config { application_parameters: vec![7; parameters], ..Config::new(size, size.max(2), 3) };
        let mut device = Device::new(&Shape::of_fsoe(&config), Source::Split);
        let mut master = fsoe::Master::new(config);
        let mut frames = 0;
        while device.outputs().is_none() {
            master.set_outputs(Some(&vec![9; size]));
            let answer = device.receive(master.to_send(), None, 0).expect("an answer to each frame");
            master.receive(&answer, 0);
            frames += 1;
        }
        assert_eq!(frames, expected, "{size} octets, {parameters} application parameters");
    }
}

/// black-channel.md 3.5: fail-safe data is zeros even when the octets are not, and the
/// directions are independent of each other.
#[test]
fn fail_safe_data_with_octets_in_it_reads_as_zeros() {
    for source in Source::ALL {
        let (mut master, mut device) = in_data(4, 12, source);
        let frame = master.forge(command::FAIL_SAFE_DATA, &[1, 2, 3, 4], 7);
        let answer = device.receive(&frame, Some(&[5; 12]), 0).expect("an answer");
        assert_eq!((answer[0], device.outputs()), (command::PROCESS_DATA, None));
        let (a, b) = device.raw_outputs();
        assert_eq!((a, b), (vec![0; 4], vec![0; 4]));
        master.receive(&answer, 0);
        let answer = device.receive(master.to_send(), None, 0);
        assert!(
            answer.is_none_or(|answer| answer[0] == command::RESET || answer[0] == command::FAIL_SAFE_DATA)
        );
    }
}

/// black-channel.md 2.5: 65535 is followed by 1, in both directions.
#[test]
fn the_numbers_wrap_without_a_reset() {
    let (master, shape) = fsoe_pair(4, 12);
    let mut bench = Bench::new(master, &shape, Source::Split, &[], 0);
    for _ in 0..70_000 {
        bench.cycle((&[], &[]));
    }
    assert!(bench.accepted.0 > 69_980, "{:?}", bench.accepted);
    assert!(bench.accepted.1 > 69_980, "{:?}", bench.accepted);
}

/// black-channel.md 2.5: a CRC_0 equal to the one before steps the number, on both sides.
#[test]
fn a_check_sum_like_the_one_before_is_stepped_past() {
    for source in Source::ALL {
        let (mut master, mut device) = in_data(2, 2, source);
        let mut collisions = (0, 0);
        for _ in 0..4 {
            let numbers = master.chain().numbers();
            let answer =
                device.receive(master.to_send(), Some(&colliding_inputs(&master)), 0).expect("an answer");
            let outputs = colliding_outputs(&master, &answer);
            master.set_outputs(Some(&outputs));
            master.receive(&answer, 0);
            assert_eq!(master.state(), State::Data, "{source:?}: {answer:02X?}");
            let after = master.chain().numbers();
            collisions.0 += u32::from(after.0 == numbers.0 + 2);
            collisions.1 += u32::from(after.1 == numbers.1 + 2);
        }
        assert!(collisions.0 > 0, "{source:?}: no collision towards the slave");
        assert!(collisions.1 > 0, "{source:?}: no collision towards the master");
    }
}

/// black-channel.md 2.5: the memory of the slave's CRC_0 is 0 after a Reset, and the rule
/// holds for its Session answer; so an answer whose CRC_0 would be 0 takes number 2.
#[test]
fn a_session_answer_never_has_the_check_sum_zero() {
    for source in Source::ALL {
        let config = Config::new(2, 2, 3);
        let mut master = fsoe::Master::new(config.clone());
        master.receive(&fsoe::frame::reset(0, 2).octets(), 0);
        let inherited = master.chain().check_sums().1;
        let zero = |id: &u16| {
            let implicit = fsoe::frame::Implicit { inherited, number: 1 };
            fsoe::frame::check_sum(implicit, 0, command::SESSION, 0, &id.to_le_bytes()) == 0
        };
        let id = (0..=u16::MAX).find(zero).expect("a linear code has such an id");
        let Shape::Fsoe { outputs, inputs, address, application_parameters, .. } = Shape::of_fsoe(&config)
        else {
            unreachable!("it was made of FSoE")
        };
        let shape = Shape::Fsoe { outputs, inputs, address, session_id: id, application_parameters };
        let mut device = Device::new(&shape, source);
        let reset = fsoe::frame::reset(0, 2).octets();
        assert_eq!(device.receive(&reset, None, 0), Some(reset));
        let answer = device.receive(master.to_send(), None, 0).expect("an answer");
        master.receive(&answer, 0);
        assert_eq!(master.state(), State::Connection, "{source:?}: {answer:02X?}");
    }
}

/// black-channel.md 2.5, 3.2: ids of each session differ from the last, on both sides.
#[test]
fn each_session_has_ids_of_its_own() {
    for source in Source::ALL {
        let (mut master, mut device) = in_data(4, 4, source);
        let mut ids = Vec::new();
        for _ in 0..3 {
            master.reset(0, 0);
            while master.state() != State::Data {
                let answer = device.receive(master.to_send(), None, 0).expect("an answer");
                master.receive(&answer, 0);
            }
            ids.push(u16::from_le_bytes([master.slave_session()[0], master.slave_session()[1]]));
        }
        assert_eq!(ids, [0x9ABE, 0x9ABF, 0x9AC0], "{source:?}");
    }
}

/// black-channel.md 3.6: with 100 ms, 99 ms is fine, 100 ms is Reset(5), frame or no frame.
#[test]
fn the_watchdog_expires_when_its_time_is_reached() {
    let expired = fsoe::frame::reset(5, 2).octets();
    for source in Source::ALL {
        let (master, mut device) = in_data(2, 2, source);
        assert!(device.receive(master.to_send(), None, 99 * MS).is_some_and(|answer| answer[0] != 0x2A));
        assert_eq!(device.advance(198 * MS), None);
        assert_eq!(device.advance(199 * MS), Some(expired.clone()), "{source:?}");
        assert_eq!(device.outputs(), None);
        let (master, mut device) = in_data(2, 2, source);
        let late = device.receive(master.to_send(), None, 100 * MS);
        assert_eq!(late, Some(expired.clone()), "{source:?}: a right frame that is late");
    }
}

/// black-channel.md 8: start, exchange, and the fail-safe values of the user program.
#[test]
fn profisafe_exchanges_and_returns_from_activated_fail_safe_values() {
    for (outputs, inputs) in [(4, 4), (2, 2), (1, 12), (12, 1)] {
        for source in Source::ALL {
            let (host, shape) = profisafe_pair(outputs, inputs);
            let mut bench = Bench::new(host, &shape, source, &[], 0);
            for cycle in 0..300 {
                bench.master.set_activate_fv((100..200).contains(&cycle));
                bench.cycle((&[], &[]));
                let passive = (103..200).contains(&cycle);
                assert!(!passive || bench.device.outputs().is_none(), "{source:?} cycle {cycle}");
            }
            assert!(bench.master.healthy());
            assert!(bench.accepted.0 > 190, "{outputs}/{inputs} {source:?}: {:?}", bench.accepted);
            assert!(bench.accepted.1 > 190, "{outputs}/{inputs} {source:?}: {:?}", bench.accepted);
        }
    }
}

/// black-channel.md 8.6: restarted by new numbers only, expires when its time is reached.
#[test]
fn the_watchdog_of_the_f_device_takes_no_old_number_for_a_new_one() {
    for source in Source::ALL {
        let (host, shape) = profisafe_pair(4, 4);
        let mut bench = Bench::new(host, &shape, source, &[], 0);
        for _ in 0..10 {
            bench.cycle((&[], &[]));
        }
        let started = bench.now_ns();
        let number = bench.master.number() - 1;
        let control = bench.master.control() ^ profisafe::control::TOGGLE;
        for step in 1..10_u8 {
            let same_number = bench.master.forge(&[step, 0, 0, 1], control, number);
            let _ = bench.device.receive(&same_number, Some(&[1; 4]), started + u64::from(step) * 10 * MS);
            assert_eq!(bench.device.outputs(), Some(vec![step, 0, 0, 1]), "{source:?}");
        }
        let _ = bench.device.advance(started + 100 * MS - 1);
        assert!(bench.device.outputs().is_some());
        let answer = bench.device.advance(started + 100 * MS);
        assert_eq!(bench.device.outputs(), None, "{source:?}");
        assert!(answer.is_some_and(|answer| answer[4] & profisafe::status::WD_TIMEOUT != 0), "{source:?}");
    }
}

/// A master and a device that have just exchanged their first Data frames.
pub fn in_data(outputs: usize, inputs: usize, source: Source) -> (fsoe::Master, Device) {
    let (mut master, shape) = fsoe_pair(outputs, inputs);
    let mut device = Device::new(&shape, source);
    master.set_outputs(Some(&vec![0xC3; outputs]));
    while device.outputs().is_none() {
        let answer = device.receive(master.to_send(), Some(&vec![0x3C; inputs]), 0).expect("an answer");
        master.receive(&answer, 0);
    }
    (master, device)
}

/// Inputs for which the slave's answer to the frame on the bus would repeat its CRC_0.
fn colliding_inputs(master: &fsoe::Master) -> [u8; 2] {
    let (received, inherited) = master.chain().check_sums();
    let number = master.chain().numbers().1;
    let implicit = fsoe::frame::Implicit { inherited, number };
    let repeats = |data: &u16| {
        fsoe::frame::check_sum(implicit, 7, command::PROCESS_DATA, 0, &data.to_le_bytes()) == received
    };
    (0..=u16::MAX).find(repeats).expect("16 data bits reach each check sum").to_le_bytes()
}

/// Outputs for which the master's next frame would repeat its CRC_0.
fn colliding_outputs(master: &fsoe::Master, answer: &[u8]) -> [u8; 2] {
    let (number, sent) = (master.chain().numbers().0, master.chain().check_sums().1);
    let inherited = Frame::parse(answer, 2).expect("a frame").first_check_sum();
    let implicit = fsoe::frame::Implicit { inherited, number };
    let repeats = |data: &u16| {
        fsoe::frame::check_sum(implicit, 7, command::PROCESS_DATA, 0, &data.to_le_bytes()) == sent
    };
    (0..=u16::MAX).find(repeats).expect("16 data bits reach each check sum").to_le_bytes()
}
