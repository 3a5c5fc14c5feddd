//! The watchdog's bite, and what the restart says about it. Two boots of one machine: the first
//! hangs with torque on, the second finds why it was started.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::os::fd::AsRawFd;
use std::process::Command;
use std::thread;
use std::time::Duration;

use producers::clock::prepare;

use crate::chip::Chip;
use crate::set::Set;
use crate::verdict::Verdict;

const DEVICE: &str = "/dev/watchdog0";
const SYSFS: &str = "/sys/class/watchdog/watchdog0";
/// `WDIOF_CARDRESET`: the watchdog was the cause of the last start.
const CARD_RESET: u32 = 0x20;
const TIMEOUT_S: libc::c_int = 2;

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
            thread::sleep(Duration::from_millis(500));
        }
    });
    let set = Set::start(chip)?;
    set.energise()?;
    println!("note first boot: torque on, watchdog of {timeout_s} s fed; the machine hangs now");
    prepare(None, Some(99));
    // No pause instruction: the emulator leaves its translated code for each.
    let mut turns = 0_u64;
    loop {
        turns = std::hint::black_box(turns.wrapping_add(1));
    }
}

/// Second boot.
fn restarted(chip: &Chip, verdict: &mut Verdict, status: u32) -> Result<(), String> {
    verdict.check(true, format!("the watchdog bit: second boot, bootstatus {status:#x}"));
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
