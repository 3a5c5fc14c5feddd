//! One axis: what a step does, in its order.

mod senses;
mod steady;
mod supervision;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_atv;
#[cfg(test)]
mod tests_bus;
#[cfg(test)]
mod tests_etg;
#[cfg(test)]
mod tests_lenze;
#[cfg(test)]
mod tests_lenze_plant;
#[cfg(test)]
mod tests_outputs;
#[cfg(test)]
mod tests_start;

use shm_schema::answer::Answer;
use shm_schema::drive::DriveRequest;
use shm_schema::error::ErrorCode;
use shm_schema::exchange::{Inputs, Outputs, Setup, Start};
use shm_schema::inhibit::Inhibit;
use shm_schema::report::{Phase, Report, Stop};
use shm_schema::word::Word;

use crate::BUILD;
use crate::agreed::Agreed;
use crate::bus::Bus;
use crate::bus::inputs::History;
use crate::compare::{Comparison, Limits};
use crate::encoder::Evaluation;
use crate::encoder::drive::Companion;
use crate::engine::Motion;
use crate::engine::record::{Breach, Phase as Stage, SPEED_MAX};
use crate::engine::spec::{NO_BIT, Reaction, Spec};
use crate::engine::stops::Demand;
use crate::fresh::{Clock, Freshness};
use crate::image::Image;
use crate::ledger::{Cause, Entry, Ledger, STOP};
use crate::outputs::Outputs as SafeOutputs;
use crate::path::Path;
use crate::profile::{Asked, Logic, Plan, judge, raise};
use crate::startup::{Progress, Startup};
use senses::{Acknowledges, Ages, Cells, Edges, Senses};
use steady::Steady;

/// Program-flow signature of a complete step: every station adds its number (DEC-22).
pub const FLOW: u32 = 0x0012_3456;

/// The monitoring of one axis.
#[derive(Debug, Clone, Copy)]
pub struct Monitor {
    setup: Setup,
    plan: Plan,
    limits: Limits,
    ledger: Ledger,
    startup: Startup,
    path: Path,
    comparison: Comparison,
    senses: Senses,
    bus: Bus,
    history: History,
    /// New on the black channel in this cycle.
    answer: Option<Answer>,
    safe_outputs: SafeOutputs,
    is_first: bool,
    /// The path was driven under torque in the cycle before.
    was_driving: bool,
    /// It was dropped because no accepted agreement was young enough.
    has_lapsed: bool,
    restart_pending: bool,
    /// What is requested in this cycle; of it the stop functions, and STO.
    requested: Word,
    asked: u16,
    asks_sto: bool,
    /// Requests that the profile's control word knows.
    known: Word,
    steady: Steady,
    cycles_per_second: u64,
    flow: u32,
}

/// The error of a violated stop: its own reaction follows a left line, STO anything else
/// (ETG-SS2-10).
fn violation(logic: &Logic, place: u8, spec: &Spec, breach: Breach, phase: Stage) -> Entry {
    let reaction = if breach == Breach::Line { spec.reaction } else { Reaction::Sto };
    let code = logic.code(spec, breach, phase, reaction);
    Entry { reaction, owner: STOP | place, ..Entry::sto(code, Cause::Reaction) }
}

/// Enters `levels` from bit `first` on, in its part of the word.
fn enter(word: &mut Word, first: u8, levels: u32) {
    if let Some(part) = word.0.get_mut(usize::from(first >> 5)) {
        *part |= levels << (first & 31);
    }
}

/// Bits of both, and of either.
fn common(one: &Word, other: &Word) -> Word {
    let mut parts = one.0;
    parts.iter_mut().zip(other.0).for_each(|(part, other)| *part &= other);
    Word(parts)
}

fn joined(one: &Word, other: &Word) -> Word {
    let mut parts = one.0;
    parts.iter_mut().zip(other.0).for_each(|(part, other)| *part |= other);
    Word(parts)
}

/// Factor of the timing on every age and wait (architecture, "Timing").
const fn factor(setup: &Setup) -> u8 {
    if setup.age_factor == 0 { 1 } else { setup.age_factor }
}

