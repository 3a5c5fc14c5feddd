//! Special operation of the SM301, and what belongs to its error stops.

use shm_schema::report::{Report, Stop};

use super::bench::{Bench, codes};
use super::lenze::{AIE, AIS, ES, NEUTRAL, OMS, bench, without};

const SSE: u32 = 1 << 23;

/// SD-In1 selects at LOW; special operation is SS2, which stands at once.
fn selector() -> Bench {
    bench(&[
        (15_030, 1, 2),
        (15_031, 1, 2),
        (15_032, 1, 9),
        (15_113, 0, !(1_i64 << 11)),
        (15_202, 0, 1),
        (15_200, 0, 2),
        (15_308, 0, 1),
    ])
}

fn is_special(report: &Report) -> [bool; 2] {
    [report.status.bit(11), report.status.bit(29)]
}

#[test]
fn a_faulty_selector_is_normal_operation_whatever_level_selects() {
    // LNZ-OMS-16, LNZ-OMS-12
    let mut bench = selector();
    bench.split = Some(0);
    bench.until(9);
    bench.lines[0] = false;
    let mut before = [false; 2];
    let report = loop {
        let report = bench.step().report;
        if codes(&report) == [(49, 0, 0, 0)] {
            break report;
        }
        before = is_special(&report);
    };
    assert_eq!((before, is_special(&report)), ([true; 2], [false; 2]), "in the cycle of the error");
    assert_eq!(bench.until(60).stop, Stop::Sos, "until the restart is acknowledged");
    // Selected again only when the error is gone and acknowledged.
    bench.split = None;
    assert_eq!(is_special(&bench.until(70)), [false; 2]);
    bench.word |= AIE;
    let report = bench.step().report;
    assert_eq!((codes(&report).as_slice(), is_special(&report)), ([].as_slice(), [true; 2]));
}

#[test]
fn a_faulty_selector_does_not_keep_the_restart_from_being_acknowledged() {
    // LNZ-OMS-12, LNZ-ACK-06: the error first, then the restart
    let mut bench = selector();
    bench.split = Some(0);
    bench.until(9);
    bench.lines[0] = false;
    bench.until(60);
    bench.lines[0] = true;
    bench.split = None;
    bench.until(70);
    bench.lines[0] = false;
    bench.until(80);
    bench.lines[0] = true;
    bench.until(90);
    bench.word |= AIE;
    assert_eq!(bench.until(91).stop, Stop::Sos);
    bench.word |= AIS;
    assert_eq!(bench.until(92).stop, Stop::None);
}

#[test]
fn in_sto_the_limit_itself_is_asked_before_the_enable_switch_moves() {
    // LNZ-OMS-22, LNZ-OMS-14, DEC-14: C15200 STO, C15201 SLS1
    for (rpm, moves) in [(50.0, true), (50.001, false)] {
        let mut bench = bench(&[(15_200, 0, 0), (15_201, 0, 3), (15_330, 1, 50), (15_331, 1, 500)]);
        bench.word |= OMS;
        assert_eq!(bench.ride(9, |_| 80.0).stop, Stop::Sto);
        bench.word |= ES;
        let report = bench.ride(10, |_| rpm);
        assert_eq!((report.status.bit(9), report.stop == Stop::None), (moves, moves), "{rpm}");
        // SLS1 begins with its braking time.
        let late = bench.first(600, |_| 51.0, |report| !report.errors.is_empty());
        assert_eq!(late, moves.then_some(510), "{rpm}");
    }
}

#[test]
fn an_edge_of_the_enable_switch_under_an_emergency_stop_confirms_nothing() {
    // LNZ-OMS-06, LNZ-OMS-08, LNZ-ES-03: SS1 as emergency stop, SS2 as stop of special operation
    for before_ms in [0, 5] {
        let mut bench = bench(&[(15_200, 0, 2), (15_201, 0, 11), (15_205, 0, 1), (15_308, 0, 1)]);
        bench.word |= OMS;
        bench.until(9);
        bench.word &= !SSE;
        (0..before_ms).for_each(|_| {
            bench.step();
        });
        bench.word |= ES;
        assert!(!bench.step().report.status.bit(9), "{before_ms}");
        bench.word |= SSE;
        assert!(!bench.until(40).status.bit(9), "it stands, and is no edge");
        bench.word &= !ES;
        bench.step();
        bench.word |= ES;
        assert!(bench.step().report.status.bit(9), "a new edge");
    }
}

#[test]
fn what_was_confirmed_before_an_emergency_stop_stays_confirmed() {
    // LNZ-OMS-10
    let mut bench = bench(&[(15_200, 0, 2), (15_201, 0, 11)]);
    bench.word |= OMS;
    bench.until(9);
    bench.word |= ES;
    bench.until(19);
    bench.word &= !SSE;
    let report = bench.until(20);
    assert_eq!((report.status.bit(9), report.stop), (true, Stop::Sto));
}

