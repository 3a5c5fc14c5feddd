//! Options of the process (docs/architecture.md).

use std::os::fd::{FromRawFd, OwnedFd, RawFd};
use std::path::PathBuf;
use std::str::FromStr;

use shm_schema::exchange::{Bus, RELAXED_AGE_FACTOR};

use super::Trouble;

/// Where the inhibit path is driven.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Backend {
    /// The cell alone: simulation.
    Sim,
    /// A line of a GPIO chip of the kernel.
    Gpio {
        /// Device of the chip.
        chip: PathBuf,
        /// Offset of the line.
        line: u32,
    },
}

/// Everything the supervisor says.
#[derive(Debug)]
pub struct Options {
    /// Boot nonce.
    pub nonce: u32,
    /// iceoryx2 prefix.
    pub prefix: String,
    /// Private root folder of this run.
    pub domain: PathBuf,
    /// Cycle, ns.
    pub cycle_ns: u64,
    /// Wake-up inside the cycle, ns.
    pub phase_ns: u64,
    /// Axes in use.
    pub axes: Vec<u8>,
    /// Folder of the images.
    pub images: PathBuf,
    /// Core to run on.
    pub cpu: Option<usize>,
    /// `SCHED_FIFO` priority.
    pub priority: Option<i32>,
    /// Kept open until exit.
    pub lock: Option<OwnedFd>,
    /// End of file is the supervisor's death.
    pub supervisor: Option<OwnedFd>,
    /// Told `R` when the cycle starts.
    pub ready: Option<OwnedFd>,
    /// Where the path is driven.
    pub backend: Backend,
    /// Unprotected commands are accepted.
    pub plain_command: bool,
    /// Factor of the timing, 1 to 10.
    pub age_factor: u8,
    /// Black channel of an axis; an axis that is not named has none.
    pub buses: Vec<(u8, Bus)>,
    /// Build the release manifest names for channel A; 0: not checked.
    pub partner_build: u32,
    evaluator: Option<String>,
}

