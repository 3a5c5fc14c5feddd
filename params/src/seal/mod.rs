//! Sealing: a checked set becomes the images of one installation.
//!
//! The order is the vendor's (AMK-PMT-07): prepare, look at the values, type the content
//! signature back, images written. The serial number comes from the installation, never from
//! the file that is sealed (design 7). Three things are stored apart, so that one damaged
//! file cannot vouch for itself (AMK-PMT-20):
//!
//! ```text
//! DIR/current -> sets/<signature>/      switched by one rename
//! DIR/sets/<signature>/set.toml         the file that was sealed
//! DIR/sets/<signature>/axis-01.a.img    what channel A reads, and so on
//! DIR/confirmed/<signature>.toml        what a person typed back
//! ```
//!
//! A kill at any instant leaves `current` at the whole old set or the whole new one.

#[cfg(test)]
mod faults;
pub mod installation;
pub mod replacement;
mod store;

use std::{fmt, io, path::Path};

use crc::{CRC_32_ISO_HDLC, Crc};
use serde::Serialize;

use crate::{
    check,
    diagnostic::Diagnostic,
    image::{Image, ImageError, Signatures},
    set::Machine,
};
pub use installation::{Installation, PasswordError};
pub use store::{IMAGE_FOLDER, source};

/// Why a set was not sealed, or does not verify.
#[derive(Debug)]
pub enum SealError {
    /// The file has errors.
    File(Vec<Diagnostic>),
    /// A rule of the profile is broken.
    Rules(Vec<check::Finding>),
    /// The installation knows no serial number for an axis.
    NoSerial(u8),
    /// The password.
    Password(PasswordError),
    /// What was typed back is not the content signature.
    TypedBack {
        /// What was typed.
        typed: String,
        /// What the set has.
        signature: String,
    },
    /// Reading or writing failed.
    Io(io::Error),
    /// Writing the set failed (AMKD-XFR-05).
    Transfer {
        /// 3609/5, or 3609/133 where no set is in force.
        code: &'static str,
        /// Why.
        error: io::Error,
    },
}

impl fmt::Display for SealError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(diagnostics) => write!(f, "the file has {} errors", diagnostics.len()),
            Self::Rules(findings) => write!(f, "the set breaks {} rules", findings.len()),
            Self::NoSerial(axis) => write!(f, "the installation names no serial number for axis {axis}"),
            Self::Password(error) => error.fmt(f),
            Self::TypedBack { typed, signature } => {
                write!(f, "\"{typed}\" was typed back, the content signature is {signature}")
            }
            Self::Io(error) => error.fmt(f),
            Self::Transfer { code, error } => {
                write!(f, "{code}: writing the set failed: {error}; transfer it again")
            }
        }
    }
}

impl std::error::Error for SealError {}

impl From<io::Error> for SealError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// A set with the serial numbers of its installation, ready to be looked at and confirmed.
#[derive(Clone, Debug, Serialize)]
pub struct Prepared {
    /// The sets.
    pub machine: Machine,
    /// Signatures of each axis, with its number.
    pub signatures: Vec<(u8, Signatures)>,
    #[serde(skip)]
    text: String,
}

impl Prepared {
    /// What a person types back: the content signature; for several axes the CRC-32 over
    /// theirs, in the order of the axes.
    pub fn content_signature(&self) -> String {
        let words: Vec<u32> = self.signatures.iter().map(|(_, signatures)| signatures.content).collect();
        format!("{:08X}", joined(&words))
    }

    /// The same over the device signatures: the name under which the set is stored.
    pub fn device_signature(&self) -> String {
        let words: Vec<u32> = self.signatures.iter().map(|(_, signatures)| signatures.device).collect();
        format!("{:08X}", joined(&words))
    }
}

fn joined(words: &[u32]) -> u32 {
    match words {
        [one] => *one,
        several => {
            let octets: Vec<u8> = several.iter().flat_map(|word| word.to_le_bytes()).collect();
            Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&octets)
        }
    }
}

