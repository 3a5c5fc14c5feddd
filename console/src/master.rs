//! The control socket of the simulated drive and master.

use std::{
    fs, io,
    os::unix::net::UnixDatagram,
    path::PathBuf,
    sync::atomic::{AtomicU32, Ordering},
    time::Duration,
};

use serde_json::{Value, json};

use crate::run::RunFolder;

/// Longest wait for the answer.
const ANSWER_DEADLINE: Duration = Duration::from_secs(1);
/// Distinguishes the sockets of one process.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// Commands the simulated drive and master of one axis.
#[derive(Debug)]
pub struct Master {
    socket: UnixDatagram,
    own: PathBuf,
    path: PathBuf,
    axis: u8,
}

impl Master {
    /// Connects to the running set in `folder`.
    ///
    /// # Errors
    /// When the simulated drive does not listen.
    pub fn connect(folder: &RunFolder, axis: u8) -> Result<Self, String> {
        let path = folder.domain().join("master.sock");
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let own = folder.domain().join(format!("ctl-{}-{number}.sock", std::process::id()));
        let socket = UnixDatagram::bind(&own)
            .map_err(|error| format!("{}: {error}; is a set running there?", folder.domain().display()))?;
        socket.set_read_timeout(Some(ANSWER_DEADLINE)).map_err(|error| error.to_string())?;
        Ok(Self { socket, own, path, axis })
    }

    /// Asks the drive for a speed, rpm.
    ///
    /// # Errors
    /// What the simulated drive says, or that it does not answer.
    pub fn set_point(&self, rpm: f64) -> Result<(), String> {
        self.send(&json!({ "set_point_rpm": rpm }))
    }

    /// Requests a function by its name.
    ///
    /// # Errors
    /// What the simulated drive says, or that it does not answer.
    pub fn request(&self, function: &str) -> Result<(), String> {
        self.send(&json!({ "request": [function] }))
    }

    /// Takes the request of a function back.
    ///
    /// # Errors
    /// What the simulated drive says, or that it does not answer.
    pub fn release(&self, function: &str) -> Result<(), String> {
        self.send(&json!({ "release": [function] }))
    }

    /// A rising edge of whatever acknowledges in the profile.
    ///
    /// # Errors
    /// What the simulated drive says, or that it does not answer.
    pub fn acknowledge(&self) -> Result<(), String> {
        self.send(&json!({ "acknowledge": true }))
    }

    /// Any instruction of the control socket; the axis is added.
    ///
    /// # Errors
    /// What the simulated drive says, or that it does not answer.
    pub fn send(&self, instruction: &Value) -> Result<(), String> {
        let mut instruction = instruction.clone();
        instruction["axis"] = self.axis.into();
        let failed = |error: io::Error| format!("{}: {error}", self.path.display());
        self.socket.send_to(instruction.to_string().as_bytes(), &self.path).map_err(failed)?;
        let mut answer = [0; 4_096];
        let length = self.socket.recv(&mut answer).map_err(failed)?;
        match &answer[..length] {
            b"ok" => Ok(()),
            wrong => Err(String::from_utf8_lossy(wrong).into_owned()),
        }
    }
}

impl Drop for Master {
    fn drop(&mut self) {
        // The folder is wiped with the set; nothing is lost if it went first.
        let _ = fs::remove_file(&self.own);
    }
}
