//! The `answer-a` and `answer-b` cells: what each channel would answer on the black
//! channel. A frame that leaves takes its data from A and its check sums from B.

use crate::cell::payload;
use crate::command::Frame;
use crate::layout;

layout! {
    /// One channel's answer to a black-channel frame.
    pub struct Answer {
        /// [`crate::command::Command::frame_number`] of the frame answered; 0: unsolicited.
        pub frame_number: u32,
        /// CRC-32 of the frame answered; an answer leaves only when A's and B's match.
        pub digest: u32,
        /// Grows by one with each answer.
        pub number: u32,
        /// Octets of `frame` in use; 0: no answer.
        pub length: u16,
        /// The answer.
        pub frame: Frame,
    }
}
payload!(Answer);