impl Monitor {
    /// A monitor for the image; a refused image gives one that never permits torque and
    /// holds the reasons.
    pub fn new(image: &[u8], setup: &Setup) -> Self {
        match Image::open(image) {
            Ok(opened) if opened.axis == setup.axis => Self::of(&opened, setup),
            // A set made for another axis is as bad as none (design 8, swapped image).
            Ok(_) => Self::refused(&[ErrorCode::amk(3609, 128, 6, 56)], setup),
            Err(_) => {
                let mut code = ErrorCode::default();
                crate::findings(image, &mut |found| code = found);
                Self::refused(&[code], setup)
            }
        }
    }

    fn of(image: &Image<'_>, setup: &Setup) -> Self {
        let mut monitor = Self::with(Plan::build(image), image.sra_crc(), setup);
        judge(image, &mut |code| monitor.refuse(code));
        monitor
    }

    fn refused(codes: &[ErrorCode], setup: &Setup) -> Self {
        let mut monitor = Self::with(Plan::empty(), 0, setup);
        for code in codes {
            monitor.refuse(*code);
        }
        monitor
    }

    fn refuse(&mut self, code: ErrorCode) {
        self.startup = Startup::new(Phase::Refused);
        self.ledger.raise(Entry::sto(code, Cause::Lasting));
    }

    fn with(plan: Plan, sra_crc: u32, setup: &Setup) -> Self {
        let phase = match setup.start {
            Start::Cold => Phase::Boot,
            Start::Settled => Phase::Operational,
        };
        Self {
            setup: *setup,
            limits: plan.limits(setup.cycle_ns),
            ledger: Ledger::new(),
            startup: Startup::new(phase),
            path: Path::new(factor(setup)),
            comparison: Comparison::new(),
            senses: Senses {
                ages: Ages::of(setup),
                encoder: Freshness::new(),
                io: Freshness::new(),
                command: Freshness::new(),
                partner: Freshness::new(),
                agreement: Freshness::new(),
                readback: Freshness::new(),
                producer_clock: Clock::new(factor(setup)),
                partner_clock: Clock::new(factor(setup)),
                evaluation: Evaluation::new(plan.encoder),
                companion: Companion::new(),
                lines: plan.inputs(),
                motion: Motion::default(),
                sampled_ns: 0,
                exchange: 0,
                acknowledges: Acknowledges::default(),
                agreed: Agreed::new(),
                partner_drives: false,
            },
            bus: Bus::new(setup.bus, plan.telegram(), sra_crc),
            history: History::new(),
            answer: None,
            safe_outputs: SafeOutputs::new(plan.outputs, setup.cycle_ns, factor(setup)),
            plan,
            is_first: true,
            was_driving: false,
            has_lapsed: false,
            restart_pending: false,
            requested: Word::ZERO,
            asked: 0,
            asks_sto: false,
            known: joined(&plan.bits.low, &plan.bits.high),
            steady: Steady::new(),
            cycles_per_second: 1_000_000_000_u64.checked_div(setup.cycle_ns).unwrap_or(0),
            flow: 0,
        }
    }

    /// One cycle at `now_ns` of the own clock.
    pub fn step(&mut self, inputs: &Inputs, now_ns: u64) -> Outputs {
        let (mut report, mut inhibit) = (Report::default(), Inhibit::default());
        self.run(inputs, now_ns, &mut report, &mut inhibit);
        if !self.bus.is_used() {
            return Outputs { report, inhibit, answer: None };
        }
        self.history.note_own(&report);
        Outputs { report, inhibit, answer: self.answer.take() }
    }

    fn run(&mut self, inputs: &Inputs, now_ns: u64, report: &mut Report, inhibit: &mut Inhibit) {
        let is_settled = self.is_first & (self.setup.start == Start::Settled);
        self.flow = 0;
        self.ledger.begin_cycle();
        let mut cells = Cells::new(now_ns, is_settled);
        self.read(inputs, &mut cells);
        self.supervise_cells(inputs, &cells, now_ns);
        let edges = self.senses.acknowledges.edges(cells.acknowledge, cells.is_connected, is_settled);
        if !self.plan.has_encoder {
            // LNZ-SS1-02: without encoder the drive's own standstill is all there is.
            cells.motion.speed = if cells.drive_n0 { 0 } else { SPEED_MAX };
        }
        let is_steady = self.is_steady(&cells, now_ns);
        let requested = if is_steady {
            self.stay(&cells);
            self.requested
        } else {
            self.act(&mut cells, edges, is_settled, now_ns)
        };
        // Only what time has raised in a usual cycle still has to be answered in it.
        let is_steady = is_steady & self.ledger.is_empty();
        if is_steady {
            self.visit(4);
        } else {
            self.react(&requested, &cells, now_ns);
        }
        self.compare(inputs, &cells, &requested, is_steady, report);
        self.drive(report, inhibit, &cells);
        self.is_first = false;
    }

