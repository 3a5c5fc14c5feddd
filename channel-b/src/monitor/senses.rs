//! What a step sees: fresh cells, motion, words, acknowledge edges.

use shm_schema::agreement::{Agreement, PathTest};
use shm_schema::encoder::Encoder;
use shm_schema::exchange::{Inputs, Received, Sampled, Setup};
use shm_schema::inhibit::Readback;
use shm_schema::report::{Phase, Report};
use shm_schema::word::Word;

use super::{Monitor, factor};
use crate::agreed::Agreed;
use crate::bus::Events;
use crate::encoder::drive::Companion;
use crate::encoder::{EncoderFault, Evaluated, Evaluation};
use crate::engine::Motion;
use crate::engine::spec::NO_BIT;
use crate::fresh::{Clock, Freshness, Limit, Look};
use crate::inputs;

/// Cycles without news after which partner or agreement is lost (DEC-23). An echo is too old
/// after as many exchanges.
const LOST_CYCLES: u8 = 3;

/// Every age and wait of the cells, in the timing of this run (architecture, "Timing").
#[derive(Debug, Clone, Copy)]
pub struct Ages {
    stale: Limit,
    lost: Limit,
    /// Age of a sample by its time stamp, and how far that may lie ahead, ns.
    sample_ns: u64,
    ahead_ns: u64,
    /// Exchanges after which an echo is too old.
    echo: u64,
    /// Overruns in a row.
    pub(super) overruns: u8,
}

impl Ages {
    /// Of `setup`.
    pub fn of(setup: &Setup) -> Self {
        let cycles = |strict: u8| strict.saturating_mul(factor(setup));
        let (stale, lost) = (cycles(setup.stale_cycles.max(1)), cycles(LOST_CYCLES));
        Self {
            stale: Limit::new(stale, setup.cycle_ns),
            lost: Limit::new(lost, setup.cycle_ns),
            sample_ns: setup.cycle_ns.saturating_mul(u64::from(stale)),
            ahead_ns: setup.cycle_ns.saturating_mul(u64::from(cycles(1))),
            echo: u64::from(lost).saturating_sub(1),
            overruns: cycles(setup.overruns_max.max(1)),
        }
    }
}

/// What is remembered about the cells.
#[derive(Debug, Clone, Copy)]
pub struct Senses {
    pub(super) ages: Ages,
    pub(super) encoder: Freshness,
    pub(super) io: Freshness,
    pub(super) command: Freshness,
    pub(super) partner: Freshness,
    pub(super) agreement: Freshness,
    pub(super) readback: Freshness,
    pub(super) producer_clock: Clock,
    pub(super) partner_clock: Clock,
    pub(super) evaluation: Evaluation,
    pub(super) companion: Companion,
    pub(super) lines: inputs::Inputs,
    pub(super) motion: Motion,
    /// Time stamp of the sample that `motion` came from, ns.
    pub(super) sampled_ns: u64,
    /// Sequence of the newest believed sample: the exchange number.
    pub(super) exchange: u64,
    pub(super) acknowledges: Acknowledges,
    pub(super) agreed: Agreed,
    /// The partner said it drives, in its newest report.
    pub(super) partner_drives: bool,
}

/// What a step made of the cells.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    /// Exchange number of the newest sample.
    pub exchange: u64,
    /// The exchange has advanced in this cycle.
    pub is_exchange_new: bool,
    /// Exchange number of the partner's newest report.
    pub partner_exchange: u64,
    /// Motion of this cycle; the last known when the encoder is not believed.
    pub motion: Motion,
    /// Control word; zeros when there is none.
    pub word: Word,
    /// Debounced levels of lines .2; bits 4 and 5 the acknowledge terminals.
    pub levels: u32,
    /// Debounced levels of lines .1.
    pub others: u32,
    /// The lines can be read.
    pub are_lines_read: bool,
    /// Acknowledge levels, as in the report.
    pub acknowledge: u32,
    /// The command comes by a standing connection, or is fresh where there is no bus (DEC-16).
    pub is_connected: bool,
    /// What happened on the black channel.
    pub events: Events,
    /// Non-safe.
    pub drive_n0: bool,
    /// Non-safe.
    pub drive_enabled: bool,
    /// Image and encoder are sound.
    pub is_plausible: bool,
    /// The encoder sample is too old.
    pub is_stale: bool,
    /// Why the encoder is not believed.
    pub encoder_fault: Option<EncoderFault>,
    /// A foreign clock runs at another rate.
    pub is_clock_off: bool,
    /// The partner's report has not advanced.
    pub is_partner_lost: bool,
    /// The agreement has not advanced.
    pub is_agreement_lost: bool,
    /// The agreement is fresh and echoes the own report.
    pub is_agreed: bool,
    /// It permits torque.
    pub permits: bool,
    /// Crosscheck has an error of its own.
    pub crosscheck_error: bool,
    /// Self-test step.
    pub path_test: PathTest,
    /// Both paths as read back.
    pub readback: Option<Readback>,
    /// Phase of the partner's report; `None` when it is lost.
    pub partner_phase: Option<Phase>,
    /// Overruns in a row.
    pub overruns: u8,
    /// Bit n: the own line of safe output n + 1 does not follow.
    pub wrong_outputs: u8,
    /// Own clock, ns.
    pub now: u64,
    /// First step of a settled start: everything counts as permitting.
    pub is_settled: bool,
}

