//! How the process ends: SIGTERM, SIGINT, or the supervisor's death. A thread of its own
//! waits for them, so that the cycle asks one atomic only.

use std::os::fd::RawFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The cycle has this long to switch the path off before the process ends anyway.
const GRACE: Duration = Duration::from_millis(200);

/// The wish to end.
pub struct Ending(Arc<AtomicBool>);

impl Ending {
    /// Blocks the signals in this and all later threads and starts the watcher.
    pub fn watch(supervisor: Option<RawFd>) -> Self {
        let wanted = Arc::new(AtomicBool::new(false));
        let signals = signal_fd();
        let flag = Arc::clone(&wanted);
        std::thread::spawn(move || {
            wait(signals, supervisor.unwrap_or(-1));
            flag.store(true, Ordering::Release);
            std::thread::sleep(GRACE);
            // The cycle did not end: the dead-man of the path does the rest.
            // SAFETY: ends the process; nothing of it is used afterwards.
            unsafe { libc::_exit(0) }
        });
        Self(wanted)
    }

    /// The process has to end.
    pub fn is_wanted(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}

fn signal_fd() -> RawFd {
    // SAFETY: an all-zero sigset_t is valid storage, and the calls only write to it.
    unsafe {
        let mut set: libc::sigset_t = core::mem::zeroed();
        libc::sigemptyset(&raw mut set);
        libc::sigaddset(&raw mut set, libc::SIGTERM);
        libc::sigaddset(&raw mut set, libc::SIGINT);
        libc::pthread_sigmask(libc::SIG_BLOCK, &raw const set, core::ptr::null_mut());
        libc::signalfd(-1, &raw const set, libc::SFD_CLOEXEC)
    }
}

/// Longest silence of a supervisor that has spoken once, ms. A stopped supervisor is as good
/// as a dead one (design 5).
const SILENCE_MS: libc::c_int = 250;

/// Returns when a signal is pending, the supervisor has ended or fallen silent, or waiting
/// itself fails.
fn wait(signals: RawFd, supervisor: RawFd) {
    let poll = |fd| libc::pollfd { fd, events: libc::POLLIN, revents: 0 };
    let mut limit_ms = -1;
    loop {
        let mut watched = [poll(signals), poll(supervisor)];
        // SAFETY: the array lives over the call and its length is passed.
        let found = unsafe { libc::poll(watched.as_mut_ptr(), watched.len() as libc::nfds_t, limit_ms) };
        let interrupted = std::io::Error::last_os_error().kind() == std::io::ErrorKind::Interrupted;
        if found < 0 && interrupted {
            continue;
        }
        let spoke = found > 0 && watched[0].revents == 0 && hear(supervisor);
        if !spoke {
            return;
        }
        limit_ms = SILENCE_MS;
    }
}

/// Takes what the supervisor says; false at end of file.
fn hear(supervisor: RawFd) -> bool {
    let mut octets = [0_u8; 64];
    // SAFETY: the buffer is valid for its length.
    unsafe { libc::read(supervisor, octets.as_mut_ptr().cast(), octets.len()) > 0 }
}

/// Tells the supervisor that the cycle starts.
pub fn ready(fd: Option<RawFd>) {
    let Some(fd) = fd else { return };
    // SAFETY: the descriptor was passed to this process for this purpose and is not used again.
    unsafe {
        libc::write(fd, b"R".as_ptr().cast(), 1);
        libc::close(fd);
    }
}
