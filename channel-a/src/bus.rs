//! The black channel of one axis at work: frames in at their exchange, control word and
//! answers out (design 9).

use shm_schema::answer::Answer;
use shm_schema::command::{Command, CommandSource, FRAME_MAX, Frame};
use shm_schema::exchange::Bus;
use shm_schema::profile::Profile;
use shm_schema::word::Word;

use crate::black_channel::{
    Answer as Sent, Config, DeviceFaultReport, FsoeConfig, ProfisafeConfig, ResetCode, Slave, State,
};
use crate::profile::Telegram;

/// Exchanges that a frame may lie ahead.
const AHEAD_MAX: u64 = 16;
/// Octets of the longest process data.
const DATA_MAX: usize = 40;
/// Octets of the status word of a [`ProcessData`].
const WORD_OCTETS: u8 = 32;

/// What is wrong with the communication.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusFault {
    /// No new frame within the watchdog time.
    Watchdog,
    /// A frame whose check sum is wrong (PROFIsafe).
    Integrity,
}

/// The safe inputs of one answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProcessData {
    octets: [u8; DATA_MAX],
    length: usize,
}

impl ProcessData {
    /// Status word, and position and speed where the telegram has them, low octet first.
    pub fn new(telegram: &Telegram, status: &Word, position: i64, speed_mrpm: i32) -> Self {
        let mut data = Self { octets: [0; DATA_MAX], length: 0 };
        (0..telegram.status.min(WORD_OCTETS)).for_each(|index| data.push(status.octet(index)));
        if telegram.values {
            // AMK-FSOE-12: 32 bits each; the position wraps, the unit of the speed is ours.
            (position as i32).to_le_bytes().into_iter().for_each(|octet| data.push(octet));
            speed_mrpm.to_le_bytes().into_iter().for_each(|octet| data.push(octet));
        }
        data
    }

    fn push(&mut self, octet: u8) {
        if let Some(place) = self.octets.get_mut(self.length) {
            *place = octet;
            self.length = self.length.saturating_add(1);
        }
    }

    fn octets(&self) -> &[u8] {
        self.octets.get(..self.length).unwrap_or(&[])
    }
}

/// What one step heard and says.
#[derive(Debug, Clone, Copy, Default)]
pub struct Heard {
    /// The safe outputs while they are process data of a running connection.
    pub word: Option<Word>,
    /// To publish.
    pub answer: Option<Answer>,
    /// What disturbs the communication.
    pub fault: Option<BusFault>,
}

/// The slave of one axis, and the frames it has seen.
#[derive(Debug, Clone)]
pub struct Field {
    bus: Bus,
    telegram: Telegram,
    slave: Option<Slave>,
    judged: u32,
    answers: u32,
}

impl Field {
    /// The slave that `bus` asks for; an F-Device waits for its parameters first.
    /// `sra`: the SRA CRC of the set.
    pub fn new(bus: Bus, telegram: Telegram, sra: u32) -> Self {
        let sent = sra.to_le_bytes();
        let slave = match bus {
            Bus::Fsoe { address, session_id, sra } => Slave::new(&Config::Fsoe(FsoeConfig {
                output_length: telegram.control,
                input_length: telegram.inputs(),
                address,
                session_id,
                application_parameters: if sra { &sent } else { &[] },
                watchdog_ms: (1, u16::MAX),
            }))
            .ok(),
            Bus::None | Bus::Profisafe { .. } => None,
        };
        Self { bus, telegram, slave, judged: 0, answers: 0 }
    }

    /// Commands come as frames, not as a plain word.
    pub const fn is_used(&self) -> bool {
        !matches!(self.bus, Bus::None)
    }

    /// FSoE session id, 0 without one.
    pub fn session_id(&self) -> u16 {
        self.slave.as_ref().map_or(0, Slave::session_id)
    }

    /// Digest of the last frame, 0 before the first.
    pub fn digest(&self) -> u32 {
        self.slave.as_ref().map_or(0, Slave::digest)
    }

    const fn speaks(&self, source: CommandSource) -> bool {
        match self.bus {
            Bus::None => false,
            Bus::Fsoe { .. } => matches!(source, CommandSource::Fsoe),
            Bus::Profisafe { .. } => {
                matches!(source, CommandSource::Profisafe | CommandSource::ProfisafeParameters)
            }
        }
    }

