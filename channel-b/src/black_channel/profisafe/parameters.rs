//! The F-parameter block and its examination (black-channel 7.1, 7.2, 8.2).

use super::super::division::ParameterCheck;

/// Why an F-parameter block was refused: nothing is answered then, and the
/// drive stays in STO (LNZ-BUS-17, DEC-34).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterFault {
    /// `F_Dest_Add` is not the own address.
    DestinationDiffers,
    /// `F_Dest_Add` is 0 or 65,535.
    DestinationInvalid,
    /// `F_Source_Add` is 0 or 65,535.
    SourceInvalid,
    /// `F_WD_Time` is 0.
    WatchdogZero,
    /// `F_SIL` is above SIL 3.
    SafetyIntegrityLevel,
    /// `F_CRC_Length` is not three octets.
    CheckLength,
    /// `F_Par_Version` is not V2.
    Version,
    /// CRC1 is wrong.
    CheckSum,
    /// Asks for something that is not offered: expanded protocol, iParameter
    /// check, channel-granular passivation, a reserved bit.
    NotOffered,
    /// `F_Block_ID` is not 0 or 1, or the block has another length.
    Block,
}

impl ParameterFault {
    /// Code in the diagnosis message, 64 to 76.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::DestinationDiffers => 0x40,
            Self::DestinationInvalid => 0x41,
            Self::SourceInvalid => 0x42,
            Self::WatchdogZero => 0x43,
            Self::SafetyIntegrityLevel => 0x44,
            Self::CheckLength => 0x45,
            Self::Version => 0x46,
            Self::CheckSum => 0x47,
            Self::NotOffered => 0x48,
            Self::Block => 0x4C,
        }
    }
}

/// What remains of an accepted F-parameter block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FParameters {
    pub(super) watchdog_ms: u16,
    /// CRC1, the preset of every CRC2.
    pub(super) check: u16,
}

/// Bits of the first flag octet: 0 is three octets of CRC2, all ones is no SIL.
const F_CRC_LENGTH: u8 = 0b0011_0000;
const F_SIL: u8 = 0b0000_1100;
/// Bits of the second flag octet.
const F_PAR_VERSION: u8 = 0b1100_0000;
const VERSION_2: u8 = 0b0100_0000;

/// `F_Check_iPar`, `F_CRC_Seed` and the reserved bit of the first flag octet.
/// Which parameters they change is known, how is not (mark L): refused.
const FLAGS_1_NOT_OFFERED: u8 = 0b1100_0010;
/// `F_Passivation` and the reserved bits of the second flag octet (mark L).
const FLAGS_2_NOT_OFFERED: u8 = 0b0000_0111;

/// The block, when everything in it can be had. The checks run in the order of
/// the codes; `F_Source_Add` need not be known (address type 1, ATV-PSF-01).
pub(super) fn examine(block: &[u8], address: u16) -> Result<FParameters, ParameterFault> {
    let (head, tail) = block.split_first_chunk::<8>().ok_or(ParameterFault::Block)?;
    let [flags_1, flags_2, source @ .., d1, d0, w1, w0] = *head;
    let destination = u16::from_be_bytes([d1, d0]);
    let watchdog_ms = u16::from_be_bytes([w1, w0]);
    let tail = split_tail(tail, flags_2 >> 3 & 0b111);
    // Without a known layout CRC1 cannot be found, and the block is at fault.
    let check_holds = tail.is_none_or(|(parameters, check)| check == check_1(parameters, *head));
    let not_offered = (flags_1 & FLAGS_1_NOT_OFFERED) | (flags_2 & FLAGS_2_NOT_OFFERED);
    let conditions = [
        (destination == address, ParameterFault::DestinationDiffers),
        (is_address(destination), ParameterFault::DestinationInvalid),
        (is_address(u16::from_be_bytes(source)), ParameterFault::SourceInvalid),
        (watchdog_ms != 0, ParameterFault::WatchdogZero),
        (flags_1 & F_SIL != F_SIL, ParameterFault::SafetyIntegrityLevel),
        (flags_1 & F_CRC_LENGTH == 0, ParameterFault::CheckLength),
        (flags_2 & F_PAR_VERSION == VERSION_2, ParameterFault::Version),
        (check_holds, ParameterFault::CheckSum),
        (not_offered == 0, ParameterFault::NotOffered),
    ];
    match conditions.into_iter().find(|(holds, _)| !holds) {
        Some((_, fault)) => Err(fault),
        None => tail.map(|(_, check)| FParameters { watchdog_ms, check }).ok_or(ParameterFault::Block),
    }
}

const fn is_address(number: u16) -> bool {
    !matches!(number, 0 | u16::MAX)
}

