//! Which differences between the two channels last too long (DEC-21): every bit of every
//! item has its own timer, which restarts as soon as the bit agrees again.

/// 32-bit parts compared: status, requests, then inputs, acknowledgements, session id and
/// digest of the last frame.
pub const PARTS: usize = 20;
/// The session id, and above it whether there is an error.
pub const SESSION_PART: usize = 18;
/// Where that is.
pub const ERROR_BIT: u32 = 1 << 16;
/// The first of them: the status word.
pub const STATUS_PARTS: usize = 8;

/// Since when each bit differs.
#[derive(Debug, Clone, Copy)]
pub struct Differences {
    since_ns: [[u64; 32]; PARTS],
    standing: [u32; PARTS],
}

impl Differences {
    /// Nothing differs.
    pub const fn new() -> Self {
        Self { since_ns: [[0; 32]; PARTS], standing: [0; PARTS] }
    }

    /// Forgets all differences.
    pub fn clear(&mut self) {
        self.standing = [0; PARTS];
    }

    /// Takes the difference masks of one exchange; the bits that have differed for
    /// `tolerance_ns` or longer.
    pub fn step(&mut self, masks: &[u32; PARTS], now_ns: u64, tolerance_ns: u64) -> [u32; PARTS] {
        let mut expired = [0; PARTS];
        let parts = masks.iter().zip(&mut self.standing).zip(&mut self.since_ns).zip(&mut expired);
        for (((mask, standing), since), expired) in parts {
            let begins = mask & !*standing;
            *standing = *mask;
            let mut left = *mask;
            while left != 0 {
                let bit = left.trailing_zeros() & 31;
                left &= left.wrapping_sub(1);
                let place = &mut since[bit as usize];
                if begins.wrapping_shr(bit) & 1 == 1 {
                    *place = now_ns;
                }
                let old = now_ns.saturating_sub(*place) >= tolerance_ns;
                *expired |= u32::from(old).wrapping_shl(bit);
            }
        }
        expired
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_item_trips_after_the_tolerance_and_its_timer_restarts_with_agreement() {
        // DEC-21
        let mut differences = Differences::new();
        let mut masks = [0; PARTS];
        masks[0] = 0b100;
        for t in 0..120 {
            assert_eq!(differences.step(&masks, t, 120)[0], 0, "{t}");
        }
        assert_eq!(differences.step(&masks, 120, 120)[0], 0b100);
        differences.step(&[0; PARTS], 121, 120);
        assert_eq!(differences.step(&masks, 122, 120)[0], 0);
        masks[0] = 0b1000;
        assert_eq!(differences.step(&masks, 242, 120)[0], 0, "another item, another timer");
    }
}