/// Reads and judges a file for an installation.
///
/// # Errors
/// Everything that is wrong with it, or a missing serial number.
pub fn prepare(text: &str, file: &str, installation: &Installation) -> Result<Prepared, SealError> {
    let mut machine = crate::parse(text, file).map_err(SealError::File)?;
    let report = check::check(text, file);
    if !report.passed() {
        let errors =
            report.findings.into_iter().filter(|finding| finding.severity == crate::rule::Severity::Error);
        return Err(SealError::Rules(errors.collect()));
    }
    for axis in &mut machine.axes {
        axis.serial = installation.serial_of(axis.number).ok_or(SealError::NoSerial(axis.number))?.into();
    }
    let signatures = machine.axes.iter().map(|axis| (axis.number, axis.signatures())).collect();
    Ok(Prepared { machine, signatures, text: text.into() })
}

/// Writes the images without the mark of validation: a set that dies with the next restart.
///
/// # Errors
/// Writing.
pub fn load(prepared: &Prepared, folder: &Path) -> Result<(), SealError> {
    store::write(prepared, folder, None).map_err(|error| failed(folder, error))
}

/// AMKD-XFR-04: 128 more where the current set is invalid.
fn failed(folder: &Path, error: io::Error) -> SealError {
    let code = if state(folder) == State::Empty { "3609/133/7/57" } else { "3609/5/7/57" };
    SealError::Transfer { code, error }
}

/// A transfer into `folder` began and did not end: 3609/6. The set before it is in force.
pub fn is_interrupted(folder: &Path) -> bool {
    store::is_interrupted(folder)
}

/// Seals: the password, the signature as typed back, then the switch.
///
/// # Errors
/// Wrong password, wrong signature, writing. Nothing is changed then.
pub fn seal(
    prepared: &Prepared,
    installation: &Installation,
    password: &str,
    typed: &str,
    folder: &Path,
) -> Result<(), SealError> {
    installation.verify(password).map_err(SealError::Password)?;
    let signature = prepared.content_signature();
    let plain = typed.trim().trim_start_matches("0x").to_ascii_uppercase();
    if plain != signature {
        return Err(SealError::TypedBack { typed: typed.trim().into(), signature });
    }
    store::write(prepared, folder, Some(&plain)).map_err(|error| failed(folder, error))
}

/// What a restart does (design 7, AMK-PMT-17): a set that is loaded but not validated is
/// erased, and a transfer that did not end is over. Whoever starts a machine calls it first;
/// true means that there is no set now.
///
/// # Errors
/// Reading or removing.
pub fn restart(folder: &Path) -> Result<bool, SealError> {
    let erased = store::erase_unvalidated(folder)?;
    // 3609/6: a restart ends what was not completed.
    if store::is_interrupted(folder) {
        store::end_transfer(folder)?;
    }
    Ok(erased)
}

/// One thing that was verified.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Item {
    /// What.
    pub what: String,
    /// Whether it is right.
    pub right: bool,
    /// What was found.
    pub found: String,
    /// Code that an AMK device shows for it (3609); empty when it is right, or only loaded.
    pub code: String,
}

/// How far a transfer has come (AMK-PMT-17, AMK-PMT-22, AMK-PMT-24).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// There is no set: nothing can start.
    Empty,
    /// A set is loaded and waits for its validation; a restart erases it.
    Loaded,
    /// A sealed set; in force from the next start of the machine on.
    Sealed,
}

impl State {
    /// What a person has to know.
    pub fn text(self) -> &'static str {
        match self {
            Self::Empty => "no set: transfer one (3609/128/6)",
            Self::Loaded => "loaded, validation requested: seal it; a restart erases it",
            Self::Sealed => "sealed: in force after the next restart of the set (3609/9/0)",
        }
    }
}

/// The state of a folder.
pub fn state(folder: &Path) -> State {
    match store::target(folder) {
        None => State::Empty,
        Some(target) if store::is_unvalidated(&target) => State::Loaded,
        Some(_) => State::Sealed,
    }
}

