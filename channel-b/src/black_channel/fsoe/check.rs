//! CRC_i of a frame in closed form, and the chain that links all frames
//! (black-channel 2.4, 2.5).
//!
//! A check sum is linear in what enters it: every field is multiplied by the
//! power of x that its place in the order gives it, the products are added, and
//! the sum is divided once by the generator polynomial. The three zero octets at
//! the end only raise the powers.

/// The generator polynomial with its leading one.
const GENERATOR: u32 = 0x1_39B7;

/// Power of the last data octet: three zero octets and the 16 bits of the sum.
const DATA: u32 = 40;
/// Power of the index word, in front of two data octets.
const INDEX: u32 = DATA + 16;
/// Powers of the command: in front of one data octet, of two, of index and two.
const COMMAND_OF_SINGLE: u32 = DATA + 8;
const COMMAND_OF_FIRST: u32 = DATA + 16;
const COMMAND_OF_FURTHER: u32 = INDEX + 16;

/// The data octets in front of one check sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Block {
    /// The only octet of a frame with one.
    Single(u8),
    /// Two octets in wire order.
    Pair([u8; 2]),
}

impl Block {
    const fn polynomial(self) -> u16 {
        match self {
            Self::Single(octet) => octet as u16,
            Self::Pair(octets) => u16::from_be_bytes(octets),
        }
    }
}

/// Everything that enters the check sums without being data: all CRCs of one
/// frame share it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    /// CRC_0 of the partner's last frame.
    pub(super) inherited: u16,
    pub(super) connection_id: u16,
    /// Sequence number of this direction, never 0.
    pub(super) number: u16,
}

impl Link {
    /// The beginning of every chain: Reset frames and the first Session frame.
    pub(super) const ORIGIN: Self = Self { inherited: 0, connection_id: 0, number: 1 };

    /// CRC_0 of a frame that begins with `block`.
    pub(super) fn first_check(self, command: u8, block: Block) -> u16 {
        divide(self.first_sum(command, block) ^ times(block.polynomial(), const { power_of_x(DATA) }))
    }

    /// CRC_i for i > 0, of two data octets each.
    pub(super) fn further_checks(self, command: u8) -> FurtherChecks {
        FurtherChecks(self.sum::<COMMAND_OF_FURTHER>(command))
    }

    fn first_sum(self, command: u8, block: Block) -> u32 {
        match block {
            Block::Single(_) => self.sum::<COMMAND_OF_SINGLE>(command),
            Block::Pair(_) => self.sum::<COMMAND_OF_FIRST>(command),
        }
    }

    /// The fields in front of the data, where `COMMAND` is the power of the
    /// command. Words enter low octet first, hence the exchange of octets.
    #[inline]
    fn sum<const COMMAND: u32>(self, command: u8) -> u32 {
        times(self.inherited.swap_bytes(), const { power_of_x(COMMAND + 40) })
            ^ times(self.connection_id.swap_bytes(), const { power_of_x(COMMAND + 24) })
            ^ times(self.number.swap_bytes(), const { power_of_x(COMMAND + 8) })
            ^ times(u16::from(command), const { power_of_x(COMMAND) })
    }

    /// This link with the number that follows `last`, and its CRC_0. The number
    /// is stepped on once more when CRC_0 would repeat `avoided` (collision rule).
    ///
    /// One more step is always enough: two numbers differ by a polynomial of
    /// degree below 16, which the generator, odd and of degree 16, never divides.
    pub(super) fn numbered(self, last: u16, avoided: u16, command: u8, block: Block) -> (Self, u16) {
        let next = Self { number: successor(last), ..self };
        let check = next.first_check(command, block);
        if check != avoided {
            return (next, check);
        }
        let next = Self { number: successor(next.number), ..self };
        (next, next.first_check(command, block))
    }
}

/// The check sums behind the first one: what their fields have in common.
#[derive(Clone, Copy)]
pub(super) struct FurtherChecks(u32);

impl FurtherChecks {
    /// CRC_i for block `index`, which is not 0: block 0 carries no index word.
    pub(super) fn of(self, index: u16, block: Block) -> u16 {
        let index = times(index.swap_bytes(), const { power_of_x(INDEX) });
        divide(self.0 ^ index ^ times(block.polynomial(), const { power_of_x(DATA) }))
    }
}

/// The number after `number`: 65,535 is followed by 1, 0 is never used.
pub(super) const fn successor(number: u16) -> u16 {
    match number {
        u16::MAX => 1,
        _ => number.wrapping_add(1),
    }
}

