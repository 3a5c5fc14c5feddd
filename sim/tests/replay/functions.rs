//! Strictness and phases of the AMK functions, from the examples of the catalogue.

use crate::support::{bit, replay_with, replayed, request};

/// AMK-EX-STO, DEC-24: the request acts in its own cycle, the permission one cycle after.
#[test]
fn sto_acts_in_the_cycle_of_its_request_on_every_source() {
    let seen = replayed("t_ms,speed_rpm,command\n0,1500,0x7E7F\n40,1500,0x7E7E\n60,1500,0x7E7F\n90,1500,\n");
    assert_eq!(seen.tripped(), Some(40.0));
    assert_eq!(seen.shown(bit::STO, true), Some(40.0), "{seen}");
    for source in ["a", "b", "crosscheck"] {
        assert_eq!(seen.first(source, "path", false), Some(40.0), "{source}");
    }
    assert_eq!(seen.summary.trips, 1);
}

/// AMK-EX-SS1-1: at the latest at t1 + Prm20 STO without error; DEC-05: the line ends the ramp.
#[test]
fn ss1_ends_in_sto_where_the_line_meets_the_window() {
    let seen = replayed("t_ms,speed_rpm,command\n0,600,0x7E7F\n10,600,0x7E7D\n110,0,\n300,0,\n");
    // (600 - 30) rpm at 6,000 rpm/s are 95 ms.
    assert_eq!(seen.tripped(), Some(105.0), "{seen}");
    assert_eq!(seen.errors("crosscheck"), "[]");
}

/// AMK-EX-SS1-2: deviation from the ramp is STO with the error bit; DEC-02: the delay is free.
#[test]
fn ss1_off_its_ramp_is_sto_with_an_error_once_the_delay_has_passed() {
    let trace = format!("t_ms,speed_rpm,command\n0,600,\n10,600,{}\n300,600,\n", request(bit::SS1));
    let seen = replay_with(&[(18, 50)], &trace, false);
    // From t0 + 50 ms the line falls: 600 rpm lie on it then, above it one cycle later.
    assert_eq!(seen.tripped(), Some(61.0), "{seen}");
    assert_eq!(seen.shown(bit::ERROR, true), Some(61.0));
}

/// AMK-EX-SOS-1, AMK-EX-SOS-2, DEC-01: a speed at the window is inside, beyond it STO.
#[test]
fn sos_holds_at_its_speed_window_and_trips_beyond_it() {
    let sos = request(bit::SOS);
    let seen = replayed(&format!("t_ms,speed_rpm,command\n0,0,\n10,0,{sos}\n20,0,\n21,30,\n22,0,\n200,0,\n"));
    assert!(seen.quiet(), "{seen}");
    assert_eq!(seen.shown(bit::SOS, true), Some(10.0));
    let seen =
        replayed(&format!("t_ms,speed_rpm,command\n0,0,\n10,0,{sos}\n20,0,\n21,30.001,\n22,0,\n200,0,\n"));
    assert_eq!(seen.tripped(), Some(21.0), "{seen}");
    assert_eq!(seen.shown(bit::ERROR, true), Some(21.0));
}

/// AMK-EX-SOS-3: the position window lies around the position at the request.
#[test]
fn sos_trips_one_increment_beyond_its_position_window() {
    let sos = request(bit::SOS);
    let moved = |by: i32| {
        let to = 1_000 + by;
        replayed(&format!("t_ms,pos_incr,command\n0,1000,\n10,1000,{sos}\n110,{to},\n300,{to},\n"))
    };
    assert!(moved(200).quiet(), "{}", moved(200));
    assert!(moved(-200).quiet());
    assert_eq!(moved(201).tripped(), Some(110.0), "{}", moved(201));
    assert_eq!(moved(-201).tripped(), Some(110.0));
}

/// AMK-EX-SS2-1, AMK-EX-SS2-3: the ramp ends in SOS around the position reached there.
#[test]
fn ss2_ends_in_sos_and_its_windows_lie_around_that_position() {
    let ss2 = request(bit::SS2);
    let seen = replayed(&format!("t_ms,speed_rpm,command\n0,600,\n10,600,{ss2}\n105,0,\n300,0,\n"));
    assert!(seen.quiet(), "{seen}");
    assert_eq!(seen.shown(bit::SOS, true), Some(105.0));
    let late = format!("t_ms,speed_rpm,command\n0,600,\n10,600,{ss2}\n105,0,\n200,0,\n201,31,\n300,31,\n");
    let seen = replayed(&late);
    assert_eq!(seen.tripped(), Some(201.0), "{seen}");
    assert_eq!(seen.shown(bit::ERROR, true), Some(201.0));
}