impl Cells {
    /// Nothing read yet.
    pub const fn new(now: u64, is_settled: bool) -> Self {
        Self {
            exchange: 0,
            is_exchange_new: false,
            partner_exchange: 0,
            motion: Motion::ZERO,
            word: Word::ZERO,
            levels: 0,
            others: 0,
            are_lines_read: false,
            acknowledge: 0,
            is_connected: false,
            events: Events::NONE,
            drive_n0: false,
            drive_enabled: false,
            is_plausible: false,
            is_stale: false,
            encoder_fault: None,
            is_clock_off: false,
            is_partner_lost: false,
            is_agreement_lost: false,
            is_agreed: is_settled,
            permits: is_settled,
            crosscheck_error: false,
            path_test: PathTest::None,
            readback: None,
            partner_phase: None,
            overruns: 0,
            wrong_outputs: 0,
            now,
            is_settled,
        }
    }
}

/// Acknowledge levels of the cycle before: error, restart, clear.
#[derive(Debug, Clone, Copy, Default)]
pub struct Acknowledges {
    before: u32,
    /// Bits that have been 0 since the start (DEC-16).
    armed: u32,
}

/// Acknowledge levels that come by the control word.
const BY_WORD: u32 = 0b011;

/// Rising edges of one cycle.
#[derive(Debug, Clone, Copy)]
pub struct Edges {
    /// Error acknowledge.
    pub error: bool,
    /// Restart acknowledge.
    pub restart: bool,
    /// Non-safe clear.
    pub clear: bool,
}

impl Edges {
    /// An edge that acknowledges errors.
    pub const fn any(&self) -> bool {
        self.error | self.clear
    }
}

impl Acknowledges {
    /// DEC-16: a level that was there from the beginning of the connection is no edge; a 0
    /// must have been seen in it.
    pub fn edges(&mut self, levels: u32, is_connected: bool, is_settled: bool) -> Edges {
        if is_settled {
            self.before = levels;
        }
        let rising = levels & !self.before & self.armed;
        self.before = levels;
        self.armed = if is_connected { self.armed | !levels } else { (self.armed | !levels) & !BY_WORD };
        Edges { error: rising & 1 != 0, restart: rising & 2 != 0, clear: rising & 4 != 0 }
    }
}

fn sound<T>(cell: &Received<T>) -> Option<&Sampled<T>> {
    cell.as_ref().ok()
}

impl Monitor {
    /// Looks at every cell once.
    pub(super) fn read(&mut self, inputs: &Inputs, cells: &mut Cells) {
        self.visit(1);
        let now = cells.now;
        cells.partner_exchange = sound(&inputs.partner).map_or(0, |cell| cell.payload.exchange);
        cells.readback = self.read_readback(inputs, now);
        cells.overruns = inputs.overruns;
        self.read_motion(inputs, cells, now);
        self.read_io(inputs, cells, now);
        self.read_bus(inputs, cells, now);
        self.read_command(inputs, cells, now);
        self.read_partner(inputs, cells, now);
        self.read_agreement(inputs, cells, now);
    }

    /// What does not advance is no readback: a frozen one would show a path as it was.
    fn read_readback(&mut self, inputs: &Inputs, now: u64) -> Option<Readback> {
        let cell = sound(&inputs.readback);
        let senses = &mut self.senses;
        let look = senses.readback.look(cell.map(|cell| cell.sequence), &senses.ages.lost, now);
        cell.filter(|_| !look.is_stale).map(|cell| cell.payload)
    }

