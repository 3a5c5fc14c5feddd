//! Traces are read as design section 10 says, to the increment and to 1/1000 rpm.

use super::{Cursor, Fault, Instant, Trace, parse};

fn trace(text: &str) -> Trace {
    parse(text).expect("a sound trace")
}

fn at(trace: &Trace, axis: u8, times_ms: &[i64]) -> Vec<Instant> {
    let mut cursor = Cursor::new(&trace.axes[&axis]);
    times_ms.iter().map(|t| cursor.at(t * 1_000_000)).collect()
}

fn refused(text: &str) -> String {
    parse(text).expect_err("must be refused").to_string()
}

#[test]
fn speed_lies_on_the_line_and_position_is_its_exact_integral() {
    let trace = trace("t_ms,speed_rpm\n0,0\n100,1500\n1100,1500\n");
    let seen = at(&trace, 1, &[0, 1, 50, 100, 101, 1_100]);
    let speeds: Vec<_> = seen.iter().map(|i| i.motion_a.speed_mrpm).collect();
    assert_eq!(speeds, [0, 15_000, 750_000, 1_500_000, 1_500_000, 1_500_000]);
    // 1500 rpm are 1638.4 increments a millisecond.
    let positions: Vec<_> = seen.iter().map(|i| i.motion_a.position).collect();
    assert_eq!(positions, [0, 8, 20_480, 81_920, 83_558, 1_720_320]);
    assert_eq!(trace.last_cycle(), 1_100);
}

#[test]
fn integration_over_many_odd_pieces_loses_nothing() {
    let speed = |row: u32| if row.is_multiple_of(2) { "1000.1" } else { "-999.9" };
    let rows: Vec<_> = (0..=3_000).map(|row| format!("{}.37,{}", row * 7, speed(row))).collect();
    let text = format!("t_ms,speed_rpm\n{}\n", rows.join("\n"));
    let trace = trace(&text);
    let seen = at(&trace, 1, &[21_000]);
    // Mean of 0.1 rpm over each piece; before 0.37 ms 1000.1 rpm, and in the last, cut
    // piece of 6.63 ms 1000.1 falls or -999.9 rises to its value there.
    let per_ms = 65_536.0 / 60_000.0;
    let from = -999.9;
    let to = from + 2_000.0 * 6.63 / 7.0;
    let expected = per_ms * (1_000.1 * 0.37 + 2_999.0 * 7.0 * 0.1 + f64::midpoint(from, to) * 6.63);
    assert!(
        (seen[0].motion_a.position as f64 - expected).abs() < 0.51,
        "{} {expected}",
        seen[0].motion_a.position
    );
}

#[test]
fn position_gives_speed_as_slope_of_the_segment_that_ends_there() {
    let trace = trace("t_ms,pos_incr\n0,0\n10,16384\n20,16384\n25,0\n");
    let seen = at(&trace, 1, &[0, 1, 10, 11, 20, 21]);
    let speeds: Vec<_> = seen.iter().map(|i| i.motion_a.speed_mrpm).collect();
    assert_eq!(speeds, [0, 1_500_000, 1_500_000, 0, 0, -3_000_000]);
    assert_eq!(seen[1].motion_a.position, 1_638);
}

#[test]
fn empty_cells_hold_steps_and_lie_on_the_line_of_analog_columns() {
    let trace = trace("t_ms,speed_rpm,command,se2\n0,100,0x7E7F,\n4.5,,,01\n10,200,7E7E,11\n");
    let seen = at(&trace, 1, &[4, 5, 9, 10]);
    assert_eq!(seen[0].motion_a.speed_mrpm, 140_000);
    assert_eq!(seen[1].motion_a.speed_mrpm, 150_000);
    let pairs: Vec<_> = seen.iter().map(|i| i.step.pairs[1]).collect();
    assert_eq!(pairs, [(true, true), (false, true), (false, true), (true, true)]);
    let words: Vec<_> = seen.iter().map(|i| i.step.command.map(|word| word.0[0])).collect();
    assert_eq!(words, [Some(0x7E7F), Some(0x7E7F), Some(0x7E7F), Some(0x7E7E)]);
}

#[test]
fn the_first_row_has_stood_for_ever() {
    let trace = trace("t_ms,speed_rpm,ais\n3,60,1\n5,120,0\n");
    let seen = at(&trace, 1, &[0, 3, 4]);
    assert_eq!(seen[0].motion_a.speed_mrpm, 60_000);
    assert!(seen[0].step.ais);
    assert_eq!(seen[1].motion_a.position, 197);
    assert_eq!(seen[2].motion_a.speed_mrpm, 90_000);
}

#[test]
fn the_second_encoder_differs_only_where_the_trace_says_so() {
    let trace = trace("t_ms,speed_rpm,enc2_speed_rpm,enc2_pos_offset_incr\n0,600,600,0\n10,600,616,50\n");
    let seen = at(&trace, 1, &[0, 10]);
    assert_eq!(seen[0].motion_a, seen[0].motion_b);
    assert_eq!(seen[1].motion_b.speed_mrpm, 616_000);
    // 80 rpm ms more than A: 87.4 increments, and the offset.
    assert_eq!(seen[1].motion_b.position - seen[1].motion_a.position, 87 + 50);
}

#[test]
fn each_axis_has_its_own_rows_and_the_longest_ends_the_trace() {
    let trace = trace("t_ms,axis,speed_rpm,fault\n0,1,5,\n0,7,6,stale-encoder\n9.9,7,6,none\n2,1,5,\n");
    assert_eq!(at(&trace, 7, &[1])[0].motion_a.speed_mrpm, 6_000);
    assert!(at(&trace, 7, &[9])[0].step.faults.has(Fault::StaleEncoder));
    assert_eq!(trace.last_cycle(), 9);
}

#[test]
fn numbers_of_any_length_are_read() {
    let trace = trace("t_ms,speed_rpm\n0,1666.6666666666667\n3600000,1666.6666666666667\n");
    let seen = at(&trace, 1, &[3_600_000]);
    assert_eq!(seen[0].motion_a.position, 6_553_600_000);
    assert_eq!(seen[0].motion_a.speed_mrpm, 1_666_667);
}

#[test]
fn bad_input_is_one_clear_line() {
    assert_eq!(refused(""), "line 1: expected a header that names the columns, with t_ms");
    assert!(
        refused("t_ms,speed\n").starts_with("line 1: unknown column \"speed\", expected one of t_ms, axis")
    );
    assert_eq!(
        refused("t_ms,speed_rpm,pos_incr\n0,1,1\n"),
        "line 1: expected either speed_rpm or pos_incr, not both"
    );
    assert_eq!(refused("t_ms\n"), "line 2: expected at least one row");
    assert_eq!(refused("t_ms,se1\n0,12\n"), "line 2: \"12\", expected 11, 00, 10 or 01");
    assert_eq!(refused("t_ms\n1\n1\n"), "line 3: t_ms does not grow, expected strictly increasing times");
    assert!(refused("t_ms,fault\n0,boom\n").contains("unknown fault \"boom\", expected none, freeze-a"));
    assert_eq!(refused("t_ms,speed_rpm\n0,x\n"), "line 2: \"x\", expected a decimal number");
    assert_eq!(refused("t_ms,speed_rpm\n0\n"), "line 2: 1 cells, expected 2 as in the header");
    assert!(refused("t_ms,speed_rpm\n0,1e15\n10000000.000001,1e-12\n").contains("too large"));
}
