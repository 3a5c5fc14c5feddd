//! Lives repeat from their seed, and become traces that are read again.

use shm_schema::profile::Profile;

use super::*;
use crate::trace::parse;

/// An axis that may turn: SMS at 3,000 rpm, ramps it can follow.
fn set() -> AxisSet {
    let mut set = AxisSet::delivery(Profile::AmkKw, 1, "SIM-0001");
    for (key, value) in [(2, 450), (3, 315), (21, 60), (67, 3_000)] {
        set.values.insert(key, value);
    }
    set
}

#[test]
fn the_same_seed_lives_the_same_life() {
    let plan = Plan::random(&set(), 7, 4_000, 5);
    assert_eq!(plan, Plan::random(&set(), 7, 4_000, 5));
    assert_ne!(plan.events, Plan::random(&set(), 8, 4_000, 5).events);
    assert_eq!(live(&set(), &plan), live(&set(), &plan));
}

#[test]
fn a_life_is_a_trace_that_can_be_read_again() {
    let plan = Plan::random(&set(), 3, 500, 5);
    let trace = parse(&trace_csv(&set(), &plan)).expect("its own form");
    assert_eq!(trace.last_cycle(), 499);
}