/// SLS1 of 500 rpm, stopped by `reaction`, with 100 ms to be back; violated at 10 ms.
fn violated(reaction: i64) -> Bench {
    let mut bench =
        bench(&[(15_330, 1, 500), (15_331, 1, 0), (15_332, 1, reaction), (15_350, 0, 100), (15_308, 0, 1)]);
    bench.word = without(3);
    bench.ride(9, |_| 400.0);
    assert_eq!(codes(&bench.ride(10, |_| 501.0)), [(98, 0, 0, 0)]);
    bench
}

#[test]
fn the_response_time_goes_on_when_the_request_is_withdrawn() {
    // LNZ-SMS-06, DEC-11
    let mut bench = violated(1);
    bench.ride(49, |_| 501.0);
    bench.word = NEUTRAL;
    assert_eq!(bench.ride(109, |_| 501.0).stop, Stop::Ss1);
    let report = bench.ride(110, |_| 501.0);
    let both = [(98, 0, 0, 0), (102, 0, 0, 0)];
    assert_eq!((codes(&report).as_slice(), report.stop), (both.as_slice(), Stop::Sto));
}

#[test]
fn the_response_time_ends_with_the_acknowledge() {
    // DEC-15: SS2 at standstill has reached its end state
    let mut bench = violated(2);
    assert_eq!(bench.ride(20, |_| 0.0).stop, Stop::Sos);
    bench.word = NEUTRAL | AIE;
    bench.ride(21, |_| 0.0);
    bench.word |= AIS;
    assert_eq!(bench.ride(22, |_| 0.0).stop, Stop::None);
    let report = bench.ride(200, |_| 501.0);
    assert_eq!((codes(&report).as_slice(), report.stop), ([].as_slice(), Stop::None));
}

#[test]
fn all_limits_that_one_sample_leaves_are_listed() {
    // DEC-02, DEC-14: the STO of a left standstill follows the judgement of its sample
    let mut bench = bench(&[(15_308, 0, 1), (15_342, 0, 50), (15_341, 0, 0)]);
    bench.travel = false;
    bench.word = without(2) & without(7);
    assert_eq!(bench.until(9).stop, Stop::Sos);
    bench.position = -101;
    let report = bench.until(10);
    let both = [(103, 0, 0, 0), (106, 0, 0, 0)];
    assert_eq!((codes(&report).as_slice(), report.stop), (both.as_slice(), Stop::Sto));
    bench.position = 5_000;
    assert_eq!(codes(&bench.until(11)), both, "in STO nothing is judged");
}

#[test]
fn nothing_is_judged_beside_the_end_of_an_ss1() {
    // DEC-14: 97 at the end of its time, and no 98
    let mut bench = bench(&[(15_330, 1, 500), (15_331, 1, 300), (15_305, 0, 300)]);
    bench.word = without(1) & without(3);
    assert_eq!(codes(&bench.ride(299, |_| 600.0)), []);
    assert_eq!(codes(&bench.ride(300, |_| 600.0)), [(97, 0, 0, 0)]);
}

#[test]
fn the_enable_switch_does_not_end_the_stop_of_an_error() {
    // LNZ-OMS-10, LNZ-OMS-14: 111 in special operation, acknowledged by AIE
    for again in [false, true] {
        let mut bench = bench(&[(15_200, 0, 2), (15_201, 0, 11), (15_203, 0, 100), (15_308, 0, 1)]);
        bench.travel = false;
        bench.word |= OMS;
        bench.until(9);
        bench.word |= ES;
        bench.until(10);
        bench.position = 101;
        assert_eq!(codes(&bench.until(11)), [(111, 0, 0, 0)]);
        bench.word |= AIE;
        bench.until(12);
        if again {
            bench.word &= !ES;
            bench.until(13);
            bench.word |= ES;
        }
        let report = bench.until(20);
        assert_eq!((codes(&report).as_slice(), report.stop), ([].as_slice(), Stop::Sto));
        bench.word |= AIS;
        let report = bench.until(21);
        assert_eq!((report.status.bit(9), report.stop), (true, Stop::None));
    }
}

#[test]
fn a_restart_acknowledge_that_has_nothing_to_leave_is_none() {
    // DEC-12, DEC-16: given while special operation itself asks for STO
    let mut bench = bench(&[(15_200, 0, 0), (15_201, 0, 11), (15_203, 0, 100)]);
    bench.travel = false;
    bench.word |= OMS;
    bench.until(9);
    bench.word |= ES;
    bench.until(10);
    bench.position = 101;
    assert_eq!(codes(&bench.until(11)), [(111, 0, 0, 0)]);
    bench.word &= !ES;
    bench.until(12);
    for acknowledge in [AIE, AIS] {
        bench.word |= acknowledge;
        bench.step();
        bench.word &= !acknowledge;
        bench.step();
    }
    bench.word |= ES;
    let report = bench.step().report;
    assert_eq!(
        (codes(&report).as_slice(), report.status.bit(9), report.stop),
        ([].as_slice(), true, Stop::Sto)
    );
    bench.word |= AIS;
    assert_eq!(bench.step().report.stop, Stop::None);
}
