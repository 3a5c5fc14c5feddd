//! Commands that look and judge: they write nothing.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

use params::{
    AxisSet, Report, dictionary, response,
    rule::Severity,
    view::{self, Row},
};
use serde_json::json;

use super::{Failure, Outcome, machine, print, read};

/// Options of `check`.
#[derive(Debug, clap::Args)]
pub struct Check {
    /// Parameter file.
    file: PathBuf,
}

/// Options of `show` and `dictionary`.
#[derive(Debug, clap::Args)]
pub struct Show {
    /// Parameter file.
    file: PathBuf,
    /// Only what the file names, not the defaults.
    #[arg(long)]
    named: bool,
}

/// Options of `explain`.
#[derive(Debug, clap::Args)]
pub struct Explain {
    /// Name of a parameter, as files write it.
    name: String,
}

/// Options of `diff`.
#[derive(Debug, clap::Args)]
pub struct Diff {
    /// First file, or a safety image.
    left: PathBuf,
    /// Second file, or a safety image.
    right: PathBuf,
}

/// Options of `response`.
#[derive(Debug, clap::Args)]
pub struct Response {
    /// Parameter file.
    file: PathBuf,
    #[command(flatten)]
    around: Around,
}

/// What only the machine's builder knows.
#[derive(Debug, clap::Args)]
pub struct Around {
    /// Response of the sensor, ms.
    #[arg(long, default_value_t = 0.0)]
    sensor: f64,
    /// Processing of the safety controller, ms.
    #[arg(long, default_value_t = 0.0)]
    controller: f64,
    /// Cycle of the safety bus with its transmission, ms.
    #[arg(long, default_value_t = 0.0)]
    bus: f64,
    /// Watchdog of the safety bus, ms.
    #[arg(long, default_value_t = 0.0)]
    watchdog: f64,
    /// Highest frequency at which a stop may begin, Hz (ATV).
    #[arg(long, default_value_t = 0.0)]
    start_hz: f64,
}

impl Around {
    /// In the unit of the calculation.
    pub fn surroundings(&self) -> response::Surroundings {
        let us = |ms: f64| (ms.max(0.0) * 1_000.0).round() as u64;
        response::Surroundings {
            sensor: us(self.sensor),
            controller: us(self.controller),
            bus: us(self.bus),
            watchdog: us(self.watchdog),
            start_mhz: us(self.start_hz),
        }
    }
}

pub fn check(args: &Check, json: bool) -> Outcome {
    let report = params::check(&read(&args.file)?, &args.file.display().to_string());
    if json {
        println!("{}", serde_json::to_string(&report).unwrap_or_default());
    } else {
        report.findings.iter().for_each(|finding| print!("{}", finding_text(finding)));
    }
    if !report.diagnostics.is_empty() {
        return Err(report.diagnostics.into());
    }
    if !json {
        print!("{}", summary(&report));
    }
    if report.passed() { Ok(()) } else { Err(Failure::Short) }
}

fn finding_text(finding: &params::Finding) -> String {
    let kind = if finding.severity == Severity::Error { "error" } else { "warning" };
    let place = match finding.position.line {
        0 => finding.file.clone(),
        line => format!("{}:{line}:{}", finding.file, finding.position.column),
    };
    let code = if finding.code.is_empty() { String::new() } else { format!(" {}", finding.code) };
    let values: Vec<_> =
        finding.params.iter().map(|named| format!("{} = {}", named.name, named.value)).collect();
    format!(
        "{place}: {kind} {}{code} (axis {}): {}\n    {}\n    remedy: {}\n",
        finding.rule,
        finding.axis,
        finding.message,
        values.join(", "),
        finding.remedy
    )
}

fn summary(report: &Report) -> String {
    let errors = report.findings.iter().filter(|finding| finding.severity == Severity::Error).count();
    let warnings = report.findings.len() - errors;
    let many =
        |count: usize, one: &str, more: &str| format!("{count} {}", if count == 1 { one } else { more });
    format!(
        "{}: {}, {}, {}\n",
        report.file,
        many(report.axes, "axis", "axes"),
        many(errors, "error", "errors"),
        many(warnings, "warning", "warnings")
    )
}

fn rows(args: &Show, axis: &AxisSet) -> Vec<Row> {
    view::show(axis).into_iter().filter(|row| row.named || !args.named).collect()
}

pub fn show(args: &Show, json: bool) -> Outcome {
    let machine = machine(&args.file)?;
    let axes: Vec<_> = machine.axes.iter().map(|axis| json!({ "axis": axis.number, "profile": axis.profile.name(), "serial": axis.serial, "signatures": axis.signatures(), "values": rows(args, axis) })).collect();
    print(json, &axes, || machine.axes.iter().map(|axis| axis_text(args, axis)).collect());
    Ok(())
}

fn axis_text(args: &Show, axis: &AxisSet) -> String {
    let signatures = axis.signatures();
    let mut text = format!(
        "axis {}, {}, serial {}\ntemplate {:08X}, content {:08X}, device {:08X}\n",
        axis.number,
        axis.profile.name(),
        axis.serial,
        signatures.template,
        signatures.content,
        signatures.device
    );
    for row in rows(args, axis) {
        let mark = if row.named { ' ' } else { '*' };
        let meaning = if row.meaning.is_empty() { String::new() } else { format!("  {}", row.meaning) };
        let _ =
            writeln!(text, "{mark} {:<44} {:>14} {:<12} {}{meaning}", row.key, row.value, row.unit, row.name);
    }
    text.push_str("* default\n");
    text
}

