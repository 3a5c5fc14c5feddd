//! Watching the others, and the own path.

use shm_schema::error::ErrorCode;
use shm_schema::exchange::Inputs;
use shm_schema::inhibit::Inhibit;
use shm_schema::report::{Phase, Report};
use shm_schema::word::Word;

use super::Monitor;
use super::senses::Cells;
use crate::compare::{Differences, Said};
use crate::encoder::EncoderFault;
use crate::inputs::PulseFault;
use crate::ledger::{Cause, Entry};
use crate::path::{Path, PathFaults};

/// 3609/74: the check sum of the set is wrong, channel 2.
const IMAGE_BROKEN: ErrorCode = ErrorCode::amk(3609, 74, 0, 4);
/// 3606/7/3: position values contradict each other; also a sample that no longer comes.
const IMPLAUSIBLE: ErrorCode = ErrorCode::amk(3606, 7, 3, 0);
/// 3606/13/1: the other channel or crosscheck is lost (DEC-23).
const PARTNER_LOST: ErrorCode = ErrorCode::amk(3606, 13, 1, 0);
/// 3607/72/2: clock monitoring, channel 2 (DEC-26).
const CLOCK: ErrorCode = ErrorCode::amk(3607, 72, 2, 0);
/// 3607/29/6: cycle time above the tolerance.
const OVERRUN: ErrorCode = ErrorCode::amk(3607, 29, 6, 0);

const fn encoder_code(fault: EncoderFault) -> ErrorCode {
    match fault {
        EncoderFault::Absent | EncoderFault::Status => ErrorCode::amk(3607, 6, 4, 0),
        EncoderFault::SineLarge => ErrorCode::amk(3606, 6, 1, 0),
        EncoderFault::SineSmall => ErrorCode::amk(3606, 6, 2, 0),
        EncoderFault::Quadrant => ErrorCode::amk(3606, 6, 3, 0),
        EncoderFault::ResolverSmall => ErrorCode::amk(3606, 4, 1, 0),
        EncoderFault::ResolverLarge => ErrorCode::amk(3606, 4, 2, 0),
        EncoderFault::Implausible => IMPLAUSIBLE,
    }
}

impl Monitor {
    fn live(&mut self, is_wrong: bool, code: ErrorCode) {
        if is_wrong {
            self.ledger.raise(Entry::sto(self.plan.logic.internal(code), Cause::Live));
        }
    }

    /// What disturbs the exchange. Before start-up is complete nothing is driven and nothing
    /// was tripped: it is shown, withholds the next step, and ends with its cause (DEC-19).
    fn disturbed(&mut self, is_wrong: bool, code: ErrorCode) {
        let is_complete = self.startup.phase() == Phase::Operational;
        let cause = if is_complete { Cause::Live } else { Cause::Passing };
        if is_wrong {
            self.ledger.raise(Entry::sto(self.plan.logic.internal(code), cause));
        }
    }

    /// Everything that stands in the cells themselves.
    pub(super) fn supervise_cells(&mut self, inputs: &Inputs, cells: &Cells, now: u64) {
        let is_booting = self.startup.phase() == Phase::Boot;
        self.live(!inputs.image_sound, IMAGE_BROKEN);
        self.disturbed(cells.is_stale & !is_booting, IMPLAUSIBLE);
        if let Some(fault) = cells.encoder_fault {
            self.live(true, encoder_code(fault));
        }
        self.watch_clocks(cells.is_clock_off);
        self.disturbed(cells.overruns >= self.senses.ages.overruns, OVERRUN);
        // Before pairing nobody can be lost.
        let is_paired = !matches!(self.startup.phase(), Phase::Boot | Phase::Refused | Phase::Pairing);
        let is_lost = cells.is_partner_lost | cells.is_agreement_lost;
        self.disturbed(is_lost & is_paired, PARTNER_LOST);
        // Design 3.7: a driven path that lost its agreement does not come back by itself, even
        // when the agreement does.
        self.live(self.has_lapsed, PARTNER_LOST);
        self.supervise_pulses();
        self.plan.logic.watch_outputs(cells.wrong_outputs, &mut self.ledger);
        self.supervise_paths(inputs, cells, now);
    }

    /// DEC-26. A clock that has run wrong once under torque is not trusted again before a
    /// restart (decision 0002).
    fn watch_clocks(&mut self, is_off: bool) {
        let is_trusted = self.startup.is_starting() | !is_off;
        if is_trusted {
            return self.disturbed(is_off, CLOCK);
        }
        self.ledger.raise(Entry::sto(self.plan.logic.internal(CLOCK), Cause::Lasting));
    }

