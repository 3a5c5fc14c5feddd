//! Sets of the generic profile that would leave something out without a word.

use std::vec::Vec;

use shm_schema::facts::etg as f;
use shm_schema::profile::{Profile, common, etg_key, reference};

use super::bench::image;

fn refusals(entries: &[(u32, i64)]) -> Vec<(u32, u32, u32, u32)> {
    let mut sorted = entries.to_vec();
    sorted.sort_unstable();
    let mut found = Vec::new();
    crate::findings(&image(Profile::Etg61002, &sorted), &mut |code| {
        found.push((code.code, code.info1, code.info2, code.info3));
    });
    found
}

#[test]
fn what_nothing_can_request_is_refused() {
    // DEC-41: a bit, an error that names it, or the SS2 whose windows it holds
    let sls_5 = (etg_key(f::SLS, 5, f::sls::VELOCITY_LIMIT), 100);
    let bit = |bit: u32, function: u32, instance: u32| {
        (common::CONTROL_WORD + bit, i64::from(reference(function, instance)))
    };
    assert_eq!(refusals(&[sls_5]), [(3605, f::SLS, 5, 0)]);
    assert_eq!(refusals(&[sls_5, bit(32, f::SLS, 5)]), []);
    let ss1_3 = (etg_key(f::SS1, 3, f::ss1::TIME_TO_STO), 100);
    let names =
        |instance| (etg_key(f::SLS, 1, f::sls::ERROR_REACTION), i64::from(reference(f::SS1, instance)));
    assert_eq!(refusals(&[ss1_3, names(1)]), [(3605, f::SS1, 3, 0)]);
    assert_eq!(refusals(&[ss1_3, names(3)]), []);
    let sos_3 = (etg_key(f::SOS, 3, f::sos::POSITION_ZERO_WINDOW), 100);
    let ss2_3 = (etg_key(f::SS2, 3, f::ss2::TIME_TO_SOS), 100);
    let itself = (etg_key(f::SS2, 3, f::ss2::ERROR_REACTION), i64::from(reference(f::SS2, 3)));
    assert_eq!(refusals(&[sos_3]), [(3605, f::SOS, 3, 0)]);
    assert_eq!(refusals(&[sos_3, ss2_3, bit(40, f::SS2, 3)]), []);
    assert_eq!(refusals(&[sos_3, ss2_3, itself]), [(3605, f::SS2, 3, 0)]);
}

#[test]
fn a_bit_that_would_request_nothing_is_refused() {
    // DEC-41: the second bit of an instance, and functions that have bits of their own
    let sls = (etg_key(f::SLS, 5, f::sls::VELOCITY_LIMIT), 100);
    let bit = |bit: u32, function: u32, instance: u32| {
        (common::CONTROL_WORD + bit, i64::from(reference(function, instance)))
    };
    assert_eq!(refusals(&[sls, bit(32, f::SLS, 5), bit(33, f::SLS, 5)]), [(3605, f::SLS, 5, 0)]);
    assert_eq!(refusals(&[bit(32, f::STO, 1)]), [(3605, f::STO, 1, 0)]);
}

#[test]
fn a_second_brake_is_refused() {
    // ETG-SBC-08
    let brake = |instance, delay| (etg_key(f::SBC, instance, f::sbc::BRAKE_TIME_DELAY), delay);
    assert_eq!(refusals(&[brake(2, 100)]), []);
    assert_eq!(refusals(&[brake(1, 100), brake(2, 50)]), [(3605, f::SBC, 2, 0)]);
}
