//! DEC-25, DEC-14: what leaves, and the echo.

use shm_schema::drive::DriveRequest;
use shm_schema::exchange::Start;
use shm_schema::profile::{Profile, common, reference};
use shm_schema::word::Word;

use super::bench::{Bench, NONCE, image};
use crate::{Limits, combine};

/// Design 10, example: the status of a position difference at VALID and SMS.
#[test]
fn an_own_error_shows_sto_and_error_and_clears_the_monitoring_bits() {
    let mut bench = Bench::settled();
    assert_eq!(bench.step().agreement.status, Word::from_u32(0x1000_0100));
    bench.b.position = 1_000;
    assert_eq!(bench.step().agreement.status, Word::from_u32(0x1000_0081));
}

/// DEC-25: active bits by AND, the error bit by OR.
#[test]
fn active_bits_combine_by_and_and_error_bits_by_or() {
    let mut bench = Bench::settled();
    bench.a.status = Word::from_u32(0x1000_1180);
    bench.b.status = Word::from_u32(0x1000_2100);
    assert_eq!(bench.step().agreement.status, Word::from_u32(0x1000_0180));
}

/// DEC-25: the generic profile's SDI bits say "moving", its SBC bit "brake open".
#[test]
fn moving_bits_combine_by_or_and_an_open_brake_by_and() {
    let rules = Limits::from_image(&image(Profile::Etg61002, 1, &[])).status;
    let moving = Word::ZERO.with(5, true).with(20, true);
    assert_eq!(combine::status(&moving, &Word::ZERO, &rules), Word::ZERO.with(5, true));
    assert!(combine::status(&moving, &moving, &rules).bit(20));
}

/// DEC-14, DEC-41: an assigned monitoring bit is silent in STO, an assigned SSM goes on.
#[test]
fn assigned_status_bits_follow_their_function_in_sto() {
    use shm_schema::facts::etg;
    let entries = [
        (common::STATUS_WORD + 40, reference(etg::SLS, 5)),
        (common::STATUS_WORD + 41, reference(etg::SSM, 5)),
    ];
    let rules = Limits::from_image(&image(Profile::Etg61002, 1, &entries)).status;
    let all = Word([u32::MAX; 8]);
    let shown = combine::overlay_sto(&all, &rules, true);
    assert!(!shown.bit(40));
    assert!(shown.bit(41));
}

/// DEC-25: position of A, speed further from zero.
#[test]
fn position_is_a_and_speed_the_one_further_from_zero() {
    let mut bench = Bench::settled();
    (bench.a.position, bench.b.position) = (10, 20);
    (bench.a.speed_mrpm, bench.b.speed_mrpm) = (3_000, -4_000);
    let agreement = bench.step().agreement;
    assert_eq!((agreement.position, agreement.speed_mrpm), (10, -4_000));
}

/// Design 3.3: exchange number, boot nonce and check sum of both reports.
#[test]
fn the_agreement_echoes_both_reports() {
    let mut bench = Bench::settled();
    let agreement = bench.run(4).agreement;
    for echo in [agreement.echo_a, agreement.echo_b] {
        assert_eq!(echo.exchange, bench.exchange);
        assert_eq!(echo.boot_nonce, NONCE);
        assert_eq!(echo.crc32, (bench.exchange as u32).wrapping_mul(3));
    }
    assert_eq!(agreement.exchange, bench.exchange);
}

/// The drive is asked whatever either channel asks that restrains.
#[test]
fn requests_to_the_drive_combine_to_the_safe_side() {
    let a = DriveRequest {
        brake: true,
        deceleration_rpm_s: 500,
        limit_set_point: true,
        set_point_max_mrpm: 1_000,
        set_point_min_mrpm: -3_000,
        brake_open: true,
        outputs: 0b0111,
    };
    let b = DriveRequest {
        brake: false,
        deceleration_rpm_s: 900,
        set_point_max_mrpm: 2_000,
        outputs: 0b0101,
        ..a
    };
    let both = combine::drive(&a, &b);
    assert!(both.brake);
    assert_eq!(both.deceleration_rpm_s, 500);
    assert_eq!((both.set_point_max_mrpm, both.set_point_min_mrpm), (1_000, -3_000));
    assert_eq!(both.outputs, 0b0101);
    let apart =
        combine::drive(&a, &DriveRequest { set_point_min_mrpm: 1_500, set_point_max_mrpm: 1_600, ..a });
    assert_eq!((apart.set_point_max_mrpm, apart.set_point_min_mrpm), (0, 0));
}

/// Lenze and ATV show their own codes.
#[test]
fn the_other_profiles_show_their_nearest_code() {
    let single = |profile, speed| {
        let mut bench = Bench::with(&image(profile, 1, &[]), Start::Settled);
        bench.b.speed_mrpm = speed;
        bench.step().agreement.errors.codes[0]
    };
    assert_eq!(single(Profile::LenzeSm301, 400_000).code, 212);
    assert_eq!(single(Profile::Atv340, 400_000).code, 0x02C);
    assert_eq!(single(Profile::Etg61002, 400_000).code, 0xFF06);
    assert!(single(Profile::Etg61002, 315_000).is_none());
}
