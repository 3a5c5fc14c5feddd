//! The sequences of the Lenze catalogue, by their ids.

use shm_schema::facts::lenze_sm301::{control, status};
use shm_schema::profile::{Profile, lenze_key};

use crate::model::script::Script;

/// Encoder, SMS at 3,000 rpm, automatic restart, 1 s stopping time, window 20 rpm.
const BASE: [(u32, u32, i32); 8] = [
    (15_400, 0, 1),
    (15_320, 0, 3000),
    (15_300, 1, 1),
    (15_300, 2, 1),
    (15_305, 0, 1000),
    (15_310, 0, 20),
    (15_311, 0, 100),
    (15_113, 0, -1),
];

fn script(changes: &[(u32, u32, i32)]) -> Script {
    let all = BASE.iter().chain(changes);
    let keyed: Vec<(u32, i32)> = all.map(|(code, sub, value)| (lenze_key(*code, *sub), *value)).collect();
    Script::new(Profile::LenzeSm301, &keyed)
}

/// LNZ-SS1-03, LNZ-SS1-08 (LNZ-EX-28)
#[test]
fn ss1_ends_with_its_stopping_time_and_97_when_the_axis_still_turns() {
    let on = script(&[]).speed(&[(0, 900.0), (900, 0.0)]).bit(10, control::SS1, false).run(1100);
    assert_eq!(on.first(status::STO_ACTIVE, true), Some(1010));
    assert_eq!(on.first(status::ERROR_ACTIVE, true), None);
    let late = script(&[]).speed(&[(0, 900.0)]).bit(10, control::SS1, false).run(1100);
    assert_eq!(late.crosscheck(1010).errors, [[97, 0, 0, 0]]);
}

/// LNZ-SS1-04
#[test]
fn ss1_at_n_0_waits_the_additional_time() {
    let played = script(&[(15_306, 0, 1), (15_307, 0, 50)])
        .speed(&[(0, 900.0), (900, 0.0)])
        .bit(10, control::SS1, false)
        .run(1100);
    assert_eq!(played.first(status::STO_ACTIVE, true), Some(880 + 50));
}

/// LNZ-SS2-01, LNZ-SS2-02, LNZ-SOS-01, LNZ-SOS-03 (LNZ-EX-29)
#[test]
fn ss2_holds_its_position() {
    let played = script(&[(15_308, 0, 1)])
        .speed(&[(0, 900.0), (900, 0.0), (950, 0.0), (951, 10.0)])
        .bit(10, control::SS2, false)
        .run(1100);
    assert_eq!(played.first(status::SOS_MONITORED, true), Some(880));
    let at = played.first(status::ERROR_ACTIVE, true).expect("moves");
    assert_eq!(played.crosscheck(at).errors, [[106, 0, 0, 0]]);
}

/// LNZ-RAMP-03, LNZ-RAMP-04, LNZ-EX-09, LNZ-EX-10, DEC-49
#[test]
fn the_ramp_starts_with_its_offset_and_falls_after_its_delay() {
    let hold = script(&[(15_315, 0, 1)]).speed(&[(0, 1000.0)]).bit(10, control::SS1, false).run(300);
    // 1,020 rpm fall to 0 in 900 ms from 110 ms on: below 1,000 after 17.6 ms
    assert_eq!(hold.first(status::ERROR_ACTIVE, true), Some(110 + 18));
    assert_eq!(hold.crosscheck(128).errors, [[110, 0, 0, 0]]);
    let percent = script(&[(15_315, 0, 1), (15_317, 0, 10), (15_316, 0, 50)]);
    let later = percent.speed(&[(0, 1000.0)]).bit(10, control::SS1, false).run(400);
    // 1,100 rpm in 800 ms from 210 ms on: below 1,000 after 72.7 ms
    assert_eq!(later.first(status::ERROR_ACTIVE, true), Some(210 + 73));
}

