//! Two channels and crosscheck in one cycle: A, then B, then crosscheck; the agreement
//! acts in the next cycle (design 10, DEC-20 to DEC-25).

mod comparison;
mod rules;

use std::collections::BTreeSet;

use shm_schema::word::Word;

use super::{Channel, ChannelView, ModelInput, ModelOutput, View};
use comparison::Comparison;
pub use rules::Rules;

/// What crosscheck published in the cycle before.
#[derive(Debug, Clone, Copy)]
struct Agreement {
    permit: bool,
    error: bool,
}

/// The rising edges of acknowledge levels.
#[derive(Debug, Clone, Copy, Default)]
struct Edges(Option<u32>);

impl Edges {
    /// What is high from the start is no edge (DEC-16).
    fn rise(&mut self, levels: u32) -> bool {
        let before = self.0.replace(levels).unwrap_or(levels);
        levels & !before != 0
    }
}

/// One channel with its own comparison, its own acknowledges and its own path.
struct Side {
    channel: Box<dyn Channel>,
    comparison: Comparison,
    edges: Edges,
    path: bool,
}

/// Exchanges of one second, in which each channel withholds one edge: A after a quarter,
/// B after three (architecture, "Paths").
const SECOND: i64 = 1000;
const QUARTER_OF_A: i64 = 1;
const QUARTER_OF_B: i64 = 3;

impl Side {
    fn new(channel: Box<dyn Channel>) -> Self {
        Self { channel, comparison: Comparison::default(), edges: Edges::default(), path: true }
    }

    /// The evaluator: a path that is on endures a missing edge, one that is off needs an edge.
    fn drive(&mut self, driven: bool, cycle: i64, quarter: i64) -> bool {
        let is_withheld = (cycle + 1) % SECOND == quarter * SECOND / 4;
        self.path = driven && (self.path || !is_withheld);
        self.path
    }

    fn fork(&self) -> Self {
        Self {
            channel: self.channel.fork(),
            comparison: self.comparison.clone(),
            edges: self.edges,
            path: self.path,
        }
    }

    /// The step of the channel under what its own comparison and crosscheck say.
    fn step(&mut self, input: &ModelInput, agreement: Agreement, error_bit: u8) -> ChannelView {
        let own: Vec<[u32; 4]> = self.comparison.errors().iter().copied().collect();
        let mut view = self.channel.step(input, agreement.error || !own.is_empty());
        if !own.is_empty() {
            view.status = view.status.with(error_bit, true);
        }
        view.errors.extend(own);
        view
    }
}

/// A pair of channels under crosscheck.
pub struct Pair {
    a: Side,
    b: Side,
    rules: Rules,
    cycle: i64,
    agreement: Agreement,
    crosscheck: Comparison,
    edges: [Edges; 2],
    before: Option<(ChannelView, ChannelView)>,
}

impl Pair {
    /// Settled: the agreement before the first cycle counts as permitting.
    pub fn new(a: Box<dyn Channel>, b: Box<dyn Channel>, rules: Rules) -> Self {
        Self {
            a: Side::new(a),
            b: Side::new(b),
            rules,
            cycle: 0,
            agreement: Agreement { permit: true, error: false },
            crosscheck: Comparison::default(),
            edges: [Edges::default(); 2],
            before: None,
        }
    }

    /// One cycle.
    pub fn step(&mut self, input: &ModelInput) -> ModelOutput {
        let before = self.agreement;
        let a = self.step_a(input);
        let b = self.step_b(input, &a);
        // Design 3.3: a path is driven only under an agreement that permits.
        let allowed = before.permit && !before.error;
        let (driving_a, driving_b) = (a.ready && allowed, b.ready && allowed);
        let path_a = self.a.drive(driving_a, self.cycle, QUARTER_OF_A);
        let path_b = self.b.drive(driving_b, self.cycle, QUARTER_OF_B);

        // An edge counts when either channel reports it.
        let risen = [self.edges[0].rise(a.acknowledge), self.edges[1].rise(b.acknowledge)];
        if risen.contains(&true) {
            self.crosscheck.acknowledge(&self.rules, self.cycle);
        }
        self.crosscheck.compare(&self.rules, self.cycle, &a, &b);
        let error = !self.crosscheck.errors().is_empty();
        let permit = a.ready && b.ready && !error;
        self.agreement = Agreement { permit, error };
        self.cycle += 1;

        let both = driving_a && driving_b;
        let output = ModelOutput {
            crosscheck: View {
                status: self.combined(&a, &b),
                torque: both && permit,
                path: path_a && path_b,
                errors: self.union(&a, &b),
            },
            a: view(&a, driving_a, path_a),
            b: view(&b, driving_b, path_b),
        };
        self.before = Some((a, b));
        output
    }

    /// A has B's report of the cycle before, and compares it with its own of then.
    fn step_a(&mut self, input: &ModelInput) -> ChannelView {
        let side = &mut self.a;
        if side.edges.rise(side.channel.acknowledge_levels(input)) {
            side.comparison.acknowledge(&self.rules, self.cycle - 1);
        }
        if let Some((a, b)) = &self.before {
            side.comparison.compare(&self.rules, self.cycle - 1, a, b);
        }
        side.step(input, self.agreement, self.rules.error_bit)
    }

    /// B has A's report of the same cycle, and compares it with what it is about to report.
    fn step_b(&mut self, input: &ModelInput, a: &ChannelView) -> ChannelView {
        let side = &mut self.b;
        if side.edges.rise(side.channel.acknowledge_levels(input)) {
            side.comparison.acknowledge(&self.rules, self.cycle);
        }
        if self.before.is_none() {
            // Settled start: the partner of the first step counts as permitting, whatever it is.
            return side.step(input, self.agreement, self.rules.error_bit);
        }
        if !side.comparison.may_last(&self.rules, self.cycle) {
            let own = side.step(input, self.agreement, self.rules.error_bit);
            side.comparison.compare(&self.rules, self.cycle, a, &own);
            return own;
        }
        // What B would report decides whether it reports an error of its comparison too.
        let own = side.fork().step(input, self.agreement, self.rules.error_bit);
        side.comparison.compare(&self.rules, self.cycle, a, &own);
        side.step(input, self.agreement, self.rules.error_bit)
    }

    /// DEC-25: active bits by AND, error and moving bits by OR; STO and error while an
    /// error of crosscheck's own stands.
    fn combined(&self, a: &ChannelView, b: &ChannelView) -> Word {
        let own_error = !self.crosscheck.errors().is_empty();
        let mut status = Word::ZERO;
        for (part, combined) in status.0.iter_mut().enumerate() {
            let (one, other) = (a.status.0[part], b.status.0[part]);
            let by_or = self.rules.combined_by_or.0[part];
            *combined = (one & other & !by_or) | ((one | other) & by_or);
            if own_error {
                *combined &= !self.rules.cleared_in_sto.0[part];
            }
        }
        if own_error {
            for bit in [self.rules.sto_bit, self.rules.error_bit] {
                status = status.with(bit, true);
            }
        }
        status
    }

    fn union(&self, a: &ChannelView, b: &ChannelView) -> Vec<[u32; 4]> {
        let all: BTreeSet<[u32; 4]> =
            a.errors.iter().chain(&b.errors).chain(self.crosscheck.errors()).copied().collect();
        all.into_iter().collect()
    }
}

fn view(channel: &ChannelView, torque: bool, path: bool) -> View {
    let mut errors = channel.errors.clone();
    errors.sort_unstable();
    errors.dedup();
    View { status: channel.status, torque, path, errors }
}
