//! The options of docs/architecture.md.

use std::path::PathBuf;

use shm_schema::exchange::{Bus, RELAXED_AGE_FACTOR};

use super::bus::buses;

/// Where the path is driven.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum InhibitOption {
    /// The `inhibit-a` cell.
    Sim,
    /// A line of a GPIO chip.
    Gpio {
        /// Path of the chip.
        chip: PathBuf,
        /// Offset of the line.
        line: u32,
    },
}

/// All options.
#[derive(Debug, Clone)]
pub struct Options {
    /// Private root folder of this run.
    pub domain: PathBuf,
    /// iceoryx2 prefix of this run.
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
    pub priority: Option<u8>,
    /// Read end of the supervisor's pipe.
    pub supervisor_fd: Option<i32>,
    /// Written when the cycle starts.
    pub ready_fd: Option<i32>,
    /// Where the path is driven.
    pub inhibit: InhibitOption,
    /// An unprotected command is accepted.
    pub plain_command: bool,
    /// Factor on everything that asks how late.
    pub age_factor: u8,
    /// The black channels, by axis.
    pub buses: Vec<(u8, Bus)>,
    /// Build identity of the partner; 0: not checked.
    pub partner_build: u32,
}

impl Options {
    /// The cycle, ns.
    pub const fn cycle_ns(&self) -> u64 {
        self.cycle_us * 1_000
    }

    /// Reads pairs of `--name value`.
    ///
    /// # Errors
    /// One line: the option, what was found, what is expected.
    pub fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            domain: PathBuf::new(),
            prefix: String::new(),
            nonce: 0,
            cycle_us: 1_000,
            phase_us: 0,
            axes: vec![1],
            images: PathBuf::new(),
            cpu: None,
            priority: None,
            supervisor_fd: None,
            ready_fd: None,
            inhibit: InhibitOption::Sim,
            plain_command: false,
            age_factor: 1,
            buses: Vec::new(),
            partner_build: 0,
        };
        let mut evaluator = false;
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| format!("{name}: a value is expected"))?;
            evaluator |= name == "--evaluator" && !value.is_empty();
            options.take(&name, &value)?;
        }
        options.judge(evaluator)?;
        Ok(options)
    }

    /// The black channel of `axis`.
    pub fn bus_of(&self, axis: u8) -> Bus {
        self.buses.iter().find(|(of, _)| *of == axis).map_or(Bus::None, |(_, bus)| *bus)
    }

    fn take(&mut self, name: &str, value: &str) -> Result<(), String> {
        match name {
            "--domain" => self.domain = value.into(),
            "--prefix" => self.prefix = value.into(),
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
            "--lock-fd" => drop(number(name, value, 0, i32::MAX)?),
            "--supervisor-fd" => self.supervisor_fd = Some(number(name, value, 0, i32::MAX)?),
            "--ready-fd" => self.ready_fd = Some(number(name, value, 0, i32::MAX)?),
            "--inhibit" => self.inhibit = inhibit(value)?,
            "--evaluator" => {}
            "--plain-command" => self.plain_command = yes(name, value)?,
            "--age-factor" => self.age_factor = number(name, value, 1, RELAXED_AGE_FACTOR)?,
            "--bus" => self.buses = buses(name, value)?,
            "--partner-build" => self.partner_build = number(name, value, 0, u32::MAX)?,
            _ => return Err(format!("{name}: not an option of channel A")),
        }
        Ok(())
    }

    fn judge(&self, evaluator: bool) -> Result<(), String> {
        let missing = [
            ("--domain", self.domain.as_os_str().is_empty()),
            ("--prefix", self.prefix.is_empty()),
            ("--nonce", self.nonce == 0),
            ("--images", self.images.as_os_str().is_empty()),
        ];
        if let Some((name, _)) = missing.into_iter().find(|(_, missing)| *missing) {
            return Err(format!("{name}: is required"));
        }
        if self.phase_us >= self.cycle_us {
            return Err(format!(
                "--phase-us {}: less than the cycle of {} expected",
                self.phase_us, self.cycle_us
            ));
        }
        if let Some((axis, _)) = self.buses.iter().find(|(axis, _)| !self.axes.contains(axis)) {
            return Err(format!("--bus {axis}=…: axis {axis} is not in --axes"));
        }
        if self.inhibit == InhibitOption::Sim {
            return Ok(());
        }
        if self.age_factor > 1 {
            return Err(format!(
                "--age-factor {}: the relaxed timing is refused together with a GPIO path",
                self.age_factor
            ));
        }
        if !evaluator {
            return Err(
                "--inhibit gpio: --evaluator is required, the statement of what drops the path".into()
            );
        }
        if self.plain_command {
            return Err("--plain-command yes: refused together with a GPIO path".into());
        }
        if self.axes.len() != 1 {
            return Err("--inhibit gpio: one axis expected, one line drives one path".into());
        }
        Ok(())
    }
}