pub fn explain(args: &Explain, json: bool) -> Outcome {
    let found = view::parameter(&args.name);
    if found.is_empty() {
        return Err(Failure::line(format!(
            "unknown parameter {}{}; expected a name such as Prm67, C15320, SC57 or SLS_1.velocity_limit",
            args.name,
            view::nearest(&args.name).map_or(String::new(), |near| format!(", the nearest is {near}"))
        )));
    }
    print(json, &found, || found.iter().map(parameter_text).collect());
    Ok(())
}

fn parameter_text(parameter: &view::Parameter) -> String {
    let definition = &parameter.definition;
    let mut text = format!(
        "{} ({}): {}\n  {}\n  range: {}\n  default: {}\n  function: {}\n",
        definition.key,
        parameter.profile,
        definition.name,
        definition.text,
        parameter.range,
        parameter.written_default,
        definition.function
    );
    for choice in &definition.choices {
        let _ = writeln!(text, "    {} {} {}", choice.raw, choice.word, choice.text);
    }
    let _ = writeln!(text, "  source: {}", definition.source);
    text
}

/// A machine out of a file that a person edits, or out of an image.
struct Either {
    machine: params::Machine,
    image: bool,
}

fn either(path: &Path) -> Result<Either, Failure> {
    let octets = std::fs::read(path)
        .map_err(|error| Failure::line(format!("{}: {error}; expected a readable file", path.display())))?;
    match image(path, &octets) {
        Some(axis) => Ok(Either {
            machine: params::Machine { file: path.display().to_string(), axes: vec![axis?] },
            image: true,
        }),
        None => Ok(Either { machine: machine(path)?, image: false }),
    }
}

/// The set of an image; `None`: the octets are no image at all.
fn image(path: &Path, octets: &[u8]) -> Option<Result<AxisSet, Failure>> {
    let text = std::str::from_utf8(octets).is_ok_and(|text| !text.contains('\0'));
    if text {
        return None;
    }
    let read = params::Image::read(octets).map_err(|error| error.to_string());
    let set = read.and_then(|image| {
        let profile = image.profile().ok_or("of no profile that is known")?;
        let named = std::collections::BTreeMap::new();
        Ok(AxisSet { number: image.axis, profile, serial: image.serial, values: image.values, named })
    });
    Some(set.map_err(|error| Failure::line(format!("{}: {error}; expected a safety image", path.display()))))
}

pub fn diff(args: &Diff, json: bool) -> Outcome {
    let (mut left, mut right) = (either(&args.left)?, either(&args.right)?);
    // An image holds one axis: only that one is compared.
    let only = [&left, &right]
        .into_iter()
        .find(|side| side.image)
        .and_then(|side| Some(side.machine.axes.first()?.number));
    if let Some(only) = only {
        [&mut left, &mut right]
            .into_iter()
            .for_each(|side| side.machine.axes.retain(|axis| axis.number == only));
    }
    let (left, right) = (left.machine, right.machine);
    let mut differences = Vec::new();
    for axis in &left.axes {
        match right.axes.iter().find(|other| other.number == axis.number) {
            Some(other) if other.profile == axis.profile => {
                let own = view::diff(axis, other).into_iter();
                differences.extend(own.map(|difference| (axis.number, difference)));
            }
            _ => return Err(unlike(args, axis.number)),
        }
    }
    if let Some(axis) =
        right.axes.iter().find(|axis| left.axes.iter().all(|other| other.number != axis.number))
    {
        return Err(unlike(args, axis.number));
    }
    print(json, &differences, || {
        differences.iter().map(|(axis, difference)| format!("axis {axis}: {difference}\n")).collect()
    });
    if differences.is_empty() { Ok(()) } else { Err(Failure::Short) }
}

fn unlike(args: &Diff, axis: u8) -> Failure {
    Failure::line(format!(
        "axis {axis} is not in both {} and {} with one profile; expected sets of the same axes",
        args.left.display(),
        args.right.display()
    ))
}

pub fn dictionary(args: &Show, json: bool) -> Outcome {
    let machine = machine(&args.file)?;
    let axis = machine.axes.iter().find(|axis| axis.profile == shm_schema::profile::Profile::Etg61002);
    let axis = axis.ok_or_else(|| {
        Failure::line(format!("{}: no axis has profile etg-6100-2; expected one", args.file.display()))
    })?;
    let objects = dictionary::dictionary(axis);
    print(json, &objects, || objects.iter().map(object_text).collect());
    Ok(())
}

fn object_text(object: &dictionary::Object) -> String {
    let mut text = format!(
        "{} {} {} {} {}\n",
        object.row, object.name, object.object_code, object.data_type, object.condition
    );
    for entry in &object.entries {
        let _ = writeln!(text, "    :{} = {}", entry.sub_index, entry.value);
    }
    text
}

pub fn response(args: &Response, json: bool) -> Outcome {
    let machine = machine(&args.file)?;
    let around = args.around.surroundings();
    let chains: Vec<_> = machine
        .axes
        .iter()
        .flat_map(|axis| response::chains(axis, &around).into_iter().map(|chain| (axis.number, chain)))
        .collect();
    print(json, &chains, || chains.iter().map(|(axis, chain)| format!("axis {axis}: {chain}\n")).collect());
    Ok(())
}