impl Options {
    /// Reads pairs of option and value.
    ///
    /// # Errors
    /// The first option that is unknown, missing or has no possible value.
    pub fn parse(arguments: impl Iterator<Item = String>) -> Result<Self, Trouble> {
        let mut options = Self::nothing();
        let mut arguments = arguments;
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| Trouble::new(&name, "expected a value behind it"))?;
            options.take(&name, &value)?;
        }
        options.check()?;
        Ok(options)
    }

    fn nothing() -> Self {
        Self {
            domain: PathBuf::new(),
            prefix: String::new(),
            nonce: 0,
            cycle_ns: 1_000_000,
            phase_ns: 0,
            axes: Vec::new(),
            images: PathBuf::new(),
            cpu: None,
            priority: None,
            lock: None,
            supervisor: None,
            ready: None,
            backend: Backend::Sim,
            plain_command: false,
            age_factor: 1,
            buses: Vec::new(),
            partner_build: 0,
            evaluator: None,
        }
    }

    fn take(&mut self, name: &str, value: &str) -> Result<(), Trouble> {
        match name {
            "--domain" => self.domain = value.into(),
            "--prefix" => value.clone_into(&mut self.prefix),
            "--nonce" => self.nonce = number(name, value, 1, u32::MAX)?,
            "--cycle-us" => self.cycle_ns = 1_000 * number::<u64>(name, value, 125, 4_000)?,
            "--phase-us" => self.phase_ns = 1_000 * number::<u64>(name, value, 0, 4_000)?,
            "--axes" => {
                let axes = value.split(',').map(|axis| number(name, axis, 1, 64));
                self.axes = axes.collect::<Result<_, _>>()?;
            }
            "--images" => self.images = value.into(),
            "--cpu" => self.cpu = Some(number(name, value, 0, 1_023)?),
            "--priority" => self.priority = Some(number(name, value, 1, 99)?),
            "--lock-fd" => self.lock = Some(descriptor(name, value)?),
            "--supervisor-fd" => self.supervisor = Some(descriptor(name, value)?),
            "--ready-fd" => self.ready = Some(descriptor(name, value)?),
            "--inhibit" => self.backend = backend(name, value)?,
            "--evaluator" => self.evaluator = Some(value.to_owned()),
            "--plain-command" => self.plain_command = value == "yes",
            "--age-factor" => self.age_factor = number(name, value, 1, RELAXED_AGE_FACTOR)?,
            "--bus" => self.buses = value.split(',').map(|one| bus(name, one)).collect::<Result<_, _>>()?,
            "--partner-build" => self.partner_build = number(name, value, 0, u32::MAX)?,
            _ => return Err(Trouble::new(name, "is no option of this process")),
        }
        Ok(())
    }

    fn check(&self) -> Result<(), Trouble> {
        let needed = [
            ("--domain", self.domain.as_os_str().is_empty()),
            ("--prefix", self.prefix.is_empty()),
            ("--nonce", self.nonce == 0),
            ("--axes", self.axes.is_empty()),
            ("--images", self.images.as_os_str().is_empty()),
        ];
        if let Some((name, _)) = needed.iter().find(|(_, missing)| *missing) {
            return Err(Trouble::new(name, "is needed"));
        }
        let is_gpio = self.backend != Backend::Sim;
        if is_gpio & self.evaluator.is_none() {
            return Err(Trouble::new(
                "--inhibit gpio",
                "needs --evaluator: who drops the path after three missing edges",
            ));
        }
        if is_gpio & self.plain_command {
            return Err(Trouble::new("--plain-command yes", "is refused together with a GPIO path"));
        }
        if is_gpio & (self.age_factor != 1) {
            return Err(Trouble::new("--age-factor", "above 1 is refused together with a GPIO path"));
        }
        if let Some((axis, _)) = self.buses.iter().find(|(axis, _)| !self.axes.contains(axis)) {
            return Err(Trouble::new("--bus", format!("axis {axis} is not in --axes")));
        }
        if is_gpio & (self.axes.len() != 1) {
            return Err(Trouble::new("--inhibit gpio", "drives the path of exactly one axis"));
        }
        Ok(())
    }
}

fn number<T: FromStr + PartialOrd + Copy + std::fmt::Display>(
    name: &str,
    value: &str,
    least: T,
    most: T,
) -> Result<T, Trouble> {
    match value.parse::<T>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(Trouble::new(name, format!("expected {least} to {most}, found {value:?}"))),
    }
}

fn descriptor(name: &str, value: &str) -> Result<OwnedFd, Trouble> {
    let raw: RawFd = number(name, value, 3, 1_000_000)?;
    // SAFETY: the supervisor hands this descriptor over to this process alone and names it
    // once; whether it is open is found at its first use.
    Ok(unsafe { OwnedFd::from_raw_fd(raw) })
}

fn backend(name: &str, value: &str) -> Result<Backend, Trouble> {
    if value == "sim" {
        return Ok(Backend::Sim);
    }
    let wrong = || Trouble::new(name, format!("expected sim or gpio:CHIP:LINE, found {value:?}"));
    let rest = value.strip_prefix("gpio:").ok_or_else(wrong)?;
    let (chip, line) = rest.rsplit_once(':').ok_or_else(wrong)?;
    let line = line.parse().map_err(|_| wrong())?;
    let chip = if chip.starts_with('/') { chip.into() } else { PathBuf::from("/dev").join(chip) };
    Ok(Backend::Gpio { chip, line })
}

fn fsoe(name: &str, address: &str, session: &str, sra: bool) -> Result<Bus, Trouble> {
    let address = number(name, address, 1, u16::MAX)?;
    Ok(Bus::Fsoe { address, session_id: number(name, session, 0, u16::MAX)?, sra })
}

