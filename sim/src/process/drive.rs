//! The simulated drives of all axes, one cycle at a time.

use gateway::udp::Port;
use gateway::{Bridge, Protocol};
use params::AxisSet;
use shm_schema::answer::Answer;
use shm_schema::cell::Kind;
use shm_schema::command::{Command, CommandSource};
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::{Encoder, Slot};
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::io::Io;
use sim::control::{Control, Instruction};
use sim::machine::{Evaluator, Wiring, read_back};
use sim::motor::{Motor, MotorData};
use sim::replay::{Words, control_bits};
use sim::shm::{CellReader, CellValue, CellWriter, Domain, DomainError, compose};
use sim::signals::Signals;
use sim::trace::{Fault, Faults};

/// Noise of sine and cosine, counts each way.
const NOISE: i16 = 6;
/// Longest step of the drive's own control, ns.
const MOTOR_STEP_NS: u64 = 1_000_000;
/// Below this magnitude the drive says its speed is zero, 1/1000 rpm.
const STANDSTILL_MRPM: i32 = 5_000;

/// All drives of a machine.
#[derive(Debug)]
pub struct Drives {
    axes: Vec<Drive>,
    cycle_ns: u64,
    elapsed_ns: u64,
}

/// One wake-up.
#[derive(Debug, Clone, Copy)]
struct Moment {
    /// Cycles since the wake-up before: more than one when the host stalled.
    cycles: u64,
    /// Length of a cycle, ns.
    cycle_ns: u64,
    /// True time since the wake-up before, ns: what the shaft turned for.
    passed_ns: u64,
    /// Time since the start, ms.
    now_ms: u64,
    /// CLOCK_MONOTONIC, ns.
    now_ns: u64,
}

#[derive(Debug)]
struct Drive {
    number: u8,
    control: Control,
    motor: Motor,
    signals: [Signals; 2],
    frozen: [Slot; 2],
    pole_pairs: i64,
    inputs: [bool; 4],
    evaluators: [Evaluator; 2],
    request: DriveRequest,
    outputs: [[u64; 3]; 2],
    io: Option<Io>,
    bus: Option<BusEnd>,
    cells: Cells,
}

/// Where the frames of an axis come from and go to.
#[derive(Debug)]
pub struct BusEnd {
    bridge: Bridge,
    port: Option<Port>,
}

impl BusEnd {
    /// Frames of `protocol` over `port`; without one the axis gets none.
    pub fn new(protocol: Protocol, port: Option<Port>) -> Self {
        Self { bridge: Bridge::new(protocol), port }
    }

    fn cycle(&mut self, cells: &Cells, exchange: u64) -> Command {
        if let Some(port) = &mut self.port {
            let answered = |cell: &CellReader<Answer>| cell.read().map(|(_, answer)| answer);
            if let Some(frame) = self.bridge.answers(answered(&cells.answer_a), answered(&cells.answer_b)) {
                port.send(&frame);
            }
            port.receive(|octets| {
                self.bridge.received(octets);
            });
        }
        self.bridge.command(exchange)
    }
}

/// Everything one drive reads and writes.
#[derive(Debug)]
struct Cells {
    inhibit_a: CellReader<Inhibit>,
    inhibit_b: CellReader<Inhibit>,
    request: CellReader<DriveRequest>,
    answer_a: CellReader<Answer>,
    answer_b: CellReader<Answer>,
    readback: CellWriter<Readback>,
    encoder: CellWriter<Encoder>,
    io: CellWriter<Io>,
    command: CellWriter<Command>,
}

impl Drives {
    /// One drive for each parameter set, at rest.
    pub fn new(
        domain: &Domain,
        sets: &[AxisSet],
        cycle_ns: u64,
        mut buses: Vec<(u8, BusEnd)>,
        age_factor: u8,
    ) -> Result<Self, DomainError> {
        let numbers: Vec<u8> = sets.iter().map(|set| set.number).collect();
        let cells = cells(domain, &numbers)?;
        let drive = |(set, cells): (&AxisSet, Cells)| {
            let own = buses.iter().position(|(axis, _)| *axis == set.number);
            let bus = own.map(|at| buses.swap_remove(at).1);
            Drive::new(set, cells, bus, age_factor)
        };
        let axes = sets.iter().zip(cells).map(drive).collect();
        Ok(Self { axes, cycle_ns, elapsed_ns: 0 })
    }

