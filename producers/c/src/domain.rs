//! An open domain as C holds it: publishers of the cells this process writes, readers of the
//! rest, one for each axis.

use std::time::Duration;

use producers::cells::{Cell, Domain, Place, Publisher, Subscriber, Trouble, within};
use shm_schema::answer::Answer;
use shm_schema::cell::Kind;
use shm_schema::command::Command;
use shm_schema::drive::DriveRequest;
use shm_schema::encoder::Encoder;
use shm_schema::inhibit::{Inhibit, Readback};
use shm_schema::io::Io;

/// Longest wait for the domain.
const DEADLINE: Duration = Duration::from_secs(2);

/// `SAFEPAIR_ENCODER` and its sisters.
pub mod write {
    /// `SAFEPAIR_ENCODER`
    pub const ENCODER: u32 = 1;
    /// `SAFEPAIR_IO`
    pub const IO: u32 = 2;
    /// `SAFEPAIR_READBACK`
    pub const READBACK: u32 = 4;
    /// `SAFEPAIR_COMMAND`
    pub const COMMAND: u32 = 8;
    /// All there are.
    pub const ALL: u32 = 15;
}

/// `safepair_domain`
#[derive(Debug)]
pub struct Handle {
    axes: Vec<u8>,
    /// Empty: written by somebody else.
    pub encoder: Vec<Publisher<Encoder>>,
    /// Likewise.
    pub io: Vec<Publisher<Io>>,
    /// Likewise.
    pub readback: Vec<Publisher<Readback>>,
    /// Likewise.
    pub command: Vec<Publisher<Command>>,
    /// Paths of A, paths of B.
    pub inhibit: [Vec<Subscriber<Inhibit>>; 2],
    /// What the drives are asked.
    pub request: Vec<Subscriber<DriveRequest>>,
    /// Answers of A, answers of B.
    pub answer: [Vec<Subscriber<Answer>>; 2],
    // Last: the node must outlive what was made with it.
    _domain: Domain,
}

impl Handle {
    /// Opens everything, within the deadline.
    pub fn open(place: Place, axes: Vec<u8>, publish: u32) -> Result<Self, Trouble> {
        within(DEADLINE, move || Self::open_now(&place, axes, publish))
    }

    fn open_now(place: &Place, axes: Vec<u8>, publish: u32) -> Result<Self, Trouble> {
        fn own<T: Cell>(
            domain: &Domain,
            kind: Kind,
            axes: &[u8],
            wanted: bool,
        ) -> Result<Vec<Publisher<T>>, Trouble> {
            if wanted { domain.publishers(kind, axes) } else { Ok(Vec::new()) }
        }
        let domain = Domain::open(place)?;
        let wants = |bit: u32| publish & bit != 0;
        Ok(Self {
            encoder: own(&domain, Kind::Encoder, &axes, wants(write::ENCODER))?,
            io: own(&domain, Kind::Io, &axes, wants(write::IO))?,
            readback: own(&domain, Kind::Readback, &axes, wants(write::READBACK))?,
            command: own(&domain, Kind::Command, &axes, wants(write::COMMAND))?,
            inhibit: [domain.subscribers(Kind::InhibitA, &axes)?, domain.subscribers(Kind::InhibitB, &axes)?],
            request: domain.subscribers(Kind::DriveRequest, &axes)?,
            answer: [domain.subscribers(Kind::AnswerA, &axes)?, domain.subscribers(Kind::AnswerB, &axes)?],
            axes,
            _domain: domain,
        })
    }

    /// Place of an axis in every list.
    pub fn at(&self, axis: u8) -> Option<usize> {
        self.axes.iter().position(|known| *known == axis)
    }
}
