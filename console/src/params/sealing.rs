//! Commands around sealed sets: password, load, seal, verify, clone.

use std::{
    fs::File,
    io,
    path::{Path, PathBuf},
};

use crosscheck::logbook::{Book, Entry, Size};
use params::seal::{self, Installation, Prepared, SealError, replacement};
use serde_json::json;

use super::{Failure, Outcome, print, prompt, read, running, start, write};
use crate::run::RunFolder;

/// Where a set and its installation are.
#[derive(Debug, clap::Args)]
struct Place {
    /// File of the installation: serial numbers and password.
    #[arg(long, default_value = "installation.toml")]
    installation: PathBuf,
    /// Folder of the sealed sets.
    #[arg(long, default_value = "sealed")]
    folder: PathBuf,
    /// Run folder of the machine. While a set runs in it, every axis has to be in STO.
    #[arg(long)]
    run_dir: Option<PathBuf>,
    /// Logbook of the machine: what is loaded or sealed is recorded there.
    #[arg(long)]
    logbook: Option<PathBuf>,
}

impl Place {
    /// Every intervention stands in the logbook. Only with the lock in hand: nobody else writes.
    /// The logbook of a running set is that set's; its next start records the signatures.
    fn record(&self, held: &Held, text: &str) -> Outcome {
        let Some(path) = &self.logbook else { return Ok(()) };
        if matches!(held, Held::RunningInSto) {
            eprintln!("{}: belongs to the running set; not recorded: {text}", path.display());
            return Ok(());
        }
        let mut book = Book::open(path, Size::default()).map_err(|error| logbook(path, &error))?;
        book.append(&Entry::Intervention(text.into())).map_err(|error| logbook(path, &error))
    }

    /// Loading only in STO (AMK-PMT-11, AMK-PMT-12, AMKD-P1-02). A stopped set is in STO, and the
    /// lock keeps a start waiting. A running one has to be in STO with every axis; it goes on with
    /// its own copies of the set it started with, so that it cannot be changed under torque.
    fn in_sto(&self) -> Result<Held, Failure> {
        let folder = RunFolder::new(self.run_dir.clone());
        let lock = folder.images().with_file_name("lock");
        let file = match File::open(&lock) {
            // Nothing ever ran there.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Held::Nothing),
            other => other.map_err(|error| {
                Failure::line(format!("{}: {error}; expected the lock of the run folder", lock.display()))
            })?,
        };
        if file.try_lock().is_ok() {
            return Ok(Held::Stopped(file));
        }
        if let Err(line) = running::in_sto(&folder) {
            eprintln!(
                "{}: the set running in {} is not in STO ({line}); request STO or stop it first: a set is transferred in STO only",
                running::REFUSED,
                lock.with_file_name("").display()
            );
            return Err(Failure::Short);
        }
        Ok(Held::RunningInSto)
    }
}

