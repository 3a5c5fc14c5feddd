//! The control socket: one instruction a datagram.

use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::sync::mpsc::SyncSender;
use std::{fs, thread};

use sim::control::Instruction;

/// Longest datagram.
const OCTETS_MAX: usize = 4_096;

/// Keeps the socket; its file goes with it.
#[derive(Debug)]
pub struct Listener(PathBuf);

impl Listener {
    /// Listens at `DIR/master.sock` and hands every instruction to `sender`.
    pub fn start(domain: &Path, sender: SyncSender<Instruction>) -> Result<Self, String> {
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

fn listen(socket: &UnixDatagram, sender: &SyncSender<Instruction>) {
    let mut octets = [0; OCTETS_MAX];
    loop {
        let length = match socket.recv(&mut octets) {
            Ok(length) => length,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => {
                tracing::error!("control socket: {error}");
                return;
            }
        };
        match serde_json::from_slice(octets.get(..length).unwrap_or_default()) {
            // A full queue drops: a flood must not grow memory.
            Ok(instruction) => drop(sender.try_send(instruction)),
            Err(error) => tracing::warn!("control socket: {error}"),
        }
    }
}
