//! The header every cell starts with, the kinds of cells and who writes them.
//!
//! Readers check all of it, each with code of its own, every cycle (design 3.5):
//! check sum, layout hash, kind, axis, writer, boot nonce, sequence, age.

use crate::wire::{Sink, Source, Wire};
use crate::{agreement, answer, command, drive, encoder, enumeration, inhibit, io, layout, report};

enumeration! {
    /// What a cell carries. One shared-memory service for each kind, one entry for each axis.
    pub enum Kind {
        /// No cell.
        #[default]
        None = 0,
        /// [`encoder::Encoder`]
        Encoder = 1,
        /// [`io::Io`]
        Io = 2,
        /// [`command::Command`]
        Command = 3,
        /// [`report::Report`] of channel A
        ReportA = 4,
        /// [`report::Report`] of channel B
        ReportB = 5,
        /// [`agreement::Agreement`]
        Agreement = 6,
        /// [`drive::DriveRequest`]
        DriveRequest = 7,
        /// [`inhibit::Inhibit`] of channel A
        InhibitA = 8,
        /// [`inhibit::Inhibit`] of channel B
        InhibitB = 9,
        /// [`inhibit::Readback`]
        Readback = 10,
        /// [`answer::Answer`] of channel A
        AnswerA = 11,
        /// [`answer::Answer`] of channel B
        AnswerB = 12,
    }
}

enumeration! {
    /// Who writes a cell.
    pub enum Writer {
        /// Nobody.
        #[default]
        None = 0,
        /// Drive firmware or simulated drive.
        Producer = 1,
        /// Fieldbus gateway or simulated master.
        Gateway = 2,
        /// Channel A.
        ChannelA = 3,
        /// Channel B.
        ChannelB = 4,
        /// The cross-communication process.
        Crosscheck = 5,
    }
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 12] = [
        Self::Encoder,
        Self::Io,
        Self::Command,
        Self::ReportA,
        Self::ReportB,
        Self::Agreement,
        Self::DriveRequest,
        Self::InhibitA,
        Self::InhibitB,
        Self::Readback,
        Self::AnswerA,
        Self::AnswerB,
    ];

    /// The only process that may write this cell.
    pub const fn writer(self) -> Writer {
        match self {
            Self::None => Writer::None,
            Self::Encoder | Self::Io | Self::Readback => Writer::Producer,
            Self::Command => Writer::Gateway,
            Self::ReportA | Self::InhibitA | Self::AnswerA => Writer::ChannelA,
            Self::ReportB | Self::InhibitB | Self::AnswerB => Writer::ChannelB,
            Self::Agreement | Self::DriveRequest => Writer::Crosscheck,
        }
    }

    /// Name of the cell as design section 5 writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Encoder => "encoder",
            Self::Io => "io",
            Self::Command => "command",
            Self::ReportA => "report-a",
            Self::ReportB => "report-b",
            Self::Agreement => "agreement",
            Self::DriveRequest => "drive-request",
            Self::InhibitA => "inhibit-a",
            Self::InhibitB => "inhibit-b",
            Self::Readback => "inhibit-readback",
            Self::AnswerA => "answer-a",
            Self::AnswerB => "answer-b",
        }
    }

    /// Layout hash of this kind: part of the service name `safepair/<name>/<hash>`
    /// (eight hexadecimal digits) and of every header.
    pub const fn layout(self) -> u32 {
        match self {
            Self::None => 0,
            Self::Encoder => encoder::Encoder::LAYOUT_HASH,
            Self::Io => io::Io::LAYOUT_HASH,
            Self::Command => command::Command::LAYOUT_HASH,
            Self::ReportA | Self::ReportB => report::Report::LAYOUT_HASH,
            Self::Agreement => agreement::Agreement::LAYOUT_HASH,
            Self::DriveRequest => drive::DriveRequest::LAYOUT_HASH,
            Self::InhibitA | Self::InhibitB => inhibit::Inhibit::LAYOUT_HASH,
            Self::Readback => inhibit::Readback::LAYOUT_HASH,
            Self::AnswerA | Self::AnswerB => answer::Answer::LAYOUT_HASH,
        }
    }

    /// Length of the whole cell in octets, header included.
    pub const fn length(self) -> usize {
        match self {
            Self::None => 0,
            Self::Encoder => encoder::Encoder::CELL,
            Self::Io => io::Io::CELL,
            Self::Command => command::Command::CELL,
            Self::ReportA | Self::ReportB => report::Report::CELL,
            Self::Agreement => agreement::Agreement::CELL,
            Self::DriveRequest => drive::DriveRequest::CELL,
            Self::InhibitA | Self::InhibitB => inhibit::Inhibit::CELL,
            Self::Readback => inhibit::Readback::CELL,
            Self::AnswerA | Self::AnswerB => answer::Answer::CELL,
        }
    }
}

