//! The sequences and examples of the ATV catalogue, by their ids. One pole pair: 1 Hz is 60 rpm.

use shm_schema::facts::atv340::{control, status};
use shm_schema::profile::Profile;

use crate::model::script::Script;

/// The read-back example ATV-EX-08 (frequencies in tenths), one pole pair.
const BASE: [(u32, i32); 21] = [
    (2, 1),
    (4, 40),
    (30, 200),
    (31, 100),
    (32, 50),
    (33, 50),
    (34, 5),
    (35, 0),
    (36, 1),
    (39, 2),
    (40, 100),
    (41, 100),
    (43, 20),
    (46, 50),
    (48, 200),
    (50, 100),
    (54, 300),
    (56, 0),
    (65, 1),
    (66, 1),
    (57, 450),
];

fn script(changes: &[(u32, i32)]) -> Script {
    let all: Vec<(u32, i32)> = BASE.iter().chain(changes).copied().collect();
    Script::new(Profile::Atv340, &all)
}

fn hertz(value: f64) -> f64 {
    60.0 * value
}

/// ATV-SEQ-01, ATV-SEQ-02, ATV-EX-13, ATV-EX-14, ATV-SS1-12
#[test]
fn ss1_ends_in_sto_at_the_standstill_level_and_is_held_by_its_request() {
    let played = script(&[])
        .speed(&[(0, hertz(50.0)), (10, hertz(50.0)), (4510, hertz(5.0))])
        .bit(10, control::SS1, true)
        .bit(4800, control::SS1, false)
        .run(4810);
    assert!(played.bit(10, status::SS1));
    assert_eq!(played.first(status::STO, true), Some(4510));
    assert!(!played.bit(4510, status::SAFETY_ERROR));
    assert!(played.bit(4799, status::STO) && !played.bit(4800, status::STO));
}

/// ATV-SEQ-01, ATV-EX-13
#[test]
fn the_ss1_line_falls_from_the_highest_frequency_of_the_delay_plus_the_offset() {
    // 45 Hz one second after the delay
    let at = |speed: f64| {
        let corners = [
            (0, hertz(50.0)),
            (5, hertz(50.0)),
            (200, hertz(speed)),
            (1005, hertz(speed)),
            (1006, hertz(40.0)),
        ];
        script(&[]).speed(&corners).bit(0, control::SS1, true).run(1010)
    };
    assert_eq!(at(45.0).first(status::SAFETY_ERROR, true), None);
    let over = at(45.1);
    assert_eq!(over.first(status::SAFETY_ERROR, true), Some(996));
    assert_eq!(over.crosscheck(996).errors, [[0x011, 0, 0, 0]]);
}

/// ATV-SS1-11, DEC-48
#[test]
fn after_a_withdrawn_request_sto_lasts_a_tenth_of_a_second() {
    let played = script(&[])
        .speed(&[(0, hertz(10.0)), (100, hertz(4.0))])
        .bit(10, control::SS1, true)
        .bit(20, control::SS1, false)
        .run(300);
    // 5 Hz are reached at 83.3 ms
    assert_eq!(played.first(status::STO, true), Some(84));
    assert!(played.bit(183, status::STO) && !played.bit(184, status::STO));
    assert!(played.crosscheck(185).torque);
}

/// ATV-SS1-09
#[test]
fn the_fifth_violated_ss1_needs_the_power_off() {
    let mut running = script(&[(35, 1), (32, 0), (34, 0)]).speed(&[(0, hertz(50.0))]);
    for round in 0..5 {
        let start = 10 + 100 * round;
        running = running
            .bit(start, control::SS1, true)
            .bit(start + 50, control::SS1, false)
            .bit(start + 60, control::SAFETY_RESET, true)
            .bit(start + 70, control::SAFETY_RESET, false);
    }
    let played = running.run(520);
    assert_eq!(played.crosscheck(315).errors, [[0x011, 0, 0, 0]]);
    assert!(played.crosscheck(400).errors.is_empty());
    assert_eq!(played.crosscheck(415).errors, [[0x068, 0, 0, 0]]);
    assert_eq!(played.crosscheck(520).errors, [[0x068, 0, 0, 0]]);
}

/// ATV-SEQ-03, ATV-SLST1-01 to 04
#[test]
fn sls_type_1_by_zone() {
    let at = |speed: f64| script(&[(39, 1)]).speed(&[(0, hertz(speed))]).bit(10, control::SLS, true).run(20);
    for (speed, error, sto) in [
        (20.1, true, true),
        (20.0, false, false),
        (5.0, false, false),
        (4.9, false, true),
        (-10.0, false, false),
    ] {
        let played = at(speed);
        assert_eq!(played.bit(10, status::SAFETY_ERROR), error, "{speed}");
        assert_eq!(played.bit(10, status::STO), sto, "{speed}");
    }
    assert_eq!(at(20.1).crosscheck(10).errors, [[0x0AB, 0, 0, 0]]);
}

/// ATV-SEQ-04, ATV-SEQ-08, ATV-SLST2-01, ATV-SLST2-02
#[test]
fn sls_types_2_and_5_follow_a_line_from_above() {
    for sls_type in [2, 5] {
        let with = |slope_end: i64| {
            script(&[(39, sls_type)])
                .speed(&[(0, hertz(40.0)), (10, hertz(40.0)), (slope_end, hertz(10.0))])
                .bit(10, control::SLS, true)
                .run(3100)
        };
        // 10 Hz/s as configured
        assert_eq!(with(3010).first(status::SAFETY_ERROR, true), None);
        let slow = with(6010);
        let at = slow.first(status::SAFETY_ERROR, true).expect("too slow");
        assert_eq!(slow.crosscheck(at).errors, [[0x0A9, 0, 0, 0]]);
        // 5 Hz/s fall behind by 2 Hz after 400 ms
        assert_eq!(at, 411);
    }
}

