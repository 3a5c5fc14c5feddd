//! The options of docs/architecture.md, which all processes of a set share.

use std::fmt;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::str::FromStr;

/// What the supervisor said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Private root folder of this run.
    pub domain: PathBuf,
    /// iceoryx2 prefix of this run.
    pub prefix: String,
    /// Boot nonce, 1 to 4,294,967,295.
    pub nonce: u32,
    /// Cycle, µs, 125 to 4,000.
    pub cycle_us: u32,
    /// Wake-up inside the cycle, µs.
    pub phase_us: u32,
    /// Axes in use, 1 to 64.
    pub axes: Vec<u8>,
    /// Folder of the safety images.
    pub images: PathBuf,
    /// Core to run on; absent: any.
    pub cpu: Option<usize>,
    /// SCHED_FIFO priority; absent: normal scheduling.
    pub priority: Option<i32>,
    /// Read end of the supervisor's pipe.
    pub supervisor_fd: Option<i32>,
    /// Write `R` here when the cycle starts.
    pub ready_fd: Option<i32>,
    /// Factor on every age: 1 strict, up to 10 relaxed.
    pub age_factor: u8,
    /// File of the logbook; absent: none is kept.
    pub logbook: Option<PathBuf>,
}

/// A wrong option: which, what was given, what was expected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wrong {
    option: String,
    expected: &'static str,
}

impl fmt::Display for Wrong {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: expected {}", self.option, self.expected)
    }
}

fn wrong(option: &str, expected: &'static str) -> Wrong {
    Wrong { option: option.to_owned(), expected }
}

/// What has been read so far.
#[derive(Default)]
struct Draft {
    domain: Option<PathBuf>,
    prefix: Option<String>,
    nonce: Option<u32>,
    cycle_us: Option<u32>,
    phase_us: Option<u32>,
    axes: Option<Vec<u8>>,
    images: Option<PathBuf>,
    cpu: Option<usize>,
    priority: Option<i32>,
    supervisor_fd: Option<i32>,
    ready_fd: Option<i32>,
    age_factor: Option<u8>,
    logbook: Option<PathBuf>,
}

impl Options {
    /// Reads `--name value` pairs.
    ///
    /// # Errors
    /// [`Wrong`] for an option that is unknown, incomplete, out of range or missing.
    pub fn parse(arguments: impl Iterator<Item = String>) -> Result<Self, Wrong> {
        let mut draft = Draft::default();
        let mut arguments = arguments;
        while let Some(name) = arguments.next() {
            let value = arguments.next().ok_or_else(|| wrong(&name, "a value"))?;
            draft.take(&name, &value)?;
        }
        draft.finish()
    }

    /// Cycle, ns.
    pub fn cycle_ns(&self) -> u64 {
        u64::from(self.cycle_us) * 1_000
    }

    /// Wake-up inside the cycle, ns.
    pub fn phase_ns(&self) -> u64 {
        u64::from(self.phase_us) * 1_000
    }
}

impl Draft {
    fn take(&mut self, name: &str, value: &str) -> Result<(), Wrong> {
        match name {
            "--domain" => self.domain = Some(value.into()),
            "--prefix" => self.prefix = Some(value.to_owned()),
            "--nonce" => self.nonce = Some(number(name, value, 1..=u32::MAX, "1 to 4294967295")?),
            "--cycle-us" => self.cycle_us = Some(number(name, value, 125..=4_000, "125 to 4000 µs")?),
            "--phase-us" => self.phase_us = Some(number(name, value, 0..=3_999, "0 to 3999 µs")?),
            "--axes" => self.axes = Some(axes(value)?),
            "--images" => self.images = Some(value.into()),
            "--cpu" => self.cpu = Some(number(name, value, 0..=1_023, "the number of a core")?),
            "--priority" => self.priority = Some(number(name, value, 1..=99, "1 to 99")?),
            "--supervisor-fd" => self.supervisor_fd = Some(descriptor(name, value)?),
            "--ready-fd" => self.ready_fd = Some(descriptor(name, value)?),
            // Held by being open; nothing to do with it but to leave it so.
            "--lock-fd" => drop(descriptor(name, value)?),
            "--age-factor" => self.age_factor = Some(number(name, value, 1..=10, "1 to 10")?),
            "--logbook" => self.logbook = Some(value.into()),
            // All processes of a set take the same options; these concern the channels.
            "--inhibit" | "--evaluator" | "--plain-command" | "--bus" | "--partner-build" => (),
            _ => return Err(wrong(name, "a known option")),
        }
        Ok(())
    }

