//! Every cell of the slave matrix (black-channel.md 3.4), from outside: the state is reached
//! by right frames, then one frame is put in place of the next.

use sim::master::fsoe::{
    self, Config, State,
    code::{
        INVALID_ADDRESS, INVALID_APPLICATION_LENGTH, INVALID_APPLICATION_PARAMETER, INVALID_COMMAND,
        INVALID_COMMUNICATION_LENGTH, INVALID_COMMUNICATION_PARAMETER, INVALID_CONNECTION_ID, INVALID_CRC,
        LOCAL, UNKNOWN_COMMAND,
    },
    command::{CONNECTION, FAIL_SAFE_DATA, PARAMETER, PROCESS_DATA, RESET, SESSION},
    frame::{FRESH, Frame, reset},
};

use crate::device::{Device, Shape, Source};

/// A state of the slave, reached by `frames` right frames of a master with `size` octets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    name: &'static str,
    size: usize,
    frames: usize,
}

const fn place(name: &'static str, size: usize, frames: usize) -> Place {
    Place { name, size, frames }
}

const IN_RESET: Place = place("Reset", 2, 1);
const SESSION_OPEN: Place = place("Session, ids incomplete", 1, 2);
const SESSION_DONE: Place = place("Session, ids complete", 2, 2);
const CONNECTION_OPEN: Place = place("Connection, data incomplete", 2, 3);
const CONNECTION_DONE: Place = place("Connection, data complete", 2, 4);
const PARAMETER_OPEN: Place = place("Parameter, incomplete", 2, 6);
const PARAMETER_DONE: Place = place("Parameter, complete", 2, 7);
const DATA: Place = place("Data", 2, 8);
const EVERYWHERE: [Place; 8] = [
    IN_RESET,
    SESSION_OPEN,
    SESSION_DONE,
    CONNECTION_OPEN,
    CONNECTION_DONE,
    PARAMETER_OPEN,
    PARAMETER_DONE,
    DATA,
];

/// How the frame fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fit {
    /// Right id, right chain.
    Right,
    /// Right id, wrong check sum.
    BadSum,
    /// Another id, right chain.
    OtherId,
    /// Id 0, right chain.
    NoId,
    /// Another id and a wrong check sum.
    OtherIdBadSum,
    /// Id 0 and a wrong check sum.
    NoIdBadSum,
    /// Number 1, nothing inherited, id 0: the first frame of a session.
    Fresh,
}

use Fit::{BadSum, Fresh, NoId, NoIdBadSum, OtherId, OtherIdBadSum, Right};

/// What comes back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reply {
    /// R(code).
    Reset(u8),
    /// A frame of this command; the state machine goes on.
    Goes(u8),
}

use Reply::{Goes, Reset};

const R1: Reply = Reset(INVALID_COMMAND);
const R3: Reply = Reset(INVALID_CONNECTION_ID);
const R4: Reply = Reset(INVALID_CRC);

