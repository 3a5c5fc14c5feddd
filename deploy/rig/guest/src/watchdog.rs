//! The watchdog's bite, and what the restart says about it. Two boots of one machine: the first
//! hangs with torque on, the second finds why it was started.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::os::fd::AsRawFd;
use std::os::unix::fs::FileExt;
use std::process::Command;
use std::thread;
use std::time::Duration;

use producers::clock::{now_ns, prepare};

use crate::chip::Chip;
use crate::set::Set;
use crate::verdict::Verdict;

const DEVICE: &str = "/dev/watchdog0";
const SYSFS: &str = "/sys/class/watchdog/watchdog0";
/// `WDIOF_CARDRESET`: the watchdog was the cause of the last start.
const CARD_RESET: u32 = 0x20;
const TIMEOUT_S: libc::c_int = 2;
/// The feeder's period: the newest feed before the hang is not two of them old.
const FEED: Duration = Duration::from_millis(500);
/// What the firmware may take between the reset and the kernel's first instruction, ns.
const FIRMWARE_NS: u64 = 500_000_000;
/// Memory of the real-time clock, which survives a reset; a place in it that no firmware uses.
const MEMORY: &str = "/sys/bus/nvmem/devices/cmos_nvram0/nvmem";
const PLACE: u64 = 50;

nix::ioctl_readwrite!(set_timeout, b'W', 6, libc::c_int);

/// One job, two boots.
pub fn run(chip: &Chip, verdict: &mut Verdict) -> Result<(), String> {
    let text = fs::read_to_string(format!("{SYSFS}/bootstatus")).map_err(|error| error.to_string())?;
    let status: u32 = text.trim().parse().map_err(|_| format!("bootstatus {text:?}"))?;
    if status & CARD_RESET == 0 { hang(chip) } else { restarted(chip, verdict, status) }
}

/// First boot: never returns.
fn hang(chip: &Chip) -> Result<(), String> {
    let mut device =
        OpenOptions::new().write(true).open(DEVICE).map_err(|error| format!("{DEVICE}: {error}"))?;
    let mut timeout_s = TIMEOUT_S;
    // SAFETY: the number lives over the call, and the kernel reads and writes one of that size.
    unsafe { set_timeout(device.as_raw_fd(), &raw mut timeout_s) }.map_err(|error| error.to_string())?;
    thread::spawn(move || {
        prepare(None, Some(50));
        loop {
            let _ = device.write_all(b"1");
            thread::sleep(FEED);
        }
    });
    let set = Set::start(chip)?;
    set.energise()?;
    Verdict::note(format!("first boot: torque on, watchdog of {timeout_s} s fed; the machine hangs now"));
    prepare(None, Some(99));
    memory()?.write_all_at(&ticks().to_le_bytes(), PLACE).map_err(|error| format!("{MEMORY}: {error}"))?;
    // No pause instruction: the emulator leaves its translated code for each.
    let mut turns = 0_u64;
    loop {
        turns = std::hint::black_box(turns.wrapping_add(1));
    }
}

/// Second boot.
fn restarted(chip: &Chip, verdict: &mut Verdict, status: u32) -> Result<(), String> {
    let after_ns = hung_for()?;
    let least_ns = TIMEOUT_S as u64 * 1_000_000_000 - 2 * FEED.as_nanos() as u64;
    let most_ns = TIMEOUT_S as u64 * 1_000_000_000 + FIRMWARE_NS;
    verdict.check(
        (least_ns..=most_ns).contains(&after_ns),
        format!(
            "the watchdog bit {} ms after the machine hung (bounds {} to {}), bootstatus {status:#x}",
            after_ns / 1_000_000,
            least_ns / 1_000_000,
            most_ns / 1_000_000
        ),
    );
    let doctor = Command::new("/safepair/safepair").args(["doctor", "--json"]).output();
    let doctor = doctor.map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&doctor.stdout);
    let line = text.lines().find(|line| line.contains("bootstatus"));
    verdict.check(line.is_some_and(|line| line.contains("watchdog")), format!("doctor: {line:?}"));
    let set = Set::start(chip)?;
    verdict.check(set.awaits_acknowledge(), "the next start waits for an acknowledge");
    thread::sleep(Duration::from_millis(300));
    let torque = set.seen(|seen| seen.torque) == Some(true);
    verdict.check(!torque, "no torque by itself after the bite");
    Ok(())
}

fn memory() -> Result<File, String> {
    OpenOptions::new().read(true).write(true).open(MEMORY).map_err(|error| format!("{MEMORY}: {error}"))
}

/// From the hang of the boot before to the start of this one's kernel, ns.
fn hung_for() -> Result<u64, String> {
    let mut octets = [0; 8];
    memory()?.read_exact_at(&mut octets, PLACE).map_err(|error| format!("{MEMORY}: {error}"))?;
    Ok(ticks().saturating_sub(now_ns()).saturating_sub(u64::from_le_bytes(octets)))
}

/// The processor's own count: 1 ns each here, and no reset touches it.
#[cfg(target_arch = "x86_64")]
fn ticks() -> u64 {
    // SAFETY: every processor of this architecture has the instruction.
    unsafe { std::arch::x86_64::_rdtsc() }
}

#[cfg(not(target_arch = "x86_64"))]
const fn ticks() -> u64 {
    // The machine of the rig is of that architecture; elsewhere this is compiled only.
    0
}
