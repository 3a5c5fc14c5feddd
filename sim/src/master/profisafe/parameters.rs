//! F-parameter block and CRC1 (black-channel.md 7.1, 7.2).

use crc::{Algorithm, Crc};

/// Polynomial 4EAB: start 0, not reflected, not inverted.
const GENERATOR: Algorithm<u16> = Algorithm {
    width: 16,
    poly: 0x4EAB,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0,
    check: 0,
    residue: 0,
};
const CRC: Crc<u16> = Crc::<u16>::new(&GENERATOR);

/// F-parameters as the host hands them to a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameters {
    /// F_Prm_Flag1: checks, SIL, length of CRC2.
    pub flag_1: u8,
    /// F_Prm_Flag2: block id and version. Bit 3 says that F_iPar_CRC follows.
    pub flag_2: u8,
    /// F_Source_Add, 1 to 65534.
    pub source: u16,
    /// F_Dest_Add, 1 to 65534.
    pub destination: u16,
    /// F_WD_Time in ms.
    pub watchdog_ms: u16,
    /// F_iPar_CRC, sent when `flag_2` says so.
    pub ipar_crc: u32,
}

impl Parameters {
    /// SIL 3, CRC2 of three octets, V2, block id 0; host 1.
    pub const fn new(destination: u16, watchdog_ms: u16) -> Self {
        Self { flag_1: 0x08, flag_2: 0x40, source: 1, destination, watchdog_ms, ipar_crc: 0 }
    }

    const fn has_ipar_crc(&self) -> bool {
        self.flag_2 & 0x08 != 0
    }

    fn fixed(&self) -> Vec<u8> {
        let mut octets = vec![self.flag_1, self.flag_2];
        for field in [self.source, self.destination, self.watchdog_ms] {
            octets.extend(field.to_be_bytes());
        }
        octets
    }

    /// CRC1: F_iPar_CRC first, if there is one, then the block as it stands.
    pub fn crc1(&self) -> u16 {
        let mut digest = CRC.digest();
        if self.has_ipar_crc() {
            digest.update(&self.ipar_crc.to_be_bytes());
        }
        digest.update(&self.fixed());
        digest.finalize()
    }

    /// The block: F_iPar_CRC is last but one in it.
    pub fn block(&self) -> Vec<u8> {
        let mut octets = self.fixed();
        if self.has_ipar_crc() {
            octets.extend(self.ipar_crc.to_be_bytes());
        }
        octets.extend(self.crc1().to_be_bytes());
        octets
    }
}