    fn supervise_pulses(&mut self) {
        if !self.senses.lines.has_fault() {
            return;
        }
        let faults = self.senses.lines.lines.map(|line| line.fault());
        for (input, fault) in (1..).zip(faults) {
            let info2 = match fault {
                None => continue,
                Some(PulseFault::Missing) => 1,
                Some(PulseFault::TooShort) => 4,
            };
            self.live(true, ErrorCode::amk(3606, 19, info2, input));
        }
    }

    /// Readback: the own path (L) is 3606/76/1, the partner's (H) 3606/76/2.
    fn supervise_paths(&mut self, inputs: &Inputs, cells: &Cells, now: u64) {
        let partner = inputs.partner.as_ref().ok().map(|cell| &cell.payload);
        let tests = partner.is_some_and(|report| report.test_pulse);
        let faults = self.path.judge(cells.readback.as_ref(), (self.senses.partner_drives, tests), now);
        if cells.is_settled {
            return;
        }
        let PathFaults { own, partner, blind, dormant } = faults;
        self.live(own, ErrorCode::amk(3606, 76, 1, 0));
        self.live(partner, ErrorCode::amk(3606, 76, 2, 0));
        self.live(blind, ErrorCode::amk(3606, 76, 7, 0));
        if dormant {
            let code = self.plan.logic.internal(ErrorCode::amk(3610, 76, 6, 0));
            self.ledger.raise(Entry::warning(code, Cause::Live));
        }
    }

    /// Makes the report and compares it with the partner's of its exchange; a difference that
    /// trips does so in this cycle.
    pub(super) fn compare(
        &mut self,
        inputs: &Inputs,
        cells: &Cells,
        requested: &Word,
        is_steady: bool,
        report: &mut Report,
    ) {
        self.visit(5);
        self.visit(6);
        if is_steady {
            self.begin_report(cells, requested, report);
            self.repeat(report);
        } else {
            self.report(cells, requested, report);
            self.keep_answer(cells, report);
        }
        let said = Said::of(report, &self.limits);
        let partner = inputs.partner.as_ref().ok().map(|cell| &cell.payload);
        let Some(partner) = partner.filter(|_| !cells.is_settled) else {
            return self.comparison.keep(&said);
        };
        let is_starting = self.startup.is_starting();
        let found =
            self.comparison.compare(&said, partner, &self.limits, self.setup.partner_build, is_starting);
        self.comparison.keep(&said);
        if self.comparison.is_clear() {
            return;
        }
        self.raise_differences(&found);
        self.react(requested, cells, cells.now);
        // The stations of `react` were visited once already.
        self.flow = report.flow;
        self.report(cells, requested, report);
    }

    /// DEC-45.
    fn raise_differences(&mut self, found: &Differences) {
        for (info2, _) in (2..).zip(found.stops).filter(|(_, is_alone)| *is_alone) {
            self.disturbed(true, ErrorCode::amk(3606, 13, info2, 0));
        }
        self.disturbed(found.position, ErrorCode::amk(3606, 13, 5, 0));
        self.disturbed(found.speed, ErrorCode::amk(3606, 13, 6, 0));
        self.disturbed(found.other, ErrorCode::amk(3606, 13, 8, 0));
        self.live(found.identity, ErrorCode::amk(3606, 13, 8, 0));
    }

    /// Torque needs the own conditions, the agreement and the own comparison.
    pub(super) fn drive(&mut self, report: &mut Report, inhibit: &mut Inhibit, cells: &Cells) {
        let agrees = cells.permits & self.comparison.is_clear() & !cells.is_partner_lost;
        let is_test_raise = self.startup.raises(cells.path_test);
        let is_driving = report.ready & agrees;
        report.driving = is_driving | is_test_raise;
        self.has_lapsed = self.was_driving & report.ready & !cells.is_agreed;
        self.was_driving = is_driving;
        if is_driving {
            self.startup.note_driven();
        }
        let is_test = Path::is_test_cycle(cells.exchange, self.cycles_per_second);
        report.test_pulse = is_test & report.ready & report.driving;
        let (drives, tests) = (report.driving, report.test_pulse);
        self.path.drive(drives, tests, self.senses.partner_drives, inhibit);
        let level = |bit: u8| report.drive.outputs >> bit & 1 == 1;
        inhibit.outputs = self.safe_outputs.drive([level(1), level(3), level(5)]);
    }
}
