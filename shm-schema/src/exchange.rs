//! What one step of a core is given and what it returns.
//!
//! The shell (or replay, or the simulator) reads the cells, has the core's own guard judge
//! their form, and hands over what is left. Whether a sample is fresh enough, in order and
//! believable is judged inside the step.

use crate::agreement::Agreement;
use crate::answer::Answer;
use crate::command::Command;
use crate::drive::DriveRequest;
use crate::encoder::Encoder;
use crate::inhibit::{Inhibit, Readback};
use crate::io::Io;
use crate::report::Report;

/// Why a cell is no information.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellFault {
    /// Never written, or the service is gone.
    Missing,
    /// Shorter or longer than its kind.
    Length,
    /// Check sum wrong.
    CheckSum,
    /// Other layout hash.
    Layout,
    /// Other kind, axis or writer.
    Foreign,
    /// Other boot nonce.
    Nonce,
    /// Sequence or time stamp went backwards.
    Order,
    /// A value no enumeration knows.
    Content,
}

/// A cell that passed the reader's guard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampled<T> {
    /// Sequence of the header.
    pub sequence: u64,
    /// Time stamp of the header, ns.
    pub timestamp_ns: u64,
    /// CRC-32 of the header.
    pub crc32: u32,
    /// What the cell carries.
    pub payload: T,
}

/// A cell, or why there is none.
pub type Received<T> = Result<Sampled<T>, CellFault>;

/// Position and speed given behind the encoder evaluation: replay and simulator only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Motion {
    /// Position, increments.
    pub position: i64,
    /// Speed, 1/1000 rpm.
    pub speed_mrpm: i32,
    /// Acceleration, 1/1000 rpm/s; `None`: to be derived from the speed.
    pub acceleration_mrpm_s: Option<i64>,
}

/// The own report as the shell published it, for the comparison with the echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Published {
    /// Exchange number of the report.
    pub exchange: u64,
    /// CRC-32 of its cell.
    pub crc32: u32,
}

/// How a core begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// At power-up: DEC-19 in full.
    Cold,
    /// The first inputs have stood for ever: filters settled, no edge pending, start-up
    /// complete and acknowledged; partner, agreement and readback of the first step are
    /// taken as present and permitting (design 10, replay).
    Settled,
}

/// What a core is told once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Setup {
    /// Number of the axis, 1 to 64.
    pub axis: u8,
    /// Cycle of channel and exchange, ns: 125,000 to 4,000,000.
    pub cycle_ns: u64,
    /// Boot nonce of this run.
    pub boot_nonce: u32,
    /// How to begin.
    pub start: Start,
    /// Age of the newest valid sample, in cycles, at which it is stale; default 3.
    pub stale_cycles: u8,
    /// Overruns in a row at which the path is dropped; default 3.
    pub overruns_max: u8,
    /// Factor on every age, partner time-out, overrun limit and readback wait: 1 is the strict
    /// timing, [`RELAXED_AGE_FACTOR`] the relaxed one of simulation, refused with a GPIO path.
    pub age_factor: u8,
    /// Build identity the release manifest names for the partner; 0: not checked (simulation).
    pub partner_build: u32,
    /// The fieldbus this axis is commanded by.
    pub bus: Bus,
}

/// Factor of the relaxed timing.
pub const RELAXED_AGE_FACTOR: u8 = 10;

/// The black channel of one axis (design 9).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bus {
    /// None: frames are refused, the command is a plain word (simulation, replay) or inputs.
    None,
    /// FSoE slave.
    Fsoe {
        /// Device address, 1 to 65,535.
        address: u16,
        /// Id of the first session, drawn anew for each start; each later session uses one more.
        session_id: u16,
        /// The master has to send the SRA CRC of the set, [`crate::image`], in its application
        /// parameters; `false`: it has to send none.
        sra: bool,
    },
    /// PROFIsafe F-Device.
    Profisafe {
        /// F_Dest_Add, 1 to 65,534.
        address: u16,
    },
}

impl Setup {
    /// The defaults at a cycle of 1 ms.
    pub const fn new(axis: u8, boot_nonce: u32, start: Start) -> Self {
        Self {
            axis,
            cycle_ns: 1_000_000,
            boot_nonce,
            start,
            stale_cycles: 3,
            overruns_max: 3,
            age_factor: 1,
            partner_build: 0,
            bus: Bus::None,
        }
    }
}

/// Everything a channel's step sees.
#[derive(Debug, Clone, Copy)]
pub struct Inputs {
    /// The encoder sample.
    pub encoder: Received<Encoder>,
    /// Exact motion in place of the encoder evaluation; the sample above still gives
    /// sequence, time stamp, torque and frequency. Live shells always give `None`.
    pub motion: Option<Motion>,
    /// The safe inputs.
    pub io: Received<Io>,
    /// The command.
    pub command: Received<Command>,
    /// The partner's report.
    pub partner: Received<Report>,
    /// The agreement.
    pub agreement: Received<Agreement>,
    /// The readback of both paths.
    pub readback: Received<Readback>,
    /// The own newest published report.
    pub published: Option<Published>,
    /// Cycle overruns in a row, counted by the shell.
    pub overruns: u8,
    /// The own parameter image still passes its check (the shell walks it cyclically
    /// through the core's own check, at least every 10 s).
    pub image_sound: bool,
}

/// Everything a channel's step decides.
#[derive(Debug, Clone, Copy)]
pub struct Outputs {
    /// To publish as `report-a` or `report-b`.
    pub report: Report,
    /// To drive on the own path: `permit`, and `edges` one higher than before when the
    /// path is to be refreshed in this cycle.
    pub inhibit: Inhibit,
    /// A new answer on the black channel, to publish as `answer-a` or `answer-b`.
    pub answer: Option<Answer>,
}

/// Everything crosscheck's step sees.
#[derive(Debug, Clone, Copy)]
pub struct CrosscheckInputs {
    /// Report of A.
    pub report_a: Received<Report>,
    /// Report of B.
    pub report_b: Received<Report>,
    /// Readback of both paths.
    pub readback: Received<Readback>,
    /// Newest encoder sample: the exchange that is due, and the producer's clock.
    pub encoder_sequence: Option<u64>,
    /// Cycle overruns in a row, counted by the shell.
    pub overruns: u8,
}

/// Everything crosscheck's step decides.
#[derive(Debug, Clone, Copy)]
pub struct CrosscheckOutputs {
    /// To publish.
    pub agreement: Agreement,
    /// To publish: what the drive is asked, combined to the safe side.
    pub drive: DriveRequest,
    /// A and B and the agreement permit torque.
    pub torque: bool,
}
