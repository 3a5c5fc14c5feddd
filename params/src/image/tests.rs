use super::*;

fn example() -> AxisSet {
    let mut set = AxisSet::delivery(Profile::AmkKw, 3, "SIM-0001");
    set.values.insert(67, 3_000);
    set.values.insert(34, -5);
    set
}

/// Design 7: both encodings say the same.
#[test]
fn both_encodings_read_back_to_the_same_set() {
    let set = example();
    let a = Image::read(&set.image_a(true)).expect("A reads");
    let b = Image::read(&set.image_b(true)).expect("B reads");
    assert_eq!(a, b);
    assert_eq!(a.values, set.values);
    assert_eq!((a.profile(), a.axis, a.validated), (Some(Profile::AmkKw), 3, true));
    assert_eq!(a.serial, "SIM-0001");
    assert_eq!(a.signatures, set.signatures());
}

#[test]
fn the_encodings_differ_in_every_octet_order_and_sign() {
    let set = example();
    let a = set.image_a(false);
    let b = set.image_b(false);
    assert_eq!(a.len(), b.len());
    assert_eq!(&a[..4], b"SPI1");
    assert_eq!(b[..4], [!b'1', !b'I', !b'P', !b'S']);
}

#[test]
fn any_flipped_bit_is_seen_in_either_encoding() {
    let set = example();
    for image in [set.image_a(true), set.image_b(true)] {
        for bit in 0..image.len() * 8 {
            let mut damaged = image.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(Image::read(&damaged).is_err(), "bit {bit}");
        }
    }
}

#[test]
fn a_shortened_image_is_refused() {
    let image = example().image_a(true);
    for length in 0..image.len() {
        assert!(Image::read(&image[..length]).is_err(), "{length} octets");
    }
}

/// The check value of each polynomial over "123456789", from the catalogue of CRC algorithms.
#[test]
fn the_check_sums_are_the_named_ones() {
    assert_eq!(CRC32.checksum(b"123456789"), 0xCBF4_3926);
    assert_eq!(CRC32C.checksum(b"123456789"), 0xE306_9283);
}

/// AMKP: content and device signature; the serial number counts in the device's only.
#[test]
fn the_serial_number_changes_the_device_signature_only() {
    let one = example();
    let other = AxisSet { serial: "SIM-0002".into(), ..example() };
    assert_eq!(one.signatures().template, other.signatures().template);
    assert_eq!(one.signatures().content, other.signatures().content);
    assert_ne!(one.signatures().device, other.signatures().device);
}

#[test]
fn a_value_changes_the_content_signature_and_not_the_template() {
    let one = example();
    let mut other = example();
    other.values.insert(67, 3_001);
    assert_eq!(one.signatures().template, other.signatures().template);
    assert_ne!(one.signatures().content, other.signatures().content);
}

/// Pinned, so that no reader of old images is surprised: computed by hand with Python's zlib.
#[test]
fn signatures_of_a_known_set_stay_what_they_are() {
    let set = AxisSet { values: BTreeMap::from([(67, 3_000), (68, 0)]), ..example() };
    let signatures = set.signatures();
    assert_eq!(signatures.template, 0x6A12_9CCF);
    assert_eq!(signatures.content, 0x9110_868A);
    assert_eq!(signatures.device, 0x16B8_CC8E);
}

/// black-channel.md 2.7: its vector 00 … 0F as two entries.
#[test]
fn the_sra_crc_is_over_keys_and_values_low_octet_first() {
    let values = BTreeMap::from([(0x0302_0100, 0x0706_0504), (0x0B0A_0908, 0x0F0E_0D0C)]);
    assert_eq!(AxisSet { values, ..example() }.sra_crc(), 0x0CD4_BE50);
}