/// AMK-SMS-05, AMK-EX-SMS-1, AMK-EX-SMS-2, DEC-01: the limit itself is inside.
#[test]
fn a_speed_limit_trips_in_the_cycle_behind_the_limit() {
    for sign in ["", "-"] {
        let seen = replayed(&format!("t_ms,speed_rpm\n0,{sign}2990\n20,{sign}3010\n300,{sign}3010\n"));
        assert_eq!(seen.tripped(), Some(11.0), "3,000 rpm at 10 ms are inside: {seen}");
        assert_eq!(seen.shown(bit::SMS, false), Some(11.0));
        assert!(replayed(&format!("t_ms,speed_rpm\n0,{sign}2990\n20,{sign}3000\n300,{sign}3000\n")).quiet());
    }
}

/// AMK-EX-SSR-1, AMK-EX-SSR-3: range and both of its limits.
#[test]
fn ssr_is_reached_by_its_ramp_and_holds_both_limits() {
    let more = [(33, 500), (34, 200)];
    let ssr = request(bit::SSR1);
    let head = format!("t_ms,speed_rpm,command\n0,1100,\n10,1100,{ssr}\n110,500,\n");
    // 1,100 to 500 rpm at 6,000 rpm/s are 100 ms.
    let seen = replay_with(&more, &format!("{head}120,500,\n130,200,\n300,200,\n"), false);
    assert!(seen.quiet(), "{seen}");
    assert_eq!(seen.shown(bit::SSR1, true), Some(110.0));
    let above = replay_with(&more, &format!("{head}120,500,\n121,500.001,\n300,500.001,\n"), false);
    assert_eq!(above.tripped(), Some(121.0), "{above}");
    let below = replay_with(&more, &format!("{head}120,200,\n121,199.999,\n300,199.999,\n"), false);
    assert_eq!(below.tripped(), Some(121.0), "{below}");
}

/// AMK-EX-SLS-1, AMK-EX-SLS-2, AMK-EX-SLS-3.
#[test]
fn sls_is_reached_by_its_ramp_and_holds_both_directions() {
    let more = [(57, 500)];
    let sls = request(bit::SLS1);
    for sign in ["", "-"] {
        let head = format!("t_ms,speed_rpm,command\n0,{sign}1100,\n10,{sign}1100,{sls}\n110,{sign}500,\n");
        let seen = replay_with(&more, &format!("{head}300,{sign}500,\n"), false);
        assert!(seen.quiet(), "{seen}");
        assert_eq!(seen.shown(bit::SLS1, true), Some(110.0));
        let above = replay_with(
            &more,
            &format!("{head}120,{sign}500,\n121,{sign}500.001,\n300,{sign}500.001,\n"),
            false,
        );
        assert_eq!(above.tripped(), Some(121.0), "{above}");
        let lazy = format!("t_ms,speed_rpm,command\n0,{sign}1100,\n10,{sign}1100,{sls}\n300,{sign}1100,\n");
        assert_eq!(replay_with(&more, &lazy, false).tripped(), Some(11.0), "off the ramp");
    }
}

/// AMK-EX-SDIP-1, AMK-EX-SDIP-2, AMK-EX-SDIN-1, AMK-EX-SDIN-2: Prm64 against the direction.
#[test]
fn sdi_permits_its_window_against_the_direction() {
    for (bit, against, along) in [(bit::SDIP, "-", ""), (bit::SDIN, "", "-")] {
        let sdi = request(bit);
        let more = [(64, 20)];
        let trace = |speed: &str| {
            format!(
                "t_ms,speed_rpm,command\n0,0,\n10,0,{sdi}\n20,{along}1500,\n30,0,\n40,{against}{speed},\n300,{against}{speed},\n"
            )
        };
        let seen = replay_with(&more, &trace("20"), false);
        assert!(seen.quiet(), "{seen}");
        assert_eq!(seen.shown(bit, true), Some(10.0));
        let seen = replay_with(&more, &trace("20.001"), false);
        assert_eq!(seen.tripped(), Some(40.0), "{seen}");
    }
}

/// AMK-EX-SLI-POS, AMK-EX-SLI-POS-SWAP, AMK-EX-SLI-2: 9,900 to 11,000 around 10,000.
#[test]
fn sli_permits_its_range_around_the_start_in_either_order() {
    let sli = request(bit::SLI);
    for more in [[(65, 1_000), (66, -100)], [(65, -100), (66, 1_000)]] {
        let to = |to: i32| {
            let trace = format!("t_ms,pos_incr,command\n0,10000,\n10,10000,{sli}\n110,{to},\n300,{to},\n");
            replay_with(&more, &trace, false)
        };
        assert!(to(11_000).quiet(), "{}", to(11_000));
        assert!(to(9_900).quiet(), "{}", to(9_900));
        assert_eq!(to(11_001).tripped(), Some(110.0), "{}", to(11_001));
        assert_eq!(to(9_899).tripped(), Some(110.0), "{}", to(9_899));
    }
}
