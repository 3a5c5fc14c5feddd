//! The structures of `include/safepair.h`, field by field, and their way into and out of the
//! cells. Their sizes are asserted here and in the header: a mismatch would be another field.

use shm_schema::answer;
use shm_schema::command::{self, CommandSource, FRAME_MAX, Frame};
use shm_schema::drive;
use shm_schema::encoder::{self, SlotKind};
use shm_schema::inhibit;
use shm_schema::io;

macro_rules! structure {
    ($(#[$meta:meta])* $name:ident, $size:literal, { $($field:ident: $type:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy)]
        pub struct $name { $(#[doc = "See the header."] pub $field: $type,)* }
        const _: () = assert!(size_of::<$name>() == $size);
    };
}

structure!(/// `safepair_slot`
    CSlot, 24, { kind: u8, status: u8, sine: i16, cosine: i16, reserved: u16, count: i32, reserved_2: i32, digital: i64, });
structure!(/// `safepair_encoder`
    CEncoder, 72, { slots: [CSlot; 2], drive_position: i64, frequency_mhz: i32, torque_ppm: i32, period_ns: u32, reserved: u32, });
structure!(/// `safepair_io`
    CIo, 136, { samples: u64, line_1: [u64; 4], line_2: [u64; 4], ais: u64, aie: u64, output_readback: [u64; 4], dynamic_readback: [u64; 2], });
structure!(/// `safepair_readback`
    CReadback, 24, { path_a: u8, path_b: u8, reserved: [u8; 6], edges_a: u64, edges_b: u64, });
structure!(/// `safepair_command`
    CCommand, 280, { source: u8, clear_error: u8, drive_n0: u8, drive_enabled: u8, frame_number: u32, frame_exchange: u64, frame_length: u16, reserved: [u8; 6], frame: [u8; FRAME_MAX], });
structure!(/// `safepair_inhibit`
    CInhibit, 40, { permit: u8, reserved: [u8; 7], edges: u64, outputs: [u64; 3], });
structure!(/// `safepair_drive_request`
    CDriveRequest, 16, { brake: u8, limit_set_point: u8, brake_open: u8, outputs: u8, deceleration_rpm_s: u32, set_point_max_mrpm: i32, set_point_min_mrpm: i32, });
structure!(/// `safepair_answer`
    CAnswer, 272, { frame_number: u32, digest: u32, number: u32, frame_length: u16, reserved: [u8; 2], frame: [u8; FRAME_MAX], });

/// 0 and 1 are what the header allows.
const fn flag(octet: u8) -> Option<bool> {
    match octet {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

/// Into a cell; `None` for a value the header does not allow.
pub trait Incoming: Copy {
    /// The payload.
    type Payload;
    /// Converts.
    fn payload(&self) -> Option<Self::Payload>;
}

/// Out of a cell.
pub trait Outgoing {
    /// The payload.
    type Payload;
    /// Converts.
    fn of(payload: &Self::Payload) -> Self;
}

impl Incoming for CEncoder {
    type Payload = encoder::Encoder;
    fn payload(&self) -> Option<encoder::Encoder> {
        let slot = |slot: &CSlot| {
            let kind = SlotKind::from_octet(slot.kind)?;
            let CSlot { status, sine, cosine, count, digital, .. } = *slot;
            Some(encoder::Slot { kind, status, sine, cosine, count, digital })
        };
        let [first, second] = &self.slots;
        Some(encoder::Encoder {
            slots: [slot(first)?, slot(second)?],
            drive_position: self.drive_position,
            frequency_mhz: self.frequency_mhz,
            torque_ppm: self.torque_ppm,
            period_ns: self.period_ns,
        })
    }
}

impl Incoming for CIo {
    type Payload = io::Io;
    fn payload(&self) -> Option<io::Io> {
        let Self { samples, line_1, line_2, ais, aie, output_readback, dynamic_readback } = *self;
        Some(io::Io { samples, line_1, line_2, ais, aie, output_readback, dynamic_readback })
    }
}

impl Incoming for CReadback {
    type Payload = inhibit::Readback;
    fn payload(&self) -> Option<inhibit::Readback> {
        let (path_a, path_b) = (flag(self.path_a)?, flag(self.path_b)?);
        Some(inhibit::Readback { path_a, path_b, edges_a: self.edges_a, edges_b: self.edges_b })
    }
}

impl Incoming for CCommand {
    type Payload = command::Command;
    fn payload(&self) -> Option<command::Command> {
        // A plain word is for simulation; drive firmware has none to give.
        let source =
            CommandSource::from_octet(self.source).filter(|source| *source != CommandSource::Plain)?;
        let fits = usize::from(self.frame_length) <= FRAME_MAX;
        fits.then_some(command::Command {
            source,
            clear_error: flag(self.clear_error)?,
            drive_n0: flag(self.drive_n0)?,
            drive_enabled: flag(self.drive_enabled)?,
            frame_number: self.frame_number,
            frame_exchange: self.frame_exchange,
            frame_length: self.frame_length,
            frame: Frame(self.frame),
            ..command::Command::default()
        })
    }
}

impl Outgoing for CInhibit {
    type Payload = inhibit::Inhibit;
    fn of(payload: &inhibit::Inhibit) -> Self {
        let inhibit::Inhibit { permit, edges, outputs } = *payload;
        Self { permit: permit.into(), reserved: [0; 7], edges, outputs }
    }
}

impl Outgoing for CDriveRequest {
    type Payload = drive::DriveRequest;
    fn of(payload: &drive::DriveRequest) -> Self {
        Self {
            brake: payload.brake.into(),
            limit_set_point: payload.limit_set_point.into(),
            brake_open: payload.brake_open.into(),
            outputs: payload.outputs,
            deceleration_rpm_s: payload.deceleration_rpm_s,
            set_point_max_mrpm: payload.set_point_max_mrpm,
            set_point_min_mrpm: payload.set_point_min_mrpm,
        }
    }
}

impl Outgoing for CAnswer {
    type Payload = answer::Answer;
    fn of(payload: &answer::Answer) -> Self {
        let answer::Answer { frame_number, digest, number, length, frame } = *payload;
        Self { frame_number, digest, number, frame_length: length, reserved: [0; 2], frame: frame.0 }
    }
}
