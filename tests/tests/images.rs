//! A safety image with one wrong bit is refused by each channel on its own (design 8: no start).

use params::AxisSet;
use shm_schema::exchange::{CellFault, Inputs, Setup, Start};
use shm_schema::profile::Profile;
use shm_schema::report::Phase;

/// A step of a monitor that has heard nothing.
const NOTHING: Inputs = Inputs {
    encoder: Err(CellFault::Missing),
    motion: None,
    io: Err(CellFault::Missing),
    command: Err(CellFault::Missing),
    partner: Err(CellFault::Missing),
    agreement: Err(CellFault::Missing),
    readback: Err(CellFault::Missing),
    published: None,
    overruns: 0,
    image_sound: true,
};

const PROFILES: [Profile; 4] = [Profile::AmkKw, Profile::LenzeSm301, Profile::Atv340, Profile::Etg61002];

fn setup() -> Setup {
    Setup::new(1, 7, Start::Cold)
}

/// Phase and permission of channel A and of channel B with these octets.
fn start_a(image: &[u8]) -> (Phase, bool) {
    let outputs = channel_a::Monitor::new(image, &setup()).step(&NOTHING, 1_000_000);
    (outputs.report.phase, outputs.inhibit.permit)
}

fn start_b(image: &[u8]) -> (Phase, bool) {
    let outputs = channel_b::Monitor::new(image, &setup()).step(&NOTHING, 1_000_000);
    (outputs.report.phase, outputs.inhibit.permit)
}

/// The image with each of its bits turned, one at a time.
fn flipped(image: &[u8], mut judge: impl FnMut(usize, &[u8])) {
    let mut octets = image.to_vec();
    for bit in 0..8 * octets.len() {
        octets[bit / 8] ^= 1 << (bit % 8);
        judge(bit, &octets);
        octets[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn each_channel_refuses_its_image_with_any_bit_flipped() {
    for profile in PROFILES {
        let set = AxisSet::delivery(profile, 1, "SIM-1");
        let name = profile.name();
        flipped(&set.image_a(true), |bit, image| {
            assert_eq!(start_a(image), (Phase::Refused, false), "{name}, A, bit {bit}");
        });
        flipped(&set.image_b(true), |bit, image| {
            assert_eq!(start_b(image), (Phase::Refused, false), "{name}, B, bit {bit}");
        });
    }
}

#[test]
fn each_channel_refuses_the_other_ones_image_and_one_of_another_axis() {
    let set = AxisSet::delivery(Profile::AmkKw, 1, "SIM-1");
    let other = AxisSet { number: 2, ..set.clone() };
    for image in [set.image_b(true), other.image_a(true), Vec::new()] {
        assert_eq!(start_a(&image), (Phase::Refused, false));
    }
    for image in [set.image_a(true), other.image_b(true), Vec::new()] {
        assert_eq!(start_b(&image), (Phase::Refused, false));
    }
}

/// The control: an image as it was sealed is not refused.
#[test]
fn each_channel_starts_with_a_sound_image() {
    let set = AxisSet::delivery(Profile::AmkKw, 1, "SIM-1");
    assert_ne!(start_a(&set.image_a(true)).0, Phase::Refused);
    assert_ne!(start_b(&set.image_b(true)).0, Phase::Refused);
}