    fn finish(self) -> Result<Options, Wrong> {
        let options = Options {
            domain: self.domain.ok_or_else(|| wrong("--domain", "a folder"))?,
            prefix: self.prefix.ok_or_else(|| wrong("--prefix", "a text"))?,
            nonce: self.nonce.ok_or_else(|| wrong("--nonce", "1 to 4294967295"))?,
            cycle_us: self.cycle_us.unwrap_or(1_000),
            phase_us: self.phase_us.unwrap_or(0),
            axes: self.axes.ok_or_else(|| wrong("--axes", "numbers of axes"))?,
            images: self.images.ok_or_else(|| wrong("--images", "a folder"))?,
            cpu: self.cpu,
            priority: self.priority,
            supervisor_fd: self.supervisor_fd,
            ready_fd: self.ready_fd,
            age_factor: self.age_factor.unwrap_or(1),
            logbook: self.logbook,
        };
        if options.phase_us >= options.cycle_us {
            return Err(wrong("--phase-us", "less than one cycle"));
        }
        Ok(options)
    }
}

fn number<T>(name: &str, value: &str, range: RangeInclusive<T>, expected: &'static str) -> Result<T, Wrong>
where
    T: FromStr + PartialOrd,
{
    let parsed = value.parse::<T>().map_err(|_| wrong(name, expected))?;
    if range.contains(&parsed) { Ok(parsed) } else { Err(wrong(name, expected)) }
}

fn descriptor(name: &str, value: &str) -> Result<i32, Wrong> {
    number(name, value, 0..=1_048_575, "the number of an open descriptor")
}

fn axes(value: &str) -> Result<Vec<u8>, Wrong> {
    let expected = "different axes, 1 to 64, separated by commas";
    let one = |text: &str| number::<u8>("--axes", text.trim(), 1..=64, expected);
    let mut axes = value.split(',').map(one).collect::<Result<Vec<_>, _>>()?;
    let given = axes.len();
    axes.sort_unstable();
    axes.dedup();
    if axes.len() == given { Ok(axes) } else { Err(wrong("--axes", expected)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FULL: &str = "--domain /d --prefix p --nonce 7 --cycle-us 250 --phase-us 100 --axes 3,1 --images /i \
                        --cpu 2 --priority 80 --lock-fd 5 --supervisor-fd 6 --ready-fd 7 --age-factor 10 --logbook /l";

    fn parse(text: &str) -> Result<Options, Wrong> {
        Options::parse(text.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn every_option_of_the_architecture_is_understood() {
        let options = parse(FULL).expect("right");
        assert_eq!((options.nonce, options.cycle_ns(), options.phase_ns()), (7, 250_000, 100_000));
        assert_eq!(options.axes, [1, 3]);
        assert_eq!((options.cpu, options.priority), (Some(2), Some(80)));
        assert_eq!((options.supervisor_fd, options.ready_fd), (Some(6), Some(7)));
    }

    #[test]
    fn what_is_out_of_range_is_refused_by_name() {
        for (from, to, option) in [
            ("--nonce 7", "--nonce 0", "--nonce"),
            ("--cycle-us 250", "--cycle-us 124", "--cycle-us"),
            ("--cycle-us 250", "--cycle-us 4001", "--cycle-us"),
            ("--phase-us 100", "--phase-us 250", "--phase-us"),
            ("--axes 3,1", "--axes 0", "--axes"),
            ("--axes 3,1", "--axes 65", "--axes"),
            ("--axes 3,1", "--axes 3,3", "--axes"),
            ("--priority 80", "--priority 100", "--priority"),
            ("--domain /d", "", "--domain"),
            ("--age-factor 10", "--age-factor 11", "--age-factor"),
            ("--cpu 2", "--cpus 2", "--cpus"),
            ("--logbook /l", "--logbook", "--logbook"),
        ] {
            assert_eq!(parse(&FULL.replace(from, to)).expect_err(to).option, option);
        }
    }
}
