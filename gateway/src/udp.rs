//! One frame a datagram, the answer to the sender.
//!
//! | datagram to the gateway | is |
//! |---|---|
//! | a whole FSoE or PROFIsafe frame, unchanged | a frame |
//! | 10, 12, 14 or 16 octets on a PROFIsafe axis | the F-parameter block of the host |
//!
//! The datagram to the master is a whole frame. The first axis with a bus has the port asked for,
//! each further one the next. The sender of the newest datagram gets the answers, among them the
//! unsolicited one of an expired watchdog. Nothing is acknowledged or repeated: the protocol does
//! what that needs.

use std::io;
use std::net::{SocketAddr, UdpSocket};

use shm_schema::command::FRAME_MAX;

/// Datagrams taken in one call: a flood must not hold the caller.
const TAKEN_MAX: usize = 16;

/// The socket of one axis; never waits.
#[derive(Debug)]
pub struct Port {
    socket: UdpSocket,
    master: Option<SocketAddr>,
}

impl Port {
    /// Listens at `at`.
    ///
    /// # Errors
    /// What the system says.
    pub fn bind(at: SocketAddr) -> io::Result<Self> {
        let socket = UdpSocket::bind(at)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, master: None })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// What the system says.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Hands each datagram since the last call to `take`, the oldest first.
    pub fn receive(&mut self, mut take: impl FnMut(&[u8])) {
        let mut octets = [0; FRAME_MAX + 1];
        for _ in 0..TAKEN_MAX {
            let Ok((length, sender)) = self.socket.recv_from(&mut octets) else { break };
            self.master = Some(sender);
            take(octets.get(..length).unwrap_or_default());
        }
    }

    /// Sends a frame to the master, if there is one. A frame that cannot be sent is lost.
    pub fn send(&self, frame: &[u8]) {
        if let Some(master) = self.master {
            let _ = self.socket.send_to(frame, master);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_datagram_is_handed_over_in_order_and_the_newest_sender_gets_the_answer() {
        let mut port = Port::bind("127.0.0.1:0".parse().expect("an address")).expect("a port");
        let master = UdpSocket::bind("127.0.0.1:0").expect("a port");
        port.receive(|_| panic!("nobody has sent anything"));
        port.send(&[9]);
        let at = port.address().expect("bound");
        master.send_to(&[1, 2], at).expect("sent");
        master.send_to(&[3, 4, 5], at).expect("sent");
        let mut taken = Vec::new();
        port.receive(|octets| taken.push(octets.to_vec()));
        assert_eq!(taken, [vec![1, 2], vec![3, 4, 5]]);
        port.send(&[6, 7]);
        let mut answer = [0; 8];
        assert_eq!(master.recv(&mut answer).expect("an answer"), 2);
        assert_eq!(answer[..2], [6, 7]);
    }
}