    /// Everything that is decided in a cycle but the reactions to it; what is requested.
    fn act(&mut self, cells: &mut Cells, mut edges: Edges, is_settled: bool, now_ns: u64) -> Word {
        let asked = Asked {
            word: &cells.word,
            levels: cells.levels,
            others: cells.others,
            are_lines_read: cells.are_lines_read,
            is_starting: !matches!(self.startup.phase(), Phase::Operational | Phase::Refused),
            drive_n0: cells.drive_n0,
            drive_enabled: cells.drive_enabled,
            is_first: self.is_first,
            is_settled,
            in_sto: self.plan.stops.in_sto() & !is_settled,
            is_idle: self.plan.stops.is_idle(),
            rests: self.plan.stops.rests(now_ns),
            held: self.plan.stops.held(),
            motion: &cells.motion,
            now: now_ns,
        };
        let (restart, error) = self.plan.logic.terminals(&asked);
        edges.restart |= restart;
        edges.error |= error;
        // Crosscheck hears of a terminal through the report, as of the bus.
        cells.acknowledge |= u32::from(error) | u32::from(restart) << 1;
        self.acknowledge(edges.any(), cells);
        let mut requested =
            self.plan.logic.requests(&self.plan.bits, &asked, &self.plan.bank, &mut self.ledger);
        self.ask(&requested);
        let starts = self.start_up(cells, edges.any() | edges.restart, now_ns);
        // ETG-RST-03: the edge counts while the request is shown.
        let restart = self.plan.logic.restarts(edges.restart, self.restart_pending, now_ns);
        let in_sto = self.functions(&requested, cells, restart | starts, now_ns);
        if let Some(settled) = self.plan.logic.settle(&requested) {
            requested = settled;
            self.ask(&requested);
        }
        self.plan.logic.watch(&asked, &requested, in_sto, &mut self.ledger);
        requested
    }

    fn visit(&mut self, station: u32) {
        self.flow = self.flow << 4 | station;
    }

    /// DEC-15, DEC-16: one edge clears what may be cleared, and its function starts again.
    fn acknowledge(&mut self, edge: bool, cells: &Cells) {
        self.visit(2);
        if edge {
            let plan = &mut self.plan;
            self.ledger.acknowledge(&mut |entry| plan.settles(entry, &cells.word, &cells.motion, cells.now));
        }
    }

    /// DEC-19; whether torque becomes possible in this cycle.
    fn start_up(&mut self, cells: &Cells, edge: bool, now: u64) -> bool {
        let before = self.startup.phase();
        let is_requested = self.asked | self.ledger.demanded_stops() != 0;
        let progress = Progress {
            is_sound: cells.is_plausible,
            is_equal: cells.is_agreed & self.comparison.is_equal() & !cells.is_partner_lost,
            path_test: cells.path_test,
            readback: cells.readback,
            partner: cells.partner_phase,
            edge,
            is_stopped: is_requested | self.asks_sto | self.ledger.has_error(),
        };
        self.startup.step(&progress, self.plan.tolerance_ns, now);
        let is_operational = self.startup.phase() == Phase::Operational;
        is_operational & (before != Phase::Operational)
    }

    /// Bit n: the SOS at the end of stop n is left by a restart acknowledge only.
    const fn sos_needs_restart(&self) -> u16 {
        if self.plan.logic.waits_for_restart() { u16::MAX } else { self.plan.sos_needs_restart }
    }

    fn sto_needs_restart(&self) -> bool {
        self.plan.needs_restart | self.plan.logic.waits_for_restart()
    }

