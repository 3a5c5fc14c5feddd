//! Design 3.5: the guard believes no octet unchecked.

use shm_schema::cell::{Header, Kind, Payload, Writer, seal};
use shm_schema::exchange::{CellFault, Received};
use shm_schema::report::Report;

use crate::guard::{Guard, crc32, crc32c};

const CELL: usize = Report::CELL;

fn cell(change: fn(&mut Header)) -> [u8; CELL] {
    let mut header = Header {
        layout: Kind::ReportA.layout(),
        length: CELL as u16,
        kind: Kind::ReportA,
        writer: Writer::ChannelA,
        boot_nonce: 7,
        axis: 3,
        sequence: 5,
        timestamp_ns: 50,
        ..Header::default()
    };
    change(&mut header);
    let mut octets = [0; CELL];
    Report { exchange: 42, ..Report::default() }.write(&header, &mut octets);
    seal(&mut octets, crc32, crc32c);
    octets
}

fn check(octets: &[u8]) -> Received<Report> {
    Guard::new(Kind::ReportA, 3, 7).check(octets, crc32)
}

#[test]
fn the_check_sums_are_the_catalogued_ones() {
    assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    assert_eq!(crc32c(b"123456789"), 0xE306_9283);
}

#[test]
fn a_sound_cell_is_read() {
    let sampled = check(&cell(|_| ())).expect("sound");
    assert_eq!((sampled.sequence, sampled.payload.exchange), (5, 42));
}

#[test]
fn every_single_bit_that_flips_is_noticed() {
    let whole = cell(|_| ());
    // Octets 4 to 7 are the check sum of the other reader.
    for at in (0..4).chain(8..CELL) {
        for bit in 0..8 {
            let mut damaged = whole;
            damaged[at] ^= 1 << bit;
            assert!(check(&damaged).is_err(), "octet {at} bit {bit}");
        }
    }
}

#[test]
fn each_kind_of_stranger_is_named() {
    assert_eq!(check(&cell(|h| h.layout ^= 1)), Err(CellFault::Layout));
    assert_eq!(check(&cell(|h| h.length ^= 1)), Err(CellFault::Length));
    assert_eq!(check(&cell(|h| h.kind = Kind::ReportB)), Err(CellFault::Foreign));
    assert_eq!(check(&cell(|h| h.writer = Writer::ChannelB)), Err(CellFault::Foreign));
    assert_eq!(check(&cell(|h| h.axis = 4)), Err(CellFault::Foreign));
    assert_eq!(check(&cell(|h| h.boot_nonce = 8)), Err(CellFault::Nonce));
    assert_eq!(check(&cell(|h| h.sequence = 0)), Err(CellFault::Order));
    assert_eq!(check(&[0; CELL]), Err(CellFault::Missing));
    assert_eq!(check(&[0; CELL - 1]), Err(CellFault::Length));
}

#[test]
fn a_cell_from_the_past_is_out_of_order_and_the_same_again_is_not() {
    let mut guard = Guard::new(Kind::ReportA, 3, 7);
    assert!(guard.check::<Report>(&cell(|_| ()), crc32).is_ok());
    assert!(guard.check::<Report>(&cell(|_| ()), crc32).is_ok());
    assert_eq!(guard.check::<Report>(&cell(|h| h.sequence = 4), crc32), Err(CellFault::Order));
    assert_eq!(
        guard.check::<Report>(&cell(|h| (h.sequence, h.timestamp_ns) = (6, 49)), crc32),
        Err(CellFault::Order)
    );
}
