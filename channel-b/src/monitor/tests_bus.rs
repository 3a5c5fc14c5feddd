//! The black channel through whole steps: frames in, answers and functions out.

use shm_schema::answer::Answer;
use shm_schema::command::{Command, CommandSource};
use shm_schema::exchange::{Bus, CellFault, Inputs, Outputs, Setup, Start};
use shm_schema::facts::{amk_kw, lenze_sm301};
use shm_schema::profile::{Profile, common};
use shm_schema::word::Word;
use std::vec::Vec;

use crate::black_channel::frame_digest;
use crate::black_channel::fsoe::tests::master::Master;
use crate::black_channel::fsoe::tests::traces::{TRACE_A, octets};
use crate::black_channel::profisafe::tests::{BLOCK, telegram};
use crate::testing::{MS, NONCE, Rig, cell, codes, image, status};

const FSOE: Bus = Bus::Fsoe { address: 5, session_id: 0x0201, sra: false };
const PROFISAFE: Bus = Bus::Profisafe { address: 7 };
const NEUTRAL: [u8; 4] = [0x7F, 0x7E, 0, 0];

/// A rig whose command is what a gateway wrote last.
struct Wire {
    rig: Rig,
    command: Command,
    /// Answers of both monitors to the frame sent last.
    answers: [Option<Answer>; 2],
    last: Outputs,
}

impl Wire {
    fn new(profile: Profile, changes: &[(u32, i32)], bus: Bus) -> Self {
        let setup = Setup { bus, ..Setup::new(1, NONCE, Start::Settled) };
        let mut rig = Rig::with(&image(profile, changes), &setup, profile);
        let last = rig.step_with(|inputs| inputs.command = Err(CellFault::Missing));
        Self { rig, command: Command::default(), answers: [None; 2], last }
    }

    fn amk() -> Self {
        let changes = [(67, 3000), (2, 1_000_000), (3, 60_000), (64, 10)];
        Self::new(Profile::AmkKw, &changes, FSOE)
    }

    fn step(&mut self) -> Outputs {
        self.step_with(|_| ())
    }

    fn step_with(&mut self, change: impl Fn(&mut Inputs)) -> Outputs {
        let (command, cycle) = (self.command, self.rig.cycle);
        self.last = self.rig.step_with(|inputs| {
            // The gateway writes when a frame comes: the cell's age says nothing.
            inputs.command = cell(1, MS, command);
            if cycle % 3 == 0 {
                inputs.command = Err(CellFault::CheckSum);
            }
            change(inputs);
        });
        for (kept, outputs) in self.answers.iter_mut().zip(self.rig.last) {
            *kept = outputs.and_then(|outputs| outputs.answer).or(*kept);
        }
        self.last
    }

    /// Writes a frame for the exchange after the next and runs until it is processed.
    fn send(&mut self, source: CommandSource, frame: &[u8]) -> Vec<u8> {
        self.command.source = source;
        self.command.frame_number += 1;
        self.command.frame_exchange = self.rig.cycle + 1 + 2;
        self.command.frame_length = frame.len() as u16;
        self.command.frame.0[..frame.len()].copy_from_slice(frame);
        self.answers = [None; 2];
        for _ in 0..2 {
            assert_eq!(self.step().answer, None, "not before its exchange");
        }
        for _ in 0..2 {
            self.step();
        }
        let [Some(one), Some(other)] = self.answers else { return Vec::new() };
        assert!(one == other, "both answer alike");
        assert_eq!((one.frame_number, one.digest), (self.command.frame_number, frame_digest(frame)));
        one.frame.0[..usize::from(one.length)].to_vec()
    }

    fn fsoe(&mut self, frame: &[u8]) -> Vec<u8> {
        self.send(CommandSource::Fsoe, frame)
    }

    /// Hand-shake of the test master and a first frame with `data`.
    fn connect(&mut self, master: &mut Master, data: &[u8]) {
        let reset = master.reset(0);
        self.fsoe(&reset);
        for (command, piece) in master.handshake() {
            let frame = master.next(command, &piece);
            let answer = self.fsoe(&frame);
            assert_eq!(answer[0], command);
            master.accept(&answer);
        }
        self.exchange(master, data);
    }

    fn exchange(&mut self, master: &mut Master, data: &[u8]) -> Vec<u8> {
        let answer = self.fsoe(&master.next(0x36, data));
        master.accept(&answer);
        answer
    }
}

fn master() -> Master {
    let config = crate::black_channel::fsoe::Config {
        outputs: 4,
        inputs: 12,
        address: 5,
        session_id: 0,
        application_parameters: &[],
        watchdog_ms: (1, 65_535),
    };
    Master::new(&config)
}

