//! One axis, cycle by cycle.

use shm_schema::agreement::Agreement;
use shm_schema::command::{Command, CommandSource};
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::{Encoder, Slot};
use shm_schema::exchange::{
    CellFault, CrosscheckInputs, CrosscheckOutputs, Inputs, Motion, Outputs, Published, Received, Sampled,
    Start,
};
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::report::Report;
use shm_schema::word::Word;

use super::{Channel, Cores, Evaluator, Lines, Referee, View, Wiring, read_back};
use crate::signals::{FINE, Signals};
use crate::trace::{Fault, Faults};

/// Time of cycle 0, ns: nothing in a core may depend on it, and nothing underflows.
const EPOCH_NS: u64 = 1_000_000_000;

/// How an axis is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Power-up, or a machine that has run for ever.
    pub start: Start,
    /// The cores evaluate raw encoder signals instead of getting the exact motion.
    pub raw_encoder: bool,
    /// Cycle, ns.
    pub cycle_ns: u64,
    /// Noise of sine and cosine, counts each way.
    pub noise: i16,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        // One count of noise: real samples are never identical.
        Self { start: Start::Settled, raw_encoder: false, cycle_ns: 1_000_000, noise: 1, seed: 1 }
    }
}

/// Everything from outside during one cycle.
#[derive(Debug, Clone, Copy)]
pub struct Stimulus {
    /// What channel A's encoder sees.
    pub motion_a: Motion,
    /// What channel B's encoder sees.
    pub motion_b: Motion,
    /// Both positions in 1/[`FINE`] increments, for raw signals; `None`: those of the motions.
    pub fine: Option<[i64; 2]>,
    /// Torque, millionths of the rated torque.
    pub torque_ppm: i32,
    /// The profile's control word.
    pub word: Word,
    /// Safe input lines.
    pub lines: Lines,
    /// Non-safe command "clear error".
    pub clear_error: bool,
    /// The drive says its speed is zero.
    pub drive_n0: bool,
    /// The drive's power stage is enabled.
    pub drive_enabled: bool,
    /// Faults of this cycle.
    pub faults: Faults,
}

/// One channel with its path and its place in shared memory.
#[derive(Debug)]
pub(super) struct Side<T> {
    pub(super) core: T,
    inputs: Inputs,
    outputs: Outputs,
    report: Received<Report>,
    signals: [Signals; 2],
    frozen: Option<[Slot; 2]>,
    evaluator: Evaluator,
}

/// The machine of one axis.
#[derive(Debug)]
pub struct Axis<A, B, C> {
    pub(super) a: Side<A>,
    pub(super) b: Side<B>,
    pub(super) crosscheck: C,
    outputs: CrosscheckOutputs,
    /// What crosscheck was given, kept to be filled in place.
    referred: CrosscheckInputs,
    agreement: Received<Agreement>,
    readback: Received<Readback>,
    encoder_sequence: Option<u64>,
    options: Options,
    pole_pairs: i64,
    cycle: u64,
    views: [View; 3],
}

impl<A: Channel, B: Channel, C: Referee> Axis<A, B, C> {
    /// An axis before its first cycle.
    pub fn new(cores: Cores<A, B, C>, wiring: &Wiring, options: Options) -> Self {
        let signals = |side: u64| {
            let seed = |slot: u64| options.seed.wrapping_mul(4).wrapping_add(2 * side + slot);
            let make = |slot: usize| Signals::new(wiring.slots[slot], options.noise, seed(slot as u64));
            [make(0), make(1)]
        };
        // A settled machine has been permitted for ever, and the readback has said so; the
        // cores take no information of partner and agreement as permitting then.
        let settled = options.start == Start::Settled;
        let on = Readback { path_a: settled, path_b: settled, ..Readback::default() };
        Self {
            a: Side::new(cores.a, signals(0), settled),
            b: Side::new(cores.b, signals(1), settled),
            crosscheck: cores.crosscheck,
            outputs: CrosscheckOutputs {
                agreement: Agreement::default(),
                drive: DriveRequest::default(),
                torque: false,
            },
            referred: CrosscheckInputs {
                report_a: Err(CellFault::Missing),
                report_b: Err(CellFault::Missing),
                readback: Err(CellFault::Missing),
                encoder_sequence: None,
                overruns: 0,
            },
            agreement: Err(CellFault::Missing),
            readback: Ok(Sampled { sequence: 1, timestamp_ns: EPOCH_NS, crc32: stand_in(1), payload: on }),
            encoder_sequence: None,
            options,
            pole_pairs: wiring.pole_pairs.into(),
            cycle: 0,
            views: [View::default(); 3],
        }
    }

