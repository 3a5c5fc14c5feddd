//! The black channel through the monitor: frames in, control word and answers out.

use std::vec::Vec;

use super::bench::{Bench, codes};
use crate::black_channel::TestMaster;
use shm_schema::answer::Answer;
use shm_schema::command::{Command, CommandSource};
use shm_schema::exchange::{Bus, Setup, Start};
use shm_schema::profile::{Profile, common};
use shm_schema::report::{Report, Stop};

const CONN_ID: u16 = 7;
const WATCHDOG_MS: u16 = 100;
const ACK: u32 = 1 << 7;
const NEUTRAL: u32 = 0x7E7F;

fn hex(text: &str) -> Vec<u8> {
    let pairs = (0..text.len()).step_by(2);
    pairs.map(|place| u8::from_str_radix(&text[place..place + 2], 16).unwrap()).collect()
}

fn on_bus(profile: Profile, entries: &[(u32, i64)], bus: Bus) -> Bench {
    let setup = Setup { bus, ..Setup::new(1, 9, Start::Settled) };
    Bench::with(profile, entries, &setup)
}

fn octets(answer: &Answer) -> Vec<u8> {
    answer.frame.0[..usize::from(answer.length)].to_vec()
}

/// Command, data and connection id of a frame; its check sums are B's.
fn data_part(frame: &str) -> Vec<u8> {
    let mut frame = hex(frame);
    let end = frame.len() - 2;
    for place in (1..end).filter(|place| (place - 1) % 4 >= 2) {
        frame[place] = 0;
    }
    frame
}

/// black-channel.md 4.2, the handshake and the fail-safe variant: 8 out, 12 in, address 3.
const TRACE_A: [(&str, &str); 5] = [
    ("2A0000C42D0000B91400009C0200007F0F0000", "2A0000C42D0000B91400009C0200007F0F0000D62E000035230000"),
    ("4E1122B71F0000434E00006658000085550000", "4EBD9A0726000066C0000043D60000A0DB000009FA0000EAF70000"),
    ("6407004A1A030002B1000015310000F63C0700", "640700F56503001D0800000A880000E985000040A40000A3A90700"),
    ("52020027F7640032860000F2ED000011E00700", "520200CB3C6400FD4E00003D250000DE2800007709000094040700"),
    ("080000AEFE0000B0B2000095A4000076A90700", "080000F437000093DF0000B6C9000055C40000FCE500001FE80700"),
];

#[test]
fn a_recorded_handshake_is_answered_octet_for_octet_with_the_data_part() {
    // black-channel.md 4.2, design 9
    let words = [(common::CONTROL_WORD + 63, 0), (common::STATUS_WORD + 95, 0)];
    let mut bench =
        on_bus(Profile::Etg61002, &words, Bus::Fsoe { address: 3, session_id: 0x9ABD, sra: false });
    for (number, (frame, answer)) in TRACE_A.into_iter().enumerate() {
        // Without both reports of the exchange before the application is not enabled.
        bench.partner_alive = number < 4;
        bench.send(CommandSource::Fsoe, &hex(frame), 2);
        assert!(bench.step().answer.is_none());
        assert!(bench.step().answer.is_none(), "not before its exchange");
        let outputs = bench.step();
        let found = outputs.answer.unwrap_or_else(|| panic!("{number}"));
        assert_eq!(octets(&found), data_part(answer), "{number}");
        assert_eq!((found.frame_number, found.number), (number as u32 + 1, number as u32 + 1));
        let report = outputs.report;
        assert_eq!((found.digest, report.frame_digest), (crate::crc32(&hex(frame)), found.digest));
        // 0 before the first session: the answer to the master's Reset.
        assert_eq!(report.session_id, if number == 0 { 0 } else { 0x9ABD }, "{number}");
    }
}

/// An AMK axis with its master in state Data.
struct Amk {
    bench: Bench,
    master: TestMaster,
}

impl Amk {
    fn connected() -> Self {
        let bus = Bus::Fsoe { address: 3, session_id: 0x1000, sra: false };
        let mut amk = Self { bench: on_bus(Profile::AmkKw, &[(67, 3_000)], bus), master: TestMaster::new() };
        amk.connect();
        amk
    }

