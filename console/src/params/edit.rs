//! Commands that write texts: new files, lists, reports.

use std::path::{Path, PathBuf};

use params::{create, definition, vendor};
use shm_schema::profile::Profile;

use super::{Failure, Outcome, machine, print, read, write};

/// Options of `new`.
#[derive(Debug, clap::Args)]
pub struct New {
    /// Profile: amk-kw, lenze-sm301, atv340, etg-6100-2.
    #[arg(value_parser = profile)]
    profile: Profile,
    /// Serial number to write into it; sealing takes the installation's.
    #[arg(long, default_value = "UNKNOWN")]
    serial: String,
    /// File to create; standard output without it.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Options of `export`.
#[derive(Debug, clap::Args)]
pub struct Export {
    /// Parameter file.
    file: PathBuf,
    /// Axis.
    #[arg(long, default_value_t = 1)]
    axis: u8,
    /// File to create; standard output without it.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Options of `import`.
#[derive(Debug, clap::Args)]
pub struct Import {
    /// Plain list, one `Name = value` a line.
    list: PathBuf,
    /// Profile of the list.
    #[arg(long, value_parser = profile)]
    profile: Profile,
    /// Serial number to write into the file.
    #[arg(long, default_value = "UNKNOWN")]
    serial: String,
    /// File to create; standard output without it.
    #[arg(long)]
    out: Option<PathBuf>,
}

fn profile(name: &str) -> Result<Profile, String> {
    let names = definition::PROFILES.map(Profile::name);
    definition::profile_by_name(name).ok_or_else(|| format!("expected one of {}", names.join(", ")))
}

pub fn new(args: &New, json: bool) -> Outcome {
    wrote(args.out.as_deref(), &create::new_file(args.profile, &args.serial), json)
}

/// Writes a text; as JSON with the file it went to.
fn wrote(out: Option<&Path>, text: &str, json: bool) -> Outcome {
    if !json {
        write(out, text)?;
        if let Some(out) = out {
            eprintln!("{}: written", out.display());
        }
        return Ok(());
    }
    if out.is_some() {
        write(out, text)?;
    }
    let file = out.map(|out| out.display().to_string());
    print(true, &serde_json::json!({ "file": file, "text": text }), String::new);
    Ok(())
}

pub fn export(args: &Export, json: bool) -> Outcome {
    let machine = machine(&args.file)?;
    let axis = machine.axes.iter().find(|axis| axis.number == args.axis);
    let axis = axis.ok_or_else(|| {
        Failure::line(format!("{}: no axis {}; expected one of its axes", args.file.display(), args.axis))
    })?;
    wrote(args.out.as_deref(), &vendor::export(axis), json)
}

pub fn import(args: &Import, json: bool) -> Outcome {
    let text =
        vendor::import(&read(&args.list)?, &args.list.display().to_string(), args.profile, &args.serial)?;
    wrote(args.out.as_deref(), &text, json)
}
