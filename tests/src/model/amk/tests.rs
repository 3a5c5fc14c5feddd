//! The worked examples of the AMK catalogue, by their ids.

use shm_schema::facts::amk_kw::{control, status};
use shm_schema::profile::Profile;

use crate::model::Which;
use crate::model::script::Script;

use super::parameters::Parameters;
use super::sem::{Said, Sem};

/// Ramps of 3 rpm/ms for everything, wide windows, SMS at 3,000 rpm.
const BASE: [(u32, i32); 31] = [
    (67, 3000),
    (68, 0),
    (9, 60_000),
    (10, 60_000),
    (18, 50),
    (20, 1000),
    (21, 30),
    (23, 50),
    (25, 1000),
    (26, 30),
    (27, 1000),
    (28, 20),
    (29, 2000),
    (30, 50),
    (32, 1000),
    (33, 600),
    (34, -300),
    (35, 0),
    (54, 50),
    (56, 1000),
    (57, 500),
    (58, 0),
    (59, 0),
    (61, 500),
    (62, -800),
    (63, 1),
    (64, 10),
    (65, 1000),
    (66, -100),
    (103, 0),
    (105, 7),
];

fn script() -> Script {
    Script::new(Profile::AmkKw, &BASE)
}

fn script_with(changes: &[(u32, i32)]) -> Script {
    let all: Vec<(u32, i32)> = BASE.iter().chain(changes).copied().collect();
    Script::new(Profile::AmkKw, &all)
}

/// AMK-EX-SS1-1, AMK-SS1-02, AMK-SS1-10
#[test]
fn ss1_on_the_ramp_ends_in_sto_without_error_when_the_line_meets_the_window() {
    let played =
        script().speed(&[(0, 1500.0), (150, 1500.0), (640, 0.0)]).bit(100, control::SS1, false).run(700);
    assert!(!played.bit(99, status::SS1_ACTIVE));
    assert!(played.bit(100, status::SS1_ACTIVE));
    // (1500 - 30) / 3 rpm per ms after t1 = 150
    assert_eq!(played.first(status::STO, true), Some(640));
    assert_eq!(played.first(status::ERROR, true), None);
    assert!(!played.bit(640, status::SS1_ACTIVE));
    assert!(played.crosscheck(639).torque && !played.crosscheck(640).torque);
}

/// AMK-EX-SS1-2, AMK-SS1-09, DEC-45
#[test]
fn ss1_off_the_ramp_is_sto_at_once_with_a_code_of_each_channel() {
    let played = script().speed(&[(0, 1500.0)]).bit(100, control::SS1, false).run(200);
    assert_eq!(played.first(status::STO, true), Some(151));
    assert_eq!(played.a(151).errors, [[3606, 101, 0, 8]]);
    assert_eq!(played.b(151).errors, [[3606, 101, 0, 14]]);
    assert_eq!(played.crosscheck(151).errors, [[3606, 101, 0, 8], [3606, 101, 0, 14]]);
}

/// DEC-05, AMKD-FNM-02
#[test]
fn ss1_outside_its_window_at_the_end_of_the_line_is_an_error() {
    let played = script_with(&[(20, 1)]).speed(&[(0, 31.0)]).bit(10, control::SS1, false).run(100);
    assert_eq!(played.first(status::STO, true), Some(61));
    assert_eq!(played.b(61).errors, [[3606, 101, 0, 15]]);
    assert_eq!(played.a(61).errors, [[3606, 101, 0, 8]]);
}

/// AMK-GEN-05, DEC-11, DEC-48
#[test]
fn a_started_ss1_runs_to_its_end_and_its_sto_is_seen_for_a_cycle() {
    let played = script().bit(10, control::SS1, false).bit(11, control::SS1, true).run(100);
    assert_eq!(played.first(status::STO, true), Some(60));
    assert!(!played.crosscheck(60).torque);
    assert!(!played.bit(61, status::STO));
    assert!(!played.crosscheck(61).torque, "the agreement follows a cycle later");
    assert!(played.crosscheck(62).torque);
}

