//! Names of the generic profile: functions, instances, objects (DEC-40, DEC-51).

use std::sync::LazyLock;

use serde::Deserialize;
use shm_schema::{catalogue, profile};

use crate::{definition, text::nearest};

/// Largest instance number (arrays of 254 entries).
pub const INSTANCE_MAX: u32 = 254;

/// Functions that exist once: their objects are no arrays.
const SINGLE: [&str; 4] = ["STO", "SMS", "SMA", "SDI"];

#[derive(Deserialize)]
struct Objects {
    function: Vec<Function>,
}

#[derive(Deserialize)]
struct Function {
    name: String,
    number: u32,
}

static FUNCTIONS: LazyLock<Vec<Function>> = LazyLock::new(|| {
    let objects: Objects = toml::from_str(catalogue::ETG_OBJECTS)
        .expect("the fact tables are part of the build and checked by its tests");
    objects.function
});

/// A key such as `SLS_1.velocity_limit_u16`, taken apart.
#[derive(Debug)]
pub struct EtgKey {
    /// Key in the image.
    pub number: u32,
    /// What the object is.
    pub definition: &'static definition::Definition,
    /// Bits of an explicit width: signed?, number of bits.
    pub width: Option<(bool, u32)>,
}

/// Takes a key apart, or says what was expected.
pub fn etg(key: &str) -> Result<EtgKey, String> {
    let (instance_name, object) = key.split_once('.').ok_or_else(|| suggestion(key))?;
    let (function, instance) = instance(instance_name)?;
    let function_name = function_name(function).unwrap_or_default();
    let (object, width) = split_width(object);
    let name = format!("{function_name}.{object}");
    let definition = definition::by_name(profile::Profile::Etg61002, &name).ok_or_else(|| suggestion(key))?;
    if let Some(width) = width
        && !definition.widths.iter().any(|known| known == width)
    {
        let widths = definition.widths.join(", ");
        return Err(format!(
            "one of the object's types: {}",
            if widths.is_empty() { "no suffix" } else { &widths }
        ));
    }
    Ok(EtgKey {
        number: definition.number | instance << 8,
        definition,
        width: width.and_then(|text| Some((text.starts_with('i'), text[1..].parse().ok()?))),
    })
}

/// Function number and instance of a name such as `SLS_2`; without suffix instance 1.
pub fn instance(name: &str) -> Result<(u32, u32), String> {
    let (function, instance) = match name.split_once('_') {
        None => (name, Some(1)),
        Some((function, digits)) => (function, digits.parse().ok()),
    };
    let known = FUNCTIONS.iter().find(|known| known.name == function);
    let known = known.ok_or_else(|| format!("a function: {}", function_names()))?;
    let last = if SINGLE.contains(&function) { 1 } else { INSTANCE_MAX };
    match instance {
        Some(instance @ 1..) if instance <= last => Ok((known.number, instance)),
        _ if last == 1 => Err(format!("{function}, which exists once")),
        _ => Err(format!("{function}_1 to {function}_{last}")),
    }
}

/// A reference value by name: `none`, `STO`, `SS1_1` …
pub fn reference(name: &str) -> Result<i64, String> {
    if name == "none" {
        return Ok(0);
    }
    instance(name).map(|(function, instance)| i64::from(profile::reference(function, instance)))
}

/// Name of a reference value.
pub fn reference_name(raw: i32) -> String {
    let (function, instance) = ((raw >> 8) as u32, raw & 0xFF);
    match function_name(function) {
        _ if raw == 0 => "none".into(),
        None => format!("0x{raw:04X}"),
        Some(name) if SINGLE.contains(&name) => name.into(),
        Some(name) => format!("{name}_{instance}"),
    }
}

/// Name of a function by its number.
pub fn function_name(number: u32) -> Option<&'static str> {
    FUNCTIONS.iter().find(|known| known.number == number).map(|known| known.name.as_str())
}

/// Name of a key of the image as files write it.
pub fn etg_name(number: u32) -> Option<String> {
    let definition = definition::by_number(profile::Profile::Etg61002, number)?;
    let (_, object) = definition.key.split_once('.')?;
    let instance = reference_name((number >> 8) as i32);
    Some(format!("{instance}.{object}"))
}

fn function_names() -> String {
    let names: Vec<_> = FUNCTIONS.iter().map(|known| known.name.as_str()).collect();
    names.join(", ")
}

/// Splits the width off an object's name: `velocity_limit_u16` has `u16`.
fn split_width(object: &str) -> (&str, Option<&str>) {
    match object.rsplit_once('_') {
        Some((name, width @ ("u8" | "u16" | "u32" | "i8" | "i16" | "i32"))) => (name, Some(width)),
        _ => (object, None),
    }
}

/// What was probably meant by an unknown key.
fn suggestion(key: &str) -> String {
    let (instance, object) = key.split_once('.').unwrap_or((key, ""));
    let function = instance.split('_').next().unwrap_or_default();
    let object = split_width(object).0;
    let keys =
        definition::definitions(profile::Profile::Etg61002).iter().map(|definition| definition.key.as_str());
    match nearest(&format!("{function}.{object}"), keys) {
        None => "a function instance and its object, such as SLS_1.velocity_limit".into(),
        Some(name) => {
            let (function, object) = name.split_once('.').unwrap_or((name, ""));
            let suffix = instance.split_once('_').map_or(String::new(), |(_, digits)| format!("_{digits}"));
            format!("{function}{suffix}.{object}?")
        }
    }
}
