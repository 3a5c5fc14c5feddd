//! How the process ends: SIGTERM, SIGINT, or the supervisor's end. Threads of their own
//! wait for them, so that the cycle asks one flag.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::{FromRawFd, RawFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use nix::sys::signal::{SigSet, Signal};

/// The cycle has this long to notice before the process ends anyway.
const GRACE: Duration = Duration::from_millis(200);

/// The wish to end.
#[derive(Debug, Clone)]
pub struct Ending(Arc<AtomicBool>);

impl Ending {
    /// Blocks the signals in this and all later threads and starts the watchers.
    pub fn watch(supervisor: Option<RawFd>) -> Self {
        let ending = Self(Arc::new(AtomicBool::new(false)));
        let mut signals = SigSet::empty();
        signals.add(Signal::SIGTERM);
        signals.add(Signal::SIGINT);
        if let Err(error) = signals.thread_block() {
            tracing::warn!("signals: {error}; SIGTERM ends at once");
        }
        ending.when(move || {
            // Whatever it says: a process that cannot wait for its end has to end.
            let _ = signals.wait();
        });
        if let Some(fd) = supervisor {
            ending.when(move || wait_for_end(fd));
        }
        ending
    }

    fn when(&self, wait: impl FnOnce() + Send + 'static) {
        let wanted = Arc::clone(&self.0);
        thread::spawn(move || {
            wait();
            wanted.store(true, Ordering::Release);
            thread::sleep(GRACE);
            std::process::exit(0);
        });
    }

    /// The process has to end.
    pub fn is_wanted(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}

/// Returns at end of file or when reading fails for good.
fn wait_for_end(fd: RawFd) {
    // SAFETY: the descriptor was passed to this process for this purpose; nobody else uses it.
    let mut pipe = unsafe { File::from_raw_fd(fd) };
    let mut octet = [0];
    loop {
        match pipe.read(&mut octet) {
            Ok(0) => return,
            Ok(_) => {}
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(_) => return,
        }
    }
}

/// Tells the supervisor that the cycle starts.
pub fn ready(fd: Option<RawFd>) {
    let Some(fd) = fd else { return };
    // SAFETY: as above; it is closed at the end of this function.
    let mut pipe = unsafe { File::from_raw_fd(fd) };
    if let Err(error) = pipe.write_all(b"R") {
        tracing::warn!("ready: {error}");
    }
}
