//! The sequences and examples of the ETG catalogue, by their ids.

use shm_schema::facts::etg;
use shm_schema::facts::etg_6100_2::{control, status};
use shm_schema::profile::{Profile, etg_key, reference};

use crate::model::script::Script;

fn key(function: u32, object: u32) -> u32 {
    etg_key(function, 1, object)
}

/// Automatic restart, so that each test asks for what it is about.
fn script(objects: &[(u32, i32)]) -> Script {
    let mut all = vec![(key(etg::STO, etg::sto::RESTART_ACKNOWLEDGE_BEHAVIOR), 0)];
    all.extend_from_slice(objects);
    Script::new(Profile::Etg61002, &all)
}

fn ss1(objects: &[(u32, i32)]) -> Script {
    let all: Vec<(u32, i32)> =
        objects.iter().map(|(object, value)| (key(etg::SS1, *object), *value)).collect();
    script(&all)
}

/// ETG-SEQ-01, ETG-SS1-01
#[test]
fn ss1_by_time_ends_at_its_time_whatever_the_speed_without_a_window() {
    let played =
        ss1(&[(etg::ss1::TIME_TO_STO, 300)]).speed(&[(0, 900.0)]).bit(10, control::SS1_1, false).run(400);
    assert_eq!(played.first(status::STO, true), Some(310));
    assert_eq!(played.first(status::ERROR, true), None);
}

/// ETG-SEQ-01, ETG-SS1-02, ETG-SS1-11
#[test]
fn ss1_ends_early_after_dwelling_at_zero_and_fails_outside_its_window() {
    let objects = [
        (etg::ss1::TIME_TO_STO, 300),
        (etg::ss1::VELOCITY_ZERO_WINDOW, 10),
        (etg::ss1::TIME_FOR_VELOCITY_ZERO, 50),
    ];
    let early = ss1(&objects).speed(&[(0, 900.0), (100, 0.0)]).bit(10, control::SS1_1, false).run(400);
    // 10 rpm are reached at 98.9 ms
    assert_eq!(early.first(status::STO, true), Some(99 + 50));
    let late = ss1(&objects).speed(&[(0, 900.0)]).bit(10, control::SS1_1, false).run(400);
    assert_eq!(late.first(status::STO, true), Some(310));
    assert!(late.bit(310, status::ERROR) && !late.bit(309, status::ERROR));
}

/// ETG-SEQ-02, ETG-SS1-10, DEC-05
#[test]
fn ss1_follows_the_displaced_line() {
    let objects = [
        (etg::ss1::TIME_TO_STO, 1000),
        (etg::ss1::VELOCITY_ZERO_WINDOW, 10),
        (etg::ss1::DECELERATION_LIMIT, 3000),
        (etg::ss1::TIME_DELAY_DECELERATION_MONITORING, 100),
    ];
    let on =
        ss1(&objects).speed(&[(0, 910.0), (110, 910.0), (410, 10.0)]).bit(10, control::SS1_1, false).run(500);
    assert_eq!(on.first(status::STO, true), Some(410));
    assert_eq!(on.first(status::ERROR, true), None);
    let off = ss1(&objects).speed(&[(0, 910.0)]).bit(10, control::SS1_1, false).run(500);
    assert_eq!(off.first(status::ERROR, true), Some(111));
    assert!(off.bit(111, status::STO));
}

/// ETG-EX-03, ETG-SS1-05, DEC-04
#[test]
fn ss1_takes_its_slope_from_the_maximum_speed_when_only_times_are_given() {
    let played = script(&[
        (key(etg::SS1, etg::ss1::TIME_TO_STO), 1000),
        (key(etg::SS1, etg::ss1::TIME_DELAY_DECELERATION_MONITORING), 200),
        (key(etg::SMS, etg::sms::VELOCITY_MAXIMUM_POSITIVE), 3000),
        (key(etg::SMS, etg::sms::VELOCITY_MAXIMUM_NEGATIVE), 3000),
    ])
    .speed(&[(0, 1500.0), (200, 1500.0), (600, 0.0)])
    .bit(0, control::SS1_1, false)
    .run(700);
    // 3,750 rpm/s from 1,500 rpm end 400 ms after the delay
    assert_eq!(played.first(status::STO, true), Some(600));
    assert_eq!(played.first(status::ERROR, true), None);
}