/// The cells in which more than the command counts, in the order of the matrix.
#[rustfmt::skip]
const CELLS: &[(Place, u8, Fit, Reply)] = &[
    // Reset: the sum of a Reset is not checked, that of a Session is.
    (IN_RESET, RESET, Right, Reset(LOCAL)),
    (IN_RESET, RESET, BadSum, Reset(LOCAL)),
    (IN_RESET, SESSION, Fresh, Goes(SESSION)),
    (IN_RESET, SESSION, BadSum, R4),
    (IN_RESET, CONNECTION, Right, R1),
    (IN_RESET, CONNECTION, NoIdBadSum, R1),
    (IN_RESET, PARAMETER, Right, R1),
    (IN_RESET, PROCESS_DATA, Right, R1),
    (IN_RESET, FAIL_SAFE_DATA, BadSum, R1),
    // Session.
    (SESSION_OPEN, SESSION, Right, Goes(SESSION)),
    (SESSION_OPEN, SESSION, Fresh, Goes(SESSION)),
    (SESSION_OPEN, SESSION, BadSum, R4),
    (SESSION_OPEN, CONNECTION, Right, R1),
    (SESSION_OPEN, CONNECTION, NoIdBadSum, R1),
    (SESSION_OPEN, PARAMETER, Right, R1),
    (SESSION_OPEN, PROCESS_DATA, Right, R1),
    (SESSION_OPEN, FAIL_SAFE_DATA, Right, R1),
    (SESSION_DONE, SESSION, Right, R1),
    (SESSION_DONE, SESSION, BadSum, R1),
    (SESSION_DONE, SESSION, Fresh, Goes(SESSION)),
    (SESSION_DONE, CONNECTION, Right, Goes(CONNECTION)),
    (SESSION_DONE, CONNECTION, NoId, R3),
    (SESSION_DONE, CONNECTION, NoIdBadSum, R3),
    (SESSION_DONE, CONNECTION, BadSum, R4),
    (SESSION_DONE, PARAMETER, Right, R1),
    (SESSION_DONE, PROCESS_DATA, Right, R1),
    (SESSION_DONE, FAIL_SAFE_DATA, BadSum, R1),
    // Connection.
    (CONNECTION_OPEN, SESSION, Fresh, Goes(SESSION)),
    (CONNECTION_OPEN, SESSION, Right, R1),
    (CONNECTION_OPEN, SESSION, BadSum, R1),
    (CONNECTION_OPEN, CONNECTION, Right, Goes(CONNECTION)),
    (CONNECTION_OPEN, CONNECTION, BadSum, R4),
    (CONNECTION_OPEN, PARAMETER, Right, R1),
    (CONNECTION_OPEN, PARAMETER, OtherIdBadSum, R1),
    (CONNECTION_OPEN, PROCESS_DATA, Right, R1),
    (CONNECTION_OPEN, FAIL_SAFE_DATA, Right, R1),
    (CONNECTION_DONE, SESSION, Fresh, Goes(SESSION)),
    (CONNECTION_DONE, SESSION, BadSum, R1),
    (CONNECTION_DONE, CONNECTION, Right, R1),
    (CONNECTION_DONE, CONNECTION, OtherIdBadSum, R1),
    (CONNECTION_DONE, PARAMETER, Right, Goes(PARAMETER)),
    (CONNECTION_DONE, PARAMETER, OtherId, R3),
    (CONNECTION_DONE, PARAMETER, NoId, R3),
    (CONNECTION_DONE, PARAMETER, OtherIdBadSum, R3),
    (CONNECTION_DONE, PARAMETER, BadSum, R4),
    (CONNECTION_DONE, PROCESS_DATA, Right, R1),
    (CONNECTION_DONE, FAIL_SAFE_DATA, OtherIdBadSum, R1),
    // Parameter.
    (PARAMETER_OPEN, SESSION, Fresh, Goes(SESSION)),
    (PARAMETER_OPEN, SESSION, BadSum, R1),
    (PARAMETER_OPEN, CONNECTION, Right, R1),
    (PARAMETER_OPEN, PARAMETER, Right, Goes(PARAMETER)),
    (PARAMETER_OPEN, PARAMETER, OtherId, R3),
    (PARAMETER_OPEN, PARAMETER, OtherIdBadSum, R3),
    (PARAMETER_OPEN, PARAMETER, BadSum, R4),
    (PARAMETER_OPEN, PROCESS_DATA, Right, R1),
    (PARAMETER_OPEN, FAIL_SAFE_DATA, OtherIdBadSum, R1),
    (PARAMETER_DONE, SESSION, Fresh, Goes(SESSION)),
    (PARAMETER_DONE, SESSION, BadSum, R1),
    (PARAMETER_DONE, CONNECTION, Right, R1),
    (PARAMETER_DONE, PARAMETER, Right, R1),
    (PARAMETER_DONE, PARAMETER, OtherIdBadSum, R1),
    (PARAMETER_DONE, PROCESS_DATA, Right, Goes(PROCESS_DATA)),
    (PARAMETER_DONE, PROCESS_DATA, OtherId, R3),
    (PARAMETER_DONE, PROCESS_DATA, OtherIdBadSum, R3),
    (PARAMETER_DONE, PROCESS_DATA, BadSum, R4),
    (PARAMETER_DONE, FAIL_SAFE_DATA, Right, Goes(PROCESS_DATA)),
    (PARAMETER_DONE, FAIL_SAFE_DATA, NoId, R3),
    (PARAMETER_DONE, FAIL_SAFE_DATA, BadSum, R4),
    // Data.
    (DATA, SESSION, Fresh, Goes(SESSION)),
    (DATA, SESSION, Right, R1),
    (DATA, SESSION, BadSum, R1),
    (DATA, CONNECTION, Right, R1),
    (DATA, CONNECTION, OtherIdBadSum, R1),
    (DATA, PARAMETER, Right, R1),
    (DATA, PARAMETER, OtherIdBadSum, R1),
    (DATA, PROCESS_DATA, Right, Goes(PROCESS_DATA)),
    (DATA, PROCESS_DATA, OtherId, R3),
    (DATA, PROCESS_DATA, NoIdBadSum, R3),
    (DATA, PROCESS_DATA, BadSum, R4),
    (DATA, FAIL_SAFE_DATA, Right, Goes(PROCESS_DATA)),
    (DATA, FAIL_SAFE_DATA, OtherIdBadSum, R3),
    (DATA, FAIL_SAFE_DATA, BadSum, R4),
];

