//! The `command` cell: what the safety master asks, and the drive's non-safe words.

use crate::cell::payload;
use crate::wire::{Sink, Source, Wire, digest};
use crate::word::Word;
use crate::{enumeration, layout};

/// Octets of the longest black-channel frame (FSoE, 126 octets of data).
pub const FRAME_MAX: usize = 256;

/// A black-channel frame, unparsed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame(pub [u8; FRAME_MAX]);

impl Default for Frame {
    fn default() -> Self {
        Self([0; FRAME_MAX])
    }
}

impl Wire for Frame {
    const LENGTH: usize = FRAME_MAX;
    const LAYOUT: u32 = digest(crate::wire::DIGEST_START, "Frame256");
    #[inline]
    fn put(&self, out: &mut Sink<'_>) {
        out.chunk(self.0);
    }
    #[inline]
    fn take(from: &mut Source<'_>) -> Option<Self> {
        from.chunk().map(Self)
    }
}

enumeration! {
    /// How the safe command travels.
    pub enum CommandSource {
        /// No command: every active-low function is requested (DEC-18).
        #[default]
        None = 0,
        /// `word` is the control word, unprotected: simulation and replay only; refused
        /// together with a GPIO inhibit backend.
        Plain = 1,
        /// `frame` is an FSoE frame.
        Fsoe = 2,
        /// `frame` is a PROFIsafe frame.
        Profisafe = 3,
        /// `frame` is the F-parameter block of the PROFIsafe host; a new one starts the
        /// F-Device anew.
        ProfisafeParameters = 4,
    }
}

layout! {
    /// The command of one axis.
    pub struct Command {
        /// How to read the rest.
        pub source: CommandSource,
        /// Non-safe command "clear error" of the drive controller (AMK-ACK-02), level.
        pub clear_error: bool,
        /// The drive's own "speed is zero", non-safe.
        pub drive_n0: bool,
        /// The drive's power stage is enabled (EF), non-safe.
        pub drive_enabled: bool,
        /// The profile's control word, for [`CommandSource::Plain`].
        pub word: Word,
        /// Grows by one with every new frame.
        pub frame_number: u32,
        /// Exchange in which both channels process the frame: at least two ahead when the
        /// gateway writes it, so that both see it in the same exchange.
        pub frame_exchange: u64,
        /// Octets of `frame` in use.
        pub frame_length: u16,
        /// The received frame, unchanged.
        pub frame: Frame,
    }
}

payload!(Command);