layout! {
    /// Start of every cell. Both check sums cover octets 8 to `length - 1`, that is
    /// the rest of the header and the payload.
    pub struct Header {
        /// CRC-32 (ISO-HDLC), checked by channel A.
        pub crc32: u32,
        /// CRC-32C (iSCSI), checked by channel B.
        pub crc32c: u32,
        /// Layout hash, [`Kind::layout`].
        pub layout: u32,
        /// Octets of the whole cell, header included.
        pub length: u16,
        /// What the cell carries.
        pub kind: Kind,
        /// Who wrote it.
        pub writer: Writer,
        /// Number drawn by the supervisor for this run of the set; never 0.
        pub boot_nonce: u32,
        /// Number of the axis, 1 to 64.
        pub axis: u8,
        /// Always 0.
        pub reserved: [u8; 3],
        /// Grows by one with every update of the cell, from 1.
        pub sequence: u64,
        /// CLOCK_MONOTONIC of the writer at the update, ns.
        pub timestamp_ns: u64,
    }
}

impl Header {
    /// Header of a cell that its writer has not published yet: everything that follows from
    /// kind, axis and run.
    pub const fn of(kind: Kind, axis: u8, boot_nonce: u32) -> Self {
        Self {
            crc32: 0,
            crc32c: 0,
            layout: kind.layout(),
            length: kind.length() as u16,
            kind,
            writer: kind.writer(),
            boot_nonce,
            axis,
            reserved: [0; 3],
            sequence: 0,
            timestamp_ns: 0,
        }
    }
}

/// Octets in front of what the check sums cover.
pub const CRC_START: usize = 8;

/// A payload that travels in a cell of its own.
pub trait Payload: Wire {
    /// Octets of header and payload.
    const CELL: usize = Header::LENGTH + Self::LENGTH;
    /// Digest of header and payload layout.
    const LAYOUT_HASH: u32 = crate::wire::join(Header::LAYOUT, Self::LAYOUT);

    /// Writes header and payload into `octets` (`CELL` long); both check sums are
    /// left 0 for the writer to fill with [`seal`].
    fn write(&self, header: &Header, octets: &mut [u8]) {
        let mut sink = Sink::new(octets);
        header.put(&mut sink);
        self.put(&mut sink);
    }

    /// Reads the payload behind the header. Checks nothing but the values themselves.
    fn read(octets: &[u8]) -> Option<Self> {
        let mut source = Source::new(octets.get(Header::LENGTH..)?);
        Self::take(&mut source)
    }
}

/// Enters both check sums into a written cell.
pub fn seal(octets: &mut [u8], crc32: fn(&[u8]) -> u32, crc32c: fn(&[u8]) -> u32) {
    let Some((sums, covered)) = octets.split_first_chunk_mut::<CRC_START>() else {
        return;
    };
    let mut sink = Sink::new(sums);
    crc32(covered).put(&mut sink);
    crc32c(covered).put(&mut sink);
}

macro_rules! payload {
    ($type:ty) => {
        impl $crate::cell::Payload for $type {}
        impl $type {
            /// Octets of the whole cell.
            pub const CELL: usize = <$type as $crate::cell::Payload>::CELL;
            /// Layout hash of the cell.
            pub const LAYOUT_HASH: u32 = <$type as $crate::cell::Payload>::LAYOUT_HASH;
        }
    };
}
pub(crate) use payload;
