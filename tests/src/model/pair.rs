//! Two channels and crosscheck in one cycle: A, then B, then crosscheck; the agreement
//! acts in the next cycle (design 10, DEC-20 to DEC-25).

use std::collections::{BTreeMap, BTreeSet};

use shm_schema::profile::{Profile, common};
use shm_schema::word::Word;

use super::{Channel, ChannelView, ModelInput, ModelOutput, StopState, View};

/// What crosscheck knows about a profile.
#[derive(Debug, Clone)]
pub struct Rules {
    /// Fault tolerance time, ms (DEC-20).
    pub tcc: i64,
    /// Status bits combined by OR: errors and moving bits (DEC-25).
    pub combined_by_or: Word,
    /// The status bit that shows STO.
    pub sto_bit: Option<u8>,
    /// The status bit that shows errors.
    pub error_bit: Option<u8>,
    /// Status bits that are 0 in STO (DEC-14).
    pub cleared_in_sto: Word,
    /// Code of a lasting difference, by the stop one channel is alone in.
    pub code: fn(StopState) -> [u32; 4],
}

/// A word with the given bits set.
pub fn word_of(bits: &[u8]) -> Word {
    bits.iter().fold(Word::ZERO, |word, bit| word.with(*bit, true))
}

/// DEC-45: 2, 3, 4 one channel alone in STO, SS1, SS2; 8 any other item.
fn amk_code(alone_in: StopState) -> [u32; 4] {
    let info2 = match alone_in {
        StopState::Sto => 2,
        StopState::Ss1 => 3,
        StopState::Ss2 => 4,
        _ => 8,
    };
    [3606, 13, info2, 0]
}

impl Rules {
    /// The rules of a profile.
    pub fn of(profile: Profile, parameters: &BTreeMap<u32, i32>) -> Self {
        let factor_key = if profile == Profile::AmkKw { 105 } else { common::CC_FACTOR };
        let factor = i64::from(parameters.get(&factor_key).copied().unwrap_or(7));
        let (or_bits, sto_bit, error_bit, cleared): (&[u8], _, _, Vec<u8>) = match profile {
            // AMK-FSOE-10: everything that monitors, bits 3 to 6 and 8 to 14.
            Profile::AmkKw => (&[7], Some(0), Some(7), vec![3, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14]),
            _ => (&[], None, None, vec![]),
        };
        Self {
            tcc: (factor + 1) * 15,
            combined_by_or: word_of(or_bits),
            sto_bit,
            error_bit,
            cleared_in_sto: word_of(&cleared),
            code: amk_code,
        }
    }
}

/// One comparable item of a report (DEC-21).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Item {
    Status(u8),
    Requested(u8),
    Input(u8),
    Acknowledge(u8),
    ErrorPresence,
}

/// What crosscheck published in the cycle before.
#[derive(Debug, Clone, Copy)]
struct Agreement {
    permit: bool,
    error: bool,
}

/// A pair of channels under crosscheck.
pub struct Pair {
    a: Box<dyn Channel>,
    b: Box<dyn Channel>,
    rules: Rules,
    cycle: i64,
    agreement: Agreement,
    different_since: BTreeMap<Item, i64>,
    errors: BTreeSet<[u32; 4]>,
    acknowledge_before: Option<(u32, u32)>,
}

impl Pair {
    /// Settled: the agreement before the first cycle counts as permitting.
    pub fn new(a: Box<dyn Channel>, b: Box<dyn Channel>, rules: Rules) -> Self {
        Self {
            a,
            b,
            rules,
            cycle: 0,
            agreement: Agreement { permit: true, error: false },
            different_since: BTreeMap::new(),
            errors: BTreeSet::new(),
            acknowledge_before: None,
        }
    }

