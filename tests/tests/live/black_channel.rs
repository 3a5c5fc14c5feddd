//! A set that an FSoE master commands over the gateway: data of A, check sums of B, torque only
//! while both processed the same frame (design 9).

use std::fs;
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use sim::master::fsoe::{Config, Master, State};

use crate::axis::{Axis, now_ns};
use crate::host::judged;
use crate::set::{Folder, Running, alone, axis_file};

const ADDRESS: u16 = 3;
/// Nothing requested (AMK-FSOE-09), without and with the error acknowledge, bit 7.
const NEUTRAL: u32 = 0x7E7F;
const ACKNOWLEDGE: u32 = 0x7EFF;
const STO_REQUESTED: u32 = 0x7E7E;
/// Longest wait for anything.
const DEADLINE: Duration = Duration::from_secs(8);
/// Longest wait for an answer before the master sends again, as a bus does each cycle.
const BUS_CYCLE: Duration = Duration::from_millis(60);

/// A master on the other side of the gateway's socket.
struct Bus {
    master: Master,
    socket: UdpSocket,
    gateway: SocketAddr,
}

impl Bus {
    fn new(gateway: SocketAddr) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
        socket.set_read_timeout(Some(BUS_CYCLE)).expect("a time-out");
        let config = Config { watchdog_ms: 400, ..Config::new(4, 12, ADDRESS) };
        Self { master: Master::new(config), socket, gateway }
    }

    /// One frame there, one back, if it comes.
    fn exchange(&mut self) {
        self.socket.send_to(self.master.to_send(), self.gateway).expect("sent");
        let mut answer = [0; 300];
        match self.socket.recv(&mut answer) {
            Ok(length) => self.master.receive(&answer[..length], now_ns()),
            Err(_) => self.master.advance(now_ns()),
        }
    }

    /// Sends `word` until `condition` holds.
    fn command(&mut self, word: u32, axis: &mut Axis, what: &str, condition: impl Fn(&Self, &Axis) -> bool) {
        let start = Instant::now();
        self.master.set_outputs(Some(&word.to_le_bytes()));
        while start.elapsed() < DEADLINE {
            self.exchange();
            axis.comes(Duration::ZERO, |_| true);
            if condition(self, axis) {
                return;
            }
        }
        panic!("{what} did not come; master {:?}; last seen:\n{}", self.master.state(), axis.in_words());
    }

    /// To the Data state and to torque.
    fn connect(&mut self, axis: &mut Axis) {
        self.command(NEUTRAL, axis, "the Data state", |bus, _| {
            bus.master.state() == State::Data && bus.status().is_some()
        });
        self.command(ACKNOWLEDGE, axis, "torque after the acknowledge", |_, axis| axis.torque());
    }

    fn status(&self) -> Option<u32> {
        let inputs = self.master.inputs()?;
        Some(u32::from_le_bytes(*inputs.first_chunk()?))
    }
}

/// A port that is free now; whoever takes it in between makes the start fail with a clear line.
fn free_port() -> SocketAddr {
    UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a port")
}

fn commanded(folder: &Folder, gateway: SocketAddr) -> Running<'_> {
    fs::copy(axis_file(), folder.file("axis.toml")).expect("copied");
    let machine = format!(
        "[producer]\ngateway = \"{gateway}\"\n[[axis]]\nnumber = 1\nparameters = \"axis.toml\"\nbus = \
         \"fsoe\"\naddress = {ADDRESS}\n"
    );
    let file = folder.file("safepair.toml");
    fs::write(&file, machine).expect("written");
    let mut command = std::process::Command::new(crate::programs::safepair());
    command.args(["run", "--timing", "relaxed", "--machine"]).arg(&file).arg("--run-dir").arg(folder.run());
    let mut running = folder.running(folder.launch_as(command));
    running.axis.expect("the start-up", Axis::awaits_acknowledge);
    running
}

#[test]
fn an_fsoe_master_commands_a_set_of_real_processes_over_the_gateway() {
    let _turn = alone();
    judged("a master", || {
        let folder = Folder::new("bus");
        let gateway = free_port();
        let mut running = commanded(&folder, gateway);
        let mut bus = Bus::new(gateway);
        let axis = &mut running.axis;

        bus.connect(axis);
        bus.command(NEUTRAL, axis, "VALID without STO in the status", |bus, _| {
            bus.status().is_some_and(|status| (status & 1 == 0) & (status >> 28 & 1 == 1))
        });
        bus.command(STO_REQUESTED, axis, "STO", |bus, axis| {
            !axis.torque() && bus.status().is_some_and(|s| s & 1 == 1)
        });
        bus.command(NEUTRAL, axis, "torque when the request is gone", |_, axis| axis.torque());

        // DEC-18: a master that falls silent is a command of zeros, when its watchdog is over.
        axis.expect("silence on both paths", |axis| axis.silent(Duration::from_millis(160)));
        running.stop();
    });
}

/// Design 9: no frame that is not the master's own reaches the functions.
#[test]
fn a_forged_frame_takes_the_torque_away() {
    let _turn = alone();
    judged("a forged frame", || {
        let folder = Folder::new("forged");
        let gateway = free_port();
        let mut running = commanded(&folder, gateway);
        let mut bus = Bus::new(gateway);
        let axis = &mut running.axis;
        bus.connect(axis);
        let mut forged = bus.master.to_send().to_vec();
        forged[1] ^= 0x04;
        bus.socket.send_to(&forged, gateway).expect("sent");
        axis.expect("silence on both paths", |axis| axis.silent(Duration::from_millis(160)));
        running.stop();
    });
}
