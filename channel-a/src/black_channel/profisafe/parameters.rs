//! The F-parameter block and its refusal codes (black-channel.md 7.1, 7.2, 8.2).

use super::super::crc;

/// Why an F-parameter block is refused, or communication disturbed, as the
/// diagnosis message names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FParameterFault {
    /// `F_Dest_Add` is not the device address.
    DestinationMismatch,
    /// `F_Dest_Add` is 0 or 65535.
    DestinationInvalid,
    /// `F_Source_Add` is 0 or 65535.
    SourceInvalid,
    /// `F_WD_Time` is 0.
    WatchdogZero,
    /// `F_SIL` is not SIL 1 to 3.
    SilTooHigh,
    /// `F_CRC_Length` is not 3 octets.
    CrcLength,
    /// `F_Par_Version` is not V2, or an expanded protocol is asked for.
    Version,
    /// `F_Par_CRC` is not the sum of the block.
    Crc1,
    /// A feature that this device does not have, or a watchdog time below the
    /// lowest it takes.
    DeviceSpecific,
    /// `F_iPar_CRC` is not that of the device's own parameters.
    IParameters,
    /// `F_Block_ID` is not offered.
    BlockId,
}

impl FParameterFault {
    /// Code of the diagnosis message (Lenze 64 to 71, black-channel.md 8.2).
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::DestinationMismatch => 0x40,
            Self::DestinationInvalid => 0x41,
            Self::SourceInvalid => 0x42,
            Self::WatchdogZero => 0x43,
            Self::SilTooHigh => 0x44,
            Self::CrcLength => 0x45,
            Self::Version => 0x46,
            Self::Crc1 => 0x47,
            Self::DeviceSpecific => 0x48,
            Self::IParameters => 0x4B,
            Self::BlockId => 0x4C,
        }
    }
}

/// The fields of a block; numbers are high octet first on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FParameters {
    /// Sequence and iParameter check, SIL, CRC length, CRC seed.
    pub flag_1: u8,
    /// Passivation, block id, parameter version.
    pub flag_2: u8,
    /// Address of the host, 1 to 65534.
    pub source: u16,
    /// Address of the device, 1 to 65534.
    pub destination: u16,
    /// Watchdog time in milliseconds, 1 to 65535.
    pub watchdog_ms: u16,
    /// Sum over the iParameters, with block id 1.
    pub ipar_crc: Option<u32>,
    /// `F_Par_CRC`: sum over all of the above, preset of every CRC2.
    pub crc1: u16,
    /// Whether the length of the block is that of its `F_Block_ID`.
    length_fits: bool,
}

/// What the block is checked against.
#[derive(Clone, Copy)]
pub(super) struct Demand {
    pub(super) address: u16,
    pub(super) ipar_crc: Option<u32>,
    pub(super) lowest_watchdog_ms: u16,
}

impl FParameters {
    /// Reads a block of 10, 12, 14 or 16 octets; `None` for other lengths.
    #[must_use]
    pub fn parse(block: &[u8]) -> Option<Self> {
        let (fixed, rest) = block.split_first_chunk::<8>()?;
        let (middle, crc1) = rest.split_last_chunk::<2>()?;
        let [flag_1, flag_2, fields @ ..] = *fixed;
        let [source_high, source_low, dest_high, dest_low, time_high, time_low] = fields;
        let expected_middle = match block_id(flag_2) {
            0 => 0,
            1 => 4,
            2 => 2,
            _ => 6,
        };
        if !matches!(middle.len(), 0 | 2 | 4 | 6) {
            return None;
        }
        let ipar_crc = middle.last_chunk::<4>().copied().map(u32::from_be_bytes);
        Some(Self {
            flag_1,
            flag_2,
            source: u16::from_be_bytes([source_high, source_low]),
            destination: u16::from_be_bytes([dest_high, dest_low]),
            watchdog_ms: u16::from_be_bytes([time_high, time_low]),
            ipar_crc,
            crc1: u16::from_be_bytes(*crc1),
            length_fits: middle.len() == expected_middle,
        })
    }

    /// CRC1 as it ought to be: `F_iPar_CRC` comes last but one in the block
    /// and first here. Where a second watchdog time enters is mark L, which is
    /// one reason why blocks with it are refused.
    #[must_use]
    pub fn expected_crc1(&self) -> u16 {
        let [source_high, source_low] = self.source.to_be_bytes();
        let [dest_high, dest_low] = self.destination.to_be_bytes();
        let [time_high, time_low] = self.watchdog_ms.to_be_bytes();
        let fixed =
            [self.flag_1, self.flag_2, source_high, source_low, dest_high, dest_low, time_high, time_low];
        let ipar = self.ipar_crc.map(u32::to_be_bytes);
        crc::f_parameter_sum(ipar.into_iter().flatten().chain(fixed))
    }