    /// One step with the newest command of any age. `data`: what to answer; `None`: the
    /// application is not enabled. `profile` decides how an F-Device shows its own fault.
    pub fn step(
        &mut self,
        command: Option<&Command>,
        data: Option<&ProcessData>,
        (exchange, now_ns): (u64, u64),
        profile: Profile,
    ) -> Heard {
        if !self.is_used() {
            return Heard::default();
        }
        let command = command.filter(|command| self.speaks(command.source));
        let fresh = command.filter(|command| self.is_due(command, exchange));
        let answer = match fresh {
            Some(command) => self.take(command, data, now_ns, profile),
            None => self.pass(now_ns),
        };
        let fault = self.fault(answer.is_some());
        // Another source is no command, whatever the connection still says.
        let word = command.and_then(|_| self.word());
        Heard { word, answer, fault }
    }

    /// A new frame whose exchange has come; one too far ahead is refused for good.
    fn is_due(&mut self, command: &Command, exchange: u64) -> bool {
        if (command.frame_number == 0) | (command.frame_number == self.judged) {
            return false;
        }
        let refused = command.frame_exchange.saturating_sub(exchange) > AHEAD_MAX;
        let due = command.frame_exchange <= exchange;
        if due | refused {
            self.judged = command.frame_number;
        }
        due
    }

    fn take(
        &mut self,
        command: &Command,
        data: Option<&ProcessData>,
        now_ns: u64,
        profile: Profile,
    ) -> Option<Answer> {
        let octets = command.frame.0.get(..usize::from(command.frame_length))?;
        if command.source == CommandSource::ProfisafeParameters {
            self.slave = self.device(octets, profile);
            return None;
        }
        let slave = self.slave.as_mut()?;
        // What fits no frame has changed nothing and answers nothing.
        let sent = slave.frame(octets, data.map(ProcessData::octets), now_ns).ok()?;
        Some(self.wrap(command.frame_number, sent.as_ref()))
    }

    /// A new F-parameter block starts the F-Device anew.
    fn device(&self, block: &[u8], profile: Profile) -> Option<Slave> {
        let Bus::Profisafe { address } = self.bus else { return None };
        // ATV-PSF-10: its Device_Fault bit is always 0.
        let silent = profile == Profile::Atv340;
        let device_fault = if silent { DeviceFaultReport::Silence } else { DeviceFaultReport::StatusBit };
        Slave::new(&Config::Profisafe(ProfisafeConfig {
            output_length: self.telegram.control,
            input_length: self.telegram.inputs(),
            address,
            f_parameters: block,
            ipar_crc: None,
            lowest_watchdog_ms: 1,
            device_fault,
        }))
        .ok()
    }

    fn pass(&mut self, now_ns: u64) -> Option<Answer> {
        let sent = self.slave.as_mut()?.advance(now_ns)?;
        Some(self.wrap(0, Some(&sent)))
    }

    /// Channel A carries command, data and connection id; the check sums are B's.
    fn wrap(&mut self, frame_number: u32, sent: Option<&Sent>) -> Answer {
        self.answers = self.answers.wrapping_add(1);
        let part = sent.map(Sent::data_part);
        let octets = part.as_ref().map_or(&[][..], Sent::octets);
        let mut frame = Frame([0; FRAME_MAX]);
        for (place, octet) in frame.0.iter_mut().zip(octets) {
            *place = *octet;
        }
        Answer {
            frame_number,
            digest: self.digest(),
            number: self.answers,
            length: octets.len() as u16,
            frame,
        }
    }

    fn fault(&self, answered: bool) -> Option<BusFault> {
        match self.slave.as_ref()? {
            Slave::Fsoe(slave) => {
                let expired = slave.last_reset() == Some(ResetCode::WatchdogExpired);
                let at_once = answered & (slave.state() == State::Reset);
                (expired & at_once).then_some(BusFault::Watchdog)
            }
            Slave::Profisafe(device) => device.communication_fault_code().map(|code| match code {
                0x4E => BusFault::Watchdog,
                _ => BusFault::Integrity,
            }),
        }
    }

    fn word(&self) -> Option<Word> {
        let slave = self.slave.as_ref().filter(|slave| slave.outputs_valid())?;
        let mut word = Word::ZERO;
        for (index, octet) in slave.outputs().iter().enumerate() {
            if let Some(part) = word.0.get_mut(index / 4) {
                *part |= u32::from(*octet).wrapping_shl(8 * (index as u32 & 3));
            }
        }
        Some(word)
    }
}
