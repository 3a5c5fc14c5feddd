//! The machine file `safepair.toml`: which axes, which cores, which paths, who produces.
//!
//! ```toml
//! period_us = 1000              # cycle, µs; absent: by the timing
//! timing = "auto"               # auto, strict, relaxed
//! priority = 80                 # SCHED_FIFO; 0: none
//! logbook = "logbook"           # absent: none is kept
//!
//! [cores]                       # absent: any
//! channel_a = 2
//! channel_b = 3
//! crosscheck = 3
//! producer = 1
//!
//! [producer]
//! program = "/opt/drive/io"     # absent: the simulated drive and master
//! script = "story.toml"         # of the simulated drive
//! gateway = "127.0.0.1:34980"   # black channel of the simulated drive on UDP
//!
//! [inhibit]
//! a = "gpio:/dev/gpiochip0:17"  # absent: simulated
//! b = "gpio:/dev/gpiochip0:27"
//! evaluator = "charge pump XY, drops after three missing edges"
//!
//! [[axis]]
//! number = 1
//! parameters = "axis-1.toml"    # or: sealed = "folder of safepair params seal"
//! bus = "fsoe"                  # or "profisafe"; absent: none
//! address = 3
//! sra = false                   # FSoE: the master has to send the set's SRA CRC
//! ```

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
};

use serde::Deserialize;

use super::timing::Wish;
use super::{Images, default_machine, images_of, sealed_images};
use crate::machine_file;

/// A machine as its file describes it.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Machine {
    /// Cycle, µs, 125 to 4,000.
    pub period_us: Option<u32>,
    /// Timing.
    pub timing: Wish,
    /// SCHED_FIFO priority.
    pub priority: Option<u8>,
    /// File of the logbook.
    pub logbook: Option<PathBuf>,
    /// Cores.
    pub cores: Cores,
    /// Who publishes encoder, inputs and commands.
    pub producer: Producer,
    /// The two paths.
    pub inhibit: Inhibit,
    /// The axes as the file lists them.
    #[serde(rename = "axis")]
    listed: Vec<Axis>,
    /// Safety images of every axis.
    #[serde(skip)]
    pub images: Vec<Images>,
    /// Black channels by axis.
    #[serde(skip)]
    pub buses: Vec<Fieldbus>,
}

/// Cores by process; absent: any.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cores {
    channel_a: Option<u32>,
    channel_b: Option<u32>,
    crosscheck: Option<u32>,
    producer: Option<u32>,
}

impl Cores {
    /// A, B, crosscheck, producer.
    pub const fn in_order(self) -> [Option<u32>; 4] {
        [self.channel_a, self.channel_b, self.crosscheck, self.producer]
    }
}

/// Who publishes encoder, inputs and commands.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Producer {
    /// A program that takes the options of every process of the set.
    pub program: Option<PathBuf>,
    /// Script of the simulated drive.
    pub script: Option<PathBuf>,
    /// Where the simulated drive's gateway listens for black-channel frames.
    pub gateway: Option<SocketAddr>,
}

/// The two paths and who evaluates them.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Inhibit {
    /// Path of A.
    pub a: Option<String>,
    /// Path of B.
    pub b: Option<String>,
    /// The integrator's statement.
    pub evaluator: Option<String>,
}

/// The protocol an axis is commanded by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bus {
    /// FSoE.
    Fsoe,
    /// PROFIsafe.
    Profisafe,
}

/// What commands an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fieldbus {
    /// Number of the axis.
    pub axis: u8,
    /// Protocol.
    pub bus: Bus,
    /// FSoE 1 to 65,535, PROFIsafe 1 to 65,534.
    pub address: u16,
    /// The FSoE master has to send the SRA CRC of the set.
    pub sra: bool,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Axis {
    number: u8,
    parameters: Option<PathBuf>,
    sealed: Option<PathBuf>,
    bus: Option<Bus>,
    address: Option<u16>,
    #[serde(default)]
    sra: bool,
}

