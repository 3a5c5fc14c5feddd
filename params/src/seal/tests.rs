use std::{
    fs,
    path::PathBuf,
    process,
    sync::atomic::{AtomicU32, Ordering},
};

use super::*;

/// A folder of its own for each test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!("safepair-params-{}-{}", process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const SET: &str =
    "profile = \"amk-kw\"\nserial = \"FROM-FILE\"\n[parameters]\nPrm67 = 300\nPrm3 = 60\nPrm2 = 90\n";
const PASSWORD: &str = "correct horse 1";

fn installation() -> Installation {
    let mut installation = Installation::new("SIM-0001");
    installation.set_password("", PASSWORD).expect("a strong password");
    installation
}

fn sealed() -> (Folder, Installation) {
    let (folder, installation) = (Folder::new(), installation());
    let prepared = prepare(SET, "set.toml", &installation).expect("a right set");
    seal(&prepared, &installation, PASSWORD, &prepared.content_signature(), &folder.0).expect("sealed");
    (folder, installation)
}

/// AMK-PMT-21, design 7: the serial number is the installation's.
#[test]
fn a_sealed_set_verifies_with_the_serial_number_of_its_installation() {
    let (folder, installation) = sealed();
    let items = verify(&folder.0, &installation).expect("readable");
    assert_eq!(items.len(), 3);
    assert!(items.iter().all(|item| item.right), "{items:#?}");
    let image = fs::read(folder.0.join("current/axis-01.a.img")).expect("an image");
    let image = Image::read(&image).expect("a right image");
    assert_eq!((image.serial.as_str(), image.validated), ("SIM-0001", true));
}

#[test]
fn the_wrong_password_or_signature_changes_nothing() {
    let (folder, installation) = (Folder::new(), installation());
    let prepared = prepare(SET, "set.toml", &installation).expect("right");
    let signature = prepared.content_signature();
    let wrong = |password: &str, typed: &str| {
        seal(&prepared, &installation, password, typed, &folder.0).expect_err("refused").to_string()
    };
    assert_eq!(wrong("", &signature), "no password was given");
    assert_eq!(wrong("correct horse 2", &signature), "the password is wrong");
    assert!(wrong(PASSWORD, "00000000").contains(&signature));
    assert_eq!(fs::read_dir(&folder.0).expect("the folder").count(), 0);
    let none = Installation::new("SIM-0001");
    assert!(
        seal(&prepared, &none, PASSWORD, &signature, &folder.0)
            .expect_err("refused")
            .to_string()
            .contains("no password yet")
    );
}

/// A set that breaks a rule is never sealed, though it has an image.
#[test]
fn an_implausible_set_is_refused() {
    let error = prepare(&SET.replace("300", "0"), "set.toml", &installation()).expect_err("refused");
    assert!(matches!(error, SealError::Rules(findings) if !findings.is_empty()));
    let error = prepare("profile = \"amk\"", "set.toml", &installation()).expect_err("refused");
    assert!(matches!(error, SealError::File(_)));
    assert!(matches!(prepare(SET, "set.toml", &Installation::new("")), Err(SealError::NoSerial(1))));
}

/// AMK-PMT-17: without validation it dies with the next restart.
#[test]
fn a_loaded_set_is_not_validated() {
    let (folder, installation) = (Folder::new(), installation());
    let prepared = prepare(SET, "set.toml", &installation).expect("right");
    load(&prepared, &folder.0).expect("written");
    let items = verify(&folder.0, &installation).expect("readable");
    assert!(items.iter().all(|item| !item.right), "{items:#?}");
    seal(&prepared, &installation, PASSWORD, &prepared.content_signature().to_lowercase(), &folder.0)
        .expect("sealed");
    assert!(verify(&folder.0, &installation).expect("readable").iter().all(|item| item.right));
}

/// AMK-PMT-17
#[test]
fn a_restart_erases_a_loaded_set_and_keeps_a_sealed_one() {
    let (folder, installation) = sealed();
    assert!(!restart(&folder.0).expect("possible"));
    let prepared = prepare(SET, "set.toml", &installation).expect("right");
    load(&prepared, &folder.0).expect("written");
    assert!(restart(&folder.0).expect("possible"));
    assert!(verify(&folder.0, &installation).is_err());
    assert!(!restart(&folder.0).expect("possible"));
}

/// AMK-SVC-03: a set sealed for one device is nothing for another.
#[test]
fn a_set_of_another_device_does_not_verify() {
    let (folder, _) = sealed();
    let items = verify(&folder.0, &Installation::new("SIM-0002")).expect("readable");
    assert!(items.iter().all(|item| !item.right), "{items:#?}");
}

