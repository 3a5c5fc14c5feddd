//! One axis: what a step does, in which order.

mod conclude;
mod functions;

use shm_schema::command::{Command, CommandSource};
use shm_schema::encoder::{Encoder, SlotKind};
use shm_schema::exchange::{Inputs, Motion, Outputs, Sampled, Setup, Start};
use shm_schema::io::Io;
use shm_schema::report::Phase;
use shm_schema::wire::{DIGEST_START, digest, join};

use crate::black_channel::parameter_signature;
use crate::bus::{Field, Heard, ProcessData};
use crate::clock::Measured;
use crate::encoder::{Evaluation, Reading};
use crate::engine::Sample;
use crate::errors::{Class, Errors};
use crate::fresh::{Fresh, Missed, Patience};
use crate::image::{Image, Refusal};
use crate::outputs::Outputs as Lines;
use crate::partner::{Findings, Partner};
use crate::path::{Follow, Path, PathFault, Pause};
use crate::profile::{self, Fault, Outside, Program, Requests};
use crate::startup::{Conditions, Startup};

/// Identity of this program for the release manifest (DEC-22).
pub const BUILD: u32 = digest(digest(DIGEST_START, "channel-a "), env!("CARGO_PKG_VERSION"));

/// Signature of a step that went through all its stages (DEC-22).
#[derive(Debug, Clone, Copy)]
struct Flow(u32);

impl Flow {
    fn pass(&mut self, stage: u32) {
        self.0 = join(self.0, stage);
    }
}

/// Channel A's monitor of one axis.
#[derive(Debug, Clone)]
pub struct Monitor {
    setup: Setup,
    /// Age at which a sample is stale, ns.
    stale_ns: u64,
    /// Distance of samples from which on some are missing, ns.
    gap_ns: u64,
    /// Overruns in a row that are too many.
    overruns_most: u16,
    program: Program,
    phase: Phase,
    errors: Errors,
    encoder: Evaluation,
    encoder_cell: Fresh<Encoder>,
    io_cell: Fresh<Io>,
    command_cell: Fresh<Command>,
    field: Field,
    partner: Partner,
    path: Path,
    own_follow: Follow,
    partner_follow: Follow,
    partner_pause: Pause,
    readback_sequence: u64,
    outputs: Lines,
    readback_missed: Missed,
    producer_stamps: Measured,
    producer_count: Measured,
    producer_stamp_ns: u64,
    sample: Sample,
    judged: Sample,
    now_ns: u64,
    driving: bool,
    stepped: bool,
    startup: Startup,
}

impl Monitor {
    /// A monitor of what `image` (encoding A) asks for. A refused image gives a monitor
    /// that holds the reasons and never permits torque.
    pub fn new(image: &[u8], setup: &Setup) -> Self {
        let mut errors = Errors::default();
        let parsed = Image::parse(image)
            .and_then(|image| if image.axis == setup.axis { Ok(image) } else { Err(Refusal::Unfit) });
        let program = match &parsed {
            Ok(image) => profile::load(image, &mut |code| errors.raise(code, Class::Parameter)),
            Err(refusal) => {
                errors.raise(profile::refusal_code(*refusal), Class::Parameter);
                Program::refused()
            }
        };
        let sra = parsed.map_or(0, |image| parameter_signature(image.content()));
        let phase = match setup.start {
            _ if errors.removes_torque() => Phase::Refused,
            Start::Cold => Phase::Boot,
            Start::Settled => Phase::Operational,
        };
        let patience = Patience::new(setup.age_factor);
        Self {
            setup: *setup,
            stale_ns: setup.cycle_ns.saturating_mul(patience.cycles(setup.stale_cycles.max(1)).into()),
            gap_ns: setup.cycle_ns.saturating_mul(3) / 2,
            overruns_most: patience.cycles(setup.overruns_max.max(1)).min(u8::MAX.into()),
            phase,
            errors,
            encoder: Evaluation::new(program.encoder),
            encoder_cell: Fresh::new(),
            io_cell: Fresh::new(),
            command_cell: Fresh::new(),
            field: Field::new(setup.bus, program.telegram, sra),
            partner: Partner::new(program.tolerance, program.signature, setup),
            path: Path::new(setup.cycle_ns, patience),
            own_follow: Follow::new(patience),
            partner_follow: Follow::new(patience),
            partner_pause: Pause::new(patience),
            readback_sequence: 0,
            outputs: Lines::new(program.gaps, program.supplies, setup.cycle_ns, patience),
            readback_missed: Missed::new(patience),
            producer_stamps: Measured::new(patience),
            producer_count: Measured::new(patience),
            producer_stamp_ns: 0,
            sample: Sample::default(),
            judged: Sample::default(),
            now_ns: 0,
            driving: false,
            stepped: false,
            startup: Startup::default(),
            program,
        }
    }

