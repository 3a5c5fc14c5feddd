//! What can be seen of a source after a cycle.

use shm_schema::error::{ErrorCode, ErrorList};
use shm_schema::word::Word;

/// Who is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Channel A.
    A,
    /// Channel B.
    B,
    /// The combined, external view.
    Crosscheck,
}

impl Source {
    /// All, in the order of a cycle.
    pub const ALL: [Self; 3] = [Self::A, Self::B, Self::Crosscheck];

    /// Name in the output of replay.
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "a",
            Self::B => "b",
            Self::Crosscheck => "crosscheck",
        }
    }
}

/// Codes of three full lists.
const CODES_MAX: usize = 24;

/// The union of error lists: sorted, without duplicates.
#[derive(Debug, Clone, Copy, Eq, Default)]
pub struct Codes {
    codes: [ErrorCode; CODES_MAX],
    count: usize,
}

impl PartialEq for Codes {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl Codes {
    /// Becomes the union of `lists`, at most three.
    pub fn unite(&mut self, lists: &[&ErrorList]) {
        self.count = 0;
        lists.iter().flat_map(|list| list.iter()).for_each(|code| self.insert(*code));
    }

    fn insert(&mut self, code: ErrorCode) {
        let Err(place) = self.as_slice().binary_search(&code) else {
            return;
        };
        if self.count < CODES_MAX {
            self.codes.copy_within(place..self.count, place + 1);
            self.codes[place] = code;
            self.count += 1;
        }
    }

    /// The codes in order.
    pub fn as_slice(&self) -> &[ErrorCode] {
        &self.codes[..self.count]
    }
}

/// One source after a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct View {
    /// Status word of the profile.
    pub status: Word,
    /// What the source permits or drives; crosscheck: A and B and the agreement.
    pub torque: bool,
    /// State of its path after the dead-man; crosscheck: both.
    pub path: bool,
    /// Standing errors; crosscheck: the union and its own.
    pub errors: Codes,
    /// Position, increments.
    pub position: i64,
    /// Speed, 1/1000 rpm.
    pub speed_mrpm: i32,
    /// Crosscheck only: safe outputs as [`DriveRequest`](shm_schema::drive::DriveRequest) has
    /// them, with the release of the brake in bit 7.
    pub outputs: u8,
}

impl View {
    /// Whether a line of output is due: position, speed and outputs alone are no change.
    pub fn differs(&self, before: &Self) -> bool {
        let now = (self.status, self.torque, self.path);
        (now != (before.status, before.torque, before.path)) || (self.errors != before.errors)
    }
}
