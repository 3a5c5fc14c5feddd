//! The installation: serial numbers of the devices, and the password of whoever may seal.
//!
//! ```toml
//! serial = "SIM-0001"     # every axis that has none of its own
//! [axis]
//! 2 = "SIM-0002"
//! [password]              # written by `set_password`
//! salt = "…"
//! rounds = 200000
//! hash = "…"
//! ```

use std::{collections::BTreeMap, fmt, fs, io::Read as _, path::Path};

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use shm_schema::image::SERIAL_OCTETS;

use super::SealError;

/// Rounds of a new password's hash.
const ROUNDS: u32 = if cfg!(test) { 1_000 } else { 200_000 };
/// Fewest characters of a password (AMK-PMT-14).
pub const PASSWORD_MIN: usize = 8;

/// What the file of an installation says.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Installation {
    /// Serial number of every axis that has none of its own.
    #[serde(default)]
    serial: String,
    /// Serial numbers by axis.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    axis: BTreeMap<String, String>,
    /// The password, hashed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    password: Option<Stored>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    salt: String,
    rounds: u32,
    hash: String,
}

/// Why a password was not accepted (AMK-PMT-15: each its own).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PasswordError {
    /// None was given.
    Missing,
    /// None is set: an installation without a password seals nothing.
    NotSet,
    /// The wrong one.
    Wrong,
    /// A new one that is too short, or has no letter or no digit.
    Weak,
}

impl fmt::Display for PasswordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => f.write_str("no password was given"),
            Self::NotSet => f.write_str("the installation has no password yet"),
            Self::Wrong => f.write_str("the password is wrong"),
            Self::Weak => {
                write!(f, "a new password needs {PASSWORD_MIN} characters, with letters and digits")
            }
        }
    }
}

impl Installation {
    /// An installation with one serial number and no password.
    pub fn new(serial: &str) -> Self {
        Self { serial: serial.into(), ..Self::default() }
    }

    /// Reads the file of an installation.
    ///
    /// # Errors
    /// Reading, or what is wrong in it.
    pub fn read(path: &Path) -> Result<Self, SealError> {
        let text = fs::read_to_string(path)?;
        toml::from_str(&text).map_err(|error| {
            SealError::Io(std::io::Error::new(std::io::ErrorKind::InvalidData, error.to_string()))
        })
    }

    /// Writes it, whole or not at all.
    ///
    /// # Errors
    /// Writing.
    pub fn write(&self, path: &Path) -> Result<(), SealError> {
        let text =
            toml::to_string(self).map_err(|error| SealError::Io(std::io::Error::other(error.to_string())))?;
        Ok(super::store::replace(path, text.as_bytes())?)
    }

    /// Serial number of an axis, if it is one.
    pub fn serial_of(&self, axis: u8) -> Option<&str> {
        let own = self.axis.get(&axis.to_string()).unwrap_or(&self.serial);
        let fits = !own.is_empty() && own.len() <= SERIAL_OCTETS;
        (fits && own.bytes().all(|octet| octet.is_ascii_graphic())).then_some(own.as_str())
    }

    /// Whether a password is set.
    pub fn has_password(&self) -> bool {
        self.password.is_some()
    }

    /// Whether `password` may seal.
    ///
    /// # Errors
    /// Why not.
    pub fn verify(&self, password: &str) -> Result<(), PasswordError> {
        if password.is_empty() {
            return Err(PasswordError::Missing);
        }
        let stored = self.password.as_ref().ok_or(PasswordError::NotSet)?;
        let hash = hashed(&stored.salt, password, stored.rounds);
        // Every octet is compared, so that time tells nothing.
        let differing =
            hash.bytes().zip(stored.hash.bytes()).fold(0, |all, (own, other)| all | (own ^ other));
        let equal = differing == 0 && hash.len() == stored.hash.len();
        if equal { Ok(()) } else { Err(PasswordError::Wrong) }
    }

    /// Sets a password; the old one is asked for once there is one.
    ///
    /// # Errors
    /// The old one is wrong, or the new one is weak.
    pub fn set_password(&mut self, old: &str, new: &str) -> Result<(), SealError> {
        if self.password.is_some() {
            self.verify(old).map_err(SealError::Password)?;
        }
        let has = |kind: fn(&char) -> bool| new.chars().any(|letter| kind(&letter));
        let strong =
            [new.chars().count() >= PASSWORD_MIN, has(char::is_ascii_digit), has(char::is_ascii_alphabetic)];
        if strong.contains(&false) {
            return Err(SealError::Password(PasswordError::Weak));
        }
        let salt = salt()?;
        let hash = hashed(&salt, new, ROUNDS);
        self.password = Some(Stored { salt, rounds: ROUNDS, hash });
        Ok(())
    }
}

fn salt() -> Result<String, SealError> {
    let mut octets = [0; 16];
    fs::File::open("/dev/urandom")?.read_exact(&mut octets)?;
    Ok(hexadecimal(&octets))
}

fn hexadecimal(octets: &[u8]) -> String {
    octets
        .iter()
        .flat_map(|octet| [octet >> 4, octet & 0xF])
        .filter_map(|digit| char::from_digit(u32::from(digit), 16))
        .collect()
}

/// SHA-256 of salt and password, repeated.
fn hashed(salt: &str, password: &str, rounds: u32) -> String {
    let mut hash = Sha256::new().chain_update(salt).chain_update(password).finalize();
    for _ in 0..rounds {
        hash = Sha256::new().chain_update(hash).chain_update(salt).chain_update(password).finalize();
    }
    hexadecimal(&hash)
}