    /// Runs even a refused set, to show that no parameter can make a step panic.
    #[cfg(test)]
    pub(crate) fn force_operational(&mut self) {
        self.phase = Phase::Operational;
        self.errors = Errors::default();
    }

    fn settles_now(&self) -> bool {
        let settled = self.setup.start == Start::Settled;
        settled & !self.stepped
    }

    fn raise(&mut self, fault: Fault) {
        let (code, class) = self.program.rules.fault_code(fault);
        self.errors.raise(code, class);
    }

    /// One cycle.
    pub fn step(&mut self, inputs: &Inputs, now_ns: u64) -> Outputs {
        let mut flow = Flow(DIGEST_START);
        self.now_ns = now_ns;
        self.errors.begin_step();
        let moving = self.measure(inputs, now_ns);
        flow.pass(1);
        let found = self.compare(inputs, now_ns);
        let agrees = found.permits();
        if !agrees {
            self.name(&found);
        }
        flow.pass(2);
        self.supervise(inputs, now_ns);
        flow.pass(3);
        self.command_cell.take(&inputs.command);
        let heard = self.listen(now_ns);
        let n0 = self.command_cell.last().is_some_and(|cell| cell.payload.drive_n0);
        self.judged = self.program.rules.sample(self.sample, n0);
        let mut requests = self.request(inputs, &heard, now_ns);
        flow.pass(4);
        self.acknowledge(&requests);
        requests.demand.restart |= self.start_up(&requests, (agrees, !found.differs), moving, now_ns);
        flow.pass(5);
        self.functions(&mut requests, moving);
        flow.pass(6);
        let mut outputs = self.conclude(inputs, &requests, agrees, flow);
        self.stepped = true;
        // Most steps have none; it is the largest part of what they return.
        if heard.answer.is_some() {
            outputs.answer = heard.answer;
        }
        outputs
    }

    /// Position and speed of this instant; `false` while there is none to believe.
    fn measure(&mut self, inputs: &Inputs, now_ns: u64) -> bool {
        self.encoder_cell.take(&inputs.encoder);
        let current = self.encoder_cell.current(now_ns, self.stale_ns, self.setup.cycle_ns).copied();
        let judged = !matches!(self.phase, Phase::Boot | Phase::Refused);
        let Some(cell) = current else {
            self.producer_stamps.restart();
            self.producer_count.restart();
            self.sample.now_ns = now_ns;
            if judged & !self.settles_now() {
                self.raise(Fault::EncoderStale);
            }
            return false;
        };
        self.watch_producer(&cell, now_ns);
        let elapsed_ns = now_ns.saturating_sub(self.sample.now_ns);
        let before = self.sample;
        let (motion, sound) = self.motion(inputs, &cell, judged);
        let Motion { position, speed_mrpm, acceleration_mrpm_s: acceleration } = motion;
        let speed = i64::from(speed_mrpm);
        let derived = speed.saturating_sub(before.speed).saturating_mul(1_000_000_000);
        let derived = derived.checked_div(elapsed_ns.min(i64::MAX as u64) as i64).unwrap_or(0);
        let derived = if self.stepped { derived } else { 0 };
        self.sample = Sample {
            now_ns,
            position,
            speed,
            acceleration: acceleration.unwrap_or(derived),
            torque: i64::from(cell.payload.torque_ppm),
        };
        sound
    }

