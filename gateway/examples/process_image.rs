//! How a fieldbus stack hands its process image to safepair: one call in each bus cycle.
//!
//! ```text
//! cargo run -p gateway --example process_image -- 127.0.0.1:34980 0 11 0 27 < cycles.txt
//! ```
//!
//! Arguments: gateway, offset and length of the frame in the outputs (master to device), offset
//! and length in the inputs (device to master). Standard input stands in for the stack: one
//! output image a line, hexadecimal, a line a bus cycle; standard output shows the input image
//! after each. An EtherCAT or PROFINET stack calls [`Device::cycle`] from its own cycle instead.

use std::env;
use std::io::{self, BufRead};
use std::net::UdpSocket;
use std::ops::Range;
use std::process::ExitCode;
use std::time::Duration;

/// Longest wait for an answer in one cycle; a stack with a cycle of its own does not wait.
const WAIT: Duration = Duration::from_millis(100);

/// A safety device in the process image of a fieldbus.
struct Device {
    socket: UdpSocket,
    outputs: Range<usize>,
    inputs: Range<usize>,
    last: Vec<u8>,
}

impl Device {
    /// Carries the frame of one bus cycle: a new one to the gateway, an answer into `inputs`.
    /// Frames are carried as they are; whoever mends one breaks the protocol.
    fn cycle(&mut self, outputs: &[u8], inputs: &mut [u8]) -> io::Result<()> {
        let frame = outputs.get(self.outputs.clone()).ok_or(io::ErrorKind::InvalidInput)?;
        if frame != self.last {
            self.socket.send(frame)?;
            self.last = frame.to_vec();
        }
        let place = inputs.get_mut(self.inputs.clone()).ok_or(io::ErrorKind::InvalidInput)?;
        let mut answer = [0; 300];
        match self.socket.recv(&mut answer) {
            Ok(length) if length == place.len() => place.copy_from_slice(&answer[..length]),
            // Another length is no frame of this device; no answer leaves the image as it was.
            Ok(_) => {}
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [gateway, places @ ..] = arguments.as_slice() else { return usage() };
    let places: Vec<usize> = places.iter().filter_map(|place| place.parse().ok()).collect();
    let [out_at, out_length, in_at, in_length] = places[..] else { return usage() };
    match run(gateway, out_at..out_at + out_length, in_at..in_at + in_length) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{gateway}: {error}");
            ExitCode::FAILURE
        }
    }
}

fn usage() -> ExitCode {
    eprintln!("process_image GATEWAY OUT_OFFSET OUT_LENGTH IN_OFFSET IN_LENGTH");
    ExitCode::from(2)
}

fn run(gateway: &str, outputs: Range<usize>, inputs: Range<usize>) -> io::Result<()> {
    let socket = UdpSocket::bind("0.0.0.0:0")?;
    socket.connect(gateway)?;
    socket.set_read_timeout(Some(WAIT))?;
    let mut image = vec![0; inputs.end];
    let mut device = Device { socket, outputs, inputs, last: Vec::new() };
    for line in io::stdin().lock().lines() {
        device.cycle(&octets(&line?)?, &mut image)?;
        println!("{}", image.iter().map(|octet| format!("{octet:02x}")).collect::<String>());
    }
    Ok(())
}

fn octets(line: &str) -> io::Result<Vec<u8>> {
    let pairs = line.trim().as_bytes().chunks(2);
    let octet = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    pairs.map(|pair| octet(pair).ok_or(io::ErrorKind::InvalidData.into())).collect()
}