    /// The first refusal, in the order of the codes.
    pub(super) fn fault(&self, demand: &Demand) -> Option<FParameterFault> {
        REFUSALS.iter().find(|(refuses, _)| refuses(self, demand)).map(|(_, fault)| *fault)
    }
}

/// `F_Block_ID`: 0 plain, 1 with `F_iPar_CRC`, 2 with `F_WD_Time_2`, 3 both.
const fn block_id(flag_2: u8) -> u8 {
    (flag_2 >> 3) & 0b111
}

const fn is_reserved_address(address: u16) -> bool {
    matches!(address, 0 | u16::MAX)
}

type Refusal = (fn(&FParameters, &Demand) -> bool, FParameterFault);

/// Mark H up to CRC1, M above. DEC-34: V1 mode and the expanded protocol are
/// refused with their code.
const REFUSALS: [Refusal; 12] = [
    (|block, demand| block.destination != demand.address, FParameterFault::DestinationMismatch),
    (|block, _| is_reserved_address(block.destination), FParameterFault::DestinationInvalid),
    (|block, _| is_reserved_address(block.source), FParameterFault::SourceInvalid),
    (|block, _| block.watchdog_ms == 0, FParameterFault::WatchdogZero),
    (
        // 3 names no SIL at all; LNZ-BUS-16 takes 0 to 2 only.
        |block, _| (block.flag_1 >> 2) & 0b11 == 3,
        FParameterFault::SilTooHigh,
    ),
    (|block, _| (block.flag_1 >> 4) & 0b11 != 0, FParameterFault::CrcLength),
    (is_other_version, FParameterFault::Version),
    (is_block_unknown, FParameterFault::BlockId),
    (|block, _| block.crc1 != block.expected_crc1(), FParameterFault::Crc1),
    (has_foreign_feature, FParameterFault::DeviceSpecific),
    (|block, demand| block.ipar_crc.is_some() && demand.ipar_crc.is_none(), FParameterFault::BlockId),
    (|block, demand| block.ipar_crc != demand.ipar_crc, FParameterFault::IParameters),
];

/// V1, a version to come, or the seed bit of the expanded protocol.
fn is_other_version(block: &FParameters, _: &Demand) -> bool {
    let version_2 = block.flag_2 >> 6 == 1;
    let expanded = block.flag_1 & 0x40 != 0;
    !version_2 || expanded
}

/// Before CRC1, because the sum of an unknown block cannot be formed.
fn is_block_unknown(block: &FParameters, _: &Demand) -> bool {
    let offered = matches!(block_id(block.flag_2), 0 | 1);
    !offered || !block.length_fits
}

