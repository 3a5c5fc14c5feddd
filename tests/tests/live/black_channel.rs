//! A set that an FSoE master or a PROFIsafe host commands over the gateway: data of A, check sums
//! of B, torque only while both processed the same frame (design 9).

use std::fs;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::time::{Duration, Instant};

use shm_schema::facts::lenze_sm301::{control, status};
use sim::master::fsoe::code::INVALID_APPLICATION_PARAMETER;
use sim::master::{Master, fsoe, profisafe};

use crate::axis::{Axis, now_ns};
use crate::host::judged;
use crate::set::{Folder, Running, alone, axis_file};

const ADDRESS: u16 = 3;
/// The bus as the machine file says it.
const FSOE: &str = "\"fsoe\"";
const PROFISAFE: &str = "\"profisafe\"";
/// The master has to send the SRA CRC.
const SIGNED: &str = "\"fsoe\"\nsra = true";
/// Nothing requested (AMK-FSOE-09), without and with the error acknowledge, bit 7.
const NEUTRAL: u32 = 0x7E7F;
const ACKNOWLEDGE: u32 = 0x7EFF;
const STO_REQUESTED: u32 = 0x7E7E;
/// Nothing that passes the filter of `profisafe.toml` is requested.
const RELEASED: u32 = 1 << control::STO | 1 << control::SS1 | 1 << control::SD_OUT1;
const PS_AIS: u32 = 1 << control::PS_AIS;
const PS_AIE: u32 = 1 << control::PS_AIE;
const STO_ACTIVE: u32 = 1 << status::STO_ACTIVE;
/// Both paths have been quiet for so long when they are off.
const SILENCE: Duration = Duration::from_millis(160);
const WATCHDOG_MS: u16 = 400;
/// Longest wait for anything.
const DEADLINE: Duration = Duration::from_secs(8);
/// Longest wait for an answer before the master sends again, as a bus does each cycle.
const BUS_CYCLE: Duration = Duration::from_millis(60);

/// A master on the other side of the gateway's socket.
struct Bus<M> {
    master: M,
    socket: UdpSocket,
    gateway: SocketAddr,
}

impl Bus<fsoe::Master> {
    fn fsoe(gateway: SocketAddr) -> Self {
        Self::signed(gateway, Vec::new())
    }

    /// `sra`: what it sends as application parameters.
    fn signed(gateway: SocketAddr, sra: Vec<u8>) -> Self {
        let config = fsoe::Config {
            watchdog_ms: WATCHDOG_MS,
            application_parameters: sra,
            ..fsoe::Config::new(4, 12, ADDRESS)
        };
        Self::new(gateway, fsoe::Master::new(config))
    }

    /// To the Data state and to torque.
    fn connect(&mut self, axis: &mut Axis) {
        self.command(NEUTRAL, axis, "the Data state", |bus, _| {
            bus.master.state() == fsoe::State::Data && bus.status().is_some()
        });
        self.command(ACKNOWLEDGE, axis, "torque after the acknowledge", |_, axis| axis.torque());
    }
}

impl Bus<profisafe::Host> {
    /// Hands the F-parameters over, as a controller does before the first telegram.
    fn profisafe(gateway: SocketAddr) -> Self {
        let parameters = profisafe::Parameters::new(ADDRESS, WATCHDOG_MS);
        let host = profisafe::Host::new(profisafe::Config { outputs: 4, inputs: 4, parameters });
        let bus = Self::new(gateway, host);
        bus.socket.send_to(&parameters.block(), gateway).expect("sent");
        bus
    }
}

impl<M: Master> Bus<M> {
    fn new(gateway: SocketAddr, master: M) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
        socket.set_read_timeout(Some(BUS_CYCLE)).expect("a time-out");
        Self { master, socket, gateway }
    }

    /// One frame there, one back, if it comes.
    fn exchange(&mut self) {
        self.master.operate();
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
        self.master.set_outputs(&word.to_le_bytes());
        while start.elapsed() < DEADLINE {
            self.exchange();
            axis.comes(Duration::ZERO, |_| true);
            if condition(self, axis) {
                return;
            }
        }
        panic!("{what} did not come; {:?}; last seen:\n{}", self.master, axis.in_words());
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

/// A set at its first acknowledge whose axis of `parameters` is on `bus` behind `gateway`.
fn commanded<'a>(folder: &'a Folder, gateway: SocketAddr, bus: &str, parameters: &Path) -> Running<'a> {
    fs::copy(parameters, folder.file("axis.toml")).expect("copied");
    let machine = format!(
        "[producer]\ngateway = \"{gateway}\"\n[[axis]]\nnumber = 1\nparameters = \"axis.toml\"\nbus = \
         {bus}\naddress = {ADDRESS}\n"
    );
    let file = folder.file("safepair.toml");
    fs::write(&file, machine).expect("written");
    let mut command = std::process::Command::new(crate::programs::safepair());
    command.args(["run", "--timing", "relaxed", "--machine"]).arg(&file).arg("--run-dir").arg(folder.run());
    let mut running = folder.running(folder.launch_as(command));
    running.axis.expect("the start-up", Axis::awaits_acknowledge);
    running
}

