//! Machines made of files: each check sees the good one as fit and misses what is taken away.

use std::fs;
use std::path::PathBuf;

use super::host::Host;
use super::{Finding, Judgement, examine};

/// A machine with everything: cores 2 and 3 isolated, and a thread of the kernel on one.
const GOOD: [(&str, &str); 15] = [
    ("proc/version", "Linux version 6.1.0-56-rt-amd64 #1 SMP PREEMPT_RT"),
    ("sys/devices/system/cpu/isolated", "2-3"),
    ("sys/devices/system/cpu/nohz_full", "2-3"),
    ("proc/self/limits", "Max locked memory unlimited unlimited bytes\nMax realtime priority 95 95"),
    ("proc/self/status", "Uid:\t100\t100\t100\t100\nCapEff:\t0000000000000000"),
    ("proc/sys/kernel/sched_rt_runtime_us", "-1"),
    ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc"),
    ("sys/devices/system/cpu/cpu2/cpufreq/scaling_governor", "performance"),
    (
        "proc/9/task/9/stat",
        "9 (ksoftirqd/3) S 2 0 0 0 -1 69238848 0 0 0 0 0 0 0 0 20 0 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 3 0 0",
    ),
    ("proc/irq/4/effective_affinity_list", "0"),
    ("proc/stat", "cpu  1 2 3 4 5 6 7 0 0 0"),
    ("proc/cpuinfo", "flags : fpu tsc"),
    ("sys/class/watchdog/watchdog0/identity", "iTCO_wdt"),
    ("sys/class/watchdog/watchdog0/state", "active"),
    ("sys/class/watchdog/watchdog0/bootstatus", "0"),
];

/// A machine below a temporary folder.
struct Machine(PathBuf);

impl Machine {
    fn new(name: &str) -> Self {
        let root = std::env::temp_dir().join(format!("safepair-doctor-{name}-{}", std::process::id()));
        let machine = Self(root);
        GOOD.iter().for_each(|(path, text)| machine.write(path, text));
        fs::create_dir_all(machine.0.join("dev/shm")).expect("a folder");
        machine
    }

    fn write(&self, path: &str, text: &str) {
        let path = self.0.join(path);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, format!("{text}\n")).expect("a file");
    }

    fn findings(&self, about: &str) -> Vec<Finding> {
        let all = examine(&Host::new(&self.0, [2, 3]), &[]);
        all.into_iter().filter(|finding| finding.about == about).collect()
    }

    fn falls_short(&self, about: &str) -> bool {
        self.findings(about).iter().any(|finding| finding.judgement == Judgement::Short)
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_machine_with_everything_is_fit() {
    let machine = Machine::new("good");
    let all = examine(&Host::new(&machine.0, [2, 3]), &[]);
    let short: Vec<_> = all.iter().filter(|finding| finding.judgement == Judgement::Short).collect();
    // The disk under the temporary folder stands for /dev/shm, and may be full.
    assert!(short.iter().all(|finding| finding.about == "shared memory"), "{short:?}");
}

#[test]
fn everything_that_is_taken_away_is_missed() {
    let worse = [
        ("kernel", "proc/version", "Linux version 6.1.0-48-amd64 #1 SMP PREEMPT_DYNAMIC"),
        ("isolation", "sys/devices/system/cpu/isolated", "3"),
        ("priority", "proc/self/limits", "Max locked memory unlimited\nMax realtime priority 80 80"),
        ("memory lock", "proc/self/limits", "Max locked memory 8388608\nMax realtime priority 95 95"),
        ("throttling", "proc/sys/kernel/sched_rt_runtime_us", "950000"),
        ("clock source", "sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet"),
        ("frequency", "sys/devices/system/cpu/cpu2/cpufreq/scaling_governor", "powersave"),
        ("hypervisor", "proc/stat", "cpu  1 2 3 4 5 6 7 80 0 0"),
        ("hypervisor", "proc/cpuinfo", "flags : fpu tsc hypervisor"),
        ("watchdog", "sys/class/watchdog/watchdog0/state", "inactive"),
        ("RemoveIPC", "proc/self/status", "Uid:\t1000\t1000\t1000\t1000\nCapEff:\t0"),
        (
            "other threads",
            "proc/9/task/9/stat",
            "9 (bash) S 2 0 0 0 -1 4194304 0 0 0 0 0 0 0 0 20 0 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 3 0 0",
        ),
    ];
    for (about, path, text) in worse {
        let machine = Machine::new("worse");
        assert!(!machine.falls_short(about), "{about}: fit before");
        machine.write(path, text);
        assert!(machine.falls_short(about), "{about}: {text}");
    }
}

#[test]
fn a_capability_stands_for_the_limits_it_lifts() {
    let machine = Machine::new("capable");
    machine.write("proc/self/limits", "Max locked memory 0 0 bytes\nMax realtime priority 0 0");
    assert!(machine.falls_short("priority") & machine.falls_short("memory lock"));
    machine.write("proc/self/status", "Uid:\t0\t0\t0\t0\nCapEff:\t0000000000804000");
    assert!(!machine.falls_short("priority") & !machine.falls_short("memory lock"));
}

#[test]
fn a_bite_of_the_watchdog_is_told_after_the_restart() {
    let machine = Machine::new("bitten");
    machine.write("sys/class/watchdog/watchdog0/bootstatus", "32");
    let told = machine.findings("watchdog").into_iter().find(|finding| finding.read.contains("bootstatus"));
    assert_eq!(told.map(|finding| finding.judgement), Some(Judgement::Note));
}

#[test]
fn logind_is_told_to_leave_shared_memory_alone() {
    let machine = Machine::new("logind");
    machine.write("proc/self/status", "Uid:\t1000\t1000\t1000\t1000\nCapEff:\t0");
    machine.write("etc/systemd/logind.conf.d/50-safepair-logind.conf", "[Login]\nRemoveIPC=no");
    assert!(!machine.falls_short("RemoveIPC"));
}

#[test]
fn the_assumptions_of_use_are_named_and_judge_nothing() {
    let machine = Machine::new("assumed");
    let assumed = machine.findings("assumption of use");
    assert!(assumed.len() >= 4);
    assert!(assumed.iter().all(|finding| finding.judgement == Judgement::Assumption));
    assert!(assumed.iter().any(|finding| finding.read.contains("one producer")));
}
