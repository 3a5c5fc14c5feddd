//! The simulated GPIO chip from outside: what its sysfs shows and takes, as wires would.

use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::PathBuf;

/// Line of channel A's inhibit path.
pub const PATH_A: u32 = 0;
/// Line of channel B's inhibit path.
pub const PATH_B: u32 = 1;
/// SD-In1, line .1 and .2.
pub const PAIR_1: [u32; 2] = [2, 3];
/// Acknowledge terminal for errors.
pub const AIE: u32 = 4;
/// Acknowledge terminal for restarts.
pub const AIS: u32 = 5;

/// The chip.
#[derive(Debug, Clone)]
pub struct Chip {
    name: String,
    folder: PathBuf,
}

impl Chip {
    /// The chip `name` (`gpiochip0`) of the gpio-sim device `device`.
    pub fn new(name: &str, device: &str) -> Self {
        Self { name: name.to_owned(), folder: PathBuf::from("/sys/devices/platform").join(device).join(name) }
    }

    /// Its character device.
    pub fn device(&self) -> String {
        format!("/dev/{}", self.name)
    }

    fn attribute(&self, line: u32, name: &str) -> PathBuf {
        self.folder.join(format!("sim_gpio{line}/{name}"))
    }

    /// Puts a level on an input, as a contact would.
    pub fn pull(&self, line: u32, high: bool) -> Result<(), String> {
        let path = self.attribute(line, "pull");
        let text = if high { "pull-up" } else { "pull-down" };
        fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))
    }

    /// A probe on a line.
    pub fn probe(&self, line: u32) -> Result<Probe, String> {
        let path = self.attribute(line, "value");
        let file = OpenOptions::new().read(true).open(&path);
        file.map(Probe).map_err(|error| format!("{}: {error}", path.display()))
    }
}

/// Sees the level of one line.
#[derive(Debug)]
pub struct Probe(File);

impl Probe {
    /// The line is high. A line that cannot be read is not.
    pub fn high(&self) -> bool {
        let mut octet = [0];
        self.0.read_at(&mut octet, 0).is_ok() && octet == *b"1"
    }
}