    /// A sample is as old as its last update; an old time stamp is as bad as none, and one
    /// from the future by more than a cycle too.
    fn read_motion(&mut self, inputs: &Inputs, cells: &mut Cells, now: u64) {
        let sample = sound(&inputs.encoder);
        let mut believed = sample.map(|cell| cell.sequence);
        if let Some(cell) = sample {
            let ages = &self.senses.ages;
            let verdict = self.senses.producer_clock.observe(now, cell.timestamp_ns, ages.ahead_ns);
            let is_bad = verdict.is_ahead | (verdict.age_ns >= ages.sample_ns);
            believed = believed.filter(|_| !is_bad);
            cells.is_clock_off |= verdict.is_off;
        }
        let senses = &mut self.senses;
        let Look { is_news, is_stale } = senses.encoder.look(believed, &senses.ages.stale, now);
        // A cell that fails is no sample: the exchange stands, as it does without news.
        self.senses.exchange = believed.filter(|_| is_news).unwrap_or(self.senses.exchange);
        cells.exchange = self.senses.exchange;
        cells.is_exchange_new = is_news;
        cells.is_stale = is_stale;
        if let (Some(cell), true) = (sample, is_news & (self.plan.has_encoder | inputs.motion.is_some())) {
            self.evaluate(inputs, cell, cells);
        }
        cells.motion = self.senses.motion;
        cells.is_plausible = !cells.is_stale & cells.encoder_fault.is_none() & inputs.image_sound;
    }

    fn evaluate(&mut self, inputs: &Inputs, cell: &Sampled<Encoder>, cells: &mut Cells) {
        let evaluated = match inputs.motion {
            Some(exact) => {
                let seen = Evaluated { position: exact.position, speed_mrpm: i64::from(exact.speed_mrpm) };
                if cells.is_settled {
                    let spacing = self.setup.cycle_ns;
                    self.senses.evaluation.settle(&cell.payload, cell.timestamp_ns, &seen, spacing);
                }
                Ok(seen)
            }
            None => self.evaluate_signals(cell),
        };
        match evaluated {
            Ok(seen) => {
                let given = inputs.motion.and_then(|exact| exact.acceleration_mrpm_s);
                let is_asked = self.plan.bank.limits_acceleration();
                let acceleration = match given {
                    Some(given) => given,
                    None if is_asked => self.acceleration(seen.speed_mrpm, cell, cells.is_settled),
                    None => 0,
                };
                self.senses.sampled_ns = cell.timestamp_ns;
                self.senses.motion = Motion {
                    speed: seen.speed_mrpm,
                    position: seen.position,
                    acceleration,
                    torque: i64::from(cell.payload.torque_ppm),
                };
            }
            Err(fault) => {
                self.senses.evaluation.restart();
                cells.encoder_fault = Some(fault);
            }
        }
    }

    /// Own evaluation, beside the drive's own position.
    fn evaluate_signals(&mut self, cell: &Sampled<Encoder>) -> Result<Evaluated, EncoderFault> {
        let seen = self.senses.evaluation.evaluate(&cell.payload, cell.timestamp_ns);
        match &seen {
            Ok(seen) if self.plan.logic.watches_drive() => {
                let drive = cell.payload.drive_position;
                let found = self.senses.companion.observe(seen.position, drive, cell.timestamp_ns);
                self.plan.logic.watch_drive(&found, &mut self.ledger);
            }
            Ok(_) => {}
            Err(_) => self.senses.companion = Companion::new(),
        }
        seen
    }

    /// Change of speed since the sample before, 1/1000 rpm/s.
    fn acceleration(&self, speed: i64, cell: &Sampled<Encoder>, is_settled: bool) -> i64 {
        if is_settled | self.is_first {
            return 0;
        }
        let change = speed.saturating_sub(self.senses.motion.speed);
        // Skipped samples took their time; stamps that stand still count as one cycle.
        let stamped = cell.timestamp_ns.saturating_sub(self.senses.sampled_ns);
        let elapsed = if stamped == 0 { self.setup.cycle_ns } else { stamped };
        let elapsed = elapsed.clamp(1, i64::MAX as u64) as i64;
        change.saturating_mul(1_000_000_000).checked_div(elapsed).unwrap_or(i64::MAX)
    }

    fn read_io(&mut self, inputs: &Inputs, cells: &mut Cells, now: u64) {
        let io = sound(&inputs.io);
        let senses = &mut self.senses;
        let is_stale = senses.io.look(io.map(|cell| cell.sequence), &senses.ages.stale, now).is_stale;
        let payload = io.map(|cell| &cell.payload).filter(|_| !is_stale);
        let first = cells.is_settled | self.is_first;
        cells.levels = self.senses.lines.take(payload, first);
        cells.others = self.senses.lines.others();
        cells.are_lines_read = payload.is_some();
        if let Some(io) = payload {
            let ([_, first, _, second], [_, supply]) = (io.output_readback, io.dynamic_readback);
            cells.wrong_outputs = self.safe_outputs.judge(io.samples, [first, second, supply]);
        }
        let terminals = payload.map_or(0, |io| (io.ais & 1) << 4 | (io.aie & 1) << 5);
        cells.levels |= terminals as u32;
    }

