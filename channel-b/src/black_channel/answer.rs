//! The fixed buffer that an answer is written into.

/// Octets of the longest frame: 126 octets of data, 63 check sums, command and
/// connection id (black-channel 2.1).
pub const LONGEST_FRAME: usize = 255;

/// One outgoing frame. Empty until something has been written.
///
/// Each octet remembers whether it belongs to a check sum, because on the wire
/// the check sums come from this channel and everything else from the other
/// (design 9).
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    octets: [u8; LONGEST_FRAME],
    is_check: [bool; LONGEST_FRAME],
    length: usize,
}

impl Answer {
    /// A buffer without a frame.
    #[must_use]
    pub const fn empty() -> Self {
        Self { octets: [0; LONGEST_FRAME], is_check: [false; LONGEST_FRAME], length: 0 }
    }

    /// The frame in wire order; empty when there is none.
    #[must_use]
    pub fn octets(&self) -> &[u8] {
        self.octets.get(..self.length).unwrap_or(&[])
    }

    /// Whether the octet at `index` belongs to a check sum.
    #[must_use]
    pub fn is_check_octet(&self, index: usize) -> bool {
        self.is_check.get(..self.length).and_then(|marks| marks.get(index)) == Some(&true)
    }

    /// The frame that leaves the controller: this channel's check sums around
    /// the command, data and connection id (PROFIsafe: data and status) of
    /// `other`, the whole answer of the other channel to the same frame.
    ///
    /// `None` when the lengths differ: then nothing may leave.
    #[must_use]
    pub fn with_data_of(&self, other: &[u8]) -> Option<Self> {
        let same_length = other.len() == self.length;
        same_length.then(|| self.merged(other))
    }

    fn merged(mut self, other: &[u8]) -> Self {
        let places = self.octets.iter_mut().zip(&self.is_check);
        for ((octet, is_check), foreign) in places.zip(other) {
            if !is_check {
                *octet = *foreign;
            }
        }
        self
    }

    pub(super) const fn clear(&mut self) {
        self.length = 0;
    }

    /// Appends data; what no longer fits is dropped, which no size that
    /// [`Slave::new`](super::Slave::new) accepts can cause.
    pub(super) fn push(&mut self, octet: u8) {
        self.append(octet, false);
    }

    pub(super) fn push_check(&mut self, octets: impl IntoIterator<Item = u8>) {
        octets.into_iter().for_each(|octet| self.append(octet, true));
    }

    fn append(&mut self, octet: u8, is_check: bool) {
        let place = self.octets.get_mut(self.length).zip(self.is_check.get_mut(self.length));
        if let Some((place, mark)) = place {
            *place = octet;
            *mark = is_check;
            self.length = self.length.saturating_add(1);
        }
    }
}

impl Default for Answer {
    fn default() -> Self {
        Self::empty()
    }
}

/// The last frame seen: a repetition of it is no event (black-channel 3.2).
///
/// Not mirrored: a spoilt bit here makes a repeated frame look new, which the
/// check sums then refuse, or a new one old, which the watchdog then ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastImage {
    octets: [u8; LONGEST_FRAME],
}

impl LastImage {
    /// The bus before anybody has written to it.
    pub(super) const fn untouched() -> Self {
        Self { octets: [0; LONGEST_FRAME] }
    }

    /// Remembers `image`; false when it is the one already known.
    pub(super) fn replace(&mut self, image: &[u8]) -> bool {
        let known = self.octets.get(..image.len()) == Some(image);
        for (place, octet) in self.octets.iter_mut().zip(image) {
            *place = *octet;
        }
        !known
    }

    /// Whether the last image was all zeros.
    pub(super) fn is_blank(&self) -> bool {
        self.octets.iter().all(|octet| *octet == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer_of(parts: &[(u8, bool)]) -> Answer {
        let mut answer = Answer::empty();
        for (octet, is_check) in parts {
            answer.append(*octet, *is_check);
        }
        answer
    }

    #[test]
    fn a_split_answer_has_the_data_of_one_channel_and_the_check_sums_of_the_other() {
        let own = answer_of(&[(1, false), (2, true), (3, true), (4, false)]);
        let merged = own.with_data_of(&[11, 12, 13, 14]).expect("same length");
        assert_eq!(merged.octets(), [11, 2, 3, 14]);
    }

    #[test]
    fn answers_of_different_length_are_not_merged() {
        assert!(answer_of(&[(1, false)]).with_data_of(&[1, 2]).is_none());
    }

    #[test]
    fn a_full_buffer_takes_nothing_more() {
        let mut answer = Answer::empty();
        answer.push_check([7; 300]);
        assert_eq!(answer.octets().len(), LONGEST_FRAME);
        assert!(!answer.is_check_octet(LONGEST_FRAME));
    }
}
