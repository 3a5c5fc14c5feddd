//! Safe outputs through whole steps: levels, inversion, load between the terminals, readback.

use shm_schema::exchange::{Inputs, Outputs};
use shm_schema::facts::{amk_kw, lenze_sm301};
use shm_schema::profile::Profile;
use std::vec;

use crate::testing::{Rig, codes};

const NEUTRAL: u32 = 0x0000_7E7F;

fn amk(changes: &[(u32, i32)]) -> Rig {
    let mut all = vec![(67, 3000), (2, 1_000_000), (3, 60_000)];
    all.extend_from_slice(changes);
    Rig::new(Profile::AmkKw, &all)
}

/// Whether SA1.2 and SA2.2 are high at the first sample.
fn levels(outputs: &Outputs) -> [bool; 2] {
    let [sa1, sa2, _] = outputs.inhibit.outputs;
    [sa1, sa2].map(|driven| driven & 1 == 1)
}

/// AMK-OUT-05, AMKP-SA-04: SA2 is the acknowledgement of STO; Prm98 inverts its second line.
#[test]
fn sa2_shows_sto_and_its_second_line_is_inverted_by_prm98() {
    for (prm98, high_in_sto) in [(0, true), (1, false)] {
        let mut rig = amk(&[(98, prm98)]);
        assert_eq!(levels(&rig.step()), [false, !high_in_sto]);
        rig.world.word = NEUTRAL & !(1 << amk_kw::control::STO);
        assert_eq!(levels(&rig.step()), [false, high_in_sto]);
    }
}

/// AMK-OUT-07, AMKP-CMD-02: with Prm7 = 0 and Prm8 = 0 bits 30 and 31 drive the outputs;
/// AMK-OUT-06: with Prm104 = 1 SA1.2 is the low side of the load.
#[test]
fn free_outputs_follow_their_bits_and_a_low_side_is_low_while_on() {
    for (prm104, prm92, on) in [(0, 0, true), (1, 0, false), (0, 1, false), (1, 1, true)] {
        let mut rig = amk(&[(8, 0), (104, prm104), (92, prm92)]);
        assert_eq!(levels(&rig.step()), [!on, false]);
        rig.world.word = NEUTRAL | 1 << amk_kw::control::SA1 | 1 << amk_kw::control::SA2;
        assert_eq!(levels(&rig.step()), [on, true]);
    }
}

/// AMK-DYN-09, AMKP-SA-03: the sampling supply has no switch, the outputs have.
#[test]
fn sdyn2_is_always_pulsed_and_sa2_only_with_prm93() {
    let low = |prm93: i32| {
        let mut rig = amk(&[(93, prm93), (96, 500), (97, 50), (101, 1_000), (102, 100)]);
        rig.world.word = NEUTRAL & !(1 << amk_kw::control::STO);
        (0..1_000).fold([0, 0], |[sa2, supply], _| {
            let [_, second, third] = rig.step().inhibit.outputs;
            assert!(codes(&rig.last[1].expect("stepped")).is_empty());
            [sa2 + 16 - second.count_ones(), supply + 16 - third.count_ones()]
        })
    };
    // 20 pulses of 8 samples in a second, 10 of 16.
    assert_eq!(low(1), [160, 160]);
    assert_eq!(low(0), [0, 160]);
}

/// AMKD-3606-028: a line of channel 2 that does not follow is STO.
#[test]
fn an_output_that_does_not_follow_is_an_error_of_its_line() {
    for (line, code) in [(1, [3606, 28, 1, 1]), (3, [3606, 28, 1, 2])] {
        let mut rig = amk(&[(8, 0)]);
        rig.step();
        rig.world.word = NEUTRAL | 3 << amk_kw::control::SA1;
        let stuck = |inputs: &mut Inputs| {
            if let Ok(cell) = &mut inputs.io {
                cell.payload.output_readback[line] = 0;
            }
        };
        let first = (0..20).find(|_| !codes(&rig.step_with(stuck)).is_empty());
        assert_eq!(first, Some(4));
        let tripped = rig.last[1].expect("stepped");
        assert_eq!((codes(&tripped), tripped.inhibit.permit), (vec![code], false));
    }
}

fn lenze(changes: &[(u32, u32, i32)]) -> Rig {
    let mut all = vec![(15_100 << 8, 1), (15_113 << 8, -1), (15_300 << 8 | 1, 1)];
    all.extend(changes.iter().map(|(code, sub, value)| (code << 8 | sub, *value)));
    Rig::new(Profile::LenzeSm301, &all)
}

/// LNZ-OUT-01, LNZ-OUT-05: the selected conditions and the bus agree, or the output is off.
#[test]
fn sd_out1_shows_its_conditions_while_the_bus_lets_it() {
    let neutral = Profile::LenzeSm301.neutral_word();
    let sto = neutral & !(1 << lenze_sm301::control::STO);
    let is_on = |changes: &[(u32, u32, i32)], word: u32| {
        let mut rig = lenze(changes);
        rig.step();
        rig.world.word = word;
        let [on, _] = levels(&rig.step());
        on
    };
    let (sto_active, not_sto, no_error) = (1, 2, i32::MIN);
    assert!(is_on(&[(15_051, 1, sto_active)], sto) & !is_on(&[(15_051, 1, sto_active)], neutral));
    assert!(!is_on(&[(15_051, 1, not_sto)], sto) & is_on(&[(15_051, 1, not_sto)], neutral));
    // OR, AND of "STO active" and "no error".
    let both = [(15_051, 1, sto_active), (15_052, 1, no_error)];
    assert!(is_on(&[both[0], both[1], (15_055, 1, 0)], neutral));
    assert!(!is_on(&[both[0], both[1], (15_055, 1, 1)], neutral));
    assert!(is_on(&[both[0], both[1], (15_055, 1, 1)], sto));
    let off = sto & !(1 << lenze_sm301::control::SD_OUT1);
    assert!(!is_on(&[(15_051, 1, sto_active)], off));
}

/// LNZ-OUT-02, LNZ-OUT-03: a pulse below 1 ms about every 2 s; a fault is the output off, no STO.
#[test]
fn sd_out1_is_tested_and_switched_off_when_it_does_not_follow() {
    let mut rig = lenze(&[]);
    let low: u32 = (0..4_000).map(|_| 16 - (rig.step().inhibit.outputs[0] & 0xFFFF).count_ones()).sum();
    assert_eq!(low, 2 * 8);
    let stuck = |inputs: &mut Inputs| {
        if let Ok(cell) = &mut inputs.io {
            cell.payload.output_readback[1] = 0;
        }
    };
    for _ in 0..8 {
        rig.step_with(stuck);
    }
    let faulty = rig.last[1].expect("stepped");
    assert_eq!((codes(&faulty), levels(&faulty)[0]), (vec![[89, 0, 0, 0]], false));
    assert!(faulty.inhibit.permit);
}
