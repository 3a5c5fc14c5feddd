//! A machine: the parameter sets of its axes.

use std::collections::BTreeMap;

use serde::Serialize;
use shm_schema::profile::{Profile, common};

use crate::{definition, diagnostic::Position, key};

/// Everything one file says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Name of the file.
    pub file: String,
    /// The axes, ascending by number.
    pub axes: Vec<AxisSet>,
}

/// The parameter set of one axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct AxisSet {
    /// Number of the axis, 1 to 64.
    pub number: u8,
    /// Profile.
    #[serde(serialize_with = "profile_name")]
    pub profile: Profile,
    /// Serial number as the file gives it; sealing takes the installation's.
    pub serial: String,
    /// Raw values by key of the image, with the defaults of what the file leaves out.
    pub values: BTreeMap<u32, i32>,
    /// Where the file names a key; what it leaves out is not here.
    #[serde(skip)]
    pub named: BTreeMap<u32, Position>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature is serde's")]
fn profile_name<S: serde::Serializer>(profile: &Profile, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(profile.name())
}

impl AxisSet {
    /// The delivery state of a profile: every default, nothing named.
    pub fn delivery(profile: Profile, number: u8, serial: &str) -> Self {
        Self { number, profile, serial: serial.into(), values: defaults(profile), named: BTreeMap::new() }
    }

    /// Raw value of a key; 0 when it is absent.
    pub fn value(&self, key: u32) -> i32 {
        self.values.get(&key).copied().unwrap_or_default()
    }

    /// Name of a key as files write it.
    pub fn name(&self, number: u32) -> String {
        name(self.profile, number)
    }
}

/// Name of a key of the image as files of that profile write it.
pub fn name(profile: Profile, number: u32) -> String {
    if (common::CONTROL_WORD..common::STATUS_WORD).contains(&number) {
        return format!("control.{}", number - common::CONTROL_WORD);
    }
    if (common::STATUS_WORD..common::STATUS_WORD + 0x1000).contains(&number) {
        return format!("status.{}", number - common::STATUS_WORD);
    }
    let etg = profile == Profile::Etg61002;
    let etg = etg.then(|| key::etg_name(number)).flatten();
    let plain = || definition::by_number(profile, number).map(|definition| definition.key.clone());
    etg.or_else(plain).unwrap_or_else(|| format!("0x{number:08X}"))
}

/// Values of a set that names nothing (DEC-28). In the generic profile only the restart
/// behaviour of STO, the one function that always exists (DEC-40, DEC-12).
pub fn defaults(profile: Profile) -> BTreeMap<u32, i32> {
    let own = definition::definitions(profile)
        .iter()
        .filter(|definition| definition.fixed_to.is_none() && !definition.optional);
    let own = own.filter(|definition| {
        profile != Profile::Etg61002 || definition.key == "STO.restart_acknowledge_behavior"
    });
    let common = definition::common().iter().filter(|_| profile != Profile::AmkKw);
    let instance = if profile == Profile::Etg61002 { 0x100 } else { 0 };
    let own = own.map(|definition| (definition.number | instance, definition.default as i32));
    own.chain(common.map(|definition| (definition.number, definition.default as i32))).collect()
}

/// A raw value of the image as wide as a file would write it: the pattern of a bit field has
/// no sign.
pub fn widen(profile: Profile, key: u32, value: i32) -> i64 {
    let bits = definition::by_number(profile, key)
        .is_some_and(|definition| definition.kind == definition::Kind::Bits);
    if bits { i64::from(value as u32) } else { i64::from(value) }
}