/// LNZ-SLS-01 to 03, LNZ-SMS-02, LNZ-SMS-06 (LNZ-EX-27, LNZ-EX-30)
#[test]
fn sls_is_monitored_below_its_limit_and_enforced_after_its_braking_time() {
    let set = [(15_330, 1, 500), (15_331, 1, 200), (15_332, 1, 1), (15_350, 0, 30)];
    let on = script(&set).speed(&[(0, 900.0), (100, 400.0)]).bit(10, control::SLS1, false).run(300);
    assert_eq!(on.first(status::SLS1_ACTIVE, true), Some(10));
    assert_eq!(on.first(status::SLS1_MONITORED, true), Some(80));
    assert_eq!(on.first(status::ERROR_ACTIVE, true), None);
    let off = script(&set).speed(&[(0, 900.0)]).bit(10, control::SLS1, false).run(300);
    assert_eq!(off.crosscheck(210).errors, [[98, 0, 0, 0]]);
    assert!(off.bit(210, status::SS1_ACTIVE) && !off.bit(239, status::STO_ACTIVE));
    assert_eq!(off.crosscheck(240).errors, [[98, 0, 0, 0], [102, 0, 0, 0]]);
    assert!(off.bit(240, status::STO_ACTIVE));
}

/// LNZ-SDI-01 to 05, DEC-49 (LNZ-EX-31)
#[test]
fn sdi_counts_from_the_furthest_position() {
    let played = script(&[(15_341, 0, 50), (15_342, 0, 1000)])
        .speed(&[(0, 0.0), (100, 0.0), (101, 60.0), (200, 60.0), (201, -60.0)])
        .bit(10, control::SDIPOS, false)
        .run(300);
    assert_eq!(played.first(status::SDIPOS_MONITORED, true), Some(60));
    let at = played.first(status::ERROR_ACTIVE, true).expect("turns back");
    assert_eq!(played.crosscheck(at).errors, [[103, 0, 0, 0]]);
    // 65.5 increments per ms: 1,000 after 15.3 ms
    assert_eq!(at, 217);
    assert!(played.bit(at, status::SS1_ACTIVE), "LNZ-SDI-05: SS1 by default");
}

/// LNZ-PRIO-04, LNZ-SOS-04, LNZ-EX-11, LNZ-EX-35
#[test]
fn from_sto_straight_back_to_a_standing_ss2() {
    let played = script(&[])
        .bit(10, control::SS2, false)
        .bit(20, control::STO, false)
        .bit(40, control::STO, true)
        .run(60);
    assert!(played.bit(10, status::SS2_ACTIVE) && played.bit(20, status::STO_ACTIVE));
    assert!(played.bit(40, status::SOS_MONITORED) && !played.bit(40, status::STO_ACTIVE));
}

/// LNZ-ACK-01, LNZ-ACK-05, LNZ-ACK-06, LNZ-RST-01
#[test]
fn acknowledged_restart_takes_a_pulse_of_the_right_length() {
    let pulse = |length: i64| {
        script(&[(15_300, 1, 0)])
            .bit(10, control::STO, false)
            .bit(20, control::STO, true)
            .at(30, |input| input.ais = true)
            .at(30 + length, |input| input.ais = false)
            .run(11_000)
    };
    assert!(pulse(299).bit(11_000, status::STO_ACTIVE));
    assert!(pulse(300).bit(329, status::STO_ACTIVE) && !pulse(300).bit(330, status::STO_ACTIVE));
    assert!(!pulse(10_000).bit(10_030, status::STO_ACTIVE) && pulse(10_001).bit(11_000, status::STO_ACTIVE));
}

/// LNZ-STOP-02, LNZ-SSE-01
#[test]
fn emergency_stop_is_sto_or_ss1() {
    for (choice, bit) in [(0, status::STO_ACTIVE), (1, status::SS1_ACTIVE)] {
        let played = script(&[(15_205, 0, choice)]).bit(10, control::SSE, false).run(20);
        assert!(played.bit(10, bit) && played.bit(10, status::SSE_ACTIVE));
    }
}

/// Special operation by the bus: OMS at 10 ms, ES at 20 ms.
fn special(changes: &[(u32, u32, i32)]) -> Script {
    script(changes).bit(10, control::OMS, true).bit(20, control::ES, true)
}