    /// Hands an instruction to its axis.
    ///
    /// # Errors
    /// One line: what was found and what was expected. Nothing has changed then.
    pub fn take(&mut self, instruction: &Instruction) -> Result<(), String> {
        let axis = instruction.axis.unwrap_or(1);
        let now_ms = self.elapsed_ns / 1_000_000;
        let Some(drive) = self.axes.iter_mut().find(|drive| drive.number == axis) else {
            return Err(format!("axis {axis}, expected an axis of this machine"));
        };
        drive.control.take(instruction, now_ms)
    }

    /// One wake-up after `cycles` cycles, for the boundary at `now_ns` on CLOCK_MONOTONIC.
    pub fn step(&mut self, cycles: u64, now_ns: u64) {
        let passed_ns = cycles * self.cycle_ns;
        self.elapsed_ns += passed_ns;
        let now_ms = self.elapsed_ns / 1_000_000;
        let moment = Moment { cycles, cycle_ns: self.cycle_ns, passed_ns, now_ms, now_ns };
        for drive in &mut self.axes {
            drive.step(&moment);
        }
    }
}

fn cells(domain: &Domain, axes: &[u8]) -> Result<Vec<Cells>, DomainError> {
    let inhibit_a = domain.readers(Kind::InhibitA, axes)?;
    let inhibit_b = domain.readers(Kind::InhibitB, axes)?;
    let request = domain.readers(Kind::DriveRequest, axes)?;
    let answer_a = domain.readers(Kind::AnswerA, axes)?;
    let answer_b = domain.readers(Kind::AnswerB, axes)?;
    let readback = domain.writers(Kind::Readback, axes)?;
    let encoder = domain.writers(Kind::Encoder, axes)?;
    let io = domain.writers(Kind::Io, axes)?;
    let command = domain.writers(Kind::Command, axes)?;
    let readers = inhibit_a.into_iter().zip(inhibit_b).zip(request).zip(answer_a.into_iter().zip(answer_b));
    let writers = readback.into_iter().zip(encoder).zip(io).zip(command);
    let join = |(
        (((inhibit_a, inhibit_b), request), (answer_a, answer_b)),
        (((readback, encoder), io), command),
    )| Cells {
        inhibit_a,
        inhibit_b,
        request,
        answer_a,
        answer_b,
        readback,
        encoder,
        io,
        command,
    };
    Ok(readers.zip(writers).map(join).collect())
}

impl Drive {
    fn new(set: &AxisSet, cells: Cells, bus: Option<BusEnd>, age_factor: u8) -> Self {
        let wiring = Wiring::of(set);
        let signals =
            |slot: usize| Signals::new(wiring.slots[slot], NOISE, u64::from(set.number) * 2 + slot as u64);
        Self {
            number: set.number,
            control: Control::new(set.profile, Words::of(set).neutral, control_bits(set)),
            motor: Motor::new(MotorData::default()),
            signals: [signals(0), signals(1)],
            frozen: [Slot::default(); 2],
            pole_pairs: wiring.pole_pairs.into(),
            inputs: wiring.inputs,
            evaluators: [Evaluator::relaxed(age_factor); 2],
            request: DriveRequest::default(),
            outputs: [[0; 3]; 2],
            io: None,
            bus,
            cells,
        }
    }

    fn step(&mut self, moment: &Moment) {
        self.evaluate();
        self.move_on(moment.passed_ns);
        let readback = Readback {
            path_a: self.evaluators[0].on(),
            path_b: self.evaluators[1].on(),
            edges_a: self.evaluators[0].seen(),
            edges_b: self.evaluators[1].seen(),
        };
        self.cells.readback.publish(&readback, moment.now_ns);
        self.publish_encoder(moment);
        self.publish_inputs(moment);
    }

