//! The recorded sessions of black-channel.md 4.2 and 4.3, octet for octet.

use super::*;
use std::string::String;

fn hex(text: &str) -> Vec<u8> {
    let digits: String = text.split_whitespace().collect();
    let pairs = (0..digits.len()).step_by(2);
    pairs.map(|place| u8::from_str_radix(&digits[place..place + 2], 16).unwrap()).collect()
}

fn slave(lengths: (u8, u8), address: u16, session_id: u16) -> FsoeSlave {
    FsoeSlave::new(&FsoeConfig {
        output_length: lengths.0,
        input_length: lengths.1,
        address,
        session_id,
        application_parameters: &[],
        watchdog_ms: (1, u16::MAX),
    })
    .unwrap()
}

fn plays(slave: &mut FsoeSlave, inputs: Option<&[u8]>, trace: &[(&str, &str)]) {
    for (question, expected) in trace {
        let answer = slave.frame(&hex(question), inputs, 0).unwrap().unwrap();
        assert_eq!(answer.octets(), hex(expected), "answer to {question}");
    }
}

const A_INPUTS: [u8; 12] = [0x01, 0x1F, 0x10, 0x20, 0x30, 0x40, 0x50, 0x60, 0x70, 0x80, 0x11, 0x22];

const A_START: [(&str, &str); 4] = [
    ("2A0000C42D0000B91400009C0200007F0F0000", "2A0000C42D0000B91400009C0200007F0F0000D62E000035230000"),
    ("4E1122B71F0000434E00006658000085550000", "4EBD9A0726000066C0000043D60000A0DB000009FA0000EAF70000"),
    ("6407004A1A030002B1000015310000F63C0700", "640700F56503001D0800000A880000E985000040A40000A3A90700"),
    ("52020027F7640032860000F2ED000011E00700", "520200CB3C6400FD4E00003D250000DE2800007709000094040700"),
];

const A_PROCESS: [(&str, &str); 4] = [
    ("3601006F3E00001622000033340000D0390700", "36011F79531020CB0230408E1F506057DE70800425112254430700"),
    ("36010042A200006F6800004A7E0000A9730700", "36011F9E4F1020F2043040B71950606ED870803D2311226D450700"),
    ("3601001B1E0000C9280000EC3E00000F330700", "36011F1FD3102047DE304002C35060DB02708088F91122D89F0700"),
    ("360100071C00005B8800007E9E00009D930700", ""),
];

const A_FAIL_SAFE: [(&str, &str); 2] = [
    ("080000AEFE0000B0B2000095A4000076A90700", "080000F437000093DF0000B6C9000055C40000FCE500001FE80700"),
    ("080000C3500000F7690000D27F000031720700", "080000912F0000EE750000CB630000286E0000814F000062420700"),
];

/// black-channel.md 4.2.
#[test]
fn trace_a_with_process_data() {
    let mut slave = slave((8, 12), 3, 0x9ABD);
    plays(&mut slave, Some(&A_INPUTS), &A_START);
    let (last, answered) = A_PROCESS.split_last().unwrap();
    plays(&mut slave, Some(&A_INPUTS), answered);
    let answer = slave.frame(&hex(last.0), Some(&A_INPUTS), 0).unwrap();
    assert_eq!(answer.unwrap().octets()[0], command::PROCESS_DATA);
    assert_eq!(slave.outputs(), [1, 0, 0, 0, 0, 0, 0, 0]);
    assert!(slave.outputs_valid());
}

/// black-channel.md 4.2, variant.
#[test]
fn trace_a_with_fail_safe_data() {
    let mut slave = slave((8, 12), 3, 0x9ABD);
    plays(&mut slave, None, &A_START);
    plays(&mut slave, None, &A_FAIL_SAFE);
    assert_eq!(slave.outputs(), [0; 8]);
    assert!(!slave.outputs_valid());
}

const C: [(&str, &str); 9] = [
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

/// black-channel.md 4.3: two octets each way, three parameter chunks.
#[test]
fn trace_c() {
    let mut slave = slave((2, 2), 5, 0x0102);
    plays(&mut slave, None, &C);
    assert_eq!(slave.outputs(), [3, 0]);
    assert_eq!(slave.session_id(), 0x0102);
}

/// black-channel.md 2.5, 2.2: nothing of a session survives one wrong bit. The
/// Reset frame is left out, because state Reset takes it without looking.
#[test]
fn each_flipped_bit_of_a_recorded_session_is_refused() {
    for broken in 1..C.len() {
        let bits = hex(C[broken].0).len() * 8;
        for bit in 0..bits {
            let mut slave = slave((2, 2), 5, 0x0102);
            plays(&mut slave, None, &C[..broken]);
            let mut frame = hex(C[broken].0);
            frame[bit / 8] ^= 1 << (bit % 8);
            let answer = slave.frame(&frame, None, 0).unwrap().unwrap();
            assert_eq!(answer.octets()[0], command::RESET, "{broken} {bit}");
            assert_eq!(slave.outputs(), [0, 0]);
            assert_eq!(slave.state(), State::Reset);
        }
    }
}

/// The same with the shape of an AMK drive's larger frames.
#[test]
fn each_flipped_bit_of_a_large_frame_is_refused() {
    for bit in 0..19 * 8 {
        let mut slave = slave((8, 12), 3, 0x9ABD);
        plays(&mut slave, Some(&A_INPUTS), &A_START);
        plays(&mut slave, Some(&A_INPUTS), &A_PROCESS[..2]);
        let mut frame = hex(A_PROCESS[2].0);
        frame[bit / 8] ^= 1 << (bit % 8);
        let answer = slave.frame(&frame, Some(&A_INPUTS), 0).unwrap().unwrap();
        assert_eq!(answer.octets()[0], command::RESET, "{bit}");
        assert_eq!(slave.outputs(), [0; 8]);
    }
}

/// black-channel.md 2.5: the chain refuses a lost, a repeated and a swapped
/// frame, and one of another session.
#[test]
fn lost_repeated_and_foreign_frames_are_refused() {
    for (kept, then) in [(7, 8), (9, 6), (9, 7), (8, 6)] {
        let mut slave = slave((2, 2), 5, 0x0102);
        plays(&mut slave, None, &C[..kept]);
        let answer = slave.frame(&hex(C[then].0), None, 0).unwrap().unwrap();
        assert_eq!(answer.octets()[0], command::RESET, "{kept} then {then}");
    }
    let mut other = slave((2, 2), 5, 0x0103);
    plays(&mut other, None, &C[..1]);
    other.frame(&hex(C[1].0), None, 0).unwrap();
    let answer = other.frame(&hex(C[2].0), None, 0).unwrap().unwrap();
    assert_eq!(answer.octets(), reset_frame(2, 4));
}