    /// Exact motion where it is given, the evaluated encoder otherwise; whether it is sound.
    fn motion(&mut self, inputs: &Inputs, cell: &Sampled<Encoder>, judged: bool) -> (Motion, bool) {
        if let Some(motion) = inputs.motion {
            if self.settles_now() {
                self.encoder.seed(cell, &motion, self.setup.cycle_ns);
            }
            return (motion, true);
        }
        let sound = self.evaluate(cell, judged);
        let (reading, primed) = if self.is_encoderless() {
            (self.by_frequency(&cell.payload), true)
        } else {
            (self.encoder.reading(), self.encoder.is_primed())
        };
        if sound & primed & self.encoder_cell.advanced {
            self.beside(cell, &reading, judged);
        }
        let speed = reading.speed.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        let motion =
            Motion { position: reading.position, speed_mrpm: speed as i32, acceleration_mrpm_s: None };
        (motion, sound & primed)
    }

    /// Open loop: the drive's output frequency is all there is (ATV-FREQ-02).
    fn by_frequency(&self, encoder: &Encoder) -> Reading {
        let turns = i64::from(encoder.frequency_mhz).saturating_mul(60);
        let speed = turns.checked_div(self.program.encoder.periods).unwrap_or(0);
        let speed = if self.program.encoder.inverted { speed.wrapping_neg() } else { speed };
        Reading { position: 0, speed }
    }

    /// The drive's own movement contradicts the safe one.
    fn beside(&mut self, cell: &Sampled<Encoder>, reading: &Reading, judged: bool) {
        let by_speed = self.is_encoderless();
        let Some(twin) = &mut self.program.twin else { return };
        let (drive, time_ns) = (cell.payload.drive_position, cell.timestamp_ns);
        let found = if by_speed {
            twin.step_by_speed(reading.speed, drive, time_ns)
        } else {
            twin.step(reading.position, drive, time_ns)
        };
        if let Some(contradiction) = found.filter(|_| judged) {
            self.raise(Fault::Drive(contradiction));
        }
    }

    fn is_encoderless(&self) -> bool {
        self.program.encoder.kind == Some(SlotKind::Encoderless)
    }

    fn evaluate(&mut self, cell: &Sampled<Encoder>, judged: bool) -> bool {
        if self.is_encoderless() | !self.encoder_cell.advanced {
            return true;
        }
        match self.encoder.take(cell) {
            Ok(_) => true,
            Err(fault) => {
                if judged {
                    self.raise(Fault::Encoder(fault));
                }
                false
            }
        }
    }

    /// DEC-26: the producer's stamps and its sample count against the own clock.
    fn watch_producer(&mut self, cell: &Sampled<Encoder>, now_ns: u64) {
        if !self.encoder_cell.advanced {
            return;
        }
        // A producer that lost samples in between is late, not slow: measured anew.
        let gap_ns = cell.timestamp_ns.saturating_sub(self.producer_stamp_ns);
        self.producer_stamp_ns = cell.timestamp_ns;
        if gap_ns > self.gap_ns {
            self.producer_count.restart();
        }
        let by_stamp = self.producer_stamps.step(now_ns, cell.timestamp_ns);
        let counted = cell.sequence.saturating_mul(u64::from(cell.payload.period_ns));
        let stated = cell.payload.period_ns != 0;
        let by_count = !stated || self.producer_count.step(now_ns, counted);
        let right = by_stamp & by_count;
        if !right & (self.phase == Phase::Operational) {
            self.raise(Fault::Clock);
        }
    }

