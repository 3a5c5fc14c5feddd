//! The order and delays of a cycle, shown with cores that do just one thing.

use shm_schema::agreement::Agreement;
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::SlotKind;
use shm_schema::exchange::{CellFault, CrosscheckInputs, CrosscheckOutputs, Inputs, Outputs};
use shm_schema::inhibit::Inhibit;
use shm_schema::profile::Profile;
use shm_schema::report::Report;

use super::*;
use crate::replay::{Words, idle_stimulus};
use crate::signals::SlotWiring;
use crate::trace::{Fault, Faults};

/// Drives its path while control bit 0 is 1 and remembers what it was given.
#[derive(Default)]
struct Obedient {
    edges: u64,
    seen: Option<Inputs>,
}

impl Channel for Obedient {
    fn step(&mut self, inputs: &Inputs, _now_ns: u64) -> Outputs {
        self.seen = Some(*inputs);
        let permit = inputs.command.is_ok_and(|command| command.payload.word.bit(0));
        self.edges += u64::from(permit);
        let exchange = inputs.encoder.map_or(0, |sample| sample.sequence);
        let report = Report { exchange, ready: permit, driving: permit, ..Report::default() };
        Outputs { report, inhibit: Inhibit { permit, edges: self.edges, ..Inhibit::default() }, answer: None }
    }
}

/// Permits when both reports are ready.
#[derive(Default)]
struct Agreeable(Option<CrosscheckInputs>);

impl Referee for Agreeable {
    fn step(&mut self, inputs: &CrosscheckInputs, _now_ns: u64) -> CrosscheckOutputs {
        self.0 = Some(*inputs);
        let ready =
            |cell: shm_schema::exchange::Received<Report>| cell.is_ok_and(|report| report.payload.ready);
        let permit = ready(inputs.report_a) & ready(inputs.report_b);
        let agreement = Agreement { permit, ..Agreement::default() };
        CrosscheckOutputs { agreement, drive: DriveRequest::default(), torque: permit }
    }
}

type Fake = Axis<Obedient, Obedient, Agreeable>;

fn fake(raw_encoder: bool) -> Fake {
    let cores = Cores { a: Obedient::default(), b: Obedient::default(), crosscheck: Agreeable::default() };
    let sine = SlotWiring::new(SlotKind::SineCosine, 1_024);
    let wiring = Wiring { slots: [sine; 2], pole_pairs: 2, inputs: [true; 4] };
    Axis::new(cores, &wiring, Options { raw_encoder, ..Options::default() })
}

fn stimulus(fault: Option<Fault>) -> Stimulus {
    let set = params::AxisSet::delivery(Profile::AmkKw, 1, "SIM");
    let faults = fault.map_or(Faults::NONE, |fault| Faults::NONE.with(fault));
    Stimulus { faults, ..idle_stimulus(&Words::of(&set)) }
}

/// Paths of a, b, both and the torque of crosscheck after each of `cycles` cycles.
fn paths(axis: &mut Fake, stimulus: &Stimulus, cycles: usize) -> Vec<(bool, bool, bool)> {
    let step = |_| {
        axis.step(stimulus);
        let [a, b, crosscheck] = axis.views();
        (a.path, b.path, crosscheck.torque)
    };
    (0..cycles).map(step).collect()
}

#[test]
fn a_settled_machine_has_torque_from_cycle_0() {
    let mut axis = fake(false);
    assert_eq!(paths(&mut axis, &stimulus(None), 1), [(true, true, true)]);
    assert!(axis.torque());
}

#[test]
fn a_frozen_channel_loses_its_path_in_the_third_cycle_without_an_edge() {
    let mut axis = fake(false);
    paths(&mut axis, &stimulus(None), 5);
    let seen = paths(&mut axis, &stimulus(Some(Fault::FreezeA)), 4);
    assert_eq!(seen.iter().map(|seen| seen.0).collect::<Vec<_>>(), [true, true, false, false]);
    assert!(seen.iter().all(|seen| seen.1), "B's path is B's");
}

