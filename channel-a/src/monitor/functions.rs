//! What the functions of the profile make of one instant.

use super::Monitor;
use crate::engine::Sample;
use crate::engine::stop::{Demand, Reaction, Stops};
use crate::profile::{self, Program, Requests, Scene};
use shm_schema::report::Phase;

impl Monitor {
    /// Stop functions, then watches, then what their violations start.
    pub(super) fn functions(&mut self, requests: &mut Requests, moving: bool) {
        let sample = self.judged;
        let stopped = self.errors.removes_torque() | self.partner.error();
        let idle = self.phase != Phase::Operational;
        let blind = !moving & !self.settles_now();
        let demand = &mut requests.demand;
        let mut forced = *demand;
        forced.fault = stopped | idle | blind;
        forced.blocked = self.errors.stand();
        let stops = &mut self.program.stops;
        stops.restart_once |= requests.restart_once;
        let was_sto = stops.is_sto();
        stops.command(forced, &sample);
        let restarts = was_sto & !stops.is_sto();
        if restarts {
            self.program.watches.restart();
        }
        let stops = &self.program.stops;
        if !stops.running().is_empty() {
            self.advance(&sample);
        }
        let monitored = self.program.stops.judges();
        self.stand_still(moving);
        self.watch(requests.watches, monitored, &sample);
        self.respond(requests, (monitored, restarts), &sample);
        forced.blocked = self.errors.stand();
        self.program.stops.note_pending(&forced, sample.now_ns);
    }

    /// What the profile judges by itself.
    fn respond(&mut self, requests: &Requests, (monitored, restarts): (bool, bool), sample: &Sample) {
        let Program { watches, stops, rules, .. } = &mut self.program;
        let response = rules.respond(&Scene { watches, stops, sample, requests, monitored, restarts });
        if let Some((code, class)) = response.error {
            self.errors.raise(code, class);
        }
        if self.program.stops.react(response.reaction, sample) {
            self.advance(sample);
        }
    }

    fn watch(&mut self, asked: u64, monitored: bool, sample: &Sample) {
        let mut wanted = Demand::default();
        let Program { watches, rules, stops, .. } = &mut self.program;
        let errors = &mut self.errors;
        watches.step(asked, monitored, sample, &mut |plan, violation| {
            let (code, class) = rules.watch_code(plan, violation);
            errors.raise(code, class);
            wanted.ask(plan.reaction);
        });
        if start(wanted, stops, sample) {
            self.advance(sample);
        }
    }

    /// One instant of the stop functions; also once more when one begins in this instant: it is
    /// in force in it (DEC-02).
    fn advance(&mut self, sample: &Sample) {
        let Program { stops, rules, .. } = &mut self.program;
        let errors = &mut self.errors;
        stops.advance(sample, &mut |violation| {
            let (code, class) = rules.stop_code(violation);
            errors.raise(code, class);
        });
    }

    fn stand_still(&mut self, moving: bool) {
        let Some(sem) = self.program.sem.as_mut().filter(|_| moving) else { return };
        let sample = self.sample;
        let Some(notice) = sem.step(sample.position, sample.now_ns) else { return };
        let (code, class, reaction) = profile::sem_code(notice);
        self.errors.raise(code, class);
        if self.program.stops.react(reaction, &sample) {
            self.advance(&sample);
        }
    }
}

/// STO first, then the stops in the order of their table; `true` when one begins to brake.
fn start(wanted: Demand, stops: &mut Stops, sample: &Sample) -> bool {
    if wanted.sto {
        stops.react(Reaction::Sto, sample);
    }
    let started = |begun, place| begun | stops.react(Reaction::Stop(place), sample);
    wanted.stops.into_iter().fold(false, started)
}
