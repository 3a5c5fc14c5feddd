//! The host against the vectors of black-channel.md section 9, without any device of ours.

use super::{Config, Host, Parameters, telegram::check_sum};

fn octets(hexadecimal: &str) -> Vec<u8> {
    let pairs = hexadecimal.as_bytes().chunks(2);
    pairs.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

/// Plays the device's answers; the host must send what is written before each.
fn plays(host: &mut Host, exchange: &[(&str, &str)]) {
    for (at, (from_host, from_device)) in exchange.iter().enumerate() {
        assert_eq!(host.to_send(), octets(from_host), "telegram {at}");
        host.receive(&octets(from_device), 0);
    }
}

/// black-channel.md 9.1.
#[test]
fn crc1_is_that_of_the_manuals() {
    let cdv = Parameters { flag_1: 0x04, flag_2: 0x48, ipar_crc: 3_489_011_925, ..Parameters::new(1, 125) };
    assert_eq!(cdv.crc1(), 9296);
    assert_eq!(Parameters { flag_1: 0x24, ..cdv }.crc1(), 35282);
    assert_eq!(Parameters { flag_1: 0x04, ..Parameters::new(1, 500) }.crc1(), 37411);
    assert_eq!(Parameters::new(7, 100).block(), octets("08400001000700647022"));
}

/// black-channel.md 9.2: captured from a robot controller.
#[test]
fn crc2_is_that_of_the_capture() {
    let start = octets("4101000400000000");
    let running = octets("414D000400000000");
    for (number, data, status, expected) in [
        (0, &start, 0x40, 0xBB_5F_B5),
        (1, &start, 0x20, 0x81_11_99),
        (2, &running, 0x00, 0xE1_8A_A8),
        (3, &running, 0x20, 0xB5_47_4A),
        (11, &running, 0x20, 0x4E_91_3F),
    ] {
        assert_eq!(check_sum(data, status, 0x22FF, number), expected, "number {number}");
    }
}

/// black-channel.md 9.3: start, a disturbed telegram after number 9, recovery.
#[test]
fn the_derived_exchange_is_what_the_host_sends() {
    let mut host = Host::new(Config { outputs: 4, inputs: 4, parameters: Parameters::new(7, 100) });
    host.set_outputs(&octets("11121314"));
    plays(
        &mut host,
        &[
            ("0000000034ACB4B2", "0000000070BC0020"),
            ("11121314003B1029", "A1A2A3A400DDF872"),
            ("11121314207549F9", "A1A2A3A42093A1A2"),
            ("1112131400FC0823", "A1A2A3A4001AE078"),
        ],
    );
    while host.number() < 10 {
        let status = host.control() & 0x20;
        let crc1 = Parameters::new(7, 100).crc1();
        let answer = super::telegram::Telegram::build(&octets("A1A2A3A4"), status, crc1, host.number());
        host.receive(&answer.octets(), 0);
    }
    plays(
        &mut host,
        &[
            ("11121314208E9F8C", "0000000014DE231D"),
            ("000000001446796D", "000000005056CDFF"),
            ("0000000032B5EDC6", "0000000030577A50"),
        ],
    );
    assert_eq!(host.to_send(), octets("0000000012FBB416"));
    assert_eq!(host.inputs(), None);
    // The vector leaves out how often the host asks before the operator comes.
    while host.to_send() != octets("0000000032D834ED") {
        assert!(host.number() < 100);
        let status = 0x10 | (host.control() & 0x20);
        let crc1 = Parameters::new(7, 100).crc1();
        let answer = super::telegram::Telegram::build(&[0; 4], status, crc1, host.number());
        host.receive(&answer.octets(), 0);
    }
    host.set_acknowledge(true);
    host.receive(&octets("00000000303AA37B"), 0);
    assert_eq!(host.to_send(), octets("11121314002100D2"));
    host.receive(&octets("A1A2A3A400C7E889"), 0);
    assert_eq!(host.inputs(), Some(&octets("A1A2A3A4")[..]));
}