/// `AXIS=fsoe:ADDRESS:SESSION`, `:sra` behind it where the master sends the SRA CRC, or `AXIS=profisafe:ADDRESS`.
fn bus(name: &str, value: &str) -> Result<(u8, Bus), Trouble> {
    let parts: Vec<&str> = value.split(['=', ':']).collect();
    let (axis, bus) = match parts[..] {
        [axis, "fsoe", address, session] => (axis, fsoe(name, address, session, false)?),
        [axis, "fsoe", address, session, "sra"] => (axis, fsoe(name, address, session, true)?),
        [axis, "profisafe", address] => (axis, Bus::Profisafe { address: number(name, address, 1, 65_534)? }),
        _ => {
            let wanted = "AXIS=fsoe:ADDRESS:SESSION[:sra] or AXIS=profisafe:ADDRESS";
            return Err(Trouble::new(name, format!("expected {wanted}, found {value:?}")));
        }
    };
    Ok((number(name, axis, 1, 64)?, bus))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEEDED: [&str; 10] =
        ["--domain", "/d", "--prefix", "p", "--nonce", "7", "--axes", "1,2", "--images", "/i"];

    fn parse(more: &[&str]) -> Result<Options, Trouble> {
        Options::parse(NEEDED.iter().chain(more).map(|text| (*text).to_owned()))
    }

    #[test]
    fn the_needed_options_are_enough_and_each_is_needed() {
        let options = parse(&[]).expect("complete");
        assert_eq!((options.axes, options.cycle_ns, options.backend), (vec![1, 2], 1_000_000, Backend::Sim));
        for left_out in 0..5 {
            let rest =
                NEEDED.chunks(2).enumerate().filter(|(at, _)| *at != left_out).flat_map(|(_, pair)| pair);
            assert!(Options::parse(rest.map(|text| (*text).to_owned())).is_err());
        }
    }

    #[test]
    fn a_value_out_of_range_and_an_unknown_option_are_refused() {
        for wrong in [
            ["--cycle-us", "124"],
            ["--cycle-us", "4001"],
            ["--priority", "0"],
            ["--what", "1"],
            ["--age-factor", "11"],
        ] {
            assert!(parse(&wrong).is_err(), "{wrong:?}");
        }
        assert!(parse(&["--cpu"]).is_err());
    }

    /// Architecture, "Processes".
    #[test]
    fn a_bus_is_named_for_an_axis_in_use() {
        let options = parse(&["--bus", "1=fsoe:513:47872:sra,2=profisafe:7"]).expect("complete");
        let fsoe = Bus::Fsoe { address: 513, session_id: 47_872, sra: true };
        assert_eq!(options.buses, [(1, fsoe), (2, Bus::Profisafe { address: 7 })]);
        for wrong in ["3=profisafe:7", "1=profisafe:65535", "1=fsoe:0:1", "1=fsoe:1", "1:fsoe", ""] {
            assert!(parse(&["--bus", wrong]).is_err(), "{wrong:?}");
        }
    }

    /// Design 3.4: a GPIO path needs a stated evaluator and no unprotected command.
    #[test]
    fn a_gpio_path_needs_an_evaluator_one_axis_and_protected_commands() {
        let gpio = ["--axes", "1", "--inhibit", "gpio:gpiochip0:4"];
        assert!(parse(&gpio).is_err());
        let stated = [&gpio[..], &["--evaluator", "charge pump"]].concat();
        let chip = PathBuf::from("/dev/gpiochip0");
        assert_eq!(parse(&stated).expect("complete").backend, Backend::Gpio { chip, line: 4 });
        assert!(parse(&[&stated[..], &["--plain-command", "yes"]].concat()).is_err());
        assert!(parse(&[&stated[..], &["--axes", "1,2"]].concat()).is_err());
        // Architecture, "Timing": the relaxed timing is for simulation.
        assert!(parse(&[&stated[..], &["--age-factor", "10"]].concat()).is_err());
        assert_eq!(parse(&["--age-factor", "10"]).expect("complete").age_factor, 10);
    }
}
