//! The options every process of a set takes (docs/architecture.md), and what ends it.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::{FromRawFd, OwnedFd, RawFd};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::cells::Place;

/// What a producer is told.
#[derive(Debug)]
pub struct Options {
    /// The domain.
    pub place: Place,
    /// Cycle, ns.
    pub cycle_ns: u64,
    /// Wake-up inside the cycle, ns.
    pub phase_ns: u64,
    /// The axis.
    pub axis: u8,
    /// Core.
    pub cpu: Option<usize>,
    /// SCHED_FIFO priority.
    pub priority: Option<i32>,
    /// Every other option of this producer, with its value.
    pub own: Vec<(String, String)>,
    supervisor: Option<RawFd>,
    ready: Option<RawFd>,
}

fn number<T: FromStr + PartialOrd>(name: &str, value: &str, least: T, most: T) -> Result<T, String> {
    let number = value.parse().ok().filter(|number| (*number >= least) & (*number <= most));
    number.ok_or_else(|| format!("{name} {value}: a number in its range expected"))
}

impl Options {
    /// Reads pairs of `--name value`; `own` names the options of this producer.
    ///
    /// # Errors
    /// One line: what was found, what is expected.
    pub fn parse(mut words: impl Iterator<Item = String>, own: &[&str]) -> Result<Self, String> {
        let mut options = Self {
            place: Place { domain: PathBuf::new(), prefix: String::new(), nonce: 0 },
            cycle_ns: 1_000_000,
            phase_ns: 0,
            axis: 1,
            cpu: None,
            priority: None,
            own: Vec::new(),
            supervisor: None,
            ready: None,
        };
        while let Some(name) = words.next() {
            let value = words.next().ok_or_else(|| format!("{name}: expected a value"))?;
            options.take(name, value, own)?;
        }
        let nowhere = options.place.domain.as_os_str().is_empty() | options.place.prefix.is_empty();
        if nowhere | (options.place.nonce == 0) {
            return Err("--domain, --prefix and --nonce: are required".into());
        }
        Ok(options)
    }

    fn take(&mut self, name: String, value: String, own: &[&str]) -> Result<(), String> {
        match name.as_str() {
            "--domain" => self.place.domain = value.into(),
            "--prefix" => self.place.prefix = value,
            "--nonce" => self.place.nonce = number(&name, &value, 1, u32::MAX)?,
            "--cycle-us" => self.cycle_ns = number(&name, &value, 125, 4_000)? * 1_000,
            "--phase-us" => self.phase_ns = number(&name, &value, 0, 4_000)? * 1_000,
            "--axis" => self.axis = number(&name, &value, 1, 64)?,
            "--cpu" => self.cpu = Some(number(&name, &value, 0, 1_023)?),
            "--priority" => self.priority = Some(number(&name, &value, 1, 99)?),
            "--supervisor-fd" => self.supervisor = Some(number(&name, &value, 3, RawFd::MAX)?),
            "--ready-fd" => self.ready = Some(number(&name, &value, 3, RawFd::MAX)?),
            // Inherited and kept open until exit; nothing is done with it.
            "--lock-fd" => drop(number(&name, &value, 3, RawFd::MAX)?),
            known if own.contains(&known) => self.own.push((name, value)),
            _ => return Err(format!("{name}: not an option of this producer")),
        }
        Ok(())
    }

    /// Every value of the own option `name`.
    pub fn each<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a str> {
        self.own.iter().filter(move |(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// Says that the cycle starts. To be called once.
    pub fn ready(&mut self) {
        if let Some(fd) = self.ready.take() {
            // SAFETY: the descriptor was passed to this process for this purpose; taken once.
            let mut pipe = File::from(unsafe { OwnedFd::from_raw_fd(fd) });
            // A supervisor that does not hear it ends the set by itself.
            let _ = pipe.write_all(b"R");
        }
    }

    /// A flag that SIGTERM, SIGINT and the end of the supervisor set. To be called once.
    pub fn ending(&mut self) -> Arc<AtomicBool> {
        let wanted = Arc::new(AtomicBool::new(false));
        for signal in [libc::SIGTERM, libc::SIGINT] {
            // Cannot fail for these two; without it the signal would just end the process.
            let _ = signal_hook::flag::register(signal, Arc::clone(&wanted));
        }
        if let Some(fd) = self.supervisor.take() {
            // SAFETY: as above.
            let mut pipe = File::from(unsafe { OwnedFd::from_raw_fd(fd) });
            let flag = Arc::clone(&wanted);
            std::thread::spawn(move || {
                let mut octets = [0; 64];
                while pipe.read(&mut octets).is_ok_and(|length| length > 0) {}
                flag.store(true, Ordering::Release);
            });
        }
        wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Options, String> {
        Options::parse(text.split_whitespace().map(ToOwned::to_owned), &["--line"])
    }

    #[test]
    fn common_and_own_options_are_read() {
        let options =
            parse("--domain /d --prefix p --nonce 7 --cycle-us 250 --axis 3 --line ais=1 --line aie=2");
        let options = options.expect("sound");
        assert_eq!((options.cycle_ns, options.axis, options.place.nonce), (250_000, 3, 7));
        assert_eq!(options.each("--line").collect::<Vec<_>>(), ["ais=1", "aie=2"]);
    }

    #[test]
    fn what_is_missing_or_unknown_is_named() {
        for wrong in ["", "--domain /d --prefix p --nonce 0", "--domain", "--domain /d --what 1"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
