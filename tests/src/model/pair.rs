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
    pub sto_bit: u8,
    /// The status bit that shows errors.
    pub error_bit: u8,
    /// Status bits that are 0 in STO (DEC-14).
    pub cleared_in_sto: Word,
    /// Status bits that show a stop, which is an item of its own.
    pub stop_bits: &'static [u8],
    /// Code of a lasting difference, by the stop one channel is alone in.
    pub code: fn(StopState) -> [u32; 4],
}

/// A word with the given bits set.
pub fn word_of(bits: &[u8]) -> Word {
    bits.iter().fold(Word::ZERO, |word, bit| word.with(*bit, true))
}

/// DEC-45: 2, 3, 4 one channel alone in STO, SS1, SS2; 8 any other item.
fn info2(alone_in: StopState) -> u32 {
    match alone_in {
        StopState::Sto => 2,
        StopState::Ss1 => 3,
        StopState::Ss2 => 4,
        _ => 8,
    }
}

fn amk_code(alone_in: StopState) -> [u32; 4] {
    [3606, 13, info2(alone_in), 0]
}

/// ETG-ERR-03 leaves codes to the maker.
fn etg_code(alone_in: StopState) -> [u32; 4] {
    [0xFF00 + info2(alone_in), 0, 0, 0]
}

/// "Internal error, STO active", the nearest of the catalogue.
fn lenze_code(_: StopState) -> [u32; 4] {
    [1, 0, 0, 0]
}

/// SME0D4, the nearest of the catalogue.
fn atv_code(_: StopState) -> [u32; 4] {
    [0x0D4, 0, 0, 0]
}

/// One row for each profile: bits by OR, STO bit, error bit, bits cleared in STO, codes.
struct Row(&'static [u8], u8, u8, &'static [u8], fn(StopState) -> [u32; 4]);

fn row_of(profile: Profile) -> Row {
    use shm_schema::facts::{amk_kw, atv340, etg_6100_2, lenze_sm301};
    match profile {
        // AMK-FSOE-10: what monitors or brakes.
        Profile::AmkKw => {
            use amk_kw::status as s;
            Row(&[s::ERROR], s::STO, s::ERROR, &[3, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 26, 27], amk_code)
        }
        // DEC-41: SDI bits say "moving"; SSM, SCA, brake and moving bits go on (DEC-14).
        Profile::Etg61002 => {
            use etg_6100_2::status as s;
            let monitors = &[3, 4, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 24, 25, 26, 27, 28, 29, 30, 31];
            let by_or = &[s::ERROR, s::SDIP, s::SDIN, s::RESTART_ACKNOWLEDGE_REQUEST];
            Row(by_or, s::STO, s::ERROR, monitors, etg_code)
        }
        Profile::LenzeSm301 => {
            use lenze_sm301::status as s;
            Row(&[s::ERROR_ACTIVE], s::STO_ACTIVE, s::ERROR_ACTIVE, LENZE_MONITORS, lenze_code)
        }
        Profile::Atv340 => {
            use atv340::status as s;
            let monitors = &[s::SS1, s::SLS, s::SMS, s::SMS_THRESHOLD_2];
            Row(&[s::SAFETY_ERROR, s::RESTART_REQUIRED], s::STO, s::SAFETY_ERROR, monitors, atv_code)
        }
        Profile::None => panic!("no model without a profile"),
    }
}

/// Bits of STO, SS1 and SS2 in the status word.
fn stop_bits_of(profile: Profile) -> &'static [u8] {
    use shm_schema::facts::{amk_kw, atv340, lenze_sm301};
    match profile {
        Profile::AmkKw => &[amk_kw::status::STO, amk_kw::status::SS1_ACTIVE, amk_kw::status::SS2_ACTIVE],
        Profile::LenzeSm301 => {
            use lenze_sm301::status as s;
            &[s::STO_ACTIVE, s::SS1_ACTIVE, s::SS2_ACTIVE]
        }
        Profile::Atv340 => &[atv340::status::STO, atv340::status::SS1],
        _ => &[0],
    }
}

/// DEC-42: what is active or monitored.
const LENZE_MONITORS: &[u8] = {
    use shm_schema::facts::lenze_sm301::status as s;
    &[
        s::SS1_ACTIVE,
        s::SS2_ACTIVE,
        s::SLS1_ACTIVE,
        s::SLS2_ACTIVE,
        s::SLS3_ACTIVE,
        s::SLS4_ACTIVE,
        s::SDIPOS_ACTIVE,
        s::SDINEG_ACTIVE,
        s::SLI_ACTIVE,
        s::SOS_MONITORED,
        s::SLS1_MONITORED,
        s::SLS2_MONITORED,
        s::SLS3_MONITORED,
        s::SLS4_MONITORED,
        s::SDIPOS_MONITORED,
        s::SDINEG_MONITORED,
    ]
};

impl Rules {
    /// The rules of a profile.
    ///
    /// # Panics
    /// On [`Profile::None`].
    pub fn of(profile: Profile, parameters: &BTreeMap<u32, i32>) -> Self {
        let factor_key = if profile == Profile::AmkKw { 105 } else { common::CC_FACTOR };
        let factor = i64::from(parameters.get(&factor_key).copied().unwrap_or(7));
        let Row(by_or, sto_bit, error_bit, cleared, code) = row_of(profile);
        Self {
            tcc: (factor + 1) * 15,
            combined_by_or: word_of(by_or),
            sto_bit,
            error_bit,
            cleared_in_sto: word_of(cleared),
            stop_bits: stop_bits_of(profile),
            code,
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
        let different = differences(a, b, self.rules.stop_bits);
        self.different_since.retain(|item, _| different.contains(item));
        for item in different {
            self.different_since.entry(item).or_insert(self.cycle);
        }
        let codes = self.lasting_differences(a, b);
        self.errors.extend(codes);
    }

    fn lasting_differences(&self, a: &ChannelView, b: &ChannelView) -> BTreeSet<[u32; 4]> {
        let different = differences(a, b, self.rules.stop_bits);
        self.different_since
            .iter()
            .filter(|(item, since)| different.contains(item) && self.cycle - **since >= self.rules.tcc)
            .map(|(item, _)| (self.rules.code)(item.alone_in()))
            .collect()
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
            for bit in [self.rules.sto_bit, self.rules.error_bit] {
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