    fn connect(&mut self) {
        self.master = TestMaster::new();
        let reset = self.master.chained(0, 0x2A, &[0; 4]);
        self.bench.send(CommandSource::Fsoe, &reset, 0);
        self.bench.step();
        self.master = TestMaster::new();
        let [low, high] = WATCHDOG_MS.to_le_bytes();
        let frames = [
            (0, 0x4E, [0x11, 0x22, 0, 0]),
            (CONN_ID, 0x64, [7, 0, 3, 0]),
            (CONN_ID, 0x52, [2, 0, low, high]),
            (CONN_ID, 0x52, [0; 4]),
        ];
        for (conn_id, command, data) in frames {
            self.send(conn_id, command, &data);
        }
    }

    fn send(&mut self, conn_id: u16, command: u8, data: &[u8]) -> (Report, Vec<u8>) {
        let frame = self.master.chained(conn_id, command, data);
        self.bench.send(CommandSource::Fsoe, &frame, 0);
        let outputs = self.bench.step();
        let answer = octets(&outputs.answer.expect("each frame is answered"));
        // The other channel's check sums, from the same chain.
        let whole = self.master.seal(&answer);
        self.master.receive(&whole);
        (outputs.report, answer)
    }

    /// Process data with this control word; the report, and the safe inputs that came back.
    fn exchange(&mut self, word: u32) -> (Report, Vec<u8>) {
        let (report, answer) = self.send(CONN_ID, 0x36, &word.to_le_bytes());
        assert_eq!(answer[0], 0x36);
        let data = answer[1..answer.len() - 2].chunks(4).flat_map(|block| block[..2].to_vec()).collect();
        (report, data)
    }
}

#[test]
fn process_data_carry_status_position_and_speed_of_both_channels() {
    // AMK-FSOE-03, AMK-FSOE-12, DEC-25
    let mut amk = Amk::connected();
    amk.exchange(NEUTRAL | ACK);
    amk.exchange(NEUTRAL);
    amk.exchange(NEUTRAL | ACK);
    amk.bench.partner_changes = |report| {
        report.position += 7;
        report.speed_mrpm = -9_000;
    };
    (amk.bench.travel, amk.bench.position) = (false, -5);
    amk.exchange(NEUTRAL);
    let (before, _) = amk.exchange(NEUTRAL);
    let (_, data) = amk.exchange(NEUTRAL);
    let mut expected = before.status.0[0].to_le_bytes().to_vec();
    expected.extend((-5_i32).to_le_bytes());
    expected.extend((-9_000_i32).to_le_bytes());
    assert_eq!(data, expected);
}

#[test]
fn the_control_word_is_the_one_of_the_frame_and_an_acknowledge_needs_a_zero_first() {
    // DEC-16, DEC-18
    let mut amk = Amk::connected();
    let (report, _) = amk.exchange(NEUTRAL | ACK);
    assert_eq!((report.requested.0[0], report.acknowledgements), (0, 1));
    amk.bench.rpm = 3_001.0;
    amk.exchange(NEUTRAL | ACK);
    amk.bench.rpm = 0.0;
    assert!(amk.exchange(NEUTRAL | ACK).0.status.bit(7), "high since the connection began");
    assert!(amk.exchange(NEUTRAL).0.status.bit(7));
    assert!(!amk.exchange(NEUTRAL | ACK).0.status.bit(7));
    let (report, _) = amk.exchange(NEUTRAL & !1);
    assert_eq!(report.stop, Stop::Sto);
}

#[test]
fn an_expired_watchdog_answers_by_itself_and_requests_everything() {
    // black-channel.md 3.6, AMK-FSOE-06
    let mut amk = Amk::connected();
    let (report, _) = amk.exchange(NEUTRAL);
    assert_eq!(report.stop, Stop::None);
    let at = amk.bench.k;
    let report = amk.bench.until(at + u64::from(WATCHDOG_MS) - 2);
    assert_eq!(report.requested.0[0], 0, "the age of the cell is not judged");
    let outputs = amk.bench.step();
    let answer = outputs.answer.expect("unsolicited");
    assert_eq!((answer.frame_number, &octets(&answer)[..2]), (0, &[0x2A, 5][..]));
    assert_eq!((outputs.report.requested.0[0], outputs.report.stop), (NEUTRAL, Stop::Sto));
    assert_eq!(codes(&outputs.report), [(3606, 70, 6, 3)]);
    amk.connect();
    amk.exchange(NEUTRAL);
    let (report, _) = amk.exchange(NEUTRAL | ACK);
    assert_eq!((codes(&report).len(), report.stop), (0, Stop::None));
    assert_eq!(report.session_id, 0x1001);
}