    /// A stop could be left but for the restart acknowledge.
    fn awaits_restart(&self, cells: &Cells) -> bool {
        let is_acknowledged = self.sto_needs_restart() | (self.sos_needs_restart() != 0);
        if !is_acknowledged {
            return false;
        }
        if self.plan.stops.is_idle() {
            return false;
        }
        let demand = self.demand(cells, true);
        if self.plan.stops.in_sto() {
            let is_free = demand.may_leave & self.sto_needs_restart() & !demand.sto;
            return is_free & self.plan.stops.is_released(&demand);
        }
        let waiting = demand.may_leave_sos & self.sos_needs_restart() & !demand.requests;
        waiting & self.plan.stops.standing() != 0
    }

    /// Keeps what `requested` asks of the stops: nothing new while it stays.
    fn ask(&mut self, requested: &Word) {
        if self.requested == *requested {
            return;
        }
        self.requested = *requested;
        let bit = |bit: u8| (bit != NO_BIT) && requested.bit(bit);
        self.asks_sto = bit(self.plan.bits.sto);
        self.asked = self
            .plan
            .stops
            .all()
            .fold(0, |mask, (place, stop)| mask | u16::from(bit(stop.spec.control)) << (place & 15));
    }

    fn demand(&self, cells: &Cells, restart: bool) -> Demand {
        let asked = self.asked;
        let is_operational = self.startup.phase() == Phase::Operational;
        let must = self.asks_sto | self.ledger.demands_sto() | cells.crosscheck_error;
        Demand {
            sto: must | !is_operational,
            requests: asked,
            reactions: self.ledger.demanded_stops(),
            may_leave: !self.ledger.has_error() & (restart | !self.sto_needs_restart()),
            may_leave_sos: match (self.ledger.has_error(), restart) {
                (true, _) => 0,
                (false, true) => u16::MAX,
                (false, false) => !self.sos_needs_restart(),
            },
        }
    }

    /// Stops first: what is in STO is not monitored (DEC-14). Whether that was so.
    fn functions(&mut self, requested: &Word, cells: &Cells, restart: bool, now: u64) -> bool {
        self.visit(3);
        let demand = self.demand(cells, restart | self.is_first);
        if self.plan.logic.completes_stops() {
            let freed = Demand { may_leave: !self.ledger.has_error(), ..demand };
            self.plan.stops.complete(&freed);
        }
        self.plan.stops.leave(&demand, now);
        let is_violated = self.advance_stops(&demand, &cells.motion, now);
        // The violations of one cycle are found side by side; STO is their reaction.
        let in_sto = self.plan.stops.in_sto() & !is_violated;
        let (logic, ledger) = (&self.plan.logic, &mut self.ledger);
        self.plan.bank.step(requested, in_sto, now, &cells.motion, &mut |owner, spec, breach, phase| {
            let code = logic.code(spec, breach, phase, spec.reaction);
            let reaction = if breach == Breach::Damage { Reaction::Sto } else { spec.reaction };
            ledger.raise(Entry { reaction, owner, ..Entry::sto(code, Cause::Reaction) });
        });
        in_sto
    }

    /// Whether an SS2 was violated.
    fn advance_stops(&mut self, demand: &Demand, motion: &Motion, now: u64) -> bool {
        let (logic, ledger) = (&self.plan.logic, &mut self.ledger);
        self.plan.stops.advance(demand, now, motion, &mut |place, spec, breach, phase| {
            ledger.raise(violation(logic, place, spec, breach, phase));
        })
    }

    /// What the violations of this cycle demand, in this cycle.
    fn react(&mut self, requested: &Word, cells: &Cells, now: u64) {
        self.visit(4);
        let demand = self.demand(cells, false);
        let (logic, ledger) = (&self.plan.logic, &mut self.ledger);
        self.plan.stops.join(&demand, now, &cells.motion, &mut |place, spec, breach, phase| {
            ledger.raise(violation(logic, place, spec, breach, phase));
        });
        if self.plan.stops.in_sto() {
            // DEC-14: nothing about motion is monitored or acknowledged in STO.
            self.plan.bank.step(requested, true, now, &cells.motion, &mut |_, _, _, _| ());
        }
    }