    /// Image, overruns, both paths.
    fn supervise(&mut self, inputs: &Inputs, now_ns: u64) {
        if !inputs.image_sound {
            self.raise(Fault::Image);
        }
        let late = u16::from(inputs.overruns) >= self.overruns_most;
        if late & self.startup.judges_overruns() {
            self.raise(Fault::Overrun);
        }
        self.paths(inputs, now_ns);
    }

    /// Both paths: they follow, and their tests are seen.
    fn paths(&mut self, inputs: &Inputs, now_ns: u64) {
        let readback = inputs.readback.as_ref().ok();
        let missed = self.readback_missed.step(readback.map(|cell| cell.sequence));
        let news = readback.filter(|cell| cell.sequence != self.readback_sequence);
        self.readback_sequence = news.map_or(self.readback_sequence, |cell| cell.sequence);
        let news = news.map(|cell| &cell.payload);
        let seen_own = news.map(|seen| (seen.path_a, seen.edges_a));
        let own_stuck = self.path.look_back(self.driving, seen_own, now_ns);
        if self.partner.test_pulse {
            self.partner_pause.begin();
        }
        let seen_partner = news.map(|seen| (seen.path_b, seen.edges_b));
        let partner_passed = self.partner_pause.step(self.partner.driving, seen_partner);
        if self.settles_now() {
            return;
        }
        let blind = missed & self.driving;
        let own_reads = if blind { Some(false) } else { readback.map(|cell| cell.payload.path_a) };
        let own_fault = self.own_follow.step(self.driving, own_reads);
        if let Some(fault) = own_fault.or(own_stuck.then_some(PathFault::StuckOn)) {
            self.raise(Fault::OwnPath(fault));
        }
        let partner_reads = readback.map(|cell| cell.payload.path_b);
        let partner_fault = self.partner_follow.step(self.partner.driving, partner_reads);
        let partner_stuck = (partner_passed == Some(false)).then_some(PathFault::StuckOn);
        if let Some(fault) = partner_fault.or(partner_stuck) {
            // A partner that has died no longer says that it stopped driving.
            if fault == PathFault::StuckOn || self.phase == Phase::Operational {
                self.raise(Fault::PartnerPath(fault));
            }
        }
        if self.path.dormant(now_ns) {
            self.raise(Fault::Dormant);
        }
    }

    /// Partner and agreement.
    fn compare(&mut self, inputs: &Inputs, now_ns: u64) -> Findings {
        self.partner.published(inputs.published);
        if self.settles_now() {
            return Findings::default();
        }
        let mut found = self.partner.compare(&inputs.partner, self.phase, now_ns);
        found.lost |= self.partner.agree(&inputs.agreement, self.exchange());
        if found.lost {
            self.partner.driving = false;
        }
        found
    }

    /// Before the first torque nothing that was found is an error yet.
    fn name(&mut self, found: &Findings) {
        if self.phase != Phase::Operational {
            return;
        }
        let named = [
            (found.lost, Fault::PartnerLost),
            (found.position, Fault::Position),
            (found.speed, Fault::Speed),
            (found.identity, Fault::Identity),
            (found.clock, Fault::Clock),
        ];
        for (is, fault) in named {
            if is {
                self.raise(fault);
            }
        }
        let errors = &mut self.errors;
        self.program.rules.difference_codes(found, &mut |code, class| errors.raise(code, class));
    }

    /// The black channel: the answer is made of both reports of the exchange before this one.
    fn listen(&mut self, now_ns: u64) -> Heard {
        if !self.field.is_used() {
            return Heard::default();
        }
        let exchange = self.exchange();
        let telegram = &self.program.telegram;
        let data = exchange.checked_sub(1).and_then(|before| self.partner.pair_of(before)).map(|pair| {
            let [own, other] = &pair.status;
            ProcessData::new(telegram, &telegram.combine(own, other), pair.position, pair.speed_mrpm)
        });
        let command = self.command_cell.last().map(|cell| &cell.payload);
        let heard = self.field.step(command, data.as_ref(), (exchange, now_ns), self.program.profile);
        if let Some((code, class)) = heard.fault.and_then(|fault| self.program.rules.bus_code(fault)) {
            self.errors.raise(code, class);
        }
        heard
    }

