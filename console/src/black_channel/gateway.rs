//! `safepair gateway`: a device of both channels behind a plain UDP socket, one frame a
//! datagram, the answer to the sender; needs no privileges. For masters in other programs.

use std::{
    io,
    net::{SocketAddr, UdpSocket},
    process::ExitCode,
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

use super::{ShapeArgs, device::Device, process_data};
use crate::report::{bad_input, fell_short};
use crate::run::stop_flag;

/// How late an expired watchdog is noticed at most.
const TICK: Duration = Duration::from_millis(1);

/// A black-channel device behind a UDP socket.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    shape: ShapeArgs,
    /// Where to listen; port 0 takes a free one, which is printed.
    #[arg(long, default_value = "127.0.0.1:0")]
    listen: SocketAddr,
    /// Safe inputs to send, hexadecimal. Without it the application is not enabled.
    #[arg(long)]
    process_data: Option<String>,
    /// What happens as JSON lines.
    #[arg(long)]
    json: bool,
}

/// Runs the command until SIGINT or SIGTERM.
pub fn run(args: &Args) -> ExitCode {
    let built = args.shape.device().and_then(|(device, shape)| {
        let inputs = process_data(args.process_data.as_deref(), &shape)?;
        Ok((device, inputs))
    });
    match built {
        Ok((device, inputs)) => match serve(args, device, inputs.as_deref()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => fell_short(&format!("{}: {error}", args.listen)),
        },
        Err(line) => bad_input(&line),
    }
}

fn serve(args: &Args, mut device: Device, inputs: Option<&[u8]>) -> io::Result<()> {
    let socket = UdpSocket::bind(args.listen)?;
    socket.set_read_timeout(Some(TICK))?;
    announce(args.json, socket.local_addr()?);
    let stop = stop_flag();
    let start = Instant::now();
    let now_ns = || start.elapsed().as_nanos() as u64;
    let mut partner = None;
    let mut image = [0; 2_048];
    while !stop.load(Ordering::Relaxed) {
        match socket.recv_from(&mut image) {
            Ok((length, sender)) => {
                partner = Some(sender);
                // A datagram of another length is no frame: no event, no answer.
                if let Ok(Some(answer)) = device.receive(&image[..length], inputs, now_ns()) {
                    socket.send_to(&answer, sender)?;
                }
            }
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
            Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {}
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
        if let (Some(frame), Some(sender)) = (device.advance(now_ns()), partner) {
            socket.send_to(&frame, sender)?;
        }
    }
    Ok(())
}

fn announce(json: bool, address: SocketAddr) {
    if json {
        println!("{}", serde_json::json!({ "event": "listening", "address": address.to_string() }));
    } else {
        println!("listening on {address}");
    }
}
