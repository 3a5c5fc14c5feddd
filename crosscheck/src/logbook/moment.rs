//! One axis in one cycle, as small as it can be and still explain a trip.

use shm_schema::error::{ErrorCode, ErrorList};
use shm_schema::exchange::CrosscheckOutputs;
use shm_schema::report::Report;

/// Words of a moment in ring and file.
pub const WORDS: usize = 17;
/// Codes kept for each source; the smallest, as the lists are sorted.
const CODES: usize = 2;

/// What both channels and crosscheck showed in one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Moment {
    /// Number of the axis.
    pub axis: u8,
    /// Torque was permitted by all.
    pub torque: bool,
    /// An error of crosscheck's own stood.
    pub crosscheck_error: bool,
    /// Phase of A and B, as in [`shm_schema::report::Phase`].
    pub phases: [u8; 2],
    /// Stop of A and B, as in [`shm_schema::report::Stop`].
    pub stops: [u8; 2],
    /// Debounced inputs of A and B, bits 0 to 5.
    pub inputs: [u8; 2],
    /// CLOCK_MONOTONIC, ns.
    pub now_ns: u64,
    /// Exchange number.
    pub exchange: u64,
    /// Status of A, B and combined, bits 0 to 63.
    pub status: [u64; 3],
    /// Requested functions of A and B, bits 0 to 31.
    pub requested: [u32; 2],
    /// Positions of A and B, increments.
    pub positions: [i64; 2],
    /// Speeds of A and B, 1/1000 rpm.
    pub speeds_mrpm: [i32; 2],
    /// Up to two codes of A, B and crosscheck; each field at most 65,535.
    pub errors: [[ErrorCode; CODES]; 3],
    /// Parameter signatures of A and B.
    pub signatures: [u32; 2],
}

impl Moment {
    /// What the cycle saw of `axis`; `reports` are those that were compared.
    pub fn new(
        axis: u8,
        now_ns: u64,
        reports: Option<(&Report, &Report)>,
        outputs: &CrosscheckOutputs,
    ) -> Self {
        let agreement = &outputs.agreement;
        let mut moment = Self {
            axis,
            torque: outputs.torque,
            crosscheck_error: agreement.error,
            now_ns,
            exchange: agreement.exchange,
            ..Self::default()
        };
        let [_, _, combined] = &mut moment.status;
        *combined = low(&agreement.status.0);
        if let Some((a, b)) = reports {
            moment.phases = [a.phase as u8, b.phase as u8];
            moment.stops = [a.stop as u8, b.stop as u8];
            moment.inputs = [a.inputs as u8 & 0x3F, b.inputs as u8 & 0x3F];
            moment.status = [low(&a.status.0), low(&b.status.0), low(&agreement.status.0)];
            moment.requested = [a.requested.0[0], b.requested.0[0]];
            moment.positions = [a.position, b.position];
            moment.speeds_mrpm = [a.speed_mrpm, b.speed_mrpm];
            moment.errors = [first(&a.errors), first(&b.errors), first(&agreement.errors)];
            moment.signatures = [a.parameter_signature, b.parameter_signature];
        } else {
            let [_, _, own] = &mut moment.errors;
            *own = first(&agreement.errors);
        }
        moment
    }

    /// Every code that stands, each with its source: 0 A, 1 B, 2 crosscheck.
    pub fn codes(&self) -> impl Iterator<Item = (usize, ErrorCode)> {
        let sources = self.errors.iter().enumerate();
        sources.flat_map(|(source, codes)| {
            codes.iter().filter(|code| !code.is_none()).map(move |code| (source, *code))
        })
    }

    /// What a person would call the state: everything but time, motion and exchange.
    #[must_use]
    pub fn state(&self) -> Self {
        Self { now_ns: 0, exchange: 0, positions: [0; 2], speeds_mrpm: [0; 2], ..*self }
    }

    /// The moment as words.
    pub fn to_words(&self) -> [u64; WORDS] {
        let [sa, sb, sc] = self.status;
        let [pa, pb] = self.positions.map(|position| position as u64);
        let [speed_a, speed_b] = self.speeds_mrpm.map(|speed| speed as u32);
        let [[a0, a1], [b0, b1], [c0, c1]] = self.errors.map(|codes| codes.map(pack));
        let speeds = join(speed_a, speed_b);
        let (requested, signatures) = (pair(self.requested), pair(self.signatures));
        [
            self.flags(),
            self.now_ns,
            self.exchange,
            sa,
            sb,
            sc,
            requested,
            pa,
            pb,
            speeds,
            a0,
            a1,
            b0,
            b1,
            c0,
            c1,
            signatures,
        ]
    }

    fn flags(&self) -> u64 {
        let [phase_a, phase_b] = self.phases;
        let [stop_a, stop_b] = self.stops;
        let states = phase_a & 7 | phase_b << 4;
        let stops = stop_a & 7 | stop_b << 4;
        let [inputs_a, inputs_b] = self.inputs;
        let bits = u8::from(self.torque) | u8::from(self.crosscheck_error) << 1;
        u64::from_le_bytes([self.axis, bits, states, stops, inputs_a, inputs_b, 0, 0])
    }

    /// The moment from its words.
    pub fn from_words(words: &[u64; WORDS]) -> Self {
        let [
            flags,
            now_ns,
            exchange,
            sa,
            sb,
            sc,
            requested,
            pa,
            pb,
            speeds,
            a0,
            a1,
            b0,
            b1,
            c0,
            c1,
            signatures,
        ] = *words;
        let [axis, bits, phases, stops, inputs_a, inputs_b, ..] = flags.to_le_bytes();
        Self {
            axis,
            torque: bits & 1 != 0,
            crosscheck_error: bits & 2 != 0,
            phases: [phases & 7, phases >> 4],
            stops: [stops & 7, stops >> 4],
            inputs: [inputs_a, inputs_b],
            now_ns,
            exchange,
            status: [sa, sb, sc],
            requested: split(requested),
            positions: [pa as i64, pb as i64],
            speeds_mrpm: split(speeds).map(|speed| speed as i32),
            errors: [[a0, a1], [b0, b1], [c0, c1]].map(|codes| codes.map(unpack)),
            signatures: split(signatures),
        }
    }
}

fn low(words: &[u32; 8]) -> u64 {
    join(words[0], words[1])
}

fn join(low: u32, high: u32) -> u64 {
    u64::from(low) | u64::from(high) << 32
}

fn pair(both: [u32; 2]) -> u64 {
    join(both[0], both[1])
}

fn split(word: u64) -> [u32; 2] {
    [word as u32, (word >> 32) as u32]
}

fn first(list: &ErrorList) -> [ErrorCode; CODES] {
    [list.codes[0], list.codes[1]]
}

/// Four fields in one word; a larger field shows as 65,535.
fn pack(code: ErrorCode) -> u64 {
    let fields = [code.code, code.info1, code.info2, code.info3];
    fields
        .iter()
        .rev()
        .fold(0, |word, field| word << 16 | u64::from(u16::try_from(*field).unwrap_or(u16::MAX)))
}

fn unpack(word: u64) -> ErrorCode {
    let field = |at: u32| (word >> (16 * at) & 0xFFFF) as u32;
    ErrorCode::amk(field(0), field(1), field(2), field(3))
}
