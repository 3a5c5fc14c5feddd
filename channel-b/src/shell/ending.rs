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

/// A supervisor that has given a sign of life gives the next one within this time, or counts
/// as dead: it may have been stopped (design 5).
const LIFE_SIGN_MS: u16 = 250;

/// Returns when one of them has come; an error ends the process too.
fn wait(signals: &SignalFd, supervisor: Option<&OwnedFd>) {
    let mut patience = PollTimeout::NONE;
    loop {
        let mut watched = vec![PollFd::new(signals.as_fd(), PollFlags::POLLIN)];
        watched.extend(supervisor.map(|pipe| PollFd::new(pipe.as_fd(), PollFlags::POLLIN)));
        match poll(&mut watched, patience) {
            Err(nix::errno::Errno::EINTR) => {}
            Ok(1) if watched[0].any() == Some(false) && has_life(supervisor) => {
                patience = LIFE_SIGN_MS.into();
            }
            _ => return,
        }
    }
}

fn has_life(supervisor: Option<&OwnedFd>) -> bool {
    let mut signs = [0; 16];
    supervisor.is_some_and(|pipe| nix::unistd::read(pipe, &mut signs).is_ok_and(|count| count != 0))
}
