//! Which functions a set makes active, read from the set itself and not from the steps that
//! prove them: a function without a step shows as not proven, and is never left out.

use std::collections::BTreeSet;

use serde::Serialize;
use shm_schema::{
    facts::lenze_sm301::control,
    profile::{Profile, lenze_key},
};

use super::trial::{Trial, supervision};
use crate::{key, set::AxisSet};

/// An active function that no step of the run proves.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Unproven {
    /// Function.
    pub function: String,
    /// Why there is no step.
    pub reason: &'static str,
}

/// The active functions that none of `trials` proves.
pub fn unproven<'a>(axis: &AxisSet, trials: impl IntoIterator<Item = &'a Trial>) -> Vec<Unproven> {
    let proven: BTreeSet<&str> = trials.into_iter().map(|trial| trial.function.as_str()).collect();
    let open = active(axis).into_iter().filter(|function| !proven.contains(function.as_str()));
    open.map(|function| Unproven { reason: reason(axis, &function), function }).collect()
}

/// Every function that is active in a set.
pub fn active(axis: &AxisSet) -> Vec<String> {
    let own = match axis.profile {
        Profile::AmkKw => amk(axis),
        Profile::LenzeSm301 => lenze(axis),
        Profile::Atv340 => atv(axis),
        Profile::Etg61002 => etg(axis),
        Profile::None => return Vec::new(),
    };
    let mut all = own;
    all.extend([supervision::ENCODER, supervision::CROSS_CHECK].map(String::from));
    all
}

fn names(rows: &[(&str, bool)]) -> Vec<String> {
    rows.iter().filter(|(_, active)| *active).map(|(name, _)| (*name).to_string()).collect()
}

/// AMK-IN-04, AMK-IN-07: the fieldbus commands everything, the inputs what is assigned to them.
fn amk(axis: &AxisSet) -> Vec<String> {
    let by_inputs = axis.value(7) == 1;
    let assigned = [axis.value(15), axis.value(16), axis.value(17)];
    let requested = |bit: i32| !by_inputs || assigned.contains(&bit);
    let functions = [
        ("STO", 0),
        ("SS1", 1),
        ("SS2", 2),
        ("SOS", 3),
        ("SSR1", 4),
        ("SSR2", 9),
        ("SSR3", 10),
        ("SSR4", 11),
        ("SLS1", 12),
        ("SLS2", 13),
        ("SDIp", 5),
        ("SDIn", 6),
        ("SLI", 14),
    ];
    let mut rows: Vec<(&str, bool)> = functions.map(|(name, bit)| (name, requested(bit))).into();
    let sine = axis.value(4) == 1 || axis.value(5) == 1;
    let free_outputs = !by_inputs && axis.value(8) == 0;
    let acknowledging = by_inputs && (axis.value(15) != 16 || axis.value(16) != 16);
    rows.extend([("SMS", true), ("SEM", sine), ("SE1", true), ("SE2", true), ("SE3", true)]);
    rows.extend([("SA1", free_outputs || acknowledging), ("SA2", true)]);
    names(&rows)
}