pub(super) fn number<T: std::str::FromStr + PartialOrd + std::fmt::Display + Copy>(
    name: &str,
    value: &str,
    least: T,
    most: T,
) -> Result<T, String> {
    match value.trim().parse::<T>() {
        Ok(number) if number >= least && number <= most => Ok(number),
        _ => Err(format!("{name} {value}: a number from {least} to {most} expected")),
    }
}

fn yes(name: &str, value: &str) -> Result<bool, String> {
    match value {
        "yes" => Ok(true),
        "no" => Ok(false),
        _ => Err(format!("{name} {value}: yes or no expected")),
    }
}

fn inhibit(value: &str) -> Result<InhibitOption, String> {
    let wrong = || format!("--inhibit {value}: sim or gpio:CHIP:LINE expected");
    if value == "sim" {
        return Ok(InhibitOption::Sim);
    }
    let (chip, line) =
        value.strip_prefix("gpio:").and_then(|rest| rest.rsplit_once(':')).ok_or_else(wrong)?;
    let line = line.parse().map_err(|_| wrong())?;
    let chip = if chip.contains('/') { chip.into() } else { PathBuf::from("/dev").join(chip) };
    Ok(InhibitOption::Gpio { chip, line })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(extra: &str) -> Result<Options, String> {
        let text = format!("--domain d --prefix p --nonce 7 --images i {extra}");
        Options::parse(text.split_whitespace().map(String::from))
    }

    #[test]
    fn every_option_of_the_architecture_is_known() {
        let options = parse(
            "--cycle-us 250 --phase-us 100 --axes 1,2,64 --cpu 1 --priority 80 --lock-fd 3 --supervisor-fd 4 \
             --ready-fd 5 --inhibit sim --plain-command yes --age-factor 10 --partner-build 77 \
             --bus 2=fsoe:5:4660,64=profisafe:7",
        )
        .unwrap();
        assert_eq!((options.age_factor, options.partner_build), (10, 77));
        assert_eq!(options.bus_of(1), Bus::None);
        assert_eq!(options.bus_of(2), Bus::Fsoe { address: 5, session_id: 4_660, sra: false });
        assert_eq!(options.bus_of(64), Bus::Profisafe { address: 7 });
        assert_eq!((options.cycle_us, options.phase_us, options.axes.len()), (250, 100, 3));
        assert!(options.plain_command);
    }

    #[test]
    fn a_gpio_path_needs_its_evaluator_and_no_plain_command() {
        assert!(parse("--inhibit gpio:gpiochip0:4").is_err());
        assert!(parse("--inhibit gpio:gpiochip0:4 --evaluator charge-pump").is_ok());
        assert!(parse("--inhibit gpio:gpiochip0:4 --evaluator x --plain-command yes").is_err());
        assert!(parse("--inhibit gpio:gpiochip0:4 --evaluator x --age-factor 2").is_err());
        assert!(parse("--inhibit gpio:gpiochip0:4 --evaluator x --age-factor 1").is_ok());
    }

    #[test]
    fn wrong_values_are_named() {
        for wrong in [
            "--age-factor 0",
            "--age-factor 11",
            "--partner-build -1",
            "--bus 2=fsoe:1:1",
            "--cycle-us 100",
            "--axes 0",
            "--axes 1,65",
            "--nonce 0",
            "--what x",
            "--phase-us 1000",
            "--cpu",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
