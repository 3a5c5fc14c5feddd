//! What each document asks for when a device is replaced or copied: as data, for the person
//! who does it. The seal itself enforces the core of it: a set sealed for one serial number
//! is refused by every other device.

use serde::Serialize;
use shm_schema::profile::Profile;

/// One step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Step {
    /// What to do.
    pub text: &'static str,
    /// Requirement it comes from.
    pub source: &'static str,
}

const fn step(text: &'static str, source: &'static str) -> Step {
    Step { text, source }
}

const AMK: &[Step] = &[
    step("Replace the complete card, never one half of it.", "AMK-SVC-02"),
    step("Write the serial number of the new device into the installation file.", "AMK-PMT-21"),
    step(
        "Take the file out of the sealed set and seal it again: the old confirmation holds for the old serial number only.",
        "AMK-SVC-03",
    ),
    step("Stop the set and start it again: only then is the new set in force.", "AMK-PMT-22"),
    step("Recheck all values with the acceptance report and test every operating mode.", "AMK-PMT-25"),
];

const LENZE: &[Step] = &[
    step(
        "Set the address switch, or C15111, exactly as on the replaced module; only then may the set be transferred.",
        "LNZ-MODX-04",
    ),
    step(
        "Write the serial number of the new device into the installation file, take the file out of the sealed set and seal it again.",
        "LNZ-PSET-06",
    ),
    step("Compare the check sums of parameter set and module after the transfer.", "LNZ-PSET-01"),
    step("Check the safety functions after the replacement.", "LNZ-COM-03"),
];

const ATV: &[Step] = &[
    step(
        "Save the configuration before; power off; mount the new drive; power on; transfer, accept what was read back, store the displayed code.",
        "ATV-SVC-01",
    ),
    step(
        "Write the serial number of the new device into the installation file and seal the saved file to it.",
        "ATV-SVC-01",
    ),
    step(
        "For a copy: change the F-address SC68 of the copy, so that it stays unique in the network.",
        "ATV-SVC-05",
    ),
    step("Set F_Dest_Address of the controller and SC68 to the same value.", "ATV-PSF-02"),
];

const ETG: &[Step] = &[
    step(
        "Write the serial number of the new device into the installation file, take the file out of the sealed set and seal it again.",
        "design 7",
    ),
    step("Check the safety functions after the replacement.", "design 7"),
];

/// The steps of a profile.
pub const fn steps(profile: Profile) -> &'static [Step] {
    match profile {
        Profile::AmkKw => AMK,
        Profile::LenzeSm301 => LENZE,
        Profile::Atv340 => ATV,
        Profile::Etg61002 | Profile::None => ETG,
    }
}