/// AMK-EX-SOS-1, AMK-EX-SOS-2, AMK-EX-SOS-3
#[test]
fn sos_holds_both_windows_and_leaving_either_is_sto() {
    let inside = script().bit(10, control::SOS, false).run(50);
    assert!(inside.bit(10, status::SOS) && inside.bit(50, status::SOS));
    let fast = script().speed(&[(0, 0.0), (20, 0.0), (30, 30.0)]).bit(10, control::SOS, false).run(50);
    assert_eq!(fast.first(status::STO, true), Some(27));
    assert_eq!(fast.crosscheck(27).errors, [[3606, 103, 3, 0]]);
    assert!(!fast.bit(27, status::SOS) && fast.bit(27, status::ERROR));
    let creeping = script().speed(&[(0, -20.0)]).bit(10, control::SOS, false).run(400);
    let at = creeping.first(status::STO, true).expect("drifts out");
    assert_eq!(creeping.crosscheck(at).errors, [[3606, 103, 6, 0]]);
    // 20 rpm are 21.8453 increments per ms
    assert_eq!(at, 10 + 92);
}

/// AMK-EX-SS2-1, AMK-EX-SS2-2, AMK-EX-SS2-3, DEC-08
#[test]
fn ss2_brakes_into_a_standstill_with_its_own_windows() {
    let braked = || script().speed(&[(0, 1500.0), (150, 1500.0), (640, 0.0), (700, 0.0), (800, -50.0)]);
    let played = braked().bit(100, control::SS2, false).run(800);
    assert!(played.bit(100, status::SS2_ACTIVE) && played.bit(639, status::SS2_ACTIVE));
    assert_eq!(played.first(status::SOS, true), Some(640));
    assert!(!played.bit(640, status::SS2_ACTIVE) && played.crosscheck(640).torque);
    let at = played.first(status::STO, true).expect("moves again");
    assert_eq!(played.crosscheck(at).errors, [[3606, 102, 4, 0]]);
    let off = script().speed(&[(0, -1500.0)]).bit(100, control::SS2, false).run(200);
    assert_eq!(off.a(151).errors, [[3606, 102, 0, 9]]);
    assert_eq!(off.b(151).errors, [[3606, 102, 0, 14]]);
}

/// AMK-EX-SMS-1, AMK-EX-SMS-2
#[test]
fn sms_permits_its_limit_and_no_more() {
    let equal = script().speed(&[(0, 3000.0)]).run(10);
    assert!(equal.bit(10, status::SMS) && !equal.bit(10, status::ERROR));
    let played = script().speed(&[(0, -2999.999), (1, -2999.999), (2, -3000.001)]).run(10);
    assert_eq!(played.first(status::STO, true), Some(2));
    assert_eq!(played.crosscheck(2).errors, [[3606, 108, 4, 0]]);
    assert!(!played.bit(2, status::SMS));
}

/// AMK-EX-SSR-1, AMK-EX-SSR-2, AMK-EX-SSR-3
#[test]
fn ssr_follows_the_ramp_into_the_range() {
    let on = script()
        .speed(&[(0, 1500.0), (150, 1500.0), (450, 600.0), (500, 600.0), (501, 601.0)])
        .bit(100, control::SSR1, false)
        .run(510);
    assert_eq!(on.first(status::SSR1, true), Some(450));
    assert_eq!(on.crosscheck(501).errors, [[3606, 104, 3, 0]]);
    let off = script().speed(&[(0, 1500.0)]).bit(100, control::SSR1, false).run(160);
    assert_eq!(off.a(151).errors, [[3606, 104, 0, 8]]);
    assert!(!off.bit(151, status::SSR1));
}

