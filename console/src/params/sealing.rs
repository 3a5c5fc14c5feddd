//! Commands around sealed sets: password, load, seal, verify, clone.

use std::{
    io::{self, BufRead as _, Write as _},
    path::{Path, PathBuf},
};

use params::seal::{self, Installation, Prepared, SealError};

use super::{Failure, Outcome, print, read, write};

/// Where a set and its installation are.
#[derive(Debug, clap::Args)]
struct Place {
    /// File of the installation: serial numbers and password.
    #[arg(long, default_value = "installation.toml")]
    installation: PathBuf,
    /// Folder of the sealed sets.
    #[arg(long, default_value = "sealed")]
    folder: PathBuf,
}

/// Options of `password`.
#[derive(Debug, clap::Args)]
pub struct Password {
    /// File of the installation; created if it does not exist.
    #[arg(long, default_value = "installation.toml")]
    installation: PathBuf,
    /// Serial number of a new installation.
    #[arg(long)]
    serial: Option<String>,
    /// File with the old password in its first line; asked for without it.
    #[arg(long)]
    old_password_file: Option<PathBuf>,
    /// File with the new password in its first line; asked for without it.
    #[arg(long)]
    new_password_file: Option<PathBuf>,
}

/// Options of `load`.
#[derive(Debug, clap::Args)]
pub struct Load {
    /// Parameter file.
    file: PathBuf,
    #[command(flatten)]
    place: Place,
}

/// Options of `seal`.
#[derive(Debug, clap::Args)]
pub struct Seal {
    /// Parameter file.
    file: PathBuf,
    #[command(flatten)]
    place: Place,
    /// File with the password in its first line; asked for without it.
    #[arg(long)]
    password_file: Option<PathBuf>,
    /// The content signature, typed back; asked for without it.
    #[arg(long)]
    signature: Option<String>,
}

/// Options of `verify`.
#[derive(Debug, clap::Args)]
pub struct Verify {
    #[command(flatten)]
    place: Place,
}

/// Options of `clone`.
#[derive(Debug, clap::Args)]
pub struct Clone {
    /// Folder of the sealed sets.
    #[arg(long, default_value = "sealed")]
    folder: PathBuf,
    /// File to create; standard output without it.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Everything that a sealing command may refuse, as lines of text.
fn failure(error: SealError) -> Failure {
    match error {
        SealError::File(diagnostics) => diagnostics.into(),
        SealError::Rules(findings) => {
            for finding in &findings {
                eprintln!(
                    "{}:{}: {} {}: {}",
                    finding.file, finding.position.line, finding.rule, finding.code, finding.message
                );
            }
            Failure::Short
        }
        other => Failure::line(other),
    }
}

fn installation(path: &Path) -> Result<Installation, Failure> {
    Installation::read(path).map_err(|error| {
        Failure::line(format!("{}: {error}; expected the file of an installation", path.display()))
    })
}

/// A secret from the first line of a file, or asked for.
fn secret(file: Option<&PathBuf>, question: &str) -> Result<String, Failure> {
    match file {
        Some(path) => Ok(read(path)?.lines().next().unwrap_or_default().into()),
        None => asked(question),
    }
}

fn asked(question: &str) -> Result<String, Failure> {
    eprint!("{question}: ");
    let mut line = String::new();
    let read = io::stderr().flush().and_then(|()| io::stdin().lock().read_line(&mut line));
    read.map_err(|error| Failure::line(format!("standard input: {error}; expected an answer")))?;
    Ok(line.trim_end_matches(['\r', '\n']).into())
}

pub fn password(args: &Password) -> Outcome {
    let mut installation = match &args.serial {
        Some(serial) if !args.installation.exists() => Installation::new(serial),
        _ => installation(&args.installation)?,
    };
    let old = if installation.has_password() {
        secret(args.old_password_file.as_ref(), "old password")?
    } else {
        String::new()
    };
    let new = secret(args.new_password_file.as_ref(), "new password")?;
    installation.set_password(&old, &new).map_err(failure)?;
    installation.write(&args.installation).map_err(failure)?;
    println!("{}: password set", args.installation.display());
    Ok(())
}

fn prepared(file: &Path, place: &Place) -> Result<(Prepared, Installation), Failure> {
    let installation = installation(&place.installation)?;
    let prepared =
        seal::prepare(&read(file)?, &file.display().to_string(), &installation).map_err(failure)?;
    Ok((prepared, installation))
}

pub fn load(args: &Load, json: bool) -> Outcome {
    let (prepared, _) = prepared(&args.file, &args.place)?;
    seal::load(&prepared, &args.place.folder).map_err(failure)?;
    print(json, &prepared, || {
        format!(
            "loaded, not validated: dies with the next restart\ncontent signature {}\n",
            prepared.content_signature()
        )
    });
    Ok(())
}

pub fn seal(args: &Seal, json: bool) -> Outcome {
    let (prepared, installation) = prepared(&args.file, &args.place)?;
    let password = secret(args.password_file.as_ref(), "password")?;
    let typed = match &args.signature {
        Some(typed) => typed.clone(),
        None => {
            eprintln!(
                "content signature {}: compare it with the values you checked",
                prepared.content_signature()
            );
            asked("type it back")?
        }
    };
    seal::seal(&prepared, &installation, &password, &typed, &args.place.folder).map_err(failure)?;
    print(json, &prepared, || {
        format!(
            "sealed: content signature {}, device signature {}\n",
            prepared.content_signature(),
            prepared.device_signature()
        )
    });
    Ok(())
}

pub fn verify(args: &Verify, json: bool) -> Outcome {
    let installation = installation(&args.place.installation)?;
    let items = seal::verify(&args.place.folder, &installation).map_err(failure)?;
    let line = |item: &seal::Item| {
        format!("{} {}: {}\n", if item.right { "right" } else { "WRONG" }, item.what, item.found)
    };
    print(json, &items, || items.iter().map(line).collect());
    if items.iter().all(|item| item.right) { Ok(()) } else { Err(Failure::Short) }
}

pub fn clone(args: &Clone) -> Outcome {
    let text = seal::source(&args.folder).map_err(|error| {
        Failure::line(format!("{}: {error}; expected a sealed set", args.folder.display()))
    })?;
    write(args.out.as_deref(), &text)
}