/// `F_iPar_CRC`, empty for block id 0, and CRC1.
fn split_tail(tail: &[u8], block_id: u8) -> Option<(&[u8], u16)> {
    let (parameters, check) = tail.split_last_chunk::<2>()?;
    let wanted = match block_id {
        0 => 0,
        1 => 4,
        _ => return None, // F_WD_Time_2: its place in CRC1 is mark L
    };
    (parameters.len() == wanted).then_some((parameters, u16::from_be_bytes(*check)))
}

/// CRC1: `F_iPar_CRC` comes first, although it is last but one in the block.
fn check_1(parameters: &[u8], head: [u8; 8]) -> u16 {
    let octets = parameters.iter().copied().chain(head);
    ParameterCheck::preset(0).then_all(octets).value() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: [u8; 10] = [0x08, 0x40, 0, 1, 0, 7, 0, 0x64, 0x70, 0x22];

    /// The block with some octets replaced and CRC1 made right again.
    fn changed(places: &[(usize, u8)]) -> [u8; 10] {
        let mut block = PLAIN;
        for (place, octet) in places {
            block[*place] = *octet;
        }
        let head = *block.first_chunk().expect("eight octets");
        let check = check_1(&[], head).to_be_bytes();
        [block[8], block[9]] = check;
        block
    }

    /// Black-channel 9.1.
    #[test]
    fn crc1_vectors_hold() {
        let i_parameters = 3_489_011_925_u32.to_be_bytes();
        let kuka = [0x04, 0x40, 0, 1, 0, 1, 0x01, 0xF4];
        let basic = [0x04, 0x48, 0, 1, 0, 1, 0, 0x7D];
        let expanded = [0x24, 0x48, 0, 1, 0, 1, 0, 0x7D];
        assert_eq!(check_1(&[], kuka), 37_411);
        assert_eq!(check_1(&i_parameters, basic), 9_296);
        assert_eq!(check_1(&i_parameters, expanded), 35_282);
        assert_eq!(check_1(&[], *PLAIN.first_chunk().expect("eight octets")), 28_706);
    }

    #[test]
    fn a_right_block_is_accepted() {
        let accepted = FParameters { watchdog_ms: 100, check: 0x7022 };
        assert_eq!(examine(&PLAIN, 7), Ok(accepted));
    }

    #[test]
    fn a_block_with_i_parameter_signature_is_accepted() {
        let mut block = [0x04, 0x48, 0, 1, 0, 1, 0, 0x7D, 0, 0, 0, 0, 0x24, 0x50];
        block[8..12].copy_from_slice(&3_489_011_925_u32.to_be_bytes());
        assert_eq!(examine(&block, 1), Ok(FParameters { watchdog_ms: 125, check: 9_296 }));
    }

    /// Black-channel 8.2, LNZ-BUS-17: code after code, with CRC1 right.
    #[test]
    fn every_fault_is_refused_with_its_code() {
        let cases: [(&[(usize, u8)], u8); 12] = [
            (&[(5, 8)], 0x40),
            (&[(2, 0xFF), (3, 0xFF)], 0x42),
            (&[(3, 0)], 0x42),
            (&[(7, 0)], 0x43),
            (&[(0, 0x0C)], 0x44),
            (&[(0, 0x18)], 0x45),
            (&[(0, 0x28)], 0x45),
            (&[(1, 0x00)], 0x46),
            (&[(0, 0x48)], 0x48),
            (&[(0, 0x0A)], 0x48),
            (&[(1, 0x41)], 0x48),
            (&[(1, 0x50)], 0x4C),
        ];
        for (places, code) in cases {
            let result = examine(&changed(places), 7).map_err(ParameterFault::code);
            assert_eq!(result, Err(code), "{places:?}");
        }
        assert_eq!(examine(&changed(&[(5, 0)]), 0), Err(ParameterFault::DestinationInvalid));
        let all_ones = changed(&[(4, 0xFF), (5, 0xFF)]);
        assert_eq!(examine(&all_ones, 0xFFFF), Err(ParameterFault::DestinationInvalid));
    }

    #[test]
    fn the_first_fault_in_the_order_of_codes_is_named() {
        let block = changed(&[(5, 0), (7, 0), (1, 0)]);
        assert_eq!(examine(&block, 7), Err(ParameterFault::DestinationDiffers));
        assert_eq!(examine(&block, 0), Err(ParameterFault::DestinationInvalid));
    }

    #[test]
    fn every_single_bit_flip_is_refused() {
        for bit in 0..80 {
            let mut block = PLAIN;
            block[bit / 8] ^= 1 << (bit % 8);
            assert!(examine(&block, 7).is_err(), "{bit}");
        }
    }

    #[test]
    fn a_block_of_another_length_is_refused() {
        for length in (0..10).chain(11..20) {
            let mut block = [0; 20];
            block[..10].copy_from_slice(&PLAIN);
            assert_eq!(examine(&block[..length], 7), Err(ParameterFault::Block), "{length}");
        }
    }
}
