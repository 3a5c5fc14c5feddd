//! The master against the vectors of black-channel.md section 4, without any slave of ours.

use super::{
    Config, Master, State, command,
    frame::{FRESH, Implicit, check_sum, reset},
};

fn octets(hexadecimal: &str) -> Vec<u8> {
    let pairs = hexadecimal.as_bytes().chunks(2);
    pairs.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

/// Lets the master meet the recorded answers; each of its frames must be the recorded one.
fn plays(mut master: Master, outputs_from: (usize, &[u8]), recording: &[(&str, &str)]) -> Master {
    for (at, (from_master, from_slave)) in recording.iter().enumerate() {
        assert_eq!(master.to_send(), octets(from_master), "frame {at}");
        if at + 1 == outputs_from.0 {
            master.set_outputs(Some(outputs_from.1));
        }
        master.receive(&octets(from_slave), 0);
    }
    master
}

/// black-channel.md 4.1.
#[test]
fn single_check_sums_are_those_of_the_table() {
    assert_eq!(check_sum(FRESH, 0, command::SESSION, 0, &[0x12, 0x34]), 0x4D07);
    assert_eq!(check_sum(FRESH, 0, command::SESSION, 0, &[0x12]), 0xA176);
    let second = Implicit { inherited: 0xABCD, number: 2 };
    assert_eq!(check_sum(second, 7, command::PROCESS_DATA, 1, &[0xDE, 0xAD]), 0xBC47);
    assert_eq!(reset(0, 2).octets(), octets("2A0000C42D0000"));
}

/// black-channel.md 4.2, trace A: recorded from drive firmware.
#[test]
fn the_recorded_drive_accepts_each_frame_of_the_master() {
    let trace = [
        ("2A0000C42D0000B91400009C0200007F0F0000", "2A0000C42D0000B91400009C0200007F0F0000D62E000035230000"),
        ("4E1122B71F0000434E00006658000085550000", "4EBD9A0726000066C0000043D60000A0DB000009FA0000EAF70000"),
        ("6407004A1A030002B1000015310000F63C0700", "640700F56503001D0800000A880000E985000040A40000A3A90700"),
        ("52020027F7640032860000F2ED000011E00700", "520200CB3C6400FD4E00003D250000DE2800007709000094040700"),
        ("3601006F3E00001622000033340000D0390700", "36011F79531020CB0230408E1F506057DE70800425112254430700"),
        ("36010042A200006F6800004A7E0000A9730700", "36011F9E4F1020F2043040B71950606ED870803D2311226D450700"),
        ("3601001B1E0000C9280000EC3E00000F330700", "36011F1FD3102047DE304002C35060DB02708088F91122D89F0700"),
    ];
    let outputs = [1, 0, 0, 0, 0, 0, 0, 0];
    let master = plays(Master::new(Config::new(8, 12, 3)), (4, &outputs), &trace);
    assert_eq!(master.to_send(), octets("360100071C00005B8800007E9E00009D930700"));
    assert_eq!(master.inputs(), Some(&octets("011F10203040506070801122")[..]));
    assert_eq!(master.slave_session(), [0xBD, 0x9A]);
}

/// black-channel.md 4.2, the variant with fail-safe data.
#[test]
fn fail_safe_data_flows_both_ways_and_is_no_process_data() {
    let trace = [
        ("2A0000C42D0000B91400009C0200007F0F0000", "2A0000C42D0000B91400009C0200007F0F0000D62E000035230000"),
        ("4E1122B71F0000434E00006658000085550000", "4EBD9A0726000066C0000043D60000A0DB000009FA0000EAF70000"),
        ("6407004A1A030002B1000015310000F63C0700", "640700F56503001D0800000A880000E985000040A40000A3A90700"),
        ("52020027F7640032860000F2ED000011E00700", "520200CB3C6400FD4E00003D250000DE2800007709000094040700"),
        ("080000AEFE0000B0B2000095A4000076A90700", "080000F437000093DF0000B6C9000055C40000FCE500001FE80700"),
        ("080000C3500000F7690000D27F000031720700", "080000912F0000EE750000CB630000286E0000814F000062420700"),
    ];
    let master = plays(Master::new(Config::new(8, 12, 3)), (99, &[]), &trace);
    assert_eq!((master.state(), master.inputs()), (State::Data, None));
}

/// black-channel.md 4.3, trace C: two octets each way, so that the payload is cut.
#[test]
fn a_payload_longer_than_a_chunk_is_cut_as_recorded() {
    let trace = [
        ("2A0000C42D0000", "2A0000C42D0000"),
        ("4EEFBE275E0000", "4E020143860000"),
        ("6434122AD63412", "643412785F3412"),
        ("640500A6813412", "640500399B3412"),
        ("52020043253412", "520200B4A83412"),
        ("52C80029C43412", "52C800DD153412"),
        ("520000AD523412", "520000934F3412"),
        ("360300D09C3412", "080000D40F3412"),
        ("360300E0423412", "08000023473412"),
    ];
    let config =
        Config { connection_id: 0x1234, watchdog_ms: 200, session_id: 0xBEEF, ..Config::new(2, 2, 5) };
    let master = plays(Master::new(config), (7, &[3, 0]), &trace);
    assert_eq!((master.state(), master.inputs()), (State::Data, None));
}

/// black-channel.md 3.6: expiry in Reset leads to Session, elsewhere to Reset(5), in turns.
#[test]
fn a_silent_slave_makes_the_master_alternate_between_reset_and_session() {
    let mut master = Master::new(Config::new(2, 2, 5));
    master.advance(99_999_999);
    assert_eq!(master.state(), State::Reset);
    master.advance(100_000_000);
    assert_eq!(master.state(), State::Session);
    master.advance(200_000_000);
    assert_eq!((master.state(), master.to_send()[1]), (State::Reset, 5));
    master.advance(300_000_000);
    assert_eq!(master.state(), State::Session);
}
