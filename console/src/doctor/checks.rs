//! What a machine needs, one check each: what was read, what is expected, how to fix it.
//! Unreadable is not fit: torque off is the answer to every doubt.

use super::host::{Host, cores};
use super::{Finding, Judgement};

type Check = fn(&Host) -> Vec<Finding>;

/// All checks that need nothing but files, in the order in which they are shown.
pub const CHECKS: [(&str, Check); 16] = [
    ("kernel", kernel),
    ("isolation", isolation),
    ("tick", tick),
    ("priority", priority),
    ("memory lock", memory_lock),
    ("throttling", throttling),
    ("clock source", clock_source),
    ("frequency", frequency),
    ("siblings", siblings),
    ("other threads", other_threads),
    ("interrupts", interrupts),
    ("hypervisor", hypervisor),
    ("counter", counter),
    ("watchdog", watchdog),
    ("shared memory", shared_memory),
    ("RemoveIPC", remove_ipc),
];

/// Capabilities of capabilities(7), as bit numbers.
const IPC_LOCK: u32 = 14;
const SYS_NICE: u32 = 23;
/// SCHED_FIFO priorities a set takes: 80, and the producer above.
const PRIORITY_NEEDED: u64 = 81;
/// Shared memory for 64 axes with room to spare, octets.
const SHARED_NEEDED: u64 = 64 << 20;
/// `WDIOF_CARDRESET`: the watchdog caused the last start.
const CARD_RESET: u32 = 0x20;

fn one(judgement: Judgement, read: impl Into<String>, expected: &str, fix: &str) -> Vec<Finding> {
    vec![Finding::new(judgement, read, expected, fix)]
}

fn fit_if(fit: bool) -> Judgement {
    if fit { Judgement::Fit } else { Judgement::Short }
}

fn kernel(host: &Host) -> Vec<Finding> {
    let version = host.read("/proc/version").unwrap_or_else(|| "unreadable".into());
    let realtime = host.read("/sys/kernel/realtime").is_some_and(|text| text == "1");
    let named = version.contains("PREEMPT_RT");
    one(
        fit_if(realtime | named),
        version,
        "a PREEMPT_RT kernel",
        "apt-get install linux-image-rt-amd64, and boot it",
    )
}

fn isolation(host: &Host) -> Vec<Finding> {
    let read = host.read("/sys/devices/system/cpu/isolated").unwrap_or_default();
    let missing = host.cores_missing_in(&read);
    let fit = missing.is_empty() & !host.cores.is_empty();
    let expected = format!("the monitors' cores {} isolated", host.cores_text());
    one(
        fit_if(fit),
        format!("isolated {read:?}"),
        &expected,
        "isolcpus=managed_irq,domain,CORES (kernel/command-line.md), --cpus of the set to match",
    )
}

fn tick(host: &Host) -> Vec<Finding> {
    let read = host.read("/sys/devices/system/cpu/nohz_full").unwrap_or_default();
    let fit = host.cores_missing_in(&read).is_empty();
    let judgement = if fit { Judgement::Fit } else { Judgement::Note };
    one(
        judgement,
        format!("nohz_full {read:?}"),
        "no tick on the monitors' cores",
        "nohz_full=CORES rcu_nocbs=CORES",
    )
}

fn capability(host: &Host, bit: u32) -> bool {
    let mask = host.field("/proc/self/status", "CapEff").unwrap_or_default();
    u64::from_str_radix(&mask, 16).is_ok_and(|mask| mask >> bit & 1 == 1)
}

/// The soft limit of `name`; `None`: unlimited.
fn limit(host: &Host, name: &str) -> Option<u64> {
    let row = host.field("/proc/self/limits", name).unwrap_or_default();
    let soft = row.split_whitespace().next().unwrap_or("0").to_owned();
    if soft == "unlimited" { None } else { Some(soft.parse().unwrap_or(0)) }
}

fn priority(host: &Host) -> Vec<Finding> {
    let soft = limit(host, "Max realtime priority");
    let privileged = capability(host, SYS_NICE);
    let fit = privileged | soft.is_none_or(|soft| soft >= PRIORITY_NEEDED);
    let read =
        format!("limit {}, CAP_SYS_NICE {privileged}", soft.map_or("none".into(), |soft| soft.to_string()));
    one(fit_if(fit), read, "SCHED_FIFO up to 81", "LimitRTPRIO=95 in the service, or limits.conf: rtprio 95")
}