/// ATV-SEQ-05, ATV-SLST2-06, ATV-SLST3-04
#[test]
fn sls_types_2_and_3_wait_for_the_standstill_level() {
    for sls_type in [2, 3] {
        let waiting = |corners: &[(i64, f64)]| {
            script(&[(39, sls_type)]).speed(corners).bit(10, control::SLS, true).run(600)
        };
        let still = waiting(&[(0, 0.0)]);
        assert_eq!(still.first(status::STO, true), Some(310));
        assert!(!still.bit(310, status::SAFETY_ERROR));
        let moving = waiting(&[(0, 0.0), (10, 0.0), (110, hertz(10.0)), (500, hertz(10.0)), (510, 0.0)]);
        // below 5 Hz again at 505 ms
        assert_eq!(moving.first(status::STO, true), Some(506));
    }
}

/// ATV-SEQ-06, ATV-SLST3-05, ATV-SLST6-04
#[test]
fn sls_types_3_and_6_brake_from_above_by_ss1() {
    for sls_type in [3, 6] {
        let played = script(&[(39, sls_type)])
            .speed(&[(0, hertz(25.0)), (10, hertz(25.0)), (2010, hertz(5.0))])
            .bit(10, control::SLS, true)
            .bit(100, control::SLS, false)
            .run(2200);
        assert!(played.bit(10, status::SS1) && played.bit(200, status::SS1));
        assert_eq!(played.first(status::STO, true), Some(2010));
        assert!(played.bit(2109, status::STO) && !played.bit(2110, status::STO));
    }
}

/// ATV-SEQ-07, ATV-SLST4-01 to 04
#[test]
fn sls_type_4_permits_both_directions_and_standstill() {
    let played = script(&[(39, 4)])
        .speed(&[
            (0, hertz(15.0)),
            (10, hertz(15.0)),
            (100, hertz(-20.0)),
            (200, hertz(-20.0)),
            (201, hertz(-20.1)),
        ])
        .bit(10, control::SLS, true)
        .run(210);
    assert_eq!(played.first(status::SAFETY_ERROR, true), Some(201));
    assert_eq!(played.crosscheck(201).errors, [[0x0AB, 0, 0, 0]]);
}

/// ATV-SEQ-09, the table of SMS modes, ATV-SMS-10
#[test]
fn sms_by_mode_and_bit() {
    let run = |mode: i32, bit: bool, speed: f64| {
        let thresholds = [(56, mode), (57, 450), (58, 400), (59, 300), (60, 200)];
        script(&thresholds).speed(&[(0, hertz(speed))]).bit(0, control::SMS_SWITCH, bit).run(3)
    };
    let rows: [(i32, bool, f64, Option<u32>); 10] = [
        (0, false, 100.0, None),
        (0, true, 0.0, Some(0x158)),
        (1, false, 45.0, None),
        (1, false, 45.1, Some(0x0B4)),
        (1, true, -40.1, Some(0x0B5)),
        (2, false, 31.0, None),
        (2, true, 30.1, Some(0x0B4)),
        (2, true, -20.1, Some(0x0B5)),
        (3, false, 100.0, None),
        (3, true, 45.1, Some(0x0B4)),
    ];
    for (mode, bit, speed, code) in rows {
        let played = run(mode, bit, speed);
        let expected: Vec<[u32; 4]> = code.into_iter().map(|code| [code, 0, 0, 0]).collect();
        assert_eq!(played.crosscheck(0).errors, expected, "mode {mode}, bit {bit}, {speed} Hz");
        let shown = expected.is_empty() && mode != 0 && (mode != 3 || bit);
        assert_eq!(played.bit(0, status::SMS), shown);
    }
}

/// ATV-PSF-07, ATV-SS1-18, ATV-SLS-13, DEC-33
#[test]
fn what_is_reserved_or_not_configured_is_refused_while_it_stands() {
    let rows = [(control::SS1, 0x156), (control::SLS, 0x157), (5, 0x152)];
    for (bit, code) in rows {
        let played = script(&[(65, 0), (66, 0)])
            .bit(10, bit, true)
            .bit(20, control::SAFETY_RESET, true)
            .bit(30, control::SAFETY_RESET, false)
            .bit(30, bit, false)
            .bit(40, control::SAFETY_RESET, true)
            .run(50);
        assert_eq!(played.crosscheck(25).errors, [[code, 0, 0, 0]]);
        assert!(played.bit(39, status::STO) && !played.bit(40, status::STO));
    }
}

/// ATV-EX-02, DEC-32
#[test]
fn frequencies_are_electrical() {
    let at = |speed: f64| script(&[(2, 2), (56, 1), (58, 450)]).speed(&[(0, speed)]).run(2);
    // 45 Hz with two pole pairs are 1,350 rpm
    assert_eq!(at(1350.0).first(status::SAFETY_ERROR, true), None);
    assert_eq!(at(1350.001).first(status::SAFETY_ERROR, true), Some(0));
}
