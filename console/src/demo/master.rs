//! The simulated master's control socket, as the demonstration uses it.

use std::{os::unix::net::UnixDatagram, path::PathBuf};

use shm_schema::facts::amk_kw::control;

use crate::run::RunFolder;

/// Commands the simulated drive and master of one axis.
pub struct Master {
    socket: UnixDatagram,
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
        let socket = UnixDatagram::unbound().map_err(|error| error.to_string())?;
        Ok(Self { socket, path, axis })
    }

    /// Asks the drive for a speed, rpm.
    ///
    /// # Errors
    /// When the simulated drive does not listen.
    pub fn set_point(&self, rpm: i32) -> Result<(), String> {
        self.send(&serde_json::json!({ "axis": self.axis, "set_point_rpm": rpm }))
    }

    /// Requests the active-low function of `bit`.
    ///
    /// # Errors
    /// When the simulated drive does not listen.
    pub fn request(&self, bit: u8) -> Result<(), String> {
        self.send(&serde_json::json!({ "axis": self.axis, "clear": [bit] }))
    }

    /// Takes the request of `bit` back.
    ///
    /// # Errors
    /// When the simulated drive does not listen.
    pub fn release(&self, bit: u8) -> Result<(), String> {
        self.send(&serde_json::json!({ "axis": self.axis, "set": [bit] }))
    }

    /// A rising edge of the error acknowledge.
    ///
    /// # Errors
    /// When the simulated drive does not listen.
    pub fn acknowledge(&self) -> Result<(), String> {
        self.send(&serde_json::json!({ "axis": self.axis, "pulse": [control::ERROR_ACK] }))
    }

    fn send(&self, command: &serde_json::Value) -> Result<(), String> {
        let sent = self.socket.send_to(command.to_string().as_bytes(), &self.path);
        sent.map(|_| ()).map_err(|error| format!("{}: {error}", self.path.display()))
    }
}
