//! The derived exchange of black-channel 9.3 and the rows of table 8.3.

use super::std::vec::Vec;
use super::*;

fn octets(text: &str) -> Vec<u8> {
    let digit = |octet: &u8| char::from(*octet).to_digit(16).expect("hexadecimal") as u8;
    let pairs = text.as_bytes().chunks(2);
    pairs.map(|pair| digit(&pair[0]) << 4 | digit(&pair[1])).collect()
}

fn replay(device: &mut Device, exchange: &[(&str, &str)]) {
    for (host, expected) in exchange {
        assert_eq!(receive(device, &octets(host), 0), octets(expected), "{host}");
    }
}

/// Mark M: never seen on a wire.
#[test]
fn the_start_is_answered_octet_for_octet() {
    let mut device = device();
    replay(
        &mut device,
        &[
            ("0000000034ACB4B2", "0000000070BC0020"),
            ("11121314003B1029", "A1A2A3A400DDF872"),
            ("11121314207549F9", "A1A2A3A42093A1A2"),
            ("1112131400FC0823", "A1A2A3A4001AE078"),
        ],
    );
    assert_eq!(device.outputs(), OUTPUTS);
}

/// Mark M: disturbance after number 9, reset request, operator acknowledgement.
#[test]
fn the_recovery_is_answered_octet_for_octet() {
    let mut device = exchanging(9);
    // The vector prints the telegram as the host sent it, number 10.
    let mut disturbed = octets("11121314208E9F8C");
    assert_eq!(disturbed, telegram(10, TOGGLE, &OUTPUTS));
    disturbed[2] ^= 0x08;
    assert_eq!(receive(&mut device, &disturbed, 0), octets("0000000014DE231D"));
    replay(
        &mut device,
        &[
            ("000000001446796D", "000000005056CDFF"),
            ("0000000032B5EDC6", "0000000030577A50"),
            ("0000000012FBB416", "0000000010192380"),
        ],
    );
    assert_eq!(device.outputs(), [0; 4]);
    // The exchange goes on without data until the operator acknowledges; the
    // number of the last two telegrams is found by their check sums.
    let number = (3..50).find(|number| telegram(*number, 0x32, &[]) == octets("0000000032D834ED"));
    for number in 3..number.expect("a number with toggle 1") {
        let control = toggle(number + 1) | 0x12;
        let answer = receive(&mut device, &telegram(number, control, &[]), 0);
        expect(&answer, number, toggle(number + 1) | FAIL_SAFE, &[]);
    }
    replay(
        &mut device,
        &[("0000000032D834ED", "00000000303AA37B"), ("11121314002100D2", "A1A2A3A400C7E889")],
    );
    assert_eq!(device.outputs(), OUTPUTS);
}

#[test]
fn an_all_zero_telegram_before_the_start_is_ignored() {
    let mut device = device();
    assert!(receive(&mut device, &[0; 8], 0).is_empty());
    receive(&mut device, &[9; 8], 0);
    assert!(receive(&mut device, &[0; 8], 0).is_empty());
}

/// Mark M: a plain start may come without the reset request.
#[test]
fn number_0_is_accepted_first_with_and_without_reset_request() {
    for reset in [0, RESETS_NUMBER] {
        let mut device = device();
        let answer = receive(&mut device, &telegram(0, TOGGLE | FAIL_SAFE | reset, &[]), 0);
        let status = TOGGLE | FAIL_SAFE | if reset == 0 { 0 } else { NUMBER_RESET };
        expect(&answer, 0, status, &[]);
        let answer = receive(&mut device, &telegram(1, 0, &OUTPUTS), 0);
        expect(&answer, 1, 0, &INPUTS);
    }
}

/// Process values never go with number 0.
#[test]
fn number_0_keeps_fail_safe_values_even_if_the_host_releases_them() {
    let mut device = device();
    let answer = receive(&mut device, &telegram(0, TOGGLE | RESETS_NUMBER, &OUTPUTS), 0);
    expect(&answer, 0, TOGGLE | NUMBER_RESET | FAIL_SAFE, &[]);
    assert_eq!(device.outputs(), [0; 4]);
}

/// Black-channel 8.1: the first accepted telegram starts exchange and timer.
#[test]
fn the_first_right_telegram_is_an_edge_with_number_0_without_toggle_too() {
    let mut device = device();
    let answer = receive(&mut device, &telegram(0, FAIL_SAFE, &[]), 0);
    expect(&answer, 0, FAIL_SAFE, &[]);
    assert!(advance(&mut device, 99).is_empty());
    let mut late = device;
    expect(&advance(&mut late, 100), 0, TIMED_OUT | FAIL_SAFE, &[]);
    let answer = receive(&mut device, &telegram(1, TOGGLE, &OUTPUTS), 99);
    expect(&answer, 1, TOGGLE, &INPUTS);
    assert_eq!(device.outputs(), OUTPUTS);
}

/// Only the very first one: afterwards an edge needs toggle or reset request.
#[test]
fn a_second_telegram_without_toggle_is_no_edge() {
    let mut device = device();
    receive(&mut device, &telegram(0, FAIL_SAFE, &[]), 0);
    let answer = receive(&mut device, &telegram(0, 0, &OUTPUTS), 60);
    expect(&answer, 0, FAIL_SAFE, &[]);
    assert_eq!(device.outputs(), [0; 4]);
    assert!(!advance(&mut device, 100).is_empty(), "the timer goes on from the first");
}

