//! DEC-20 to DEC-22, DEC-15, DEC-16, DEC-45.

use shm_schema::error::{ErrorCode, ErrorList};
use shm_schema::report::Stop;
use shm_schema::word::Word;

use super::bench::{Bench, TCC_CYCLES, amk, codes};

/// What bends a healthy machine.
type Bend = fn(&mut Bench);

/// Each item of DEC-21, the way it is bent in A, and Info2 of DEC-45.
const ITEMS: [(&str, Bend, u32); 9] = [
    ("status bit", |b| b.a.status = b.a.status.with(12, true), 8),
    ("last status bit", |b| b.a.status = b.a.status.with(255, true), 8),
    ("requested function", |b| b.a.requested = Word::ZERO.with(200, true), 8),
    ("input level", |b| b.a.inputs = 1 << 31, 8),
    ("acknowledgement bit", |b| b.a.acknowledgements = 2, 8),
    ("error presence", |b| b.a.errors = list(ErrorCode::amk(3606, 27, 1, 1)), 8),
    ("STO", |b| b.a.stop = Stop::Sto, 2),
    ("SS1", |b| b.a.stop = Stop::Ss1, 3),
    ("SS2", |b| b.a.stop = Stop::Ss2, 4),
];

fn list(code: ErrorCode) -> ErrorList {
    let mut list = ErrorList::default();
    list.insert(code);
    list
}

/// DEC-20, DEC-21: first seen in exchange k, tripped in exchange k + tcc / cycle, for every item.
#[test]
fn every_item_trips_exactly_one_fault_tolerance_time_after_it_was_first_seen() {
    for (name, bend, info2) in ITEMS {
        let mut bench = Bench::settled();
        bench.run(10);
        bend(&mut bench);
        assert_eq!(bench.cycles_to_error(TCC_CYCLES + 5), Some(TCC_CYCLES), "{name}");
        let outputs = bench.step();
        assert!(!outputs.torque, "{name}");
        assert_eq!(codes(&outputs.agreement), [amk(3606, 13, info2)], "{name}");
    }
}

/// DEC-21: agreement in the last cycle before restarts the timer of the item.
#[test]
fn an_item_that_agrees_for_one_cycle_starts_its_time_anew() {
    let mut bench = Bench::settled();
    bench.run(3);
    bench.a.inputs = 1;
    assert!(!bench.run(TCC_CYCLES).agreement.error);
    bench.a.inputs = 0;
    assert!(!bench.step().agreement.error);
    bench.a.inputs = 1;
    assert_eq!(bench.cycles_to_error(TCC_CYCLES + 5), Some(TCC_CYCLES));
}

/// DEC-21: it is the same item that counts, so two that take turns never trip.
#[test]
fn items_that_take_turns_in_differing_are_tolerated_each_for_itself() {
    let mut bench = Bench::settled();
    for turn in 0..10 {
        bench.a.inputs = 1 << (turn % 2);
        assert!(!bench.run(TCC_CYCLES - 1).agreement.error);
    }
}

/// DEC-20: cc_factor 8 is 135 ms.
#[test]
fn the_fault_tolerance_time_follows_the_cc_factor() {
    let image = super::bench::image(shm_schema::profile::Profile::AmkKw, 1, &[(2, 50), (3, 16), (105, 8)]);
    let mut bench = Bench::with(&image, shm_schema::exchange::Start::Settled);
    bench.step();
    bench.b.requested = Word::ZERO.with(12, true);
    assert_eq!(bench.cycles_to_error(200), Some(135));
}

/// AMK-PRM-01, DEC-01: a difference equal to Prm2 is inside, one increment more trips at once.
#[test]
fn a_position_difference_equal_to_the_limit_is_inside() {
    let mut bench = Bench::settled();
    (bench.a.position, bench.b.position) = (-20, 30);
    assert!(bench.run(500).torque);
    bench.b.position = 31;
    let outputs = bench.step();
    assert!(!outputs.torque);
    assert_eq!(codes(&outputs.agreement), [amk(3606, 13, 5)]);
}

/// AMK-PRM-03, DEC-01: the same for the speed, in 1/1000 rpm.
#[test]
fn a_speed_difference_equal_to_the_limit_is_inside() {
    let mut bench = Bench::settled();
    (bench.a.speed_mrpm, bench.b.speed_mrpm) = (-8_000, 8_000);
    assert!(bench.run(500).torque);
    bench.b.speed_mrpm = 8_001;
    assert_eq!(codes(&bench.step().agreement), [amk(3606, 13, 6)]);
}

/// DEC-22: the farthest values there are differ, and nothing overflows.
#[test]
fn the_ends_of_the_number_range_differ() {
    let mut bench = Bench::settled();
    (bench.a.position, bench.b.position) = (i64::MIN, i64::MAX);
    (bench.a.speed_mrpm, bench.b.speed_mrpm) = (i32::MIN, i32::MAX);
    assert_eq!(codes(&bench.step().agreement), [amk(3606, 13, 5), amk(3606, 13, 6)]);
}

/// DEC-22: unequal parameter signatures are an error at once, and no acknowledgement helps.
#[test]
fn an_unequal_parameter_signature_ends_it_until_the_restart() {
    let mut bench = Bench::settled();
    bench.step();
    bench.b.parameter_signature ^= 1;
    assert_eq!(codes(&bench.step().agreement), [amk(3606, 13, 8)]);
    bench.b.parameter_signature ^= 1;
    assert!(bench.acknowledge().agreement.error);
}

/// DEC-22: one channel's STO withdraws the agreement in the same exchange, without an error.
#[test]
fn one_channels_sto_withdraws_the_agreement_at_once() {
    let mut bench = Bench::settled();
    bench.step();
    (bench.b.ready, bench.b.driving, bench.b.stop) = (false, false, Stop::Sto);
    let outputs = bench.step();
    assert!(!outputs.torque);
    assert!(!outputs.agreement.permit);
    assert!(!outputs.agreement.error);
}

/// DEC-15: refused while the cause stands, accepted on an edge once it is gone.
#[test]
fn an_acknowledge_edge_clears_only_what_has_lost_its_cause() {
    let mut bench = Bench::settled();
    bench.b.position = 51;
    bench.step();
    bench.stop_both();
    assert!(bench.acknowledge().agreement.error);
    bench.b.position = 50;
    assert!(bench.step().agreement.error);
    assert!(!bench.acknowledge().agreement.error);
}

/// DEC-16: a level that was high when the error appeared is no edge.
#[test]
fn an_acknowledge_bit_that_is_high_already_is_no_edge() {
    let mut bench = Bench::settled();
    (bench.a.acknowledgements, bench.b.acknowledgements) = (1, 1);
    bench.run(5);
    bench.b.position = 51;
    bench.step();
    bench.b.position = 0;
    assert!(bench.run(50).agreement.error);
    assert!(!bench.acknowledge().agreement.error);
}

/// DEC-15: an edge counts when either channel reports it.
#[test]
fn one_channels_acknowledge_edge_is_enough() {
    let mut bench = Bench::settled();
    bench.b.position = 51;
    bench.step();
    bench.b.position = 0;
    bench.step();
    bench.b.acknowledgements = 4;
    assert!(!bench.step().agreement.error);
}

/// DEC-47: an AMK warning of one channel is no difference in error presence.
#[test]
fn a_warning_of_one_channel_alone_is_no_difference() {
    let mut bench = Bench::settled();
    bench.a.errors = list(ErrorCode::amk(3610, 75, 6, 0));
    assert!(bench.run(TCC_CYCLES * 2).torque);
}
