//! The control socket: one instruction a datagram. A sender with an address of its own gets
//! an answer: `ok`, or one line that says what was wrong.

use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;
use std::{fs, thread};

use sim::control::Instruction;

/// Longest datagram.
const OCTETS_MAX: usize = 4_096;

/// Longest wait of a sender for the cycle that takes its instruction.
const ANSWER_DEADLINE: Duration = Duration::from_millis(500);

/// An instruction on its way to the cycle.
#[derive(Debug)]
pub struct Order {
    /// What to do.
    pub instruction: Instruction,
    /// What came of it; has room for one answer.
    pub answer: SyncSender<Result<(), String>>,
}

/// Keeps the socket; its file goes with it.
#[derive(Debug)]
pub struct Listener(PathBuf);

impl Listener {
    /// Listens at `DIR/master.sock` and hands every instruction to `sender`.
    pub fn start(domain: &Path, sender: SyncSender<Order>) -> Result<Self, String> {
        let path = domain.join("master.sock");
        let failed = |error: std::io::Error| format!("{}: {error}", path.display());
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(failed(error)),
            _ => {}
        }
        let socket = UnixDatagram::bind(&path).map_err(failed)?;
        thread::spawn(move || listen(&socket, &sender));
        Ok(Self(path))
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        // The folder belongs to this run; what is left the next one wipes.
        let _ = fs::remove_file(&self.0);
    }
}

fn listen(socket: &UnixDatagram, sender: &SyncSender<Order>) {
    let mut octets = [0; OCTETS_MAX];
    loop {
        let (length, from) = match socket.recv_from(&mut octets) {
            Ok(received) => received,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => {
                tracing::error!("control socket: {error}");
                return;
            }
        };
        let answer = order(octets.get(..length).unwrap_or_default(), sender);
        if let Err(message) = &answer {
            tracing::warn!("control socket: {message}");
        }
        if let Some(path) = from.as_pathname() {
            // Who does not wait for the answer loses only the answer.
            let _ = socket.send_to(answer.err().unwrap_or("ok".to_owned()).as_bytes(), path);
        }
    }
}

fn order(octets: &[u8], sender: &SyncSender<Order>) -> Result<(), String> {
    let instruction = serde_json::from_slice(octets).map_err(|error| error.to_string())?;
    let (answer, answered) = sync_channel(1);
    // A full queue drops: a flood must not grow memory.
    sender.try_send(Order { instruction, answer }).map_err(|_| "too many instructions wait".to_owned())?;
    answered.recv_timeout(ANSWER_DEADLINE).unwrap_or_else(|_| Err("the cycle did not answer".to_owned()))
}