    /// One cycle. Afterwards [`Self::views`] show a, b and crosscheck.
    pub fn step(&mut self, stimulus: &Stimulus) {
        self.step_between(stimulus, &[]);
    }

    /// One cycle with levels of the lines since the cycle before: each from so many
    /// nanoseconds before this cycle on, oldest first.
    pub fn step_between(&mut self, stimulus: &Stimulus, between: &[(u64, Lines)]) {
        let faults = stimulus.faults;
        let now_ns = EPOCH_NS.wrapping_add(self.cycle.wrapping_mul(self.options.cycle_ns));
        self.sample(stimulus, between, now_ns);
        self.a.inputs.partner.clone_from(&self.b.report);
        self.step_a(faults, now_ns);
        corrupt(&mut self.b.inputs.partner, &self.a.report, faults.has(Fault::CorruptReportA));
        self.step_b(faults, now_ns);
        self.evaluate(faults);
        self.step_crosscheck(faults, now_ns);
        self.publish_readback(now_ns);
        self.look();
        self.cycle += 1;
    }

    /// What the last cycle showed of a, b and crosscheck.
    pub const fn views(&self) -> &[View; 3] {
        &self.views
    }

    /// What the controller asks of the drive.
    pub const fn drive_request(&self) -> &DriveRequest {
        &self.outputs.drive
    }

    /// Both paths permit torque.
    pub const fn torque(&self) -> bool {
        self.a.evaluator.on() & self.b.evaluator.on()
    }

    /// Report of channel A and of channel B, as they stand.
    pub const fn reports(&self) -> [&Report; 2] {
        [&self.a.outputs.report, &self.b.outputs.report]
    }

    /// Cycles done.
    pub const fn cycles(&self) -> u64 {
        self.cycle
    }

    fn sample(&mut self, stimulus: &Stimulus, between: &[(u64, Lines)], now_ns: u64) {
        let sample = EncoderSample {
            sequence: self.cycle + 1,
            now_ns,
            faults: stimulus.faults,
            raw: self.options.raw_encoder,
            // A settled estimator knows the speed that has stood for ever; one sample cannot tell.
            seed: (self.cycle == 0) && (self.options.start == Start::Settled),
            period_ns: self.options.cycle_ns as u32,
            torque_ppm: stimulus.torque_ppm,
            pole_pairs: self.pole_pairs,
        };
        if !stimulus.faults.has(Fault::StaleEncoder) {
            let corrupt = stimulus.faults.has(Fault::CorruptEncoder);
            self.encoder_sequence = if corrupt { None } else { Some(sample.sequence) };
        }
        let whole = [stimulus.motion_a.position, stimulus.motion_b.position];
        let [fine_a, fine_b] = stimulus.fine.unwrap_or(whole.map(|position| position.saturating_mul(FINE)));
        let [freeze_a, freeze_b] =
            [Fault::FreezeEncoder1, Fault::FreezeEncoder2].map(|f| stimulus.faults.has(f));
        self.a.sense(&sample, &stimulus.motion_a, fine_a, freeze_a);
        self.b.sense(&sample, &stimulus.motion_b, fine_b, freeze_b);
        self.a.receive(stimulus, &sample, &self.agreement, &self.readback);
        self.b.receive(stimulus, &sample, &self.agreement, &self.readback);
        self.a.amend(between);
        self.b.amend(between);
        let driven = [self.a.outputs.inhibit.outputs, self.b.outputs.inhibit.outputs];
        self.a.read_back(&driven, self.options.cycle_ns);
        self.b.read_back(&driven, self.options.cycle_ns);
    }

    fn step_a(&mut self, faults: Faults, now_ns: u64) {
        if !faults.has(Fault::FreezeA) {
            self.a.step(now_ns, self.cycle);
        }
    }

    fn step_b(&mut self, faults: Faults, now_ns: u64) {
        if !faults.has(Fault::FreezeB) {
            self.b.step(now_ns, self.cycle);
        }
    }