/// AMK-EX-SSR-2A, AMK-SSR-09, DEC-44
#[test]
fn ssr_with_reaction_ss2_runs_the_whole_ss2_and_keeps_the_error() {
    let played = script_with(&[(35, 2)])
        .speed(&[(0, 1500.0), (201, 1500.0), (691, 0.0)])
        .bit(100, control::SSR1, false)
        .run(800);
    assert_eq!(played.first(status::ERROR, true), Some(151));
    assert_eq!(played.a(151).errors, [[3610, 104, 0, 8]]);
    assert_eq!(played.first(status::SS2_ACTIVE, true), Some(151));
    assert_eq!(played.first(status::SOS, true), Some(691));
    assert!(played.crosscheck(800).torque && played.bit(800, status::ERROR));
}

/// AMK-EX-SLS-1, AMK-EX-SLS-2, AMK-EX-SLS-3, AMK-SLS-06
#[test]
fn sls_follows_the_ramp_and_holds_both_directions() {
    let on = script()
        .speed(&[(0, -1500.0), (150, -1500.0), (483, -500.0), (600, -500.0), (601, -501.0)])
        .bit(100, control::SLS1, false)
        .run(610);
    assert_eq!(on.first(status::SLS1, true), Some(484));
    assert_eq!(on.crosscheck(601).errors, [[3606, 112, 4, 0]]);
    let off = script().speed(&[(0, 1500.0)]).bit(100, control::SLS2, false).run(110);
    assert_eq!(off.crosscheck(101).errors, [[3610, 113, 0, 8], [3610, 113, 0, 14]]);
    assert!(off.bit(101, status::SS1_ACTIVE) && off.bit(101, status::ERROR));
}

/// AMK-EX-SDIP-1, AMK-EX-SDIP-2, AMK-EX-SDIN-1, AMK-EX-SDIN-2
#[test]
fn sdi_lets_one_direction_pass_and_the_window_of_the_other() {
    let rows: [(u8, u8, f64, Option<[u32; 4]>); 6] = [
        (control::SDIP, status::SDIP, 100.0, None),
        (control::SDIP, status::SDIP, -10.0, None),
        (control::SDIP, status::SDIP, -10.001, Some([3606, 105, 4, 0])),
        (control::SDIN, status::SDIN, -100.0, None),
        (control::SDIN, status::SDIN, 10.0, None),
        (control::SDIN, status::SDIN, 10.001, Some([3606, 106, 3, 0])),
    ];
    for (request, acknowledge, speed, error) in rows {
        let played = script().speed(&[(0, speed)]).bit(5, request, false).run(10);
        assert_eq!(played.crosscheck(5).errors, Vec::from_iter(error), "{speed}");
        assert_eq!(played.bit(5, acknowledge), error.is_none());
        assert_eq!(played.bit(5, status::STO), error.is_some());
    }
}

/// AMK-EX-SLI-1, AMK-EX-SLI-2, AMK-EX-SLI-POS, AMK-EX-SLI-POS-SWAP, AMKP-EX-SLI65, AMKP-EX-SLI66
#[test]
fn sli_counts_from_where_it_was_selected_and_sorts_its_limits() {
    for limits in [[(65, 1000), (66, -100)], [(65, -100), (66, 1000)]] {
        let at = |position: i64| {
            script_with(&limits)
                .at(0, |input| input.speed_mrpm = 0)
                .bit(5, control::SLI, false)
                .inputs(20)
                .into_iter()
                .enumerate()
                .map(move |(cycle, mut input)| {
                    input.position = if cycle < 10 { 10_000 } else { position };
                    input
                })
                .collect::<Vec<_>>()
        };
        for (position, error) in [
            (9_900, None),
            (11_000, None),
            (9_899, Some([3606, 114, 6, 0])),
            (11_001, Some([3606, 114, 5, 0])),
        ] {
            let parameters = BASE.iter().chain(&limits).copied().collect();
            let mut model = crate::model::Model::new(Profile::AmkKw, &parameters);
            let last = at(position).iter().map(|input| model.step(input)).last().expect("cycles");
            assert_eq!(last.crosscheck.errors, Vec::from_iter(error), "{position}");
            assert_eq!(last.crosscheck.status.bit(status::SLI), error.is_none());
        }
    }
}

