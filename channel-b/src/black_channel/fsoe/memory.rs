//! Everything an FSoE slave remembers between two frames (black-channel 3.1).

use super::super::mirrored::Words;
use super::check::Link;
use super::verdict::State;

/// Octets of the session id, of the connection data, and of the parameters in
/// front of the application parameters (black-channel 2.6).
pub(super) const SESSION_OCTETS: usize = 2;
pub(super) const CONNECTION_OCTETS: usize = 4;
pub(super) const PARAMETER_HEADER_OCTETS: usize = 6;

const NANOSECONDS_PER_MILLISECOND: u64 = 1_000_000;

/// The safety variables of the slave, replaced as a whole by each event.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory {
    pub(super) state: State,
    /// Payload octets of this state's exchange that are already done.
    pub(super) done: u16,
    /// Own id of the present session, and of the one after it.
    pub(super) session_id: u16,
    pub(super) next_session_id: u16,
    pub(super) connection_id: u16,
    pub(super) connection_data: [u8; CONNECTION_OCTETS],
    pub(super) parameter_header: [u8; PARAMETER_HEADER_OCTETS],
    /// Every application parameter octet so far was the expected one.
    pub(super) application_agrees: bool,
    /// Last sequence number of each direction; 0 before the first frame.
    pub(super) master_number: u16,
    pub(super) slave_number: u16,
    /// CRC_0 of the last frame of each direction; 0 before the first frame.
    pub(super) received_check: u16,
    pub(super) sent_check: u16,
    /// The master sends process data, not fail-safe data.
    pub(super) has_process_data: bool,
    /// When the last data frame was accepted, in nanoseconds.
    pub(super) accepted_at_ns: u64,
}

impl Memory {
    /// The fault procedure (black-channel 3.3): everything about the connection
    /// is forgotten, only the next session id stays.
    pub(super) const fn reset(next_session_id: u16) -> Self {
        Self {
            state: State::Reset,
            done: 0,
            session_id: 0,
            next_session_id,
            connection_id: 0,
            connection_data: [0; CONNECTION_OCTETS],
            parameter_header: [0; PARAMETER_HEADER_OCTETS],
            application_agrees: true,
            master_number: 0,
            slave_number: 0,
            received_check: 0,
            sent_check: 0,
            has_process_data: false,
            accepted_at_ns: 0,
        }
    }

    /// Communication parameter length, watchdog in milliseconds, application
    /// parameter length, as received.
    pub(super) const fn parameter_fields(&self) -> [u16; 3] {
        let [l0, l1, w0, w1, a0, a1] = self.parameter_header;
        [u16::from_le_bytes([l0, l1]), u16::from_le_bytes([w0, w1]), u16::from_le_bytes([a0, a1])]
    }

    /// Connection id and slave address, as received.
    pub(super) const fn connection_fields(&self) -> [u16; 2] {
        let [c0, c1, a0, a1] = self.connection_data;
        [u16::from_le_bytes([c0, c1]), u16::from_le_bytes([a0, a1])]
    }

    /// The watchdog runs in Data only and expires when the elapsed time reaches
    /// it (black-channel 3.6). A clock that runs backwards counts as expired.
    pub(super) fn has_expired(&self, now_ns: u64) -> bool {
        let [_, watchdog_ms, _] = self.parameter_fields();
        let limit_ns = u64::from(watchdog_ms).wrapping_mul(NANOSECONDS_PER_MILLISECOND);
        let elapsed_ns = now_ns.checked_sub(self.accepted_at_ns);
        let is_over = elapsed_ns.is_none_or(|elapsed_ns| elapsed_ns >= limit_ns);
        let is_running = self.state == State::Data;
        is_running && is_over
    }

    /// The next place in the chain for a frame of the master.
    pub(super) const fn expected(&self, connection_id: u16) -> Link {
        Link { inherited: self.sent_check, connection_id, number: 0 }
    }
}

impl Words<6> for Memory {
    fn words(&self) -> [u64; 6] {
        let pack = |[a, b, c, d]: [u16; 4]| {
            u64::from(a) | u64::from(b) << 16 | u64::from(c) << 32 | u64::from(d) << 48
        };
        let [length, watchdog, application] = self.parameter_fields();
        let [connection, address] = self.connection_fields();
        let flags = u16::from(self.application_agrees) | u16::from(self.has_process_data) << 1;
        [
            pack([self.state as u16, self.done, flags, self.connection_id]),
            pack([self.session_id, self.next_session_id, connection, address]),
            pack([length, watchdog, application, 0]),
            pack([self.master_number, self.slave_number, 0, 0]),
            pack([self.received_check, self.sent_check, 0, 0]),
            self.accepted_at_ns,
        ]
    }
}
