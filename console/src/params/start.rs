//! The check at start: a sealed set is verified before anything runs with it (AMK-PMT-19,
//! AMKD-XFR-01). What is wrong carries the vendor's code 3609.

use std::path::{Path, PathBuf};

use params::seal::{self, Installation, SealError};

/// File of the installation: in the folder of the sealed sets, beside it, or here.
const INSTALLATION: &str = "installation.toml";
const SYSTEM: &str = "/etc/safepair/installation.toml";

/// Where a start looks for the installation of the sets in `folder`, in this order.
fn places(folder: &Path) -> [PathBuf; 3] {
    let beside = folder.parent().unwrap_or(Path::new(".")).join(INSTALLATION);
    [folder.join(INSTALLATION), beside, SYSTEM.into()]
}

/// Whether a start of the sets in `folder` finds this installation; where it looks, if not.
pub fn finds(folder: &Path, installation: &Path) -> Result<(), String> {
    let places = places(folder);
    let first = places.iter().find(|place| place.exists());
    let same = first.is_some_and(|first| first.canonicalize().ok() == installation.canonicalize().ok());
    let names = || places.map(|place| place.display().to_string()).join(", ");
    if same { Ok(()) } else { Err(names()) }
}

/// Verifies the set that `folder` holds against its installation.
///
/// # Errors
/// One line: what is wrong, with its code.
pub fn verified(folder: &Path) -> Result<(), String> {
    let at = |text: &dyn std::fmt::Display| format!("{}: {text}", folder.display());
    if seal::is_interrupted(folder) {
        eprintln!(
            "{}: 3609/6/0/55: a transfer did not end; the set before it stays in force",
            folder.display()
        );
    }
    let erased = seal::restart(folder).map_err(|error| at(&error))?;
    if erased {
        return Err(at(
            &"3609/128/6/55: the set was loaded but not validated, and is erased by this start (AMK-PMT-17); expected a sealed set: transfer and seal it again",
        ));
    }
    if seal::state(folder) == seal::State::Empty {
        return Err(at(&"3609/128/6/55: no set is there; expected a sealed set: safepair params seal"));
    }
    let [own, ..] = places(folder);
    let path = places(folder).into_iter().find(|place| place.exists()).unwrap_or(own);
    let installation = Installation::read(&path).map_err(|error| {
        at(&format!(
            "3609/128/9/55: {}: {error}; expected the installation that the set is sealed to, here, beside the folder, or as {SYSTEM}",
            path.display()
        ))
    })?;
    let items = seal::verify(folder, &installation).map_err(|error| at(&described(&error)))?;
    let wrong = items.iter().filter(|item| !item.right);
    let lines: Vec<_> = wrong.map(|item| format!("{}: {}: {}", item.code, item.what, item.found)).collect();
    if lines.is_empty() { Ok(()) } else { Err(at(&lines.join("; "))) }
}

fn described(error: &SealError) -> String {
    match error {
        SealError::NoSerial(_) => format!("3609/128/9/55: {error}"),
        _ => format!("3609/128/4/55: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{
        fs, process,
        sync::atomic::{AtomicU32, Ordering},
    };

    const SET: &str = "profile = \"amk-kw\"\n[parameters]\nPrm67 = 300\nPrm3 = 60\nPrm2 = 90\n";
    const PASSWORD: &str = "correct horse 1";

    struct Place(PathBuf);

    impl Drop for Place {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    impl Place {
        /// An installation, and beside it a folder with a sealed set.
        fn new() -> Self {
            static NEXT: AtomicU32 = AtomicU32::new(0);
            let name = format!("safepair-start-{}-{}", process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
            let place = Self(std::env::temp_dir().join(name));
            fs::create_dir_all(place.folder()).expect("a folder");
            let installation = place.installed("SIM-0001");
            let set = seal::prepare(SET, "set.toml", &installation).expect("right");
            seal::seal(&set, &installation, PASSWORD, &set.content_signature(), &place.folder())
                .expect("sealed");
            place
        }

        fn folder(&self) -> PathBuf {
            self.0.join("sealed")
        }

        fn installed(&self, serial: &str) -> Installation {
            let mut installation = Installation::new(serial);
            installation.set_password("", PASSWORD).expect("strong");
            installation.write(&self.0.join(INSTALLATION)).expect("written");
            installation
        }

        fn refused(&self) -> String {
            verified(&self.folder()).expect_err("refused")
        }
    }

    /// AMKD-XFR-01, AMK-PMT-19
    #[test]
    fn a_set_that_is_sealed_to_this_installation_starts() {
        assert_eq!(verified(&Place::new().folder()), Ok(()));
    }

    /// 3609/128: each with the reason of its row.
    #[test]
    fn every_other_set_is_refused_with_its_code() {
        let place = Place::new();
        place.installed("SIM-0002");
        assert!(place.refused().contains("3609/128/9/"), "{}", place.refused());
        fs::remove_file(place.0.join(INSTALLATION)).expect("there");
        assert!(place.refused().contains("3609/128/9/55"), "{}", place.refused());
        let place = Place::new();
        let image = place.folder().join("current/axis-01.b.img");
        let mut octets = fs::read(&image).expect("there");
        octets[70] ^= 4;
        fs::write(&image, octets).expect("written");
        assert!(place.refused().contains("3609/128/4/56"), "{}", place.refused());
        fs::remove_dir_all(place.folder().join("confirmed")).expect("there");
        assert!(place.refused().contains("3609/128/10/56"), "{}", place.refused());
        fs::remove_file(place.folder().join("current")).expect("there");
        assert!(place.refused().contains("3609/128/6/55"), "{}", place.refused());
    }

    #[test]
    fn a_start_finds_the_installation_beside_the_folder_and_no_other() {
        let place = Place::new();
        assert_eq!(finds(&place.folder(), &place.0.join(INSTALLATION)), Ok(()));
        let other = place.0.join("other.toml");
        fs::copy(place.0.join(INSTALLATION), &other).expect("copied");
        let names = finds(&place.folder(), &other).expect_err("another file");
        assert!(names.contains("sealed/installation.toml"), "{names}");
    }

    /// AMK-PMT-17
    #[test]
    fn a_set_that_is_only_loaded_is_gone_after_a_start() {
        let place = Place::new();
        let set = seal::prepare(SET, "set.toml", &place.installed("SIM-0001")).expect("right");
        seal::load(&set, &place.folder()).expect("loaded");
        assert!(place.refused().contains("not validated"));
        assert!(!place.folder().join("current").exists());
    }
}