/// AMK-FSOE-03, AMK-FSOE-09, AMK-FSOE-10, DEC-25.
#[test]
fn an_amk_axis_is_commanded_and_answers_by_fsoe() {
    let (mut wire, mut master) = (Wire::amk(), master());
    assert!(!wire.last.inhibit.permit, "no frame, no torque (DEC-18)");
    wire.rig.world.speed = -1_500_250;
    wire.rig.world.position = -70_000;
    wire.connect(&mut master, &NEUTRAL);
    wire.exchange(&mut master, &NEUTRAL);
    assert!(wire.last.inhibit.permit);
    let answer = wire.exchange(&mut master, &NEUTRAL);
    assert_eq!(answer[0], 0x36, "process data");
    let data: Vec<u8> = [1, 2, 5, 6, 9, 10, 13, 14, 17, 18, 21, 22].map(|place| answer[place]).to_vec();
    let wanted = [0xF000_0100_u32.to_le_bytes(), (-70_000_i32).to_le_bytes(), (-1_500_250_i32).to_le_bytes()];
    assert_eq!(data, wanted.concat());
    assert_eq!(wire.last.report.session_id, 0x0201);
    // One bit of the control word is one function.
    let sls = [0x7F, 0x7E & !0x10, 0, 0];
    wire.rig.world.speed = 0;
    wire.exchange(&mut master, &sls);
    assert!(wire.last.report.requested.bit(amk_kw::control::SLS1));
    wire.exchange(&mut master, &[0x7E, 0x7E, 0, 0]);
    assert!(!wire.last.inhibit.permit);
}

/// AMK-FSOE-06, AMKD-FSM-01, DEC-16: the watchdog is an error of its own, and an acknowledge
/// needs a 0 in the new connection.
#[test]
fn an_expired_fsoe_watchdog_is_sto_until_an_edge_in_a_new_connection() {
    let (mut wire, mut master) = (Wire::amk(), master());
    wire.connect(&mut master, &NEUTRAL);
    wire.exchange(&mut master, &NEUTRAL);
    assert!(wire.last.inhibit.permit);
    wire.answers = [None; 2];
    let off = (0..200).find(|_| !wire.step().inhibit.permit);
    // 100 ms after the frame was taken, two steps of which `exchange` has run.
    assert_eq!(off, Some(98));
    assert_eq!(codes(&wire.last), [[3606, 70, 6, 4]]);
    let unsolicited = wire.answers[1].expect("a Reset frame");
    assert_eq!((unsolicited.frame_number, unsolicited.frame.0[..2].to_vec()), (0, [0x2A, 5].to_vec()));
    let acknowledge = [0xFF, 0x7E, 0, 0];
    wire.connect(&mut master, &acknowledge);
    wire.exchange(&mut master, &acknowledge);
    assert_eq!(codes(&wire.last).len(), 1, "high from the beginning");
    wire.exchange(&mut master, &NEUTRAL);
    wire.exchange(&mut master, &acknowledge);
    assert!(codes(&wire.last).is_empty() & wire.last.inhibit.permit);
}

/// Black-channel 4.2, octet for octet: 8 octets out, 12 in, session 9ABD.
#[test]
fn a_recorded_hand_shake_is_answered_as_recorded() {
    let words = [(common::CONTROL_WORD + 63, 0x0701), (common::STATUS_WORD + 95, 0x0701)];
    let bus = Bus::Fsoe { address: 3, session_id: 0x9ABD, sra: false };
    let mut wire = Wire::new(Profile::Etg61002, &words, bus);
    for (frame, expected) in &TRACE_A[..4] {
        assert_eq!(wire.fsoe(&octets(frame)), octets(expected));
    }
}

/// Architecture: where a report is missing the application is not enabled.
#[test]
fn without_the_partners_report_the_answer_is_fail_safe() {
    let (mut wire, mut master) = (Wire::amk(), master());
    wire.connect(&mut master, &NEUTRAL);
    wire.command.frame_number += 1;
    let frame = master.next(0x36, &NEUTRAL);
    wire.command.frame_length = frame.len() as u16;
    wire.command.frame_exchange = wire.rig.cycle + 4;
    wire.command.frame.0[..frame.len()].copy_from_slice(&frame);
    wire.answers = [None; 2];
    for _ in 0..6 {
        wire.step_with(|inputs| inputs.partner = Err(CellFault::Missing));
    }
    let answer = wire.answers[1].expect("answered");
    assert_eq!(answer.frame.0[0], 0x08, "fail-safe data");
}

/// Architecture: a frame more than sixteen exchanges ahead is refused, once and for all.
#[test]
fn a_frame_too_far_ahead_is_refused_and_one_in_time_is_taken_once() {
    let (mut wire, mut master) = (Wire::amk(), master());
    let reset = master.reset(0);
    for (ahead, answers) in [(16, 1), (17, 0)] {
        let mut wire_of = |ahead: u64| {
            wire.command.source = CommandSource::Fsoe;
            wire.command.frame_number += 1;
            wire.command.frame_length = reset.len() as u16;
            wire.command.frame.0[..reset.len()].copy_from_slice(&reset);
            // An image identical to the last is no event.
            wire.command.frame.0[1] = ahead as u8;
            let see = wire.rig.cycle + 1 + u64::from(wire.rig.cycle.is_multiple_of(3));
            wire.command.frame_exchange = see + ahead;
            (0..40).filter(|_| wire.step().answer.is_some()).count()
        };
        assert_eq!(wire_of(ahead), answers, "{ahead}");
    }
}

