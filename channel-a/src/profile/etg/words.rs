//! Which bit of the words belongs to which function (DEC-41).

use crate::image::Image;
use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::{control, status};
use shm_schema::profile::common;

/// DEC-41: function, instance, control bit.
const CONTROL: [(u32, u32, u8); 24] = [
    (etg::SS1, 1, control::SS1_1),
    (etg::SS1, 2, control::SS1_2),
    (etg::SS2, 1, control::SS2_1),
    (etg::SS2, 2, control::SS2_2),
    (etg::SOS, 1, control::SOS_1),
    (etg::SOS, 2, control::SOS_2),
    (etg::SSR, 1, control::SSR_1),
    (etg::SSR, 2, control::SSR_2),
    (etg::SSR, 3, control::SSR_3),
    (etg::SSR, 4, control::SSR_4),
    (etg::SLS, 1, control::SLS_1),
    (etg::SLS, 2, control::SLS_2),
    (etg::SLS, 3, control::SLS_3),
    (etg::SLS, 4, control::SLS_4),
    (etg::SLP, 1, control::SLP_1),
    (etg::SLP, 2, control::SLP_2),
    (etg::SLI, 1, control::SLI_1),
    (etg::SLI, 2, control::SLI_2),
    (etg::SLT, 1, control::SLT_1),
    (etg::SLT, 2, control::SLT_2),
    (etg::SAR, 1, control::SAR_1),
    (etg::SAR, 2, control::SAR_2),
    (etg::SBC, 1, control::SBC_1),
    (etg::STO, 1, control::STO),
];
/// DEC-41: function, instance, status bit.
const STATUS: [(u32, u32, u8); 27] = [
    (etg::SSM, 1, status::SSM_1),
    (etg::SSM, 2, status::SSM_2),
    (etg::SSM, 3, status::SSM_3),
    (etg::SSM, 4, status::SSM_4),
    (etg::SOS, 1, status::SOS_1),
    (etg::SOS, 2, status::SOS_2),
    (etg::SSR, 1, status::SSR_1),
    (etg::SSR, 2, status::SSR_2),
    (etg::SSR, 3, status::SSR_3),
    (etg::SSR, 4, status::SSR_4),
    (etg::SLS, 1, status::SLS_1),
    (etg::SLS, 2, status::SLS_2),
    (etg::SLS, 3, status::SLS_3),
    (etg::SLS, 4, status::SLS_4),
    (etg::SLP, 1, status::SLP_1),
    (etg::SLP, 2, status::SLP_2),
    (etg::SLI, 1, status::SLI_1),
    (etg::SLI, 2, status::SLI_2),
    (etg::SLT, 1, status::SLT_1),
    (etg::SLT, 2, status::SLT_2),
    (etg::SAR, 1, status::SAR_1),
    (etg::SAR, 2, status::SAR_2),
    (etg::SMS, 1, status::SMS),
    (etg::SMA, 1, status::SMA),
    (etg::SCA, 1, status::SCA_1),
    (etg::SCA, 2, status::SCA_2),
    (etg::SBC, 1, status::SBC_1),
];

/// The control bit that requests an instance.
pub(super) fn control_bit(image: &Image, function: u32, instance: u32) -> Option<u8> {
    bit_of(image, common::CONTROL_WORD, &CONTROL, (function, instance))
}

/// The status bit that shows an instance.
pub(super) fn status_bit(image: &Image, function: u32, instance: u32) -> Option<u8> {
    bit_of(image, common::STATUS_WORD, &STATUS, (function, instance))
}

/// The control bits that `[words]` assigns, each with the reference it is to request.
pub(super) fn assignments<'a>(image: &'a Image<'a>) -> impl Iterator<Item = (u8, u32)> + 'a {
    of_word(image, common::CONTROL_WORD)
}

/// `base` is the first key of the word.
fn of_word<'a>(image: &'a Image<'a>, base: u32) -> impl Iterator<Item = (u8, u32)> + 'a {
    let keys = image.keys().filter(move |key| (base..base + 0x100).contains(key));
    keys.map(|key| (key as u8, image.value(key) as u32))
}

fn bit_of(image: &Image, base: u32, defaults: &[(u32, u32, u8)], own: (u32, u32)) -> Option<u8> {
    let mut assigned = of_word(image, base).filter(|row| row.1 == own.0 << 8 | own.1);
    let default = defaults.iter().find(|row| (row.0, row.1) == own);
    assigned.next().map(|row| row.0).or(default.map(|row| row.2))
}
