//! One frame out of two: no channel alone can produce a valid one (design 9).

use shm_schema::command::CommandSource;

/// The protocol a frame is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Safety over EtherCAT.
    Fsoe,
    /// PROFIsafe, three octets of CRC2.
    Profisafe,
}

/// Octets of the shortest FSoE frame: command, one octet of data, check sum, connection id.
const FSOE_SHORTEST: usize = 6;
/// Octets of the check sum at the end of a PROFIsafe frame.
const PROFISAFE_CHECK: usize = 3;

impl Protocol {
    /// How the command cell calls a frame of it.
    pub const fn source(self) -> CommandSource {
        match self {
            Self::Fsoe => CommandSource::Fsoe,
            Self::Profisafe => CommandSource::Profisafe,
        }
    }

    /// Whether the octet at `at` of a frame with `length` octets belongs to a check sum.
    ///
    /// FSoE: command, then after each two octets of data (or one in the shortest frame) two of
    /// check sum, then two of connection id. PROFIsafe: data, status, three of check sum.
    const fn is_check(self, at: usize, length: usize) -> bool {
        match self {
            Self::Fsoe if length == FSOE_SHORTEST => at == 2 || at == 3,
            Self::Fsoe => at > 0 && at + 2 < length && (at - 1) % 4 >= 2,
            Self::Profisafe => at + PROFISAFE_CHECK >= length,
        }
    }
}

/// Data of `a`, check sums of `b`; `None` when they are not of one length.
pub fn merge(protocol: Protocol, a: &[u8], b: &[u8]) -> Option<Vec<u8>> {
    let length = a.len();
    let octet = |(at, (a, b)): (usize, (&u8, &u8))| if protocol.is_check(at, length) { *b } else { *a };
    (length == b.len()).then(|| a.iter().zip(b).enumerate().map(octet).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from_b(protocol: Protocol, length: usize) -> Vec<usize> {
        let merged = merge(protocol, &vec![0; length], &vec![1; length]).expect("one length");
        (0..length).filter(|at| merged[*at] == 1).collect()
    }

    #[test]
    fn check_sums_come_from_b_and_everything_else_from_a() {
        assert_eq!(from_b(Protocol::Fsoe, 6), [2, 3]);
        assert_eq!(from_b(Protocol::Fsoe, 7), [3, 4]);
        assert_eq!(from_b(Protocol::Fsoe, 11), [3, 4, 7, 8]);
        assert_eq!(from_b(Protocol::Fsoe, 27).len(), 12, "six check sums of an AMK answer");
        assert_eq!(from_b(Protocol::Profisafe, 8), [5, 6, 7]);
    }

    #[test]
    fn frames_of_different_length_are_no_frame() {
        assert_eq!(merge(Protocol::Fsoe, &[0; 7], &[0; 11]), None);
    }
}
