//! What ends the process: SIGTERM, SIGINT, or the death of the supervisor. A thread of its
//! own waits for them; the cycle reads one flag.

use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::{SfdFlags, SignalFd};

use super::Trouble;

/// Set once, never taken back.
#[derive(Debug, Clone)]
pub struct Ending(Arc<AtomicBool>);

impl Ending {
    /// The process shall end.
    pub fn has_come(&self) -> bool {
        // Pairs with the store of the watcher; the flag carries no other data.
        self.0.load(Ordering::Acquire)
    }
}

/// Blocks the signals and starts the watcher.
pub fn watch(supervisor: Option<OwnedFd>) -> Result<Ending, Trouble> {
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGTERM);
    signals.add(Signal::SIGINT);
    signals.thread_block().map_err(|error| Trouble::new("signals", error))?;
    let descriptor = SignalFd::with_flags(&signals, SfdFlags::SFD_CLOEXEC)
        .map_err(|error| Trouble::new("signals", error))?;
    let ending = Ending(Arc::new(AtomicBool::new(false)));
    let flag = ending.clone();
    std::thread::Builder::new()
        .name("ending".into())
        .spawn(move || {
            wait(&descriptor, supervisor.as_ref());
            flag.0.store(true, Ordering::Release);
        })
        .map_err(|error| Trouble::new("thread", error))?;
    Ok(ending)
}

/// Returns when one of them has come; an error ends the process too.
fn wait(signals: &SignalFd, supervisor: Option<&OwnedFd>) {
    let mut watched = vec![PollFd::new(signals.as_fd(), PollFlags::POLLIN)];
    watched.extend(supervisor.map(|pipe| PollFd::new(pipe.as_fd(), PollFlags::POLLIN)));
    while let Err(nix::errno::Errno::EINTR) = poll(&mut watched, PollTimeout::NONE) {}
}
