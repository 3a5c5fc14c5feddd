//! The end of the set: SIGTERM, SIGINT, or the supervisor's death. And the end of opening.

use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::{SfdFlags, SignalFd};

use super::OpenError;

/// Whether the end has come; read by the cycle.
#[derive(Debug, Clone, Default)]
pub struct Ending(Arc<AtomicBool>);

impl Ending {
    /// Whether the end has come.
    pub fn has_come(&self) -> bool {
        // Relaxed: one flag that carries no other data.
        self.0.load(Ordering::Relaxed)
    }

    fn come(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Starts the thread that waits for the end. `supervisor`: read end of the pipe whose write
/// end only the supervisor holds.
pub fn watch(supervisor: Option<i32>) -> Result<Ending, OpenError> {
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGTERM);
    signals.add(Signal::SIGINT);
    signals.thread_block().map_err(|error| OpenError::new("signals", error))?;
    let flags = SfdFlags::SFD_CLOEXEC;
    let signals = SignalFd::with_flags(&signals, flags).map_err(|error| OpenError::new("signals", error))?;
    let ending = Ending::default();
    let shared = ending.clone();
    thread::Builder::new()
        .name("ending".to_owned())
        .spawn(move || wait(&signals, supervisor, &shared))
        .map_err(|error| OpenError::new("thread", error))?;
    Ok(ending)
}

fn wait(signals: &SignalFd, supervisor: Option<i32>, ending: &Ending) {
    // SAFETY: the descriptor was handed over for the life of the process and is never closed.
    let supervisor = supervisor.map(|fd| unsafe { BorrowedFd::borrow_raw(fd) });
    let mut watched = vec![PollFd::new(signals.as_fd(), PollFlags::POLLIN)];
    watched.extend(supervisor.map(|fd| PollFd::new(fd, PollFlags::POLLIN)));
    // Whatever happens on either is the end: nobody writes into the supervisor's pipe, and a
    // descriptor that is none (POLLNVAL) or a poll that fails leaves nobody to tell us.
    while poll(&mut watched, PollTimeout::NONE) == Err(Errno::EINTR) {}
    ending.come();
}

/// Ends the process with code 3 when opening takes longer than it may: a half-created domain
/// can make the library hang for ever (design 5).
#[derive(Debug)]
pub struct Opening(Arc<AtomicBool>);

impl Opening {
    /// Everything is open.
    pub fn done(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Starts the time of opening.
pub fn limit_opening(deadline: Duration) -> Opening {
    let done = Arc::new(AtomicBool::new(false));
    let watched = done.clone();
    // Some slack, so that an orderly refusal says what was missing.
    let limit = deadline + Duration::from_millis(200);
    let watchdog = move || {
        thread::sleep(limit);
        if !watched.load(Ordering::Relaxed) {
            eprintln!("safepair-crosscheck: not everything was open after {} ms", deadline.as_millis());
            std::process::exit(3);
        }
    };
    if thread::Builder::new().name("opening".to_owned()).spawn(watchdog).is_err() {
        tracing::warn!("no thread to limit the time of opening");
    }
    Opening(done)
}