fn memory_lock(host: &Host) -> Vec<Finding> {
    let soft = limit(host, "Max locked memory");
    let privileged = capability(host, IPC_LOCK);
    let fit = privileged | soft.is_none();
    let read =
        format!("limit {}, CAP_IPC_LOCK {privileged}", soft.map_or("none".into(), |soft| soft.to_string()));
    one(
        fit_if(fit),
        read,
        "memory may be locked without limit",
        "LimitMEMLOCK=infinity in the service, or limits.conf: memlock unlimited",
    )
}

fn throttling(host: &Host) -> Vec<Finding> {
    let read = host.read("/proc/sys/kernel/sched_rt_runtime_us").unwrap_or_default();
    one(
        fit_if(read == "-1"),
        format!("sched_rt_runtime_us {read:?}"),
        "-1: SCHED_FIFO is never throttled",
        "sysctl -w kernel.sched_rt_runtime_us=-1 (kernel/90-safepair.conf)",
    )
}

fn clock_source(host: &Host) -> Vec<Finding> {
    let folder = "/sys/devices/system/clocksource/clocksource0";
    let read = host.read(&format!("{folder}/current_clocksource")).unwrap_or_default();
    let good = ["tsc", "arch_sys_counter"].contains(&read.as_str());
    let others = host.read(&format!("{folder}/available_clocksource")).unwrap_or_default();
    one(
        fit_if(good),
        format!("{read:?} of {others:?}"),
        "tsc or arch_sys_counter: read without a call to the system",
        "clocksource=tsc, where the counter is invariant",
    )
}

fn frequency(host: &Host) -> Vec<Finding> {
    let each = host.cores.iter().map(|core| {
        let path = format!("/sys/devices/system/cpu/cpu{core}/cpufreq/scaling_governor");
        (core, host.read(&path))
    });
    let wrong: Vec<String> = each
        .filter_map(|(core, governor)| Some((core, governor.filter(|name| name != "performance")?)))
        .map(|(core, name)| format!("core {core}: {name}"))
        .collect();
    let read = if wrong.is_empty() { "performance, or no scaling".into() } else { wrong.join(", ") };
    one(
        fit_if(wrong.is_empty()),
        read,
        "governor performance on the monitors' cores",
        "cpufreq.default_governor=performance",
    )
}

fn siblings(host: &Host) -> Vec<Finding> {
    let shared: Vec<String> = host
        .cores
        .iter()
        .filter_map(|core| {
            let list =
                host.read(&format!("/sys/devices/system/cpu/cpu{core}/topology/thread_siblings_list"))?;
            (cores(&list).len() > 1).then(|| format!("core {core} is one of {list}"))
        })
        .collect();
    let read = if shared.is_empty() { "none".into() } else { shared.join(", ") };
    let judgement = if shared.is_empty() { Judgement::Fit } else { Judgement::Note };
    one(
        judgement,
        read,
        "no other hardware thread on the monitors' cores",
        "nosmt, or leave the sibling idle and isolated too",
    )
}

