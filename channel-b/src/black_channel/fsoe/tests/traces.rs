//! Recorded sessions (black-channel 4.2 and 4.3), octet for octet.

use super::std::vec::Vec;

use super::super::{Config, Slave, State};
use super::{Answer, config, is_reset_with, receive};

pub const INPUTS_A: [u8; 12] = [1, 0x1F, 0x10, 0x20, 0x30, 0x40, 0x50, 0x60, 0x70, 0x80, 0x11, 0x22];

/// Frames of master and slave in turn; recorded at drive firmware.
pub const TRACE_A: [(&str, &str); 8] = [
    ("2A0000C42D0000B91400009C0200007F0F0000", "2A0000C42D0000B91400009C0200007F0F0000D62E000035230000"),
    ("4E1122B71F0000434E00006658000085550000", "4EBD9A0726000066C0000043D60000A0DB000009FA0000EAF70000"),
    ("6407004A1A030002B1000015310000F63C0700", "640700F56503001D0800000A880000E985000040A40000A3A90700"),
    ("52020027F7640032860000F2ED000011E00700", "520200CB3C6400FD4E00003D250000DE2800007709000094040700"),
    ("3601006F3E00001622000033340000D0390700", "36011F79531020CB0230408E1F506057DE70800425112254430700"),
    ("36010042A200006F6800004A7E0000A9730700", "36011F9E4F1020F2043040B71950606ED870803D2311226D450700"),
    ("3601001B1E0000C9280000EC3E00000F330700", "36011F1FD3102047DE304002C35060DB02708088F91122D89F0700"),
    ("360100071C00005B8800007E9E00009D930700", ""),
];

/// From the fourth frame of trace A on: fail-safe data in both directions.
const TRACE_A_FAIL_SAFE: [(&str, &str); 2] = [
    ("080000AEFE0000B0B2000095A4000076A90700", "080000F437000093DF0000B6C9000055C40000FCE500001FE80700"),
    ("080000C3500000F7690000D27F000031720700", "080000912F0000EE750000CB630000286E0000814F000062420700"),
];

const TRACE_C: [(&str, &str); 9] = [
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

pub fn octets(text: &str) -> Vec<u8> {
    let digit = |octet: &u8| char::from(*octet).to_digit(16).expect("hexadecimal") as u8;
    let pairs = text.as_bytes().chunks(2);
    pairs.map(|pair| digit(&pair[0]) << 4 | digit(&pair[1])).collect()
}

pub fn config_a() -> Config<'static> {
    Config { address: 3, session_id: 0x9ABD, ..config(8, 12) }
}

fn replay(slave: &mut Slave, trace: &[(&str, &str)], inputs: Option<&[u8]>) {
    for (frame, expected) in trace {
        let answer = receive(slave, &octets(frame), 0, inputs);
        if !expected.is_empty() {
            assert_eq!(answer, octets(expected), "{frame}");
        }
    }
    assert_eq!(slave.state(), State::Data);
}

#[test]
fn trace_a_is_answered_octet_for_octet() {
    let mut slave = Slave::new(&config_a()).expect("valid");
    replay(&mut slave, &TRACE_A, Some(&INPUTS_A));
    assert_eq!(slave.outputs(), [1, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(slave.session_id(), 0x9ABD);
}

#[test]
fn trace_a_with_fail_safe_data_is_answered_octet_for_octet() {
    let mut slave = Slave::new(&config_a()).expect("valid");
    let trace: Vec<_> = TRACE_A[..4].iter().chain(&TRACE_A_FAIL_SAFE).copied().collect();
    replay(&mut slave, &trace, None);
    assert!(!slave.has_process_data());
}

#[test]
fn trace_c_is_answered_octet_for_octet() {
    let mut slave = Slave::new(&Config { session_id: 0x0102, ..config(2, 2) }).expect("valid");
    replay(&mut slave, &TRACE_C, None);
    assert_eq!(slave.outputs(), [3, 0]);
}

/// Design 10: a first Session frame without a Reset before is accepted.
#[test]
fn trace_a_is_answered_without_its_reset() {
    let mut slave = Slave::new(&config_a()).expect("valid");
    replay(&mut slave, &TRACE_A[1..], Some(&INPUTS_A));
}

/// Design 9: data of the other channel, check sums of this one.
#[test]
fn each_octet_of_an_answer_belongs_to_data_or_to_check_sums() {
    let mut slave = Slave::new(&config_a()).expect("valid");
    let mut answer = Answer::empty();
    let _ = slave.receive(&octets(TRACE_A[0].0), 0, None, &mut answer);
    let marks: Vec<_> = (0..27).map(|index| answer.is_check_octet(index)).collect();
    for (index, mark) in marks.iter().enumerate() {
        let is_inside = (1..25).contains(&index);
        assert_eq!(*mark, is_inside && (index - 1) % 4 >= 2, "{index}");
    }
}

#[test]
fn every_single_bit_flip_of_a_session_is_refused() {
    for place in 0..TRACE_A.len() {
        let mut before = Slave::new(&config_a()).expect("valid");
        for (frame, _) in &TRACE_A[..place] {
            receive(&mut before, &octets(frame), 0, Some(&INPUTS_A));
        }
        let right = octets(TRACE_A[place].0);
        for bit in 0..right.len() * 8 {
            let mut slave = before;
            let mut wrong = right.clone();
            wrong[bit / 8] ^= 1 << (bit % 8);
            let answer = receive(&mut slave, &wrong, 0, Some(&INPUTS_A));
            assert_eq!(slave.state(), State::Reset, "frame {place}, bit {bit}");
            assert_eq!(slave.outputs(), [0; 8]);
            // In state Reset the check sums of a Reset frame are not looked at.
            let is_acknowledged = is_reset_with(&answer, 0);
            assert_eq!(is_acknowledged, place == 0 && bit >= 8, "frame {place}, bit {bit}");
        }
    }
}
