//! Octets of a telegram and CRC2 (black-channel.md 7.3, 7.4).

use crc::{Algorithm, Crc};

/// Polynomial 5D6DCB, 24 bits; the start value is CRC1.
const GENERATOR: Algorithm<u32> = Algorithm {
    width: 24,
    poly: 0x5D_6D_CB,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0,
    check: 0,
    residue: 0,
};
const CRC: Crc<u32> = Crc::<u32>::new(&GENERATOR);

/// Octets after the data: status or control, and three of CRC2.
pub const TRAILER: usize = 4;

/// A telegram taken apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Telegram {
    /// F-data.
    pub data: Vec<u8>,
    /// Control octet of a host, status octet of a device.
    pub octet: u8,
    /// CRC2.
    pub check_sum: u32,
}

impl Telegram {
    /// Puts a telegram together, with the check sum for `number`.
    pub fn build(data: &[u8], octet: u8, crc1: u16, number: u32) -> Self {
        Self { data: data.to_vec(), octet, check_sum: check_sum(data, octet, crc1, number) }
    }

    /// Takes a telegram of `data` F-data octets apart; `None` when the length is another.
    pub fn parse(image: &[u8], data: usize) -> Option<Self> {
        let (data, trailer) = image.split_at_checked(data)?;
        let [octet, high, middle, low] = *trailer else { return None };
        Some(Self { data: data.to_vec(), octet, check_sum: u32::from_be_bytes([0, high, middle, low]) })
    }

    /// The telegram as it goes over the bus.
    pub fn octets(&self) -> Vec<u8> {
        let mut octets = self.data.clone();
        octets.push(self.octet);
        octets.extend(self.check_sum.to_be_bytes().iter().skip(1));
        octets
    }
}

/// CRC2: octets in reverse order, then the number, then one zero octet.
pub fn check_sum(data: &[u8], octet: u8, crc1: u16, number: u32) -> u32 {
    let mut digest = CRC.digest_with_initial(u32::from(crc1));
    digest.update(&[octet]);
    for value in data.iter().rev() {
        digest.update(&[*value]);
    }
    // Low, middle, high octet, and the zero octet after them.
    digest.update(&(number & 0x00FF_FFFF).to_le_bytes());
    digest.finalize()
}