    /// Commands and inputs, stale ones read as nothing (DEC-18).
    fn request(&mut self, inputs: &Inputs, heard: &Heard, now_ns: u64) -> Requests {
        let (stale_ns, cycle_ns) = (self.stale_ns, self.setup.cycle_ns);
        self.io_cell.take(&inputs.io);
        // The age of frames is the protocol's affair: its watchdog judges it.
        let framed = self.field.is_used();
        let newest = self.command_cell.last().filter(|_| framed);
        let command = newest.or(self.command_cell.current(now_ns, stale_ns, cycle_ns));
        let command = command.map(|cell| &cell.payload);
        let plain = command.filter(|command| (command.source == CommandSource::Plain) & !framed);
        let word = heard.word.or(plain.map(|command| command.word));
        let outside = Outside {
            now_ns,
            word,
            clear: command.map(|command| command.clear_error),
            drive_enabled: command.is_some_and(|command| command.drive_enabled),
            io: self.io_cell.current(now_ns, stale_ns, cycle_ns).map(|cell| &cell.payload),
            speed: self.judged.speed,
            settle: self.settles_now(),
            operational: self.phase == Phase::Operational,
        };
        let readback = outside
            .io
            .map(|io| (io.samples, [io.output_readback[0], io.output_readback[2], io.dynamic_readback[0]]));
        for (line, faulty) in (0..).zip(self.outputs.judge(readback)) {
            if !faulty {
                continue;
            }
            if let Some((code, class)) = self.program.rules.output_code(line) {
                self.errors.raise(code, class);
            }
        }
        let Program { watches, rules, stops, .. } = &mut self.program;
        rules.requests(&outside, watches, stops, &mut self.errors)
    }

    /// DEC-15: after all causes of this step have shown themselves.
    fn acknowledge(&mut self, requests: &Requests) {
        if !requests.acknowledge {
            return;
        }
        self.look_again(requests);
        let settled = self.program.stops.is_settled();
        self.errors.acknowledge(settled);
        self.program.watches.acknowledge(settled);
    }

    /// DEC-15: a limit that is violated has no end state without a reaction; its error stands as
    /// long as the limit is.
    fn look_again(&mut self, requests: &Requests) {
        let Program { watches, stops, rules, .. } = &mut self.program;
        if requests.demand.sto | stops.is_sto() {
            return;
        }
        let errors = &mut self.errors;
        watches.look_again(requests.watches, &self.judged, &mut |plan, violation| {
            let (code, class) = rules.watch_code(plan, violation);
            errors.raise(code, class);
        });
        stops.look_again(&self.judged, &mut |violation| {
            let (code, class) = rules.stop_code(violation);
            errors.raise(code, class);
        });
    }

    /// DEC-19; `true` in the step that becomes operational: its edge restarts too. `agrees`: with
    /// the partner, and in every item however shortly.
    fn start_up(&mut self, requests: &Requests, agrees: (bool, bool), moving: bool, now_ns: u64) -> bool {
        let before = self.phase;
        if before == Phase::Operational {
            // Nothing leads back from here.
            return false;
        }
        let asked = requests.acknowledge | requests.demand.restart;
        let stop_asked = requests.demand.sto | !requests.demand.stops.is_empty();
        let conditions = Conditions {
            sound: moving,
            agrees: agrees.0,
            equal: agrees.1,
            path_test: self.partner.path_test(),
            released: asked & !stop_asked & !self.errors.stand(),
        };
        self.phase = self.startup.next(before, &conditions, now_ns, self.program.tolerance.time_ns);
        self.phase == Phase::Operational
    }

    fn exchange(&self) -> u64 {
        self.encoder_cell.last().map_or(0, |cell| cell.sequence)
    }
}