    fn step_crosscheck(&mut self, faults: Faults, now_ns: u64) {
        if faults.has(Fault::FreezeCrosscheck) {
            return;
        }
        let inputs = &mut self.referred;
        corrupt(&mut inputs.report_a, &self.a.report, faults.has(Fault::CorruptReportA));
        inputs.report_b.clone_from(&self.b.report);
        (inputs.readback, inputs.encoder_sequence) = (self.readback, self.encoder_sequence);
        self.outputs = self.crosscheck.step(inputs, now_ns);
        update(&mut self.agreement, now_ns, self.cycle, &self.outputs.agreement);
    }

    fn evaluate(&mut self, faults: Faults) {
        self.a.evaluate(faults.has(Fault::StuckPathA));
        self.b.evaluate(faults.has(Fault::StuckPathB));
    }

    /// The producer publishes in the next cycle what its evaluator sees in this one.
    fn publish_readback(&mut self, now_ns: u64) {
        let readback = Readback {
            path_a: self.a.evaluator.on(),
            path_b: self.b.evaluator.on(),
            edges_a: self.a.evaluator.seen(),
            edges_b: self.b.evaluator.seen(),
        };
        let at_ns = now_ns.wrapping_add(self.options.cycle_ns);
        update(&mut self.readback, at_ns, self.cycle, &readback);
    }

    fn look(&mut self) {
        let agreement = &self.outputs.agreement;
        let [a, b, crosscheck] = &mut self.views;
        self.a.show(a);
        self.b.show(b);
        crosscheck.status = agreement.status;
        // A frozen crosscheck cannot withdraw what its agreement says: the channels do.
        crosscheck.torque = self.outputs.torque & a.torque & b.torque;
        crosscheck.path = a.path & b.path;
        let errors = [&self.a.outputs.report.errors, &self.b.outputs.report.errors, &agreement.errors];
        crosscheck.errors.unite(&errors);
        (crosscheck.position, crosscheck.speed_mrpm) = (agreement.position, agreement.speed_mrpm);
        crosscheck.outputs = self.outputs.drive.outputs & 0x3F | u8::from(self.outputs.drive.brake_open) << 7;
    }
}

/// What both encoder samples of a cycle have in common.
struct EncoderSample {
    sequence: u64,
    now_ns: u64,
    faults: Faults,
    raw: bool,
    seed: bool,
    period_ns: u32,
    torque_ppm: i32,
    pole_pairs: i64,
}

impl<T: Channel> Side<T> {
    fn new(core: T, signals: [Signals; 2], settled: bool) -> Self {
        let nothing = CellFault::Missing;
        Self {
            core,
            inputs: Inputs {
                encoder: Err(nothing),
                motion: None,
                io: Err(nothing),
                command: Err(nothing),
                partner: Err(nothing),
                agreement: Err(nothing),
                readback: Err(nothing),
                published: None,
                overruns: 0,
                image_sound: true,
            },
            outputs: Outputs { report: Report::default(), inhibit: Inhibit::default(), answer: None },
            report: Err(nothing),
            signals,
            frozen: None,
            evaluator: Evaluator::new(settled),
        }
    }

    fn sense(&mut self, sample: &EncoderSample, motion: &Motion, fine: i64, freeze: bool) {
        if sample.faults.has(Fault::StaleEncoder) {
            return;
        }
        let slots = self.slots(sample.raw, fine, freeze);
        let payload = Encoder {
            slots,
            drive_position: motion.position,
            // DEC-32: f = n * pole pairs / 60
            frequency_mhz: (i64::from(motion.speed_mrpm) * sample.pole_pairs / 60) as i32,
            torque_ppm: sample.torque_ppm,
            period_ns: sample.period_ns,
        };
        let (sequence, timestamp_ns) = (sample.sequence, sample.now_ns);
        self.inputs.encoder = Ok(Sampled { sequence, timestamp_ns, crc32: stand_in(sequence), payload });
        if sample.faults.has(Fault::CorruptEncoder) {
            // No information: what was known of the motion stands as it is.
            self.inputs.encoder = Err(CellFault::CheckSum);
            return;
        }
        self.inputs.motion = if sample.raw && !sample.seed { None } else { Some(*motion) };
    }

    fn slots(&mut self, raw: bool, fine: i64, freeze: bool) -> [Slot; 2] {
        if !raw {
            return [Slot::default(); 2];
        }
        if let (true, Some(slots)) = (freeze, self.frozen) {
            return slots;
        }
        let [first, second] = &mut self.signals;
        let slots = [first.slot(fine), second.slot(fine)];
        self.frozen = Some(slots);
        slots
    }

