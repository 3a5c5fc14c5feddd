//! Tests of the F-Device against the derived exchange of black-channel.md 9.3
//! and a plain test host with a CRC2 of its own.

extern crate std;

use super::super::ConfigFault;
use super::{Communication, DeviceFaultReport, FDevice, FParameterFault, ProfisafeConfig, control, status};
use std::string::String;
use std::vec::Vec;

const MS: u64 = 1_000_000;
const CRC1: u16 = 0x7022;
const F_PARAMETERS: [u8; 10] = [0x08, 0x40, 0, 1, 0, 7, 0, 0x64, 0x70, 0x22];
const INPUTS: [u8; 4] = [0xA1, 0xA2, 0xA3, 0xA4];
const OUTPUTS: [u8; 4] = [0x11, 0x12, 0x13, 0x14];

const CONFIG: ProfisafeConfig = ProfisafeConfig {
    output_length: 4,
    input_length: 4,
    address: 7,
    f_parameters: &F_PARAMETERS,
    ipar_crc: None,
    lowest_watchdog_ms: 1,
    device_fault: DeviceFaultReport::StatusBit,
};

fn hex(text: &str) -> Vec<u8> {
    let digits: String = text.split_whitespace().collect();
    let pairs = (0..digits.len()).step_by(2);
    pairs.map(|place| u8::from_str_radix(&digits[place..place + 2], 16).unwrap()).collect()
}

/// Polynomial division bit by bit, octets in reverse order (7.4).
fn plain_sum(number: u32, octet: u8, data: &[u8]) -> [u8; 3] {
    let mut octets = std::vec![octet];
    octets.extend(data.iter().rev());
    octets.extend(&number.to_le_bytes()[..3]);
    octets.push(0);
    let mut register = u32::from(CRC1);
    for octet in octets {
        register ^= u32::from(octet) << 16;
        for _ in 0..8 {
            register <<= 1;
            if register & 0x0100_0000 != 0 {
                register ^= 0x015D_6DCB;
            }
        }
    }
    let [_, sum @ ..] = register.to_be_bytes();
    sum
}

fn pdu(number: u32, octet: u8, data: &[u8]) -> Vec<u8> {
    let mut pdu = data.to_vec();
    pdu.push(octet);
    pdu.extend(plain_sum(number, octet, data));
    pdu
}

/// A device, and the host's side of number and toggle.
struct Bench {
    device: FDevice,
    number: u32,
    toggle: bool,
    now_ns: u64,
}

impl Bench {
    fn new() -> Self {
        Self::with(&CONFIG)
    }

    fn with(config: &ProfisafeConfig) -> Self {
        Self { device: FDevice::new(config).unwrap(), number: 0, toggle: false, now_ns: 0 }
    }

    fn raw(&mut self, frame: &[u8]) -> Option<Vec<u8>> {
        self.device.frame(frame, Some(&INPUTS), self.now_ns).unwrap().map(|answer| answer.octets().to_vec())
    }

    /// Next number, toggled; returns the status octet of the answer, whose
    /// check sum has to be right.
    fn next(&mut self, bits: u8, data: [u8; 4]) -> u8 {
        self.number = match (bits & control::RESET_NUMBER, self.number) {
            (0, 0x00FF_FFFF) => 1,
            (0, number) => number + 1,
            _ => 0,
        };
        self.toggle = !self.toggle;
        self.same(bits, data)
    }

    /// The same number again.
    fn same(&mut self, bits: u8, data: [u8; 4]) -> u8 {
        let frame = pdu(self.number, self.octet(bits), &data);
        let answer = self.raw(&frame).unwrap();
        let expected = pdu(self.number, answer[4], &answer[..4]);
        assert_eq!(answer, expected);
        answer[4]
    }

    const fn octet(&self, bits: u8) -> u8 {
        if self.toggle { bits | control::TOGGLE } else { bits }
    }

    fn start(&mut self) {
        self.next(control::RESET_NUMBER | control::ACTIVATE_FV, [0; 4]);
        self.next(0, OUTPUTS);
        assert_eq!(self.device.outputs(), OUTPUTS);
        assert_eq!(self.device.communication(), Communication::DataExchange);
    }

