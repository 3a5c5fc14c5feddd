//! Both protocols behind the one interface that the shell uses.

use super::*;

const F_PARAMETERS: [u8; 10] = [0x08, 0x40, 0, 1, 0, 7, 0, 0x64, 0x70, 0x22];

fn fsoe() -> Slave {
    Slave::new(&Config::Fsoe(FsoeConfig {
        output_length: 2,
        input_length: 2,
        address: 5,
        session_id: 0x0102,
        application_parameters: &[],
        watchdog_ms: (1, u16::MAX),
    }))
    .unwrap()
}

fn profisafe() -> Slave {
    Slave::new(&Config::Profisafe(ProfisafeConfig {
        output_length: 4,
        input_length: 4,
        address: 7,
        f_parameters: &F_PARAMETERS,
        ipar_crc: None,
        lowest_watchdog_ms: 1,
        device_fault: DeviceFaultReport::StatusBit,
    }))
    .unwrap()
}

/// Design 9: the two channels' parts of a frame make the frame, and the data
/// part alone is refused by a partner.
#[test]
fn the_parts_of_both_channels_make_one_frame() {
    let reset = [0x2A, 0, 0, 0xC4, 0x2D, 0, 0];
    let answer = fsoe().frame(&reset, None, 0).unwrap().unwrap();
    assert_eq!(answer.octets(), reset);
    assert_eq!(answer.data_part().octets(), [0x2A, 0, 0, 0, 0, 0, 0]);
    let host = [0, 0, 0, 0, 0x34, 0xAC, 0xB4, 0xB2];
    let status = profisafe().frame(&host, None, 0).unwrap().unwrap();
    assert_eq!(status.octets(), [0, 0, 0, 0, 0x70, 0xBC, 0x00, 0x20]);
    for whole in [answer, status] {
        let check = whole.check_part();
        let merged = whole.data_part().with_check_octets_of(check.octets());
        assert_eq!(merged.unwrap().octets(), whole.octets());
    }
}

/// black-channel.md 3.6, 8.6.
#[test]
fn nothing_is_sent_before_the_first_frame() {
    for mut slave in [fsoe(), profisafe()] {
        assert_eq!(slave.advance(u64::MAX), None);
        assert!(slave.outputs().iter().all(|octet| *octet == 0));
        assert!(!slave.outputs_valid());
        assert_eq!(slave.digest(), 0);
    }
}

/// black-channel.md 2.1, 7.3: lengths are judged before content.
#[test]
fn a_frame_of_another_length_is_refused() {
    let refused = |slave: &mut Slave, length| {
        let frame = [0x2A; 16];
        slave.frame(frame.get(..length).unwrap(), None, 0).err()
    };
    let fault = |expected, received| Some(LengthFault { expected, received });
    assert_eq!(refused(&mut fsoe(), 8), fault(7, 8));
    assert_eq!(refused(&mut profisafe(), 7), fault(8, 7));
}

/// Design 9: report A carries the id of the present session; 0 before the first one.
#[test]
fn the_session_id_is_reported() {
    let mut slave = fsoe();
    assert_eq!(slave.session_id(), 0);
    slave.frame(&[0x4E, 0xEF, 0xBE, 0x27, 0x5E, 0, 0], None, 0).unwrap();
    assert_eq!(slave.session_id(), 0x0102);
    assert_eq!(profisafe().session_id(), 0);
}

/// black-channel.md 3.2, 8.3: an image that is ignored before the start was not processed.
#[test]
fn an_ignored_first_image_leaves_the_digest_alone() {
    for (mut slave, length) in [(fsoe(), 7), (profisafe(), 8)] {
        let image = [0; 8];
        assert_eq!(slave.frame(image.get(..length).unwrap(), None, 0), Ok(None));
        assert_eq!(slave.digest(), 0);
    }
    let mut slave = fsoe();
    let reset = [0x2A, 0, 0, 0xC4, 0x2D, 0, 0];
    slave.frame(&reset, None, 0).unwrap();
    let processed = slave.digest();
    assert_eq!(processed, frame_digest(&reset));
    assert_eq!(slave.frame(&[0; 7], None, 0), Ok(None));
    assert_eq!(slave.digest(), processed);
    assert!(slave.frame(&reset, None, 0).unwrap().is_some(), "the ignored image was still seen");
}