/// Remainder of x to the power of `exponent`.
const fn power_of_x(exponent: u32) -> u32 {
    let mut power = 1;
    let mut step = 0;
    while step < exponent {
        power <<= 1;
        if power >> 16 != 0 {
            power ^= GENERATOR;
        }
        step += 1;
    }
    power
}

/// Product of two polynomials of degree below 16, not yet divided. Written out,
/// so that a constant factor leaves only the terms that it has.
#[inline]
fn times(field: u16, factor: u32) -> u32 {
    let term = |power: u32| (u32::from(field) << power) & (factor >> power & 1).wrapping_neg();
    let low = term(0) ^ term(1) ^ term(2) ^ term(3) ^ term(4) ^ term(5) ^ term(6) ^ term(7);
    let high = term(8) ^ term(9) ^ term(10) ^ term(11) ^ term(12) ^ term(13) ^ term(14) ^ term(15);
    low ^ high
}

/// Remainder of a polynomial of degree below 31.
#[inline]
fn divide(dividend: u32) -> u16 {
    let remainder = (0..15_u32).rev().fold(dividend, |remainder, degree| {
        let fits = (remainder >> 16 >> degree & 1).wrapping_neg();
        remainder ^ (fits & GENERATOR << degree)
    });
    remainder as u16
}

#[cfg(test)]
mod tests {
    use super::super::super::division::Remainder;
    use super::*;

    /// CRC_i as black-channel 2.4 lists it, octet after octet.
    fn by_long_division(link: Link, command: u8, index: u16, data: &[u8]) -> u16 {
        let mut division = Remainder::<16, 0x39B7>::preset(0);
        for word in [link.inherited, link.connection_id, link.number] {
            division = division.then_all(word.to_le_bytes());
        }
        division = division.then(command);
        if index != 0 {
            division = division.then_all(index.to_le_bytes());
        }
        division.then_all(data.iter().copied()).then_all([0; 3]).value() as u16
    }

    /// Black-channel 4.1.
    #[test]
    fn single_check_sum_vectors_hold() {
        assert_eq!(Link::ORIGIN.first_check(0x4E, Block::Pair([0x12, 0x34])), 0x4D07);
        assert_eq!(Link::ORIGIN.first_check(0x4E, Block::Single(0x12)), 0xA176);
        let link = Link { inherited: 0xABCD, connection_id: 7, number: 2 };
        assert_eq!(link.further_checks(0x36).of(1, Block::Pair([0xDE, 0xAD])), 0xBC47);
    }

    #[test]
    fn the_closed_form_equals_the_long_division() {
        let mut seed = 0x1234_5678_u32;
        let mut word = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 16) as u16
        };
        for _ in 0..20_000 {
            let link = Link { inherited: word(), connection_id: word(), number: word() };
            let (command, index, data) = (word() as u8, word().max(1), word().to_le_bytes());
            let first = link.first_check(command, Block::Pair(data));
            let single = link.first_check(command, Block::Single(data[0]));
            let further = link.further_checks(command).of(index, Block::Pair(data));
            assert_eq!(first, by_long_division(link, command, 0, &data));
            assert_eq!(single, by_long_division(link, command, 0, &data[..1]));
            assert_eq!(further, by_long_division(link, command, index, &data));
        }
    }

    /// Black-channel 2.5.
    #[test]
    fn number_65535_is_followed_by_1() {
        assert_eq!(successor(0), 1);
        assert_eq!(successor(65_534), 65_535);
        assert_eq!(successor(65_535), 1);
    }

    /// The proof in the comment of `numbered`, by trying all of them.
    #[test]
    fn all_sequence_numbers_give_different_check_sums() {
        extern crate std;
        let mut seen = std::vec![false; 65_536];
        for number in 1..=u16::MAX {
            let link = Link { inherited: 5, connection_id: 7, number };
            let check = link.first_check(0x36, Block::Pair([1, 2]));
            assert!(!core::mem::replace(&mut seen[usize::from(check)], true));
        }
    }

    #[test]
    fn a_collision_steps_the_number_on_once_more() {
        let link = Link { inherited: 0x1111, connection_id: 7, number: 0 };
        let block = Block::Pair([1, 2]);
        let (plain, repeated) = link.numbered(9, 0, 0x36, block);
        assert_eq!(plain.number, 10);
        let (stepped, check) = link.numbered(9, repeated, 0x36, block);
        assert_eq!(stepped.number, 11);
        assert_ne!(check, repeated);
        let at_wrap = Link { number: 65_535, ..link }.first_check(0x36, block);
        assert_eq!(link.numbered(65_534, at_wrap, 0x36, block).0.number, 1);
    }
}