#[test]
fn a_frame_counts_once_in_its_exchange_and_not_when_it_is_too_far_ahead() {
    let mut amk = Amk::connected();
    amk.exchange(NEUTRAL);
    assert!(amk.bench.step().answer.is_none(), "the same frame number");
    let frame = amk.master.chained(CONN_ID, 0x36, &NEUTRAL.to_le_bytes());
    amk.bench.send(CommandSource::Fsoe, &frame, 17);
    let at = amk.bench.k;
    while amk.bench.k < at + 40 {
        assert!(amk.bench.step().answer.is_none());
    }
}

#[test]
fn what_does_not_belong_to_the_bus_is_no_command() {
    // DEC-18
    let mut amk = Amk::connected();
    amk.exchange(NEUTRAL);
    for source in [CommandSource::Plain, CommandSource::Profisafe, CommandSource::None] {
        let mut amk = Amk::connected();
        assert_eq!(amk.exchange(NEUTRAL).0.stop, Stop::None);
        amk.bench.command.as_mut().unwrap().source = source;
        amk.bench.command.as_mut().unwrap().word.0[0] = NEUTRAL;
        assert_eq!(amk.bench.step().report.stop, Stop::Sto, "{source:?}");
    }
    let mut bench = Bench::amk(&[(67, 3_000)]);
    bench.until(5);
    bench.command = Some(Command { source: CommandSource::Fsoe, frame_number: 1, ..Command::default() });
    let outputs = bench.step();
    assert_eq!((outputs.report.stop, outputs.answer.is_none()), (Stop::Sto, true));
}

const F_PARAMETERS: &str = "08400001000700647022";

#[test]
fn an_f_device_waits_for_its_parameters_and_then_exchanges() {
    // black-channel.md 9.3, LNZ-BUS-05, LNZ-BUS-20
    let mut bench = on_bus(Profile::LenzeSm301, &[], Bus::Profisafe { address: 7 });
    bench.send(CommandSource::Profisafe, &hex("0000000034ACB4B2"), 0);
    let outputs = bench.step();
    assert!(outputs.answer.is_none_or(|answer| answer.length == 0));
    assert_eq!(outputs.report.stop, Stop::Sto);
    bench.send(CommandSource::ProfisafeParameters, &hex(F_PARAMETERS), 0);
    bench.step();
    let mut statuses = Vec::new();
    for host in ["0000000034ACB4B2", "11121314003B1029", "11121314207549F9"] {
        bench.send(CommandSource::Profisafe, &hex(host), 0);
        let outputs = bench.step();
        let answer = octets(&outputs.answer.unwrap());
        statuses.push((answer[4], outputs.report.requested.0[0] & 1));
        assert_eq!(answer[5..], [0; 3], "the check sum is B's");
    }
    // STO is active low, and bit 0 of octet 11 is 1: not requested.
    assert_eq!(statuses, [(0x70, 1), (0x00, 0), (0x20, 0)]);
    let outputs = bench.step();
    let status = outputs.report.status;
    bench.send(CommandSource::Profisafe, &hex("1112131400FC0823"), 0);
    let answer = octets(&bench.step().answer.unwrap());
    assert_eq!(answer[..4], status.0[0].to_le_bytes());
}

#[test]
fn a_disturbed_profisafe_frame_is_an_error_of_the_atv_until_it_is_reset() {
    // ATV-PSF-17
    let mut bench = on_bus(Profile::Atv340, &[], Bus::Profisafe { address: 7 });
    bench.send(CommandSource::ProfisafeParameters, &hex(F_PARAMETERS), 0);
    bench.step();
    bench.send(CommandSource::Profisafe, &hex("000034ACB4B2"), 0);
    assert_eq!(codes(&bench.step().report), [(0x147, 0, 0, 0)]);
}