#[test]
fn a_damaged_image_or_confirmation_does_not_verify() {
    for file in ["current/axis-01.a.img", "current/axis-01.b.img", "confirmed"] {
        let (folder, installation) = sealed();
        let mut path = folder.0.join(file);
        if path.is_dir() {
            path = fs::read_dir(path).expect("a folder").next().expect("a file").expect("its name").path();
        }
        let mut octets = fs::read(&path).expect("the file");
        let middle = octets.len() / 2 + 4;
        octets[middle] ^= 1;
        fs::write(&path, octets).expect("written");
        let items = verify(&folder.0, &installation).expect("readable");
        assert_eq!(items.iter().filter(|item| !item.right).count(), 1, "{file}: {items:#?}");
    }
}

/// Whatever a killed writer leaves aside, the old set stays whole and the next seal works.
#[test]
fn remains_of_a_killed_writer_do_not_matter() {
    let (folder, installation) = sealed();
    let other = prepare(&SET.replace("300", "301"), "set.toml", &installation).expect("right");
    let aside = folder.0.join(format!("sets/{}", other.device_signature()));
    fs::create_dir(&aside).expect("as if killed there");
    fs::write(aside.join("axis-01.a.img"), b"half").expect("as if killed there");
    std::os::unix::fs::symlink("nowhere", folder.0.join(".next")).expect("as if killed there");
    assert!(verify(&folder.0, &installation).expect("readable").iter().all(|item| item.right));
    seal(&other, &installation, PASSWORD, &other.content_signature(), &folder.0).expect("sealed");
    assert!(verify(&folder.0, &installation).expect("readable").iter().all(|item| item.right));
    assert!(source(&folder.0).expect("readable").contains("Prm67 = 301"));
}

#[test]
fn sealing_the_same_set_again_and_again_works() {
    let (folder, installation) = sealed();
    let prepared = prepare(SET, "set.toml", &installation).expect("right");
    for _ in 0..3 {
        seal(&prepared, &installation, PASSWORD, &prepared.content_signature(), &folder.0).expect("sealed");
        assert!(verify(&folder.0, &installation).expect("readable").iter().all(|item| item.right));
    }
}

/// AMK-PMT-14, AMK-PMT-15
#[test]
fn a_new_password_must_be_strong_and_the_old_one_known() {
    let mut installation = installation();
    let refused =
        |installation: &mut Installation, old: &str, new: &str| installation.set_password(old, new).is_err();
    assert!(refused(&mut installation, "wrong", "another 12345"));
    assert!(refused(&mut installation, PASSWORD, "short1"));
    assert!(refused(&mut installation, PASSWORD, "onlyletters"));
    assert!(!refused(&mut installation, PASSWORD, "another 12345"));
    assert_eq!(installation.verify(PASSWORD), Err(PasswordError::Wrong));
    assert_eq!(installation.verify("another 12345"), Ok(()));
}

#[test]
fn an_installation_is_written_and_read() {
    let folder = Folder::new();
    let path = folder.0.join("installation.toml");
    installation().write(&path).expect("written");
    let again = Installation::read(&path).expect("read");
    assert_eq!((again.serial_of(1), again.verify(PASSWORD)), (Some("SIM-0001"), Ok(())));
}

/// Which set a folder holds, whole: the number of its Prm67; `None` when there is none.
fn whole(folder: &Folder, installation: &Installation) -> Option<String> {
    if !folder.0.join("current").exists() {
        return None;
    }
    let items = verify(&folder.0, installation).expect("readable");
    assert!(items.iter().all(|item| item.right), "half a set: {items:#?}");
    let text = source(&folder.0).expect("readable");
    text.lines().find(|line| line.starts_with("Prm67")).map(str::to_string)
}

/// Power may go at every instant of sealing: the old set or the new one, never half, and the
/// next attempt works. First with no set before, then over an old one, then the same again.
#[test]
fn power_may_go_at_every_instant_of_sealing() {
    let installation = installation();
    let of = |speed: &str| prepare(&SET.replace("300", speed), "set.toml", &installation).expect("right");
    for before in [None, Some("301"), Some("302")] {
        let mut instants = 0;
        loop {
            let folder = Folder::new();
            let sealing =
                |set: &Prepared| seal(set, &installation, PASSWORD, &set.content_signature(), &folder.0);
            if let Some(old) = before {
                sealing(&of(old)).expect("sealed");
            }
            let old = whole(&folder, &installation);
            let new = of("302");
            faults::arm(Some(instants));
            let done = sealing(&new);
            faults::arm(None);
            let left = whole(&folder, &installation);
            assert!(left == old || left.as_deref() == Some("Prm67 = 302"), "instant {instants}: {left:?}");
            assert!(!restart(&folder.0).expect("possible"), "instant {instants}: a sealed set survives");
            sealing(&new).expect("the next attempt works");
            assert_eq!(whole(&folder, &installation).as_deref(), Some("Prm67 = 302"));
            if done.is_ok() {
                break;
            }
            instants += 1;
        }
        assert!(instants > 15, "{instants} instants are too few to be all");
    }
}

