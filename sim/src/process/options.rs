//! The options of docs/architecture.md, as far as they concern the simulated machine.

use std::fmt::Display;
use std::net::SocketAddr;
use std::os::fd::RawFd;
use std::path::PathBuf;
use std::str::FromStr;

use gateway::Protocol;

/// All options.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Private root folder of this run.
    pub domain: PathBuf,
    /// Prefix of this run in shared memory.
    pub prefix: String,
    /// Boot nonce.
    pub nonce: u32,
    /// Cycle, µs.
    pub cycle_us: u64,
    /// Wake-up inside the cycle, µs.
    pub phase_us: u64,
    /// Axes in use.
    pub axes: Vec<u8>,
    /// Folder of the images.
    pub images: PathBuf,
    /// Core to run on.
    pub cpu: Option<usize>,
    /// SCHED_FIFO priority.
    pub priority: Option<i32>,
    /// Read end of the supervisor's pipe.
    pub supervisor_fd: Option<RawFd>,
    /// Written when the cycle starts.
    pub ready_fd: Option<RawFd>,
    /// Factor on the dead-man of the evaluators: 1 strict, up to 10 relaxed.
    pub age_factor: u8,
    /// Black channels by axis.
    pub buses: Vec<(u8, Protocol)>,
    /// Where the gateway listens for the first axis with a bus.
    pub gateway: Option<SocketAddr>,
    /// Script of the simulated master.
    pub script: Option<PathBuf>,
}

impl Options {
    /// The cycle, ns.
    pub const fn cycle_ns(&self) -> u64 {
        self.cycle_us * 1_000
    }

    /// Reads pairs of `--name value`.
    pub fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self { cycle_us: 1_000, axes: vec![1], age_factor: 1, ..Self::default() };
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| format!("{name}: expected a value"))?;
            options.take(&name, &value)?;
        }
        options.complete()
    }

    fn take(&mut self, name: &str, value: &str) -> Result<(), String> {
        match name {
            "--domain" => self.domain = value.into(),
            "--prefix" => value.clone_into(&mut self.prefix),
            "--nonce" => self.nonce = number(name, value, 1, u32::MAX)?,
            "--cycle-us" => self.cycle_us = number(name, value, 125, 4_000)?,
            "--phase-us" => self.phase_us = number(name, value, 0, 4_000)?,
            "--axes" => {
                self.axes =
                    value.split(',').map(|axis| number(name, axis, 1, 64)).collect::<Result<_, _>>()?;
            }
            "--images" => self.images = value.into(),
            "--cpu" => self.cpu = Some(number(name, value, 0, 1_023)?),
            "--priority" => self.priority = Some(number(name, value, 1, 99)?),
            // Inherited and kept open until exit; nothing is done with it.
            "--lock-fd" => drop(number(name, value, 0, RawFd::MAX)?),
            "--supervisor-fd" => self.supervisor_fd = Some(number(name, value, 0, RawFd::MAX)?),
            "--ready-fd" => self.ready_fd = Some(number(name, value, 0, RawFd::MAX)?),
            "--age-factor" => self.age_factor = number(name, value, 1, 10)?,
            "--bus" => self.buses = value.split(',').map(bus).collect::<Result<_, _>>()?,
            "--gateway" => {
                let address =
                    value.parse().map_err(|_| format!("{name} {value:?}: expected ADDRESS:PORT"))?;
                self.gateway = Some(address);
            }
            "--script" => self.script = Some(value.into()),
            _ => return Err(format!("{name}: not an option of safepair-sim")),
        }
        Ok(())
    }

    fn complete(self) -> Result<Self, String> {
        let missing = [
            ("--domain", self.domain.as_os_str().is_empty()),
            ("--prefix", self.prefix.is_empty()),
            ("--nonce", self.nonce == 0),
            ("--images", self.images.as_os_str().is_empty()),
        ];
        match missing.into_iter().find(|(_, missing)| *missing) {
            Some((name, _)) => Err(format!("{name}: is required")),
            None if self.phase_us >= self.cycle_us => Err(format!(
                "--phase-us {}: expected less than the cycle of {} µs",
                self.phase_us, self.cycle_us
            )),
            None => Ok(self),
        }
    }
}

/// `AXIS=PROTOCOL:…`; address and session id concern the channels.
fn bus(text: &str) -> Result<(u8, Protocol), String> {
    let expected = || format!("--bus {text:?}: expected AXIS=fsoe:… or AXIS=profisafe:…");
    let (axis, rest) = text.split_once('=').ok_or_else(expected)?;
    let protocol = match rest.split(':').next() {
        Some("fsoe") => Protocol::Fsoe,
        Some("profisafe") => Protocol::Profisafe,
        _ => return Err(expected()),
    };
    Ok((number("--bus", axis, 1, 64)?, protocol))
}

fn number<T>(name: &str, value: &str, least: T, most: T) -> Result<T, String>
where
    T: FromStr + PartialOrd + Display,
{
    match value.parse::<T>() {
        Ok(number) if (number >= least) && (number <= most) => Ok(number),
        _ => Err(format!("{name} {value:?}: expected a number from {least} to {most}")),
    }
}
