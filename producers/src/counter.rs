//! The kernel's counter subsystem: a quadrature counter as [`SlotKind::Counter`].
//!
//! Read through sysfs, which every counter driver has: `count0/count`, `count0/ceiling`,
//! `count0/function`. A driver with events (`/dev/counterN`) gives time stamps of its own;
//! take them instead of the wake-up's where yours does.
//!
//! [`SlotKind::Counter`]: shm_schema::encoder::SlotKind::Counter

use std::fs::{self, File};
use std::io::{Read, Seek};
use std::path::Path;
use std::str::FromStr;

use shm_schema::encoder::{Slot, SlotKind};

use crate::count::Quarters;

/// Four counts for each period, as the slot wants them; one count less of anything else would be
/// another speed.
const FUNCTION: &str = "quadrature x4";
/// Fault bits of [`Slot::status`] as this producer sets them.
pub mod status {
    /// The counter could not be read.
    pub const UNREADABLE: u8 = 1 << 0;
    /// The counter is not enabled any more.
    pub const DISABLED: u8 = 1 << 1;
}

/// An open counter.
#[derive(Debug)]
pub struct Counter {
    count: File,
    enable: Option<File>,
    quarters: Quarters,
    slot: Slot,
}

fn field(folder: &Path, name: &str) -> Result<String, String> {
    let path = folder.join(name);
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(text.trim().to_owned())
}

/// The number in an attribute, read again from its start. No allocation.
fn number<T: FromStr>(file: &mut File) -> Option<T> {
    let mut octets = [0; 24];
    file.rewind().ok()?;
    let length = file.read(&mut octets).ok()?;
    std::str::from_utf8(octets.get(..length)?).ok()?.trim().parse().ok()
}

impl Counter {
    /// Opens `folder`, such as `/sys/bus/counter/devices/counter0/count0`.
    ///
    /// # Errors
    /// One line: what was read, what is expected.
    pub fn open(folder: &Path) -> Result<Self, String> {
        let function = field(folder, "function")?;
        if function != FUNCTION {
            return Err(format!(
                "{}: {function:?}, expected {FUNCTION:?}",
                folder.join("function").display()
            ));
        }
        // A driver without a ceiling counts through all of 64 bits.
        let ceiling = field(folder, "ceiling").ok().and_then(|text| text.parse().ok()).unwrap_or(u64::MAX);
        let path = folder.join("count");
        let mut count = File::open(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let raw = number(&mut count).ok_or_else(|| format!("{}: expected a number", path.display()))?;
        Ok(Self {
            count,
            enable: File::open(folder.join("enable")).ok(),
            quarters: Quarters::new(raw, ceiling),
            slot: Slot { kind: SlotKind::Counter, ..Slot::default() },
        })
    }

    /// The slot now. A counter that cannot be read keeps its count and says so.
    pub fn sample(&mut self) -> Slot {
        let raw = number(&mut self.count);
        let enabled = self.enable.as_mut().is_none_or(|file| number::<u8>(file) == Some(1));
        self.slot.status = if raw.is_some() { 0 } else { status::UNREADABLE };
        self.slot.status |= if enabled { 0 } else { status::DISABLED };
        if let Some(raw) = raw {
            self.slot.count = self.quarters.step(raw);
        }
        self.slot
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    /// A folder that looks like a counter's.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str, function: &str) -> Self {
            let path = std::env::temp_dir().join(format!("safepair-counter-{name}-{}", std::process::id()));
            fs::create_dir_all(&path).expect("a folder");
            let folder = Self(path);
            [("function", function), ("ceiling", "65535"), ("enable", "1"), ("count", "65530")]
                .iter()
                .for_each(|(name, text)| folder.write(name, text));
            folder
        }

        fn write(&self, name: &str, text: &str) {
            fs::write(self.0.join(name), format!("{text}\n")).expect("a file");
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_counter_of_the_kernel_becomes_a_counter_slot() {
        let folder = Folder::new("slot", FUNCTION);
        let mut counter = Counter::open(&folder.0).expect("a counter");
        folder.write("count", "4");
        let slot = counter.sample();
        assert_eq!((slot.kind, slot.status, slot.count), (SlotKind::Counter, 0, 10));
    }

    #[test]
    fn a_counter_that_falls_silent_says_so_and_does_not_move() {
        let folder = Folder::new("silent", FUNCTION);
        let mut counter = Counter::open(&folder.0).expect("a counter");
        folder.write("enable", "0");
        folder.write("count", "");
        let slot = counter.sample();
        assert_eq!((slot.status, slot.count), (status::UNREADABLE | status::DISABLED, 0));
    }

    #[test]
    fn another_way_of_counting_is_refused() {
        let folder = Folder::new("function", "quadrature x2 a");
        let line = Counter::open(&folder.0).expect_err("refused");
        assert!(line.contains("quadrature x4"), "{line}");
    }
}