/// Architecture: a plain word with a bus, a frame without one, and a source that changes.
#[test]
fn a_command_by_the_wrong_way_is_none() {
    let plain = Command {
        source: CommandSource::Plain,
        word: Word::from_u32(0x0000_7E7F),
        clear_error: true,
        ..Command::default()
    };
    let mut wire = Wire::amk();
    wire.command = plain;
    for _ in 0..5 {
        let outputs = wire.step();
        assert_eq!((outputs.inhibit.permit, outputs.report.acknowledgements), (false, 0));
    }
    let mut rig = Rig::new(Profile::AmkKw, &[(67, 3000)]);
    rig.step();
    assert!(rig.step().inhibit.permit);
    let framed = rig.step_with(|inputs| {
        if let Ok(cell) = &mut inputs.command {
            cell.payload.source = CommandSource::Fsoe;
        }
    });
    assert!(!framed.inhibit.permit);
}

fn lenze() -> Wire {
    let set = [(15_100 << 8, 1), (15_113 << 8, -1), (15_300 << 8 | 1, 1)];
    Wire::new(Profile::LenzeSm301, &set, PROFISAFE)
}

/// LNZ-BUS-13, LNZ-BUS-20, DEC-42: silent before the F-parameters, then commanded bit by bit.
#[test]
fn a_lenze_axis_is_commanded_by_profisafe_after_its_parameters() {
    let mut wire = lenze();
    let start = telegram(0, 0x34, &[]);
    assert!(wire.send(CommandSource::Profisafe, &start).is_empty());
    assert!(wire.send(CommandSource::ProfisafeParameters, &BLOCK).is_empty());
    let first = wire.send(CommandSource::Profisafe, &start);
    // Black-channel 9.3.
    assert_eq!(first, octets("0000000070BC0020"));
    let neutral = 0x0180_01FF_u32.to_le_bytes();
    wire.send(CommandSource::Profisafe, &telegram(1, 0, &neutral));
    wire.send(CommandSource::Profisafe, &telegram(2, 0x20, &neutral));
    assert!(wire.last.inhibit.permit, "{:?}", codes(&wire.last));
    let answer = wire.send(CommandSource::Profisafe, &telegram(3, 0, &neutral));
    let shown = status(&wire.last).to_le_bytes();
    assert_eq!(answer, telegram(3, 0, &shown));
    // LNZ-BUS-13: passivated after F_WD_Time, without an error.
    let off = (0..200).find(|_| !wire.step().inhibit.permit);
    assert_eq!(off, Some(98));
    assert_eq!(codes(&wire.last), [[35, 0, 0, 0]]);
    for _ in 0..3 {
        wire.step();
    }
    assert!(codes(&wire.last).is_empty());
    assert_eq!(status(&wire.last) >> lenze_sm301::status::ERROR_ACTIVE & 1, 0);
}

/// LNZ-BUS-17: refused parameters are a message without error status; nothing is answered.
#[test]
fn refused_f_parameters_are_named_and_nothing_is_answered() {
    let mut wire = lenze();
    let mut wrong = BLOCK;
    wrong[5] = 8;
    wire.send(CommandSource::ProfisafeParameters, &wrong);
    assert!(wire.send(CommandSource::Profisafe, &telegram(0, 0x34, &[])).is_empty());
    assert_eq!(codes(&wire.last), [[0x40, 0, 0, 0]]);
    assert!(!wire.last.inhibit.permit);
}

fn atv() -> (Wire, u32) {
    let mut wire = Wire::new(Profile::Atv340, &[(65, 0), (66, 0)], PROFISAFE);
    wire.send(CommandSource::ProfisafeParameters, &BLOCK);
    (wire, 0)
}

fn atv_telegram(number: u32, control: u8, data: [u8; 2]) -> Vec<u8> {
    use crate::black_channel::profisafe::tests::telegram_of;
    telegram_of(2, number, control, &data)
}

/// ATV-PSF-06, ATV-PSF-07, ATV-PSF-17: two octets, reserved bits and a lost host are errors.
#[test]
fn an_atv_axis_refuses_reserved_bits_and_names_a_lost_host() {
    let (mut wire, mut number) = atv();
    let mut next = |wire: &mut Wire, data: [u8; 2]| {
        let control = if number == 0 { 0x34 } else { 0x20 * u8::from(number % 2 == 0) };
        let answer = wire.send(CommandSource::Profisafe, &atv_telegram(number, control, data));
        number += 1;
        answer
    };
    next(&mut wire, [0, 0]);
    next(&mut wire, [1, 0]);
    let answer = next(&mut wire, [1, 0]);
    assert_eq!(answer.len(), 6);
    assert!(wire.last.inhibit.permit, "{:X?}", codes(&wire.last));
    next(&mut wire, [0x03, 0]);
    assert_eq!(codes(&wire.last), [[0x152, 0, 0, 0]]);
    next(&mut wire, [1, 0]);
    next(&mut wire, [0x81, 0]);
    assert!(codes(&wire.last).is_empty());
    let off = (0..200).find(|_| !wire.step().inhibit.permit);
    assert_eq!((off, codes(&wire.last)), (Some(98), Vec::from([[0x153, 0, 0, 0]])));
}