    fn is_passivated(&self) -> bool {
        let zeros = self.device.outputs() == [0; 4];
        zeros && !self.device.outputs_valid()
    }
}

const START: [(&str, &str); 4] = [
    ("0000000034ACB4B2", "0000000070BC0020"),
    ("11121314003B1029", "A1A2A3A400DDF872"),
    ("11121314207549F9", "A1A2A3A42093A1A2"),
    ("1112131400FC0823", "A1A2A3A4001AE078"),
];

const RECOVERY: [(&str, &str); 4] = [
    ("11121314208E9F8D", "0000000014DE231D"),
    ("000000001446796D", "000000005056CDFF"),
    ("0000000032B5EDC6", "0000000030577A50"),
    ("0000000012FBB416", "0000000010192380"),
];

const ACKNOWLEDGED: [(&str, &str); 2] =
    [("0000000032D834ED", "00000000303AA37B"), ("11121314002100D2", "A1A2A3A400C7E889")];

/// black-channel.md 9.3: start, disturbance after number 9, recovery.
#[test]
fn the_derived_exchange_octet_for_octet() {
    let mut bench = Bench::new();
    let plays = |bench: &mut Bench, frames: &[(&str, &str)]| {
        for (host, device) in frames {
            let answer = bench.raw(&hex(host)).unwrap();
            assert_eq!(answer, hex(device), "answer to {host}");
        }
    };
    plays(&mut bench, &START);
    assert_eq!(bench.device.outputs(), OUTPUTS);
    bench.number = 3;
    for _ in 4..=9 {
        assert_eq!(bench.next(0, OUTPUTS) & status::FV_ACTIVATED, 0);
    }
    plays(&mut bench, &RECOVERY);
    assert!(bench.is_passivated());
    assert!(bench.device.operator_acknowledgement_requested());
    bench.number = 2;
    bench.toggle = false;
    let acknowledged = u32::from_be_bytes([0, 0xD8, 0x34, 0xED]);
    let waiting = control::ACTIVATE_FV | control::OPERATOR_REQUEST;
    for _ in 0..1000 {
        let [high, middle, low] = plain_sum(bench.number + 1, waiting | control::TOGGLE, &[0; 4]);
        let due = u32::from_be_bytes([0, high, middle, low]) == acknowledged;
        if due && !bench.toggle {
            break;
        }
        bench.next(waiting, [0; 4]);
    }
    plays(&mut bench, &ACKNOWLEDGED);
    assert_eq!(bench.device.outputs(), OUTPUTS);
}

/// black-channel.md 8.3, 8.4: number 0 is accepted with and without reset.
#[test]
fn the_first_frame_starts_with_number_zero_either_way() {
    for bits in [0, control::RESET_NUMBER] {
        for toggle in [false, true] {
            let mut bench = Bench::new();
            assert_eq!(bench.device.communication(), Communication::Waiting);
            bench.toggle = toggle;
            let octet = bench.same(bits | control::ACTIVATE_FV, [0; 4]);
            assert_eq!(octet & status::FV_ACTIVATED, status::FV_ACTIVATED);
            assert_eq!(octet & status::NUMBER_RESET != 0, bits != 0);
            assert_eq!(octet & status::TOGGLE != 0, toggle);
            assert!(bench.device.advance(100 * MS).is_some(), "timer runs");
        }
    }
}

/// black-channel.md 8.3: number 0 never carries process values.
#[test]
fn number_zero_is_fail_safe() {
    let mut bench = Bench::new();
    let octet = bench.next(control::RESET_NUMBER, OUTPUTS);
    assert_eq!(octet & status::FV_ACTIVATED, status::FV_ACTIVATED);
    assert!(bench.is_passivated());
}

/// black-channel.md 8.3.
#[test]
fn an_empty_telegram_is_ignored_before_the_start_only() {
    let mut bench = Bench::new();
    assert_eq!(bench.raw(&[0; 8]), None);
    bench.start();
    let answer = bench.raw(&[0; 8]).unwrap();
    assert_eq!(answer[4] & status::CRC_FAULT, status::CRC_FAULT);
    assert!(bench.is_passivated());
    assert_eq!(bench.device.communication_fault_code(), Some(0x4D));
}

