//! Every parameter of the four profiles, as the fact tables give it (design 3.8).

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};
use shm_schema::{catalogue, profile::Profile};

/// How a file writes a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A whole number.
    Integer,
    /// A number with at most one decimal place; the raw value is in tenths.
    Decimal,
    /// A number out of [`Definition::choices`].
    Choice,
    /// A word out of [`Definition::choices`].
    Word,
    /// A field of 32 bits.
    Bits,
    /// A function instance by name.
    Reference,
}

/// One value of an enumeration.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Choice {
    /// Raw value in the safety image.
    pub raw: i64,
    /// The vendor's word for it.
    pub word: String,
    /// What it does.
    #[serde(default)]
    pub text: String,
}

/// One parameter. Limits and default are raw values of the safety image.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Definition {
    /// Name as files spell it; in the generic profile without the instance.
    pub key: String,
    /// Key in the image ([`shm_schema::profile`]); in the generic profile with instance 0.
    pub number: u32,
    /// The vendor's name.
    pub name: String,
    /// Unit of the value as files write it; empty for pure numbers.
    #[serde(default)]
    pub unit: String,
    /// How files write it.
    pub kind: Kind,
    /// Smallest value.
    pub min: i64,
    /// Largest value.
    pub max: i64,
    /// Distance of two neighbouring values.
    pub step: i64,
    /// Value when a file leaves it out (DEC-28).
    pub default: i64,
    /// Function it belongs to.
    #[serde(default)]
    pub function: String,
    /// What it means.
    pub text: String,
    /// Where the catalogue has it from.
    #[serde(default)]
    pub source: String,
    /// Values with a meaning of their own.
    #[serde(default)]
    pub choices: Vec<Choice>,
    /// The parameter it always equals; such a parameter is not in the image.
    #[serde(default)]
    pub fixed_to: Option<String>,
    /// Counts only when a file names it; absent from the image otherwise.
    #[serde(default)]
    pub optional: bool,
    /// ETG: M, O or C as the profile's tables give it.
    #[serde(default)]
    pub condition: String,
    /// ETG: suffixes of width that the object has.
    #[serde(default)]
    pub widths: Vec<String>,
}

#[derive(Deserialize)]
struct Table {
    parameter: Vec<Definition>,
}

impl Definition {
    /// A raw value as a file writes it.
    pub fn written(&self, raw: i64) -> String {
        let word = self.choices.iter().find(|choice| choice.raw == raw);
        match (self.kind, word) {
            (Kind::Word | Kind::Integer | Kind::Decimal, Some(choice)) => format!("\"{}\"", choice.word),
            (Kind::Decimal, None) => {
                let sign = if raw < 0 { "-" } else { "" };
                format!("{sign}{}.{}", raw.abs() / 10, raw.abs() % 10)
            }
            (Kind::Bits, _) => format!("0x{:08X}", raw as u32),
            (Kind::Reference, _) => format!("\"{}\"", crate::key::reference_name(raw as i32)),
            _ => raw.to_string(),
        }
    }

    /// The limits as a person reads them.
    pub fn range(&self) -> String {
        match self.kind {
            Kind::Word => {
                let words: Vec<_> = self.choices.iter().map(|c| format!("\"{}\"", c.word)).collect();
                words.join(", ")
            }
            Kind::Choice if self.choices.len() as i64 != self.max - self.min + 1 => {
                let numbers: Vec<_> = self.choices.iter().map(|c| c.raw.to_string()).collect();
                numbers.join(", ")
            }
            Kind::Reference => "\"none\" or a function instance such as \"SS1_1\"".into(),
            _ => self.number_range(),
        }
    }

    fn number_range(&self) -> String {
        let words = self.choices.iter().filter(|_| matches!(self.kind, Kind::Integer | Kind::Decimal));
        let words = words.map(|c| format!(", or \"{}\"", c.word)).collect::<Vec<_>>().concat();
        // The words stand for 0, which is no number of the parameter's own range.
        let smallest = if words.is_empty() { self.min } else { self.min.max(1) };
        let bare = Self { choices: Vec::new(), ..self.clone() };
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        format!("{} to {}{unit}{words}", bare.written(smallest), bare.written(self.max))
    }
}

fn read(text: &str) -> Vec<Definition> {
    let mut table: Table =
        toml::from_str(text).expect("the fact tables are part of the build and checked by its tests");
    table.parameter.sort_by_key(|definition| definition.number);
    table.parameter
}

static AMK: LazyLock<Vec<Definition>> = LazyLock::new(|| read(catalogue::PARAMETERS_AMK_KW));
static LENZE: LazyLock<Vec<Definition>> = LazyLock::new(|| read(catalogue::PARAMETERS_LENZE_SM301));
static ATV: LazyLock<Vec<Definition>> = LazyLock::new(|| read(catalogue::PARAMETERS_ATV340));
static ETG: LazyLock<Vec<Definition>> = LazyLock::new(|| read(catalogue::PARAMETERS_ETG_6100_2));
static COMMON: LazyLock<Vec<Definition>> = LazyLock::new(|| read(catalogue::PARAMETERS_COMMON));

/// All parameters of a profile's own, ascending by number.
pub fn definitions(profile: Profile) -> &'static [Definition] {
    match profile {
        Profile::None => &[],
        Profile::AmkKw => &AMK,
        Profile::LenzeSm301 => &LENZE,
        Profile::Atv340 => &ATV,
        Profile::Etg61002 => &ETG,
    }
}

/// The parameters of `[common]` (DEC-50).
pub fn common() -> &'static [Definition] {
    &COMMON
}

/// The definition behind a key of the image.
pub fn by_number(profile: Profile, number: u32) -> Option<&'static Definition> {
    let own = match profile {
        Profile::Etg61002 if number < shm_schema::profile::common::CONTROL_WORD => number & 0xFFFF_00FF,
        _ => number,
    };
    let all = definitions(profile).iter().chain(common());
    all.into_iter().find(|definition| definition.number == own)
}

/// The definition behind a name, without instance and width.
pub fn by_name(profile: Profile, name: &str) -> Option<&'static Definition> {
    definitions(profile).iter().find(|definition| definition.key == name)
}

/// The profile of that name.
pub fn profile_by_name(name: &str) -> Option<Profile> {
    PROFILES.into_iter().find(|profile| profile.name() == name)
}

/// All profiles.
pub const PROFILES: [Profile; 4] = [Profile::AmkKw, Profile::LenzeSm301, Profile::Atv340, Profile::Etg61002];
