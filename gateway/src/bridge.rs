//! Between the newest frame of a fieldbus and the cells of one axis.

use shm_schema::answer::Answer;
use shm_schema::command::{Command, CommandSource, Frame};

use crate::merge::{Protocol, merge};

/// Exchanges between writing a frame and its being processed: both channels have read the
/// cell by then, whatever their phases in the cycle.
pub const LEAD_EXCHANGES: u64 = 2;

/// Octets an F-parameter block may have; no PROFIsafe frame of ours has such a length.
const F_PARAMETERS: [usize; 4] = [10, 12, 14, 16];

/// What is carried to both channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Load {
    source: CommandSource,
    frame: Frame,
    length: u16,
}

/// The black channel of one axis.
#[derive(Debug, Clone)]
pub struct Bridge {
    protocol: Protocol,
    load: Load,
    number: u32,
    due: u64,
    parameters: Option<Load>,
    newest: Option<Load>,
    a: Side,
    b: Side,
}

/// What one channel has answered and nobody has sent yet.
#[derive(Debug, Clone, Default)]
struct Side {
    last: Option<u32>,
    waiting: Option<Answer>,
}

impl Side {
    fn take(&mut self, answer: Option<Answer>) {
        let Some(answer) = answer else { return };
        let is_news = self.last != Some(answer.number);
        // Before the first answer of a run the cell is empty: number 0.
        if is_news && answer.number > 0 {
            self.last = Some(answer.number);
            self.waiting = Some(answer);
        }
    }
}

impl Bridge {
    /// A bridge that has carried nothing.
    pub fn new(protocol: Protocol) -> Self {
        Self {
            protocol,
            load: Load { source: protocol.source(), frame: Frame::default(), length: 0 },
            number: 0,
            due: 0,
            parameters: None,
            newest: None,
            a: Side::default(),
            b: Side::default(),
        }
    }

    /// Takes a frame, or the F-parameter block of a PROFIsafe host (10, 12, 14 or 16 octets).
    /// Whether it was taken: one that is empty or longer than the cell (256 octets) is none. As on a bus, a
    /// frame that has not left yet gives way to a newer one, but never the block to a frame.
    pub fn received(&mut self, octets: &[u8]) -> bool {
        let mut frame = Frame::default();
        let place = frame.0.get_mut(..octets.len()).filter(|place| !place.is_empty());
        let Some(place) = place else { return false };
        place.copy_from_slice(octets);
        let is_block = self.protocol == Protocol::Profisafe && F_PARAMETERS.contains(&octets.len());
        let source = if is_block { CommandSource::ProfisafeParameters } else { self.protocol.source() };
        let load = Some(Load { source, frame, length: octets.len() as u16 });
        if is_block {
            // What waits belongs to the connection before.
            (self.parameters, self.newest) = (load, None);
        } else {
            self.newest = load;
        }
        true
    }

    /// The frame part of the next `command` cell; the non-safe levels are the caller's. `exchange`:
    /// sequence of the newest encoder sample. A frame stands until both channels had the cycle it is due
    /// in; only then the next one follows.
    pub fn command(&mut self, exchange: u64) -> Command {
        let free = (self.number == 0) | (exchange > self.due);
        if let Some(load) = free.then(|| self.parameters.take().or_else(|| self.newest.take())).flatten() {
            self.load = load;
            self.number = self.number.wrapping_add(1).max(1);
            self.due = exchange.saturating_add(LEAD_EXCHANGES);
        }
        Command {
            source: self.load.source,
            frame_number: self.number,
            frame_exchange: self.due,
            frame_length: self.load.length,
            frame: self.load.frame,
            ..Command::default()
        }
    }

