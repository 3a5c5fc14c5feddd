//! A model of the F-Host (black-channel 8.4) over a bus that loses, spoils and
//! repeats telegrams.

use super::super::super::division::Remainder;
use super::std::vec::Vec;
use super::*;

const TIMEOUT_CYCLES: u32 = 9;
/// More than the device's 100 ms in ten cycles.
const CYCLE_MS: u64 = 11;

#[allow(clippy::struct_excessive_bools, reason = "the bits of the control octet are independent")]
struct Host {
    number: u32,
    old_number: u32,
    toggle: bool,
    resets_number: bool,
    has_fault: bool,
    wants_acknowledgement: bool,
    uses_fail_safe: bool,
    waited: u32,
    data: [u8; 4],
}

impl Host {
    fn new() -> Self {
        Self {
            number: 0,
            old_number: 0,
            toggle: true,
            resets_number: true,
            has_fault: false,
            wants_acknowledgement: false,
            uses_fail_safe: true,
            waited: 0,
            data: [0; 4],
        }
    }

    fn sends(&self) -> Vec<u8> {
        let bits = [
            (self.wants_acknowledgement, 1),
            (self.resets_number, 2),
            (self.uses_fail_safe, 4),
            (self.toggle, 5),
        ];
        let control = bits.iter().map(|(is_set, bit)| u8::from(*is_set) << bit).sum();
        let data = if self.uses_fail_safe { [0; 4] } else { self.data };
        telegram(self.number, control, &data)
    }

    fn next_number(&mut self) {
        self.old_number = self.number;
        self.number = successor(self.number);
        self.resets_number = false;
        self.toggle = !self.toggle;
        self.waited = 0;
        self.data = data_of(self.number);
    }

    fn faults(&mut self) {
        self.has_fault = true;
        self.wants_acknowledgement = false;
        self.uses_fail_safe = true;
        self.resets_number = true;
        self.old_number = self.number;
        self.number = 0;
        self.toggle = !self.toggle;
        self.waited = 0;
    }

    fn hears(&mut self, answer: &[u8], is_acknowledged_by_operator: bool) {
        let status = answer[4];
        let is_answer = (status & TOGGLE != 0) == self.toggle;
        let number = if is_answer { self.number } else { self.old_number };
        let reports_fault = status & (CHECK_FAULT | TIMED_OUT) != 0;
        if !is_right(answer, number) || reports_fault {
            return self.faults();
        }
        let resets_agree = (status & NUMBER_RESET != 0) == self.resets_number;
        if !is_answer || !resets_agree {
            return self.waits();
        }
        if !self.has_fault {
            self.uses_fail_safe = false;
        } else if self.wants_acknowledgement && is_acknowledged_by_operator {
            (self.has_fault, self.wants_acknowledgement, self.uses_fail_safe) = (false, false, false);
        } else {
            self.wants_acknowledgement = true;
        }
        self.next_number();
    }

    fn waits(&mut self) {
        self.waited += 1;
        if self.waited >= TIMEOUT_CYCLES {
            self.faults();
        }
    }
}

/// CRC2 by the text of black-channel 7.4, over the octets as they lie here.
fn is_right(answer: &[u8], number: u32) -> bool {
    let mut octets: Vec<u8> = answer[..5].iter().rev().copied().collect();
    octets.extend(&number.to_le_bytes()[..3]);
    octets.push(0);
    let check = Remainder::<24, 0x5D_6DCB>::preset(u32::from(CHECK_1)).then_all(octets).value();
    answer[5..] == check.to_be_bytes()[1..]
}

struct Noise(u64);

impl Noise {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) % bound
    }

    /// What arrives of `image`; `earlier` may arrive in its place.
    fn carry(&mut self, mut image: Vec<u8>, earlier: &[u8]) -> Option<Vec<u8>> {
        match self.below(60) {
            0 => None,
            1 => {
                let (octet, bit) = (self.below(8) as usize, self.below(8));
                image[octet] ^= 1 << bit;
                Some(image)
            }
            2 => Some(earlier.to_vec()),
            _ => Some(image),
        }
    }
}

struct Bus {
    device: Device,
    host: Host,
    noise: Noise,
    last_answer: Vec<u8>,
    earlier: Vec<u8>,
    now_ms: u64,
}

impl Bus {
    fn carried(&mut self, image: Vec<u8>, earlier: &[u8], is_disturbed: bool) -> Option<Vec<u8>> {
        if is_disturbed { self.noise.carry(image, earlier) } else { Some(image) }
    }

    fn cycle(&mut self, is_disturbed: bool) {
        self.now_ms += CYCLE_MS;
        let sent = self.host.sends();
        let arrives = self.carried(sent.clone(), &self.earlier.clone(), is_disturbed);
        if let Some(image) = arrives {
            let answer = receive(&mut self.device, &image, self.now_ms);
            if !answer.is_empty() {
                self.last_answer = answer;
            }
        }
        let expired = advance(&mut self.device, self.now_ms);
        if !expired.is_empty() {
            self.last_answer = expired;
        }
        if self.noise.below(20) == 0 {
            self.earlier = sent;
        }
        let answer = self.last_answer.clone();
        let answer = self.carried(answer.clone(), &answer, is_disturbed);
        let is_acknowledged = self.noise.below(10) == 0;
        match answer {
            Some(answer) => self.host.hears(&answer, is_acknowledged),
            None => self.host.waits(),
        }
    }
}

/// The property that black-channel 8.3 claims of its table.
#[test]
fn over_a_bad_bus_no_wrong_octet_comes_out_and_every_fault_is_recovered_from() {
    let mut bus = Bus {
        device: device(),
        host: Host::new(),
        noise: Noise(0x05AF_E9A1),
        last_answer: telegram(0, FAIL_SAFE, &[]),
        earlier: std::vec![0; 8],
        now_ms: 0,
    };
    let (mut with_data, mut faults) = (0, 0);
    for _ in 0..400 {
        for _ in 0..200 {
            bus.cycle(true);
            let number = bus.device.memory.read().expect("unspoilt").number;
            let outputs = bus.device.outputs();
            let is_zero = outputs == [0; 4];
            assert!(is_zero || outputs == data_of(number), "{outputs:02X?} under {number}");
            with_data += u32::from(bus.device.has_process_data());
            faults += u32::from(bus.host.resets_number && bus.host.waited == 0);
        }
        for _ in 0..200 {
            bus.cycle(false);
        }
        assert!(bus.device.has_process_data(), "no recovery");
        assert!(!bus.host.has_fault);
    }
    assert!(with_data > 10_000, "{with_data}");
    assert!(faults > 1_000, "{faults}");
}

/// The data that the host sends under `number`.
fn data_of(number: u32) -> [u8; 4] {
    number.wrapping_mul(0x9E37_79B9).to_be_bytes()
}
