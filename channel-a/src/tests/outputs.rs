//! Safe outputs of an axis: levels, and what happens when a line does not follow.

use super::bench::{Bench, codes};
use shm_schema::report::Stop;

const ON: u64 = 0xFFFF;
const SA1: u32 = 1 << 30;
const SA2: u32 = 1 << 31;

fn driven(bench: &mut Bench) -> [u64; 3] {
    bench.step().inhibit.outputs
}

#[test]
fn free_outputs_follow_their_control_bits() {
    // AMK-OUT-07, AMKP-CMD-02: Prm7 = 0, Prm8 = 0
    let mut bench = Bench::amk(&[(67, 3_000), (8, 0)]);
    bench.until(5);
    assert_eq!(driven(&mut bench), [0, 0, ON]);
    bench.word |= SA1;
    assert_eq!(driven(&mut bench), [ON, 0, ON]);
    bench.word |= SA2;
    assert_eq!(driven(&mut bench), [ON, ON, ON]);
}

#[test]
fn fixed_outputs_acknowledge_the_functions_of_the_inputs_and_sto() {
    // AMK-OUT-01, AMK-OUT-02, AMK-OUT-05: SE1 requests SOS, SE2 SLS1
    let entries = [(67, 3_000), (7, 1), (15, 3), (16, 12), (54, 100), (57, 500), (28, 500), (29, 50_000)];
    let mut bench = Bench::amk(&entries);
    bench.until(5);
    assert_eq!(driven(&mut bench), [0, 0, ON]);
    bench.lines[0] = false;
    bench.until(20);
    assert_eq!(driven(&mut bench), [ON, 0, ON]);
    bench.lines[1] = false;
    bench.until(60);
    assert_eq!(driven(&mut bench)[0], 0, "SLS1 is still on its way");
    bench.until(200);
    assert_eq!(driven(&mut bench)[0], ON);
    bench.lines[2] = false;
    bench.encoder_alive = false;
    bench.until(210);
    assert_eq!(driven(&mut bench), [0, ON, ON], "STO by an error");
}

#[test]
fn an_output_that_does_not_follow_is_an_error_of_channel_1() {
    // 3606/27, AMKD-OUTM-01
    let mut bench = Bench::amk(&[(67, 3_000), (8, 0)]);
    bench.word |= SA1;
    bench.returned = Some(|_, read| read);
    assert_eq!(codes(&bench.until(60)), []);
    bench.returned = Some(|line, read| if line == 0 { 0 } else { read });
    assert_eq!(codes(&bench.until(63)), []);
    let report = bench.until(64);
    assert_eq!((codes(&report).as_slice(), report.stop), ([(3606, 27, 1, 1)].as_slice(), Stop::Sto));
}

#[test]
fn a_test_pulse_that_is_not_seen_is_an_error_of_channel_1() {
    // AMK-DYN-09: Prm93 = 1, 500 µs in 50 ms
    let mut bench = Bench::amk(&[(67, 3_000), (8, 0), (93, 1), (94, 500), (95, 50)]);
    bench.word |= SA2;
    bench.returned = Some(|_, read| read);
    assert_eq!(codes(&bench.until(500)), []);
    bench.returned = Some(|line, read| if line == 1 { ON } else { read });
    assert_eq!(codes(&bench.until(560)), [(3606, 27, 1, 2)]);
}
