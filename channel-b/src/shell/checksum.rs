//! CRC-32C by the processor, handed to the core's guard; the core's own where there is none.

/// A check sum over octets.
pub type CheckSum = fn(&[u8]) -> u32;

/// The fastest this machine has. Asked once, before the cycle.
pub fn fastest() -> CheckSum {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("sse4.2") {
        return by_processor;
    }
    channel_b::crc::crc32c
}

#[cfg(target_arch = "x86_64")]
fn by_processor(octets: &[u8]) -> u32 {
    // SAFETY: `fastest` hands this function out only after it has found SSE 4.2.
    unsafe { sse(octets) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "sse4.2")]
fn sse(octets: &[u8]) -> u32 {
    use std::arch::x86_64::{_mm_crc32_u8, _mm_crc32_u64};
    let (words, tail) = octets.as_chunks::<8>();
    let start = u64::from(u32::MAX);
    let rest = words.iter().fold(start, |rest, word| _mm_crc32_u64(rest, u64::from_le_bytes(*word)));
    !tail.iter().fold(rest as u32, |rest, octet| _mm_crc32_u8(rest, *octet))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_processor_and_the_portable_check_sum_agree() {
        let octets: Vec<u8> = (0..999_u32).map(|n| (n * 7) as u8).collect();
        for length in [0, 1, 7, 8, 9, 64, 999] {
            let part = &octets[..length];
            assert_eq!(super::fastest()(part), channel_b::crc::crc32c(part));
        }
    }
}