    /// Takes what the `answer` cells show; the frame to send, when both channels have answered
    /// the same frame. Answers that do not belong together never leave.
    pub fn answers(&mut self, a: Option<Answer>, b: Option<Answer>) -> Option<Vec<u8>> {
        self.a.take(a);
        self.b.take(b);
        let (from_a, from_b) = (self.a.waiting?, self.b.waiting?);
        let same = (from_a.frame_number, from_a.digest) == (from_b.frame_number, from_b.digest);
        if !same {
            // The one that answered the older frame will not be met any more.
            let older = if from_a.frame_number < from_b.frame_number { &mut self.a } else { &mut self.b };
            older.waiting = None;
            return None;
        }
        (self.a.waiting, self.b.waiting) = (None, None);
        let octets = |answer: &Answer| answer.frame.0.get(..answer.length.into()).map(<[u8]>::to_vec);
        let merged = merge(self.protocol, &octets(&from_a)?, &octets(&from_b)?)?;
        (!merged.is_empty()).then_some(merged)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(number: u32, frame_number: u32, digest: u32, octet: u8) -> Answer {
        let mut frame = Frame::default();
        frame.0[..7].fill(octet);
        Answer { frame_number, digest, number, length: 7, frame }
    }

    #[test]
    fn a_frame_is_due_in_both_channels_two_exchanges_later() {
        let mut bridge = Bridge::new(Protocol::Fsoe);
        assert_eq!(bridge.command(100).frame_number, 0);
        assert!(bridge.received(&[1; 7]));
        let command = bridge.command(100);
        assert_eq!((command.frame_number, command.frame_exchange, command.frame_length), (1, 102, 7));
        assert_eq!(command.source, CommandSource::Fsoe);
        assert!(!bridge.received(&[0; 257]) & !bridge.received(&[]));
        assert_eq!(bridge.command(200), command, "what is no frame changes nothing");
    }

    #[test]
    fn a_frame_stands_until_both_channels_had_it_and_the_newest_follows() {
        let mut bridge = Bridge::new(Protocol::Fsoe);
        let carried = |bridge: &mut Bridge, exchange| bridge.command(exchange).frame.0[0];
        bridge.received(&[1; 7]);
        assert_eq!(carried(&mut bridge, 100), 1);
        bridge.received(&[2; 7]);
        bridge.received(&[3; 7]);
        assert_eq!([100, 101, 102].map(|exchange| carried(&mut bridge, exchange)), [1; 3]);
        assert_eq!(carried(&mut bridge, 103), 3);
        assert_eq!(bridge.command(104).frame_exchange, 105);
    }

    #[test]
    fn a_frame_leaves_once_when_both_have_answered_the_same_one() {
        let mut bridge = Bridge::new(Protocol::Fsoe);
        assert_eq!(bridge.answers(Some(answer(1, 1, 9, 0xA0)), None), None);
        let sent = bridge.answers(Some(answer(1, 1, 9, 0xA0)), Some(answer(1, 1, 9, 0xB0)));
        assert_eq!(sent.as_deref(), Some(&[0xA0, 0xA0, 0xA0, 0xB0, 0xB0, 0xA0, 0xA0][..]));
        assert_eq!(
            bridge.answers(Some(answer(1, 1, 9, 0xA0)), Some(answer(1, 1, 9, 0xB0))),
            None,
            "and not again"
        );
    }

    #[test]
    fn answers_to_different_frames_or_digests_never_leave() {
        let mut bridge = Bridge::new(Protocol::Fsoe);
        assert_eq!(bridge.answers(Some(answer(1, 1, 9, 1)), Some(answer(1, 1, 8, 2))), None);
        assert_eq!(bridge.answers(Some(answer(2, 2, 9, 1)), Some(answer(1, 1, 8, 2))), None);
        let sent = bridge.answers(Some(answer(2, 2, 9, 1)), Some(answer(2, 2, 9, 2)));
        assert!(sent.is_some(), "the next frame that both answer leaves");
    }

    #[test]
    fn a_block_of_f_parameters_is_known_by_its_length_and_goes_before_any_telegram() {
        let mut bridge = Bridge::new(Protocol::Profisafe);
        bridge.received(&[7; 8]);
        bridge.received(&[0; 10]);
        bridge.received(&[1; 8]);
        let block = bridge.command(1);
        assert_eq!((block.source, block.frame_length), (CommandSource::ProfisafeParameters, 10));
        let telegram = bridge.command(4);
        assert_eq!((telegram.source, telegram.frame.0[0]), (CommandSource::Profisafe, 1));
        assert_eq!(telegram.frame_number, 2);
    }
}
