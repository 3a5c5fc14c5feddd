//! What a step ends with: the own path, and the report.

use shm_schema::agreement::PathTest;
use shm_schema::exchange::{Inputs, Outputs};
use shm_schema::inhibit::Inhibit;
use shm_schema::report::{Phase, Report, Stop};
use shm_schema::word::Word;

use super::{BUILD, Flow, Monitor};
use crate::partner::Own;
use crate::profile::{Program, Requests, State};

impl Monitor {
    pub(super) fn conclude(
        &mut self,
        inputs: &Inputs,
        requests: &Requests,
        agrees: bool,
        mut flow: Flow,
    ) -> Outputs {
        let operational = self.phase == Phase::Operational;
        let sto = self.program.stops.is_sto() | !operational;
        let broken = self.errors.removes_torque();
        let ready = operational & !sto & !broken;
        let exchange = self.exchange();
        let accepted = self.partner.echoed() & agrees;
        let permitted = (accepted & self.partner.permitted()) | self.settles_now();
        let raised = (self.phase == Phase::SelfTest) & (self.partner.path_test() == PathTest::RaiseA);
        let faultless = !(broken | self.partner.error());
        let tested = raised & accepted & faultless;
        let driving = (ready & permitted) | tested;
        self.startup.note(self.phase, driving);
        let test_pulse = self.path.refresh(driving, exchange);
        self.driving = driving;
        flow.pass(7);
        let mut concluded = Outputs {
            report: self.report(inputs, requests, exchange, (sto, ready, driving, test_pulse), flow),
            inhibit: Inhibit { permit: driving, edges: self.path.edges(), ..Inhibit::default() },
            answer: None,
        };
        let report = &concluded.report;
        // Channel A owns the lines .1: bits 0 and 2.
        let levels = report.drive.outputs;
        concluded.inhibit.outputs = self.outputs.drive([levels & 1 != 0, levels & 4 != 0]);
        self.partner.keep(Own {
            exchange,
            phase: self.phase,
            status: report.status,
            requested: report.requested,
            inputs: report.inputs,
            acknowledgements: report.acknowledgements,
            session_id: report.session_id,
            frame_digest: report.frame_digest,
            position: report.position,
            speed: i64::from(report.speed_mrpm),
            first_error: report.errors.codes[0].code,
        });
        concluded
    }

    fn report(
        &mut self,
        inputs: &Inputs,
        requests: &Requests,
        exchange: u64,
        (sto, ready, driving, test_pulse): (bool, bool, bool, bool),
        flow: Flow,
    ) -> Report {
        let state = State {
            watches: &self.program.watches,
            stops: &self.program.stops,
            error: self.errors.stand(),
            ready: matches!(self.phase, Phase::AwaitAcknowledge | Phase::Operational),
            sto,
            requests,
            sample: &self.judged,
            output_fault: self.errors.of_outputs(),
        };
        let status: Word = self.program.rules.status(&state);
        let drive = self.program.rules.drive(&state);
        Report {
            exchange,
            partner_exchange: self.partner.exchange,
            time_ns: self.now_ns,
            parameter_signature: self.program.signature,
            build: BUILD,
            flow: flow.0,
            phase: self.phase,
            ready,
            driving,
            test_pulse,
            stop: stop_of(&self.program, sto),
            overruns: inputs.overruns,
            status,
            requested: requests.requested,
            inputs: requests.inputs,
            acknowledgements: requests.acknowledgements,
            position: self.sample.position,
            speed_mrpm: self.sample.speed.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32,
            drive,
            session_id: self.field.session_id(),
            frame_digest: self.field.digest(),
            errors: self.errors.list(),
        }
    }
}

fn stop_of(program: &Program, sto: bool) -> Stop {
    if sto {
        return Stop::Sto;
    }
    let stops = &program.stops;
    let brakes = (!stops.braking_to_sto().is_empty(), !stops.braking().is_empty());
    match (brakes, stops.standing().is_empty()) {
        ((true, _), _) => Stop::Ss1,
        ((_, true), _) => Stop::Ss2,
        (_, false) => Stop::Sos,
        _ => Stop::None,
    }
}
