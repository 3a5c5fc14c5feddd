//! The comparison of one exchange: what tolerates tcc (DEC-21) and what nothing (DEC-22).

use shm_schema::error::ErrorCode;
use shm_schema::profile::Profile;
use shm_schema::report::{Report, Stop};
use shm_schema::word::Word;

use crate::fault::{Fault, FaultSet};
use crate::limits::Limits;
use crate::profile::StatusRules;

/// Items that have a code of their own, as bits of [`Differences::named`].
const NAMED: [(u32, Fault); 4] =
    [(1, Fault::StoAlone), (2, Fault::Ss1Alone), (4, Fault::Ss2Alone), (8, Fault::State)];

/// Where two reports differ, one bit for each item of DEC-21.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Differences {
    status: [u32; 8],
    requested: [u32; 8],
    inputs: u32,
    acknowledgements: u32,
    named: u32,
}

impl Differences {
    /// Compares every item of two reports.
    pub fn between(a: &Report, b: &Report, limits: &Limits) -> Self {
        let rules = &limits.status;
        let status = unequal(&a.status, &b.status);
        let stop_bits = either(&either(&rules.sto, &rules.ss1), &rules.ss2);
        let mut unnamed = status;
        for (word, stops) in unnamed.iter_mut().zip(stop_bits.0) {
            *word &= !stops;
        }
        Self {
            status: unnamed,
            requested: unequal(&a.requested, &b.requested),
            inputs: a.inputs ^ b.inputs,
            acknowledgements: a.acknowledgements ^ b.acknowledgements,
            named: named(a, b, &status, rules) | error_presence(a, b, limits.profile) | black_channel(a, b),
        }
    }

    /// Whether the reports agree in every item.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

fn unequal(a: &Word, b: &Word) -> [u32; 8] {
    let mut different = a.0;
    for (word, other) in different.iter_mut().zip(b.0) {
        *word ^= other;
    }
    different
}

fn either(a: &Word, b: &Word) -> Word {
    let mut both = *a;
    for (word, other) in both.0.iter_mut().zip(b.0) {
        *word |= other;
    }
    both
}

fn touches(different: &[u32; 8], mask: &Word) -> bool {
    different.iter().zip(mask.0).any(|(word, bits)| word & bits != 0)
}

/// One channel alone in a stop, by its report or by its status bit.
fn named(a: &Report, b: &Report, status: &[u32; 8], rules: &StatusRules) -> u32 {
    let alone = |stop: Stop, bit: &Word| {
        let state = (a.stop == stop) != (b.stop == stop);
        state | touches(status, bit)
    };
    u32::from(alone(Stop::Sto, &rules.sto))
        | u32::from(alone(Stop::Ss1, &rules.ss1)) << 1
        | u32::from(alone(Stop::Ss2, &rules.ss2)) << 2
}

/// Presence, not equality: many codes name the channel that raises them. AMK warnings
/// (3610) do not count (DEC-47), for some of them belong to one channel's path or encoder.
fn error_presence(a: &Report, b: &Report, profile: Profile) -> u32 {
    let counts = |code: &ErrorCode| profile != Profile::AmkKw || code.code != 3610;
    let present = |report: &Report| report.errors.iter().any(counts);
    u32::from(present(a) != present(b)) << 3
}

/// Design 9: both have processed the same frame of the same session.
fn black_channel(a: &Report, b: &Report) -> u32 {
    let differs = (a.session_id != b.session_id) | (a.frame_digest != b.frame_digest);
    u32::from(differs) << 3
}

/// Since when each of 32 items differs without interruption.
#[derive(Debug, Clone, Copy)]
struct Timed {
    differing: u32,
    since_ns: [u64; 32],
}

impl Timed {
    const NEW: Self = Self { differing: 0, since_ns: [0; 32] };