/// black-channel.md 3.2 for both protocols (design 10).
#[test]
fn an_identical_image_is_no_event() {
    let mut bench = Bench::new();
    bench.start();
    let frame = pdu(1, bench.octet(0), &OUTPUTS);
    assert_eq!(bench.raw(&frame), None);
}

/// black-channel.md 7.5, 8.3: data may change under one number; the timer
/// does not restart.
#[test]
fn a_frame_without_edge_brings_data_only() {
    let mut bench = Bench::new();
    bench.start();
    bench.now_ns = 99 * MS;
    let octet = bench.same(control::ACTIVATE_FV, [9, 8, 7, 6]);
    assert_eq!(octet & status::FV_ACTIVATED, 0);
    assert_eq!(bench.device.outputs(), [9, 8, 7, 6]);
    assert!(bench.device.advance(100 * MS).is_some());
}

/// black-channel.md 8.6, LNZ-BUS-13: expiry at elapsed >= F_WD_Time.
#[test]
fn the_watchdog_expires_at_its_value() {
    let mut bench = Bench::new();
    assert_eq!(bench.device.advance(5000 * MS), None, "not before the start");
    bench.start();
    assert_eq!(bench.device.advance(99 * MS), None);
    assert_eq!(bench.device.advance(100 * MS - 1), None);
    let answer = bench.device.advance(100 * MS).unwrap();
    let octet = bench.octet(status::WATCHDOG | status::FV_ACTIVATED);
    assert_eq!(answer.octets(), pdu(1, octet, &[0; 4]));
    assert!(bench.is_passivated());
    assert_eq!(bench.device.advance(900 * MS), None, "only once");
    assert_eq!(bench.device.communication_fault_code(), Some(0x4E));
}

/// black-channel.md 8.3, 8.5: a late frame keeps the fault, a reset of the
/// number ends it, and the host decides when values return.
#[test]
fn after_a_timeout_only_a_number_reset_ends_passivation() {
    let mut bench = Bench::new();
    bench.start();
    bench.now_ns = 100 * MS;
    let octet = bench.next(0, OUTPUTS);
    assert_eq!(octet & status::WATCHDOG, status::WATCHDOG);
    assert!(bench.is_passivated());
    let octet = bench.next(0, OUTPUTS);
    assert_eq!(octet & status::WATCHDOG, status::WATCHDOG);
    let octet = bench.next(control::RESET_NUMBER | control::ACTIVATE_FV, [0; 4]);
    assert_eq!(octet & (status::WATCHDOG | status::CRC_FAULT), 0);
    assert_eq!(octet & status::NUMBER_RESET, status::NUMBER_RESET);
    bench.next(control::ACTIVATE_FV | control::OPERATOR_REQUEST, [0; 4]);
    assert!(bench.is_passivated());
    bench.next(0, OUTPUTS);
    assert_eq!(bench.device.outputs(), OUTPUTS);
}

/// black-channel.md 8.3: after a rejected frame the host toggles back.
#[test]
fn a_number_reset_is_an_edge_without_toggle() {
    let mut bench = Bench::new();
    bench.start();
    let mut frame = pdu(2, bench.octet(0) ^ control::TOGGLE, &OUTPUTS);
    frame[0] ^= 1;
    let answer = bench.raw(&frame).unwrap();
    assert_eq!(answer[..4], [0; 4]);
    bench.number = 0;
    let octet = bench.same(control::RESET_NUMBER | control::ACTIVATE_FV, [0; 4]);
    assert_eq!(octet & status::NUMBER_RESET, status::NUMBER_RESET);
    assert_eq!(octet & status::CRC_FAULT, 0);
}

/// black-channel.md 8.5: activate_FV alone needs no acknowledgement.
#[test]
fn passivation_by_the_program_returns_by_itself() {
    let mut bench = Bench::new();
    bench.start();
    let octet = bench.next(control::ACTIVATE_FV, OUTPUTS);
    assert_eq!(octet & status::FV_ACTIVATED, status::FV_ACTIVATED);
    assert!(bench.is_passivated());
    assert_eq!(bench.device.communication(), Communication::FailSafe);
    let octet = bench.next(0, OUTPUTS);
    assert_eq!(octet & status::FV_ACTIVATED, 0);
    assert_eq!(bench.device.outputs(), OUTPUTS);
}