impl Machine {
    /// The machine of the file at `path`.
    ///
    /// # Errors
    /// File, line and what was expected.
    pub fn read(path: &Path) -> Result<Self, String> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| format!("{name}: {error}"))?;
        let mut machine: Self = toml::from_str(&text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or("");
            format!("{name}:{}: {}", before.matches('\n').count() + 1, error.message())
        })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        machine.complete(folder).map_err(|line| format!("{name}: {line}"))?;
        Ok(machine)
    }

    /// The embedded machine: one simulated axis.
    ///
    /// # Errors
    /// None, unless the program itself is broken.
    pub fn embedded() -> Result<Self, String> {
        default_machine().map(|set| Self::of(&set))
    }

    /// A machine with these axes and nothing else said.
    pub fn of(set: &params::Machine) -> Self {
        Self::with_images(images_of(set))
    }

    /// A machine with these images and nothing else said.
    pub fn with_images(images: Vec<Images>) -> Self {
        Self { images, ..Self::default() }
    }

    fn complete(&mut self, folder: &Path) -> Result<(), String> {
        if self.period_us.is_some_and(|period| !(125..=4_000).contains(&period)) {
            return Err("period_us: expected 125 to 4,000 µs".into());
        }
        if self.priority.is_some_and(|priority| priority > 98) {
            return Err("priority: expected 0 to 98".into());
        }
        if self.listed.is_empty() {
            return Err("expected at least one [[axis]]".into());
        }
        for axis in self.listed.clone() {
            let images = images(&axis, folder).map_err(|line| format!("axis {}: {line}", axis.number))?;
            self.images.push(images);
            self.buses.extend(bus(&axis).map_err(|line| format!("axis {}: {line}", axis.number))?);
        }
        self.images.sort_by_key(|(number, _, _)| *number);
        self.buses.sort_by_key(|fieldbus| fieldbus.axis);
        let twice = self.images.windows(2).find(|pair| pair[0].0 == pair[1].0);
        if let Some(twice) = twice {
            return Err(format!("axis {}: expected once", twice[0].0));
        }
        let below = |path: &mut Option<PathBuf>| *path = path.take().map(|path| folder.join(path));
        below(&mut self.logbook);
        below(&mut self.producer.script);
        self.distinct_addresses()
    }

    /// A frame finds its axis by the address, so that no two may have the same (issue: addresses).
    fn distinct_addresses(&self) -> Result<(), String> {
        let mut addresses: Vec<u16> = self.buses.iter().map(|fieldbus| fieldbus.address).collect();
        addresses.sort_unstable();
        match addresses.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(format!("address {}: expected for one axis only", pair[0])),
            None => Ok(()),
        }
    }
}

fn images(axis: &Axis, folder: &Path) -> Result<Images, String> {
    let mut found = match (&axis.parameters, &axis.sealed) {
        (Some(file), None) => {
            let mut set = machine_file::read(&folder.join(file))?;
            if let [only] = set.axes.as_mut_slice() {
                only.number = axis.number;
            }
            images_of(&set)
        }
        (None, Some(sealed)) => sealed_images(&folder.join(sealed))?,
        _ => return Err("expected either parameters or sealed".into()),
    };
    let own = found.iter().position(|(number, _, _)| *number == axis.number);
    own.map(|at| found.swap_remove(at)).ok_or_else(|| "its parameter file has no such axis".into())
}

fn bus(axis: &Axis) -> Result<Option<Fieldbus>, String> {
    if axis.sra & (axis.bus != Some(Bus::Fsoe)) {
        return Err("sra: expected with bus = \"fsoe\" only".into());
    }
    match (axis.bus, axis.address) {
        (None, None) => Ok(None),
        // 65,535 is no F_Dest_Add; 0 is no address of either (black-channel.md 7.1).
        (Some(Bus::Profisafe), Some(65_535)) => Err("address: expected 1 to 65,534".into()),
        (Some(_), Some(0)) => Err("address: expected 1 to 65,535".into()),
        (Some(bus), Some(address)) => Ok(Some(Fieldbus { axis: axis.number, bus, address, sra: axis.sra })),
        _ => Err("expected bus and address together".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXIS: &str = include_str!("../demo/axis.toml");

    fn read(name: &str, text: &str) -> Result<Machine, String> {
        let folder = std::env::temp_dir().join(format!("safepair-machine-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join("axis.toml"), AXIS).expect("written");
        let path = folder.join("safepair.toml");
        std::fs::write(&path, text).expect("written");
        let machine = Machine::read(&path);
        std::fs::remove_dir_all(&folder).expect("ours");
        machine
    }

    #[test]
    fn several_axes_may_share_one_parameter_file() {
        let machine = read(
            "two",
            "period_us = 2000\n[[axis]]\nnumber = 3\nparameters = \"axis.toml\"\n[[axis]]\nnumber = 1\nparameters \
             = \"axis.toml\"\nbus = \"fsoe\"\naddress = 7\n",
        );
        let machine = machine.expect("sound");
        assert_eq!(machine.images.iter().map(|(axis, _, _)| *axis).collect::<Vec<_>>(), [1, 3]);
        assert_eq!(machine.buses, [Fieldbus { axis: 1, bus: Bus::Fsoe, address: 7, sra: false }]);
    }

    #[test]
    fn what_is_wrong_is_named_with_file_and_line() {
        for (name, text, expected) in [
            ("key", "period = 1\n", "safepair.toml:1: unknown field `period`"),
            ("late", "\n\ntiming = \"quick\"\n", "safepair.toml:3: unknown variant `quick`"),
            ("none", "period_us = 1000\n", "expected at least one [[axis]]"),
            ("period", "period_us = 100\n", "period_us: expected 125 to 4,000"),
            (
                "address",
                "[[axis]]\nnumber = 1\nparameters = \"axis.toml\"\nbus = \"fsoe\"\naddress = 0\n",
                "axis 1: address: expected 1 to 65,535",
            ),
            (
                "twice",
                "[[axis]]\nnumber = 1\nparameters = \"axis.toml\"\n[[axis]]\nnumber = 1\nparameters = \"axis.toml\"\n",
                "axis 1: expected once",
            ),
        ] {
            let line = read(name, text).expect_err(name);
            assert!(line.contains(expected), "{line}");
        }
    }
}
