//! `safepair gateway`: the FSoE device of both channels behind a UDP socket, on a bus that loses.

use std::io::{BufRead, BufReader};
use std::net::UdpSocket;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use sim::master::fsoe::{Config, Master, State};
use system_tests::compare::random::Random;

use crate::axis::now_ns;
use crate::programs::safepair;
use crate::set::alone;

const ADDRESS: u16 = 0x1234;
const WATCHDOG_MS: u16 = 40;
/// An answer that has not come by then is lost: the bus has gone on.
const LOST: Duration = Duration::from_millis(4);
/// What the device sends.
const INPUTS: [u8; 12] = [0x10, 0x32, 0x54, 0x76, 0x98, 0xBA, 0xDC, 0xFE, 0x0F, 0x2D, 0x4B, 0x69];
/// The way back to the Data state takes at most so many frames of four octets and more.
const HANDSHAKE: u32 = 12;

/// The process; ended when dropped.
struct Device {
    child: Child,
    socket: UdpSocket,
}

impl Device {
    fn start() -> Self {
        let mut command = Command::new(safepair());
        command.args(["gateway", "--profile", "amk-kw", "--session-id", "0x4711", "--json"]);
        command.arg("--address").arg(ADDRESS.to_string());
        command.arg("--process-data").arg(INPUTS.map(|octet| format!("{octet:02x}")).concat());
        let mut child = command.stdout(Stdio::piped()).spawn().expect("safepair starts");
        let mut line = String::new();
        let output = child.stdout.take().expect("its output");
        BufReader::new(output).read_line(&mut line).expect("a line");
        let event: Value = serde_json::from_str(&line).expect("JSON");
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
        socket.connect(event["address"].as_str().expect("an address")).expect("connected");
        socket.set_read_timeout(Some(LOST)).expect("a time-out");
        Self { child, socket }
    }

    /// One bus cycle.
    fn cycle(&self, master: &mut Master, lost: [bool; 2]) {
        if !lost[0] {
            self.socket.send(master.to_send()).expect("sent");
        }
        let mut answer = [0; 300];
        let came = (!lost[0]).then(|| self.socket.recv(&mut answer).ok()).flatten();
        match came.filter(|_| !lost[1]) {
            Some(length) => master.receive(&answer[..length], now_ns()),
            None => master.advance(now_ns()),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// `cycles` with process data both ways; one datagram in `one_in` is lost in each direction.
fn runs(cycles: u32, one_in: i64) {
    let _turn = alone();
    let device = Device::start();
    let mut master = Master::new(Config { watchdog_ms: WATCHDOG_MS, ..Config::new(4, 12, ADDRESS) });
    let mut random = Random::new(one_in as u64);
    let start = Instant::now();
    let (mut data, mut losses, mut connections) = (0_u32, 0_u32, 0_u32);
    let mut was_data = false;
    while data < cycles {
        let lost = [0, 1].map(|_| random.between(1, one_in) == 1);
        losses += u32::from(lost[0] | lost[1]);
        master.set_outputs(Some(&data.to_le_bytes()));
        device.cycle(&mut master, lost);
        let inputs = master.inputs().filter(|_| master.state() == State::Data);
        // FSoE 3.3: fail-safe values, or exactly what the device sends.
        assert!(inputs.is_none_or(|inputs| inputs == INPUTS), "after {data} cycles: {inputs:x?}");
        data += u32::from(inputs.is_some());
        connections += u32::from(inputs.is_some() & !was_data);
        was_data = inputs.is_some();
        let most = u64::from(cycles / 1_000 + losses * HANDSHAKE + 60) * u64::from(WATCHDOG_MS);
        assert!(start.elapsed().as_millis() < u128::from(most), "stuck after {data} cycles, {losses} losses");
    }
    println!("{data} cycles, {losses} losses, {connections} connections, {:?}", start.elapsed());
    assert!(connections > 1, "losses that cost no connection were none");
}

#[test]
fn a_device_behind_udp_finds_back_to_data_after_every_loss() {
    runs(20_000, 1_000);
}

#[test]
#[ignore = "long form: a million cycles"]
fn a_device_behind_udp_runs_a_million_cycles_with_losses() {
    runs(1_000_000, 5_000);
}
