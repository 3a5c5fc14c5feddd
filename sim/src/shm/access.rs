//! One cell of one axis: writing it sealed, reading it as it stands.

use std::{fmt, marker::PhantomData, sync::Arc};

use crc::{CRC_32_ISCSI, CRC_32_ISO_HDLC, Crc, Table};
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::ZeroCopySend;
use shm_schema::cell::{CRC_START, Header, Kind, Payload, seal};
use shm_schema::wire::{Source, Wire};
use shm_schema::{agreement, answer, command, drive, encoder, inhibit, io, report};

use super::{DomainError, Ipc, service_error};

static CRC_A: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);
static CRC_B: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISCSI);

fn crc32(octets: &[u8]) -> u32 {
    CRC_A.checksum(octets)
}

fn crc32c(octets: &[u8]) -> u32 {
    CRC_B.checksum(octets)
}

/// A payload with its cell as an array of octets, the value type of the blackboards.
pub trait CellValue: Payload + Default + Copy + 'static {
    /// `[u8; CELL]`
    type Octets: ZeroCopySend + Copy + AsRef<[u8]> + AsMut<[u8]> + fmt::Debug + 'static;
    /// A cell that nobody has written.
    const EMPTY: Self::Octets;
}

macro_rules! cell_values {
    ($($type:ty),*) => {$(
        impl CellValue for $type {
            type Octets = [u8; <$type>::CELL];
            const EMPTY: Self::Octets = [0; <$type>::CELL];
        }
    )*};
}
cell_values!(
    agreement::Agreement,
    answer::Answer,
    command::Command,
    drive::DriveRequest,
    encoder::Encoder,
    inhibit::Inhibit,
    inhibit::Readback,
    io::Io,
    report::Report
);

/// A whole cell with both check sums.
pub fn compose<T: CellValue>(header: &Header, payload: &T) -> T::Octets {
    let mut octets = T::EMPTY;
    payload.write(header, octets.as_mut());
    seal(octets.as_mut(), crc32, crc32c);
    octets
}

/// The only writer of one cell.
pub struct CellWriter<T: CellValue> {
    entry: EntryHandleMut<Ipc, u32, T::Octets>,
    header: Header,
    // Keeps the port alive as long as one of its entries is in use.
    _port: Arc<Writer<Ipc, u32>>,
}

impl<T: CellValue> fmt::Debug for CellWriter<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("CellWriter").field("header", &self.header).finish_non_exhaustive()
    }
}

impl<T: CellValue> CellWriter<T> {
    pub(super) fn new(
        port: &Arc<Writer<Ipc, u32>>,
        kind: Kind,
        axis: u8,
        nonce: u32,
    ) -> Result<Self, DomainError> {
        let entry = port.entry::<T::Octets>(&u32::from(axis)).map_err(service_error(kind.name()))?;
        let header = Header::of(kind, axis, nonce);
        Ok(Self { entry, header, _port: port.clone() })
    }

    /// Header of the newest update; its check sums are 0.
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// Publishes `payload` with the next sequence number. No allocation, no system call.
    pub fn publish(&mut self, payload: &T, timestamp_ns: u64) {
        self.header.sequence += 1;
        self.header.timestamp_ns = timestamp_ns;
        self.entry.update_with_copy(compose(&self.header, payload));
    }

    /// Leaves out `missed` sequence numbers: updates that never came.
    pub const fn skip(&mut self, missed: u64) {
        self.header.sequence = self.header.sequence.saturating_add(missed);
    }

    /// Publishes octets as they are: for faults that no honest writer makes.
    pub fn publish_octets(&mut self, octets: T::Octets) {
        self.entry.update_with_copy(octets);
    }
}

/// A reader of one cell.
pub struct CellReader<T: CellValue> {
    entry: EntryHandle<Ipc, u32, T::Octets>,
    kind: Kind,
    payload: PhantomData<T>,
    // Keeps the port alive as long as one of its entries is in use.
    _port: Arc<Reader<Ipc, u32>>,
}

impl<T: CellValue> fmt::Debug for CellReader<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("CellReader").field("kind", &self.kind).finish_non_exhaustive()
    }
}

impl<T: CellValue> CellReader<T> {
    pub(super) fn new(port: &Arc<Reader<Ipc, u32>>, kind: Kind, axis: u8) -> Result<Self, DomainError> {
        let entry = port.entry::<T::Octets>(&u32::from(axis)).map_err(service_error(kind.name()))?;
        Ok(Self { entry, kind, payload: PhantomData, _port: port.clone() })
    }

    /// The cell as it stands, unchecked: all zeros before the first update.
    pub fn octets(&self) -> T::Octets {
        *self.entry.get()
    }

    /// Header and payload of a sound cell of this kind; `None` before the first update.
    /// For tools and the simulated drive: a monitor checks with code of its own.
    pub fn read(&self) -> Option<(Header, T)> {
        let octets = self.octets();
        let octets = octets.as_ref();
        let header = Header::take(&mut Source::new(octets))?;
        let sound = header.crc32 == crc32(octets.get(CRC_START..)?);
        let own = (header.kind, header.layout) == (self.kind, self.kind.layout());
        if sound && own { Some((header, T::read(octets)?)) } else { None }
    }
}
