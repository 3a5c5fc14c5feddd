//! Disturbed telegrams, time, memory faults and refused parameters.

use super::*;

#[test]
fn a_wrong_check_sum_passivates_until_the_host_resets_the_number() {
    let mut device = exchanging(3);
    let mut disturbed = telegram(4, toggle(4), &OUTPUTS);
    disturbed[0] ^= 1;
    let latched = CHECK_FAULT | FAIL_SAFE;
    expect(&receive(&mut device, &disturbed, 0), 3, latched, &[]);
    assert_eq!(device.outputs(), [0; 4]);
    // Right again, and even released by the host: the latch holds.
    let answer = receive(&mut device, &telegram(4, toggle(4), &OUTPUTS), 0);
    expect(&answer, 4, latched | toggle(4), &[]);
    assert_eq!(device.outputs(), [0; 4]);
    let control = toggle(5) | FAIL_SAFE | RESETS_NUMBER;
    let answer = receive(&mut device, &telegram(0, control, &[]), 0);
    expect(&answer, 0, FAIL_SAFE | NUMBER_RESET | toggle(5), &[]);
}

/// Black-channel 8.3: CE_CRC and FV under the old number, which is 0, toggle and
/// timer as they were; the first right telegram clears it.
#[test]
fn a_wrong_check_sum_before_the_start_is_answered_with_number_0() {
    let disturbed = [0, 0, 0, 0, TOGGLE | FAIL_SAFE, 1, 2, 3];
    for first in [FAIL_SAFE, TOGGLE | FAIL_SAFE] {
        let mut device = device();
        let answer = receive(&mut device, &disturbed, 0);
        expect(&answer, 0, CHECK_FAULT | FAIL_SAFE, &[]);
        // The check sum is that of 9.3 for the same octets under number 0.
        assert_eq!(answer, [0, 0, 0, 0, 0x14, 0x46, 0x79, 0x6D]);
        assert!(advance(&mut device, 100_000).is_empty(), "the timer does not run");
        let answer = receive(&mut device, &telegram(0, first, &[]), 100_000);
        expect(&answer, 0, first, &[]);
    }
}

/// The toggle alone would show no edge after a refused telegram.
#[test]
fn a_reset_request_is_an_edge_without_toggle() {
    let mut device = exchanging(3);
    let control = toggle(3) | FAIL_SAFE | RESETS_NUMBER;
    let answer = receive(&mut device, &telegram(0, control, &[]), 0);
    expect(&answer, 0, NUMBER_RESET | FAIL_SAFE | toggle(3), &[]);
    // Held without a new toggle it is none: the timer goes on from 0.
    let answer = receive(&mut device, &telegram(0, control, &[1]), 50);
    expect(&answer, 0, NUMBER_RESET | FAIL_SAFE | toggle(3), &[]);
    assert!(!advance(&mut device, 100).is_empty());
}

/// Black-channel 8.6.
#[test]
fn the_watchdog_expires_when_the_elapsed_time_reaches_it() {
    let mut device = exchanging(3);
    assert!(advance(&mut device, 99).is_empty());
    receive(&mut device, &telegram(4, toggle(4), &OUTPUTS), 99);
    assert!(advance(&mut device, 198).is_empty());
    assert_eq!(device.outputs(), OUTPUTS);
    expect(&advance(&mut device, 199), 4, TIMED_OUT | FAIL_SAFE | toggle(4), &[]);
    assert_eq!(device.outputs(), [0; 4]);
    assert!(advance(&mut device, 10_000).is_empty(), "it expires once");
}

#[test]
fn the_watchdog_is_not_running_before_the_first_telegram() {
    assert!(advance(&mut device(), u64::MAX / MILLISECOND).is_empty());
}

#[test]
fn a_clock_that_runs_backwards_passivates() {
    let mut device = exchanging(3);
    receive(&mut device, &telegram(4, toggle(4), &OUTPUTS), 50);
    assert!(!advance(&mut device, 49).is_empty());
    assert_eq!(device.outputs(), [0; 4]);
}

/// The late telegram is accepted, but the latch of the time-out holds.
#[test]
fn a_right_but_late_telegram_does_not_bring_the_process_values_back() {
    let mut device = exchanging(3);
    let answer = receive(&mut device, &telegram(4, toggle(4), &OUTPUTS), 100);
    expect(&answer, 4, TIMED_OUT | FAIL_SAFE | toggle(4), &[]);
    let answer = receive(&mut device, &telegram(5, toggle(5), &OUTPUTS), 110);
    expect(&answer, 5, TIMED_OUT | FAIL_SAFE | toggle(5), &[]);
    assert_eq!(device.outputs(), [0; 4]);
    let control = toggle(6) | FAIL_SAFE | RESETS_NUMBER;
    let answer = receive(&mut device, &telegram(0, control, &[]), 120);
    expect(&answer, 0, FAIL_SAFE | NUMBER_RESET | toggle(6), &[]);
    receive(&mut device, &telegram(1, toggle(5), &OUTPUTS), 130);
    assert_eq!(device.outputs(), OUTPUTS);
}