    fn show(&self, cells: &Cells, requested: &Word, awaits_restart: bool) -> Word {
        let bits = &self.plan.bits;
        let mut word = self.plan.bank.shown();
        raise(&mut word, bits.sto_active, self.plan.stops.in_sto());
        raise(&mut word, bits.error, self.ledger.has_error());
        let phase = self.startup.phase();
        raise(&mut word, bits.valid, matches!(phase, Phase::AwaitAcknowledge | Phase::Operational));
        let running = (!self.plan.stops.is_idle()).then(|| self.plan.stops.running());
        for (stop, landed) in running.into_iter().flatten() {
            raise(&mut word, stop.spec.status, !landed);
            raise(&mut word, stop.standing_status, landed);
        }
        raise(&mut word, bits.restart_request, awaits_restart);
        self.plan.logic.show(
            &mut word,
            requested,
            &cells.motion,
            &self.plan.stops,
            cells.now,
            &self.plan.bank,
        );
        if bits.pairs > 0 {
            let pairs = (1_u32 << (bits.pairs & 7)).wrapping_sub(1);
            enter(&mut word, bits.inputs, cells.levels & pairs);
        }
        word
    }

    /// What brakes comes before what stands.
    fn stop(&self) -> Stop {
        if self.plan.stops.in_sto() {
            return Stop::Sto;
        }
        if self.plan.stops.brakes_to_sto() {
            return Stop::Ss1;
        }
        match (self.plan.stops.is_in_ss2(), self.plan.stops.braking() != 0) {
            (false, _) => Stop::None,
            (true, false) => Stop::Sos,
            (true, true) => Stop::Ss2,
        }
    }

    /// Fills in a report that is empty, or one of the same cycle.
    fn report(&mut self, cells: &Cells, requested: &Word, report: &mut Report) {
        self.restart_pending = self.awaits_restart(cells);
        self.begin_report(cells, requested, report);
        report.ready &= !self.plan.stops.in_sto();
        report.stop = self.stop();
        report.status = self.show(cells, requested, self.restart_pending);
        report.drive = self.drive_request(cells, requested, &report.status, report.stop);
        self.ledger.list(&mut report.errors);
    }

    /// What every report says anew.
    fn begin_report(&self, cells: &Cells, requested: &Word, report: &mut Report) {
        report.exchange = cells.exchange;
        report.partner_exchange = cells.partner_exchange;
        report.time_ns = cells.now;
        report.parameter_signature = self.plan.signature;
        report.build = BUILD;
        report.flow = self.flow;
        report.phase = self.startup.phase();
        report.ready = report.phase == Phase::Operational;
        report.overruns = cells.overruns;
        report.requested = common(requested, &self.known);
        report.inputs = self.plan.logic.shown_inputs(cells.levels);
        report.acknowledgements = cells.acknowledge;
        report.position = cells.motion.position;
        let speed = self.senses.motion.speed;
        report.speed_mrpm = speed.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        if self.bus.is_used() {
            (report.session_id, report.frame_digest) = (self.bus.session_id(), self.bus.digest());
        }
    }

    fn drive_request(&self, cells: &Cells, requested: &Word, status: &Word, stop: Stop) -> DriveRequest {
        let in_sto = self.plan.stops.in_sto();
        let brakes = stop == Stop::Ss1;
        match &self.plan.logic {
            Logic::Amk(logic) => DriveRequest {
                brake: brakes & logic.brakes(),
                brake_open: !in_sto,
                outputs: logic.outputs(&cells.word, requested, in_sto, &|bit| self.plan.bank.stands(bit)),
                ..DriveRequest::default()
            },
            Logic::Etg(logic) => DriveRequest {
                brake_open: logic.is_brake_open(requested, &self.plan.stops, cells.now),
                ..DriveRequest::default()
            },
            Logic::Lenze(logic) => DriveRequest {
                brake_open: !in_sto,
                outputs: logic.outputs(&cells.word, status, in_sto),
                ..DriveRequest::default()
            },
            Logic::Atv(logic) => DriveRequest { brake_open: !in_sto, ..logic.drive(brakes) },
            Logic::None => DriveRequest::default(),
        }
    }
}
