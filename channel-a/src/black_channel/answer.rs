//! Fixed buffers: the answer that leaves, the image that came last.

/// Longest frame of both protocols: FSoE with 126 octets of safe data.
pub const MAX_FRAME: usize = 255;
/// Most safe data octets in one direction.
pub const MAX_DATA: usize = 126;

/// Where the check sums lie inside a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// One data octet: command, data, check sum, connection id.
    FsoeSingle,
    /// Command, blocks of two data octets and a check sum, connection id.
    FsoeBlocks,
    /// Data, status octet, three octets of check sum.
    Profisafe,
}

impl Layout {
    fn is_check_octet(self, index: usize, length: usize) -> bool {
        match self {
            Self::FsoeSingle => matches!(index, 2 | 3),
            Self::FsoeBlocks => {
                let in_block = index.wrapping_sub(1) & 3;
                let in_blocks = index.wrapping_sub(1) < length.saturating_sub(3);
                in_blocks && in_block >= 2
            }
            Self::Profisafe => index >= length.saturating_sub(3),
        }
    }
}

/// One frame to send, in wire order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    octets: [u8; MAX_FRAME],
    length: usize,
    layout: Layout,
}

impl Answer {
    pub(super) const fn empty(layout: Layout) -> Self {
        Self { octets: [0; MAX_FRAME], length: 0, layout }
    }

    /// Appends octets; what exceeds the longest frame is dropped.
    pub(super) fn push(&mut self, octets: &[u8]) {
        for octet in octets {
            if let Some(place) = self.octets.get_mut(self.length) {
                *place = *octet;
                self.length = self.length.saturating_add(1);
            }
        }
    }

    /// The whole frame as this channel made it.
    #[must_use]
    pub fn octets(&self) -> &[u8] {
        self.octets.get(..self.length).unwrap_or(&[])
    }

    /// Channel A's part of a common frame: command, data and connection id
    /// (PROFIsafe: data and status); every check sum octet is 0. A frame of
    /// this part alone is refused by any partner.
    #[must_use]
    pub fn data_part(&self) -> Self {
        self.masked(false)
    }

    /// Channel B's part of a common frame: the check sum octets; all others 0.
    #[must_use]
    pub fn check_part(&self) -> Self {
        self.masked(true)
    }

    fn masked(&self, keep_check_octets: bool) -> Self {
        let mut part = *self;
        for (index, octet) in part.octets.iter_mut().enumerate() {
            if self.layout.is_check_octet(index, self.length) != keep_check_octets {
                *octet = 0;
            }
        }
        part
    }

    /// This channel's data with the check sum octets of the other channel's
    /// frame, `None` when the lengths differ (design 9: no single channel can
    /// produce a valid frame).
    #[must_use]
    pub fn with_check_octets_of(&self, other: &[u8]) -> Option<Self> {
        if other.len() != self.length {
            return None;
        }
        let mut merged = *self;
        for (index, (octet, check)) in merged.octets.iter_mut().zip(other).enumerate() {
            if self.layout.is_check_octet(index, self.length) {
                *octet = *check;
            }
        }
        Some(merged)
    }
}

/// A frame whose length fits no frame of the configured process data: refused
/// before its content is looked at (black-channel.md 2.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LengthFault {
    /// Length of a frame of this configuration, in octets.
    pub expected: usize,
    /// Length that came, in octets.
    pub received: usize,
}

/// The process image that came last, and its digest. An identical image is no
/// event (black-channel.md 3.2).
#[derive(Clone, Debug)]
pub(super) struct Image {
    octets: [u8; MAX_FRAME],
    seen: bool,
    digest: u32,
}

impl Image {
    pub(super) const fn none() -> Self {
        Self { octets: [0; MAX_FRAME], seen: false, digest: 0 }
    }

    /// Keeps the image and says whether it differs from the one before. All
    /// images of one slave have the same length.
    pub(super) fn renew(&mut self, octets: &[u8]) -> bool {
        let unchanged = octets.iter().eq(self.octets.iter().take(octets.len()));
        if self.seen && unchanged {
            return false;
        }
        for (kept, octet) in self.octets.iter_mut().zip(octets) {
            *kept = *octet;
        }
        self.seen = true;
        true
    }

    /// The image kept last counts: what is ignored before the start leaves the digest alone.
    pub(super) fn count(&mut self, octets: &[u8]) {
        self.digest = super::crc::frame_digest(octets);
    }

    pub(super) const fn digest(&self) -> u32 {
        self.digest
    }
}

/// Safe data of one direction in a buffer of fixed size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Data {
    octets: [u8; MAX_DATA],
    length: usize,
}

impl Data {
    /// Fail-safe data: zeros (DEC-18).
    pub(super) const fn zeros(length: usize) -> Self {
        Self { octets: [0; MAX_DATA], length }
    }

    /// `source` cut or filled up with zeros to `length`.
    pub(super) fn from_octets(length: usize, source: impl Iterator<Item = u8>) -> Self {
        let mut data = Self::zeros(length);
        for (place, octet) in data.octets.iter_mut().take(length).zip(source) {
            *place = octet;
        }
        data
    }

    pub(super) fn octets(&self) -> &[u8] {
        self.octets.get(..self.length).unwrap_or(&[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(layout: Layout, length: u8) -> Answer {
        let mut answer = Answer::empty(layout);
        (1..=length).for_each(|octet| answer.push(&[octet]));
        answer
    }

    /// Design 9: command, data and connection id from A, check sums from B.
    #[test]
    fn a_frame_splits_into_data_and_check_octets() {
        let frame = answer(Layout::FsoeBlocks, 11);
        assert_eq!(frame.data_part().octets(), [1, 2, 3, 0, 0, 6, 7, 0, 0, 10, 11]);
        assert_eq!(frame.check_part().octets(), [0, 0, 0, 4, 5, 0, 0, 8, 9, 0, 0]);
        let single = answer(Layout::FsoeSingle, 6);
        assert_eq!(single.data_part().octets(), [1, 2, 0, 0, 5, 6]);
        let profisafe = answer(Layout::Profisafe, 8);
        assert_eq!(profisafe.check_part().octets(), [0, 0, 0, 0, 0, 6, 7, 8]);
    }

    /// Design 9.
    #[test]
    fn merging_takes_only_the_check_octets_of_the_other_frame() {
        let frame = answer(Layout::FsoeBlocks, 7);
        let merged = frame.with_check_octets_of(&[0xFF; 7]).unwrap();
        assert_eq!(merged.octets(), [1, 2, 3, 0xFF, 0xFF, 6, 7]);
        assert_eq!(frame.with_check_octets_of(&[0xFF; 6]), None);
    }

    /// black-channel.md 3.2.
    #[test]
    fn an_identical_image_is_no_event() {
        let mut image = Image::none();
        assert!(image.renew(&[0; 7]));
        assert!(!image.renew(&[0; 7]));
        assert!(image.renew(&[0, 0, 0, 0, 0, 0, 1]));
        assert!(image.renew(&[0; 7]));
    }
}