    fn receive(
        &mut self,
        stimulus: &Stimulus,
        sample: &EncoderSample,
        agreement: &Received<Agreement>,
        readback: &Received<Readback>,
    ) {
        self.inputs.agreement.clone_from(agreement);
        self.inputs.readback.clone_from(readback);
        let (sequence, timestamp_ns) = (sample.sequence, sample.now_ns);
        let crc32 = stand_in(sequence);
        // In place: the cells are large, and a cycle of virtual time is short.
        if let Ok(cell) = &mut self.inputs.io {
            stimulus.lines.sample(&mut cell.payload, sample.period_ns.into());
            (cell.sequence, cell.timestamp_ns, cell.crc32) = (sequence, timestamp_ns, crc32);
        } else {
            let payload = stimulus.lines.settled();
            self.inputs.io = Ok(Sampled { sequence, timestamp_ns, crc32, payload });
        }
        if self.inputs.command.is_err() {
            let payload = Command::default();
            self.inputs.command = Ok(Sampled { sequence, timestamp_ns, crc32, payload });
        }
        if let Ok(cell) = &mut self.inputs.command {
            (cell.sequence, cell.timestamp_ns, cell.crc32) = (sequence, timestamp_ns, crc32);
            fill(&mut cell.payload, stimulus);
        }
    }

    fn amend(&mut self, between: &[(u64, Lines)]) {
        if let Ok(cell) = &mut self.inputs.io {
            between.iter().for_each(|(since_ns, lines)| lines.amend(&mut cell.payload, *since_ns));
        }
    }

    fn read_back(&mut self, driven: &[[u64; 3]; 2], cycle_ns: u64) {
        if let Ok(cell) = &mut self.inputs.io {
            read_back(&mut cell.payload, driven, cycle_ns);
        }
    }

    fn step(&mut self, now_ns: u64, cycle: u64) {
        self.outputs = self.core.step(&self.inputs, now_ns);
        let crc32 = update(&mut self.report, now_ns, cycle, &self.outputs.report);
        self.inputs.published = Some(Published { exchange: self.outputs.report.exchange, crc32 });
    }

    fn evaluate(&mut self, stuck: bool) {
        self.evaluator.step(&self.outputs.inhibit);
        if stuck {
            self.evaluator.stick();
        }
    }

    fn show(&self, view: &mut View) {
        let report = &self.outputs.report;
        view.status = report.status;
        view.torque = self.outputs.inhibit.permit;
        view.path = self.evaluator.on();
        view.errors.unite(&[&report.errors]);
        (view.position, view.speed_mrpm) = (report.position, report.speed_mrpm);
    }
}

fn fill(command: &mut Command, stimulus: &Stimulus) {
    command.source = CommandSource::Plain;
    command.clear_error = stimulus.clear_error;
    command.drive_n0 = stimulus.drive_n0;
    command.drive_enabled = stimulus.drive_enabled;
    command.word = stimulus.word;
}

/// What a reader gets of a cell.
fn corrupt<T: Copy>(reader: &mut Received<T>, cell: &Received<T>, corrupt: bool) {
    if corrupt {
        *reader = Err(CellFault::CheckSum);
    } else {
        reader.clone_from(cell);
    }
}

/// The next update of a cell, in place: the cells are large, and a cycle of virtual time is
/// short. Returns what stands in for its check sum.
fn update<T: Copy>(cell: &mut Received<T>, timestamp_ns: u64, cycle: u64, payload: &T) -> u32 {
    let sequence = cell.as_ref().map_or(1, |cell| cell.sequence + 1);
    let crc32 = stand_in(cycle.wrapping_add(sequence));
    if let Ok(cell) = cell {
        (cell.sequence, cell.timestamp_ns, cell.crc32) = (sequence, timestamp_ns, crc32);
        cell.payload = *payload;
    } else {
        *cell = Ok(Sampled { sequence, timestamp_ns, crc32, payload: *payload });
    }
    crc32
}

/// Stands in for the check sum of a cell, which nobody computes in virtual time: different
/// for each update, never 0.
const fn stand_in(number: u64) -> u32 {
    (number as u32).wrapping_mul(0x9E37_79B1) | 1
}