/// ETG-SEQ-03, ETG-SBC-02
#[test]
fn the_brake_closes_with_sto_and_with_its_control_bit() {
    let played = script(&[(key(etg::SBC, etg::sbc::BRAKE_TIME_DELAY), 50)])
        .bit(10, control::SBC_1, false)
        .bit(20, control::SBC_1, true)
        .bit(30, control::STO, false)
        .bit(40, control::STO, true)
        .run(50);
    let open: Vec<bool> = [9, 10, 20, 30, 39, 40].iter().map(|at| played.bit(*at, status::SBC_1)).collect();
    assert_eq!(open, [true, false, true, false, false, true]);
}

/// ETG-SEQ-04, ETG-SEQ-05, ETG-EX-06
#[test]
fn ss1_closes_the_brake_in_time_for_sto() {
    let objects = [
        (key(etg::SS1, etg::ss1::TIME_TO_STO), 1000),
        (key(etg::SS1, etg::ss1::VELOCITY_ZERO_WINDOW), 10),
        (key(etg::SS1, etg::ss1::TIME_FOR_VELOCITY_ZERO), 20),
        (key(etg::SS1, etg::ss1::ACTIVATE_SBC), reference(etg::SBC, 1)),
        (key(etg::SBC, etg::sbc::BRAKE_TIME_DELAY), 150),
    ];
    let early = script(&objects).speed(&[(0, 100.0), (100, 0.0)]).bit(0, control::SS1_1, false).run(1100);
    assert_eq!(early.first(status::SBC_1, false), Some(110));
    assert_eq!(early.first(status::STO, true), Some(260));
    let late = script(&objects)
        .speed(&[(0, 100.0), (900, 100.0), (950, 0.0)])
        .bit(0, control::SS1_1, false)
        .run(1100);
    assert_eq!(late.first(status::SBC_1, false), Some(850));
    assert_eq!(late.first(status::STO, true), Some(1000));
}

/// ETG-SEQ-06, ETG-SOS-01, ETG-SOS-04
#[test]
fn sos_latches_its_position_and_violation_is_sto() {
    let objects = [(key(etg::SOS, etg::sos::POSITION_ZERO_WINDOW), 100)];
    let played =
        script(&objects).speed(&[(0, 0.0), (50, 0.0), (51, 10.0)]).bit(10, control::SOS_1, false).run(200);
    assert!(played.bit(10, status::SOS_1));
    // 10.9 increments per ms, 5.5 in the first
    assert_eq!(played.first(status::STO, true), Some(60));
    assert!(played.bit(60, status::ERROR) && !played.bit(60, status::SOS_1));
}

/// ETG-SEQ-07, ETG-SEQ-08, ETG-SS2-02, ETG-RST-02
#[test]
fn ss2_ends_in_its_sos_and_is_left_by_its_own_restart_rule() {
    let objects = [
        (key(etg::SS2, etg::ss2::TIME_TO_SOS), 200),
        (key(etg::SOS, etg::sos::POSITION_ZERO_WINDOW), 100),
        (key(etg::SOS, etg::sos::VELOCITY_ZERO_WINDOW), 10),
    ];
    let played = script(&objects)
        .speed(&[(0, 500.0), (200, 0.0)])
        .bit(10, control::SS2_1, false)
        .bit(250, control::SS2_1, true)
        .bit(260, control::RESTART_ACKNOWLEDGE, true)
        .run(300);
    assert_eq!(played.first(status::SOS_1, true), Some(210));
    assert!(played.crosscheck(210).torque);
    assert_eq!(played.first(status::RESTART_ACKNOWLEDGE_REQUEST, true), Some(250));
    assert!(played.bit(259, status::SOS_1) && !played.bit(260, status::SOS_1));
    assert!(!played.bit(260, status::RESTART_ACKNOWLEDGE_REQUEST));
}

