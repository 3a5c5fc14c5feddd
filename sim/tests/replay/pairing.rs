//! What crosscheck tolerates for how long (DEC-20 to DEC-22).

use crate::support::{Seen, bit, replay_with};

/// tcc with the cc-factor 7 of the delivery state.
const TCC_MS: u32 = 120;

/// DEC-22: a position difference equal to Prm2 stands, one increment more trips at once.
#[test]
fn a_position_difference_beyond_prm2_trips_in_its_exchange() {
    let apart = |by: i32| {
        let trace = format!("t_ms,speed_rpm,enc2_pos_offset_incr\n0,0,0\n50,0,0\n51,0,{by}\n400,0,{by}\n");
        replay_with(&[(2, 50)], &trace, false)
    };
    assert!(apart(50).quiet(), "{}", apart(50));
    assert!(apart(-50).quiet());
    for by in [51, -51] {
        let seen = apart(by);
        let at = seen.first("crosscheck", "torque", false);
        assert_eq!(at, Some(51.0), "{seen}");
        assert!(seen.errors("crosscheck").contains("3606/13/5"), "{seen}");
    }
}

/// DEC-22: a speed difference equal to Prm3 stands, more trips at once.
#[test]
fn a_speed_difference_beyond_prm3_trips_in_its_exchange() {
    let apart = |speed: &str| {
        // One cycle: the positions stay together.
        let trace = format!(
            "t_ms,speed_rpm,enc2_speed_rpm\n0,100,100\n50,100,100\n51,100,{speed}\n52,100,100\n400,100,100\n"
        );
        replay_with(&[(3, 16)], &trace, false)
    };
    assert!(apart("116").quiet(), "{}", apart("116"));
    assert!(apart("84").quiet());
    for speed in ["116.001", "83.999"] {
        let seen = apart(speed);
        assert_eq!(seen.first("crosscheck", "torque", false), Some(51.0), "{seen}");
        assert!(seen.errors("crosscheck").contains("3606/13/6"), "{seen}");
    }
}

/// An SE1 pair that selects `SDIp` (which a shaft that stands does not violate), line .1 low from
/// 50 ms on for so long.
fn line_low_for(ms: u32) -> Seen {
    let end = 50 + ms;
    let trace = format!("t_ms,speed_rpm,se1\n0,0,11\n50,0,01\n{end},0,11\n600,0,\n");
    replay_with(&[(15, 5)], &trace, false)
}

/// DEC-21, AMK-IN-08: what differs for less than tcc is tolerated.
#[test]
fn a_line_that_differs_for_less_than_tcc_trips_nothing() {
    let seen = line_low_for(TCC_MS - 1);
    assert!(seen.quiet(), "{seen}");
    assert!(seen.first_bit("a", bit::SE1, false).is_some(), "A saw its line: {seen}");
    assert_eq!(seen.first_bit("b", bit::SE1, false), None, "DEC-36: one line each");
}

/// DEC-21, design 10: first seen in cycle k, tripped in cycle k + tcc.
#[test]
fn a_line_that_differs_trips_tcc_after_it_was_first_seen() {
    for ms in [TCC_MS + 1, 500] {
        let seen = line_low_for(ms);
        let first = seen.first_bit("a", bit::SE1, false).unwrap_or(f64::NAN);
        let at = seen.first("crosscheck", "torque", false);
        assert_eq!(at, Some(first + f64::from(TCC_MS)), "{seen}");
        assert!(seen.errors("crosscheck").contains("3606/13/8"), "{seen}");
    }
}

/// AMK-FILT-03, AMK-FILT-04: the samples lie 62.5 µs apart, rows between two cycles count.
#[test]
fn a_dip_between_two_cycles_is_filtered_and_a_longer_one_is_not() {
    let dip = |end: &str| {
        let trace = format!("t_ms,se1\n0,11\n50.1,00\n{end},11\n600,11\n");
        replay_with(&[(15, 5)], &trace, false).shown(bit::SE1, false)
    };
    assert_eq!(dip("50.9"), None);
    assert!(dip("53.9").is_some());
}