/// A master and a device after so many frames.
fn at(place: Place, config: Config, source: Source) -> (fsoe::Master, Device) {
    let mut device =
        Device::new(&Shape::of_fsoe(&Config { parameter_payload: None, ..config.clone() }), source);
    let mut master = fsoe::Master::new(config);
    master.set_outputs(Some(&vec![0x77; place.size]));
    for _ in 0..place.frames {
        let answer = device.receive(master.to_send(), Some(&vec![0x88; place.size]), 0).expect("an answer");
        master.receive(&answer, 0);
    }
    (master, device)
}

fn config(size: usize) -> Config {
    Config::new(size, size, 3)
}

fn frame(master: &fsoe::Master, command: u8, fit: Fit) -> Vec<u8> {
    let size = master.config().outputs;
    let next = Frame::parse(master.to_send(), size).expect("its own frame");
    let data = if next.command == command { next.data } else { vec![0x11; size] };
    let own = if matches!(command, SESSION | RESET) { 0 } else { master.config().connection_id };
    let id = match fit {
        OtherId | OtherIdBadSum => own ^ 0x0F00,
        NoId | NoIdBadSum => 0,
        Right | BadSum | Fresh => own,
    };
    let mut octets = match (command, fit) {
        // Code 3, so that it differs from the Reset that began the connection.
        (RESET, _) => reset(3, size).octets(),
        (_, Fresh) => Frame::build(command, &data, 0, FRESH).octets(),
        _ => master.forge(command, &data, id),
    };
    if matches!(fit, BadSum | OtherIdBadSum | NoIdBadSum) {
        octets[size.min(2) + 1] ^= 0x40;
    }
    octets
}

fn reply(answer: Option<&[u8]>) -> Option<Reply> {
    match answer? {
        [RESET, code, ..] => Some(Reset(*code)),
        [command, ..] => Some(Goes(*command)),
        [] => None,
    }
}

/// Sends one frame at `place`; compares the reply, and asks for zeros where it is a refusal.
fn cell(place: Place, command: u8, fit: Fit, expected: Reply, source: Source) -> Option<String> {
    let (master, mut device) = at(place, config(place.size), source);
    let image = frame(&master, command, fit);
    let answer = device.receive(&image, Some(&vec![0x99; place.size]), 0);
    let got = reply(answer.as_deref());
    let safe = !matches!(expected, Reset(_)) || device.outputs().is_none();
    let whole = match expected {
        Reset(code) => answer == Some(reset(code, place.size).octets()),
        Goes(_) => true,
    };
    let right = got == Some(expected) && safe && whole;
    (!right).then(|| {
        let name = place.name;
        format!("{source:?} {name}: {command:02X} {fit:?}: expected {expected:?}, got {got:?}, safe {safe}")
    })
}

