//! What the kernel shows of this machine, below a root that tests can put elsewhere.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

/// A machine.
#[derive(Debug, Clone)]
pub struct Host {
    root: PathBuf,
    /// Cores of channel A, channel B and crosscheck.
    pub cores: BTreeSet<usize>,
}

/// A thread as the scheduler has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Thread {
    /// Name of its process or thread.
    pub name: String,
    /// Core it ran on last.
    pub core: usize,
    /// One of the kernel's own.
    pub kernel: bool,
}

/// `PF_KTHREAD` of the kernel's `sched.h`.
const KERNEL_THREAD: u64 = 0x0020_0000;

impl Host {
    /// The machine below `root`, with the cores the monitors shall have.
    pub fn new(root: impl Into<PathBuf>, cores: impl IntoIterator<Item = usize>) -> Self {
        Self { root: root.into(), cores: cores.into_iter().collect() }
    }

    /// A file of the machine, without the blanks around; `None` when it cannot be read.
    pub fn read(&self, path: &str) -> Option<String> {
        let text = fs::read_to_string(self.root.join(path.trim_start_matches('/'))).ok()?;
        Some(text.trim().trim_matches('\0').to_owned())
    }

    /// Names in a folder, sorted.
    pub fn list(&self, path: &str) -> Vec<String> {
        let entries = fs::read_dir(self.root.join(path.trim_start_matches('/')));
        let names = entries.into_iter().flatten().flatten();
        let mut names: Vec<String> = names.map(|entry| entry.file_name().to_string_lossy().into()).collect();
        names.sort();
        names
    }

    /// The value of `name` in a file of `name: value` lines.
    pub fn field(&self, path: &str, name: &str) -> Option<String> {
        let text = self.read(path)?;
        let line = text.lines().find_map(|line| line.strip_prefix(name))?;
        Some(line.trim_start_matches(':').trim().to_owned())
    }

    /// Free octets of the file system at `path`.
    pub fn free(&self, path: &str) -> Option<u64> {
        let found = nix::sys::statvfs::statvfs(&self.root.join(path.trim_start_matches('/'))).ok()?;
        Some(found.blocks_available() * found.fragment_size())
    }

    /// The monitors' cores, for a person.
    pub fn cores_text(&self) -> String {
        let cores: Vec<String> = self.cores.iter().map(ToString::to_string).collect();
        if cores.is_empty() { "none".into() } else { cores.join(",") }
    }

    /// Monitors' cores that a kernel list such as `1,3-5` does not name.
    pub fn cores_missing_in(&self, list: &str) -> Vec<usize> {
        let named = cores(list);
        self.cores.iter().copied().filter(|core| !named.contains(core)).collect()
    }

    /// Every thread that is not of safepair.
    pub fn threads(&self) -> Vec<Thread> {
        let processes = self.list("/proc").into_iter().filter(|name| name.parse::<u32>().is_ok());
        let each = processes.flat_map(|process| {
            let folder = format!("/proc/{process}/task");
            self.list(&folder).into_iter().map(move |task| format!("{folder}/{task}/stat"))
        });
        let each: Vec<String> = each.collect();
        let threads = each.iter().filter_map(|path| thread(&self.read(path)?));
        threads.filter(|thread| !thread.name.starts_with("safepair")).collect()
    }
}

/// Cores of a kernel list.
pub fn cores(list: &str) -> BTreeSet<usize> {
    let part = |part: &str| -> Option<std::ops::RangeInclusive<usize>> {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
    };
    list.split(',').filter_map(part).flatten().collect()
}

/// One line of `/proc/PID/task/TID/stat`: the name stands in brackets and may hold anything.
fn thread(line: &str) -> Option<Thread> {
    let (before, behind) = line.rsplit_once(')')?;
    let name = before.split_once('(')?.1.to_owned();
    let fields: Vec<&str> = behind.split_whitespace().collect();
    // Fields 9 (flags) and 39 (processor) of proc(5); the first behind the name is 3.
    let flags: u64 = fields.get(6)?.parse().ok()?;
    let core = fields.get(36)?.parse().ok()?;
    Some(Thread { name, core, kernel: flags & KERNEL_THREAD != 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_cores_are_read_as_the_kernel_writes_them() {
        assert_eq!(cores("1,3-5"), BTreeSet::from([1, 3, 4, 5]));
        assert_eq!(cores(""), BTreeSet::new());
        assert_eq!(Host::new("/", [2, 3]).cores_missing_in("0,3"), [2]);
    }

    #[test]
    fn a_thread_is_read_whatever_its_name_is() {
        let mut fields = vec!["0"; 40];
        (fields[0], fields[6], fields[36]) = ("S", "2097216", "3");
        let line = format!("17 (a) b (c) {}", fields.join(" "));
        let expected = Thread { name: "a) b (c".into(), core: 3, kernel: true };
        assert_eq!(thread(&line), Some(expected));
    }
}
