//! Check sums by polynomial long division, one bit after the other.
//!
//! No table and no library: the dividend passes through a register that is
//! left-aligned in 32 bits, and the divisor is subtracted wherever the leading
//! bit is set. All generator polynomials of this folder share the code; only the many
//! small check sums of FSoE have a closed form of their own.

/// Remainder of a division by `POLYNOMIAL`, which has `WIDTH` bits (1 to 32)
/// below its leading one. Most significant bit first, nothing reflected,
/// nothing inverted.
#[derive(Clone, Copy)]
pub(super) struct Remainder<const WIDTH: u32, const POLYNOMIAL: u32>(u32);

/// CRC1 over the F-parameters (black-channel 7.2).
pub(super) type ParameterCheck = Remainder<16, 0x4EAB>;
/// CRC2 of a safety telegram, basic protocol (black-channel 7.4).
pub(super) type TelegramCheck = Remainder<24, 0x5D_6DCB>;
/// Signature over a safety parameter set (black-channel 2.7).
type SignatureCheck = Remainder<32, 0x8141_41AB>;
/// The generator of the usual CRC-32, for the digest of a frame.
type DigestCheck = Remainder<32, 0x04C1_1DB7>;

impl<const WIDTH: u32, const POLYNOMIAL: u32> Remainder<WIDTH, POLYNOMIAL> {
    const UNUSED: u32 = 32_u32.saturating_sub(WIDTH);
    const DIVISOR: u32 = POLYNOMIAL << Self::UNUSED;

    /// A division whose register starts at `value`.
    pub(super) const fn preset(value: u32) -> Self {
        Self(value << Self::UNUSED)
    }

    /// Brings down the next eight bits of the dividend.
    #[must_use]
    pub(super) const fn then(self, octet: u8) -> Self {
        let mut register = self.0 ^ ((octet as u32) << 24);
        let mut bit = 0;
        while bit < 8 {
            // All ones where the leading bit says that the divisor fits.
            let fits = (register >> 31).wrapping_neg();
            register = (register << 1) ^ (fits & Self::DIVISOR);
            bit += 1;
        }
        Self(register)
    }

    /// Brings down all `octets` in their order.
    #[must_use]
    pub(super) fn then_all(self, octets: impl IntoIterator<Item = u8>) -> Self {
        octets.into_iter().fold(self, Self::then)
    }

    /// The remainder, right-aligned.
    pub(super) const fn value(self) -> u32 {
        self.0 >> Self::UNUSED
    }
}

/// Signature of a safety parameter set: 32 bits, sent low octet first in front
/// of the application parameters (black-channel 2.7).
#[must_use]
pub fn parameter_signature(set: impl IntoIterator<Item = u8>) -> u32 {
    SignatureCheck::preset(0).then_all(set).value()
}

/// Digest of a frame: the CRC-32 that IEEE 802.3 uses, over all its octets.
/// Both channels report it for the last frame they processed (design 9).
#[must_use]
pub fn frame_digest(frame: &[u8]) -> u32 {
    // The usual CRC-32 counts bits from the low end: turning octets and result
    // round makes it the same division as everywhere else in this folder.
    let mirrored = frame.iter().map(|octet| octet.reverse_bits());
    !DigestCheck::preset(u32::MAX).then_all(mirrored).value().reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signature_vectors_of_black_channel_2_7_hold() {
        let counted: [u8; 16] = core::array::from_fn(|index| index as u8);
        let vectors: [(&[u8], u32); 5] = [
            (&[1], 0x8141_41AB),
            (&[1, 2], 0x03C3_71CF),
            (&[1, 2, 3, 4], 0x552B_9287),
            (&counted, 0x0CD4_BE50),
            (b"123456789", 0x3010_BF7F),
        ];
        for (set, signature) in vectors {
            assert_eq!(parameter_signature(set.iter().copied()), signature);
        }
    }

    #[test]
    fn frame_digest_is_the_usual_crc_32() {
        assert_eq!(frame_digest(b"123456789"), 0xCBF4_3926);
        assert_eq!(frame_digest(&[]), 0);
    }

    /// Remark of black-channel 2.4: entry 1 of the standard's second table.
    #[test]
    fn one_octet_and_three_zero_octets_leave_7648() {
        let remainder = Remainder::<16, 0x39B7>::preset(0).then_all([1, 0, 0, 0]);
        assert_eq!(remainder.value(), 0x7648);
    }
}