fn other_threads(host: &Host) -> Vec<Finding> {
    let threads = host.threads();
    let here = threads.iter().filter(|thread| host.cores.contains(&thread.core) & !thread.kernel);
    let mut names: Vec<&str> = here.map(|thread| thread.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let read = if names.is_empty() {
        "none".into()
    } else {
        format!("{} kinds: {}", names.len(), shortened(&names))
    };
    let fit = names.is_empty() & !threads.is_empty();
    one(
        fit_if(fit),
        read,
        "no thread of others on the monitors' cores",
        "isolate the cores; AffinityMask or CPUAffinity for what is left",
    )
}

fn interrupts(host: &Host) -> Vec<Finding> {
    let numbers = host.list("/proc/irq").into_iter().filter(|name| name.parse::<u32>().is_ok());
    let here = numbers.filter(|number| {
        let list = host.read(&format!("/proc/irq/{number}/effective_affinity_list")).unwrap_or_default();
        !host.cores.is_disjoint(&cores(&list))
    });
    let here: Vec<String> = here.collect();
    let read = if here.is_empty() { "none".into() } else { format!("interrupts {}", here.join(",")) };
    let judgement = if here.is_empty() { Judgement::Fit } else { Judgement::Note };
    one(
        judgement,
        read,
        "no interrupt on the monitors' cores but that of their safe inputs",
        "irqaffinity=OTHERS, or /proc/irq/N/smp_affinity_list",
    )
}

fn hypervisor(host: &Host) -> Vec<Finding> {
    let flagged = host.read("/proc/cpuinfo").is_some_and(|text| text.contains(" hypervisor"));
    let line = host.field("/proc/stat", "cpu ").unwrap_or_default();
    let steal = line.split_whitespace().nth(7).unwrap_or("0").to_owned();
    let read = format!("hypervisor {flagged}, {steal} ticks stolen since the start");
    one(
        fit_if(!flagged & (steal == "0")),
        read,
        "no hypervisor: nobody takes the processor unseen",
        "run on the machine itself; a virtual one is for simulation only",
    )
}

fn counter(host: &Host) -> Vec<Finding> {
    let names = host.list("/sys/bus/counter/devices");
    let read = if names.is_empty() { "no counter".into() } else { names.join(", ") };
    one(
        Judgement::Note,
        read,
        "a counter, where the encoder is read through the kernel",
        "the driver of the counter; safepair-counter-producer",
    )
}

fn watchdog(host: &Host) -> Vec<Finding> {
    let folder = "/sys/class/watchdog";
    let names = host.list(folder);
    if names.is_empty() {
        return one(
            Judgement::Short,
            "no watchdog",
            "a hardware watchdog",
            "load its driver (softdog is none: it hangs with the kernel)",
        );
    }
    names.iter().flat_map(|name| one_watchdog(host, &format!("{folder}/{name}"), name)).collect()
}

fn one_watchdog(host: &Host, folder: &str, name: &str) -> Vec<Finding> {
    let field = |field: &str| host.read(&format!("{folder}/{field}")).unwrap_or_default();
    let (identity, state, boot) = (field("identity"), field("state"), field("bootstatus"));
    let software = identity.contains("Software");
    let fed = if software { Judgement::Note } else { fit_if(state == "active") };
    let mut found = one(
        fed,
        format!("watchdog {name}: {identity:?}, {state}"),
        "a hardware watchdog, active",
        "RuntimeWatchdogSec=10s in system.conf (systemd/50-safepair-watchdog.conf)",
    );
    let bitten = boot.parse::<u32>().is_ok_and(|boot| boot & CARD_RESET != 0);
    if bitten {
        found.extend(one(
            Judgement::Note,
            format!("watchdog {name}: bootstatus {boot}: it caused the last start"),
            "a start that somebody asked for",
            "find out why the machine hung before it runs again: journalctl -b -1",
        ));
    }
    found
}

fn shared_memory(host: &Host) -> Vec<Finding> {
    let octets = host.free("/dev/shm");
    let read = octets.map_or("unreadable".into(), |octets| format!("{} MiB free", octets >> 20));
    let fit = octets.is_some_and(|octets| octets >= SHARED_NEEDED);
    one(fit_if(fit), read, "64 MiB free in /dev/shm", "mount -o remount,size=256M /dev/shm")
}

fn remove_ipc(host: &Host) -> Vec<Finding> {
    let user = host.field("/proc/self/status", "Uid").unwrap_or_default();
    let user: u32 = user.split_whitespace().nth(1).and_then(|uid| uid.parse().ok()).unwrap_or(u32::MAX);
    let mut set = Vec::new();
    for folder in ["/usr/lib/systemd/logind.conf.d", "/etc/systemd/logind.conf.d"] {
        set.extend(
            host.list(folder)
                .into_iter()
                .filter_map(|name| host.field(&format!("{folder}/{name}"), "RemoveIPC=")),
        );
    }
    set.extend(host.field("/etc/systemd/logind.conf", "RemoveIPC="));
    let off = set.iter().any(|value| value == "no");
    // logind leaves the shared memory of system users alone (logind.conf(5)).
    let fit = off | (user < 1_000);
    one(
        fit_if(fit),
        format!("user {user}, RemoveIPC {set:?}"),
        "a system user, or RemoveIPC=no",
        "systemd/50-safepair-logind.conf",
    )
}

fn shortened(names: &[&str]) -> String {
    let more = if names.len() > 8 { ", …" } else { "" };
    format!("{}{more}", names.iter().take(8).copied().collect::<Vec<_>>().join(", "))
}