/// The same for a set that is only loaded: it is never taken for a validated one, and a
/// restart that is itself interrupted ends the job the next time.
#[test]
fn power_may_go_at_every_instant_of_loading_and_of_the_restart_after_it() {
    let installation = installation();
    let set = prepare(SET, "set.toml", &installation).expect("right");
    for instants in 0..40 {
        let folder = Folder::new();
        faults::arm(Some(instants));
        let _ = load(&set, &folder.0);
        let _ = restart(&folder.0);
        faults::arm(None);
        let _ = restart(&folder.0).expect("possible");
        assert!(!folder.0.join("current").exists(), "instant {instants}: an unvalidated set survived");
    }
}

/// AMKD-XFR-04: what is wrong with a stored set carries the vendor's code.
#[test]
fn a_wrong_set_is_reported_with_its_transfer_code() {
    let code = |damage: fn(&Folder), serial: &str| {
        let (folder, _) = sealed();
        damage(&folder);
        let items = verify(&folder.0, &Installation::new(serial)).expect("readable");
        items.into_iter().filter(|item| !item.right).map(|item| item.code).collect::<Vec<_>>()
    };
    assert_eq!(
        code(|folder| fs::remove_file(folder.0.join("current/axis-01.a.img")).expect("there"), "SIM-0001"),
        ["3609/128/6/55"]
    );
    let flip = |folder: &Folder| {
        let path = folder.0.join("current/axis-01.b.img");
        let mut octets = fs::read(&path).expect("there");
        octets[60] ^= 1;
        fs::write(path, octets).expect("written");
    };
    assert_eq!(code(flip, "SIM-0001"), ["3609/128/4/56"]);
    assert_eq!(code(|_| (), "SIM-0002"), ["3609/128/10/56", "3609/128/9/55", "3609/128/9/56"]);
}

/// AMKD-XFR-05, 3609/6: what ended early says so until the next transfer or restart, and what
/// failed says whether a set is in force.
#[test]
fn a_transfer_that_did_not_end_is_named_until_the_next_restart() {
    let (folder, installation) = sealed();
    assert!(!is_interrupted(&folder.0));
    let other = prepare(&SET.replace("300", "301"), "set.toml", &installation).expect("right");
    let cut = |folder: &Folder| {
        faults::arm(Some(9));
        let error = load(&other, &folder.0).expect_err("power loss").to_string();
        faults::arm(None);
        error
    };
    assert!(cut(&folder).starts_with("3609/5/7/57"));
    assert!(is_interrupted(&folder.0));
    assert!(!restart(&folder.0).expect("possible"));
    assert!(!is_interrupted(&folder.0));
    let empty = Folder::new();
    assert!(cut(&empty).starts_with("3609/133/7/57"));
    load(&other, &empty.0).expect("the next one");
    assert!(!is_interrupted(&empty.0));
}

/// AMK-PMT-24: the states of a transfer, as the LED of the device shows them.
#[test]
fn the_state_of_a_folder_follows_loading_sealing_and_restart() {
    let (folder, installation) = (Folder::new(), installation());
    assert_eq!(state(&folder.0), State::Empty);
    let set = prepare(SET, "set.toml", &installation).expect("right");
    load(&set, &folder.0).expect("loaded");
    assert_eq!(state(&folder.0), State::Loaded);
    seal(&set, &installation, PASSWORD, &set.content_signature(), &folder.0).expect("sealed");
    assert_eq!(state(&folder.0), State::Sealed);
    assert!(state(&folder.0).text().contains("restart"));
}

/// An image, a file and a serial number are enough for a third party.
#[test]
fn an_image_verifies_against_its_file_and_its_device_only() {
    let (folder, _) = sealed();
    for channel in ["a", "b"] {
        let octets = fs::read(folder.0.join(format!("current/axis-01.{channel}.img"))).expect("there");
        let right = |text: &str, serial: &str| {
            let machine = crate::parse(text, "x").expect("right");
            verify_image(&octets, &machine, serial).iter().all(|item| item.right)
        };
        assert!(right(SET, "SIM-0001"));
        assert!(!right(SET, "SIM-0002"));
        assert!(!right(&SET.replace("300", "301"), "SIM-0001"));
        for bit in 0..octets.len() * 8 {
            let mut damaged = octets.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let machine = crate::parse(SET, "x").expect("right");
            assert!(!verify_image(&damaged, &machine, "SIM-0001").iter().all(|item| item.right), "bit {bit}");
        }
    }
}
