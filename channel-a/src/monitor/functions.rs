//! What the functions of the profile make of one instant.

use super::Monitor;
use crate::engine::Sample;
use crate::engine::stop::{Reaction, STOPS};
use crate::profile::{self, Requests, Scene};
use shm_schema::report::Phase;

impl Monitor {
    /// Stop functions, then watches, then what their violations start.
    pub(super) fn functions(&mut self, requests: &mut Requests, moving: bool) {
        let n0 = self.command_cell.last().is_some_and(|cell| cell.payload.drive_n0);
        self.judged = self.program.rules.sample(self.sample, n0);
        let sample = self.judged;
        let stopped = self.errors.removes_torque() | self.partner.error();
        let idle = self.phase != Phase::Operational;
        let blind = !moving & !self.settles_now();
        let demand = &mut requests.demand;
        let mut forced = *demand;
        forced.sto |= stopped | idle | blind;
        forced.blocked = self.errors.blocks();
        let stops = &mut self.program.stops;
        stops.restart_once |= requests.restart_once;
        stops.command(forced, &sample);
        let broken = stops.advance(&sample);
        let mut monitored = !stops.is_sto();
        for violation in broken.into_iter().flatten() {
            let (code, class) = self.program.rules.stop_code(violation);
            self.errors.raise(code, class);
            monitored = true;
        }
        self.stand_still(moving);
        self.watch(requests.watches, monitored, &sample);
        self.respond(requests, monitored, &sample);
        forced.blocked = self.errors.blocks();
        self.program.stops.note_pending(&forced, sample.now_ns);
    }

    /// What the profile judges by itself.
    fn respond(&mut self, requests: &Requests, monitored: bool, sample: &Sample) {
        let watches = self.program.watches.get(..self.program.used).unwrap_or(&[]);
        let scene = Scene { watches, stops: &self.program.stops, sample, requests, monitored };
        let response = self.program.rules.respond(&scene);
        if let Some((code, class)) = response.error {
            self.errors.raise(code, class);
        }
        let before = self.program.stops.active();
        self.program.stops.react(response.reaction, sample);
        if self.program.stops.active() != before {
            self.advance_once_more(sample);
        }
    }

    fn watch(&mut self, asked: u64, monitored: bool, sample: &Sample) {
        let mut reactions = [None; STOPS + 1];
        let used = self.program.used;
        for watch in self.program.watches.iter_mut().take(used) {
            if !(monitored & watch.is_asked(asked)) {
                watch.rest();
                continue;
            }
            if let Some(violation) = watch.step(sample) {
                let (code, class) = self.program.rules.watch_code(&watch.plan, violation);
                self.errors.raise(code, class);
                if let Some(place) = reactions.get_mut(place_of(watch.plan.reaction)) {
                    *place = Some(watch.plan.reaction);
                }
            }
        }
        let before = self.program.stops.active();
        for reaction in reactions.into_iter().flatten() {
            self.program.stops.react(reaction, sample);
        }
        if self.program.stops.active() != before {
            self.advance_once_more(sample);
        }
    }

    /// A stop that begins in this instant is in force in it (DEC-02).
    fn advance_once_more(&mut self, sample: &Sample) {
        for violation in self.program.stops.advance(sample).into_iter().flatten() {
            let (code, class) = self.program.rules.stop_code(violation);
            self.errors.raise(code, class);
        }
    }

    fn stand_still(&mut self, moving: bool) {
        let sample = self.sample;
        let notice = self
            .program
            .sem
            .as_mut()
            .filter(|_| moving)
            .and_then(|sem| sem.step(sample.position, sample.now_ns));
        let Some(notice) = notice else { return };
        let (code, class, reaction) = profile::sem_code(notice);
        self.errors.raise(code, class);
        let before = self.program.stops.active();
        self.program.stops.react(reaction, &sample);
        if self.program.stops.active() != before {
            self.advance_once_more(&sample);
        }
    }
}

/// One place per reaction: STO first, then the stops in the order of the table.
fn place_of(reaction: Reaction) -> usize {
    match reaction {
        Reaction::Sto => 0,
        Reaction::Stop(place) => usize::from(place).saturating_add(1),
        Reaction::None => usize::MAX,
    }
}
