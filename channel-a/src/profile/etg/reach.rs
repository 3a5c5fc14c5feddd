//! What nothing can request: it would be left out without a word (DEC-41).

use super::super::no_place;
use super::build::reference;
use super::object::instances;
use super::words::{assignments, control_bit};
use crate::image::Image;
use shm_schema::error::ErrorCode;
use shm_schema::facts::etg;

/// What a bit of the control word can request; the others have bits of their own, or none.
const REQUESTABLE: [u32; 10] =
    [etg::SS1, etg::SS2, etg::SBC, etg::SOS, etg::SSR, etg::SAR, etg::SLS, etg::SLP, etg::SLT, etg::SLI];
/// Objects that name the stop an error starts.
const REACTIONS: [(u32, u32); 9] = [
    (etg::SS2, etg::ss2::ERROR_REACTION),
    (etg::SSR, etg::ssr::ERROR_REACTION),
    (etg::SAR, etg::sar::ERROR_REACTION),
    (etg::SLS, etg::sls::ERROR_REACTION),
    (etg::SLP, etg::slp::ERROR_REACTION),
    (etg::SMS, etg::sms::ERROR_REACTION),
    (etg::SLT, etg::slt::ERROR_REACTION),
    (etg::SMA, etg::sma::ERROR_REACTION),
    (etg::SLI, etg::sli::ERROR_REACTION),
];

/// Instances that nothing requests, and bits that request nothing.
pub fn findings(image: &Image, report: &mut dyn FnMut(ErrorCode)) {
    for (function, instance) in instances(image) {
        if !is_reached(image, function, instance) {
            report(no_place(reference(function, instance)));
        }
    }
    for (bit, wanted) in assignments(image) {
        let again = control_bit(image, wanted >> 8, wanted & 0xFF) != Some(bit);
        if again | !REQUESTABLE.contains(&(wanted >> 8)) {
            report(no_place(wanted));
        }
    }
}

fn is_reached(image: &Image, function: u32, instance: u32) -> bool {
    if !REQUESTABLE.contains(&function) || control_bit(image, function, instance).is_some() {
        return true;
    }
    match function {
        // It follows STO.
        etg::SBC => true,
        etg::SS1 | etg::SS2 => is_a_reaction(image, reference(function, instance)),
        // ETG-SS2-02: it holds the windows of the SS2 with its number.
        etg::SOS => instances(image).any(|other| other == (etg::SS2, instance)),
        _ => false,
    }
}

/// An error of another instance starts it.
fn is_a_reaction(image: &Image, stop: u32) -> bool {
    let mut keys = image.keys().filter(|key| REACTIONS.contains(&(key >> 16, key & 0xFF)));
    keys.any(|key| (key >> 8 != stop) & (image.value(key) as u32 == stop))
}