/// ETG-SEQ-09 to 12, ETG-EX-04, ETG-EX-05
#[test]
fn ssr_and_sls_monitor_at_their_time_or_when_the_line_arrives() {
    let sms = [
        (key(etg::SMS, etg::sms::VELOCITY_MAXIMUM_POSITIVE), 3000),
        (key(etg::SMS, etg::sms::VELOCITY_MAXIMUM_NEGATIVE), 2000),
    ];
    let by_time = script(&[
        (key(etg::SLS, etg::sls::TIME_TO_VELOCITY_MONITORING), 300),
        (key(etg::SLS, etg::sls::VELOCITY_LIMIT), 500),
    ])
    .speed(&[(0, 501.0)])
    .bit(10, control::SLS_1, false)
    .run(400);
    assert_eq!(by_time.first(status::ERROR, true), Some(310));
    let sls = [
        (key(etg::SLS, etg::sls::TIME_TO_VELOCITY_MONITORING), 1000),
        (key(etg::SLS, etg::sls::VELOCITY_LIMIT), 500),
        (key(etg::SLS, etg::sls::TIME_DELAY_DECELERATION_MONITORING), 200),
    ];
    // ETG-EX-04: 3,125 rpm/s; 2,500 rpm reach 500 rpm in 640 ms
    let by_line = script(&[sms.as_slice(), &sls].concat())
        .speed(&[(0, 2500.0), (200, 2500.0), (840, 500.0)])
        .bit(0, control::SLS_1, false)
        .run(900);
    assert_eq!(by_line.first(status::SLS_1, true), Some(840));
    assert_eq!(by_line.first(status::ERROR, true), None);
    let ssr = [
        (key(etg::SSR, etg::ssr::TIME_TO_VELOCITY_MONITORING), 1000),
        (key(etg::SSR, etg::ssr::VELOCITY_UPPER_LIMIT), 500),
        (key(etg::SSR, etg::ssr::VELOCITY_LOWER_LIMIT), -300),
        (key(etg::SSR, etg::ssr::TIME_DELAY_DECELERATION_MONITORING), 200),
    ];
    // ETG-EX-05 with DEC-04: the larger demand, 3,125 rpm/s
    let by_range = script(&[sms.as_slice(), &ssr].concat())
        .speed(&[(0, -1550.0), (200, -1550.0), (600, -300.0)])
        .bit(0, control::SSR_1, false)
        .run(700);
    assert_eq!(by_range.first(status::SSR_1, true), Some(600));
    assert_eq!(by_range.first(status::ERROR, true), None);
}

/// ETG-EX-07, ETG-SMS-01, DEC-31
#[test]
fn sms_takes_its_negative_limit_as_a_magnitude() {
    let objects = [
        (key(etg::SMS, etg::sms::VELOCITY_MAXIMUM_POSITIVE), 3000),
        (key(etg::SMS, etg::sms::VELOCITY_MAXIMUM_NEGATIVE), -3500),
    ];
    assert_eq!(script(&objects).speed(&[(0, -3500.0)]).run(5).first(status::ERROR, true), None);
    assert_eq!(script(&objects).speed(&[(0, -3500.001)]).run(5).first(status::ERROR, true), Some(0));
    assert_eq!(script(&objects).speed(&[(0, 3000.001)]).run(5).first(status::ERROR, true), Some(0));
}

/// ETG-SEQ-13, ETG-SLI-01
#[test]
fn sli_is_relative_to_its_activation() {
    let objects = [
        (key(etg::SLI, etg::sli::POSITION_RELATIVE_UPPER_LIMIT), 1000),
        (key(etg::SLI, etg::sli::POSITION_RELATIVE_LOWER_LIMIT), 200),
        (key(etg::SLI, etg::sli::ERROR_REACTION), 0),
    ];
    let played =
        script(&objects).speed(&[(0, 0.0), (10, 0.0), (11, -60.0)]).bit(5, control::SLI_1, false).run(30);
    // 65.536 increments per ms, half of it in the first: 32.8, 98.3, 163.8, 229.4
    assert_eq!(played.first(status::ERROR, true), Some(14));
    assert!(!played.bit(14, status::STO), "ETG-ERR-02: reference 0 is no reaction");
    assert!(played.bit(13, status::SLI_1) && !played.bit(14, status::SLI_1));
}

/// ETG-SEQ-14, ETG-SDI-02, ETG-SDI-05, DEC-30
#[test]
fn sdi_counts_from_where_zero_was_reached() {
    let objects = [
        (key(etg::SDI, etg::sdi::POSITION_ZERO_WINDOW), 100),
        (key(etg::SDI, etg::sdi::VELOCITY_ZERO_WINDOW), 5),
    ];
    let reversing = || script(&objects).speed(&[(0, -100.0), (100, 0.0), (200, 0.0), (201, -4.0)]);
    let positive_only = reversing().bit(10, control::SDIN, false).run(400);
    assert_eq!(positive_only.first(status::SDIN, true), Some(0));
    let at = positive_only.first(status::ERROR, true).expect("creeps back");
    assert!(positive_only.bit(at, status::STO));
    // 5 rpm are reached at 95 ms, 13.7 increments before standstill; then 4.369 per ms
    assert!((219..=222).contains(&at), "{at}");
    let both = reversing().bit(10, control::SDIN, true).run(400);
    assert_eq!(both.first(status::ERROR, true), None);
    let neither = reversing().bit(10, control::SDIN, false).bit(10, control::SDIP, false).run(400);
    assert_eq!(neither.first(status::ERROR, true), Some(at));
}