/// black-channel.md 7.5: FFFFFF is followed by 1.
#[test]
fn numbers_wrap_to_one() {
    let mut bench = Bench::new();
    bench.start();
    bench.number = 0x00FF_FFFD;
    bench.device.number = super::Number(0x00FF_FFFD);
    for _ in 0..6 {
        assert_eq!(bench.next(0, OUTPUTS) & status::CRC_FAULT, 0);
    }
    assert_eq!(bench.number, 4);
    assert_eq!(bench.device.outputs(), OUTPUTS);
}

/// black-channel.md 8.3: nothing survives one wrong bit; number, toggle and
/// timer stay, and the answer carries the old number.
#[test]
fn each_flipped_bit_is_refused() {
    for bit in 0..64 {
        let mut bench = Bench::new();
        bench.start();
        let toggled = bench.octet(0) ^ control::TOGGLE;
        let mut frame = pdu(2, toggled, &[1, 2, 3, 4]);
        frame[bit / 8] ^= 1 << (bit % 8);
        let answer = bench.raw(&frame).unwrap();
        let octet = bench.octet(status::CRC_FAULT | status::FV_ACTIVATED);
        assert_eq!(answer, pdu(1, octet, &[0; 4]), "bit {bit}");
        assert!(bench.is_passivated());
        assert!(bench.device.advance(100 * MS).is_some());
    }
}

/// black-channel.md 7.5: lost, repeated and foreign frames are refused.
#[test]
fn frames_with_another_number_or_of_another_host_are_refused() {
    for number in [0, 1, 3, 4, 0x00FF_FFFF] {
        let mut bench = Bench::new();
        bench.start();
        let toggled = bench.octet(0) ^ control::TOGGLE;
        bench.raw(&pdu(number, toggled, &OUTPUTS)).unwrap();
        assert!(bench.is_passivated(), "number {number}");
    }
    let mut bench = Bench::new();
    bench.start();
    let toggled = bench.octet(0) ^ control::TOGGLE;
    let foreign = super::pdu::seal(CRC1 ^ 1, super::Number(2), toggled, &OUTPUTS);
    bench.raw(foreign.octets()).unwrap();
    assert!(bench.is_passivated());
}

/// black-channel.md 8.3: an application that is not enabled sends zeros.
#[test]
fn missing_inputs_are_fail_safe_values() {
    for inputs in [None, Some(&INPUTS[..3])] {
        let mut bench = Bench::new();
        bench.start();
        let toggled = bench.octet(0) ^ control::TOGGLE;
        let frame = pdu(2, toggled, &[5; 4]);
        let answer = bench.device.frame(&frame, inputs, 0).unwrap().unwrap();
        let octet = toggled | status::FV_ACTIVATED;
        assert_eq!(answer.octets(), pdu(2, octet, &[0; 4]));
        assert_eq!(bench.device.outputs(), [5; 4]);
    }
}

/// black-channel.md 8.3: an internal fault passivates until it is gone.
#[test]
fn a_device_fault_passivates_and_shows() {
    let mut bench = Bench::new();
    bench.start();
    bench.device.set_device_fault(true);
    assert!(bench.is_passivated());
    let octet = bench.next(0, OUTPUTS);
    let expected = status::DEVICE_FAULT | status::FV_ACTIVATED;
    assert_eq!(octet & !status::TOGGLE, expected);
    bench.device.set_device_fault(false);
    assert_eq!(bench.device.outputs(), OUTPUTS);
}

/// ATV-PSF-10: the bit stays 0, communication stops.
#[test]
fn an_atv_is_silent_under_a_device_fault() {
    let mut bench = Bench::with(&ProfisafeConfig { device_fault: DeviceFaultReport::Silence, ..CONFIG });
    bench.start();
    bench.device.set_device_fault(true);
    let toggled = bench.octet(0) ^ control::TOGGLE;
    assert_eq!(bench.raw(&pdu(2, toggled, &OUTPUTS)), None);
    assert!(bench.is_passivated());
    assert_eq!(bench.device.advance(100 * MS), None);
    assert_eq!(bench.device.communication_fault_code(), Some(0x4E));
}

