//! Load beside the measurement: what else a machine does.

use std::{
    fs::File,
    io::{PipeReader, PipeWriter, Read, Write},
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
};

/// A kind of load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Load {
    /// Arithmetic on every core.
    Cpu,
    /// Copies of 64 MiB on every core.
    Memory,
    /// Writing and syncing a file.
    Io,
    /// Octets to and fro through pipes.
    Ipc,
}

/// Octets copied at a time.
const BLOCK: usize = 64 << 20;

/// Running load; ends when it is dropped.
#[derive(Debug)]
pub struct Running {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Running {
    /// Starts `loads` at normal priority; files go into `folder`.
    pub fn start(loads: &[Load], folder: &Path) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let mut threads = Vec::new();
        for load in loads {
            let count = if matches!(load, Load::Io) { 1 } else { cores };
            for number in 0..count {
                let (stop, load) = (Arc::clone(&stop), *load);
                let file = folder.join(format!("load-{number}"));
                threads.push(thread::spawn(move || work(load, &file, &stop)));
            }
        }
        Self { stop, threads }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn work(load: Load, file: &Path, stop: &AtomicBool) {
    let running = || !stop.load(Ordering::Relaxed);
    match load {
        Load::Cpu => {
            let mut value = 1_u64;
            while running() {
                value = (0..100_000)
                    .fold(value, |value, _| value.wrapping_mul(6_364_136_223_846_793_005).rotate_left(7));
                std::hint::black_box(value);
            }
        }
        Load::Memory => {
            let (from, mut to) = (vec![1_u8; BLOCK], vec![0; BLOCK]);
            while running() {
                to.copy_from_slice(&from);
                std::hint::black_box(&to);
            }
        }
        Load::Io => {
            let block = vec![7; 1 << 20];
            // A disk that is full is no load any more, and no reason to fail.
            while running() && write(file, &block).is_ok() {}
            let _ = std::fs::remove_file(file);
        }
        Load::Ipc => {
            let Ok((reader, writer)) = std::io::pipe() else { return };
            exchange(reader, writer, running);
        }
    }
}

fn write(file: &Path, block: &[u8]) -> std::io::Result<()> {
    let mut file = File::create(file)?;
    file.write_all(block)?;
    file.sync_all()
}

fn exchange(mut reader: PipeReader, mut writer: PipeWriter, running: impl Fn() -> bool) {
    let mut octets = [0; 512];
    while running() && writer.write_all(&octets).is_ok() && reader.read_exact(&mut octets).is_ok() {}
}