    /// A cell that cannot be read drives nothing.
    fn evaluate(&mut self) {
        let nonce = self.cells.readback.header().boot_nonce;
        let faults = self.control.faults;
        let sources =
            [(&self.cells.inhibit_a, Fault::StuckPathA), (&self.cells.inhibit_b, Fault::StuckPathB)];
        let own = self.evaluators.iter_mut().zip(&mut self.outputs);
        for ((evaluator, outputs), (cell, stuck)) in own.zip(sources) {
            let driven = cell.read().filter(|(header, _)| header.boot_nonce == nonce);
            let driven = driven.map_or_else(Inhibit::default, |(_, driven)| driven);
            evaluator.step(&driven);
            *outputs = driven.outputs;
            if faults.has(stuck) {
                evaluator.stick();
            }
        }
    }

    fn move_on(&mut self, passed_ns: u64) {
        if let Some((_, request)) = self.cells.request.read() {
            self.request = request;
        }
        if let Some(rpm) = self.control.set_point_rpm.take() {
            self.motor.set_point(rpm);
        }
        if let Some(rpm_s) = self.control.ramp_rpm_s.take() {
            self.motor.ramp(rpm_s);
        }
        let paths = self.evaluators.iter().all(Evaluator::on);
        let energised = paths & self.control.drive_enabled;
        // The drive's own control runs on while the host stalls.
        let parts = passed_ns.div_ceil(MOTOR_STEP_NS);
        let seconds = passed_ns as f64 / parts as f64 / 1e9;
        (0..parts).for_each(|_| self.motor.step(seconds, energised, &self.request));
    }

    /// The sequence counts cycles, so that a stall of the host shows as missed exchanges and
    /// not as a clock that runs slow.
    fn publish_encoder(&mut self, moment: &Moment) {
        let faults = self.control.faults;
        if faults.has(Fault::StaleEncoder) {
            self.cells.encoder.skip(moment.cycles);
            return;
        }
        self.sense(faults);
        let speed_mrpm = self.motor.speed_mrpm();
        let sample = Encoder {
            slots: self.frozen,
            drive_position: self.motor.position(),
            frequency_mhz: (i64::from(speed_mrpm) * self.pole_pairs / 60) as i32,
            torque_ppm: self.motor.torque_ppm(),
            period_ns: moment.cycle_ns as u32,
        };
        self.cells.encoder.skip(moment.cycles.saturating_sub(1));
        self.cells.encoder.publish(&sample, moment.now_ns);
        if faults.has(Fault::CorruptEncoder) {
            corrupt(&mut self.cells.encoder, &sample);
        }
    }

    /// New signals, but for a slot that is frozen.
    fn sense(&mut self, faults: Faults) {
        let fine = self.motor.fine();
        let freeze = [Fault::FreezeEncoder1, Fault::FreezeEncoder2].map(|fault| faults.has(fault));
        for ((slot, signals), freeze) in self.frozen.iter_mut().zip(&mut self.signals).zip(freeze) {
            if !freeze {
                *slot = signals.slot(fine);
            }
        }
    }

    fn publish_inputs(&mut self, moment: &Moment) {
        let (word, lines) = self.control.show(moment.now_ms);
        let lines = lines.where_connected(self.inputs);
        let io = self.io.get_or_insert_with(|| lines.settled());
        lines.sample(io, moment.cycles * moment.cycle_ns);
        read_back(io, &self.outputs, moment.cycles * moment.cycle_ns);
        self.cells.io.publish(io, moment.now_ns);
        let exchange = self.cells.encoder.header().sequence;
        let plain = Command { source: CommandSource::Plain, word, ..Command::default() };
        let safe = self.bus.as_mut().map_or(plain, |bus| bus.cycle(&self.cells, exchange));
        let command = Command {
            clear_error: self.control.clear_error,
            drive_n0: self.motor.speed_mrpm().abs() < STANDSTILL_MRPM,
            drive_enabled: self.control.drive_enabled,
            ..safe
        };
        self.cells.command.publish(&command, moment.now_ns);
    }
}

/// The cell as it was just published, with one octet of the payload changed.
fn corrupt<T: CellValue>(writer: &mut CellWriter<T>, payload: &T) {
    let mut octets = compose(writer.header(), payload);
    if let Some(octet) = octets.as_mut().last_mut() {
        *octet ^= 1;
    }
    writer.publish_octets(octets);
}
