//! What has to be proved by hand at the machine, function by function.

use serde::Serialize;
use shm_schema::{
    catalogue,
    profile::{Profile, common},
};

use crate::{key, set::AxisSet};

/// One function to be proved at the machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Proof {
    /// Function.
    pub function: String,
    /// What to do.
    pub test: String,
    /// What has to happen.
    pub expected: String,
}

/// One proof for every function in use.
pub(super) fn proofs(axis: &AxisSet) -> Vec<Proof> {
    match axis.profile {
        Profile::Etg61002 => generic(axis),
        profile => tabled(profile),
    }
}

#[derive(serde::Deserialize)]
struct Proofs {
    proof: Vec<Tabled>,
}

#[derive(serde::Deserialize)]
struct Tabled {
    profile: String,
    function: String,
    test: String,
    expected: String,
}

/// Functions of a vendor's profile: the vendor's list is fixed, and a function that is not
/// in use is proved to be out of use.
fn tabled(profile: Profile) -> Vec<Proof> {
    let table: Proofs = toml::from_str(catalogue::PROOFS)
        .expect("the fact tables are part of the build and checked by its tests");
    let own = table.proof.into_iter().filter(|proof| proof.profile == profile.name());
    own.map(|proof| Proof { function: proof.function, test: proof.test, expected: proof.expected }).collect()
}

/// Every named instance, with the reaction that its set gives it.
fn generic(axis: &AxisSet) -> Vec<Proof> {
    let keys = axis.values.keys().filter(|key| **key < common::CONTROL_WORD);
    let mut instances: Vec<u32> = keys.map(|key| key >> 8).collect();
    instances.dedup();
    instances.into_iter().map(|instance| proof_of(axis, instance)).collect()
}

fn proof_of(axis: &AxisSet, instance: u32) -> Proof {
    let name = key::reference_name(instance as i32);
    let own = axis.values.iter().filter(|(key, _)| **key >> 8 == instance && **key < common::CONTROL_WORD);
    let reaction = own
        .filter(|(key, _)| axis.name(**key).ends_with("error_reaction"))
        .map(|(_, value)| key::reference_name(*value))
        .next();
    let stop = matches!(name.split('_').next(), Some("STO" | "SS1" | "SS2" | "SBC"));
    Proof {
        test: if stop {
            format!("request {name} in motion")
        } else {
            format!("request {name} where it has a request, then leave its limits")
        },
        expected: match reaction {
            None => format!("{name} as parameterised; a violation ends in STO with the error bit"),
            Some(reaction) => format!("error bit, then {reaction}"),
        },
        function: name,
    }
}
