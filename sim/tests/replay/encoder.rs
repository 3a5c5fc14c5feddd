//! Raw signals through the encoder evaluation.

use crate::support::{Seen, replay_with};

fn raw(trace: &str) -> Seen {
    replay_with(&[], trace, true)
}

/// Design 10: raw signals evaluated give the same trip within 2 cycles.
#[test]
fn raw_signals_trip_within_two_cycles_of_the_line() {
    for sign in ["", "-"] {
        let seen = raw(&format!("t_ms,speed_rpm\n0,{sign}2900\n100,{sign}3100\n400,{sign}3100\n"));
        for source in ["a", "b"] {
            let at = seen.first(source, "torque", false).unwrap_or(f64::NAN);
            assert!((49.0..=53.0).contains(&at), "{source} at {at} ms: {seen}");
        }
    }
}

/// Design 10: within 1 rpm of what the line was at most two cycles ago, in steady state and on ramps of some thousand rpm/s.
#[test]
fn raw_speed_is_within_one_rpm_of_the_line() {
    // A request in between makes lines that show the speed.
    for (from, to) in [(0, 0), (1_234, 1_234), (-2_345, -2_345), (0, 2_000), (2_000, -2_000), (-2_500, 500)] {
        let at = |ms: f64| f64::from(from) + f64::from(to - from) * ms / 1_000.0;
        let trace = format!(
            "t_ms,speed_rpm,command\n0,{from},\n300,,7E7E\n310,,7E7F\n700,,7E7E\n710,,7E7F\n1000,{to},\n"
        );
        let seen = raw(&trace);
        let shown = |source: &str, ms: i32| {
            let line = seen.lines.iter().find(|l| (l["source"] == source) && (l["t_ms"] == f64::from(ms)));
            line.and_then(|line| line["speed"].as_f64()).unwrap_or(f64::NAN)
        };
        for source in ["a", "b"] {
            for ms in [300, 700] {
                let tenths = 0..=20;
                let off =
                    tenths.map(|late| (shown(source, ms) - at(f64::from(ms) - f64::from(late) / 10.0)).abs());
                let off = off.fold(f64::INFINITY, f64::min);
                assert!(off <= 1.0, "{from} to {to}, {source} at {ms} ms: {off} rpm off\n{seen}");
            }
        }
    }
}

/// A shaft that creeps over and rests on a boundary of the period trips nothing.
#[test]
fn resting_on_a_period_boundary_trips_nothing() {
    for at in [0, 16, 32, 48, 64, -16, -64, 6_400] {
        let seen =
            raw(&format!("t_ms,pos_incr\n0,{}\n100,{at}\n200,{at}\n300,{}\n500,{at}\n", at - 8, at + 3));
        assert!(seen.quiet(), "{at}: {seen}");
    }
}

/// Design 8: signals of one encoder that stand still while the shaft turns.
#[test]
fn a_frozen_encoder_drops_torque_within_two_cycles() {
    for (fault, speed) in
        [("freeze-enc1", 1_500), ("freeze-enc2", 1_500), ("freeze-enc1", -200), ("freeze-enc2", -200)]
    {
        let seen = raw(&format!("t_ms,speed_rpm,fault\n0,{speed},none\n50,{speed},{fault}\n400,{speed},\n"));
        let at = seen.first("crosscheck", "torque", false).unwrap_or(f64::NAN);
        assert!((50.0..=52.0).contains(&at), "{fault} at {speed} rpm: {at} ms\n{seen}");
    }
}