/// ATV-PSF-06: two octets each way.
#[test]
fn an_atv_telegram_has_two_octets_each_way() {
    let mut device = FDevice::new(&ProfisafeConfig { output_length: 2, input_length: 2, ..CONFIG }).unwrap();
    let start = control::RESET_NUMBER | control::TOGGLE;
    device.frame(&pdu(0, start, &[0, 0]), None, 0).unwrap();
    let frame = pdu(1, 0, &[1, 0]);
    let answer = device.frame(&frame, Some(&[0x80, 2]), 0).unwrap();
    assert_eq!(answer.unwrap().octets(), pdu(1, 0, &[0x80, 2]));
    assert_eq!(device.outputs(), [1, 0]);
}

/// black-channel.md 8.1, LNZ-BUS-17: refused parameters mean no communication.
#[test]
fn a_device_with_refused_parameters_stays_silent() {
    let mut block = F_PARAMETERS;
    block[9] ^= 1;
    let mut bench = Bench::with(&ProfisafeConfig { f_parameters: &block, ..CONFIG });
    let refused = Communication::Refused(FParameterFault::Crc1);
    assert_eq!(bench.device.communication(), refused);
    let frame = pdu(0, control::RESET_NUMBER | control::TOGGLE, &OUTPUTS);
    assert_eq!(bench.raw(&frame), None);
    assert!(bench.is_passivated());
    assert_eq!(bench.device.advance(u64::MAX), None);
}

/// black-channel.md 7.3, 7.7: 0 to 12 octets; other lengths fit no PDU.
#[test]
fn lengths_outside_the_basic_protocol_are_refused() {
    let fault = |config: &ProfisafeConfig| FDevice::new(config).err();
    for length in 0..=12 {
        let sized = ProfisafeConfig { output_length: length, input_length: length, ..CONFIG };
        assert_eq!(fault(&sized), None);
    }
    let long = ProfisafeConfig { output_length: 13, ..CONFIG };
    assert_eq!(fault(&long), Some(ConfigFault::OutputLength));
    let long = ProfisafeConfig { input_length: 13, ..CONFIG };
    assert_eq!(fault(&long), Some(ConfigFault::InputLength));
    for address in [0, u16::MAX] {
        let nowhere = ProfisafeConfig { address, ..CONFIG };
        assert_eq!(fault(&nowhere), Some(ConfigFault::Address));
    }
    for block in [&[][..], &F_PARAMETERS[..9], &[0; 11], &[0; 18]] {
        let odd = ProfisafeConfig { f_parameters: block, ..CONFIG };
        assert_eq!(fault(&odd), Some(ConfigFault::FParameterLength));
    }
    let mut bench = Bench::new();
    for length in (0..20).filter(|length| *length != 8) {
        let refused = bench.device.frame(&[0; 20][..length], None, 0).unwrap_err();
        assert_eq!((refused.expected, refused.received), (8, length));
    }
}

/// Design 3.2: noise never reaches the outputs.
#[test]
fn noise_never_reaches_the_outputs() {
    let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
    let mut bench = Bench::new();
    for turn in 0..100_000 {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        bench.now_ns = turn * MS;
        bench.raw(&seed.to_le_bytes());
        assert!(bench.is_passivated());
    }
}

/// black-channel.md 8.3: before the first accepted frame a wrong one answers
/// with number 0, toggle 0 and nothing but its own fault.
#[test]
fn a_disturbed_first_frame_shows_only_its_fault() {
    let mut bench = Bench::new();
    assert!(!bench.device.operator_acknowledgement_requested());
    assert_eq!(bench.device.communication_fault_code(), None);
    let answer = bench.raw(&[1; 8]).unwrap();
    assert_eq!(answer, pdu(0, status::CRC_FAULT | status::FV_ACTIVATED, &[0; 4]));
    assert_eq!(bench.device.communication(), Communication::Waiting);
    let octet = bench.same(control::ACTIVATE_FV, [0; 4]);
    assert_eq!(octet, status::FV_ACTIVATED, "the first right frame clears it");
}