#[test]
fn withdrawn_permission_shows_on_path_and_torque_in_the_same_cycle() {
    let mut axis = fake(false);
    paths(&mut axis, &stimulus(None), 5);
    let mut stop = stimulus(None);
    stop.word = stop.word.with(0, false);
    assert_eq!(paths(&mut axis, &stop, 1), [(false, false, false)]);
}

#[test]
fn a_stuck_path_stays_on_and_its_readback_says_so() {
    let mut axis = fake(false);
    paths(&mut axis, &stimulus(None), 5);
    let mut stop = stimulus(Some(Fault::StuckPathB));
    stop.word = stop.word.with(0, false);
    assert_eq!(paths(&mut axis, &stop, 2)[1], (false, true, false));
    let seen = axis.a.core.seen.and_then(|inputs| inputs.readback.ok()).expect("published");
    assert!(seen.payload.path_b && !seen.payload.path_a);
}

#[test]
fn b_reads_the_report_a_made_in_the_same_cycle_and_a_the_one_b_made_before() {
    let mut axis = fake(false);
    paths(&mut axis, &stimulus(None), 3);
    let partner = |inputs: Option<Inputs>| {
        inputs.and_then(|inputs| inputs.partner.ok()).map(|cell| cell.payload.exchange)
    };
    assert_eq!(partner(axis.a.core.seen), Some(2));
    assert_eq!(partner(axis.b.core.seen), Some(3));
    let own = axis.a.core.seen.and_then(|inputs| inputs.published).expect("published");
    assert_eq!(own.exchange, 2);
}

#[test]
fn the_agreement_acts_one_cycle_later() {
    let mut axis = fake(false);
    paths(&mut axis, &stimulus(None), 1);
    assert!(axis.a.core.seen.is_some_and(|inputs| inputs.agreement.is_err()));
    paths(&mut axis, &stimulus(None), 1);
    let seen = axis.b.core.seen.and_then(|inputs| inputs.agreement.ok()).expect("one cycle old");
    assert!(seen.payload.permit && (seen.sequence == 1));
    paths(&mut axis, &stimulus(Some(Fault::FreezeCrosscheck)), 3);
    let seen = axis.b.core.seen.and_then(|inputs| inputs.agreement.ok()).expect("the frozen one");
    assert_eq!(seen.sequence, 2);
}

#[test]
fn encoder_faults_stand_still_or_fail_their_check_sum() {
    let mut axis = fake(false);
    paths(&mut axis, &stimulus(None), 2);
    paths(&mut axis, &stimulus(Some(Fault::StaleEncoder)), 2);
    let sample = axis.a.core.seen.and_then(|inputs| inputs.encoder.ok()).expect("the old one");
    assert_eq!(sample.sequence, 2);
    paths(&mut axis, &stimulus(Some(Fault::CorruptEncoder)), 1);
    let seen = axis.a.core.seen.expect("stepped");
    assert_eq!(seen.encoder.err(), Some(CellFault::CheckSum));
    paths(&mut axis, &stimulus(Some(Fault::CorruptReportA)), 1);
    let seen = axis.b.core.seen.expect("stepped");
    assert_eq!(seen.partner.err(), Some(CellFault::CheckSum));
    assert!(axis.crosscheck.0.is_some_and(|inputs| inputs.report_a.is_err()));
}

#[test]
fn raw_signals_replace_the_motion_and_freeze_for_one_channel_only() {
    let mut axis = fake(true);
    let mut moving = stimulus(None);
    moving.faults = Faults::NONE.with(Fault::FreezeEncoder1);
    let mut slots = Vec::new();
    for cycle in 0..3 {
        moving.motion_a.position = 1_000 * cycle;
        moving.motion_b.position = 1_000 * cycle;
        axis.step(&moving);
        let sample =
            |seen: &Option<Inputs>| seen.and_then(|i| i.encoder.ok()).expect("sampled").payload.slots[0];
        slots.push((sample(&axis.a.core.seen), sample(&axis.b.core.seen)));
        let seeded = axis.a.core.seen.is_some_and(|inputs| inputs.motion.is_some());
        assert_eq!(seeded, cycle == 0, "a settled estimator starts with the speed it has had for ever");
    }
    assert_eq!(slots[2].0, slots[0].0);
    assert_ne!(slots[2].1, slots[0].1);
}