    /// Starts, keeps or restarts the timers; the items whose time is over.
    fn follow(&mut self, differing: u32, patience: &Patience) -> u32 {
        let begins = differing & !self.differing;
        self.differing = differing;
        let mut expired = 0;
        for item in ones(differing) {
            let Some(since_ns) = self.since_ns.get_mut(item as usize) else { continue };
            if begins >> item & 1 == 1 {
                *since_ns = patience.now_ns;
            }
            expired |= u32::from(patience.is_over(*since_ns)) << item;
        }
        expired
    }
}

/// The numbers of the bits that are 1, lowest first.
fn ones(mut bits: u32) -> impl Iterator<Item = u32> {
    core::iter::from_fn(move || {
        let lowest = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (lowest < 32).then_some(lowest & 31)
    })
}

/// The present and how long a difference is tolerated.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::struct_field_names, reason = "units last")]
pub struct Patience {
    /// Crosscheck's clock, ns.
    pub now_ns: u64,
    /// Fault tolerance time, ns.
    pub tcc_ns: u64,
    /// Half a cycle: a wake-up that comes a little early must not cost a whole cycle.
    pub slack_ns: u64,
}

impl Patience {
    const fn is_over(&self, since_ns: u64) -> bool {
        self.now_ns.saturating_sub(since_ns).saturating_add(self.slack_ns) >= self.tcc_ns
    }
}

/// The timers of all items (DEC-21: each its own, restarted when the item agrees again).
#[derive(Debug, Clone, Copy)]
pub struct Timers {
    /// Nothing differed in the last exchange: no timer runs.
    calm: bool,
    status: [Timed; 8],
    requested: [Timed; 8],
    inputs: Timed,
    acknowledgements: Timed,
    named: Timed,
}

impl Timers {
    /// Everything agrees.
    pub const NEW: Self = Self {
        calm: true,
        status: [Timed::NEW; 8],
        requested: [Timed::NEW; 8],
        inputs: Timed::NEW,
        acknowledgements: Timed::NEW,
        named: Timed::NEW,
    };

    /// Follows the differences of one exchange; what has lasted too long.
    pub fn follow(&mut self, differences: &Differences, patience: &Patience) -> FaultSet {
        let nothing_differs = differences.is_empty();
        if self.calm & nothing_differs {
            return FaultSet::EMPTY;
        }
        self.calm = nothing_differs;
        let mut other = self.inputs.follow(differences.inputs, patience);
        other |= self.acknowledgements.follow(differences.acknowledgements, patience);
        for (timed, word) in self.status.iter_mut().zip(differences.status) {
            other |= timed.follow(word, patience);
        }
        for (timed, word) in self.requested.iter_mut().zip(differences.requested) {
            other |= timed.follow(word, patience);
        }
        let named = self.named.follow(differences.named, patience);
        let mut faults = FaultSet::EMPTY;
        faults.add_if(other != 0, Fault::State);
        for (bit, fault) in NAMED {
            faults.add_if(named & bit != 0, fault);
        }
        faults
    }
}

/// What tolerates nothing beyond one exchange (DEC-22); equal to the limit is inside (DEC-01).
pub fn at_once(a: &Report, b: &Report, limits: &Limits) -> FaultSet {
    let mut faults = FaultSet::EMPTY;
    let position = a.position.abs_diff(b.position);
    let speed = a.speed_mrpm.abs_diff(b.speed_mrpm);
    faults.add_if(position > limits.position_difference.unsigned_abs(), Fault::Position);
    faults.add_if(i64::from(speed) > limits.speed_difference_mrpm, Fault::Speed);
    let expected = |named: u32, reported: u32| (named == 0) || (named == reported);
    let identified = [
        a.parameter_signature == b.parameter_signature,
        expected(limits.signature, a.parameter_signature),
        expected(limits.build_a, a.build),
        expected(limits.build_b, b.build),
        expected(limits.flow_a, a.flow),
        expected(limits.flow_b, b.flow),
    ];
    faults.add_if(identified.contains(&false), Fault::Identity);
    faults
}