/// ETG-SEQ-15, ETG-RST-03, ETG-RST-06, DEC-16
#[test]
fn a_stop_is_left_only_by_an_edge_while_the_request_for_it_is_shown() {
    let played = Script::new(Profile::Etg61002, &[])
        .bit(10, control::STO, false)
        .bit(15, control::RESTART_ACKNOWLEDGE, true)
        .bit(20, control::STO, true)
        .bit(25, control::RESTART_ACKNOWLEDGE, false)
        .bit(30, control::RESTART_ACKNOWLEDGE, true)
        .run(40);
    assert!(!played.bit(19, status::RESTART_ACKNOWLEDGE_REQUEST));
    assert!(played.bit(20, status::RESTART_ACKNOWLEDGE_REQUEST) && played.bit(29, status::STO));
    assert!(!played.bit(30, status::STO) && !played.bit(30, status::RESTART_ACKNOWLEDGE_REQUEST));
    assert!(!played.crosscheck(30).torque && played.crosscheck(31).torque);
}

/// ETG-SEQ-16, ETG-ERR-04
#[test]
fn an_edge_clears_all_errors_that_do_not_recur() {
    let objects = [
        (key(etg::SLP, etg::slp::POSITION_UPPER_LIMIT), 1000),
        (key(etg::SLP, etg::slp::POSITION_LOWER_LIMIT), -1000),
        (key(etg::SLT, etg::slt::TORQUE_LIMIT_POSITIVE_DIRECTION), 500),
        (key(etg::SLT, etg::slt::TORQUE_LIMIT_NEGATIVE_DIRECTION), 400),
    ];
    let run = |calm: i64| {
        script(&objects)
            .bit(0, control::SLT_1, false)
            .at(10, |input| input.torque_ppm = -400_001)
            .at(calm, |input| input.torque_ppm = -400_000)
            .bit(30, control::ERROR_ACK, true)
            .run(40)
    };
    let cleared = run(20);
    assert_eq!(cleared.first(status::ERROR, true), Some(10));
    assert!(cleared.bit(29, status::ERROR) && !cleared.bit(30, status::ERROR));
    assert!(run(35).bit(30, status::ERROR), "it recurs at once");
}

/// ETG-EX-01, ETG-GEN-12
#[test]
fn of_several_limits_the_lowest_counts() {
    let limits: Vec<(u32, i32)> =
        (1..=4).map(|one| (etg_key(etg::SLS, one, etg::sls::VELOCITY_LIMIT), 100 * one as i32)).collect();
    for (bit, limit) in [(control::SLS_1, 100.0), (control::SLS_2, 200.0), (control::SLS_4, 400.0)] {
        let at = |speed: f64| {
            script(&limits).speed(&[(0, speed)]).bit(0, control::SLS_4, false).bit(0, bit, false)
        };
        assert_eq!(at(limit).run(3).first(status::ERROR, true), None);
        assert_eq!(at(limit + 0.001).run(3).first(status::ERROR, true), Some(0));
    }
}

/// ETG-SAR-01, ETG-SMA-01, ETG-SSM-01, ETG-SCA-01, DEC-29
#[test]
fn acceleration_limits_and_output_bits() {
    let objects = [
        (key(etg::SAR, etg::sar::ACCELERATION_UPPER_LIMIT), 1000),
        (key(etg::SAR, etg::sar::ACCELERATION_LOWER_LIMIT), -500),
        (key(etg::SSM, etg::ssm::VELOCITY_UPPER_LIMIT), 100),
        (key(etg::SSM, etg::ssm::VELOCITY_LOWER_LIMIT), -100),
        (key(etg::SCA, etg::sca::POSITION_UPPER_LIMIT), 10),
        (key(etg::SCA, etg::sca::POSITION_LOWER_LIMIT), 0),
    ];
    let at = |acceleration: i64| {
        script(&objects)
            .bit(0, control::SAR_1, false)
            .at(0, move |input| input.acceleration_mrpm_s = Some(acceleration))
            .run(3)
    };
    assert_eq!(at(1_000_000).first(status::ERROR, true), None);
    assert_eq!(at(-500_001).first(status::ERROR, true), Some(0));
    let stopped = at(1_000_001);
    assert!(stopped.bit(3, status::STO) && stopped.bit(3, status::SSM_1) && stopped.bit(3, status::SCA_1));
}

