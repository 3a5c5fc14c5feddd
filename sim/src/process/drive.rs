//! The simulated drives of all axes, one cycle at a time.

use params::AxisSet;
use shm_schema::cell::Kind;
use shm_schema::command::{Command, CommandSource};
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::{Encoder, Slot};
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::io::Io;
use sim::control::{Control, Instruction};
use sim::machine::{Evaluator, Wiring};
use sim::motor::{Motor, MotorData};
use sim::replay::Words;
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
    evaluators: [Evaluator; 2],
    request: DriveRequest,
    io: Option<Io>,
    cells: Cells,
}

/// Everything one drive reads and writes.
#[derive(Debug)]
struct Cells {
    inhibit_a: CellReader<Inhibit>,
    inhibit_b: CellReader<Inhibit>,
    request: CellReader<DriveRequest>,
    readback: CellWriter<Readback>,
    encoder: CellWriter<Encoder>,
    io: CellWriter<Io>,
    command: CellWriter<Command>,
}

impl Drives {
    /// One drive for each parameter set, at rest.
    pub fn new(domain: &Domain, sets: &[AxisSet], cycle_ns: u64) -> Result<Self, DomainError> {
        let numbers: Vec<u8> = sets.iter().map(|set| set.number).collect();
        let cells = cells(domain, &numbers)?;
        let axes = sets.iter().zip(cells).map(|(set, cells)| Drive::new(set, cells)).collect();
        Ok(Self { axes, cycle_ns, elapsed_ns: 0 })
    }

    /// Hands an instruction to its axis.
    pub fn take(&mut self, instruction: &Instruction) {
        let axis = instruction.axis.unwrap_or(1);
        let now_ms = self.elapsed_ns / 1_000_000;
        let Some(drive) = self.axes.iter_mut().find(|drive| drive.number == axis) else {
            tracing::warn!("instruction for axis {axis}, expected an axis of this machine");
            return;
        };
        if let Err(message) = drive.control.take(instruction, now_ms) {
            tracing::warn!("axis {axis}: {message}");
        }
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
    let readback = domain.writers(Kind::Readback, axes)?;
    let encoder = domain.writers(Kind::Encoder, axes)?;
    let io = domain.writers(Kind::Io, axes)?;
    let command = domain.writers(Kind::Command, axes)?;
    let readers = inhibit_a.into_iter().zip(inhibit_b).zip(request);
    let writers = readback.into_iter().zip(encoder).zip(io).zip(command);
    let join = |(((inhibit_a, inhibit_b), request), (((readback, encoder), io), command))| Cells {
        inhibit_a,
        inhibit_b,
        request,
        readback,
        encoder,
        io,
        command,
    };
    Ok(readers.zip(writers).map(join).collect())
}

impl Drive {
    fn new(set: &AxisSet, cells: Cells) -> Self {
        let wiring = Wiring::of(set);
        let signals =
            |slot: usize| Signals::new(wiring.slots[slot], NOISE, u64::from(set.number) * 2 + slot as u64);
        Self {
            number: set.number,
            control: Control::new(set.profile, Words::of(set).neutral),
            motor: Motor::new(MotorData::default()),
            signals: [signals(0), signals(1)],
            frozen: [Slot::default(); 2],
            pole_pairs: wiring.pole_pairs.into(),
            evaluators: [Evaluator::default(); 2],
            request: DriveRequest::default(),
            io: None,
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
        for (evaluator, (cell, stuck)) in self.evaluators.iter_mut().zip(sources) {
            let driven = cell.read().filter(|(header, _)| header.boot_nonce == nonce);
            evaluator.step(&driven.map_or_else(Inhibit::default, |(_, driven)| driven));
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
        let (word, mut lines) = self.control.show(moment.now_ms);
        lines.outputs = self.request.outputs;
        let io = self.io.get_or_insert_with(|| lines.settled());
        lines.sample(io, moment.cycles * moment.cycle_ns);
        self.cells.io.publish(io, moment.now_ns);
        let command = Command {
            source: CommandSource::Plain,
            clear_error: self.control.clear_error,
            drive_n0: self.motor.speed_mrpm().abs() < STANDSTILL_MRPM,
            drive_enabled: self.control.drive_enabled,
            word,
            ..Command::default()
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