/// black-channel.md 3.4, first to sixth column, and the order of checks below it.
#[test]
fn each_cell_of_the_matrix_answers_as_written() {
    let each = Source::ALL.iter().flat_map(|source| CELLS.iter().map(move |row| (*source, row)));
    let wrong = each.filter_map(|(source, (place, command, fit, expected))| {
        cell(*place, *command, *fit, *expected, source)
    });
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// black-channel.md 3.4, column Reset: any code is acknowledged with 0, a wrong sum is not.
#[test]
fn a_reset_ends_every_state_and_a_corrupt_one_is_refused() {
    let after_reset = EVERYWHERE.iter().filter(|place| **place != IN_RESET);
    let wrong: Vec<String> = after_reset
        .flat_map(|place| Source::ALL.map(|source| (*place, source)))
        .flat_map(|(place, source)| {
            let right = cell(place, RESET, Right, Reset(LOCAL), source);
            [right, cell(place, RESET, BadSum, R4, source)]
        })
        .flatten()
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// black-channel.md 3.4, last column, for every value that is no command. An image whose
/// command is 0 is no frame yet in state Reset (3.2).
#[test]
fn an_unknown_command_is_refused_in_every_state_whatever_else_is_wrong() {
    let mut wrong = Vec::new();
    for (place, source) in EVERYWHERE.iter().flat_map(|place| Source::ALL.map(|source| (*place, source))) {
        let unknown = (0..=u8::MAX).filter(|octet| !fsoe::command::ALL.contains(octet));
        for command in unknown.filter(|octet| (place, *octet) != (IN_RESET, 0)) {
            for fit in [Right, OtherIdBadSum] {
                wrong.extend(cell(place, command, fit, Reset(UNKNOWN_COMMAND), source));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// black-channel.md 3.2: a bus that has just started shows no frame, an image like the last
/// is no event; neither is answered.
#[test]
fn nothing_is_said_to_an_image_that_is_no_event() {
    for source in Source::ALL {
        let mut device = Device::new(&Shape::of_fsoe(&config(2)), source);
        assert_eq!(device.receive(&[0; 7], None, 0), None);
        assert_eq!(device.receive(&[0, 1, 2, 3, 4, 5, 6], None, 0), None);
        for place in EVERYWHERE {
            let (master, mut device) = at(place, config(place.size), source);
            assert!(device.receive(master.to_send(), None, 0).is_some(), "{source:?} {}", place.name);
            assert_eq!(device.receive(master.to_send(), None, 1), None, "{source:?} {}", place.name);
        }
    }
}

/// black-channel.md 3.4: the address shows up at the first Parameter frame, before the sum.
#[test]
fn a_wrong_address_is_refused_with_the_first_parameter_frame() {
    for (source, bad_sum) in Source::ALL.iter().flat_map(|source| [false, true].map(|bad| (*source, bad))) {
        let mut device = Device::new(&Shape::of_fsoe(&config(2)), source);
        let mut master = fsoe::Master::new(Config { address: 4, ..config(2) });
        while master.state() != State::Parameter {
            let answer = device.receive(master.to_send(), None, 0).expect("an answer");
            master.receive(&answer, 0);
        }
        let image = frame(&master, PARAMETER, if bad_sum { BadSum } else { Right });
        let answer = device.receive(&image, None, 0);
        assert_eq!(reply(answer.as_deref()), Some(Reset(INVALID_ADDRESS)), "{source:?} {bad_sum}");
    }
}

/// black-channel.md 3.4: the id in the Connection data must be that of the field.
#[test]
fn an_id_in_the_data_other_than_in_the_field_is_refused_with_the_first_parameter_frame() {
    for source in Source::ALL {
        // Four octets: one Connection frame holds id and address.
        let (mut master, mut device) = at(place("Session, ids complete", 4, 2), config(4), source);
        let image = master.forge(CONNECTION, &[8, 0, 3, 0], 7);
        let answer = device.receive(&image, None, 0).expect("an echo");
        assert_eq!(reply(Some(&answer)), Some(Goes(CONNECTION)), "{source:?}");
        master.receive(&answer, 0);
        let parameters = Frame::build(PARAMETER, &[2, 0, 100, 0], 7, FRESH).octets();
        let answer = device.receive(&parameters, None, 0);
        assert_eq!(reply(answer.as_deref()), Some(R3), "{source:?}");
    }
}

/// black-channel.md 3.4: content before sum, in the order 8, 9, 10, 11; a length error that
/// changes the number of chunks is a wrong command instead.
#[test]
fn wrong_parameters_are_refused_with_the_first_data_frame() {
    let cases: [(&[u8], u8); 7] = [
        (&[3, 0, 100, 0, 2, 0, 0xAA, 0xBB], INVALID_COMMUNICATION_LENGTH),
        (&[3, 0, 0, 0, 9, 0, 0xAA, 0xBC], INVALID_COMMUNICATION_LENGTH),
        (&[2, 0, 0, 0, 9, 0, 0xAA, 0xBC], INVALID_COMMUNICATION_PARAMETER),
        (&[2, 0, 100, 0, 1, 0, 0xAA, 0xBC], INVALID_APPLICATION_LENGTH),
        (&[2, 0, 100, 0, 2, 0, 0xAA, 0xBC], INVALID_APPLICATION_PARAMETER),
        (&[2, 0, 100, 0, 0, 0], INVALID_COMMAND),
        (&[2, 0, 100, 0, 4, 0, 0xAA, 0xBB, 0, 0], INVALID_COMMAND),
    ];
    for (source, (payload, code)) in Source::ALL.iter().flat_map(|source| cases.map(|case| (*source, case))) {
        for fit in [Right, BadSum] {
            let config = Config {
                application_parameters: vec![0xAA, 0xBB],
                parameter_payload: Some(payload.to_vec()),
                ..config(2)
            };
            let (mut master, mut device) = at(CONNECTION_DONE, config, source);
            let mut last = None;
            while master.state() == State::Parameter {
                last = device.receive(master.to_send(), None, 0);
                master.receive(&last.clone().expect("an answer"), 0);
            }
            if master.state() == State::Data {
                last = device.receive(&frame(&master, PROCESS_DATA, fit), None, 0);
            }
            assert_eq!(reply(last.as_deref()), Some(Reset(code)), "{source:?} {payload:02X?} {fit:?}");
        }
    }
}