    /// One cycle.
    pub fn step(&mut self, input: &ModelInput) -> ModelOutput {
        let before = self.agreement;
        let a = self.a.step(input, before.error);
        let b = self.b.step(input, before.error);
        // Design 3.3: a path is driven only under an agreement that permits.
        let allowed = before.permit && !before.error;
        let (driving_a, driving_b) = (a.ready && allowed, b.ready && allowed);

        self.acknowledge(&a, &b);
        self.compare(&a, &b);
        let error = !self.errors.is_empty();
        let permit = a.ready && b.ready && !error;
        self.agreement = Agreement { permit, error };
        self.cycle += 1;

        let both = driving_a && driving_b;
        ModelOutput {
            crosscheck: View {
                status: self.combined(&a, &b),
                torque: both && permit,
                path: both,
                errors: self.union(&a, &b),
            },
            a: view(a, driving_a),
            b: view(b, driving_b),
        }
    }

    /// DEC-15: an edge of either channel clears what stands no longer.
    fn acknowledge(&mut self, a: &ChannelView, b: &ChannelView) {
        let now = (a.acknowledge, b.acknowledge);
        let before = self.acknowledge_before.replace(now).unwrap_or(now);
        let rising = (now.0 & !before.0) | (now.1 & !before.1);
        if rising == 0 {
            return;
        }
        let standing: BTreeSet<[u32; 4]> = self.lasting_differences(a, b);
        self.errors.retain(|code| standing.contains(code));
    }

    /// DEC-21: continuous inequality of the same item for the fault tolerance time.
    fn compare(&mut self, a: &ChannelView, b: &ChannelView) {
        let different = differences(a, b);
        self.different_since.retain(|item, _| different.contains(item));
        for item in different {
            self.different_since.entry(item).or_insert(self.cycle);
        }
        let codes = self.lasting_differences(a, b);
        self.errors.extend(codes);
    }

    fn lasting_differences(&self, a: &ChannelView, b: &ChannelView) -> BTreeSet<[u32; 4]> {
        let different = differences(a, b);
        self.different_since
            .iter()
            .filter(|(item, since)| different.contains(item) && self.cycle - **since >= self.rules.tcc)
            .map(|(item, _)| (self.rules.code)(self.alone_in(*item)))
            .collect()
    }

    /// Which stop a differing status bit is about.
    fn alone_in(&self, item: Item) -> StopState {
        match item {
            Item::Status(bit) if Some(bit) == self.rules.sto_bit => StopState::Sto,
            Item::Status(26) => StopState::Ss1,
            Item::Status(27) => StopState::Ss2,
            _ => StopState::None,
        }
    }

    /// DEC-25: active bits by AND, error and moving bits by OR; STO and error while an
    /// error of crosscheck's own stands.
    fn combined(&self, a: &ChannelView, b: &ChannelView) -> Word {
        let own_error = !self.errors.is_empty();
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
            for bit in [self.rules.sto_bit, self.rules.error_bit].into_iter().flatten() {
                status = status.with(bit, true);
            }
        }
        status
    }

    fn union(&self, a: &ChannelView, b: &ChannelView) -> Vec<[u32; 4]> {
        let all: BTreeSet<[u32; 4]> = a.errors.iter().chain(&b.errors).chain(&self.errors).copied().collect();
        all.into_iter().collect()
    }
}

fn view(channel: ChannelView, driving: bool) -> View {
    let mut errors = channel.errors;
    errors.sort_unstable();
    errors.dedup();
    View { status: channel.status, torque: driving, path: driving, errors }
}

fn differences(a: &ChannelView, b: &ChannelView) -> BTreeSet<Item> {
    let mut items = BTreeSet::new();
    items.extend(differing_bits(&a.status, &b.status).map(Item::Status));
    items.extend(differing_bits(&a.requested, &b.requested).map(Item::Requested));
    items.extend(differing_bits(&Word::from_u32(a.inputs), &Word::from_u32(b.inputs)).map(Item::Input));
    let acknowledge = (Word::from_u32(a.acknowledge), Word::from_u32(b.acknowledge));
    items.extend(differing_bits(&acknowledge.0, &acknowledge.1).map(Item::Acknowledge));
    if a.errors.is_empty() != b.errors.is_empty() {
        items.insert(Item::ErrorPresence);
    }
    items
}

fn differing_bits(one: &Word, other: &Word) -> impl Iterator<Item = u8> {
    let (one, other) = (*one, *other);
    let bits = if one == other { 0..0 } else { 0..256u16 };
    bits.map(|bit| bit as u8).filter(move |bit| one.bit(*bit) != other.bit(*bit))
}