/// AMKD-FNM-04
#[test]
fn sli_numbers_its_limits_differently_in_the_warning() {
    let played = script_with(&[(103, 2)]).speed(&[(0, 25.0)]).bit(5, control::SLI, false).run(100);
    let at = played.first(status::ERROR, true).expect("leaves the range");
    assert_eq!(played.crosscheck(at).errors, [[3610, 114, 3, 0]]);
}

/// AMK-EX-CONFLICT, DEC-13
#[test]
fn two_reactions_end_in_sto() {
    let played = script_with(&[(58, 1), (54, 0), (35, 2), (30, 0)])
        .speed(&[(0, 1500.0), (51, 1500.0), (541, 0.0)])
        .bit(0, control::SLS1, false)
        .bit(0, control::SSR1, false)
        .run(700);
    assert!(played.bit(1, status::SS1_ACTIVE) && !played.bit(1, status::SS2_ACTIVE));
    assert_eq!(played.first(status::STO, true), Some(541));
    assert!(played.bit(700, status::STO));
}

/// AMK-EX-SEM-TIMELINE, AMK-SEM-04, AMK-SEM-07
#[test]
fn standstill_warns_then_stops() {
    let played = script_with(&[(9, 1), (10, 1)]).run(120_060);
    assert_eq!(played.a(59_999).errors, Vec::<[u32; 4]>::new());
    assert_eq!(played.a(60_000).errors, [[3610, 38, 3, 0]]);
    assert_eq!(played.b(60_000).errors, [[3610, 39, 3, 0]]);
    assert!(!played.bit(60_000, status::ERROR), "DEC-47: a warning sets no error bit");
    assert_eq!(played.first(status::ERROR, true), Some(120_000));
    assert_eq!(played.a(120_000).errors, [[3606, 38, 4, 0], [3610, 38, 3, 0]]);
    assert!(played.bit(120_000, status::SS1_ACTIVE));
    assert_eq!(played.first(status::STO, true), Some(120_050));
}

/// AMK-EX-SEM-TIMELINE, AMK-SEM-08, AMK-SEM-09
#[test]
fn the_standstill_error_comes_back_every_half_hour_until_the_axis_moves() {
    let parameters = Parameters::new(&[(9, 1), (10, 2), (6, 1024)].into());
    let mut sem = Sem::new(&parameters, Which::A);
    let mut said = Vec::new();
    for now in 0..4_000_000 {
        // 63 of the 64 increments of a sine period are no movement.
        let position = if now < 3_900_000 { 63 } else { 64 };
        said.extend(sem.step(now, if now == 0 { 0 } else { position }).map(|what| (now, what)));
    }
    let error = Said::Error([3606, 38, 4, 0]);
    let warning = Said::Warning([3610, 38, 3, 0]);
    let expected =
        [(60_000, warning), (180_000, error), (1_980_000, error), (3_780_000, error), (3_960_000, warning)];
    assert_eq!(said, expected);
}

/// AMK-ACK-02, AMK-ACK-03, DEC-15, DEC-16, DEC-17
#[test]
fn an_edge_clears_what_has_ended_and_the_function_starts_again() {
    let sls = || script().speed(&[(0, 501.0)]).bit(0, control::SLS1, false);
    // The line falls from 501 to 500 rpm within the cycle after t1 = 50.
    assert_eq!(sls().run(60).first(status::STO, true), Some(51));
    let high_before = sls().bit(49, control::ERROR_ACK, true).run(80);
    assert!(high_before.bit(80, status::ERROR), "no 0 was seen after the error");
    let edge = sls().bit(60, control::ERROR_ACK, true).run(200);
    assert!(!edge.bit(60, status::ERROR) && !edge.bit(60, status::STO));
    assert!(!edge.bit(60, status::SLS1), "a new transition time runs");
    assert_eq!(edge.first_where(|view| view.status.bit(status::SLS1)), None);
    assert!(!edge.bit(110, status::ERROR) && edge.bit(111, status::ERROR), "and ends as the first did");
    let plain = sls().at(60, |input| input.clear_error = true).run(70);
    assert!(!plain.bit(60, status::ERROR));
}

