//! Comparison of two reports of the same exchange (DEC-21), as crosscheck and each channel
//! does it.

use std::collections::{BTreeMap, BTreeSet};

use shm_schema::word::Word;

use super::rules::{Rules, word_of};
use crate::model::{ChannelView, StopState};

/// One comparable item of a report (DEC-21).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Item {
    Status(u8),
    Requested(u8),
    Input(u8),
    Acknowledge(u8),
    /// One channel alone in a stop, whatever its status word shows of it.
    Stop(u8),
    ErrorPresence,
}

impl Item {
    /// Which stop an item is about; DEC-45 gives it a number of its own.
    fn alone_in(self) -> StopState {
        match self {
            Self::Stop(0) => StopState::Sto,
            Self::Stop(1) => StopState::Ss1,
            Self::Stop(_) => StopState::Ss2,
            _ => StopState::None,
        }
    }
}

/// What one party has seen of both reports.
#[derive(Debug, Clone, Default)]
pub struct Comparison {
    different_since: BTreeMap<Item, i64>,
    errors: BTreeSet<[u32; 4]>,
}

impl Comparison {
    /// Codes that stand until they are acknowledged.
    pub fn errors(&self) -> &BTreeSet<[u32; 4]> {
        &self.errors
    }

    /// Compares the reports of exchange `cycle`: continuous inequality of the same item for
    /// the fault tolerance time is an error.
    pub fn compare(&mut self, rules: &Rules, cycle: i64, a: &ChannelView, b: &ChannelView) {
        let different = differences(a, b, rules.stop_bits);
        self.different_since.retain(|item, _| different.contains(item));
        for item in different {
            self.different_since.entry(item).or_insert(cycle);
        }
        let lasting = self.lasting(rules, cycle);
        self.errors.extend(lasting);
    }

    /// DEC-15: an edge clears what stands no longer.
    pub fn acknowledge(&mut self, rules: &Rules, cycle: i64) {
        let lasting = self.lasting(rules, cycle);
        self.errors.retain(|code| lasting.contains(code));
    }

    /// Whether a difference would be an error if it still stands in exchange `cycle`.
    pub fn may_last(&self, rules: &Rules, cycle: i64) -> bool {
        !self.lasting(rules, cycle).is_empty()
    }

    fn lasting(&self, rules: &Rules, cycle: i64) -> BTreeSet<[u32; 4]> {
        let lasting = self.different_since.iter().filter(|(_, since)| cycle - **since >= rules.tcc);
        lasting.map(|(item, _)| (rules.code)(item.alone_in())).collect()
    }
}

fn differences(a: &ChannelView, b: &ChannelView, stop_bits: &[u8]) -> BTreeSet<Item> {
    let mut items = BTreeSet::new();
    for (number, stop) in [StopState::Sto, StopState::Ss1, StopState::Ss2].into_iter().enumerate() {
        if (a.stop == stop) != (b.stop == stop) {
            items.insert(Item::Stop(number as u8));
        }
    }
    let stop_bits = word_of(stop_bits);
    let others = differing_bits(&a.status, &b.status).filter(|bit| !stop_bits.bit(*bit));
    items.extend(others.map(Item::Status));
    items.extend(differing_bits(&a.requested, &b.requested).map(Item::Requested));
    items.extend(differing_bits(&Word::from_u32(a.inputs), &Word::from_u32(b.inputs)).map(Item::Input));
    let acknowledge = (Word::from_u32(a.acknowledge), Word::from_u32(b.acknowledge));
    items.extend(differing_bits(&acknowledge.0, &acknowledge.1).map(Item::Acknowledge));
    // DEC-47: a warning of AMK is no error.
    let is_error = |code: &[u32; 4]| code[0] != 3610;
    if a.errors.iter().any(is_error) != b.errors.iter().any(is_error) {
        items.insert(Item::ErrorPresence);
    }
    items
}

fn differing_bits(one: &Word, other: &Word) -> impl Iterator<Item = u8> {
    let (one, other) = (*one, *other);
    let bits = if one == other { 0..0 } else { 0..256u16 };
    bits.map(|bit| bit as u8).filter(move |bit| one.bit(*bit) != other.bit(*bit))
}