fn lenze(axis: &AxisSet) -> Vec<String> {
    let c = |code: u32, sub: u32| axis.value(lenze_key(code, sub));
    let bus = |bit: u8| c(15_100, 0) != 0 && c(15_113, 0) as u32 >> bit & 1 == 1;
    let live = |input: u32| c(15_030, input) != 0;
    let cascade = c(15_035, 0) == 4;
    let of_kind = |kind: i32| (1..=4).any(|input| live(input) && c(15_031, input) == kind);
    let assigned = |function: i32| {
        (1..=4).any(|input| live(input) && c(15_031, input) == 0 && c(15_032, input) == function)
    };
    let asked = |bit: u8, function: i32| bus(bit) || assigned(function);
    let encoder = c(15_400, 0) != 0;
    let special = of_kind(2) || bus(control::OMS);
    let sls = [control::SLS1, control::SLS2, control::SLS3, control::SLS4];
    let limited = |number: u32| {
        let function = number as i32 + 2;
        let requested = asked(sls[number as usize - 1], function) || special && c(15_201, 0) == function;
        encoder && c(15_330, number) > 0 && requested
    };
    // C15333: a limited speed with one direction monitors that direction.
    let directed = |side: i32| c(15_340, 0) == side || (1..=4).any(|at| limited(at) && c(15_333, at) == side);
    let ss2 = encoder && (asked(control::SS2, 2) || special && c(15_200, 0) == 2);
    // The cascade has the output for itself.
    let output = !cascade && (c(15_051, 1) != 0 || c(15_052, 1) != 0);
    // LNZ-CAS-08: in a cascade the enable switch goes on from SOS only.
    let enabled = special && (of_kind(3) || bus(control::ES)) && (!cascade || c(15_200, 0) == 2);
    names(&[
        ("STO", asked(control::STO, 0) || special && c(15_200, 0) == 0),
        ("SSE", bus(control::SSE) || of_kind(1)),
        ("SS1", asked(control::SS1, 1) || special && c(15_200, 0) == 1),
        ("SS2", ss2),
        ("SOS", ss2),
        ("SLS1", limited(1)),
        ("SLS2", limited(2)),
        ("SLS3", limited(3)),
        ("SLS4", limited(4)),
        ("SDIpos", encoder && (asked(control::SDIPOS, 7) || directed(1))),
        ("SDIneg", encoder && (asked(control::SDINEG, 8) || directed(2))),
        ("SMS", c(15_320, 0) > 0),
        ("OMS", special),
        ("ES", enabled),
        ("SLI", encoder && enabled && c(15_203, 0) > 0),
        ("cascade", cascade),
        ("SD-In1", live(1)),
        ("SD-In2", live(2)),
        ("SD-In3", live(3)),
        ("SD-In4", live(4) && !cascade),
        ("SD-Out1", output),
    ])
}

fn atv(axis: &AxisSet) -> Vec<String> {
    let sls = axis.value(66) == 1 && axis.value(39) != 0;
    let by_sls = sls && [3, 6].contains(&axis.value(39));
    names(&[
        ("STO", true),
        ("SS1", axis.value(65) == 1 || by_sls),
        ("SLS", sls),
        ("SMS", axis.value(56) != 0),
    ])
}

/// Every instance that the set names; SDI by its directions.
fn etg(axis: &AxisSet) -> Vec<String> {
    let zero = |function: &str| {
        let reference = key::reference(function).unwrap_or_default() as u32;
        let own = axis.values.iter().filter(|(key, _)| **key >> 8 == reference);
        let limits = own.filter(|(key, _)| !axis.name(**key).ends_with("error_reaction"));
        limits.into_iter().all(|(_, value)| *value == 0)
    };
    let mut active = Vec::new();
    for reference in super::trial::etg_instances(axis) {
        let name = key::reference_name(reference as i32);
        match key::function_name(reference >> 8).unwrap_or_default() {
            "SDI" => active.extend(["SDIP", "SDIN"].map(String::from)),
            // ETG-SMS-01, ETG-SMA-01, ETG-SSM-02, ETG-SCA-02: active while a limit is not zero.
            "SMS" | "SMA" | "SSM" | "SCA" if zero(&name) => {}
            _ => active.push(name),
        }
    }
    active
}

fn reason(axis: &AxisSet, function: &str) -> &'static str {
    match (axis.profile, function) {
        (Profile::AmkKw, "SEM") => {
            "Prm9 + Prm10 are longer than the four hours that a run goes through: by hand"
        }
        (Profile::Etg61002, _) => {
            "nothing requests or shows it (give it a bit in [words]), or SMS comes first: by hand"
        }
        _ => "the run has no step for this setting: by hand",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acceptance::trial::trials;
    use crate::definition;

    /// Issue: a test step for each active function. Taking away the steps of one function makes
    /// that function show, whichever it is.
    #[test]
    fn a_function_without_a_step_is_not_proven() {
        for profile in definition::PROFILES {
            let set = AxisSet::delivery(profile, 1, "S");
            let all = trials(&set);
            assert_eq!(unproven(&set, &all), [], "{}", profile.name());
            for function in active(&set) {
                let others = all.iter().filter(|trial| trial.function != function);
                let open = unproven(&set, others);
                assert!(open.len() == 1 && open[0].function == function, "{}: {open:?}", profile.name());
            }
        }
    }
}