/// Black-channel 7.5: data may change under one number, the timer goes on.
#[test]
fn without_edge_only_the_data_are_accepted() {
    let mut device = exchanging(3);
    let answer = receive(&mut device, &telegram(3, toggle(3), &[9, 8, 7, 6]), 60);
    expect(&answer, 3, 0, &INPUTS);
    assert_eq!(device.outputs(), [9, 8, 7, 6]);
    assert!(advance(&mut device, 99).is_empty());
    expect(&advance(&mut device, 100), 3, TIMED_OUT | FAIL_SAFE, &[]);
}

/// Black-channel 8.3: activate_FV is taken over with a new number only; the
/// watchdog bounds how long that can take.
#[test]
fn fail_safe_values_wished_without_edge_wait_for_the_next_number() {
    let mut device = exchanging(3);
    let answer = receive(&mut device, &telegram(3, toggle(3) | FAIL_SAFE, &[9, 8, 7, 6]), 60);
    expect(&answer, 3, 0, &INPUTS);
    assert_eq!(device.outputs(), [9, 8, 7, 6]);
    let mut silent = device;
    expect(&advance(&mut silent, 100), 3, TIMED_OUT | FAIL_SAFE, &[]);
    assert_eq!(silent.outputs(), [0; 4]);
    let answer = receive(&mut device, &telegram(4, toggle(4) | FAIL_SAFE, &OUTPUTS), 60);
    expect(&answer, 4, toggle(4) | FAIL_SAFE, &[]);
    assert_eq!(device.outputs(), [0; 4]);
}

/// Black-channel 8.3, the other way round: no release without a new number.
#[test]
fn fail_safe_values_released_without_edge_stay_until_the_next_number() {
    let mut device = exchanging(3);
    receive(&mut device, &telegram(4, toggle(4) | FAIL_SAFE, &OUTPUTS), 0);
    let answer = receive(&mut device, &telegram(4, toggle(4), &OUTPUTS), 0);
    expect(&answer, 4, toggle(4) | FAIL_SAFE, &[]);
    assert_eq!(device.outputs(), [0; 4]);
}

/// Black-channel 8.5: no acknowledgement without a fault.
#[test]
fn fail_safe_values_wished_by_the_host_are_released_by_the_host() {
    let mut device = exchanging(3);
    let answer = receive(&mut device, &telegram(4, toggle(4) | FAIL_SAFE, &OUTPUTS), 0);
    expect(&answer, 4, toggle(4) | FAIL_SAFE, &[]);
    assert_eq!(device.outputs(), [0; 4]);
    let answer = receive(&mut device, &telegram(5, toggle(5), &OUTPUTS), 0);
    expect(&answer, 5, toggle(5), &INPUTS);
    assert_eq!(device.outputs(), OUTPUTS);
}

/// Design 10: an image identical to the last is no event.
#[test]
fn an_identical_image_is_no_event() {
    let mut device = exchanging(3);
    assert!(receive(&mut device, &telegram(3, toggle(3), &OUTPUTS), 99).is_empty());
    let answer = receive(&mut device, &telegram(3, toggle(3), &OUTPUTS), 100);
    expect(&answer, 3, TIMED_OUT | FAIL_SAFE, &[]);
}

#[test]
fn an_application_that_is_not_enabled_sends_fail_safe_values() {
    let mut device = exchanging(3);
    let mut answer = Answer::empty();
    for inputs in [None, Some(&[1, 2, 3][..])] {
        assert_eq!(device.refresh(inputs, &mut answer), Outcome::Answered);
        expect(answer.octets(), 3, FAIL_SAFE, &[]);
    }
    assert_eq!(device.refresh(Some(&[1, 2, 3, 4]), &mut answer), Outcome::Answered);
    expect(answer.octets(), 3, 0, &[1, 2, 3, 4]);
    assert_eq!(super::device().refresh(None, &mut answer), Outcome::Nothing);
}

/// Black-channel 7.5: FFFFFF is followed by 1.
#[test]
fn the_exchange_outlives_the_wrap_of_the_number() {
    let mut device = exchanging(3);
    let mut memory = device.memory.read().expect("unspoilt");
    memory.number = 0xFF_FFFE;
    device.memory = super::super::Mirrored::new(memory);
    let answer = receive(&mut device, &telegram(0xFF_FFFF, TOGGLE, &OUTPUTS), 0);
    expect(&answer, 0xFF_FFFF, TOGGLE, &INPUTS);
    let answer = receive(&mut device, &telegram(successor(0xFF_FFFF), 0, &OUTPUTS), 0);
    expect(&answer, 1, 0, &INPUTS);
    assert_eq!(device.outputs(), OUTPUTS);
}

/// LNZ-BUS-05: eight octets; ATV-PSF-06: two octets of data.
#[test]
fn the_telegrams_of_both_profiles_have_their_length() {
    for (length, octets) in [(4, 8), (2, 6), (0, 4), (12, 16)] {
        let config = Config { outputs: length, inputs: length, address: 7, f_parameters: &BLOCK };
        let mut device = Device::new(&config).expect("valid");
        let mut host = Answer::empty();
        compose(&mut host, (CHECK_1, 0), TOGGLE | FAIL_SAFE, &[], length);
        assert_eq!(host.octets().len(), octets);
        assert_eq!(receive(&mut device, host.octets(), 0).len(), octets);
        assert_eq!(device.outputs().len(), length);
    }
}