/// LNZ-OMS-02, LNZ-OMS-12: the way back leads through state 2 even when ES and OMS end together.
#[test]
fn special_operation_ends_in_its_stop() {
    let played = special(&[(15_201, 0, 11), (15_203, 0, 0)])
        .bit(40, control::ES, false)
        .bit(40, control::OMS, false)
        .bit(60, control::PS_AIS, true)
        .run(70);
    assert!(played.bit(39, status::ES_ACTIVE) && !played.bit(39, status::STO_ACTIVE));
    assert!(played.bit(40, status::STO_ACTIVE) && played.bit(40, status::OMS_ACTIVE));
    assert!(played.bit(59, status::STO_ACTIVE) && !played.bit(41, status::OMS_ACTIVE));
    assert!(!played.bit(60, status::STO_ACTIVE));
}

/// LNZ-OMS-06, LNZ-OMS-08, LNZ-ES-03: from state 5 no edge leads to state 3.
#[test]
fn an_enable_edge_under_an_emergency_stop_confirms_nothing() {
    let played = special(&[(15_201, 0, 11), (15_203, 0, 0)])
        .bit(20, control::SSE, false)
        .bit(40, control::SSE, true)
        .bit(50, control::ES, false)
        .bit(60, control::ES, true)
        .run(70);
    assert_eq!(played.first(status::ES_ACTIVE, true), Some(60));
}

/// LNZ-OMS-22: in STO the limit itself is asked for.
#[test]
fn the_enable_switch_leads_out_of_sto_when_the_reduced_speed_is_kept() {
    for (speed, confirmed) in [(500.0, true), (500.001, false)] {
        let set = [(15_201, 0, 3), (15_203, 0, 0), (15_330, 1, 500), (15_331, 1, 100)];
        let played = special(&set).speed(&[(0, speed)]).run(30);
        assert_eq!(played.bit(20, status::ES_ACTIVE), confirmed);
        assert_eq!(played.bit(20, status::STO_ACTIVE), !confirmed);
    }
}

/// LNZ-SMS-06: the response time belongs to the error stop.
#[test]
fn the_response_time_runs_on_without_the_request() {
    let set = [(15_330, 1, 500), (15_331, 1, 0), (15_332, 1, 1), (15_350, 0, 30)];
    let played =
        script(&set).speed(&[(0, 900.0)]).bit(10, control::SLS1, false).bit(20, control::SLS1, true).run(50);
    assert_eq!(played.first(status::STO_ACTIVE, true), Some(40));
    assert_eq!(played.crosscheck(40).errors, [[98, 0, 0, 0], [102, 0, 0, 0]]);
}

/// What a pair of active sensors at SD-In1 shows, its error acknowledged at 200 ms.
fn pair(changes: &[(i64, (bool, bool))]) -> super::super::script::Played {
    let set = [(15_030, 1, 2), (15_031, 1, 0), (15_032, 1, 9), (15_033, 1, 10)];
    let lines = |script: Script, (at, levels): &(i64, (bool, bool))| {
        let levels = *levels;
        script.at(*at, move |input| input.se[0] = levels)
    };
    let played = changes.iter().fold(script(&set), lines);
    played.bit(200, control::PS_AIE, true).run(300)
}

/// LNZ-IN-14, LNZ-IN-15, LNZ-IN-18 (LNZ-EX-34)
#[test]
fn an_acknowledged_pair_is_on_when_its_lines_rose_together() {
    for (first, second) in [((false, true), (false, false)), ((true, false), (false, false))] {
        let played = pair(&[(100, first), (130, second), (150, (true, true))]);
        assert_eq!(played.first(status::SD_IN1, false), Some(102));
        assert_eq!(played.first(status::ERROR_ACTIVE, true), Some(113));
        assert!(!played.bit(199, status::SD_IN1) && played.bit(200, status::SD_IN1));
    }
}

/// LNZ-IN-16, LNZ-IN-17
#[test]
fn a_late_rise_under_an_error_is_a_new_discrepancy() {
    let refused = pair(&[(100, (false, true)), (130, (false, false)), (150, (true, false))]);
    assert!(refused.bit(300, status::ERROR_ACTIVE) && !refused.bit(300, status::SD_IN1));
    let again = pair(&[(100, (false, true)), (130, (false, false)), (195, (true, false))]);
    assert!(!again.bit(200, status::ERROR_ACTIVE) && !again.bit(207, status::ERROR_ACTIVE));
    assert!(again.bit(208, status::ERROR_ACTIVE));
}
