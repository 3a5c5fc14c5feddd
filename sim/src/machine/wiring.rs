//! What is mounted at the encoder slots of an axis, from its parameters.

use params::AxisSet;
use shm_schema::encoder::SlotKind;
use shm_schema::profile::{Profile, common, lenze_key};

use crate::signals::SlotWiring;

const ALL: [bool; 4] = [true; 4];

/// Encoders, motor and sensors of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wiring {
    /// Slot 1, slot 2.
    pub slots: [SlotWiring; 2],
    /// Pole pairs of the motor (DEC-32).
    pub pole_pairs: u16,
    /// Input pairs something is connected to; the others are low.
    pub inputs: [bool; 4],
}

impl Wiring {
    /// The machine a parameter set describes.
    pub fn of(set: &AxisSet) -> Self {
        match set.profile {
            Profile::None => Self { slots: [SlotWiring::NONE; 2], pole_pairs: 1, inputs: ALL },
            Profile::AmkKw => amk(set),
            Profile::LenzeSm301 => lenze(set),
            Profile::Atv340 => atv(set),
            Profile::Etg61002 => common_slots(set),
        }
    }
}

/// KW-R07 carries one sine encoder and one resolver (AMK Prm4, Prm5; DEC-37).
fn amk(set: &AxisSet) -> Wiring {
    let sine = SlotWiring::new(SlotKind::SineCosine, set.value(6));
    Wiring { slots: [sine, SlotWiring::new(SlotKind::Resolver, 1)], pole_pairs: 1, inputs: ALL }
}

/// C15400 motor encoder, C15500 position encoder, C15030 sensors.
fn lenze(set: &AxisSet) -> Wiring {
    let code = |code| set.value(lenze_key(code, 0));
    let motor = match code(15_400) {
        2 => SlotWiring::new(SlotKind::Resolver, code(15_430)),
        1 => SlotWiring::new(SlotKind::SineCosine, code(15_420)),
        _ => SlotWiring::NONE,
    };
    let position = match code(15_500) {
        1 => SlotWiring::new(SlotKind::SineCosine, code(15_420)),
        2 => SlotWiring::new(SlotKind::Digital, 1),
        _ => SlotWiring::NONE,
    };
    // LNZ-IN-03: nothing may be connected to a deactivated input.
    let inputs = [1, 2, 3, 4].map(|input| set.value(lenze_key(15_030, input)) != 0);
    Wiring { slots: [motor, position], pole_pairs: 1, inputs }
}

/// SC02 pole pairs; the encoder of SC05 and SC06 as a sine encoder.
fn atv(set: &AxisSet) -> Wiring {
    let pole_pairs = u16::try_from(set.value(2)).unwrap_or(1).max(1);
    let sine = SlotWiring::new(SlotKind::SineCosine, set.value(6));
    Wiring { slots: [sine; 2], pole_pairs, inputs: ALL }
}

fn common_slots(set: &AxisSet) -> Wiring {
    let periods = set.value(common::PERIODS_PER_REVOLUTION);
    Wiring { slots: [SlotWiring::new(SlotKind::SineCosine, periods); 2], pole_pairs: 1, inputs: ALL }
}
