//! The examples of a process image carry frames unchanged, in every language that is installed.

use std::io::Write;
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

/// Frames to the device at offset 2, three octets; answers at offset 1, two octets.
const PLACES: [&str; 4] = ["2", "3", "1", "2"];
const CYCLES: &str = "aaaa010203\naaaa010203\nbbbb040506\n";

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name)
}

/// Runs the example against a gateway that answers with the sum and the number of the frame.
fn carries(mut command: Command, apart: bool) {
    let gateway = UdpSocket::bind("127.0.0.1:0").expect("a port");
    gateway.set_read_timeout(Some(Duration::from_secs(20))).expect("a time-out");
    let address = gateway.local_addr().expect("bound");
    let answering = thread::spawn(move || {
        let mut frames = Vec::new();
        let mut frame = [0; 300];
        while frames.len() < 2 {
            let (length, sender) = gateway.recv_from(&mut frame).expect("a frame");
            frames.push(frame[..length].to_vec());
            let sum = frame[..length].iter().sum();
            gateway.send_to(&[sum, frames.len() as u8], sender).expect("sent");
        }
        frames
    });
    if apart {
        command.args([address.ip().to_string(), address.port().to_string()]);
    } else {
        command.arg(address.to_string());
    }
    let mut child =
        command.args(PLACES).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the example runs");
    child.stdin.take().expect("piped").write_all(CYCLES.as_bytes()).expect("written");
    let output = child.wait_with_output().expect("the example ends");
    assert!(output.status.success(), "{output:?}");
    // An image that has not changed is no new frame.
    assert_eq!(answering.join().expect("answered"), [[1, 2, 3], [4, 5, 6]]);
    assert_eq!(String::from_utf8_lossy(&output.stdout), "000601\n000601\n000f02\n");
}

fn is_installed(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        println!("{program} is not installed: its example was not tried");
    }
    found
}

#[test]
fn the_python_example_carries_frames_unchanged() {
    if is_installed("python3") {
        let mut command = Command::new("python3");
        command.arg(example("process_image.py"));
        carries(command, false);
    }
}

#[test]
fn the_c_example_carries_frames_unchanged() {
    if is_installed("cc") {
        let program = std::env::temp_dir().join(format!("safepair-process-image-{}", std::process::id()));
        let mut compiler = Command::new("cc");
        compiler
            .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-o"])
            .arg(&program)
            .arg(example("process_image.c"));
        assert!(compiler.status().expect("cc runs").success());
        carries(Command::new(&program), true);
        std::fs::remove_file(program).expect("ours");
    }
}

#[test]
fn the_rust_example_carries_frames_unchanged() {
    // Cargo builds the examples of a package with its tests, two folders up from here.
    let own = std::env::current_exe().expect("a test has a path");
    let folder = own.ancestors().nth(2).expect("target/profile").join("examples");
    carries(Command::new(folder.join("process_image")), false);
}
