//! What a code means: every message of the four catalogues with cause, reaction and remedy.
//!
//! Codes are written as replay writes them: AMK `3606/13/6/0` (fields may be left out from
//! the right), Lenze message numbers, ATV `SME0A9`, ETG `SLS-E1`.

mod amk;

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};
use shm_schema::{catalogue, profile::Profile};

use crate::definition;

/// One field of an AMK code, put into words.
#[derive(Clone, Debug, Serialize)]
pub struct Info {
    /// Name of the field: `Info2` …
    pub field: String,
    /// Its value.
    pub value: String,
    /// What it says.
    pub meaning: String,
    /// Parameters it concerns.
    pub params: String,
}

/// One code explained.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Explanation {
    /// Profile.
    pub profile: String,
    /// The code as it was recognised.
    pub code: String,
    /// Short name.
    pub title: String,
    /// Class: error, warning, trouble …
    pub class: String,
    /// Channel that reports it, where that is fixed.
    pub channel: String,
    /// Why it appears.
    pub cause: String,
    /// What the drive does.
    pub reaction: String,
    /// What to do.
    pub remedy: String,
    /// How it is acknowledged.
    pub acknowledge: String,
    /// Parameters to look at.
    pub params: String,
    /// The fields, put into words.
    pub infos: Vec<Info>,
    /// Where the catalogue has it from, and what it remarks.
    pub source: String,
}

#[derive(Deserialize)]
struct Codes {
    code: Vec<Code>,
}

/// A row of Lenze, ATV or ETG; what a profile has not is empty.
#[derive(Deserialize)]
struct Code {
    #[serde(rename = "code")]
    number: toml::Value,
    #[serde(default)]
    info: String,
    #[serde(default)]
    name: String,
    #[serde(default)]
    group: String,
    #[serde(default)]
    error_class: Option<toml::Value>,
    cause: String,
    reaction: String,
    remedy: String,
    #[serde(default)]
    ack: String,
    #[serde(default)]
    note: String,
    at: String,
}

impl Code {
    fn explanation(&self, profile: Profile) -> Explanation {
        let class = self.error_class.as_ref().map(text).unwrap_or_default();
        Explanation {
            profile: profile.name().into(),
            code: text(&self.number),
            title: joined(&[&self.info, &self.name]),
            class: joined(&[&class, &self.group]),
            cause: self.cause.clone(),
            reaction: self.reaction.clone(),
            // The Lenze catalogue gives the acknowledgement as the remedy.
            acknowledge: if self.ack.is_empty() { self.remedy.clone() } else { self.ack.clone() },
            remedy: self.remedy.clone(),
            source: joined(&[&self.at, &self.note]),
            ..Explanation::default()
        }
    }
}

/// A value without the quotes of its text form.
fn text(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

/// The parts that say something, with a semicolon between them.
fn joined(parts: &[&str]) -> String {
    let parts: Vec<_> = parts.iter().copied().filter(|part| !part.is_empty()).collect();
    parts.join("; ")
}

fn read(text: &str) -> Vec<Code> {
    let codes: Codes =
        toml::from_str(text).expect("the catalogues are part of the build and checked by its tests");
    codes.code
}

static LENZE: LazyLock<Vec<Code>> = LazyLock::new(|| read(catalogue::LENZE));
static ATV: LazyLock<Vec<Code>> = LazyLock::new(|| read(catalogue::ATV));
static ETG: LazyLock<Vec<Code>> = LazyLock::new(|| read(catalogue::ETG));

/// Everything the catalogues know about a code; empty when none knows it. A number that two
/// profiles use is explained twice.
pub fn explain(code: &str) -> Vec<Explanation> {
    let code = code.trim();
    let number = code
        .strip_prefix("0x")
        .map_or_else(|| code.parse().ok(), |digits| i64::from_str_radix(digits, 16).ok());
    let mut found = amk::explain(code);
    let rows = LENZE.iter().filter(|row| row.number.as_integer() == number && number.is_some());
    found.extend(rows.map(|row| row.explanation(Profile::LenzeSm301)));
    for (profile, rows) in [(Profile::Atv340, &ATV), (Profile::Etg61002, &ETG)] {
        let rows = rows
            .iter()
            .filter(|row| row.number.as_str().is_some_and(|known| known.eq_ignore_ascii_case(code)));
        found.extend(rows.map(|row| row.explanation(profile)));
    }
    found
}

/// The codes that were probably meant by one that nobody knows, at most three.
pub fn nearest(code: &str) -> Vec<String> {
    let code = code.trim().to_ascii_uppercase();
    let known = definition::PROFILES.into_iter().flat_map(|profile| all(profile).into_iter());
    let mut ranked: Vec<(usize, String)> =
        known.map(|known| (distance(&code, &known.code), known.code)).collect();
    ranked.sort();
    ranked.dedup();
    ranked.into_iter().take(3).map(|(_, code)| code).collect()
}

/// Edits from one code to the other; of AMK codes only the fields that both have count.
fn distance(code: &str, known: &str) -> usize {
    let fields = known.split('/').count();
    let own: Vec<_> = code.split('/').take(fields).collect();
    crate::text::distance(&own.join("/"), known)
}

/// Every code of a profile, explained without its fields.
pub fn all(profile: Profile) -> Vec<Explanation> {
    let rows = match profile {
        Profile::None => return Vec::new(),
        Profile::AmkKw => return amk::all(),
        Profile::LenzeSm301 => &LENZE,
        Profile::Atv340 => &ATV,
        Profile::Etg61002 => &ETG,
    };
    rows.iter().map(|row| row.explanation(profile)).collect()
}

#[cfg(test)]
mod tests;
