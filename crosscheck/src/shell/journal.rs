//! The thread that keeps the logbook: normal priority, never waited for by the cycle.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crosscheck::logbook::recorder::Recorder;
use crosscheck::logbook::ring::{Drain, Feeder, ring};
use crosscheck::logbook::{Book, Entry, Size};

use super::options::Options;
use super::{Image, OpenError};

/// Pause between two looks into the ring.
const PAUSE: Duration = Duration::from_millis(20);
/// Distance of two reports on what was lost.
const REPORT: Duration = Duration::from_secs(1);
/// Moments of one axis the ring holds: half a second at 1 kHz, for a disk that is slow.
const CAPACITY: usize = 512;

/// The running recorder.
#[derive(Debug)]
pub struct Journal {
    end: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Journal {
    /// Writes what is left, and the end of the run.
    pub fn finish(self) {
        self.end.store(true, Ordering::Relaxed);
        if self.thread.join().is_err() {
            tracing::error!("the logbook ended early");
        }
    }
}

/// Opens the logbook and starts its thread; `None` without the option.
pub fn begin(options: &Options, axes: Vec<Image>) -> Result<Option<(Feeder, Journal)>, OpenError> {
    let Some(path) = &options.logbook else { return Ok(None) };
    let unusable = |error| OpenError::new(path.display().to_string(), error);
    let mut book = Book::open(path, Size::default()).map_err(unusable)?;
    let version = concat!("safepair ", env!("CARGO_PKG_VERSION")).to_owned();
    book.append(&Entry::Start { version, nonce: options.nonce, axes }).map_err(unusable)?;
    let (feeder, drain) = ring(CAPACITY * options.axes.len());
    let end = Arc::new(AtomicBool::new(false));
    let keeper = Keeper {
        book,
        drain,
        recorder: Recorder::new(options.cycle_ns()),
        reported: Instant::now(),
        lost: (0, 0),
        failing: false,
    };
    let shared = end.clone();
    let thread = thread::Builder::new()
        .name("logbook".to_owned())
        .spawn(move || keeper.run(&shared))
        .map_err(|error| OpenError::new("thread", error))?;
    Ok(Some((feeder, Journal { end, thread })))
}

struct Keeper {
    book: Book,
    drain: Drain,
    recorder: Recorder,
    reported: Instant,
    /// Moments and changes lost and not yet recorded.
    lost: (u64, u64),
    failing: bool,
}

impl Keeper {
    fn run(mut self, end: &AtomicBool) {
        while !end.load(Ordering::Relaxed) {
            self.empty();
            thread::sleep(PAUSE);
        }
        // Once more: the cycle has ended, so nothing can be left behind now.
        self.empty();
        self.report();
        self.append(&Entry::End);
    }

    fn empty(&mut self) {
        while let Some(moment) = self.drain.pop() {
            if let Some(entry) = self.recorder.take(moment) {
                self.append(&entry);
            }
        }
        if self.reported.elapsed() >= REPORT {
            self.report();
        }
    }

    fn report(&mut self) {
        self.reported = Instant::now();
        let (moments, changes) = self.lost;
        let moments = moments + self.drain.lost();
        let changes = changes + self.recorder.suppressed();
        self.lost = (0, 0);
        if moments > 0 || changes > 0 {
            self.append(&Entry::Lost { moments, changes });
        }
    }

    /// A record that cannot be written is counted and reported when one can be again.
    fn append(&mut self, entry: &Entry) {
        match self.book.append(entry) {
            Ok(()) => self.failing = false,
            Err(error) => {
                if !self.failing {
                    tracing::error!("the logbook cannot be written: {error}");
                }
                self.failing = true;
                self.lost.0 += 1;
            }
        }
    }
}