/// What was found where a set may run.
enum Held {
    /// Nothing ever ran there.
    Nothing,
    /// A stopped set, whose start waits for this lock.
    Stopped(#[allow(dead_code, reason = "held, not read")] File),
    /// A running set, every axis of it in STO.
    RunningInSto,
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
    /// Verify this image instead, as a third party could: against a file and a serial number.
    #[arg(long, requires_all = ["against", "serial"])]
    image: Option<PathBuf>,
    /// File that the image should hold.
    #[arg(long)]
    against: Option<PathBuf>,
    /// Serial number of the device that it should be sealed to.
    #[arg(long)]
    serial: Option<String>,
}

/// An image against a file and a device.
fn verify_image(path: &Path, file: &Path, serial: &str, json: bool) -> Outcome {
    let octets = std::fs::read(path)
        .map_err(|error| Failure::line(format!("{}: {error}; expected a safety image", path.display())))?;
    let machine = super::machine(file)?;
    let items = seal::verify_image(&octets, &machine, serial);
    report_items(&items, json!({ "items": &items }), "", json)
}

fn report_items(items: &[seal::Item], value: serde_json::Value, last: &str, json: bool) -> Outcome {
    let line = |item: &seal::Item| {
        let code = if item.code.is_empty() { String::new() } else { format!(" ({})", item.code) };
        format!("{} {}: {}{code}\n", if item.right { "right" } else { "WRONG" }, item.what, item.found)
    };
    print(json, &value, || items.iter().map(line).chain([last.to_string()]).collect());
    if items.iter().all(|item| item.right) { Ok(()) } else { Err(Failure::Short) }
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

fn logbook(path: &Path, error: &io::Error) -> Failure {
    Failure::line(format!("{}: {error}; expected a logbook that can be written", path.display()))
}

fn installation(path: &Path) -> Result<Installation, Failure> {
    Installation::read(path).map_err(|error| {
        Failure::line(format!("{}: {error}; expected the file of an installation, as `safepair params password --serial SERIAL` makes it", path.display()))
    })
}

/// A secret from the first line of a file, or asked for.
fn secret(file: Option<&PathBuf>, question: &str) -> Result<String, Failure> {
    match file {
        Some(path) => Ok(read(path)?.lines().next().unwrap_or_default().into()),
        None => prompt::secret(question).map_err(Failure::line),
    }
}

/// A new secret; on a terminal, where nobody sees what is typed, it is repeated (AMK-PMT-15).
fn new_secret(file: Option<&PathBuf>) -> Result<String, Failure> {
    let new = secret(file, "new password")?;
    let seen = file.is_some() || !prompt::is_terminal();
    if seen || secret(None, "new password again")? == new {
        return Ok(new);
    }
    Err(Failure::line("the new password and its repetition differ; expected the same twice"))
}

pub fn password(args: &Password, json: bool) -> Outcome {
    let mut installation = match &args.serial {
        Some(serial) if !args.installation.exists() => Installation::new(serial),
        _ => installation(&args.installation)?,
    };
    let old = if installation.has_password() {
        secret(args.old_password_file.as_ref(), "old password")?
    } else {
        String::new()
    };
    let new = new_secret(args.new_password_file.as_ref())?;
    installation.set_password(&old, &new).map_err(failure)?;
    installation.write(&args.installation).map_err(failure)?;
    let file = args.installation.display().to_string();
    print(json, &json!({ "file": file, "password": "set" }), || format!("{file}: password set\n"));
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
    let held = args.place.in_sto()?;
    seal::load(&prepared, &args.place.folder).map_err(failure)?;
    args.place.record(
        &held,
        &format!(
            "set loaded, not validated: content {}, device {}",
            prepared.content_signature(),
            prepared.device_signature()
        ),
    )?;
    print(json, &transferred(&prepared, args.place.folder.as_path()), || {
        format!("{}\ncontent signature {}\n", seal::State::Loaded.text(), prepared.content_signature())
    });
    Ok(())
}

pub fn seal(args: &Seal, json: bool) -> Outcome {
    let (prepared, installation) = prepared(&args.file, &args.place)?;
    let held = args.place.in_sto()?;
    let password = secret(args.password_file.as_ref(), "password")?;
    let typed = match &args.signature {
        Some(typed) => typed.clone(),
        None => {
            eprintln!(
                "content signature {}: compare it with the values you checked",
                prepared.content_signature()
            );
            prompt::line("type it back").map_err(Failure::line)?
        }
    };
    let sealed = seal::seal(&prepared, &installation, &password, &typed, &args.place.folder);
    if let Err(error) = sealed {
        // Best effort: the refusal itself is what the caller has to hear.
        let _ = args.place.record(&held, &format!("sealing refused: {error}"));
        return Err(failure(error));
    }
    args.place.record(
        &held,
        &format!(
            "set sealed: content {}, device {}",
            prepared.content_signature(),
            prepared.device_signature()
        ),
    )?;
    if let Err(places) = start::finds(&args.place.folder, &args.place.installation) {
        let used = args.place.installation.display();
        eprintln!("note: a start looks for the installation in {places}; put {used} there before");
    }
    print(json, &transferred(&prepared, &args.place.folder), || {
        format!(
            "{}\ncontent signature {}, device signature {}\n{}start it with: safepair run --sealed {}\n",
            seal::State::Sealed.text(),
            prepared.content_signature(),
            prepared.device_signature(),
            sra_crcs(&prepared),
            args.place.folder.display()
        )
    });
    Ok(())
}

/// For the one who configures an FSoE master.
fn sra_crcs(prepared: &Prepared) -> String {
    let line = |set: &params::AxisSet| format!("axis {}: SRA CRC {:08X}\n", set.number, set.sra_crc());
    prepared.machine.axes.iter().map(line).collect()
}

/// A transfer as JSON, with the vendor's message of success (AMKD-XFR-03).
fn transferred(prepared: &Prepared, folder: &Path) -> serde_json::Value {
    let state = seal::state(folder);
    let codes: &[&str] = if state == seal::State::Sealed { &["3609/9/0/61", "3609/9/0/62"] } else { &[] };
    json!({
        "state": state,
        "text": state.text(),
        "codes": codes,
        "content_signature": prepared.content_signature(),
        "device_signature": prepared.device_signature(),
        "axes": prepared.signatures.iter().map(|(axis, signatures)| {
            let set = prepared.machine.axes.iter().find(|set| set.number == *axis);
            json!({
                "axis": axis, "signatures": signatures,
                "serial": set.map(|set| &set.serial),
                "sra_crc": set.map(|set| format!("{:08X}", set.sra_crc())),
            })
        }).collect::<Vec<_>>(),
    })
}

pub fn verify(args: &Verify, json: bool) -> Outcome {
    if let (Some(image), Some(file), Some(serial)) = (&args.image, &args.against, &args.serial) {
        return verify_image(image, file, serial, json);
    }
    let installation = installation(&args.place.installation)?;
    if seal::state(&args.place.folder) == seal::State::Empty {
        return Err(Failure::line(format!(
            "{}: 3609/128/6/55: no set is there; expected one that params seal wrote",
            args.place.folder.display()
        )));
    }
    let items = seal::verify(&args.place.folder, &installation).map_err(failure)?;
    let state = seal::state(&args.place.folder);
    let interrupted = seal::is_interrupted(&args.place.folder);
    let value = json!({ "state": state, "text": state.text(), "interrupted": interrupted, "items": &items });
    let note =
        if interrupted { "3609/6/0/57: a later transfer did not end; transfer it again\n" } else { "" };
    report_items(&items, value, &format!("{}\n{note}", state.text()), json)
}

/// The file of the sealed set, and what the documents ask for with another device.
pub fn clone(args: &Clone, json: bool) -> Outcome {
    let text = seal::source(&args.folder).map_err(|error| {
        Failure::line(format!("{}: {error}; expected a sealed set", args.folder.display()))
    })?;
    let machine = params::parse(&text, "set.toml")?;
    let mut profiles: Vec<_> = machine.axes.iter().map(|axis| axis.profile).collect();
    profiles.sort_by_key(|profile| *profile as u8);
    profiles.dedup();
    if json {
        let steps: Vec<_> = profiles
            .iter()
            .map(|profile| json!({ "profile": profile.name(), "steps": replacement::steps(*profile) }))
            .collect();
        println!("{}", json!({ "set": text, "replacement": steps }));
        return args.out.as_deref().map_or(Ok(()), |out| write(Some(out), &text));
    }
    write(args.out.as_deref(), &text)?;
    for profile in profiles {
        eprintln!("Another device, {}:", profile.name());
        for (at, step) in (1..).zip(replacement::steps(profile)) {
            eprintln!("  {at}. {} ({})", step.text, step.source);
        }
    }
    Ok(())
}