    /// Takes the frame whose exchange has come. The inputs of the answer are those of the
    /// exchange before, which both channels hold.
    fn read_bus(&mut self, inputs: &Inputs, cells: &mut Cells, now: u64) {
        if !self.bus.is_used() {
            return;
        }
        self.history.note_partner(sound(&inputs.partner).map(|cell| &cell.payload));
        let command = sound(&inputs.command).map(|cell| &cell.payload);
        let command = command.filter(|command| self.bus.is_believed(command.source));
        let before = self.history.of(cells.exchange.saturating_sub(1));
        let seen = before.filter(|seen| self.plan.telegram().is_sendable(seen));
        (self.answer, cells.events) = self.bus.step(command, cells.exchange, now, seen.as_ref());
        self.plan.logic.watch_bus(&cells.events, &mut self.ledger);
    }

    fn read_command(&mut self, inputs: &Inputs, cells: &mut Cells, now: u64) {
        let command = sound(&inputs.command);
        let senses = &mut self.senses;
        let is_stale =
            senses.command.look(command.map(|cell| cell.sequence), &senses.ages.stale, now).is_stale;
        // Architecture: where frames come, the protocol's watchdog judges their age.
        let command = command.filter(|_| self.bus.is_used() | !is_stale).map(|cell| &cell.payload);
        let Some(command) = command else {
            // A connection stands on while its newest cell cannot be read.
            return self.take_word(cells, false);
        };
        if !self.bus.is_believed(command.source) {
            return;
        }
        cells.drive_n0 = command.drive_n0;
        cells.drive_enabled = command.drive_enabled;
        if !self.bus.is_used() {
            cells.word = command.word;
            cells.is_connected = true;
        }
        self.take_word(cells, command.clear_error);
    }

    fn take_word(&mut self, cells: &mut Cells, clear_error: bool) {
        if self.bus.is_used() {
            cells.word = self.bus.word();
            cells.is_connected = self.bus.is_connected();
        }
        let bit = |bit: u8| (bit != NO_BIT) && cells.word.bit(bit);
        let levels = [bit(self.plan.bits.acknowledge), bit(self.plan.bits.restart), clear_error];
        cells.acknowledge =
            (0..).zip(levels).fold(0, |all, (place, level)| all | u32::from(level) << (place & 3));
    }

    fn read_partner(&mut self, inputs: &Inputs, cells: &mut Cells, now: u64) {
        let partner: Option<&Sampled<Report>> = sound(&inputs.partner);
        let is_news = self.senses.partner.observe(partner.map(|cell| cell.payload.exchange), now);
        let stand_together = !is_news & !cells.is_exchange_new;
        if stand_together {
            // DEC-23 counts exchange cycles: a producer that stands still is not the partner's loss.
            self.senses.partner.hold(self.setup.cycle_ns);
        }
        let is_lost = !is_news && self.senses.partner.is_stale(&self.senses.ages.lost, now);
        cells.is_partner_lost = is_lost & !cells.is_settled;
        cells.partner_phase = partner.filter(|_| !is_lost).map(|cell| cell.payload.phase);
        if is_lost {
            self.senses.partner_clock.restart();
        }
        let drives = partner.is_some_and(|cell| cell.payload.driving);
        self.senses.partner_drives = drives & !is_lost;
        if let (Some(cell), true) = (partner, is_news) {
            let verdict = self.senses.partner_clock.observe(now, cell.payload.time_ns, u64::MAX);
            cells.is_clock_off |= verdict.is_off;
        }
    }

    fn read_agreement(&mut self, inputs: &Inputs, cells: &mut Cells, now: u64) {
        self.senses.agreed.note_published(inputs.published);
        let agreement: Option<&Sampled<Agreement>> = sound(&inputs.agreement);
        let senses = &mut self.senses;
        let sequence = agreement.map(|cell| cell.sequence);
        let is_lost = senses.agreement.look(sequence, &senses.ages.lost, now).is_stale;
        cells.is_agreement_lost = is_lost & !cells.is_settled;
        if cells.is_settled {
            return;
        }
        let agreed = &mut self.senses.agreed;
        if is_lost {
            agreed.forget();
            return;
        }
        agreed.take(&inputs.agreement, self.setup.boot_nonce);
        cells.crosscheck_error = agreed.has_error();
        let heard = agreed.heard(cells.exchange, self.senses.ages.echo);
        (cells.is_agreed, cells.permits, cells.path_test) = (heard.is_agreed, heard.permits, heard.path_test);
    }
}