/// A set on `bus`, acted on by the master that `connect` makes; at the end both paths are silent.
fn on_bus<M: Master>(
    bus: &str,
    parameters: &Path,
    connect: impl Fn(SocketAddr) -> Bus<M>,
    act: impl Fn(&mut Bus<M>, &mut Axis),
) {
    let _turn = alone();
    judged(bus, || {
        let folder = Folder::new("bus");
        let gateway = free_port();
        let mut running = commanded(&folder, gateway, bus, parameters);
        act(&mut connect(gateway), &mut running.axis);
        running.axis.expect("silence on both paths", |axis| axis.silent(SILENCE));
        running.stop();
    });
}

#[test]
fn an_fsoe_master_commands_a_set_of_real_processes_over_the_gateway() {
    on_bus(FSOE, &axis_file(), Bus::fsoe, |bus, axis| {
        bus.connect(axis);
        bus.command(NEUTRAL, axis, "VALID without STO in the status", |bus, _| {
            bus.status().is_some_and(|status| (status & 1 == 0) & (status >> 28 & 1 == 1))
        });
        bus.command(STO_REQUESTED, axis, "STO", |bus, axis| {
            !axis.torque() && bus.status().is_some_and(|s| s & 1 == 1)
        });
        bus.command(NEUTRAL, axis, "torque when the request is gone", |_, axis| axis.torque());
        // DEC-18: a master that falls silent is a command of zeros, when its watchdog is over.
    });
}

/// Design 9: no frame that is not the master's own reaches the functions.
#[test]
fn a_forged_frame_takes_the_torque_away() {
    on_bus(FSOE, &axis_file(), Bus::fsoe, |bus, axis| {
        bus.connect(axis);
        let mut forged = bus.master.to_send().to_vec();
        forged[1] ^= 0x04;
        bus.socket.send_to(&forged, bus.gateway).expect("sent");
    });
}

/// black-channel.md 2.7: each channel computes the SRA CRC from its own copy of the set.
#[test]
fn a_master_has_to_know_the_set_where_the_machine_asks_for_its_sra_crc() {
    let text = fs::read_to_string(axis_file()).expect("the axis of the tests");
    let set = params::parse(&text, "axis.toml").expect("sound");
    let sra = set.axes[0].sra_crc();
    on_bus(SIGNED, &axis_file(), |gateway| Bus::signed(gateway, sra.to_le_bytes().into()), Bus::connect);
    on_bus(
        SIGNED,
        &axis_file(),
        |gateway| Bus::signed(gateway, (!sra).to_le_bytes().into()),
        |bus, axis| {
            bus.command(NEUTRAL, axis, "the refusal", |bus, _| {
                bus.master.refusal() == Some(INVALID_APPLICATION_PARAMETER)
            });
        },
    );
}

#[test]
fn a_profisafe_host_commands_a_set_of_real_processes_over_the_gateway() {
    let parameters = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/live/profisafe.toml");
    on_bus(PROFISAFE, &parameters, Bus::profisafe, |bus, axis| {
        bus.command(RELEASED, axis, "process data", |bus, _| bus.status().is_some());
        let acknowledge = RELEASED | PS_AIS | PS_AIE;
        bus.command(acknowledge, axis, "torque after the acknowledge", |_, axis| axis.torque());
        bus.command(RELEASED, axis, "a status without STO", |bus, _| {
            bus.status().is_some_and(|status| status & STO_ACTIVE == 0)
        });
        bus.command(RELEASED & !(1 << control::STO), axis, "STO", |bus, axis| {
            !axis.torque() && bus.status().is_some_and(|status| status & STO_ACTIVE != 0)
        });
        // LNZ: the restart is acknowledged (C15300 = 0).
        bus.command(RELEASED, axis, "the request gone", |bus, axis| !axis.torque() && bus.status().is_some());
        bus.command(RELEASED | PS_AIS, axis, "torque after the restart acknowledge", |_, axis| axis.torque());
        // DEC-18: a host that falls silent is a command of zeros, when the watchdog is over.
    });
}
