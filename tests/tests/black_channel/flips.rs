//! Every single bit of every frame, in every state: never taken for a right one.

use sim::master::{
    fsoe::{self, command::RESET},
    profisafe::{Host, status},
};

use crate::{
    bench::{fsoe_pair, profisafe_pair},
    device::{Device, Shape, Source},
};

/// Frames after which a handshake of any sampled size has long reached Data.
const FRAMES: usize = 18;

fn fsoe_after(frames: usize, outputs: usize, inputs: usize, source: Source) -> (fsoe::Master, Device) {
    let (mut master, shape) = fsoe_pair(outputs, inputs);
    let mut device = Device::new(&shape, source);
    for count in 0..frames {
        master.set_outputs(Some(&vec![count as u8 + 1; outputs]));
        let answer = device.receive(master.to_send(), Some(&vec![0x42; inputs]), 0).expect("an answer");
        master.receive(&answer, 0);
    }
    (master, device)
}

fn flipped(image: &[u8], bit: usize) -> Vec<u8> {
    let mut image = image.to_vec();
    image[bit / 8] ^= 1 << (bit % 8);
    image
}

/// black-channel.md 3.4. Only the sum of a Reset in state Reset is not checked: its answer
/// is a Reset too, and the state stays.
#[test]
fn a_flipped_bit_in_any_fsoe_frame_leads_to_reset() {
    for (outputs, inputs) in [(1, 1), (2, 2), (4, 12), (6, 2)] {
        for (source, frames) in
            Source::ALL.iter().flat_map(|source| (0..FRAMES).map(move |count| (*source, count)))
        {
            let bits = fsoe_after(frames, outputs, inputs, source).0.to_send().len() * 8;
            for bit in 0..bits {
                let (master, mut device) = fsoe_after(frames, outputs, inputs, source);
                let answer = device.receive(&flipped(master.to_send(), bit), None, 0).expect("an answer");
                let refused = frames == 0 || answer[1] != 0;
                let case = format!("{source:?} {outputs}/{inputs} frame {frames} bit {bit}: {answer:02X?}");
                assert!(answer[0] == RESET && refused, "{case}");
                assert_eq!(device.outputs(), None, "{case}");
            }
        }
    }
}

/// A host and a device after so many telegrams; telegram 8 is disturbed, so that restart and
/// operator acknowledgement lie in the run.
fn profisafe_after(telegrams: usize, source: Source) -> (Host, Device) {
    let (mut host, shape) = profisafe_pair(4, 4);
    let mut device = Device::new(&shape, source);
    for count in 0..telegrams {
        host.set_outputs(&[count as u8 + 1, 2, 3, 4]);
        let wanted = host.wants_acknowledge();
        host.set_acknowledge(wanted && count > 12);
        let image = if count == 8 { flipped(host.to_send(), 3) } else { host.to_send().to_vec() };
        let answer = device.receive(&image, Some(&[0x42; 4]), 0).expect("an answer");
        host.receive(&answer, 0);
    }
    (host, device)
}

/// black-channel.md 8.3, "CRC2 wrong", at the start, in operation, restart and return.
#[test]
fn a_flipped_bit_in_any_profisafe_telegram_passivates() {
    for (source, telegrams) in
        Source::ALL.iter().flat_map(|source| (0..20).map(move |count| (*source, count)))
    {
        for bit in 0..64 {
            let (host, mut device) = profisafe_after(telegrams, source);
            let answer = device.receive(&flipped(host.to_send(), bit), Some(&[0x42; 4]), 0);
            let case = format!("{source:?} telegram {telegrams} bit {bit}: {answer:02X?}");
            assert_eq!(device.outputs(), None, "{case}");
            let passive = status::CE_CRC | status::FV_ACTIVATED;
            let answer = answer.expect("an answer");
            assert_eq!((answer[4] & passive, &answer[..4]), (passive, &[0; 4][..]), "{case}");
        }
    }
}

/// The runs above do reach process data, before the disturbance and after the return.
#[test]
fn the_undisturbed_runs_reach_process_data() {
    for source in Source::ALL {
        assert!(fsoe_after(FRAMES, 1, 1, source).1.outputs().is_some());
        assert!(profisafe_after(8, source).1.outputs().is_some());
        assert!(profisafe_after(9, source).1.outputs().is_none());
        assert!(profisafe_after(19, source).1.outputs().is_some());
    }
}

/// DEC-34, black-channel.md 8.2: what is refused is refused by both channels alike.
#[test]
fn f_parameters_of_another_device_or_protocol_open_no_communication() {
    use sim::master::profisafe::{Config, Parameters};
    let good = Parameters::new(7, 100);
    let refused = [
        ("another destination", Parameters { destination: 8, ..good }),
        ("destination 0", Parameters { destination: 0, ..good }),
        ("destination FFFF", Parameters { destination: 0xFFFF, ..good }),
        ("source 0", Parameters { source: 0, ..good }),
        ("source FFFF", Parameters { source: 0xFFFF, ..good }),
        ("watchdog 0", Parameters { watchdog_ms: 0, ..good }),
        ("CRC2 of two octets, V1", Parameters { flag_1: 0x18, ..good }),
        ("CRC2 of four octets", Parameters { flag_1: 0x28, ..good }),
        ("expanded protocol", Parameters { flag_1: 0x48, ..good }),
        ("version V1", Parameters { flag_2: 0x00, ..good }),
        ("block with F_WD_Time_2", Parameters { flag_2: 0x50, ..good }),
    ];
    for (what, parameters) in refused {
        let config = Config { outputs: 4, inputs: 4, parameters };
        let Shape::Profisafe { outputs, inputs, f_parameters, .. } = Shape::of_profisafe(&config) else {
            unreachable!("it was made of PROFIsafe")
        };
        stays_shut(&Shape::Profisafe { outputs, inputs, address: 7, f_parameters }, config, what);
    }
    let block = good.block();
    for bit in 0..block.len() * 8 {
        let f_parameters = flipped(&block, bit);
        let shape = Shape::Profisafe { outputs: 4, inputs: 4, address: 7, f_parameters };
        stays_shut(&shape, Config { outputs: 4, inputs: 4, parameters: good }, &format!("bit {bit}"));
    }
}

/// Either there is no such slave, in both channels, or it says nothing.
fn stays_shut(shape: &Shape, config: sim::master::profisafe::Config, what: &str) {
    let (a, b) = Device::try_new(shape);
    assert_eq!(a.is_some(), b.is_some(), "{what}: A and B");
    if a.is_none() {
        return;
    }
    let mut device = Device::new(shape, Source::A);
    let mut host = Host::new(config);
    host.set_outputs(&[1, 2, 3, 4]);
    for cycle in 0..20 {
        let (a, b) = device.receive_both(host.to_send(), Some(&[1; 4]), cycle);
        assert_eq!((&a.outputs, &b.outputs), (&None, &None), "{what}");
        assert_eq!((&a.answer, &b.answer), (&Ok(None), &Ok(None)), "{what}");
    }
}