/// Reserved bits, passivation of single channels (mark L), or a watchdog time
/// below the device's own limit (LNZ-BUS-16 leaves 1 to 109 ms open).
fn has_foreign_feature(block: &FParameters, demand: &Demand) -> bool {
    let reserved_1 = block.flag_1 & 0x80 != 0;
    let reserved_2 = block.flag_2 & 0b110 != 0;
    let channel_granular = block.flag_2 & 1 != 0;
    let too_short = block.watchdog_ms < demand.lowest_watchdog_ms;
    reserved_1 || reserved_2 || channel_granular || too_short
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: [u8; 10] = [0x08, 0x40, 0, 1, 0, 7, 0, 0x64, 0x70, 0x22];
    const DEMAND: Demand = Demand { address: 7, ipar_crc: None, lowest_watchdog_ms: 1 };

    fn sealed(mut block: [u8; 10]) -> FParameters {
        let sum = FParameters::parse(&block).unwrap().expected_crc1();
        block[8..].copy_from_slice(&sum.to_be_bytes());
        FParameters::parse(&block).unwrap()
    }

    fn code_with(index: usize, octet: u8) -> Option<u8> {
        let mut block = BLOCK;
        block[index] = octet;
        sealed(block).fault(&DEMAND).map(FParameterFault::code)
    }

    /// black-channel.md 9.1.
    #[test]
    fn crc1_of_the_catalogue() {
        let sum = |fixed: [u8; 8], ipar_crc: Option<u32>| {
            let mut block = FParameters::parse(&[0; 10]).unwrap();
            block.flag_1 = fixed[0];
            block.flag_2 = fixed[1];
            block.source = u16::from_be_bytes([fixed[2], fixed[3]]);
            block.destination = u16::from_be_bytes([fixed[4], fixed[5]]);
            block.watchdog_ms = u16::from_be_bytes([fixed[6], fixed[7]]);
            block.ipar_crc = ipar_crc;
            block.expected_crc1()
        };
        let ipar = Some(3_489_011_925);
        assert_eq!(sum([4, 0x40, 0, 1, 0, 1, 1, 0xF4], None), 37_411);
        assert_eq!(sum([4, 0x48, 0, 1, 0, 1, 0, 0x7D], ipar), 9_296);
        assert_eq!(sum([0x24, 0x48, 0, 1, 0, 1, 0, 0x7D], ipar), 35_282);
        assert_eq!(sum([8, 0x40, 0, 1, 0, 7, 0, 0x64], None), 0x7022);
    }

    /// black-channel.md 9.1, LNZ-BUS-16.
    #[test]
    fn a_right_block_is_accepted() {
        let block = FParameters::parse(&BLOCK).unwrap();
        assert_eq!(block.fault(&DEMAND), None);
        assert_eq!(block.watchdog_ms, 100);
    }

    /// black-channel.md 8.2, LNZ-BUS-17, DEC-34.
    #[test]
    fn each_wrong_field_has_its_code() {
        assert_eq!(code_with(5, 8), Some(0x40), "another address");
        assert_eq!(code_with(3, 0), Some(0x42), "source 0");
        assert_eq!(code_with(7, 0), Some(0x43), "no watchdog");
        assert_eq!(code_with(0, 0x0C), Some(0x44), "no SIL");
        assert_eq!(code_with(0, 0x18), Some(0x45), "2-octet CRC of V1");
        assert_eq!(code_with(0, 0x28), Some(0x45), "4-octet CRC");
        assert_eq!(code_with(1, 0x00), Some(0x46), "version 1");
        assert_eq!(code_with(0, 0x48), Some(0x46), "expanded protocol");
        assert_eq!(code_with(1, 0x41), Some(0x48), "channel passivation");
        assert_eq!(code_with(0, 0x88), Some(0x48), "reserved bit");
        assert_eq!(code_with(1, 0x48), Some(0x4C), "block id without its field");
        assert_eq!(code_with(1, 0x50), Some(0x4C), "second watchdog time");
    }

    /// black-channel.md 8.2, codes 41 and 42.
    #[test]
    fn reserved_addresses_are_refused() {
        for reserved in [0, u16::MAX] {
            let mut block = BLOCK;
            block[4..6].copy_from_slice(&reserved.to_be_bytes());
            let demand = Demand { address: reserved, ..DEMAND };
            let fault = sealed(block).fault(&demand);
            assert_eq!(fault, Some(FParameterFault::DestinationInvalid));
            let mut block = BLOCK;
            block[2..4].copy_from_slice(&reserved.to_be_bytes());
            let fault = sealed(block).fault(&DEMAND);
            assert_eq!(fault, Some(FParameterFault::SourceInvalid));
        }
    }

    /// black-channel.md 8.2, code 47.
    #[test]
    fn each_flipped_bit_of_a_block_is_refused() {
        for bit in 0..80 {
            let mut block = BLOCK;
            block[bit / 8] ^= 1 << (bit % 8);
            let block = FParameters::parse(&block).unwrap();
            assert!(block.fault(&DEMAND).is_some(), "bit {bit}");
        }
    }

    /// black-channel.md 8.2, code 4B; LNZ-BUS-16 for the watchdog.
    #[test]
    fn iparameters_have_to_be_the_devices_own() {
        let mut block = [0; 14];
        block[..8].copy_from_slice(&[8, 0x48, 0, 1, 0, 7, 0, 0x64]);
        block[8..12].copy_from_slice(&3_489_011_925_u32.to_be_bytes());
        let sum = FParameters::parse(&block).unwrap().expected_crc1();
        block[12..].copy_from_slice(&sum.to_be_bytes());
        let block = FParameters::parse(&block).unwrap();
        let fault = |ipar_crc| block.fault(&Demand { ipar_crc, ..DEMAND });
        assert_eq!(fault(Some(3_489_011_925)), None);
        assert_eq!(fault(Some(1)), Some(FParameterFault::IParameters));
        assert_eq!(fault(None), Some(FParameterFault::BlockId));
        let plain = FParameters::parse(&BLOCK).unwrap();
        let expecting = Demand { ipar_crc: Some(1), ..DEMAND };
        assert_eq!(
            plain.fault(&expecting),
            Some(FParameterFault::IParameters),
            "a block that leaves out the sum the device needs"
        );
        let at_limit = Demand { lowest_watchdog_ms: 100, ..DEMAND };
        assert_eq!(plain.fault(&at_limit), None);
        let slow = Demand { lowest_watchdog_ms: 110, ..DEMAND };
        assert_eq!(plain.fault(&slow), Some(FParameterFault::DeviceSpecific));
    }
}