/// DEC-15
#[test]
fn an_acknowledge_while_the_reaction_brakes_is_refused() {
    let early = script_with(&[(58, 1), (54, 0)])
        .speed(&[(0, 520.0), (20, 520.0), (50, 200.0), (120, 0.0)])
        .bit(0, control::SLS1, false)
        .bit(20, control::ERROR_ACK, true)
        .run(100);
    let tripped = early.first(status::ERROR, true).expect("trips");
    assert!(tripped < 20 && early.bit(20, status::ERROR) && early.bit(30, status::ERROR));
}

/// AMK-IN-02, AMK-IN-07, DEC-36, AMK-TIME-02
#[test]
fn inputs_request_only_when_they_command_and_each_channel_reads_its_own_line() {
    let low = |commands: i32| {
        script_with(&[(7, commands), (15, 12)]).at(10, |input| input.se[0] = (false, false)).run(100)
    };
    let shown = low(0);
    assert!(shown.bit(11, status::SE1) && !shown.bit(12, status::SE1));
    assert!(!shown.bit(100, status::SLS1));
    let commanded = low(1);
    assert_eq!(commanded.first(status::SLS1, true), Some(12 + 50));
    let one_line = script_with(&[(7, 1), (15, 12)]).at(10, |input| input.se[0] = (false, true)).run(100);
    assert!(one_line.a(62).status.bit(status::SLS1) && !one_line.b(62).status.bit(status::SLS1));
    assert!(!one_line.bit(62, status::SE1), "DEC-36: the AND of both leaves");
}

/// DEC-20, DEC-21, AMKP-EX-TCC-MIN, AMKP-EX-TCC-MAX
#[test]
fn a_lasting_difference_trips_at_the_fault_tolerance_time() {
    for (factor, tcc) in [(7, 120), (199, 3000)] {
        let played = script_with(&[(7, 1), (15, 12), (105, factor)])
            .at(10, |input| input.se[0] = (false, true))
            .run(12 + tcc + 10);
        assert!(played.crosscheck(12 + tcc - 1).torque);
        assert!(!played.crosscheck(12 + tcc).torque);
        assert_eq!(played.crosscheck(12 + tcc).errors, [[3606, 13, 8, 0]]);
        assert!(played.bit(12 + tcc, status::STO) && played.bit(12 + tcc, status::ERROR));
        assert!(!played.a(12 + tcc).status.bit(status::STO));
        assert!(played.a(12 + tcc + 1).status.bit(status::STO));
    }
}

/// AMK-GEN-07, DEC-13, DEC-14
#[test]
fn the_higher_stop_wins_and_monitors_rest_in_sto() {
    let played = script()
        .speed(&[(0, 1000.0)])
        .bit(10, control::SS2, false)
        .bit(20, control::SS1, false)
        .bit(30, control::STO, false)
        .bit(30, control::SOS, false)
        .run(60);
    assert!(played.bit(10, status::SS2_ACTIVE) && played.bit(20, status::SS1_ACTIVE));
    assert!(!played.bit(20, status::SS2_ACTIVE) && played.bit(30, status::STO));
    assert!(!played.bit(30, status::SMS) && !played.bit(60, status::ERROR));
}

/// AMKP-RAMP-04: whatever the line permits.
#[test]
fn every_ramp_refuses_more_than_60_000_rpm() {
    // SMS answers with SS1 as well, so that the ramp goes on.
    let set = [(67, 60_000), (68, 1), (18, 10), (20, 65_535)];
    for (speed, too_fast) in [(60_000.0, None), (-60_000.001, Some(30))] {
        let slow = script_with(&set).speed(&[(0, 100.0), (19, 100.0), (20, speed)]);
        let played = slow.bit(20, control::SS1, false).run(30);
        let found = played.first_where(|view| view.errors.contains(&[3606, 101, 0, 1]));
        assert_eq!(found, too_fast);
    }
}
