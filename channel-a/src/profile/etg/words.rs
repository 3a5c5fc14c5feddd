//! Which bit of the words belongs to which function (DEC-41).

use crate::image::Image;
use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::{control, status};

/// DEC-41: function, instance, control bit.
pub(super) const CONTROL: [(u32, u32, u8); 24] = [
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
pub(super) const STATUS: [(u32, u32, u8); 27] = [
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

/// The bit that `[words]` assigns to the function and instance of `reference`; `base` is the
/// first key of the word.
pub(super) fn assigned(image: &Image, base: u32, reference: u32) -> Option<u8> {
    let mut keys = image.keys().filter(|key| (base..base + 0x100).contains(key));
    keys.find(|key| image.value(*key) as u32 == reference).map(|key| key as u8)
}
