//! The F-Device against the derived exchange, its table and a test host.

extern crate std;

mod exchange;
mod faults;
mod host;

use std::vec::Vec;

use super::super::answer::Answer;
use super::super::{ConfigFault, Outcome};
use super::memory::Memory;
use super::telegram::{compose, successor};
use super::{Config, Device, ParameterFault};

const MILLISECOND: u64 = 1_000_000;
/// Last row of black-channel 9.1: address 7, watchdog 100 ms.
pub(crate) const BLOCK: [u8; 10] = [0x08, 0x40, 0, 1, 0, 7, 0, 0x64, 0x70, 0x22];
const CHECK_1: u16 = 0x7022;
const OUTPUTS: [u8; 4] = [0x11, 0x12, 0x13, 0x14];
const INPUTS: [u8; 4] = [0xA1, 0xA2, 0xA3, 0xA4];

const RESETS_NUMBER: u8 = 1 << 2;
const FAIL_SAFE: u8 = 1 << 4;
const TOGGLE: u8 = 1 << 5;
const CHECK_FAULT: u8 = 1 << 2;
const TIMED_OUT: u8 = 1 << 3;
const NUMBER_RESET: u8 = 1 << 6;
const DEVICE_FAULT: u8 = 1 << 1;

fn device() -> Device {
    Device::new(&Config { outputs: 4, inputs: 4, address: 7, f_parameters: &BLOCK }).expect("valid")
}

/// A telegram of the host.
pub(crate) fn telegram(number: u32, control: u8, data: &[u8]) -> Vec<u8> {
    telegram_of(4, number, control, data)
}

/// A telegram with `length` octets of data.
pub(crate) fn telegram_of(length: usize, number: u32, control: u8, data: &[u8]) -> Vec<u8> {
    let mut answer = Answer::empty();
    compose(&mut answer, (CHECK_1, number), control, data, length);
    answer.octets().to_vec()
}

fn receive(device: &mut Device, image: &[u8], now_ms: u64) -> Vec<u8> {
    let mut answer = Answer::empty();
    let outcome = device.receive(image, now_ms * MILLISECOND, Some(&INPUTS), &mut answer);
    assert_eq!(outcome == Outcome::Answered, !answer.octets().is_empty());
    answer.octets().to_vec()
}

fn advance(device: &mut Device, now_ms: u64) -> Vec<u8> {
    let mut answer = Answer::empty();
    let _ = device.advance(now_ms * MILLISECOND, &mut answer);
    answer.octets().to_vec()
}

/// A device that has exchanged the numbers 0 to `number` at time 0.
fn exchanging(number: u32) -> Device {
    let mut device = device();
    receive(&mut device, &telegram(0, FAIL_SAFE | TOGGLE | RESETS_NUMBER, &[]), 0);
    for number in 1..=number {
        receive(&mut device, &telegram(number, toggle(number), &OUTPUTS), 0);
    }
    device
}

/// Number 0 goes with toggle 1, number 1 with toggle 0, and so on.
fn toggle(number: u32) -> u8 {
    if number.is_multiple_of(2) { TOGGLE } else { 0 }
}

/// The answer must be this status and these data under this number.
fn expect(answer: &[u8], number: u32, status: u8, data: &[u8]) {
    assert_eq!(answer, telegram(number, status, data), "number {number}, status {status:02X}");
}