#[test]
fn a_device_fault_passivates_until_the_application_clears_it() {
    let mut device = exchanging(3);
    device.set_device_fault(true);
    assert_eq!(device.outputs(), [0; 4]);
    let answer = receive(&mut device, &telegram(4, toggle(4), &OUTPUTS), 0);
    expect(&answer, 4, DEVICE_FAULT | FAIL_SAFE | toggle(4), &[]);
    device.set_device_fault(false);
    let answer = receive(&mut device, &telegram(5, toggle(5), &OUTPUTS), 0);
    expect(&answer, 5, toggle(5), &INPUTS);
}

#[test]
fn every_single_bit_flip_of_an_exchange_is_refused() {
    let before: [Device; 3] = [device(), exchanging(1), exchanging(2)];
    let right = [
        telegram(0, FAIL_SAFE | TOGGLE | RESETS_NUMBER, &[]),
        telegram(2, toggle(2), &OUTPUTS),
        telegram(3, toggle(3), &OUTPUTS),
    ];
    for (before, right) in before.iter().zip(&right) {
        for bit in 0..right.len() * 8 {
            let mut device = *before;
            let mut wrong = right.clone();
            wrong[bit / 8] ^= 1 << (bit % 8);
            let answer = receive(&mut device, &wrong, 0);
            assert_eq!(answer[4] & CHECK_FAULT, CHECK_FAULT, "bit {bit}");
            assert_eq!(answer[..4], [0; 4]);
            assert_eq!(device.outputs(), [0; 4]);
        }
    }
}

/// Lost, repeated, inserted or from elsewhere: the number or CRC1 shows it.
#[test]
fn telegrams_out_of_order_or_of_another_connection_are_refused() {
    let mut foreign = Answer::empty();
    compose(&mut foreign, (0x7023, 4), toggle(4), &OUTPUTS, 4);
    let cases = [
        telegram(2, toggle(2), &OUTPUTS),
        telegram(5, toggle(5), &OUTPUTS),
        telegram(6, toggle(6), &OUTPUTS),
        foreign.octets().to_vec(),
    ];
    for image in cases {
        let mut device = exchanging(3);
        expect(&receive(&mut device, &image, 0), 3, CHECK_FAULT | FAIL_SAFE, &[]);
        assert_eq!(device.outputs(), [0; 4]);
    }
}

/// Design 3.1: value and complement are checked on use.
#[test]
fn every_spoilt_variable_passivates_with_a_device_fault() {
    let changes: [fn(&mut Memory); 10] = [
        |m| m.is_started ^= true,
        |m| m.number ^= 1 << 20,
        |m| m.toggle ^= true,
        |m| m.number_was_reset ^= true,
        |m| m.has_check_fault ^= true,
        |m| m.has_timed_out ^= true,
        |m| m.host_wants_fail_safe ^= true,
        |m| m.has_device_fault ^= true,
        |m| m.is_timed ^= true,
        |m| m.renewed_at_ns ^= 1 << 33,
    ];
    for change in changes {
        let mut device = exchanging(3);
        device.memory.spoil(change);
        assert_eq!(device.outputs(), [0; 4]);
        let control = TOGGLE | FAIL_SAFE | RESETS_NUMBER;
        let answer = receive(&mut device, &telegram(0, control, &[]), 0);
        expect(&answer, 0, DEVICE_FAULT | FAIL_SAFE | NUMBER_RESET | TOGGLE, &[]);
        assert_eq!(device.integrity_faults(), 1);
    }
}

#[test]
fn spoilt_outputs_read_as_zeros() {
    let mut device = exchanging(3);
    device.outputs.spoil();
    assert_eq!(device.outputs(), [0; 4]);
}

/// LNZ-BUS-17, DEC-34: no safety communication with refused parameters.
#[test]
fn a_device_with_refused_parameters_never_answers() {
    let config = Config { outputs: 4, inputs: 4, address: 8, f_parameters: &BLOCK };
    let mut device = Device::new(&config).expect("valid sizes");
    assert_eq!(device.parameter_fault(), Some(ParameterFault::DestinationDiffers));
    for number in 0..3 {
        assert!(receive(&mut device, &telegram(number, toggle(number), &OUTPUTS), 0).is_empty());
    }
    assert!(advance(&mut device, 100_000).is_empty());
    assert_eq!(device.outputs(), [0; 4]);
}

#[test]
fn more_data_than_three_octets_of_crc2_protect_are_refused() {
    let config = Config { outputs: 12, inputs: 12, address: 7, f_parameters: &BLOCK };
    assert!(Device::new(&config).is_ok());
    let outputs = Device::new(&Config { outputs: 13, ..config });
    assert_eq!(outputs.err(), Some(ConfigFault::OutputLength));
    let inputs = Device::new(&Config { inputs: 13, ..config });
    assert_eq!(inputs.err(), Some(ConfigFault::InputLength));
}

#[test]
fn a_telegram_of_wrong_length_is_not_looked_at() {
    let mut device = exchanging(3);
    for length in (0..20).filter(|length| *length != 8) {
        let mut answer = Answer::empty();
        let outcome = device.receive(&[0x20; 20][..length], 0, None, &mut answer);
        assert_eq!(outcome, Outcome::WrongLength);
    }
    assert_eq!(device.outputs(), OUTPUTS);
}