/// Verifies the current set of a folder against its installation, item by item.
///
/// # Errors
/// There is no set, or it cannot be read.
pub fn verify(folder: &Path, installation: &Installation) -> Result<Vec<Item>, SealError> {
    let text = store::source(folder)?;
    let prepared = prepare(&text, "set.toml", installation)?;
    let mut items = vec![confirmed(&prepared, folder)];
    for axis in &prepared.machine.axes {
        let expected = axis.signatures();
        for channel in ["a", "b"] {
            let read = store::image(folder, axis.number, channel).map(|octets| Image::read(&octets));
            items.push(judged(axis.number, channel, read, expected));
        }
    }
    Ok(items)
}

/// Verifies one image, as a third party could: against the file it should hold and the serial
/// number it should be sealed to.
pub fn verify_image(octets: &[u8], machine: &Machine, serial: &str) -> Vec<Item> {
    let read = Image::read(octets);
    let number = read.as_ref().map_or(1, |image| image.axis);
    // The encoding tells for which channel it is: the plain one is A's.
    let plain = octets.first_chunk::<4>() == Some(&shm_schema::image::MAGIC.to_le_bytes());
    let channel = if plain { "a" } else { "b" };
    let Some(axis) = machine.axes.iter().find(|axis| axis.number == number) else {
        let found = format!("of axis {number}, which the file does not have");
        return vec![Item { what: "axis".into(), right: false, found, code: "3609/128/6/55".into() }];
    };
    let own = crate::AxisSet { serial: serial.into(), ..axis.clone() };
    let rules = check::check_set(&own);
    let broken = rules.iter().filter(|finding| finding.severity == crate::rule::Severity::Error);
    let codes: Vec<_> = broken.map(|finding| format!("{} {}", finding.rule, finding.code)).collect();
    vec![
        judged(number, channel, Ok(read), own.signatures()),
        Item {
            what: "rules of the profile".into(),
            right: codes.is_empty(),
            found: if codes.is_empty() { "none is broken".into() } else { codes.join(", ") },
            code: String::new(),
        },
    ]
}

fn confirmed(prepared: &Prepared, folder: &Path) -> Item {
    let found = store::confirmation(folder, &prepared.device_signature());
    let right = found.as_ref() == Some(&prepared.content_signature());
    // AMK-PMT-20: it is kept apart from the set. None at all reads as 0 (3609/128/10).
    let code = if found.is_some() { "3609/74/0/4" } else { "3609/128/10/56" };
    Item {
        what: "content signature as typed back".into(),
        right,
        found: found.unwrap_or_else(|| "none".into()),
        code: if right { String::new() } else { code.into() },
    }
}

fn judged(
    axis: u8,
    channel: &str,
    read: io::Result<Result<Image, ImageError>>,
    expected: Signatures,
) -> Item {
    // AMKD-XFR-02: the phase "check at start", by channel.
    let phase = if channel == "a" { 55 } else { 56 };
    let wrong = |info2: u8, found: String| (false, found, format!("3609/128/{info2}/{phase}"));
    let (right, found, code) = match read {
        Err(error) => wrong(6, error.to_string()),
        Ok(Err(error @ (ImageError::CheckSum | ImageError::Signature))) => wrong(4, error.to_string()),
        Ok(Err(error)) => wrong(6, error.to_string()),
        Ok(Ok(image)) => {
            let Signatures { content, device, .. } = image.signatures;
            let found = format!("serial {}, device signature {device:08X}", image.serial);
            if image.axis != axis {
                wrong(6, format!("of axis {}", image.axis))
            } else if content != expected.content || image.signatures.template != expected.template {
                wrong(4, format!("{found}, content {content:08X}, not {:08X}", expected.content))
            } else if device != expected.device {
                // Sealed for another device: the hardware was replaced.
                wrong(9, format!("{found}, not {:08X}", expected.device))
            } else if image.validated {
                (true, format!("validated, {found}"), String::new())
            } else {
                (false, format!("loaded, not validated: dies with the next restart, {found}"), String::new())
            }
        }
    };
    Item { what: format!("axis {axis}, image {channel}"), right, found, code }
}

#[cfg(test)]
mod tests;