/// Two SS2, the first with a line of 1,000 rpm/s from 100 ms after its request on.
fn two_ss2(reaction: i32) -> Script {
    script(&[
        (key(etg::SS2, etg::ss2::TIME_TO_SOS), 1000),
        (key(etg::SS2, etg::ss2::DECELERATION_LIMIT), 1000),
        (key(etg::SS2, etg::ss2::TIME_DELAY_DECELERATION_MONITORING), 100),
        (key(etg::SS2, etg::ss2::ERROR_REACTION), reaction),
        (key(etg::SOS, etg::sos::POSITION_ZERO_WINDOW), 1000),
        (etg_key(etg::SS2, 2, etg::ss2::TIME_TO_SOS), 200),
        (etg_key(etg::SOS, 2, etg::sos::POSITION_ZERO_WINDOW), 1_000_000),
    ])
    .speed(&[(0, 500.0)])
    .bit(10, control::SS2_1, false)
}

/// ETG-SS2-10, ETG-ERR-02
#[test]
fn an_ss2_off_its_line_starts_what_its_reaction_names() {
    let to_itself = two_ss2(reference(etg::SS2, 1)).run(400);
    assert_eq!(to_itself.first(status::STO, true), Some(111));
    let to_none = two_ss2(0).run(400);
    assert_eq!(to_none.first(status::ERROR, true), Some(111));
    assert_eq!(to_none.first(status::STO, true), None);
    let to_other = two_ss2(reference(etg::SS2, 2)).run(400);
    assert_eq!(to_other.first(status::ERROR, true), Some(111));
    assert_eq!(to_other.first(status::SOS_2, true), Some(311));
    assert_eq!(to_other.first(status::STO, true), None);
}

/// ETG-ERR-02, DEC-15: without a reaction monitoring goes on.
#[test]
fn an_error_without_reaction_is_acknowledged_when_the_limit_is_kept_again() {
    let objects =
        [(key(etg::SLS, etg::sls::VELOCITY_LIMIT), 500), (key(etg::SLS, etg::sls::ERROR_REACTION), 0)];
    let played = script(&objects)
        .speed(&[(0, 400.0), (100, 400.0), (101, 600.0), (200, 600.0), (201, 400.0)])
        .bit(10, control::SLS_1, false)
        .bit(150, control::ERROR_ACK, true)
        .bit(160, control::ERROR_ACK, false)
        .bit(250, control::ERROR_ACK, true)
        .run(300);
    let shown: Vec<(bool, bool)> = [100, 101, 151, 201, 249, 250]
        .iter()
        .map(|at| (played.bit(*at, status::SLS_1), played.bit(*at, status::ERROR)))
        .collect();
    let expected = [(true, false), (false, true), (false, true), (true, true), (true, true), (true, false)];
    assert_eq!(shown, expected);
    assert_eq!(played.first_where(|view| !view.torque), None);
}

/// ETG-GEN-12, ETG-SDI-02, DEC-30
#[test]
fn each_direction_of_sdi_has_its_own_latch() {
    let objects = [(key(etg::SDI, etg::sdi::POSITION_ZERO_WINDOW), 1000)];
    let moving = script(&objects).speed(&[(0, 0.0), (20, 0.0), (21, -600.0)]);
    let later = moving.bit(10, control::SDIP, false).bit(100, control::SDIN, false).run(200);
    assert_eq!(later.first(status::ERROR, true), None);
    // 65.5 increments per ms from rest: 1,000 after 15.8 ms.
    let turning = script(&objects).speed(&[(0, 0.0), (20, 0.0), (21, 60.0)]);
    let both = turning.bit(10, control::SDIP, false).bit(15, control::SDIN, false);
    let kept = both.bit(25, control::SDIN, true).run(200);
    assert_eq!(kept.first(status::ERROR, true), Some(36));
}
